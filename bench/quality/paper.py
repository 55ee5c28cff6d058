"""The paper: figures and tables from a report and from the guides, and its text as a PDF.

``python -m blysk.bench.quality.paper report/report.json`` measures what the report lacks, writes the data and
the drawings beside a copy of ``docs/paper/paper.typ``, and compiles the copy with Typst.
"""

import json
import math
import re
import shutil
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from blysk.bench.command import run
from blysk.sim.errors import InputError
from blysk.sim.output import atomic_writer, check_writable, write_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "cited",
    "data_of",
    "documents_table",
    "exponents_of",
    "lights_of",
    "methods_of",
    "paper",
    "reference_texts",
    "rivals_of",
]

PROJECT = Path(__file__).parents[2]
SOURCE = PROJECT / "docs" / "paper" / "paper.typ"
LIGHTS = 1, 2, 3, 4, 8
"""Numbers of lights in the table of multipliers."""
OF_LIGHTS = "quotient", "renormalise", "chord-local"
"""Methods in the table of multipliers."""
SHOWN = 1, 2, 3, 10, 30, 100, 300, 1000
"""Exponents in the drawing of errors and bounds."""
EXPONENT = 100
"""Exponent of the table of methods."""

_STAGES = (
    ("span\nv, d, e", 0),
    ("squares,\nlines", 5),
    ("sums\nm, w, l", 0),
    ("1/sqrt(q)\ntable, r²", 2),
    ("l r\nm r²", 2),
    ("lobe(s)\ntable", 1),
    ("colours", 6),
    ("rounding,\nsRGB", 0),
    ("pixel", 0),
)
"""Text and multipliers of each box in the drawing of the datapath, from left to right."""


def cited(text: str) -> list[str]:
    """Keys of references that a text of Typst cites by ``#cite("Key", ...)``, sorted, each once."""
    calls = re.findall(r'#cite\(((?:"\w+"(?:,\s*)?)+)\)', text)
    return sorted({key for call in calls for key in re.findall(r'"(\w+)"', call)}, key=str.lower)


