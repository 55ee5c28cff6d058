"""The report's section on [C]: its figures drawn from our measurements, and its numbers beside ours."""

from collections.abc import Sequence
from typing import Any

from blysk.bench.report.cosine_quadratic_drawings import (
    coefficient_drawing,
    curves_drawing,
    map_drawing,
    pictures_drawing,
    reflectance_drawing,
    relative_drawing,
    slope_drawing,
)
from blysk.bench.report.cosine_quadratic_figures import (
    CURVES,
    EXPONENTS,
    PICTURE_EXPONENT,
    PICTURED,
    PUBLISHED,
    RELATED,
    SHOWN,
    ZONE,
    coefficients,
    curves,
    errors,
    map_of_errors,
    pictures,
    slopes,
)
from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task

__all__ = [
    "section",
    "tasks",
]


def tasks(quick: bool) -> list[Task]:
    """Measurements of the section.

    Parameters
    ----------
    quick : bool
        Whether pictures are small; all figures are computed either way.
    """
    models = (*CURVES, *RELATED)
    size = {"width": 120, "height": 90} if quick else {"width": 240, "height": 180}
    return [
        *(Task(errors, {"model": model}) for model in models),
        Task(slopes),
        Task(coefficients),
        *(Task(curves, {"exponent": exponent}) for exponent in SHOWN),
        *(
            Task(map_of_errors, {"model": model, "size": 60 if quick else 160})
            for model in ("cosquad", "cosquad_lin")
        ),
        *(
            Task(pictures, {"body": body, "exponent": PICTURE_EXPONENT, **size})
            for body in ("sphere", "teapot")
        ),
    ]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section from the results of its tasks."""
    found: dict[str, Any] = {}
    lines, maps, bodies = {}, {}, {}
    for task, result in zip(tasks, results, strict=True):
        if task.function is errors:
            found[task.settings["model"]] = result
        elif task.function is curves:
            lines[task.settings["exponent"]] = result
        elif task.function is map_of_errors:
            maps[task.settings["model"]] = result
        elif task.function is pictures:
            bodies[task.settings["body"]] = result
        else:
            found[task.function.__name__] = result
    published = _published_table(found)
    count = sum(row["reproduces"] for row in published.records())
    others = [row["figure"] for row in published.records() if not row["reproduces"]]
    text = [
        "[C] replaces `cos^n gamma` by the square of a line, `max(k (cos gamma - 1) + 1, 0)^2`: f2 with k = "
        "n/2, fQ with the k that meets Blinn's model at the level Q = 0.64, and fQ2 with a line through "
        "that k, 0.448 n + 0.099.",
        f"{count} of {len(PUBLISHED)} published figures come out to every digit published"
        + (f"; those that do not: {'; '.join(others)}." if others else "."),
        "The line is the better one near the peak: in the zone its error is "
        f"{found['cosquad_lin']['relative']:.2%} against {found['cosquad']['relative']:.2%} of f2; over all "
        f"angles {found['cosquad_lin']['absolute']:.3f} against {found['cosquad']['absolute']:.3f}, where "
        "the two have a zero and Blinn's model has none.",
    ]
    parts = [
        published,
        _models_table(found),
        curves_drawing(lines),
        map_drawing("3", "cosquad", maps["cosquad"]),
        slope_drawing(found["slopes"]),
        relative_drawing(found, lines),
        map_drawing("6", "cosquad_lin", maps["cosquad_lin"]),
        coefficient_drawing(found["coefficients"]),
        reflectance_drawing(found["coefficients"]),
        pictures_drawing(bodies),
        _pictures_table(bodies),
    ]
    return Section(
        "cosine-quadratic", "Figures of [C]: the cosine-quadratic model", text, parts, appendix=True
    )


def _published_table(found: dict[str, Any]) -> Table:
    rows, grades = [], []
    for figure in PUBLISHED:
        value = found[figure.key[0]][figure.key[1]] * (100 if figure.percent else 1)
        digits = len(figure.published.partition(".")[2])
        reproduces = f"{value:.{digits}f}" == figure.published
        published = float(figure.published)
        rows.append([figure.what, published, value, reproduces, value / published - 1])
        near = abs(value - published) <= 2 * 10.0**-digits
        grades.append([""] * 3 + ["good" if reproduces else "fair" if near else "bad"] + [""])
    return Table(
        "cosine-quadratic-published",
        "Published figures of [C] beside ours",
        ("figure", "published", "ours", "reproduces", "relative difference"),
        rows,
        f"Float64, n from {EXPONENTS[0]} to {EXPONENTS[-1]}. [C] does not define its zone: here it is where "
        f"Blinn's model is at least {ZONE}, which is chosen to give the 7.924 % of f2. Green: every digit "
        "published; yellow: off by two units of the last digit at most; red: by more.",
        grades,
    )


def _models_table(found: dict[str, Any]) -> Table:
    return Table(
        "cosine-quadratic-models",
        "Models of the documents against Blinn's",
        (
            *("model", "largest absolute error", "at exponent"),
            "largest relative error in the zone",
        ),
        [
            [model, *(found[model][key] for key in ("absolute", "absolute_exponent", "relative"))]
            for model in (*CURVES, *RELATED)
        ],
        f"Of a full highlight, 1. n from {EXPONENTS[0]} to {EXPONENTS[-1]}, all angles; cosquad is f2, "
        "cosquad_q fQ with Q = 0.64, cosquad_lin fQ2; cosquad7 and coscos are [T]'s.",
    )


def _pictures_table(bodies: dict[str, Any]) -> Table:
    return Table(
        "cosine-quadratic-pictures",
        "Errors of those pictures against Blinn's",
        ("body", "model", "largest error, LSB", "99.9th percentile, LSB", "PSNR, dB"),
        [
            [body, model, *(found[model][key] for key in ("max_lsb", "p999_lsb", "psnr_db"))]
            for body, found in bodies.items()
            for model in PICTURED
            if model != "blinn"
        ],
        f"Unrounded float64 pictures, over the pixels of the body; exponent {PICTURE_EXPONENT}.",
    )
