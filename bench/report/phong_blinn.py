"""The report's section on [P]: exponents of Phong and Blinn, both in hardware, operations, frame times."""

import base64
import io
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from PIL import Image
from scipy.optimize import brentq

from blysk.bench.accuracy import scene_for
from blysk.bench.report.cosine_quadratic_figures import sphere
from blysk.bench.report.placed import placed
from blysk.bench.report.section import Drawing, Section, Table
from blysk.bench.report.thesis_figures import fastest
from blysk.bench.report.thesis_ways import Counted, dot
from blysk.bench.store import Task
from blysk.bench.svg import panels, svg
from blysk.bench.tools.families import DEVICE
from blysk.golden.frames.compare import compare
from blysk.golden.presets import preset
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS, exponent_ratio
from blysk.golden.reference.renderer import render
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "FEWER_OPERATIONS",
    "LESS_TIME",
    "PIXELS",
    "WAYS",
    "exponents",
    "frame_times",
    "half_angle",
    "hardware_cost",
    "hardware_frames",
    "operations",
    "picture",
    "section",
    "shading_times",
    "tasks",
    "widths",
]

FEWER_OPERATIONS = (0.20, 0.35)
"""[P]: share of operations that Blinn's model saves against Phong's."""

LESS_TIME = (0.40, 0.45)
"""[P]: largest share of a frame's time that Blinn's model saves, at a million polygons and 1920x1080."""

PIXELS = 1 << 14
"""Pixels that the ways in software compute at once: their arrays stay in a processor's cache."""

_METHOD = "quotient"
_HARDWARE_MODELS = ("blinn", "phong")
_SHAPE = {"degrees": 50, "exponent": 12}
_EXPONENT = 50
_TRIANGLES = (1_000, 10_000, 100_000, 1_000_000)
_WIDTHS = (10, 100, 1000)


def _pictured() -> list[tuple[str, int, str]]:
    """Model, exponent and title of each picture."""
    n, share = _SHAPE["exponent"], math.cos(math.radians(_SHAPE["degrees"])) ** 2
    return [
        ("phong", n, f"true Phong, n = {n}"),
        ("blinn", 4 * n, f"Blinn, 4 n = {4 * n}: alike along"),
        ("blinn", round(4 * n * share), f"Blinn, 4 n cos² a = {round(4 * n * share)}: alike across"),
    ]


# The ways in software: cosine of the highlight of a pixel from unit vectors N, L and V, as arrays of three
# rows, and of the diffuse term; then the power. What is the same for a whole frame has one column.


def _halfway(light: np.ndarray, viewer: np.ndarray) -> np.ndarray:
    total = light + viewer
    return total / np.sqrt(dot(total, total))


def _shaded(cosine: np.ndarray, highlight: np.ndarray) -> np.ndarray:
    power = np.maximum(highlight, 0.0) ** float(_EXPONENT)
    return np.maximum(cosine, 0.0) * 0.4 + power * 0.5 + 0.1


def _phong_vector(normal, light, viewer):
    cosine = dot(normal, light)
    mirrored = 2 * cosine * normal - light
    return _shaded(cosine, dot(mirrored, viewer))


def _phong_scalar(normal, light, viewer):
    cosine = dot(normal, light)
    return _shaded(cosine, 2 * cosine * dot(normal, viewer) - dot(light, viewer))


def _blinn(normal, light, viewer):
    return _shaded(dot(normal, light), dot(normal, _halfway(light, viewer)))


WAYS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "Phong, vector R": _phong_vector,
    "Phong, 2 (N·L)(N·V) - L·V": _phong_scalar,
    "Blinn": _blinn,
}
"""Functions from N, L and V to a pixel's brightness in one channel, with diffuse and ambient light."""


def _vectors(local: bool) -> list[np.ndarray]:
    """Random unit N of every pixel, and L and V of every pixel or of the frame."""
    rng = np.random.default_rng(1)
    columns = (PIXELS, PIXELS if local else 1, PIXELS if local else 1)
    vectors = [rng.normal(size=(3, count)) for count in columns]
    return [vector / np.sqrt(dot(vector, vector)) for vector in vectors]


