# amaranth: UnusedElaboratable=no
"""The live page from inside: words of the pipeline, steps, keyboard, windows, servers, missing parts."""

import base64
import dataclasses
import json
import re
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

from blysk.bench.web import web_data, web_meshes, web_spans
from blysk.golden.frame_constants import writes_of
from blysk.golden.frames.prepare import constants_of
from blysk.sim.engines.beats import pack, unpack
from blysk.sim.engines.engine import Drive
from blysk.sim.engines.probes import ObservedPipeline
from blysk.sim.engines.pysim import Interpreted
from blysk.sim.frames.frame import beats_of

from .live_page import (
    WIDTHS,
    by_model,
    change,
    digest,
    looked_at,
    picture_of,
    prepared,
    settle,
    state_of,
    use,
)

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytest.importorskip("ziglang", reason="ziglang is not installed")
pytestmark = pytest.mark.long


def traced(page, component):
    """Status of pysim in the cycles of the page's trace."""
    inside = page.evaluate(
        """() => {
            const {from, to, span, start, length, firstClock, lastClock, clock} = blysk.inside;
            return {from, to, span, start, length, firstClock, lastClock, clock};
        }"""
    )
    scene, _, frame = prepared(state_of(page))
    spans = frame.spans[inside["from"] : inside["to"]]
    none = np.zeros(1, dtype=bool)
    drive = Drive(
        input=pack(component.i.payload.shape(), beats_of(component.unit, spans)),
        write=pack(component.write.payload.shape(), writes_of(constants_of(scene, component.design))),
        constants=np.zeros((0, 0), dtype=np.uint32),
        input_stalls=none,
        output_stalls=none,
        count=int(spans.length.sum()),
        idle_timeout=1000,
        settle=64,
    )

    def status(clock):
        trace = Interpreted(component).run(dataclasses.replace(drive, limit=clock))
        return unpack(component.status.shape(), trace.status)[0]

    return inside, drive, status


WATCHED = {
    ("colored", "quotient", "blinn"): ("cosine", "albedo", "diffuse", "red_surface", "red", "r"),
    ("teapot", "quotient", "blinn"): ("cosine", "highlight", "diffuse", "specular", "r"),
    ("teapot", "quadratic", "cosquad"): (
        *("normal_0_sum", "normal_0_step", "cosine", "highlight"),
        *("gated", "base", "square", "r"),
    ),
}


@pytest.mark.parametrize("design", WATCHED, ids="-".join)
def test_waveform_is_that_of_pysim(open_page, design):
    page = open_page()
    mesh, *names = design
    change(page, "mesh", mesh)
    use(page, *names)
    x, y = looked_at(page)
    component = ObservedPipeline(web_data.design_of(*names, web_meshes.MESHES[mesh].albedo))
    inside, drive, status = traced(page, component)
    run = Interpreted(component).run(drive)
    own = slice(inside["start"], inside["start"] + inside["length"])
    assert inside["lastClock"] == run.cycles[own][-1]
    assert inside["firstClock"] == run.input_cycles[inside["span"] - inside["from"]]
    cells = "row => Object.fromEntries([...row.cells].slice(1).map(c => [c.dataset.clock, c.dataset.code]))"
    for clock in (inside["clock"], inside["clock"] + 2, inside["lastClock"]):
        row = status(clock)
        for name in WATCHED[design]:
            shown = page.locator(f"#wave tr[data-word={name}]").evaluate(cells)
            assert int(shown[str(clock)]) == int(row[name]), (clock, name)
    # The clicked pixel comes out with the colour of the picture.
    pixel = picture_of(page)[y, x]
    place = page.evaluate("([x, y]) => blysk.inside.spans.codes.x[blysk.inside.span]", [x, y])
    clock = int(run.cycles[own][x - place])
    for name, value in zip("rgb", pixel, strict=True):
        assert int(page.locator(f"#wave tr[data-word={name}]").evaluate(cells)[str(clock)]) == value
    assert int(page.locator("#wave tr[data-word=x]").evaluate(cells)[str(clock)]) == x


