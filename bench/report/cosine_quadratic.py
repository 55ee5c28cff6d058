"""The report's section on [C]: its figures drawn again, and its published numbers beside ours."""

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from PIL import Image

from blysk.bench.accuracy import scene_for
from blysk.bench.report.section import Drawing, Section, Table
from blysk.bench.store import Task
from blysk.bench.tools.pages import svg
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.metrics import error_figures
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "EXPONENTS",
    "PUBLISHED",
    "ZONE",
    "Published",
    "coefficients",
    "curves",
    "errors",
    "map_of_errors",
    "panels",
    "pictures",
    "section",
    "slopes",
    "sphere",
    "tasks",
]

EXPONENTS = range(2, 1001)
"""Exponents that [C] speaks of."""

ZONE = 0.59363
"""Least brightness of Blinn's model in the "epicentre zone", which [C] does not define: it gives the 7.924 %
that [C] prints for f2."""

_X = np.linspace(0, 30, 6001)
"""``n (1 - cos gamma)``, on which the models depend almost alone; above 30 Blinn is below 1e-13."""

_CURVES = ("cosquad", "cosquad_q", "cosquad_lin")
_NAMES = {"blinn": "Blinn", "cosquad": "f2", "cosquad_q": "fQ, Q = 0.64", "cosquad_lin": "fQ2"}
_COLOURS = {"blinn": "black", "cosquad": "#d55e00", "cosquad_q": "#0072b2", "cosquad_lin": "#009e73"}
_STYLES = {"blinn": "-", "cosquad": "-", "cosquad_q": "--", "cosquad_lin": ":"}
_SHOWN = (5, 20, 100)
_SEEN = 0.1
"""Least brightness of Blinn's model for a relative error to be drawn."""

_RELATED = ("cosquad7", "coscos2", "coscos4")
_PICTURED = ("blinn", "cosquad", "cosquad_q", "cosquad_lin")
_PICTURE_EXPONENT = 50
_INFERRED = "What the printed figure shows is inferred from the text; the figure itself was not at hand."


@dataclass(frozen=True)
class Published:
    """A figure of [C].

    Parameters
    ----------
    what : str
        What it is of.
    printed : str
        As printed, digit by digit.
    key : tuple of str
        Where ours is: the name of a measurement, and of a figure in it.
    percent : bool
        Whether it is printed in per cent; ours is not.
    """

    what: str
    printed: str
    key: tuple[str, str]
    percent: bool = False


PUBLISHED = (
    Published("f2, largest absolute error", "0.162", ("cosquad", "absolute")),
    Published("f2, largest relative error in the zone, %", "7.924", ("cosquad", "relative"), True),
    Published(
        "fQ (Q = 0.64), largest relative error in the zone, %", "1.255", ("cosquad_q", "relative"), True
    ),
    Published("fQ2, largest relative error in the zone, %", "1.256", ("cosquad_lin", "relative"), True),
    Published("fQ2, largest absolute error", "0.128", ("cosquad_lin", "absolute")),
    Published("0.448 n + 0.099, largest relative error, %", "0.5", ("slopes", "error"), True),
    Published("coef(2)", "0.634", ("coefficients", "2")),
    Published("coef(3)", "0.833", ("coefficients", "3")),
    Published("coef(4)", "1.04", ("coefficients", "4")),
    Published("coef(5)", "1.25", ("coefficients", "5")),
    Published("coef(10)", "2.313", ("coefficients", "10")),
    Published("largest deviation of the reflectance from 1", "0.053", ("coefficients", "deviation")),
)
"""Figures of [C], in its order."""


