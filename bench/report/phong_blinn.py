"""The report's section on [P]: exponents of Phong and Blinn, both in hardware, operations, frame times."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.report.phong_blinn_hardware import (
    METHOD,
    MODELS,
    hardware_cost,
    hardware_frames,
    hardware_table,
    picture,
    pictured,
    pictures_drawing,
    said_of_hardware,
    said_of_widths,
    widths,
    widths_drawing,
)
from blysk.bench.report.section import Drawing, Section, Table
from blysk.bench.report.thesis_figures import fastest
from blysk.bench.report.thesis_ways import Counted, dot
from blysk.bench.store import Task
from blysk.bench.svg import panels, svg
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS, exponent_ratio
from blysk.golden.reference.renderer import render
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "FEWER_OPERATIONS",
    "LESS_TIME",
    "PIXELS",
    "WAYS",
    "exponents",
    "frame_times",
    "operations",
    "section",
    "shading_times",
    "tasks",
]

FEWER_OPERATIONS = (0.20, 0.35)
"""[P]: share of operations that Blinn's model saves against Phong's."""

LESS_TIME = (0.40, 0.45)
"""[P]: largest share of a frame's time that Blinn's model saves, at a million polygons and 1920x1080."""

PIXELS = 1 << 14
"""Pixels that the ways in software compute at once: their arrays stay in a processor's cache."""

_EXPONENT = 50
_TRIANGLES = (1_000, 10_000, 100_000, 1_000_000)
_WIDTHS = (10, 100, 1000)


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
        found += [Task(hardware_frames, {"model": model, **settings, **errors}) for model in MODELS]
    found += [Task(hardware_cost, {"model": model}) for model in MODELS]
    side = 240 if quick else 480
    return found + [Task(picture, {"model": m, "exponent": n, "side": side}) for m, n, _ in pictured()]


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
    hardware = hardware_table(by[hardware_frames], dict(_by_model(by[hardware_cost])))
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
        said_of_widths(by[widths][0][1]),
        said_of_hardware(hardware.records()),
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
        *(_exponent_drawing(ratio), widths_drawing(by[widths][0][1]), pictures_drawing(by[picture])),
        *(hardware, ways, frames, _frames_drawing(frames, size)),
    ]
    return Section("phong-blinn", "Experiments of [P]: Phong and Blinn", text, parts, appendix=True)


def _by_model(results: Sequence[tuple[dict, Any]]) -> list[tuple[str, Any]]:
    return [(settings["model"], result) for settings, result in results]


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
        if row["model"] == MODELS[0] and row["exponent"] == _EXPONENT
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
        f"ratios are not. Cycles: simulated pipeline, method {METHOD}, model {MODELS[0]}, hidden "
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


def _frames_drawing(frames: Table, size: dict[str, int]) -> Drawing:
    rows = frames.records()
    triangles = [row["triangles"] for row in rows]
    figure, (left, right) = panels(9.0, 3.2, 2)
    for model, marker, colour in (("Phong", "o", "#d55e00"), ("Blinn", "s", "#0072b2")):
        times = [row[f"{model}, ns a visible pixel"] * row["visible pixels"] / 1e9 for row in rows]
        left.plot(triangles, times, color=colour, marker=marker, label=f"{model}'s model")
    left.set_ylabel("time of a frame, s")
    right.plot(triangles, [row["cycles a pixel"] for row in rows], color="#009e73", marker="o", label=METHOD)
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
