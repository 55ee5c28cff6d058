"""Pages of the devices: text as the docstrings have it, and the committed pages as the code has it."""

import inspect
import re
from collections import Counter
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from bench.blocks import BLOCKS, Sample, row_of, sample_of
from bench.pages import (
    DEVICES,
    closing,
    draw_errors,
    index_page,
    markdown,
    opening,
    page,
    svg,
    write_pages,
)
from sim.cli import main

FOLDER = Path(__file__).parents[2] / "docs" / "blocks"
QUICK = ("dot_product", "gpq", "diffuse", "half_chord")


def committed(device):
    return (FOLDER / f"{device}.md").read_text(encoding="utf-8")


def without_errors(text):
    """A page without what random operands decide: the error columns, and what the last drawing says."""
    text = re.sub(r"## Errors\n.*?(?=\n## |\Z)", "", text, flags=re.DOTALL)
    before, head, rest = text.partition("| variant | model error |")
    rows, sign, after = rest.partition("\nMade by")
    lines = []
    for line in (head + rows).splitlines():
        cells = re.split(r"(?<!\\)\|", line)
        lines.append("|".join(cells[:2] + cells[5:]) if len(cells) > 5 else line)
    return before + "\n".join(lines) + sign + after.rstrip()


# Docstrings.


def test_literals():
    assert markdown("``a*b`` and `Unit`, of :py:`In(x)`") == "`a*b` and `Unit`, of `In(x)`"
    assert markdown("``a +\n    b``") == "`a + b`"
    assert markdown("a * b < c, 3*18, *so* and **this**") == r"a \* b \< c, 3\*18, *so* and **this**"


def test_table():
    text = """\
Words:

====== ========= ====
word   format    why
====== ========= ====
u      SQ(2, 17) ``|x|`` up
                 to 2
====== ========= ====
N, M   -
====== ========= ====

After."""
    assert markdown(text).splitlines() == [
        "Words:",
        "",
        "| word | format | why |",
        "| --- | --- | --- |",
        r"| u | SQ(2, 17) | `\|x\|` up to 2 |",
        "| N, M | - |  |",
        "",
        "After.",
    ]


def test_sections():
    text = """\
What.

Parameters
----------
degree : int
    1 or 2,
    not 3.
a, b : array
    Both.

Raises
------
ValueError
    If not.

Source: [T] 2.1."""
    assert markdown(text) == (
        "What.\n\n**Parameters**\n\n- `degree` (int): 1 or 2, not 3.\n- `a`, `b` (array): Both.\n\n"
        "**Raises**\n\n- `ValueError`: If not.\n\nSource: [T] 2.1."
    )


@pytest.mark.parametrize("device", DEVICES)
def test_no_word_of_a_docstring_is_lost(device):
    text = opening(device) + closing(device)

    def words(text):
        return Counter(re.findall(r"[A-Za-z0-9]+", re.sub(":py:", "", text)))

    names = re.findall(r"^(?:## Arithmetic: )`(golden\.\w+)\.(\w+)`$", text, flags=re.MULTILINE)
    names += re.findall(r"^`(hdl\.\w+)\.(\w+)`, source: ", text, flags=re.MULTILINE)
    assert len(names) == 2 or device == "light"
    documented = [inspect.getdoc(getattr(import_module(module), name)) for module, name in names]
    lost = sum(map(words, documented), Counter()) - words(text)
    assert not lost
    assert "====" not in text
    assert "----------" not in text.replace(" --- ", "")


# Pictures.


def test_svg_is_small_and_the_same_each_time():
    def drawn():
        figure = Figure(figsize=(2, 1))
        axes = figure.subplots()
        axes.plot(np.linspace(0, 1, 50), np.linspace(0, 1, 50) ** 2)
        return svg(figure)

    first = drawn()
    assert first == drawn()
    assert "<metadata" not in first
    assert not re.search(r"\d\.\d{2}", first.split("<g>", 1)[1])
    assert len(first) < 10_000