def panels(
    width: float = 9.0, height: float = 3.0, columns: int = 1, **options: Any
) -> tuple[Figure, np.ndarray]:
    """An empty drawing of some panels in a row, with a light grid and small letters.

    Parameters
    ----------
    width, height : float
        Inches.
    columns : int
        Panels.
    **options
        Of `matplotlib.figure.Figure.subplots`.
    """
    with rc_context({"font.size": 8, "axes.grid": True, "grid.color": "#dddddd", "grid.linewidth": 0.5}):
        figure = Figure(figsize=(width, height), layout="constrained")
        return figure, figure.subplots(1, columns, squeeze=False, **options)[0]


def errors(model: str) -> dict[str, Any]:
    """Largest errors of a model against Blinn's, over all angles and `EXPONENTS`.

    Returns
    -------
    dict
        ``absolute``, and ``absolute_exponent`` where it is; ``relative``: largest relative one in the zone;
        ``by_exponent``: exponent, absolute and relative error of some exponents.
    """
    found = []
    for exponent in EXPONENTS:
        cosine = np.append(1 - _X[exponent >= _X] / exponent, ZONE ** (1 / exponent))
        blinn = cosine**exponent
        error = np.abs(REFLECTION_MODELS[model].reflect(cosine, exponent) - blinn)
        # The zone's own bound is in it.
        zone = blinn >= ZONE * (1 - 1e-12)
        found.append((exponent, float(error.max()), float((error[zone] / blinn[zone]).max())))
    absolute = max(found, key=lambda entry: entry[1])
    shown = np.unique(np.geomspace(2, 1000, 60).astype(int)) - EXPONENTS[0]
    return {
        "absolute": absolute[1],
        "absolute_exponent": absolute[0],
        "relative": max(entry[2] for entry in found),
        "by_exponent": [list(found[k]) for k in shown],
    }


def slopes() -> dict[str, Any]:
    """Slope k of fQ with Q = 0.64 at some exponents, [C]'s line through it, and the line's largest error.

    Returns
    -------
    dict
        ``exponents``, ``exact``, ``line``, and ``error``: largest relative one over all of `EXPONENTS`;
        ``refitted``: that of ``0.44813 n + 0.10235``.
    """
    every = np.array(EXPONENTS)
    exact, line, refitted = (
        np.array([REFLECTION_MODELS[model].slope(n) for n in every])
        for model in ("cosquad_q", "cosquad_lin", "cosquad_lin_refitted")
    )
    shown = np.unique(np.geomspace(2, 1000, 60).astype(int)) - every[0]
    return {
        "exponents": every[shown].tolist(),
        "exact": exact[shown].tolist(),
        "line": line[shown].tolist(),
        "error": float(np.abs(line / exact - 1).max()),
        "refitted": float(np.abs(refitted / exact - 1).max()),
    }


def coefficients() -> dict[str, Any]:
    """Ideal coef(n) of fQ2, one over ``2 pi integral_0^1 S(c) c dc``, and what [C]'s line makes of it.

    With k the slope, ``S = (1 - k (1-c))^2`` down to ``z = max(1 - 1/k, 0)``, and the integral of ``S c`` is
    taken in closed form.

    Returns
    -------
    dict
        ``exponents``, ``ideal`` and ``line`` of some exponents; ``deviation``: largest of ``coef(n)`` times
    With k the slope, ``S = (1 - k (1-c))^2`` down to ``max(1 - 1/k, 0)``; the integral of ``S c`` is taken in
    closed form.
    """
    n = np.array(EXPONENTS, dtype=np.float64)
    k = np.array([REFLECTION_MODELS["cosquad_lin"].slope(value) for value in n])
    # With y = 1 - c from 0 to w: (1 - k y)^2 (1 - y).
    w = np.minimum(1 / k, 1)
    inside = w - (1 + 2 * k) * w**2 / 2 + (2 * k + k**2) * w**3 / 3 - k**2 * w**4 / 4
    ideal = 1 / (2 * np.pi * inside)
    line = np.array([REFLECTION_MODELS["cosquad_lin"].energy_factor(value) for value in n])
    deviation = np.abs(line / ideal - 1)
    shown = np.unique(np.geomspace(2, 1000, 60).astype(int)) - EXPONENTS[0]
    return {
        "exponents": n[shown].tolist(),
        "ideal": ideal[shown].tolist(),
        "line": line[shown].tolist(),
        "deviation": float(deviation.max()),
        "deviation_exponent": int(n[deviation.argmax()]),
        **{str(value): float(ideal[value - EXPONENTS[0]]) for value in (2, 3, 4, 5, 10)},
    }


