"""Phong's and Blinn's highlights by direction, and both by the simulated hardware of the method quotient."""

import base64
import io
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from PIL import Image
from scipy.optimize import brentq

from blysk.bench.accuracy import scene_for
from blysk.bench.report.placed import placed
from blysk.bench.report.section import Drawing, Table
from blysk.bench.surfaces import sphere
from blysk.bench.svg import panels, svg
from blysk.bench.tools.families import DEVICE
from blysk.golden.frames.compare import compare
from blysk.golden.presets import preset
from blysk.golden.reference.lighting import Light
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "METHOD",
    "MODELS",
    "half_angle",
    "hardware_cost",
    "hardware_frames",
    "hardware_table",
    "picture",
    "pictured",
    "pictures_drawing",
    "said_of_hardware",
    "said_of_widths",
    "widths",
    "widths_drawing",
]

METHOD = "quotient"

MODELS = ("blinn", "phong")

_SHAPE = {"degrees": 50, "exponent": 12}
"""a, half of the angle from L to V, and Phong's n, of the pictures and the outline."""


def pictured() -> list[tuple[str, int, str]]:
    """Model, exponent and title of each picture."""
    n, share = _SHAPE["exponent"], math.cos(math.radians(_SHAPE["degrees"])) ** 2
    return [
        ("phong", n, f"true Phong, n = {n}"),
        ("blinn", 4 * n, f"Blinn, 4 n = {4 * n}: alike along"),
        ("blinn", round(4 * n * share), f"Blinn, 4 n cos² a = {round(4 * n * share)}: alike across"),
    ]


def half_angle(way: Sequence[float], degrees: float, exponent: float) -> float:
    """Angle in radians of a normal from H, at which ``(R·V)^n`` is half of its peak; NaN if there is none.

    The angle is found from R·V itself, ``R = 2 (N·L) N - L``.

    Parameters
    ----------
    way : two floats
        Direction in which the normal leaves H: along the plane of L and V, and across it; of length 1.
    degrees : float
        a, half of the angle from L to V.
    exponent : float
        n.
    """
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    light, viewer = np.array([sine, 0, cosine]), np.array([-sine, 0, cosine])

    def excess(gamma: float) -> float:
        normal = np.array([way[0] * math.sin(gamma), way[1] * math.sin(gamma), math.cos(gamma)])
        mirrored = 2 * (normal @ light) * normal - light
        return max(float(mirrored @ viewer), 0.0) ** exponent - 0.5

    return brentq(excess, 0, math.pi / 2) if excess(math.pi / 2) < 0 else math.nan


def _exponent_of(gamma: float) -> float:
    """Blinn's exponent at which the highlight is half of its peak at gamma."""
    return math.log(0.5) / math.log(math.cos(gamma))


def widths(exponents: Sequence[int]) -> dict[str, Any]:
    """Blinn's exponent of the same half-width as Phong's n, over n, along and across the plane of L and V.

    Parameters
    ----------
    exponents : sequence of int
        Phong's n.

    Returns
    -------
    dict
        ``degrees``: a, half of the angle from L to V; ``along`` and ``across``: by n, a ratio for each a, or
        ``None`` where R·V nowhere falls to half; ``outline``: half-width in degrees of Phong's highlight of
        `_SHAPE` at each whole step of 5 degrees round H, from along on.
    """
    degrees = np.arange(0, 86, 2.5).tolist()
    found: dict[str, Any] = {"degrees": degrees}
    for name, way in (("along", (1, 0)), ("across", (0, 1))):
        found[name] = {}
        for exponent in exponents:
            angles = [half_angle(way, a, exponent) for a in degrees]
            ratios = [None if math.isnan(gamma) else _exponent_of(gamma) / exponent for gamma in angles]
            found[name][str(exponent)] = ratios
    round_ = np.radians(np.arange(0, 361, 5))
    ways = np.stack([np.cos(round_), np.sin(round_)], axis=-1)
    found["outline"] = [math.degrees(half_angle(way, **_SHAPE)) for way in ways]
    return found


def hardware_cost(model: str) -> dict[str, int]:
    """`Cost.totals` of the pipeline of a model, and its ``latency``."""
    unit = ShadingPipelineUnit(preset(METHOD, model))
    return cost_of(unit).totals | {"latency": unit.latency}