def _typst(text: str) -> str:
    """Text of Markdown as Typst: emphasis and code stay, links become their words."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", " ".join(text.split())).replace("\\|", "|")
    parts = re.split(r"(`[^`]*`|\*[^*]+\*|https?://[^\s,]*[^\s,.])", text)
    for k, part in enumerate(parts):
        if k % 2 == 0:
            parts[k] = re.sub(r"([#$@<>\[\]_*=~])", r"\\\1", part)
        elif part[0] == "*":
            parts[k] = "_" + re.sub(r"([#$@<>\[\]_])", r"\\\1", part[1:-1]) + "_"
    return "".join(parts)


def reference_texts(keys: Sequence[str], page: str) -> Iterator[dict[str, str]]:
    """Entries of docs/theory/references.md.

    Parameters
    ----------
    keys : sequence of str
        Keys of the entries.
    page : str
        The page.

    Yields
    ------
    dict of str to str
        ``key``, and ``text`` in Typst.

    Raises
    ------
    ValueError
        If the page has no entry of a key.
    """
    entries = dict(re.findall(r"^### \[(\w+)\]\n\n(.*?)(?=\n\n|\Z)", page, re.MULTILINE | re.DOTALL))
    for key in keys:
        if key not in entries:
            raise ValueError(f"the paper cites {key}, and docs/theory/references.md has no entry of this key")
        yield {"key": key, "text": _typst(entries[key])}


def documents_table(page: str, first: str) -> dict[str, Any]:
    """A table of a page in Markdown, so that its figures stand in one place.

    Parameters
    ----------
    page : str
        The page.
    first : str
        Beginning of the table's first line.

    Returns
    -------
    dict
        ``header`` and ``rows``, lists of texts in Typst.

    Raises
    ------
    ValueError
        If the page has no such table.
    """
    _, found, rest = page.partition(f"\n{first}")
    if not found:
        raise ValueError(f"no table begins with {first!r}")
    lines = (found.strip() + rest).split("\n\n", 1)[0].splitlines()
    rows = [[_typst(cell.strip()) for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
    return {"header": rows[0], "rows": rows[2:]}


def columns(table: Mapping[str, Any], *numbers: int) -> dict[str, Any]:
    """Some columns of a table of `documents_table`, by their numbers from 0 on."""
    rows = [[row[k] for k in numbers] for row in (table["header"], *table["rows"])]
    return {"header": rows[0], "rows": rows[1:]}


def methods_of(points: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows of the table of methods: those of the report at exponent `EXPONENT` on the teapot.

    Parameters
    ----------
    points : sequence of dict
        Points of the report's first section.

    Returns
    -------
    list of dict
        ``method``, ``model``, ``error`` in LSB against exact normals with the same lobe, ``cycles`` a pixel,
        ``multipliers``; ``luts``, ``flip_flops`` and ``mhz``, ``None`` without a placement. The smallest
        error is first.

    Raises
    ------
    ValueError
        If a method was not measured.
    """
    # These imports take a second, and bad arguments are told without them.
    from blysk.bench import accuracy
    from blysk.bench.report.placed import placed
    from blysk.bench.tools.families import DEVICE

    store = placed(DEVICE)
    rows = []
    for point in points:
        settings = point["settings"]
        words = (settings["method"], settings["model"]) if "method" in settings else None
        shown = words in accuracy.DESIGNS and words[1] in ("blinn", "phong", "cosquad")
        if not shown or settings["exponent"] != EXPONENT or settings["source"] != "teapot":
            continue
        if "operand" in settings:
            continue
        parts = store.get(words, {})
        rows.append(
            {
                "method": words[0],
                "model": words[1],
                "error": point["errors"]["method_max_lsb"],
                "cycles": point["times"]["cycles_per_pixel"],
                "multipliers": point["hardware"]["multipliers"],
                "luts": parts.get("luts"),
                "flip_flops": parts.get("flip_flops"),
                "mhz": round(parts["fmax_median_mhz"]) if parts else None,
            }
        )
    if not {("quotient", "blinn"), ("renormalise", "blinn")} <= {
        (row["method"], row["model"]) for row in rows
    }:
        raise ValueError(f"quotient and renormalise with blinn at exponent {EXPONENT} are not in the report")
    return sorted(rows, key=lambda row: (row["error"], row["cycles"]))