def curves(exponent: int) -> dict[str, Any]:
    """Brightness against the angle, of Blinn's model and those of [C].

    Parameters
    ----------
    exponent : int
        n; angles go up to where Blinn's model is about ``exp(-6)``, or to 90 degrees.

    Returns
    -------
    dict
        ``degrees``, and by model the brightness.
    """
    degrees = np.linspace(0, math.degrees(math.acos(max(1 - 6 / exponent, 0))), 121)
    cosine = np.cos(np.radians(degrees))
    brightness = {
        model: REFLECTION_MODELS[model].reflect(cosine, exponent).tolist() for model in ("blinn", *_CURVES)
    }
    return {"degrees": degrees.tolist(), **brightness}


def map_of_errors(model: str, size: int) -> dict[str, Any]:
    """Error of a model against Blinn's, over angle and exponent.

    Parameters
    ----------
    model : str
        Reflection model.
    size : int
        Angles, and exponents.

    Returns
    -------
    dict
        ``degrees``, ``exponents`` and ``error``, exponents first.
    """
    degrees, exponents = np.linspace(0, 90, size), np.geomspace(2, 1000, size)
    cosine = np.cos(np.radians(degrees))
    error = [
        REFLECTION_MODELS[model].reflect(cosine, n) - REFLECTION_MODELS["blinn"].reflect(cosine, n)
        for n in exponents
    ]
    return {
        "degrees": degrees.tolist(),
        "exponents": exponents.tolist(),
        "error": np.round(error, 5).tolist(),
    }


def sphere(segments: int) -> Mesh:
    """A sphere of radius 1 with exact normals, of ``2 segments`` by ``segments`` quadrilaterals."""
    height, around = np.meshgrid(
        np.linspace(0, np.pi, segments + 1), np.linspace(0, 2 * np.pi, 2 * segments + 1), indexing="ij"
    )
    points = np.stack([np.sin(height) * np.sin(around), np.cos(height), np.sin(height) * np.cos(around)], -1)
    index = np.arange(height.size).reshape(height.shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    points = points.reshape(-1, 3)
    return Mesh(points, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3), normalise(points))


def pictures(body: str, exponent: int, width: int, height: int) -> dict[str, Any]:
    """A body in Blinn's model and in those of [C], drawn by the golden renderer with Phong shading.

    Parameters
    ----------
    body : str
        ``"sphere"`` or ``"teapot"``.
    exponent : int
        Of the highlight.
    width, height : int
        Size of each picture.

    Returns
    -------
    dict
        By model, ``png`` in base 64, and ``max_lsb``, ``p999_lsb`` and ``psnr_db`` against Blinn's.
    """
    mesh = sphere(48) if body == "sphere" else teapot(10_000)
    scene = scene_for(mesh, exponent, width, height)
    scene = replace(scene, camera=Camera.framing(mesh.vertices, (0.2, 0.3, 1), "perspective", width / height))
    raster = rasterise(scene)
    found = {}
    exact = render(scene, "phong", REFLECTION_MODELS["blinn"], raster)
    for model in _PICTURED:
        frame = render(scene, "phong", REFLECTION_MODELS[model], raster)
        figures = error_figures(frame.image * 255, exact.image * 255, exact.mask)
        shown = np.where(frame.mask[..., np.newaxis], frame.image, 1.0)
        buffer = BytesIO()
        Image.fromarray(np.rint(shown * 255).astype(np.uint8)).convert("L").save(buffer, "PNG", optimize=True)
        found[model] = {
            "png": base64.b64encode(buffer.getvalue()).decode(),
            "max_lsb": figures.max_lsb,
            "p999_lsb": figures.p999_lsb,
            "psnr_db": figures.psnr_db if math.isfinite(figures.psnr_db) else None,
        }
    return found