def hardware_frames(
    model: str, triangles: int, width: int, height: int, exponents: Sequence[int]
) -> list[dict[str, Any]]:
    """Frames of a teapot by the simulated pipeline, against exact normals with the same model.

    Parameters
    ----------
    model : str
        ``"blinn"`` or ``"phong"``.
    triangles, width, height : int
        As for `frame_times`.
    exponents : sequence of int
        Exponents, with a frame for each.

    Returns
    -------
    list of dict
        For each exponent ``triangles``; ``pixels`` shaded, hidden ones included, and ``cycles``; ``lsb``,
        the largest error off the border of the light, ``border_lsb`` at it, and ``bound_lsb``, the bound of
        the frame's own spans; ``rounded``, the share of values within half an LSB; ``engine``.
    """
    design, mesh = preset(METHOD, model), teapot(triangles)
    simulator = FrameSimulator(design, "auto")
    found = []
    for exponent in exponents:
        scene = scene_for(mesh, exponent, width, height)
        frame = simulator.render(scene)
        result = compare(scene, design, frame)
        shown = np.zeros(width * height, dtype=bool)
        shown[frame.raster.pixel[frame.raster.visible]] = True
        off = np.abs(frame.image.reshape(-1, 3)[shown] - 255 * result.golden.reshape(-1, 3)[shown])
        found.append(
            {
                "triangles": len(mesh.faces),
                **{"pixels": frame.pixels, "cycles": frame.cycles, "engine": simulator.engine},
                "lsb": result.method_error.steady_lsb,
                "border_lsb": result.method_error.border_lsb,
                "bound_lsb": result.bound_lsb,
                "rounded": float((off <= 0.5).mean()),
            }
        )
    return found