def test_error_plot_shows_the_largest_error():
    at = np.linspace(0, 1, 1000)
    exact = np.zeros(1000)
    found = np.where(at > 0.5, 1e-3, 1e-5)
    found[700] = 0.25
    block = DEVICES["bisection"][0]
    figure = draw_errors([block], [Sample(found, exact, exact + 1e-5, at)])
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    assert set(lines) == {"model", "arithmetic", "total"}
    assert np.nanmax(lines["total"]) == 0.25
    assert np.count_nonzero(lines["total"] == 0.25) == 1
    np.testing.assert_allclose(lines["model"], 1e-5)
    # An entry measured twice is drawn once.
    sample = Sample(found, exact, None, at)
    twice = draw_errors(DEVICES["arccos"][:2], [sample, sample])
    assert len([axes for axes in twice.axes if axes.get_visible()]) == 1
    assert twice.axes[0].get_title() == DEVICES["arccos"][0].variant.split(", ")[0]


# The committed pages.


@pytest.mark.parametrize("device", DEVICES)
def test_committed_text_is_up_to_date(device):
    text = committed(device)
    assert text.startswith(opening(device)), "run `make pages`"
    assert text.endswith(closing(device)), "run `make pages`"
    for block in DEVICES[device]:
        assert f"| {block.variant or '-'} |".replace("*", "\\*") in text


def test_committed_index_is_up_to_date():
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert text == index_page(), "run `make pages`"
    assert re.findall(r"\]\((\w+)\.md\)", text) == list(DEVICES)


@pytest.mark.parametrize("device", QUICK)
def test_committed_figures_are_up_to_date(device):
    rows = [row_of(block, None) for block in DEVICES[device]]
    assert without_errors(page(device, rows)) == without_errors(committed(device)), "run `make pages`"


def test_links_and_pictures():
    used = set()
    for path in FOLDER.glob("*.md"):
        for link in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
            target = (FOLDER / link).resolve()
            assert target.is_file(), f"{path.name}: {link}"
            used.add(target)
    files = set(FOLDER.iterdir())
    assert {path.resolve() for path in files} - used == {FOLDER / "README.md"}
    for device, blocks in DEVICES.items():
        text = committed(device)
        kinds = ["structure", "timing"]
        # An exact device has no errors to draw.
        kinds += ["errors"] if blocks[0].measure and "device is exact" not in text else []
        for kind in kinds:
            assert f"({device}-{kind}.svg)" in text
    pictures = [path for path in files if path.suffix == ".svg"]
    assert max(path.stat().st_size for path in pictures) < 80_000
    assert sum(path.stat().st_size for path in files) < 3_200_000


def test_every_measured_device_has_an_axis():
    for block in BLOCKS:
        assert bool(block.axis) == (block.measure is not None)
        if block.measure and block.device not in ("pipeline", "arccos"):
            sample = sample_of(block, 1000)
            at = np.broadcast_to(sample.at, np.shape(sample.found))
            assert np.ptp(at) > 0


@pytest.mark.long
@pytest.mark.parametrize("device", DEVICES)
def test_all_committed_figures_are_up_to_date(device):
    rows = [row_of(block, None) for block in DEVICES[device]]
    assert without_errors(page(device, rows)) == without_errors(committed(device)), "run `make pages`"


# Writing.


def test_same_bytes_each_time(tmp_path):
    written = []
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        write_pages(folder, ["diffuse"], samples=1000)
        written.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert written[0] == written[1]
    assert set(written[0]) == {
        "README.md",
        "diffuse.md",
        "diffuse-structure.svg",
        "diffuse-timing.svg",
        "diffuse-errors.svg",
    }


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["nowhere"], "blysk: nowhere/README.md: cannot be written, there is no folder nowhere; make"),
        (["file"], "blysk: file/README.md: cannot be written, file is no folder; choose"),
        ([".", "--device", "x"], "blysk: --device x: unknown device; use one of dot_product, "),
    ],
)
def test_bad_input_is_one_line(arguments, line, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    assert main(["pages", *arguments]) == 2
    output, errors = capsys.readouterr()
    assert output == ""
    assert errors.startswith(line)
    assert errors.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_help_has_an_example(capsys):
    assert main(["pages", "--help"]) == 0
    assert re.search(r"Example:\n +blysk pages ", capsys.readouterr().out)
