"""Pages of the units: text from docstrings and records, drawings of measurements."""

import re
from collections import Counter
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from blysk.bench.tools import pages
from blysk.bench.tools.blocks import ENTRIES, Entry, entries_shown, sample_of
from blysk.bench.tools.docstrings import markdown
from blysk.bench.tools.error_plot import draw_errors
from blysk.bench.tools.graph import Graph, Node, likeness
from blysk.bench.tools.pages import write_pages
from blysk.bench.tools.pages_folder import PROJECT
from blysk.bench.units.record import Record, Variant
from blysk.bench.units.registry import RECORDS
from blysk.bench.units.sample import Decisions, Sample
from blysk.sim.errors import InputError

# Docstrings.


def test_literals():
    assert markdown("``a*b`` and `Unit`, of :py:`In(x)`") == "`a*b` and `Unit`, of `In(x)`"
    assert markdown("``a +\n    b``") == "`a + b`"
    assert markdown("a * b < c, 3*18, *so* and **this**") == r"a * b \< c, 3\*18, *so* and **this**".replace(
        "a * b", r"a \* b"
    )


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
        *("Words:", "", "| word | format | why |", "| --- | --- | --- |"),
        *(r"| u | SQ(2, 17) | `\|x\|` up to 2 |", "| N, M | - |  |", "", "After."),
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
    In one of these cases:

    - not 1
      or 2;
    - a - b is 0.