def tasks(quick: bool) -> list[Task]:
    """Measurements of the section.

    Parameters
    ----------
    quick : bool
        Small pictures; the figures are all there.
    """
    models = (*_CURVES, *_RELATED)
    size = {"width": 120, "height": 90} if quick else {"width": 240, "height": 180}
    return [
        *(Task(errors, {"model": model}) for model in models),
        Task(slopes),
        Task(coefficients),
        *(Task(curves, {"exponent": exponent}) for exponent in _SHOWN),
        *(
            Task(map_of_errors, {"model": model, "size": 60 if quick else 160})
            for model in ("cosquad", "cosquad_lin")
        ),
        *(
            Task(pictures, {"body": body, "exponent": _PICTURE_EXPONENT, **size})
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
        f"{count} of {len(PUBLISHED)} published figures come out to every digit printed"
        + (f"; those that do not: {'; '.join(others)}." if others else "."),
        "The line is the better one near the peak: in the zone its error is "
        f"{found['cosquad_lin']['relative']:.2%} against {found['cosquad']['relative']:.2%} of f2; over all "
        f"angles {found['cosquad_lin']['absolute']:.3f} against {found['cosquad']['absolute']:.3f}, where "
        "the two have a zero and Blinn's model has none.",
    ]
    parts = [
        published,
        _models_table(found),
        _curves_drawing(lines),
        _map_drawing("3", "cosquad", maps["cosquad"]),
        _slope_drawing(found["slopes"]),
        _relative_drawing(found, lines),
        _map_drawing("6", "cosquad_lin", maps["cosquad_lin"]),
        _coefficient_drawing(found["coefficients"]),
        _reflectance_drawing(found["coefficients"]),
        _pictures_drawing(bodies),
        _pictures_table(bodies),
    ]
    return Section("cosine-quadratic", "Figures of [C]: the cosine-quadratic model", text, parts)


def _published_table(found: dict[str, Any]) -> Table:
    rows, grades = [], []
    for figure in PUBLISHED:
        value = found[figure.key[0]][figure.key[1]] * (100 if figure.percent else 1)
        digits = len(figure.printed.partition(".")[2])
        reproduces = f"{value:.{digits}f}" == figure.printed
        printed = float(figure.printed)
        rows.append([figure.what, printed, value, reproduces, value / printed - 1])
        near = abs(value - printed) <= 2 * 10.0**-digits
        grades.append([""] * 3 + ["good" if reproduces else "fair" if near else "bad"] + [""])
    return Table(
        "cosine-quadratic-published",
        "Published figures of [C] beside ours",
        ("figure", "printed", "ours", "reproduces", "relative difference"),
        rows,
        f"Float64, n from {EXPONENTS[0]} to {EXPONENTS[-1]}. [C] does not define its zone: here it is where "
        f"Blinn's model is at least {ZONE}, which is chosen to give the 7.924 % of f2. Green: every digit "
        "printed; yellow: off by two units of the last digit at most; red: by more.",
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
            for model in (*_CURVES, *_RELATED)
        ],
        f"Of a full highlight, 1. n from {EXPONENTS[0]} to {EXPONENTS[-1]}, all angles; cosquad is f2, "
        "cosquad_q fQ with Q = 0.64, cosquad_lin fQ2; cosquad7 and coscos are [T]'s.",
    )


