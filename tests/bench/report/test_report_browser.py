"""The report's page as a reader uses it: in a browser, from disk, without a network."""

import json
import re

import numpy as np
import pytest

from blysk.bench.report.page import shown
from blysk.bench.report.report import about, write_report

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

pytestmark = pytest.mark.long

WIDTHS = {"desktop": (1280, 800), "phone": (375, 740)}


@pytest.fixture(scope="module")
def report(tmp_path_factory, points_section, plain_section):
    folder = tmp_path_factory.mktemp("pages") / "report"
    write_report(folder, [points_section, plain_section], about(True, [], ["points", "plain"]))
    return folder


@pytest.fixture(scope="module")
def figures(report):
    return json.loads((report / "report.json").read_text())["sections"]["points"]["figures"]


@pytest.fixture
def open_page(watching, report):
    """Open the page. Afterwards there may be no error, and no request but for the page."""
    pages = []
    with watching() as (new_page, errors, requests):

        def open_page(width="desktop", folder=report, unfold=True, **options):
            page = new_page(WIDTHS[width], 10, **options)
            pages.append((folder / "index.html").as_uri())
            page.goto(pages[-1])
            if options.get("java_script_enabled", True) and unfold:
                page.locator(".fold").evaluate_all("folds => folds.forEach(fold => (fold.open = true))")
                page.locator("#plot").scroll_into_view_if_needed()
            return page

        yield open_page
    assert errors == []
    assert [url for url in requests if not url.startswith("data:image/")] == pages


def drawn(figures, error, time, exponent=100):
    """Points that the drawing should have, by id."""
    return {
        point["id"]: point
        for point in figures["points"]
        if point["settings"]["exponent"] == exponent
        and point["errors"][error] is not None
        and point["times"][time] is not None
    }


def dots(page):
    """Positions of the drawn points in the window, by id."""
    script = """dots => Object.fromEntries(dots.map(dot => {
        const box = dot.querySelector('.ring').getBoundingClientRect();
        return [dot.dataset.point, [box.x + box.width / 2, box.y + box.height / 2]];
    }))"""
    return page.locator(".dot").evaluate_all(script)


def panel(page, key):
    return page.locator(f"#panel [data-key={key}]")


def test_a_point_opens_its_figures(open_page, figures):
    page = open_page()
    points = drawn(figures, "total_max_lsb", page.locator("#time-axis").input_value())
    places = dots(page)
    assert set(places) == set(points)
    # A point that stands apart.
    names = list(places)
    where = np.array([places[name] for name in names])
    apart = np.hypot(*(where[:, np.newaxis] - where).T) + 1e9 * np.eye(len(names))
    best = int(apart.min(axis=1).argmax())
    point = points[names[best]]
    page.mouse.move(*where[best])
    tip = page.locator("#tip").inner_text()
    assert tip.startswith(point["label"])
    page.mouse.click(*where[best])
    assert page.locator("#panel").is_visible()
    assert page.locator("#panel-title").inner_text() == f"{point['label']}, exponent 100"
    for axis in figures["errors"]:
        value = point["errors"][axis["key"]]
        assert float(panel(page, axis["key"]).get_attribute("title")) == value
        assert panel(page, axis["key"]).inner_text() == shown(value)
    cycles = page.locator("#panel-times td").first
    assert float(cycles.get_attribute("title")) == point["times"]["cycles_per_pixel"]
    times = page.locator("#panel-times td").all_inner_texts()
    assert times == [shown(point["times"][axis["key"]]) for axis in figures["times"]]
    counts = page.locator("#panel-hardware td").all_inner_texts()
    assert counts == [shown(value) for value in (*point["hardware"].values(), *point["counts"].values())]
    assert page.locator("#panel-command").inner_text() == point["command"]
    assert page.locator("#panel-settings").inner_text().count("\n") == len(point["settings"]) - 1
    images = page.locator("#panel-pictures img")
    assert images.count() == 3
    assert images.evaluate_all("images => images.every(image => image.naturalWidth === 16)")
    page.locator("#panel-copy").click()
    playwright.expect(page.locator("#panel-copy")).to_have_text(re.compile("Copied|Marked"))
    page.keyboard.press("Escape")
    assert not page.locator("#panel").is_visible()