Source: [T] 2.1."""
    assert markdown(text) == (
        "What.\n\n**Parameters**\n\n- `degree` (int): 1 or 2, not 3.\n- `a`, `b` (array): Both.\n\n"
        "**Raises**\n\n- `ValueError`: In one of these cases:\n  - not 1 or 2;\n  - a - b is 0.\n\n"
        "Source: [T] 2.1."
    )


# Drawings of errors.


def drawn(samples, names=("",), axis="angle"):
    """Visible panels of a drawing of errors, and its curves by name, a dictionary for each panel."""
    variants = {name: Variant(None, as_published="as published" in name) for name in names}
    record = Record("made_up", "", "", variants, None, {}, axis=axis)
    figure = draw_errors([Entry(record, name) for name in names], samples)
    panels = [axes for axes in figure.axes if axes.get_visible()]
    return figure, panels, [{line.get_label(): line for line in axes.lines} for axes in panels]


def test_error_plot_shows_the_largest_error():
    at = np.linspace(0, 1, 1000)
    exact = np.zeros(1000)
    found = np.where(at > 0.5, 1e-3, 1e-5)
    found[700] = 0.25
    _, _, (lines,) = drawn([Sample(found, exact, exact + 1e-5, at)])
    assert set(lines) == {"model", "arithmetic", "total"}
    total = lines["total"].get_ydata()
    assert np.nanmax(total) == 0.25
    assert np.count_nonzero(total == 0.25) == 1
    np.testing.assert_allclose(lines["model"].get_ydata(), 1e-5)
    # Results that two variants share are drawn once, under the common part of their names.
    _, panels, _ = drawn(
        [Sample(found, exact, None, at)] * 2, ("refitted, pipelined", "refitted, sequential")
    )
    assert [axes.get_title() for axes in panels] == ["refitted"]


def test_published_variant_is_drawn_beside_the_default():
    at = np.linspace(1, 9, 900)
    samples = [Sample(np.full(900, error), np.zeros(900), None, at) for error in (1e-3, 2e-3, 5e-2)]
    figure, panels, (one, two) = drawn(samples, ("one", "two", "two, as published"))
    assert [axes.get_title() for axes in panels] == ["one", "two"]
    assert list(one) == ["total"]
    np.testing.assert_array_equal(two["total"].get_ydata(), np.full(90, 2e-3))
    np.testing.assert_array_equal(two["total, as published"].get_ydata(), np.full(90, 5e-2))
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == list(two)


def test_intervals_have_several_spans():
    at = np.repeat(np.arange(40.0), 100)
    _, _, (lines,) = drawn([Sample(np.ones(4000), np.zeros(4000), None, at)])
    assert len(lines["total"].get_xdata()) == 40 // 8


def test_decisions_are_drawn_as_shares():
    at = np.r_[np.zeros(10), np.ones(10)]
    exact = np.arange(20) % 2 == 0
    found = exact.copy()
    found[11:15:2] = True
    found[16] = False
    _, _, (lines,) = drawn([Decisions.of(found, exact, at)])
    np.testing.assert_allclose(lines["yes by mistake"].get_ydata(), [0, 0.2])
    np.testing.assert_allclose(lines["no by mistake"].get_ydata(), [0, 0.1])


@pytest.mark.parametrize("unit", dict.fromkeys(entry.record.name for entry in ENTRIES))
def test_every_measured_unit_has_an_axis(unit):
    if unit != "pipeline":
        sample = sample_of(entries_shown(unit)[0], 1000)
        assert RECORDS[unit].axis
        assert np.ptp(np.broadcast_to(sample.at, np.shape(sample.found))) > 0


# Drawings of structures.


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
    # Order counts, and so does a choice in place of data. A product by a constant does not.
    assert likeness(chain("+", "×", "mux")) != first
    chosen = chain("×", "+", "mux")
    chosen.edges[0, 1] = False
    assert likeness(chosen) != first
    constant = chain("×", "+", "mux")
    constant.nodes[1].operations["×c"] += 1
    assert likeness(constant) == first


# Writing.


def test_a_page_has_all_of_its_record_and_the_same_bytes_each_time(tmp_path):
    written = []
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        # A picture that this page no longer has, and files that do not belong to the page.
        for file in ("diffuse-structure-9.svg", "diffuse_2-structure.svg", "diffuse-own.svg"):
            (folder / file).touch()
        write_pages(folder, ["diffuse"], samples=1000)
        written.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert written[0] == written[1]
    pictures = {f"diffuse-{kind}.svg" for kind in ("structure", "timing", "errors", "own")}
    assert set(written[0]) == {"README.md", "diffuse.md", "diffuse_2-structure.svg", *pictures}
    text, record = written[0]["diffuse.md"].decode(), RECORDS["diffuse"]
    for stimulus in record.stimuli.values():
        assert stimulus.covers in text
    assert all(reason in text for reason in (*record.waivers.values(), *record.still))
    assert all(
        f"[`{path}`]" in text for path in ("golden/lighting/diffuse.py", "bench/units/lighting/diffuse.py")
    )
    assert pages.test_command("diffuse") in text
    # Files of the project, wherever the pages are.
    links = {link.partition("#") for link in re.findall(r"\]\(([^):]+)\)", text)}
    targets = {((tmp_path / "one" / file).resolve(), anchor) for file, _, anchor in links}
    assert all(path.is_file() for path, _ in targets)
    assert (PROJECT / "docs/theory/models.md", "lighting") in targets
    assert (PROJECT / "hdl/lighting/diffuse.py", "") in targets
    index = written[0]["README.md"].decode()
    assert all(f"({unit}.md)" in index for unit in RECORDS)


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("unit", RECORDS)
def test_every_unit_has_a_page(unit, tmp_path, monkeypatch):
    """The page has the first variant and the last. Baselines and errors are measured for every variant."""
    shown = entries_shown(unit)
    monkeypatch.setattr(pages, "entries_shown", lambda _: shown[:1] + shown[1:][-1:])
    for name in ("_graph", "_structures"):
        # Data that pages of all variants have kept does not belong to this page.
        monkeypatch.setattr(pages, name, cache(getattr(pages, name).__wrapped__))
    write_pages(tmp_path, [unit], samples=1000)
    text = (tmp_path / f"{unit}.md").read_text(encoding="utf-8")
    drawings = re.findall(rf"\]\(({unit}-[^)]+)\)", text)
    assert f"{unit}-structure.svg" in drawings
    assert all((tmp_path / name).is_file() for name in drawings)


def test_the_folder_is_made_and_a_bad_one_is_one_line(tmp_path):
    """If the folder cannot be made, one line names it, and no file is left."""
    write_pages(tmp_path / "new" / "pages", [])
    assert (tmp_path / "new" / "pages" / "README.md").is_file()
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"pages: cannot be made .*; give another folder"):
        write_pages(tmp_path / "file" / "pages", [])


@pytest.mark.parametrize("name", ["README.md", "diffuse.md"])
def test_pages_of_somebody_else_stay(tmp_path, name):
    """A first page that blysk did not write, or a page of a unit in a folder without a first page."""
    (tmp_path / name).write_text("# Mine\n")
    with pytest.raises(InputError, match=f"{name}: would be replaced, and `blysk pages` did not write it"):
        write_pages(tmp_path, ["diffuse"], samples=1000)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {name: "# Mine\n"}