def _curves_drawing(lines: dict[int, Any]) -> Drawing:
    figure, row = panels(columns=len(lines))
    for (exponent, found), panel in zip(lines.items(), row, strict=True):
        for model in ("blinn", *_CURVES):
            panel.plot(
                found["degrees"],
                found[model],
                color=_COLOURS[model],
                linestyle=_STYLES[model],
                label=_NAMES[model],
            )
        panel.set_xlim(0, found["degrees"][-1])
        panel.set_title(f"n = {exponent}", fontsize=9)
        panel.set_xlabel("gamma, degrees")
    row[0].set_ylabel("brightness of the highlight")
    row[-1].legend(fontsize=8)
    return Drawing(
        "cosine-quadratic-2",
        "[C] figure 2: the models' highlights against the angle",
        svg(figure),
        f"fQ and fQ2 lie on each other. {_INFERRED}",
    )


def _map_drawing(number: str, model: str, found: dict[str, Any]) -> Drawing:
    figure, (panel,) = panels(6.4, 3.4)
    error = np.array(found["error"])
    extent = np.abs(error).max()
    shown = panel.pcolormesh(
        found["degrees"],
        found["exponents"],
        error,
        cmap="PuOr_r",
        vmin=-extent,
        vmax=extent,
        rasterized=True,
        shading="nearest",
    )
    panel.grid(False)
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.set_xlabel("gamma, degrees")
    panel.set_ylabel("exponent n")
    bar = figure.colorbar(shown, ax=panel)
    bar.set_label(f"{_NAMES[model]} less Blinn", fontsize=8)
    bar.ax.tick_params(labelsize=8)
    return Drawing(
        f"cosine-quadratic-{number}",
        f"[C] figure {number}: absolute error of {_NAMES[model]} over angle and exponent",
        svg(figure),
        f"Largest on this grid: {extent:.3f}. {_INFERRED}",
    )


def _slope_drawing(found: dict[str, Any]) -> Drawing:
    figure, (left, right) = panels(columns=2)
    n, exact, line = (np.array(found[name]) for name in ("exponents", "exact", "line"))
    left.plot(n, exact, color="black", label="k of fQ, Q = 0.64")
    left.plot(n, line, color="#d55e00", linestyle="--", label="0.448 n + 0.099")
    left.set_ylabel("slope k")
    left.legend(fontsize=8)
    right.plot(n, 100 * (line / exact - 1), color="#d55e00")
    right.set_xscale("log")
    right.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    right.set_ylabel("error of the line, %")
    for panel in (left, right):
        panel.set_xlabel("exponent n")
    return Drawing(
        "cosine-quadratic-4",
        "[C] figure 4: the slope k(n) and its line",
        svg(figure),
        f"Largest error of the line {found['error']:.2%}, [C] prints 0.5 %; of 0.44813 n + 0.10235 "
        f"{found['refitted']:.2%}. {_INFERRED}",
    )


def _relative_drawing(found: dict[str, Any], lines: dict[int, Any]) -> Drawing:
    figure, (by_angle, *by_exponent) = panels(columns=3)
    exponent, curve = list(lines.items())[1]
    blinn = np.array(curve["blinn"])
    seen = blinn >= _SEEN
    for model in _CURVES:
        style = {"color": _COLOURS[model], "linestyle": _STYLES[model], "label": _NAMES[model]}
        error = np.array(curve[model])[seen] / blinn[seen] - 1
        by_angle.plot(np.array(curve["degrees"])[seen], 100 * error, **style)
        n, absolute, relative = np.transpose(found[model]["by_exponent"])
        for panel, values in zip(by_exponent, (100 * relative, absolute), strict=True):
            panel.plot(n, values, **style)
    by_angle.set_xlabel("gamma, degrees")
    by_angle.set_ylabel(f"relative error at n = {exponent}, %")
    titles = ("largest relative error in the zone, %", "largest absolute error")
    for panel, title in zip(by_exponent, titles, strict=True):
        panel.set_xscale("log")
        panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        panel.set_xlabel("exponent n")
        panel.set_ylabel(title)
    by_exponent[-1].legend(fontsize=8)
    return Drawing(
        "cosine-quadratic-5",
        "[C] figure 5: errors against angle and exponent",
        svg(figure),
        f"Left: where Blinn's model is at least {_SEEN}; middle: at least {ZONE}; right: at all angles. "
        f"{_INFERRED}",
    )