def test_exact_values_are_near(open_page):
    """In every cycle each word of a pixel equals its exact value, up to some steps."""
    page = open_page()
    designs = ("quotient", "blinn"), ("quotient", "phong"), ("quadratic", "cosquad"), ("renormalise", "exp")
    cases = [("teapot", *design) for design in (*designs, ("linear", "cosquad"))]
    for mesh, method, model in (*cases, ("colored", *designs[0]), ("textured", *designs[0])):
        change(page, "mesh", mesh)
        use(page, method, model)
        looked_at(page)
        script = """() => {
            const {inside} = blysk;
            const found = [];
            for (const probe of inside.design.probes)
                for (let clock = inside.firstClock; clock <= inside.lastClock; clock++) {
                    const word = blysk.wordAt(inside, probe, clock);
                    const {value, exact, pixel} = word;
                    if (exact !== null) found.push([probe.name, clock, pixel, value, exact]);
                }
            return found;
        }"""
        found = page.evaluate(script)
        names = {name for name, *_ in found}
        sums = {"quadratic": "normal_2_sum", "linear": "normal_2_sum"}.get(method, "cosine")
        lights = {"cosine", "diffuse", "specular"}
        lights |= {"highlight", "argument", "product"} if method != "quotient" else set()
        lights |= {"albedo", "red_surface"} if mesh != "teapot" else set()
        assert lights | {"red", "r", sums} <= names
        assert ("square" in names) == (model == "cosquad")
        assert max(row[4] for row in found if row[0] == "specular") > 0.5
        for name, clock, pixel, value, exact in found:
            # The effect of a step of a normal's component on a word, at the exponent of the page.
            limit = 1.0 if name in "rgb" else 0.3 if name.startswith("red") else 1e-4
            if name in ("product", "base", "square", "specular"):
                limit = 1e-3
            # Texels over 1/8 are rounded by up to 2^-12.
            if name == "albedo" and mesh == "textured":
                limit = 3e-4
            assert abs(value - exact) < limit, (method, model, name, clock, pixel, value, exact)
        page.locator("#again").click()
        settle(page)


def test_step_through_a_span(open_page):
    page = open_page()
    looked_at(page)
    shown = page.locator("#clock-text")
    start = page.evaluate("() => blysk.inside.clock")
    chips = page.locator("[data-stage=light] .track i.own")
    before = chips.evaluate_all(
        "dots => Object.fromEntries(dots.map(d => [d.textContent, parseFloat(d.style.left)]))"
    )
    assert before
    page.locator("#step").click()
    assert shown.inner_text().startswith(f"{start + 1} ")
    after = chips.evaluate_all(
        "dots => Object.fromEntries(dots.map(d => [d.textContent, parseFloat(d.style.left)]))"
    )
    moved = set(before) & set(after)
    assert moved
    assert all(after[name] > before[name] for name in moved)
    code = page.locator("#pipeline tr[data-word=cosine] td[data-code]")
    same = page.locator(f"#wave tr[data-word=cosine] td[data-clock='{start + 1}']")
    assert code.get_attribute("data-code") == same.get_attribute("data-code")
    assert page.locator("#wave td.now").count() == page.locator("#wave tbody tr").count()
    page.locator("#back").click()
    page.locator("#back").press("Enter")
    assert shown.inner_text().startswith(f"{start - 1} ")
    page.locator("#first").click()
    assert page.locator("#back").is_disabled()
    assert page.locator("[data-stage=setup] .track i.token").count() == 1
    page.locator("#wave").press("ArrowRight")
    first = page.evaluate("() => blysk.inside.firstClock")
    assert shown.inner_text().startswith(f"{first + 1} ")
    page.locator(f"#wave th button[data-clock='{first + 5}']").click()
    assert shown.inner_text().startswith(f"{first + 5} ")
    page.locator("#play").click()
    page.wait_for_function(f"() => blysk.inside.clock > {first + 6}")
    page.locator("#play").click()
    # Another light gives another frame, and the data inside is gone.
    change(page, "ambient", 0.2)
    assert page.locator("#inside").is_hidden()


