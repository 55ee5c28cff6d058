"""The report's section on methods: each in its documented form and in its best form, on one teapot."""

from collections.abc import Mapping, Sequence
from typing import Any

from blysk.bench.report import points
from blysk.bench.report.frames import frames, hardware
from blysk.bench.report.front import design_of
from blysk.bench.report.placed import placed
from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task
from blysk.bench.tools.families import DEVICE
from blysk.golden.presets import METHODS

__all__ = ["EXPONENT", "rows_of", "section", "tasks"]

EXPONENT = 100
"""Exponent of the frames."""

COLUMNS = {
    "method": "method",
    "model": "lobe",
    "operand": "operand",
    "error": "largest error, LSB",
    "cycles": "cycles a pixel",
    "multipliers": "multipliers",
    "luts": "look-up tables",
    "flip_flops": "flip-flops",
    "mhz": "clock rate, median, MHz",
    "seeds": "seeds",
}
"""Headings of the table, by the names of `rows_of`."""


def _has_a_row(settings: Mapping[str, Any]) -> bool:
    """Whether the table has a design: a method's documented form, or its best form.

    The first form is the highlight of the documents (``cosquad``) and the method's own operand. The second
    form is an exact table, and the operand 1 - N·H if the method finds normals. Published variants, other
    highlights, several lanes, and ``cosquad`` with 1 - N·H in place of the method's N·H are left out.
    """
    method, model = settings.get("method"), settings.get("model")
    documented = model == "cosquad" and "operand" not in settings
    return method in METHODS and "lanes" not in settings and (documented or model in ("blinn", "phong"))


def tasks(quick: bool) -> list[Task]:
    """Frames and resources of the designs that have a row: those of the section `points`, at `EXPONENT`."""
    found = []
    for task in points.tasks(quick):
        if task.function in (frames, hardware) and _has_a_row(task.settings):
            only = {"exponents": [EXPONENT]} if task.function is frames else {}
            found.append(Task(task.function, task.settings | only))
    return found


def rows_of(found: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows of the table.

    Parameters
    ----------
    found : sequence of dict
        Result of `points_of`.

    Returns
    -------
    list of dict
        ``method``, ``model``, ``operand``, ``engine``; ``error`` in LSB against exact normals with the same
        lobe, ``cycles`` a pixel, ``multipliers``; ``luts``, ``flip_flops``, ``mhz`` (the median), ``seeds``
        and ``date``, ``None`` without a placement. The smallest error is first.
    """
    store = placed(DEVICE)
    rows = []
    for point in found:
        settings = point["settings"]
        parts = store.get(design_of(settings), {})
        rows.append(
            {
                "method": settings["method"],
                "model": settings["model"],
                "operand": settings.get("operand", METHODS[settings["method"]].operand),
                "engine": settings["engine"],
                "error": point["errors"]["method_max_lsb"],
                "cycles": point["times"]["cycles_per_pixel"],
                "multipliers": point["hardware"]["multipliers"],
                "luts": parts.get("luts"),
                "flip_flops": parts.get("flip_flops"),
                "mhz": round(parts["fmax_median_mhz"]) if parts else None,
                "seeds": len(parts["fmax_mhz"]) if parts else None,
                "date": parts.get("date"),
            }
        )
    return sorted(rows, key=lambda row: (row["error"], row["cycles"]))


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: a table. `Section.figures` has its ``rows`` by `rows_of`, and the frame's ``scene``."""
    found = points.points_of(tasks, results)
    rows, settings = rows_of(found), found[0]["settings"]
    size = f"{settings['width']}x{settings['height']}"
    scene = {"triangles": settings["triangles"], "size": size, "exponent": EXPONENT}
    text = [
        f"Each method shades a teapot at {size} and exponent {EXPONENT}, in its documented form and in its "
        "best form. The best form has a table of Blinn's lobe and, if the method finds normals, the operand "
        "1 - N·H. `quotient` has true Phong, too."
    ]
    note = (
        "Errors are the largest against exact normals with the same lobe, over all pixels. Look-up tables, "
        "flip-flops and clock rates are committed placements of the core alone, with one light, out of "
        "context. Methods differ in the work that their timing had."
    )
    cells = [[row[name] for name in COLUMNS] for row in rows]
    table = Table("methods", "Methods in two forms", list(COLUMNS.values()), cells, note)
    return Section("methods", "Methods", text, [table], figures={"rows": rows, "scene": scene})