def _coefficient_drawing(found: dict[str, Any]) -> Drawing:
    figure, (panel,) = panels(6.4, 3.2)
    panel.plot(found["exponents"], found["ideal"], color="black", label="ideal")
    panel.plot(found["exponents"], found["line"], color="#d55e00", linestyle="--", label="0.214 (0.807 + n)")
    printed = [(int(f.key[1]), float(f.printed)) for f in PUBLISHED if f.what.startswith("coef")]
    panel.plot(*zip(*printed, strict=True), "s", color="#0072b2", markersize=4, label="printed in [C]")
    panel.set(xscale="log", yscale="log")
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.set_xlabel("exponent n")
    panel.set_ylabel("coef(n)")
    panel.legend(fontsize=8)
    return Drawing(
        "cosine-quadratic-10",
        "[C] figure 10: the normalising coefficient of fQ2 and its line",
        svg(figure),
        _INFERRED,
    )


def _reflectance_drawing(found: dict[str, Any]) -> Drawing:
    figure, (panel,) = panels(6.4, 3.2)
    n, ideal, line = (np.array(found[name]) for name in ("exponents", "ideal", "line"))
    panel.plot(n, 1 / ideal, color="#999999", linestyle=":", label="fQ2 as it is")
    panel.plot(n, line / ideal, color="#d55e00", label="times 0.214 (0.807 + n)")
    panel.axhline(1, color="black", linewidth=0.8, label="energy kept")
    panel.set_xscale("log")
    panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.set_xlabel("exponent n")
    panel.set_ylabel("hemispherical reflectance")
    panel.legend(fontsize=8)
    return Drawing(
        "cosine-quadratic-11",
        "[C] figure 11: hemispherical reflectance of fQ2",
        svg(figure),
        f"Off from 1 by at most {found['deviation']:.4f}, at n = {found['deviation_exponent']}; [C] prints "
        f"53e-3. {_INFERRED}",
    )


def _pictures_drawing(bodies: dict[str, Any]) -> Drawing:
    figure = Figure(figsize=(9.6, 3.8), layout="constrained")
    rows = figure.subplots(len(bodies), len(_PICTURED), squeeze=False)
    for row, found in zip(rows, bodies.values(), strict=True):
        for panel, model in zip(row, _PICTURED, strict=True):
            with Image.open(BytesIO(base64.b64decode(found[model]["png"]))) as image:
                panel.imshow(np.asarray(image), cmap="gray", vmin=0, vmax=255)
            panel.set_axis_off()
    for panel, model in zip(rows[0], _PICTURED, strict=True):
        panel.set_title(_NAMES[model], fontsize=9)
    return Drawing(
        "cosine-quadratic-pictures",
        f"Sphere and teapot in the models of [C], n = {_PICTURE_EXPONENT}",
        svg(figure),
        "Golden renderer, Phong shading. f2's highlight is smaller and ends; fQ and fQ2 are wider at the "
        "peak.",
    )


def _pictures_table(bodies: dict[str, Any]) -> Table:
    return Table(
        "cosine-quadratic-pictures",
        "Errors of those pictures against Blinn's",
        ("body", "model", "largest error, LSB", "99.9th percentile, LSB", "PSNR, dB"),
        [
            [body, model, *(found[model][key] for key in ("max_lsb", "p999_lsb", "psnr_db"))]
            for body, found in bodies.items()
            for model in _PICTURED
            if model != "blinn"
        ],
        f"Unrounded float64 pictures, over the pixels of the body; exponent {_PICTURE_EXPONENT}.",
    )