def rivals_of(tables: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Rows of the table of rivals: those of the report's section `rivals`, errors at exponent `EXPONENT`.

    Parameters
    ----------
    tables : dict
        Tables of the section.

    Returns
    -------
    dict
        ``meshes``, and ``rows`` with ``method``, ``multipliers`` with one light and with the most lights,
        ``adders`` in bits, ``errors`` in LSB before rounding on each mesh. ``most`` is the number of lights.
    """
    parts, errors = tables["rivals-parts"]["rows"], tables["rivals-errors"]["rows"]
    most = max(row["lights"] for row in parts)
    found = {(row["method"], row["lights"]): row for row in parts}
    largest: dict[str, dict[str, float]] = {}
    for row in errors:
        if row["exponent"] == EXPONENT:
            largest.setdefault(row["method"], {})[row["mesh"]] = row["largest error before rounding, LSB"]
    meshes = list(next(iter(largest.values())))
    rows = [
        {
            "method": name,
            "multipliers": [found[name, count]["multipliers"] for count in (1, most)],
            "adders": found[name, 1]["adders, bits"],
            "errors": [largest[name][mesh] for mesh in meshes],
        }
        for name in largest
    ]
    return {"meshes": meshes, "most": most, "rows": rows}


def lights_of(methods: Sequence[str] = OF_LIGHTS, counts: Sequence[int] = LIGHTS) -> dict[str, Any]:
    """Multipliers of methods with the lobe `blinn` over the number of lights, counted in the netlist."""
    from blysk.sim.api.design import design

    rows = []
    for method in methods:
        costs = [design(method=method, model="blinn", lights=count).cost() for count in counts]
        multipliers = [cost.multipliers for cost in costs]
        rows.append({"method": method, "interval": costs[0].setup_interval, "multipliers": multipliers})
    return {"counts": list(counts), "rows": rows}


def exponents_of(triangles: int, width: int, height: int) -> dict[str, Any]:
    """Largest errors and bounds of `quotient` over the exponent, off the border of the light."""
    from blysk.bench import accuracy
    from blysk.golden.presets import preset
    from blysk.sim.meshes.teapot import teapot

    mesh, found = teapot(triangles), {}
    for model in ("blinn", "phong"):
        measured = accuracy.measure(mesh, preset("quotient", model), SHOWN, width, height)
        found[model] = [(figures.method_error.steady_lsb, figures.bound_lsb) for _, _, figures in measured]
    return {"triangles": len(mesh.faces), "size": f"{width}x{height}", **found}


def _write(figure: "Figure", path: Path) -> None:
    figure.savefig(path, metadata={"CreationDate": None})


def _draw_exponents(path: Path, found: Mapping[str, Any]) -> None:
    from blysk.bench.svg import panels

    figure, (axes,) = panels(3.4, 2.1)
    for model, color in (("blinn", "#0072b2"), ("phong", "#b0508a")):
        errors, bounds = np.array(found[model], dtype=float).T
        axes.plot(SHOWN, errors, "o-", color=color, markersize=3, linewidth=1, label=f"{model}: found")
        axes.plot(SHOWN, bounds, "--", color=color, linewidth=1, label=f"{model}: bound")
    axes.set(xscale="log", xlabel="exponent n", ylabel="error, LSB")
    axes.axhline(0.5, color="#999999", linewidth=0.8)
    axes.legend(fontsize=7, frameon=False)
    _write(figure, path)


def _draw_front(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    from blysk.bench.svg import panels

    figure, (axes,) = panels(3.4, 2.6)
    places = Counter()
    for row in rows:
        color = "#0072b2" if row["method"] == "quotient" else "#444444"
        place = row["cycles"], row["error"]
        axes.plot(*place, "o", color=color, markersize=3)
        near = tuple(round(math.log(value), 1) for value in place)
        text, shift = f"{row['method']}, {row['model']}", (4, 1 + 7 * places[near])
        axes.annotate(text, place, shift, textcoords="offset points", fontsize=5.5, color=color)
        places[near] += 1
    axes.set(xscale="log", yscale="log", xlabel="cycles a pixel", ylabel="largest error, LSB")
    axes.axhline(0.5, color="#999999", linewidth=0.8)
    axes.margins(x=0.3, y=0.1)
    _write(figure, path)


def _draw_pipeline(path: Path) -> None:
    from matplotlib.patches import FancyBboxPatch

    from blysk.bench.svg import panels

    figure, (axes,) = panels(7, 1.1)
    axes.set(xlim=(0, len(_STAGES)), ylim=(0, 1))
    axes.axis("off")
    for k, (text, multipliers) in enumerate(_STAGES):
        face = "#f9d9b8" if multipliers else "#eef1f4"
        box = FancyBboxPatch(
            (k + 0.1, 0.3), 0.74, 0.62, "round,pad=0.02", facecolor=face, edgecolor="#35506b"
        )
        axes.add_patch(box)
        axes.text(k + 0.47, 0.61, text, ha="center", va="center", fontsize=7)
        if multipliers:
            axes.text(k + 0.47, 0.1, str(multipliers), ha="center", va="center", fontsize=7)
        if k:
            arrow = {"arrowstyle": "->", "color": "#35506b"}
            axes.annotate("", (k + 0.1, 0.61), (k - 0.14, 0.61), arrowprops=arrow)
    _write(figure, path)


def data_of(report: Mapping[str, Any]) -> dict[str, Any]:
    """All figures of the paper except those that `paper` measures.

    Parameters
    ----------
    report : dict
        Content of a report's ``report.json``.

    Raises
    ------
    ValueError
        If the report or a page lacks something.
    """
    points = report["sections"]["points"]["figures"]["points"]
    methods = methods_of(points)
    named = {(row["method"], row["model"]): row for row in methods}
    settings = next(p["settings"] for p in points if p["settings"]["source"] == "teapot")
    citation = (PROJECT / "CITATION.cff").read_text(encoding="utf-8")
    pages = PROJECT / "docs"
    guide = {
        name: (pages / "guide" / f"{name}.md").read_text(encoding="utf-8")
        for name in ("accuracy", "checked", "fpga")
    }
    theory = {
        name: (pages / "theory" / f"{name}.md").read_text(encoding="utf-8")
        for name in ("geometry", "quotient", "references")
    }
    other, own = named["renormalise", "blinn"], named["quotient", "blinn"]
    return {
        "title": "Phong and Blinn shading without unit normals: an open datapath with bounded errors",
        "author": re.search(r"- name: (.*)", citation)[1],
        "version": report["versions"]["blysk"],
        "made": report["made"][:10],
        "tools": ", ".join(f"{name} {report['versions'][name]}" for name in ("Python", "amaranth", "numpy")),
        "design": own,
        "methods": methods,
        "renormalise_more": other["multipliers"] - own["multipliers"],
        "renormalise_cycles": other["cycles"],
        "scene": {
            "triangles": settings["triangles"],
            "size": f"{settings['width']}x{settings['height']}",
            "exponent": EXPONENT,
        },
        "rivals": rivals_of(report["sections"]["rivals"]["tables"]),
        "all_spans": documents_table(theory["quotient"], "| spans of up to |"),
        "found_spans": documents_table(theory["quotient"], "| | n = 1 | n = 10 |"),
        "geometry": documents_table(theory["geometry"], "| spans from | `blinn`, n = 10 |"),
        "colours": columns(documents_table(guide["fpga"], "| `--albedo` | device |"), 0, 1, 2, 3, 4, 6, 7),
        "judges": documents_table(guide["checked"], "| judged | against llvmpipe |"),
        "worst": documents_table(guide["accuracy"], "| method | model | largest error of a pixel |"),
        "references": list(reference_texts(cited(SOURCE.read_text(encoding="utf-8")), theory["references"])),
    }


def paper(
    report: Mapping[str, Any],
    folder: Path,
    exponents: Mapping[str, Any],
    lights: Mapping[str, Any],
) -> bytes:
    """The paper as a PDF. Its text, data and drawings stay in a folder.

    Parameters
    ----------
    report : dict
        Content of a report's ``report.json``.
    folder : Path
        Folder for the parts of the paper; it is made.
    exponents, lights : dict
        Results of `exponents_of` and `lights_of`.

    Raises
    ------
    ValueError
        If the report or a page lacks something.
    InputError
        If the extra ``paper`` is not installed.
    """
    try:
        import typst
    except ImportError:
        remedy = "install the extra paper, pip install -e '.[paper]'"
        raise InputError("typst", "the library that sets the paper is missing", remedy) from None
    data = data_of(report) | {"exponents": dict(exponents), "lights": dict(lights)}
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(SOURCE, folder / SOURCE.name)
    shutil.copy(PROJECT / "docs" / "teapot.png", folder / "teapot.png")
    write_json(folder / "data.json", data)
    _draw_exponents(folder / "exponents.pdf", exponents)
    _draw_front(folder / "front.pdf", data["methods"])
    _draw_pipeline(folder / "pipeline.pdf")
    return typst.compile(folder / SOURCE.name, ignore_system_fonts=True)


@click.command()
@click.argument("report", type=click.Path())
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("build/paper/paper.pdf"),
    show_default=True,
)
def _command(report: str, output: Path) -> None:
    """Make the paper from the report.json of a report that has the sections points and rivals."""
    try:
        read = json.loads(Path(report).read_text(encoding="utf-8"))
        data_of(read)
    except (OSError, ValueError, KeyError, TypeError) as error:
        reason = (
            str(error) if isinstance(error, ValueError) and "report" in str(error) else "is not such a report"
        )
        raise InputError(
            report, reason, "give the report.json of `blysk bench --only points --only rivals`"
        ) from None
    check_writable(output)
    size = data_of(read)["scene"]
    width, height = map(int, size["size"].split("x"))
    made = paper(read, output.parent, exponents_of(size["triangles"], width, height), lights_of())
    with atomic_writer(output) as path:
        path.write_bytes(made)
    click.echo(f"{'written':<12}{output}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the paper.

    Returns
    -------
    int
        0, or 2 for bad input.
    """
    return run(_command, "blysk.bench.quality.paper", arguments)


if __name__ == "__main__":
    sys.exit(main())
