"""Drawings of the report's section on the cosine-quadratic models."""

import base64
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from blysk.bench.report.cosine_quadratic_figures import (
    CURVES,
    INFERRED,
    PICTURE_EXPONENT,
    PICTURED,
    PUBLISHED,
    SEEN,
    ZONE,
)
from blysk.bench.report.section import Drawing
from blysk.bench.svg import panels, svg

__all__ = [
    "coefficient_drawing",
    "curves_drawing",
    "map_drawing",
    "pictures_drawing",
    "reflectance_drawing",
    "relative_drawing",
    "slope_drawing",
]


_NAMES = {"blinn": "Blinn", "cosquad": "f2", "cosquad_q": "fQ, Q = 0.64", "cosquad_lin": "fQ2"}

_COLOURS = {"blinn": "black", "cosquad": "#d55e00", "cosquad_q": "#0072b2", "cosquad_lin": "#009e73"}

_STYLES = {"blinn": "-", "cosquad": "-", "cosquad_q": "--", "cosquad_lin": ":"}


def curves_drawing(lines: dict[int, Any]) -> Drawing:
    """Largest error of each model against the exponent."""
    figure, row = panels(columns=len(lines))
    for (exponent, found), panel in zip(lines.items(), row, strict=True):
        for model in ("blinn", *CURVES):
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
        f"fQ and fQ2 lie on each other. {INFERRED}",
    )


def map_drawing(number: str, model: str, found: dict[str, Any]) -> Drawing:
    """Error of a model by exponent and cosine."""
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
        f"Largest on this grid: {extent:.3f}. {INFERRED}",
    )


def slope_drawing(found: dict[str, Any]) -> Drawing:
    """Slopes with a small error, exact and by [C]'s line, against the exponent."""
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
        f"Largest error of the line {found['error']:.2%}, [C] states 0.5 %; of 0.44813 n + 0.10235 "
        f"{found['refitted']:.2%}. {INFERRED}",
    )


def relative_drawing(found: dict[str, Any], lines: dict[int, Any]) -> Drawing:
    """Relative error of each model where the highlight is bright."""
    figure, (by_angle, *by_exponent) = panels(columns=3)
    exponent, curve = list(lines.items())[1]
    blinn = np.array(curve["blinn"])
    seen = blinn >= SEEN
    for model in CURVES:
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
        f"Left: where Blinn's model is at least {SEEN}; middle: at least {ZONE}; right: at all angles. "
        f"{INFERRED}",
    )


def coefficient_drawing(found: dict[str, Any]) -> Drawing:
    """Coefficients of a fit against the exponent."""
    figure, (panel,) = panels(6.4, 3.2)
    panel.plot(found["exponents"], found["ideal"], color="black", label="ideal")
    panel.plot(found["exponents"], found["line"], color="#d55e00", linestyle="--", label="0.214 (0.807 + n)")
    published = [(int(f.key[1]), float(f.published)) for f in PUBLISHED if f.what.startswith("coef")]
    panel.plot(*zip(*published, strict=True), "s", color="#0072b2", markersize=4, label="published in [C]")
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
        INFERRED,
    )


def reflectance_drawing(found: dict[str, Any]) -> Drawing:
    """Reflectance of the models against the angle."""
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
        f"Off from 1 by at most {found['deviation']:.4f}, at n = {found['deviation_exponent']}; [C] states "
        f"53e-3. {INFERRED}",
    )


def pictures_drawing(bodies: dict[str, Any]) -> Drawing:
    """Pictures of the models on two bodies."""
    figure = Figure(figsize=(9.6, 3.8), layout="constrained")
    rows = figure.subplots(len(bodies), len(PICTURED), squeeze=False)
    for row, found in zip(rows, bodies.values(), strict=True):
        for panel, model in zip(row, PICTURED, strict=True):
            with Image.open(BytesIO(base64.b64decode(found[model]["png"]))) as image:
                panel.imshow(np.asarray(image), cmap="gray", vmin=0, vmax=255)
            panel.set_axis_off()
    for panel, model in zip(rows[0], PICTURED, strict=True):
        panel.set_title(_NAMES[model], fontsize=9)
    return Drawing(
        "cosine-quadratic-pictures",
        f"Sphere and teapot in the models of [C], n = {PICTURE_EXPONENT}",
        svg(figure),
        "Golden renderer, Phong shading. f2's highlight is smaller and ends; fQ and fQ2 are wider at the "
        "peak.",
    )