def test_axes_and_front(open_page, figures):
    page = open_page()
    for error, time, exponent in [
        ("method_rmse_lsb", "golden_ns_per_pixel", 10),
        ("total_psnr_db", "simulated_pixels_per_second", 100),
        ("arithmetic_max_lsb", "cycles_per_pixel", 10),
        ("total_flip_p99", "cycles_per_pixel", 100),
    ]:
        page.locator("#error-axis").select_option(error)
        page.locator("#time-axis").select_option(time)
        page.locator("#exponent").select_option(str(exponent))
        points, places = drawn(figures, error, time, exponent), dots(page)
        assert set(places) == set(points)
        # Down and left is better, whatever the direction of the figures.
        axes = {axis["key"]: axis for axis in figures["errors"] + figures["times"]}
        ids = list(points)
        for kind, key, place in (("times", time, 0), ("errors", error, 1)):
            values = np.array([points[name][kind][key] for name in ids])
            order = np.argsort(values * (1 if axes[key]["better"] == "less" else -1), kind="stable")
            along = np.array([places[name][place] for name in ids])[order]
            assert (np.diff(along if place == 0 else -along) >= -0.01).all()
        front = {name for name in figures["fronts"][f"{error}|{time}"] if name in points}
        marked = page.locator(".dot:has(.halo)").evaluate_all("dots => dots.map(dot => dot.dataset.point)")
        assert set(marked) == front
        assert page.locator("#front li").count() == len(front)
        assert axes[time]["title"].lower() in page.locator("#meaning").inner_text().lower()
        count = page.locator("#count").inner_text()
        assert count.startswith(f"{len(points)} of 13 designs are drawn.")
        # If an error is 0, a logarithmic axis has a place for it.
        zero = any(point["errors"][error] == 0 for point in points.values())
        assert page.locator("#plot text", has_text=re.compile("^0$")).count() == zero


def test_groups(open_page, figures):
    page = open_page()
    page.locator("#groups input[value=baseline]").uncheck()
    points = drawn(figures, "total_max_lsb", page.locator("#time-axis").input_value())
    assert set(dots(page)) == {name for name, point in points.items() if point["group"] != "baseline"}
    rows = page.locator("#every-point tbody tr:visible")
    groups = set(rows.locator("td:nth-child(2)").all_inner_texts())
    assert groups == {point["group"] for point in figures["points"]} - {"baseline"}
    shown = page.locator(".shot:visible").count()
    assert shown == rows.count() == sum(point["group"] != "baseline" for point in figures["points"]) / 2


def test_keyboard(open_page, figures):
    page = open_page()
    places = dots(page)
    by_time = sorted(places, key=lambda name: places[name])
    focused = "() => document.activeElement.dataset.point"
    page.locator("#groups input").last.focus()
    page.keyboard.press("Tab")
    assert page.evaluate(focused) == by_time[0]
    assert page.locator("#tip").is_visible()
    page.keyboard.press("End")
    assert page.evaluate(focused) == by_time[-1]
    page.keyboard.press("ArrowLeft")
    assert page.evaluate(focused) == by_time[-2]
    page.keyboard.press("ArrowDown")
    lower = page.evaluate(focused)
    assert places[lower][1] >= places[by_time[-2]][1]
    page.keyboard.press("Enter")
    label = next(point["label"] for point in figures["points"] if point["id"] == lower)
    assert page.locator("#panel-title").inner_text() == f"{label}, exponent 100"
    page.keyboard.press("Escape")
    assert page.evaluate(focused) == lower
    # The drawing is one stop of the Tab key.
    page.keyboard.press("Tab")
    assert page.evaluate("() => document.activeElement.closest('#plot')") is None


def column(page, table, title):
    texts = page.locator(f"{table} thead th").all_inner_texts()
    place = [text.rstrip(" ↕↑↓") for text in texts].index(title) + 1
    heading = page.locator(f"{table} thead th:nth-child({place})")
    cells = page.locator(f"{table} tbody tr:visible td:nth-child({place})")
    return heading, cells


def test_table_of_points_sorts(open_page, figures):
    page = open_page()
    # The table has the columns of the drawing's axes.
    page.locator("#time-axis").select_option("cycles_per_pixel")
    heading, cells = column(page, "#part-points", "hardware, cycles, cycles a pixel")
    points = [point for point in figures["points"] if point["settings"]["exponent"] == 100]
    expected = sorted(p["times"]["cycles_per_pixel"] for p in points if p["times"]["cycles_per_pixel"])
    missing = len(points) - len(expected)
    assert missing > 0
    heading.get_by_role("button").click()
    assert heading.get_attribute("aria-sort") == "ascending"
    values = "cells => cells.map(cell => cell.dataset.value ?? null).map(text => text && Number(text))"
    assert cells.evaluate_all(values) == [*expected, *[None] * missing]
    heading.get_by_role("button").press("Enter")
    assert heading.get_attribute("aria-sort") == "descending"
    assert cells.evaluate_all(values) == [*expected[::-1], *[None] * missing]
    assert page.locator("#part-points th[aria-sort]").count() == 1
    # A row's name opens its point.
    first = page.locator("#part-points tbody tr:visible").first.locator("button").first
    name = first.inner_text()
    first.click()
    assert page.locator("#panel-title").inner_text() == f"{name}, exponent 100"