def exponents() -> dict[str, list[float]]:
    """[P] figure 5: Blinn's exponent n over Phong's p for the same brightness, at angles gamma.

    Returns
    -------
    dict
        ``degrees``, 0 to 44, and ``ratio``: ``ln(2c^2 - 1)/ln c``.
    """
    degrees = np.linspace(0, 44, 177)
    return {"degrees": degrees.tolist(), "ratio": exponent_ratio(np.cos(np.radians(degrees))).tolist()}


def operations(way: str, local: bool) -> dict[str, float]:
    """Operations of a pixel, by kind, counted during the computation.

    Parameters
    ----------
    way : str
        One of `WAYS`.
    local : bool
        Whether every pixel has its own L and V; else L, V, L·V and H are computed once a frame, and hardly
        count.

    Returns
    -------
    dict
        Operations of a pixel by kind: see `Counted`.
    """
    counts: Counter[str] = Counter()
    WAYS[way](*(Counted.of(vector, counts) for vector in _vectors(local)))
    return {kind: count / PIXELS for kind, count in counts.items()}


def shading_times(local: bool, repeats: int) -> dict[str, float]:
    """Times of the ways on the same pixels, in one run, as ratios to that of Phong's vector R.

    Parameters
    ----------
    local : bool
        As for `operations`.
    repeats : int
        Runs of each, in turn; the fastest counts.
    """
    vectors = _vectors(local)
    times = fastest([lambda way=way: way(*vectors) for way in WAYS.values()], repeats)
    return {name: time / times[0] for name, time in zip(WAYS, times, strict=True)}


