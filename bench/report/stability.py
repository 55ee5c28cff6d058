"""The report's section on stiff and extreme cases, with every method in each case.

A case is a scene and its spans. Every method shades each case twice. The first time it takes the spans as
they come. The second time `golden.frames.cut` cuts them first, as `blysk render` does. The same functions
grade the cases for the report and for the tests.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from blysk.bench.colors import style_of
from blysk.bench.report.section import Drawing, Grade, Mark, Section, Table
from blysk.bench.report.stability_cases import GROUPS
from blysk.bench.report.stability_conclusion import conclusion
from blysk.bench.report.stability_errors import (
    FACTORS,
    GOOD,
    RANGE_EXPONENTS,
    SWEEP,
    SWEEP_EXPONENT,
    grade_of,
    measure,
    measure_ranges,
)
from blysk.bench.store import Task
from blysk.bench.svg import svg
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.presets import METHODS

__all__ = [
    "section",
    "tasks",
]


_LIMITS: dict[Grade, float] = {"good": GOOD, "fair": 4.0, "poor": 16.0}
"""Largest error of each colour, in LSB. Larger errors are bad."""

_MARKS: dict[Grade, Mark] = {"fair": "stated", "bad": "silent"}


def tasks(quick: bool) -> list[Task]:
    """Measurements of every method in every case. A quick report has all of them, too."""
    settings = [{"method": method} for method in METHODS]
    return [Task(function, each) for function in (measure, measure_ranges) for each in settings]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: grades of every method in every group, the safe range of each method, and every case."""
    found: dict[str, dict[str, Any]] = {}
    for task, result in zip(tasks, results, strict=True):
        found.setdefault(task.function.__name__, {})[task.settings["method"]] = result
    cases, ranges = (found.get(function.__name__, {}) for function in (measure, measure_ranges))
    methods = list(cases)
    worst = {
        way: {
            (group, method): _worst([case[way] for case in cases[method][str(group)] if case[way]], way)
            for group in GROUPS
            for method in methods
        }
        for way in ("prepared", "given")
    }
    tables = [
        _matrix(
            "stability",
            "Largest error of a pixel, LSB, with spans cut as `blysk` cuts them",
            methods,
            worst["prepared"],
            "The preparation refuses normals that are not of unit length. The loader of meshes mends the "
            "normals of a mesh.",
        ),
        _matrix(
            "stability-as-given",
            "Largest error of a pixel in spans without a flag, LSB, with uncut spans",
            methods,
            worst["given"],
            "These are the errors if the user sends spans to the pipeline without cutting them. Cells with ! "
            "are outside the ranges below.",
        ),
    ]
    bad = [grade for _, grade in worst["prepared"].values() if grade == "bad"]
    silent = [method for (_, method), (_, grade) in worst["given"].items() if grade == "bad"]
    everything = [case for method in methods for group in cases[method].values() for case in group]
    safe = [case["given"] for case in everything if case["inside"]]
    unsafe = sum(case["safe_grade"] == "bad" for case in safe)
    text = [
        f"This section tests {len(methods)} methods in {sum(map(len, cases[methods[0]].values()))} stiff and "
        f"extreme cases of {len(GROUPS)} groups. The bit-accurate model computes the pixels, and the "
        "simulated hardware equals it to the bit. The reflection model is `cosquad`, but `blinn` for "
        "`quotient`. Each pixel is compared with exact normals "
        "in float64 with the same model. A correctly rounded pixel has 0.5 LSB. Where N.L is 0 within the "
        "error of the arithmetic, lit and dark are both right.",
        f"The colour of a cell shows its error: up to {GOOD:g} LSB, up to {_LIMITS['fair']:g}, up to "
        f"{_LIMITS['poor']:g}, or more. The mark of a cell shows whether the user is told of an error above "
        f"{GOOD:g} LSB:\n\n"
        "- §: the pipeline flags the span, or the method serves the span and its documentation states an "
        "error of this size. The stated error is that of the method's own curve in float64, plus the error "
        "bounds of its units. In a highlight the bounds are multiplied by the exponent.\n"
        "- !: nothing tells the user. The pixel is silently wrong.",
        "Where N.L changes its sign, even a bright highlight ends at once. At exponent 1 the highlight is "
        "bright there. If the N.L of a method is wrong by a part of an LSB, the highlight ends "
        "a pixel early or late. So the error of group 5 can be as large as the highlight.",
        f"With cut spans {len(bad)} of {len(worst['prepared'])} cells are silently wrong. With uncut spans "
        f"{len(silent)} cells are silently wrong"
        + (f", of {_listed(sorted(set(silent), key=methods.index))}" if silent else "")
        + f". {len(safe)} cases have spans that the method serves. In {unsafe} of these cases a served span "
        "is silently wrong.",
    ]
    parts = [*tables, _range_table(ranges), _drawing(ranges), _case_table(cases)]
    title = "Numerical stability on stiff and extreme cases"
    return Section("stability", title, text, parts, conclusion=conclusion(cases, ranges))


