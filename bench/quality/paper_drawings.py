"""Drawings of the paper: errors over the exponent, methods by error and cycles, and the datapath."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch
from matplotlib.ticker import NullLocator

from blysk.bench.labels import Label, place_labels
from blysk.bench.svg import panels

__all__ = ["MOST_SHOWN", "STAGES", "draw_exponents", "draw_front", "draw_pipeline"]

STAGES = (
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

MOST_SHOWN = 0.7
"""Largest error in the drawing of methods, in LSB."""


def _write(figure: Figure, path: Path) -> None:
    figure.savefig(path, metadata={"CreationDate": None})


def _ticks(axis: Axis, *values: float) -> None:
    axis.set_ticks(values, [f"{value:g}" for value in values])
    axis.set_minor_locator(NullLocator())


def draw_exponents(path: Path, found: Mapping[str, Any], exponents: Sequence[int]) -> None:
    """Largest errors and bounds over the exponent.

    Parameters
    ----------
    path : Path
        The PDF to write.
    found : dict
        ``blinn`` and ``phong``, each with pairs of error and bound in LSB.
    exponents : sequence of int
        Exponent of each pair.
    """
    figure, (axes,) = panels(3.4, 2.1)
    for model, color in (("blinn", "#0072b2"), ("phong", "#b0508a")):
        errors, bounds = np.array(found[model], dtype=float).T
        axes.plot(exponents, errors, "o-", color=color, markersize=3, linewidth=1, label=f"{model}: found")
        axes.plot(exponents, bounds, "--", color=color, linewidth=1, label=f"{model}: bound")
    axes.set(xscale="log", xlabel="exponent n", ylabel="error, LSB")
    _ticks(axes.xaxis, 1, 10, 100, 1000)
    axes.axhline(0.5, color="#999999", linewidth=0.8)
    axes.legend(fontsize=7, frameon=False)
    _write(figure, path)


def draw_front(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Methods by error and cycles a pixel. Full points are exact tables, hollow points are `cosquad`.

    Parameters
    ----------
    path : Path
        The PDF to write.
    rows : sequence of dict
        ``method``, ``model``, ``error`` in LSB and ``cycles`` a pixel of each method, the most exact first.
        Errors over `MOST_SHOWN` are not drawn.
    """
    figure, (axes,) = panels(3.4, 3.1)
    labels: dict[str, Label] = {}
    rows = [row for row in rows if row["error"] <= MOST_SHOWN]
    for row in rows:
        color = "#0072b2" if row["method"] == "quotient" else "#444444"
        place = row["cycles"], row["error"]
        face = "none" if row["model"] == "cosquad" else color
        axes.plot(*place, "o", color=color, markerfacecolor=face, markersize=3, markeredgewidth=0.7)
        name = "quotient, phong" if row["model"] == "phong" else row["method"]
        if row["model"] != "cosquad":
            labels.setdefault(name, Label(*place, name, color))
    axes.set(xscale="log", xlabel="cycles a pixel", ylabel="largest error, LSB", ylim=(0.47, MOST_SHOWN))
    axes.axhline(0.5, color="#999999", linewidth=0.8)
    axes.margins(x=0.2)
    _ticks(axes.xaxis, 1, 2, 5, 10)
    place_labels(axes, list(labels.values()), [(row["cycles"], row["error"]) for row in rows])
    _write(figure, path)


def draw_pipeline(path: Path) -> None:
    """The datapath of one light, with the multipliers of each stage."""
    figure, (axes,) = panels(7, 1.1)
    axes.set(xlim=(0, len(STAGES)), ylim=(0, 1))
    axes.axis("off")
    for k, (text, multipliers) in enumerate(STAGES):
        face = "#f9d9b8" if multipliers else "#eef1f4"
        place = (k + 0.1, 0.3), 0.74, 0.62, "round,pad=0.02"
        axes.add_patch(FancyBboxPatch(*place, facecolor=face, edgecolor="#35506b"))
        axes.text(k + 0.47, 0.61, text, ha="center", va="center", fontsize=7)
        if multipliers:
            axes.text(k + 0.47, 0.1, str(multipliers), ha="center", va="center", fontsize=7)
        if k:
            arrow = {"arrowstyle": "->", "color": "#35506b"}
            axes.annotate("", (k + 0.1, 0.61), (k - 0.14, 0.61), arrowprops=arrow)
    _write(figure, path)