def picture(model: str, exponent: int, side: int) -> dict[str, Any]:
    """A highlight on a sphere by the simulated pipeline; L and V are twice ``_SHAPE["degrees"]`` apart.

    Parameters
    ----------
    model : str
        ``"blinn"`` or ``"phong"``.
    exponent : int
        Its exponent.
    side : int
        Width and height.

    Returns
    -------
    dict
        ``png``, in base 64, the part with the highlight; ``lsb``, the largest error of the picture off the
        border of the light.
    """
    scene = scene_for(sphere(48), exponent, side, side)
    right, _, towards = scene.camera.axes[0], scene.camera.axes[1], scene.camera.viewer
    turn = math.radians(2 * _SHAPE["degrees"])
    light = Light(tuple(math.cos(turn) * towards - math.sin(turn) * right))
    scene = replace(scene, lights=(light,))
    design = preset(METHOD, model)
    frame = FrameSimulator(design, "auto").render(scene)
    buffer = io.BytesIO()
    part = frame.image[side // 8 : side - side // 8, : side // 2]
    Image.fromarray(part).convert("L").save(buffer, "png", optimize=True)
    error = compare(scene, design, frame).method_error.steady_lsb
    return {"png": base64.b64encode(buffer.getvalue()).decode(), "lsb": error}


def said_of_widths(found: dict[str, Any]) -> str:
    """Largest difference of the ratios from 4 and 4 cos^2 a, at the largest n."""
    n = list(found["along"])[-1]
    a = np.radians(found["degrees"])
    limits = {"along": np.full(len(a), 4.0), "across": 4 * np.cos(a) ** 2}
    off = {
        way: max(abs(x - y) for x, y in zip(found[way][n], limit, strict=True) if x is not None)
        for way, limit in limits.items()
    }
    return (
        '"About 4" holds for coplanar vectors. In the space of normals Phong\'s power n is as wide as '
        "Blinn's "
        "power 4 n along the plane of L and V, and as `4 n cos^2 a` across it, 2 a being the angle from L "
        "to V. "
        f"Half-widths that were found from R·V itself at n = {n} differ from 4 by up to "
        f"{off['along']:.1g}, and "
        f"from `4 cos^2 a` by up to {off['across']:.1g}. So no exponent makes both models equal, unless L "
        "= V."
    )


def said_of_hardware(rows: Sequence[dict[str, Any]]) -> str:
    """Cost, error and cycles of both models in hardware, in a sentence each."""
    said = []
    for model in MODELS:
        own = [row for row in rows if row["model"] == model]
        said.append(
            f"`{model}` takes {own[0]['multipliers']} multipliers and {own[-1]['cycles a pixel']:.3f} "
            "cycles a "
            f"pixel at {own[-1]['triangles']:,} triangles; the largest error found is "
            f"{max(row['largest error, LSB'] for row in own):.2f} LSB, within a bound of "
            f"{max(row['bound, LSB'] for row in own):.2f}"
        )
    return (
        f"In hardware the method `{METHOD}` draws both by the same circuit, as sin² of N·H's angle or of "
        "half of "
        f"R·V's is a quotient of quadratics: {'; '.join(said)}. Each is held against itself in float64."
    )


def hardware_table(frames: Sequence[tuple[dict, list[dict]]], costs: dict[str, dict[str, int]]) -> Table:
    """Table of both models in hardware.

    Parameters
    ----------
    frames : sequence of pairs
        Settings and results of `hardware_frames`.
    costs : dict
        Results of `hardware_cost` by model.
    """
    names = ("multipliers", "cells", "register_bits", "memory_bits", "latency")
    rows = []
    for settings, results in frames:
        model = settings["model"]
        entry = placed(DEVICE).get((METHOD, model), {})
        for exponent, of in zip(settings["exponents"], results, strict=True):
            rows.append(
                [
                    *(model, of["triangles"], f"{settings['width']}x{settings['height']}", exponent),
                    *(of["lsb"], of["bound_lsb"], of["border_lsb"], of["rounded"]),
                    *(of["cycles"], of["pixels"], of["cycles"] / of["pixels"]),
                    *(costs[model][name] for name in names),
                    *(entry.get(name) for name in ("luts", "flip_flops", "fmax_median_mhz")),
                ]
            )
    return Table(
        "phong-blinn-hardware",
        "True Phong beside Blinn in simulated hardware",
        (
            *("model", "triangles", "picture", "exponent", "largest error, LSB", "bound, LSB"),
            *("largest error where the light begins, LSB", "values correctly rounded, share"),
            *("cycles", "pixels", "cycles a pixel"),
            *(name.replace("_", " ") for name in names),
            *("look-up tables", "flip-flops", "clock rate, MHz"),
        ),
        rows,
        f"Method {METHOD}, teapot, one light; pixels of the simulated RTL against exact normals with the "
        "same "
        "model in float64. The bound is that of the frame's own spans. Look-up tables, flip-flops and clock "
        "rates are committed figures of place and route, where there are any.",
    )


def widths_drawing(found: dict[str, Any]) -> Drawing:
    """Drawing of the result of `widths`, with the formulas."""
    figure, (left, right) = panels(9.0, 3.6, 2)
    degrees = np.array(found["degrees"])
    colors = dict(zip(found["along"], ("#56b4e9", "#0072b2", "#d55e00"), strict=False))
    for way, dash in (("along", "-"), ("across", "--")):
        for n, ratios in found[way].items():
            shown = [np.nan if ratio is None else ratio for ratio in ratios]
            left.plot(degrees, shown, dash, color=colors[n], linewidth=1.4, label=f"{way}, n = {n}")
    for formula, label in (
        (np.full(len(degrees), 4.0), "4"),
        (4 * np.cos(np.radians(degrees)) ** 2, "4 cos² a"),
    ):
        left.plot(degrees, formula, ":", color="black", linewidth=1.2, label=label)
    left.set(
        xlabel="a, half of the angle from L to V, degrees",
        ylabel="Blinn's exponent over Phong's",
        ylim=(0, 4.6),
    )
    left.legend(fontsize=6.5, ncols=2, frameon=False, loc="lower left")
    left.set_title("of the same half-width", fontsize=9, loc="left")
    round_ = np.radians(np.arange(0, 361, 5))
    outline = np.array(found["outline"])
    right.plot(outline * np.cos(round_), outline * np.sin(round_), color="#d55e00", label="true Phong, n")
    n, share = _SHAPE["exponent"], math.cos(math.radians(_SHAPE["degrees"])) ** 2
    for exponent, dash, label in ((4 * n, "-", "Blinn, 4 n"), (4 * n * share, "--", "Blinn, 4 n cos² a")):
        radius = math.degrees(math.acos(0.5 ** (1 / exponent)))
        right.plot(radius * np.cos(round_), radius * np.sin(round_), dash, color="#0072b2", label=label)
    right.set(
        xlabel="normal from H along the plane of L and V, degrees",
        ylabel="across it, degrees",
        aspect="equal",
    )
    right.set_title(
        f"where half of the peak is, n = {n}, a = {_SHAPE['degrees']} degrees", fontsize=9, loc="left"
    )
    right.legend(fontsize=6.5, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return Drawing(
        "phong-blinn-widths",
        "Blinn's exponent for Phong's highlight, by direction in the space of normals",
        svg(figure),
        "Left: fitted to the half-width of (R·V)^n, which is found from R·V itself, against 4 along the "
        "plane of L "
        "and V and 4 cos² a across it. Right: both highlights from above.",
    )


def pictures_drawing(found: Sequence[tuple[dict, dict]]) -> Drawing:
    """Drawing of the pictures, from settings and results of `picture` in the order of `pictured`."""
    figure, row = panels(9.0, 3.3, len(found))
    for axes, (_, result), (_, _, title) in zip(row, found, pictured(), strict=True):
        image = Image.open(io.BytesIO(base64.b64decode(result["png"])))
        axes.imshow(np.asarray(image), cmap="gray", vmin=0, vmax=255)
        axes.set(xticks=(), yticks=())
        axes.grid(False)
        axes.set_title(title, fontsize=8)
        axes.set_xlabel(f"largest error {result['lsb']:.2f} LSB", fontsize=8)
    return Drawing(
        "phong-blinn-pictures",
        "True Phong and Blinn by simulated hardware",
        svg(figure),
        f"A sphere, the light {2 * _SHAPE['degrees']} degrees from the viewer. Phong's highlight is wider "
        "across the "
        "plane of L and V than along it; Blinn's is a circle in the space of normals.",
    )