def test_table_of_points_has_all_columns(open_page, points_section):
    page = open_page()
    visible = page.locator("#part-points thead th:visible")
    assert visible.count() < 10
    page.get_by_label("all columns").check()
    assert visible.count() == len(points_section.parts[1].columns)


def test_other_tables_sort_and_filter(open_page):
    page = open_page()
    heading, cells = column(page, "#part-long", "<text>")
    heading.get_by_role("button").click()
    assert cells.all_inner_texts() == [f"</t{n}>" for n in range(30)]
    heading.get_by_role("button").click()
    assert cells.all_inner_texts() == [f"</t{n}>" for n in reversed(range(30))]
    page.locator("#part-long input[type=search]").fill("t2 t25")
    assert cells.all_inner_texts() == ["</t25>"]
    assert page.locator("#part-long .rows").inner_text() == "1 of 30 rows"


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_fits_its_window(open_page, width, scheme):
    page = open_page(width, color_scheme=scheme)

    def overflow():
        return page.evaluate(
            "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
        )

    assert overflow() <= 0
    page.get_by_label("all columns").check()
    assert overflow() <= 0
    page.locator("#front button").first.click()
    assert overflow() <= 0
    inside = page.locator("#panel").evaluate("panel => panel.scrollWidth <= panel.clientWidth")
    assert inside
    # Text and background differ enough to read.
    script = "name => getComputedStyle(document.documentElement).getPropertyValue(name)"
    dark = {name: brightness(page.evaluate(script, name)) for name in ("--paper", "--ink", "--soft")}
    assert abs(dark["--paper"] - dark["--ink"]) > 0.7
    assert abs(dark["--paper"] - dark["--soft"]) > 0.4
    assert (dark["--paper"] > 0.5) == (scheme == "light")


def brightness(color):
    return sum(int(color.strip()[k : k + 2], 16) for k in (1, 3, 5)) / 3 / 255


def test_touch(open_page, figures):
    page = open_page("phone", has_touch=True)
    place = next(iter(dots(page).values()))
    page.touchscreen.tap(*place)
    assert page.locator("#panel").is_visible()


def test_print(open_page):
    page = open_page()
    page.emulate_media(media="print", color_scheme="dark")
    for hidden in ("nav", ".tools", "dialog", ".skip"):
        assert page.locator(hidden).first.is_hidden()
    for whole in ("#part-long .scroll", "#part-points .scroll"):
        assert page.locator(whole).evaluate("box => box.scrollHeight <= box.clientHeight + 1")
    # Headings appear again on the next page, and buttons do not.
    display = "button => getComputedStyle(button).display"
    assert page.locator("#part-long th button").first.evaluate(display) == "contents"
    color = "() => getComputedStyle(document.body).backgroundColor"
    assert page.evaluate(color) == "rgb(255, 255, 255)"
    assert page.pdf(prefer_css_page_size=True).startswith(b"%PDF-")


def test_answers_first_and_the_rest_folded(open_page, points_section):
    page = open_page(unfold=False)
    answer = page.locator("#answer-points")
    assert answer.locator("strong").is_visible()
    assert answer.locator("img").evaluate("image => image.naturalWidth") > 0
    assert page.locator("#plot").is_hidden()
    assert page.locator("#section-plain h2").is_visible()
    # A link opens its target.
    answer.locator(".more a").click()
    page.locator("#plot .dot").first.wait_for()
    assert page.locator("#section-points .fold").get_attribute("open") is not None
    assert page.locator("#section-plain .fold").get_attribute("open") is None


def test_page_without_scripts(open_page, points_section):
    page = open_page(java_script_enabled=False)
    for name in ("points", "plain"):
        page.locator(f"#section-{name} summary").first.click()
    assert page.locator("#explorer").is_hidden()
    assert page.get_by_text("needs JavaScript").is_visible()
    assert page.locator("#part-points tbody tr").count() == len(points_section.parts[1].rows)
    assert page.locator("#part-points thead th").first.is_visible()
    assert page.locator(".shot img").first.is_visible()


def test_quick_report(open_page, quick_report):
    figures = json.loads((quick_report / "report.json").read_text())
    for width in WIDTHS:
        page = open_page(width, quick_report)
        script = "() => document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        assert page.evaluate(script)
        for axis in figures["sections"]["points"]["figures"]["times"]:
            page.locator("#time-axis").select_option(axis["key"])
            assert page.locator("#plot svg").is_visible()
        broken = "images => images.filter(image => image.complete && !image.naturalWidth).length"
        assert page.locator("img").evaluate_all(broken) == 0
        for name in figures["sections"]:
            assert page.locator(f"#section-{name} h2").is_visible()
