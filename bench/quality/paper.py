"""The paper: figures and tables from a report and from the guides, and its text as a PDF.

``python -m blysk.bench.quality.paper report/report.json`` measures what the report lacks, writes the data and
the drawings beside a copy of ``docs/paper/paper.typ``, and compiles the copy with Typst.
"""

import json
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from blysk.bench.command import run
from blysk.bench.quality.paper_pages import (
    checkers_of,
    cited,
    columns,
    documents_table,
    materials_of,
    reference_texts,
)
from blysk.sim.errors import InputError
from blysk.sim.output import atomic_writer, check_writable, write_json

__all__ = [
    "beside",
    "data_of",
    "exponents_of",
    "lights_of",
    "measured_of",
    "paper",
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

_ENGINES = {"cxxrtl": "the simulated RTL", "model": "the model of cycles or a simulation with another lobe"}
"""Words for the sources of cycles, by the engine of a point."""


def rivals_of(tables: Mapping[str, Mapping[str, Any]], exponent: int) -> dict[str, Any]:
    """Rows of the table of rivals: those of the report's section `rivals`.

    Parameters
    ----------
    tables : dict
        Tables of the section.
    exponent : int
        Exponent of the errors.

    Returns
    -------
    dict
        - ``meshes``, and ``most``: the largest number of lights;
        - ``rows``: ``method``; ``multipliers`` with one light and with the most lights; ``adders``: bits with
          one light; ``area``; ``netlist``: multipliers with one light, or ``None``; ``beat``: bits of a beat;
          ``host``: products, sums, and divisions with roots and powers, for a triangle and for a span; on
          each mesh ``errors`` in LSB before rounding, ``cycles`` a pixel, and ``switched`` bits a pixel or
          ``None``;
        - ``fronts``: for each mesh the methods with Blinn's highlight on the front of error against ``area``
          times cycles, of error against ``switched`` bits, and of error against look-up tables times time of
          ``placed`` designs.
    """
    from blysk.bench.report.rivals_fronts import front_of
    from blysk.golden.rivals.registry import COMPARED

    parts, errors = tables["rivals-parts"]["rows"], tables["rivals-errors"]["rows"]
    most = max(row["lights"] for row in parts)
    found = {(row["method"], row["lights"]): row for row in parts}
    hosts = {row["method"]: row for row in tables["rivals-host"]["rows"] if row["lights"] == 1}
    of_mesh: dict[str, dict[str, Mapping[str, Any]]] = {}
    for row in errors:
        if row["exponent"] == exponent:
            of_mesh.setdefault(row["method"], {})[row["mesh"]] = row
    meshes = list(next(iter(of_mesh.values())))
    rows = []
    for name, of in of_mesh.items():
        one = found[name, 1]
        rows.append(
            {
                "method": name,
                "multipliers": [found[name, count]["multipliers"] for count in (1, most)],
                "adders": one["adders, bits"],
                "area": one["area, bits of adders"],
                "netlist": one["multipliers of the netlist"],
                "beat": f"{one['bits a beat']} a {one['beat']}",
                "host": [_host(hosts[name], rate) for rate in ("triangle", "span")],
                "errors": [of[mesh]["largest error before rounding, LSB"] for mesh in meshes],
                "cycles": [of[mesh]["cycles a pixel"] for mesh in meshes],
                "switched": [of[mesh]["switched bits a pixel"] for mesh in meshes],
            }
        )
    same = [row for row in rows if COMPARED[row["method"]].REFLECTION.name == "blinn"]
    fronts: dict[str, list[list[str]]] = {"area": [], "switched": []}
    for k in range(len(meshes)):
        area = {row["method"]: (row["area"] * row["cycles"][k], row["errors"][k]) for row in same}
        counted = [row for row in same if row["switched"][k] is not None]
        fronts["area"].append(front_of(area))
        fronts["switched"].append(
            front_of({of["method"]: (of["switched"][k], of["errors"][k]) for of in counted})
        )
    by_tables = sorted(tables["rivals-placed"]["rows"], key=lambda row: row["tables times ns"])
    fronts["placed"] = [
        [of["method"] for of in by_tables if of["mesh"] == mesh and of["on the front of tables"]]
        for mesh in meshes
    ]
    return {"meshes": meshes, "most": most, "rows": rows, "fronts": fronts}


def _host(row: Mapping[str, Any], rate: str) -> list[int]:
    """Products, sums, and all other operations of the host, for a triangle or a span."""
    kinds = ("multiplications",), ("additions",), ("divisions", "roots", "functions")
    return [round(sum(row[f"{kind} a {rate}"] for kind in of)) for of in kinds]


PRINTED = {"error": 2, "cycles": 3, "multipliers": 0, "luts": 0}
"""Digits of the table of methods. Methods are compared by what the table shows."""


def beside(rows: Sequence[Mapping[str, Any]], own: Mapping[str, Any]) -> dict[str, dict[str, list[str]]]:
    """Methods that have less than a design, or the same.

    Parameters
    ----------
    rows : sequence of dict
        Rows of `blysk.bench.report.methods.rows_of`.
    own : dict
        The design's row.

    Returns
    -------
    dict
        For each number of `PRINTED`: ``less`` and ``same``, names of methods, each once. A method counts in
        each of its forms. A further form of the design's own method has its highlight behind a slash.
    """
    found = {}
    for part, digits in PRINTED.items():
        names: dict[str, list[str]] = {"less": [], "same": []}
        for row in rows:
            if row is own or row[part] is None:
                continue
            value, limit = (round(of[part], digits) for of in (row, own))
            of_own = row["method"] == own["method"]
            name = f"{row['method']}/{row['model']}" if of_own else row["method"]
            if value <= limit:
                names["less" if value < limit else "same"].append(name)
        less = list(dict.fromkeys(names["less"]))
        found[part] = {"less": less, "same": [n for n in dict.fromkeys(names["same"]) if n not in less]}
    return found


def measured_of(report: Mapping[str, Any]) -> dict[str, Any]:
    """The figures that the paper takes from a report.

    Parameters
    ----------
    report : dict
        Content of a report's ``report.json``.

    Raises
    ------
    ValueError
        If this is no report, or the report lacks a section.
    """
    try:
        figures, versions = report["sections"]["methods"]["figures"], report["versions"]
        methods = figures["rows"]
        named = {(row["method"], row["model"]): row for row in methods}
        return {
            "version": versions["blysk"],
            "made": report["made"][:10],
            "tools": ", ".join(f"{name} {versions[name]}" for name in ("Python", "amaranth", "numpy")),
            "methods": methods,
            "design": named["quotient", "blinn"],
            "renormalise": named["renormalise", "blinn"],
            "mirror": named["quotient", "phong"],
            "cycles_of": " and ".join(dict.fromkeys(_ENGINES[row["engine"]] for row in methods)),
            "scene": figures["scene"],
            "rivals": rivals_of(report["sections"]["rivals"]["tables"], figures["scene"]["exponent"]),
        }
    except (KeyError, TypeError):
        raise ValueError("is not such a report") from None


def lights_of(methods: Sequence[str] = OF_LIGHTS, counts: Sequence[int] = LIGHTS) -> dict[str, Any]:
    """Multipliers of methods with the lobe `blinn` over the number of lights, counted in the netlist.

    ``counts`` are the numbers of lights. ``rows`` have ``method``, the setup ``interval``, ``multipliers`` of
    each count, and ``widest``: bits of the widest operand of a multiplier.
    """
    from blysk.sim.api.design import design

    rows = []
    for method in methods:
        costs = [design(method=method, model="blinn", lights=count).cost() for count in counts]
        rows.append(
            {
                "method": method,
                "interval": costs[0].setup_interval,
                "multipliers": [cost.multipliers for cost in costs],
                "widest": max(wide for cost in costs for wide, _ in cost.multiplier_widths),
            }
        )
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


def data_of(measured: Mapping[str, Any]) -> dict[str, Any]:
    """All figures of the paper: those of a report, and those of the project's pages.

    Parameters
    ----------
    measured : dict
        Result of `measured_of`, with ``exponents`` and ``lights`` of `exponents_of` and `lights_of`.

    Raises
    ------
    InputError
        If a page lacks something.
    """
    from blysk.sim.meshes.teapot import teapot

    methods = measured["methods"]
    guide, theory = (
        {name: (PROJECT / "docs" / folder / f"{name}.md").read_text(encoding="utf-8") for name in names}
        for folder, names in (
            ("guide", ("accuracy", "checked", "fpga")),
            ("theory", ("geometry", "measured", "quotient", "references", "textures")),
        )
    )
    return {
        **measured,
        "title": "Phong and Blinn shading without unit normals: an open datapath with bounded errors",
        "author": re.search(r"- name: (.*)", (PROJECT / "CITATION.cff").read_text(encoding="utf-8"))[1],
        "scene": measured["scene"] | {"triangles": len(teapot(measured["scene"]["triangles"]).faces)},
        "beside": beside(methods, measured["design"]),
        "dates": sorted({row["date"] for row in methods if row["date"]}),
        "all_spans": documents_table(theory["quotient"], "| spans of up to |"),
        "found_spans": documents_table(theory["quotient"], "| | n = 1 | n = 10 |"),
        "materials": materials_of(theory["measured"]),
        "geometry": documents_table(theory["geometry"], "| spans from | `blinn`, n = 10 |"),
        "checkers": checkers_of(
            documents_table(theory["textures"], "| scene | linear light | bound | sRGB |")
        ),
        "colours": columns(documents_table(guide["fpga"], "| `--albedo` | device |"), 0, 1, 2, 3, 4, 6, 7),
        "more_lights": documents_table(guide["fpga"], "| lights | `quotient` | `renormalise` |"),
        "judges": documents_table(guide["checked"], "| judged | against llvmpipe |"),
        "worst": documents_table(guide["accuracy"], "| method | model | largest error of a pixel |"),
        "references": list(reference_texts(cited(SOURCE.read_text(encoding="utf-8")), theory["references"])),
    }


def paper(data: Mapping[str, Any], folder: Path) -> bytes:
    """The paper as a PDF. Its text, data and drawings stay in a folder.

    Parameters
    ----------
    data : dict
        Result of `data_of`.
    folder : Path
        Folder for the parts of the paper; it is made.

    Raises
    ------
    InputError
        If the extra ``paper`` is not installed, or a sentence of the paper is untrue, see `check`.
    """
    try:
        import typst
    except ImportError:
        remedy = "install the extra paper, pip install -e '.[paper]'"
        raise InputError("typst", "the library that sets the paper is missing", remedy) from None
    # Drawings need a library of another extra, and bad arguments are told without them.
    from blysk.bench.quality.paper_claims import check
    from blysk.bench.quality.paper_drawings import MOST_SHOWN, draw_exponents, draw_front, draw_pipeline

    above = [row for row in data["methods"] if row["error"] > MOST_SHOWN]
    data = {**data, "above": above}
    check(data, SOURCE.read_text(encoding="utf-8"))
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(SOURCE, folder / SOURCE.name)
    shutil.copy(PROJECT / "docs" / "teapot.png", folder / "teapot.png")
    write_json(folder / "data.json", data)
    draw_exponents(folder / "exponents.pdf", data["exponents"], SHOWN)
    draw_front(folder / "front.pdf", data["methods"])
    draw_pipeline(folder / "pipeline.pdf")
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
    """Make the paper from the report.json of a report that has the sections methods and rivals."""
    measured = _read(report)
    check_writable(output)
    scene = measured["scene"]
    width, height = map(int, scene["size"].split("x"))
    measured |= {"exponents": exponents_of(scene["triangles"], width, height), "lights": lights_of()}
    made = paper(data_of(measured), output.parent)
    with atomic_writer(output) as path:
        path.write_bytes(made)
    click.echo(f"{'written':<12}{output}")


def _read(report: str) -> dict[str, Any]:
    """Figures of a file, see `measured_of`."""
    remedy = "give the report.json of `blysk bench --only methods --only rivals`"
    try:
        content = json.loads(Path(report).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise InputError(report, "is not such a report", remedy) from None
    try:
        return measured_of(content)
    except ValueError as error:
        raise InputError(report, str(error), remedy) from None


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