def test_keyboard(open_page):
    page = open_page()
    before = state_of(page)["direction"]
    page.locator("#frame").focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowDown"):
        page.keyboard.press(key)
    settle(page)
    assert state_of(page)["direction"] != before
    assert digest(picture_of(page)) == digest(by_model(state_of(page)))
    page.keyboard.press("Enter")
    page.wait_for_selector("body[data-inside]")
    assert page.locator("#inside").is_visible()
    # The Tab key reaches all controls.
    page.locator("#frame").focus()
    reached = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("() => document.activeElement.id"))
    assert {"method", "model", "mesh", "exponent", "color", "orbit", "slow"} <= reached
    assert {"step", "clock", "wave"} <= reached


def test_empty_place(open_page):
    page = open_page()
    page.evaluate("() => blysk.look(2, 3)")
    assert "no surface at column 2, row 3" in page.locator("#inside-title").inner_text()
    page.evaluate("() => blysk.setClock(4)")


def test_opens_with_the_light_turning_unless_asked_not_to(open_page):
    page = open_page(reduced_motion="no-preference")
    count = page.evaluate("() => blysk.frames")
    page.wait_for_function(f"() => blysk.frames > {count + 3}")
    assert page.locator("#orbit").get_attribute("aria-pressed") == "true"
    assert open_page().locator("#orbit").get_attribute("aria-pressed") == "false"


def test_hardware_beside_hardware(open_page):
    """Right of the divider is the simulated frame of `linear`, with its own error.

    This site has `linear` with another model than that of the first frame.
    """
    page = open_page()
    exact = digest(picture_of(page, "golden"))
    page.locator("#compare").select_option("rival")
    page.wait_for_function("() => blysk.latest.rival")
    state = state_of(page)
    assert digest(picture_of(page)) == digest(by_model(state))
    rival = digest(by_model(state | {"method": "linear", "model": "cosquad"}))
    assert digest(picture_of(page, "golden")) == rival != exact
    assert re.fullmatch(r"linear: \d+(\.\d+)? LSB", page.locator("#other-text").inner_text())
    page.locator("#split").fill("20")
    stage = page.locator("#frame").bounding_box()
    line = page.locator("#divider").bounding_box()
    assert line["x"] + 1 == pytest.approx(stage["x"] + 0.2 * stage["width"], abs=1.5)


def test_light_goes_round(open_page):
    page = open_page()
    count = page.evaluate("() => blysk.frames")
    page.locator("#orbit").click()
    page.wait_for_function(f"() => blysk.frames > {count + 5}")
    assert page.locator("#orbit").get_attribute("aria-pressed") == "true"
    page.locator("#orbit").click()
    settle(page)
    assert digest(picture_of(page)) == digest(by_model(state_of(page)))


def test_page_stays_free_while_the_worker_simulates(open_page):
    """The browser keeps drawing during one long frame, with fifty times the spans."""
    page = open_page()
    assert len(page.workers) == 1
    _, _, frame = prepared(state_of(page))
    often = np.tile(np.arange(len(frame.spans)), 50)
    data = web_spans.encode(frame.spans[often], np.tile(frame.cut_raster.visible, 50))
    script = """async data => {
        const bytes = await blysk.core.unpacked(data);
        await blysk.ask('spans', {name: 'long', bytes});
        const settings = {...blysk.settingsNow(), spans: 'long'};
        const model = {kind: 'exp'};
        let [last, longest, drawn, busy] = [performance.now(), 0, 0, true];
        const draw = () => {
            const now = performance.now();
            [longest, last, drawn] = [Math.max(longest, now - last), now, drawn + 1];
            if (busy) requestAnimationFrame(draw);
        };
        requestAnimationFrame(draw);
        const {figures} = await blysk.ask('frame', {settings, model});
        busy = false;
        longest = Math.max(longest, performance.now() - last);
        return {longest, drawn, pixels: figures.pixels, job: figures.milliseconds};
    }"""
    found = page.evaluate(script, base64.b64encode(data).decode())
    assert found["pixels"] == 50 * len(frame.cut_raster.span)
    assert found["longest"] < found["job"] / 4, found
    assert found["drawn"] > 4


COARSE = """
    const told = performance.now.bind(performance);
    performance.now = () => Math.floor(told() / 100) * 100;
"""