def _listed(methods: Sequence[str]) -> str:
    return ", ".join(f"`{method}`" for method in methods)


def _worst(figures: Sequence[dict], way: str) -> tuple[float | None, Grade]:
    name = "error" if way == "prepared" else "silent"
    return max((of[name] for of in figures), default=None), grade_of([of["grade"] for of in figures])


def _matrix(name, title, methods, worst, note) -> Table:
    def colored(group, method) -> Grade:
        return _magnitude(worst[group, method][0])

    def marked(group, method) -> Mark:
        return _MARKS.get(worst[group, method][1], "")

    return Table(
        name,
        title,
        ["group", "extreme quantity", *methods],
        [[group, text, *(worst[group, method][0] for method in methods)] for group, text in GROUPS.items()],
        f"Worst case of each group. The colour shows the error. §: stated or flagged. !: neither. {note}",
        [["", "", *(colored(group, method) for method in methods)] for group in GROUPS],
        [["", "", *(marked(group, method) for method in methods)] for group in GROUPS],
    )


def _magnitude(error: float | None) -> Grade:
    """Colour of an error in LSB."""
    if error is None:
        return ""
    return next((grade for grade, limit in _LIMITS.items() if error <= limit), "bad")


def _shown(rows: Sequence[Sequence], grades: Sequence[Sequence[Grade]]) -> dict[str, Any]:
    """Grades and marks of a table. The error of a graded cell gives the colour, and its grade the mark."""
    return {
        "grades": [
            [_magnitude(cell) if grade else "" for cell, grade in zip(row, of, strict=True)]
            for row, of in zip(rows, grades, strict=True)
        ],
        "marks": [[_MARKS.get(grade, "") for grade in of] for of in grades],
    }


def _range_table(ranges: dict[str, dict]) -> Table:
    rows, grades = [], []
    for method, found in ranges.items():
        row: list = [method, *(found["widest"][str(exponent)] for exponent in RANGE_EXPONENTS)]
        off = [of["given"]["error"] > GOOD for of in found["sweep"]]
        good = off.index(True) if True in off else len(off)
        row += [SWEEP[good - 1] if good else None, found["none_flagged"], found["all_flagged"]]
        grade: list[Grade] = [""] * len(row)
        by_factor = {of["factor"]: of for of in found["outside"]}
        for factor in FACTORS:
            of = by_factor.get(factor)
            cells: list = [None] * 3
            own: list[Grade] = [""] * 3
            if of:
                given, prepared = of["given"], of["prepared"]
                silent = given["silent"] if given["flagged"] < of["spans"] else None
                cells = [silent, given["flagged"] / of["spans"], prepared["error"]]
                own = [given["grade"], "", prepared["grade"]]
            # Spans that are not too wide are not cut.
            row += cells if factor > 1 else cells[:2]
            grade += own if factor > 1 else own[:2]
        row += [f"1 to {(1 << LENGTH_BITS) - 1}", f"1 to {MAX_EXPONENT}"]
        rows.append(row)
        grades.append([*grade, "", ""])
    columns = ["method", *(f"widest span at n = {exponent}, degrees" for exponent in RANGE_EXPONENTS)]
    columns += [f"angle up to which the error is at most {GOOD:g} LSB, degrees"]
    columns += ["angle up to which no span is flagged, degrees"]
    columns += ["angle from which every span is flagged, degrees"]
    for factor in FACTORS:
        at = f"at {factor:g} times the widest" if factor != 1 else "at the widest"
        columns += [f"error without a flag {at}, LSB", f"spans flagged {at}, share"]
        columns += [f"error {at}, cut, LSB"] * (factor > 1)
    note = (
        "`blysk` cuts wider spans before the pipeline, and counts them. The pipeline counts the wide spans "
        "that it gets and can recognise: some or all. "
        f"Errors are at exponent {SWEEP_EXPONENT}, with spans of 16 pixels that hold the highlight. "
        "There is no figure where every span is flagged. For `chord-local` the widest span depends on the "
        "light. For `chord-local` and `quotient` the widest span is measured: the widest angle at which no "
        "span of a sample is cut."
    )
    title = "Range of each method, and its errors and flags outside the range"
    columns += ["pixels of a span", "exponents"]
    return Table("safe-ranges", title, columns, rows, note, **_shown(rows, grades))