def frame_times(triangles: int, width: int, height: int, repeats: int) -> dict[str, Any]:
    """[P] figure 8: time of a frame by the golden renderer with Phong's and with Blinn's model, in one run.

    Parameters
    ----------
    triangles : int
        Triangles of the teapot, about.
    width, height : int
        Size of the picture.
    repeats : int
        Runs of each, in turn; the fastest counts.

    Returns
    -------
    dict
        ``triangles``; ``pixels`` that show the teapot; ``raster``, ``phong`` and ``blinn``: seconds of
        geometry, and of shading by each model.
    """
    scene = scene_for(teapot(triangles), _EXPONENT, width, height)
    raster = rasterise(scene)
    times = fastest(
        [
            lambda: rasterise(scene),
            lambda: render(scene, "phong", REFLECTION_MODELS["phong"], raster),
            lambda: render(scene, "phong", REFLECTION_MODELS["blinn"], raster),
        ],
        repeats,
    )
    return {
        "triangles": len(scene.mesh.faces),
        "pixels": int(raster.visible.sum()),
        **dict(zip(("raster", "phong", "blinn"), times, strict=True)),
    }


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
    unit = ShadingPipelineUnit(preset(_METHOD, model))
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
    design, mesh = preset(_METHOD, model), teapot(triangles)
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
    design = preset(_METHOD, model)
    frame = FrameSimulator(design, "auto").render(scene)
    buffer = io.BytesIO()
    part = frame.image[side // 8 : side - side // 8, : side // 2]
    Image.fromarray(part).convert("L").save(buffer, "png", optimize=True)
    error = compare(scene, design, frame).method_error.steady_lsb
    return {"png": base64.b64encode(buffer.getvalue()).decode(), "lsb": error}


def tasks(quick: bool) -> list[Task]:
    """Measurements of the section.

    Parameters
    ----------
    quick : bool
        Whether frames have up to 10,000 triangles at 320x240; else up to a million at 1920x1080.
    """
    found = [Task(exponents), Task(widths, {"exponents": list(_WIDTHS)})]
    for local in (False, True):
        found += [Task(operations, {"way": way, "local": local}) for way in WAYS]
        found.append(Task(shading_times, {"local": local, "repeats": 20 if quick else 100}, timed=True))
    size = {"width": 320, "height": 240} if quick else {"width": 1920, "height": 1080}
    for count in _TRIANGLES[:2] if quick else _TRIANGLES:
        settings = {"triangles": count, **size}
        found.append(Task(frame_times, {**settings, "repeats": 9 if quick else 2}, timed=True))
        errors = {"exponents": [_EXPONENT] if count != _TRIANGLES[1] else [1, 10, _EXPONENT, 100, 1000]}
        found += [Task(hardware_frames, {"model": model, **settings, **errors}) for model in _HARDWARE_MODELS]
    found += [Task(hardware_cost, {"model": model}) for model in _HARDWARE_MODELS]
    side = 240 if quick else 480
    return found + [Task(picture, {"model": m, "exponent": n, "side": side}) for m, n, _ in _pictured()]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section from the results of its tasks."""
    functions = (exponents, widths, operations, shading_times, frame_times)
    functions += (hardware_frames, hardware_cost, picture)
    by = {
        function: [
            (task.settings, result)
            for task, result in zip(tasks, results, strict=True)
            if task.function is function
        ]
        for function in functions
    }
    ratio = by[exponents][0][1]
    ways = _ways_table(by[operations], by[shading_times])
    hardware = _hardware_table(by[hardware_frames], dict(_by_model(by[hardware_cost])))
    frames = _frames_table(by[frame_times], hardware.records())
    rows = ways.records()
    smallest, *_, largest = frames.records()
    size = by[frame_times][-1][0]
    frame_wide, own = (
        {
            row["way"]: row["fewer operations than Phong, vector R"]
            for row in rows
            if row["L and V are"] == kind
        }
        for kind in dict.fromkeys(row["L and V are"] for row in rows)
    )
    scalar = list(WAYS)[1]
    text = [
        "[P] compares Phong's model, `(R·V)^p`, with Blinn's, `(N·H)^n`. For the same brightness "
        f"`n/p = ln(2c^2 - 1)/ln c` (figure 5), which is {ratio['ratio'][0]:.3g} at the peak and "
        f"{np.interp(30, ratio['degrees'], ratio['ratio']):.3g} at 30 degrees.",
        _said_of_widths(by[widths][0][1]),
        _said_of_hardware(hardware.records()),
        f"Operations: [P] has {FEWER_OPERATIONS[0]:.0%} to {FEWER_OPERATIONS[1]:.0%} fewer for Blinn. "
        "Counted here, with diffuse and ambient light, against Phong by the vector R: "
        f"{_fewer(frame_wide['Blinn'])} where L and V are of the whole frame, {_fewer(own['Blinn'])} where "
        "every pixel has its own, and H is normalised at each. The scalar form of Phong's own model takes "
        f"{_fewer(frame_wide[scalar])} and {_fewer(own[scalar])}.",
        f"Time of a frame (figure 8): [P] has up to {LESS_TIME[0]:.0%} to {LESS_TIME[1]:.0%} less at a "
        "million polygons, 1920x1080. With Blinn's model the golden renderer takes "
        f"{_less(largest['less time with Blinn, frame'])} for the frame and "
        f"{_less(largest['less time with Blinn, shading'])} for its shading at {largest['triangles']:,} "
        f"triangles, {size['width']}x{size['height']}. It shades only what is seen: geometry takes "
        f"{smallest['share of geometry']:.0%} of Blinn's frame at {smallest['triangles']:,} triangles and "
        f"{largest['share of geometry']:.0%} at {largest['triangles']:,}, and what a model saves counts the "
        "less.",
    ]
    parts = [
        *(_exponent_drawing(ratio), _widths_drawing(by[widths][0][1]), _pictures_drawing(by[picture])),
        *(hardware, ways, frames, _frames_drawing(frames, size)),
    ]
    return Section("phong-blinn", "Experiments of [P]: Phong and Blinn", text, parts, appendix=True)


def _by_model(results: Sequence[tuple[dict, Any]]) -> list[tuple[str, Any]]:
    return [(settings["model"], result) for settings, result in results]


def _said_of_widths(found: dict[str, Any]) -> str:
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


def _said_of_hardware(rows: Sequence[dict[str, Any]]) -> str:
    """Cost, error and cycles of both models in hardware, in a sentence each."""
    said = []
    for model in _HARDWARE_MODELS:
        own = [row for row in rows if row["model"] == model]
        said.append(
            f"`{model}` takes {own[0]['multipliers']} multipliers and {own[-1]['cycles a pixel']:.3f} "
            "cycles a "
            f"pixel at {own[-1]['triangles']:,} triangles; the largest error found is "
            f"{max(row['largest error, LSB'] for row in own):.2f} LSB, within a bound of "
            f"{max(row['bound, LSB'] for row in own):.2f}"
        )
    return (
        f"In hardware the method `{_METHOD}` draws both by the same circuit, as sin² of N·H's angle or of "
        "half of "
        f"R·V's is a quotient of quadratics: {'; '.join(said)}. Each is held against itself in float64."
    )


def _hardware_table(frames: Sequence[tuple[dict, list[dict]]], costs: dict[str, dict[str, int]]) -> Table:
    names = ("multipliers", "cells", "register_bits", "memory_bits", "latency")
    rows = []
    for settings, results in frames:
        model = settings["model"]
        entry = placed(DEVICE).get((_METHOD, model), {})
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
        f"Method {_METHOD}, teapot, one light; pixels of the simulated RTL against exact normals with the "
        "same "
        "model in float64. The bound is that of the frame's own spans. Look-up tables, flip-flops and clock "
        "rates are committed figures of place and route, where there are any.",
    )


def _fewer(share: float) -> str:
    return f"{abs(share):.0%} {'fewer' if share >= 0 else 'more'}"


def _less(share: float) -> str:
    return f"{abs(share):.1%} {'less' if share >= 0 else 'more'} time"


_KINDS = ("multiplications", "additions", "divisions", "roots", "functions", "comparisons")


def _ways_table(counted: Sequence[tuple[dict, dict]], timed: Sequence[tuple[dict, dict]]) -> Table:
    times = {settings["local"]: result for settings, result in timed}
    totals = {(s["way"], s["local"]): sum(result.values()) for s, result in counted}
    rows, grades = [], []
    for settings, result in counted:
        way, local = settings["way"], settings["local"]
        reference = totals["Phong, vector R", local]
        fewer = None if way == "Phong, vector R" else 1 - totals[way, local] / reference
        less = None if fewer is None else 1 - times[local][way]
        rows.append(
            [
                *("each pixel's" if local else "the frame's", way),
                *(result.get(kind, 0.0) for kind in _KINDS),
                *(totals[way, local], fewer, less),
            ]
        )
        grade = ""
        if way == "Blinn":
            grade = "good" if fewer >= FEWER_OPERATIONS[0] else "fair" if fewer > 0 else "bad"
        grades.append([""] * 9 + [grade, ""])
    return Table(
        "phong-blinn-operations",
        "Operations and time of a pixel's shading, Phong and Blinn",
        (
            *("L and V are", "way", *_KINDS, "all"),
            *("fewer operations than Phong, vector R", "less time than Phong, vector R"),
        ),
        rows,
        "One channel, one light, diffuse and ambient light included, a power as one function; counted and "
        "timed while NumPy does them in float64; times in one run, in turn, the fastest of many. In "
        f"[P]: {FEWER_OPERATIONS[0]:.0%} to {FEWER_OPERATIONS[1]:.0%} fewer operations. Green: as many; "
        "yellow: fewer, but not so many; red: more.",
        grades,
    )


def _frames_table(timed: Sequence[tuple[dict, dict]], simulated: Sequence[dict[str, Any]]) -> Table:
    cycles = {
        row["triangles"]: row
        for row in simulated
        if row["model"] == _HARDWARE_MODELS[0] and row["exponent"] == _EXPONENT
    }
    rows = []
    for _, result in timed:
        phong, blinn = (result["raster"] + result[model] for model in ("phong", "blinn"))
        run = cycles[result["triangles"]]
        rows.append(
            [
                *(result["triangles"], result["pixels"], phong / result["pixels"] * 1e9),
                *(blinn / result["pixels"] * 1e9, 1 - blinn / phong),
                *(
                    1 - result["blinn"] / result["phong"],
                    LESS_TIME[1] if run["triangles"] > 900_000 else None,
                ),
                result["raster"] / (result["raster"] + result["blinn"]),
                *(run["cycles"], run["pixels"], run["cycles a pixel"]),
            ]
        )
    width, height = timed[0][0]["width"], timed[0][0]["height"]
    return Table(
        "phong-blinn-frames",
        "[P] figure 8: time of a frame with Phong's and with Blinn's model",
        (
            *("triangles", "visible pixels", "Phong, ns a visible pixel", "Blinn, ns a visible pixel"),
            *("less time with Blinn, frame", "less time with Blinn, shading", "published, at most"),
            "share of geometry",
            *("hardware cycles", "pixels shaded in hardware", "cycles a pixel"),
        ),
        rows,
        f"Teapot at {width}x{height}, exponent {_EXPONENT}. Times: processor time of the golden renderer, "
        "NumPy in float64, both models in one run; they are of the machine that made this report, the "
        f"ratios are not. Cycles: simulated pipeline, method {_METHOD}, model {_HARDWARE_MODELS[0]}, hidden "
        "pixels included.",
    )


def _exponent_drawing(found: dict[str, list[float]]) -> Drawing:
    figure, (panel,) = panels(6.4, 3.2)
    panel.plot(found["degrees"], found["ratio"], color="#0072b2", label="ln(2c² - 1) / ln c")
    panel.axhline(4, color="black", linestyle=":", label="4, at the peak")
    panel.set_xlabel("gamma, degrees")
    panel.set_ylabel("n / p")
    panel.set_xlim(0, found["degrees"][-1])
    panel.set_ylim(0, math.ceil(found["ratio"][-1]))
    panel.legend(fontsize=8)
    return Drawing(
        "phong-blinn-5",
        "[P] figure 5: Blinn's exponent over Phong's for the same brightness",
        svg(figure),
        "For coplanar vectors, where R and V are twice as far apart as N and H; at 45 degrees Phong's model "
        "is dark. 4 is the factor of the peak; [P] itself says that it does not hold towards pi/2.",
    )


def _widths_drawing(found: dict[str, Any]) -> Drawing:
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


def _pictures_drawing(found: Sequence[tuple[dict, dict]]) -> Drawing:
    figure, row = panels(9.0, 3.3, len(found))
    for axes, (_, result), (_, _, title) in zip(row, found, _pictured(), strict=True):
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


def _frames_drawing(frames: Table, size: dict[str, int]) -> Drawing:
    rows = frames.records()
    triangles = [row["triangles"] for row in rows]
    figure, (left, right) = panels(9.0, 3.2, 2)
    for model, marker, colour in (("Phong", "o", "#d55e00"), ("Blinn", "s", "#0072b2")):
        times = [row[f"{model}, ns a visible pixel"] * row["visible pixels"] / 1e9 for row in rows]
        left.plot(triangles, times, color=colour, marker=marker, label=f"{model}'s model")
    left.set_ylabel("time of a frame, s")
    right.plot(triangles, [row["cycles a pixel"] for row in rows], color="#009e73", marker="o", label=_METHOD)
    right.set_ylabel("hardware cycles a pixel")
    for panel in (left, right):
        panel.set_xscale("log")
        panel.set_xlabel("triangles")
        panel.set_ylim(0, 1.1 * max(max(line.get_ydata()) for line in panel.lines))
        panel.legend(fontsize=8)
    return Drawing(
        "phong-blinn-8",
        f"[P] figure 8: time of a frame against polygons, {size['width']}x{size['height']}",
        svg(figure),
        "Left: golden renderer in NumPy, the whole frame. Right: the simulated pipeline; spans get shorter "
        "with more triangles, and each takes a setup interval at least.",
    )