def test_coarse_clock(open_page):
    """A browser that tells the time in steps of 100 ms, also in the worker."""
    in_worker = """
        const Plain = Blob;
        window.Blob = class extends Plain {
            constructor(parts, options) {
                super(options?.type === 'text/javascript' ? [coarse, ...parts] : parts, options);
            }
        };
    """
    page = open_page(script=f"{COARSE} const coarse = {json.dumps(COARSE)}; {in_worker}")
    seconds = []
    for step in range(40):
        change(page, "ambient", step / 100)
        seconds.append(page.evaluate("() => blysk.latest.figures.seconds"))
        texts = page.locator("#figures dd").all_inner_texts()
        assert not any("NaN" in text or "∞" in text or "Infinity" in text for text in texts)
        if not seconds[-1]:
            break
    assert not np.any(np.round(10 * np.array(seconds), 6) % 1)
    assert seconds[-1] == 0
    assert page.locator("[data-figure=speed]").inner_text() == "–"
    assert page.locator("#failure").is_hidden()
    page.locator("#orbit").click()
    count = page.evaluate("() => blysk.frames")
    page.wait_for_function(f"() => blysk.frames > {count + 30}")
    page.locator("#orbit").click()
    settle(page)
    rate = page.locator("[data-figure=rate]").inner_text()
    assert rate == "–" or 0 < float(rate) < 1000
    assert digest(picture_of(page)) == digest(by_model(state_of(page)))


def test_watch_it_being_shaded(open_page):
    page = open_page()
    whole = digest(picture_of(page))
    page.locator("#slow").click()
    page.wait_for_timeout(300)
    part = picture_of(page)
    assert digest(part) != whole
    page.locator("#slow").click()
    page.wait_for_timeout(50)
    assert digest(picture_of(page)) == whole


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_fits_its_window(open_page, width, scheme):
    page = open_page(width, color_scheme=scheme)
    looked_at(page)
    overflow = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert page.evaluate(overflow) <= 0
    for name in ("method", "exponent", "orbit", "step", "wave"):
        box = page.locator(f"#{name}").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= WIDTHS[width][0]
        assert name == "exponent" or box["height"] >= 24
    if width == "desktop":
        # When the page opens, its picture, divider and three controls are visible.
        page.locator("#close").click()
        page.evaluate("() => scrollTo(0, 0)")
        for name in ("frame", "split", "compare", "method", "exponent"):
            box = page.locator(f"#{name}").bounding_box()
            assert box["y"] + box["height"] <= WIDTHS[width][1], name
    background = page.evaluate("() => getComputedStyle(document.body).backgroundColor")
    dark = sum(map(int, background[4:-1].split(","))) < 3 * 128
    assert dark == (scheme == "dark")


def test_from_a_web_server(browser, live_site):
    """A static host, which sends files as they are."""

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *arguments):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=live_site)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        context = browser.new_context(reduced_motion="reduce")
        page = context.new_page()
        errors = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        page.wait_for_selector("body[data-frame]", timeout=30_000)
        image = picture_of(page)
        state = state_of(page)
        context.close()
        server.shutdown()
    assert errors == []
    assert digest(image) == digest(by_model(state))


def test_without_webassembly(open_page):
    page = open_page(script="delete window.WebAssembly", waits=False)
    assert page.locator("#failure").inner_text().startswith("This browser has no WebAssembly")
    assert page.locator("#view").is_hidden()
    assert page.get_by_text("To install it").is_visible()


def test_without_scripts(open_page):
    page = open_page(waits=False, java_script_enabled=False)
    assert page.get_by_text("The live view needs JavaScript and WebAssembly.").is_visible()


def test_missing_file_is_told(open_page, live_site):
    kept = live_site / "models" / "exp.js"
    text = kept.read_text()
    kept.unlink()
    try:
        page = open_page(waits=True)
        # The browser prints this on its console, too.
        open_page.allowed = "ERR_FILE_NOT_FOUND"
        page.locator("#method").select_option("renormalise")
        page.locator("#model").select_option("exp")
        page.wait_for_selector("#failure:not([hidden])")
        assert "models/exp.js is missing" in page.locator("#failure").inner_text()
    finally:
        kept.write_text(text)