def _case_table(cases: dict[str, dict]) -> Table:
    columns = ["method", "group", "case", "spans", "served", "cut", "flagged", "error uncut, LSB"]
    columns += [
        "error without a flag, LSB",
        "error in served spans, LSB",
        "error cut, LSB",
        "flagged when cut",
    ]
    rows, grades = [], []
    for method, groups in cases.items():
        for group, found in groups.items():
            for of in found:
                given, prepared = of["given"], of["prepared"] or {}
                row = [method, int(group), of["case"], of["spans"], of["inside"], of["cut"]]
                row += [given["flagged"], given["error"]]
                row += [given["silent"] if given["flagged"] < of["spans"] else None]
                row += [given["safe"] if of["inside"] else None]
                rows.append([*row, prepared.get("error"), prepared.get("flagged")])
                shown = [given["grade"], given["safe_grade"], prepared.get("grade", ""), ""]
                grades.append([""] * 8 + shown)
    note = "The preparation refuses a case that has no figures for cut spans."
    return Table("stability-cases", "Every case", columns, rows, note, **_shown(rows, grades))


def _drawing(ranges: dict[str, dict]) -> Drawing:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 4.0), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    titles = ("uncut spans without a flag", "spans cut if out of range")
    ways = ("given", "silent"), ("prepared", "error")
    for panel, (way, key), title in zip(panels, ways, titles, strict=True):
        for method, found in ranges.items():
            shown = [of[way]["flagged"] < of["spans"] or way == "prepared" for of in found["sweep"]]
            errors = [
                of[way][key] if show else np.nan for of, show in zip(found["sweep"], shown, strict=True)
            ]
            style = style_of(method)
            panel.plot(SWEEP, errors, color=style.color, linestyle=style.dash, linewidth=1.4, label=method)
        panel.axhline(0.5, color="#888888", linewidth=0.8, linestyle=":")
        panel.set(xscale="log", yscale="log", title=title, xlabel="angle of the span, degrees")
        panel.grid(True, color="#dddddd", linewidth=0.5)
        panel.set_xticks((1, 3, 10, 30, 90, 180), ("1", "3", "10", "30", "90", "180"), minor=False)
        panel.set_xticks((), minor=True)
        panel.set_yticks((0.5, 1, 10, 100), ("0.5", "1", "10", "100"))
        panel.title.set_fontsize(9)
    panels[0].set_ylabel("largest error, LSB")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", frameon=False)
    note = (
        f"Exponent {SWEEP_EXPONENT}, 16 pixels a span. A line ends where every span is flagged. The dotted "
        "line is half a step, the error of a correctly rounded pixel. A span is cut until the angle grows "
        "evenly in each part. So its parts are narrower than the widest uncut span."
    )
    return Drawing("stability-angles", "Error against the angle of a span", svg(figure), note)
