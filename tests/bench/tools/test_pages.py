"""Pages of the devices: text as the docstrings have it, and the committed pages as the code has it."""

import re
from collections import Counter
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blysk.bench.tools.blocks import BLOCKS, SEED, Sample, row_of, sample_of
from blysk.bench.tools.pages import (
    DEVICES,
    SAMPLES,
    draw_errors,
    likeness,
    markdown,
    svg,
    write_pages,
)
from blysk.bench.tools.structure import Graph, Node
from blysk.sim.cli.main import main

FOLDER = Path(__file__).parents[3] / "docs" / "blocks"
# Whole pages that every run of the tests makes again, and error figures: what takes least time.
QUICK = ("dot_product", "gpq", "diffuse", "chord")
MEASURED_QUICKLY = (
    *QUICK,
    "difference_setup",
    "difference_accumulator",
    "renormaliser",
    "highlight_cosine",
    "specular",
    "power",
    "light",
    "intensity",
    "linear_interpolator",
    "chord_interpolator",
)


def committed(device):
    return (FOLDER / f"{device}.md").read_text(encoding="utf-8")


def error_cells(text):
    """Variants and error cells of a page."""
    _, _, rows = text.partition("| variant | model error |")
    lines = rows.partition("\n\n")[0].splitlines()[2:]
    return [tuple(cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:5]) for line in lines]


@cache
def measured(device):
    """Samples of a device's entries, as its page has them."""
    return [sample_of(block, SAMPLES, SEED) for block in DEVICES[device]]


@cache
def row_of_parts():
    """A line of whatever times and parts."""
    return row_of(DEVICES["dot_product"][0], None)


def rows_of(device):
    return [row_of(block, sample) for block, sample in zip(DEVICES[device], measured(device), strict=True)]


def texts(picture):
    """What is written in a drawing."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", picture)


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


def test_svg_keeps_what_is_written():
    figure = Figure(figsize=(2, 1))
    figure.subplots().set_yticks([0.001, 0.125])
    assert {"0.001", "0.125"} <= set(texts(svg(figure)))


def test_svg_is_the_same_drawing_with_classes():
    """Every element keeps its style, as its own or as that of its class."""
    figure = Figure(figsize=(2, 1))
    axes = figure.subplots()
    axes.plot([0, 1], color="#123456", linestyle="--")
    axes.plot([1, 0], color="#123456", linestyle="--")
    text = svg(figure)
    rules = dict(re.findall(r"^\.(\w+)\{([^}]*)\}$", text, flags=re.MULTILINE))
    used = re.findall(r' class="(\w+)"', text)
    assert set(used) == set(rules)
    assert all(used.count(name) > 1 for name in rules)
    assert sum("#123456" in rules[name] for name in used) + text.count(' style="fill: none; stroke-d') == 2


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


def test_documented_variant_is_drawn_beside_the_default():
    at = np.linspace(1, 9, 900)
    samples = [Sample(np.full(900, error), np.zeros(900), None, at) for error in (1e-3, 2e-3, 5e-2)]
    variants = ("one", "two", "two, as published")
    blocks = [replace(DEVICES["bisection"][0], variant=variant) for variant in variants]
    figure = draw_errors(blocks, samples)
    one, two = (axes for axes in figure.axes if axes.get_visible())
    assert (one.get_title(), two.get_title()) == ("one", "two")
    assert [line.get_label() for line in one.lines] == ["total"]
    lines = {line.get_label(): line.get_ydata() for line in two.lines}
    np.testing.assert_array_equal(lines["total"], np.full(90, 2e-3))
    np.testing.assert_array_equal(lines["total, as documented"], np.full(90, 5e-2))
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == list(lines)


def test_intervals_have_several_spans():
    at = np.repeat(np.arange(40.0), 100)
    figure = draw_errors(DEVICES["gpq"], [Sample(np.ones(4000), np.zeros(4000), None, at)])
    assert len(figure.axes[0].lines[0].get_xdata()) == 40 // 8


def test_decisions_are_drawn_as_shares():
    at = np.r_[np.zeros(10), np.ones(10)]
    exact = np.arange(20) % 2 == 0
    found = exact.copy()
    found[11:15:2] = True
    found[16] = False
    block = replace(DEVICES["bisection"][0], axis="angle")
    (axes,) = draw_errors([block], [Sample(found, exact, None, at)]).axes
    lines = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(lines["yes by mistake"], [0, 0.2])
    np.testing.assert_allclose(lines["no by mistake"], [0, 0.1])


def chain(*operations, width=18, suffix=""):
    """A port, registers with an operation each, and a port."""
    graph = Graph()
    nodes = [Node("register", symbol + suffix, f"{width}", Counter([symbol])) for symbol in operations]
    numbers = [graph.add(node) for node in (Node("input", "i"), *nodes, Node("output", "o"))]
    for source, target in pairwise(numbers):
        graph.connect(source, target, True)
    return graph


def test_structures_of_one_kind_share_a_drawing():
    first = likeness(chain("×", "+", "mux"))
    assert likeness(chain("×", "+", "mux", width=20, suffix="_0")) == first
    # Order counts, so does a choice in the place of data, and a product by a constant does not.
    assert likeness(chain("+", "×", "mux")) != first
    chosen = chain("×", "+", "mux")
    chosen.edges[0, 1] = False
    assert likeness(chosen) != first
    constant = chain("×", "+", "mux")
    constant.nodes[1].operations["×c"] += 1
    assert likeness(constant) == first


# The committed pages.


def test_every_measured_device_has_an_axis():
    for block in BLOCKS:
        assert bool(block.axis) == (block.measure is not None)
    for device, blocks in DEVICES.items():
        if blocks[0].measure and device not in ("pipeline", "arccos"):
            sample = sample_of(blocks[0], 1000)
            at = np.broadcast_to(sample.at, np.shape(sample.found))
            assert np.ptp(at) > 0


# Writing.


def test_same_bytes_each_time(tmp_path):
    written = []
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        # A picture of this page that it no longer has, and files that are not its own.
        for file in ("diffuse-structure-9.svg", "diffuse_2-structure.svg", "diffuse-own.svg"):
            (folder / file).touch()
        write_pages(folder, ["diffuse"], samples=1000)
        written.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert written[0] == written[1]
    assert set(written[0]) == {
        "README.md",
        "diffuse.md",
        "diffuse-structure.svg",
        "diffuse-timing.svg",
        "diffuse-errors.svg",
        "diffuse_2-structure.svg",
        "diffuse-own.svg",
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
