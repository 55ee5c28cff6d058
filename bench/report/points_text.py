"""Tables and text of the report's section on error against run time."""

from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from blysk.bench.report.frames import ERRORS, TIMES
from blysk.bench.report.perception import (
    CIEDE2000_MAX,
    CIEDE2000_P99,
    FLIP_MAX,
    FLIP_P99,
    LARGEST_LSB,
)
from blysk.bench.report.section import Cell, Grade, Table
from blysk.bench.tools.families import DEVICE
from blysk.golden.frames.border import BORDER
from blysk.golden.presets import METHODS, MIRROR_LOBES

__all__ = [
    "front",
    "front_table",
    "fronts_of",
    "table",
    "text",
]


# The section.


def front(error: Sequence[float | None], time: Sequence[float | None]) -> np.ndarray:
    """Whether points are on the Pareto front.

    A point is on the front if no other point is better in one measure and at least as good in the other.

    Parameters
    ----------
    error, time : sequences of float
        Measures of each point. Less is better. A point that lacks a measure (``None`` or NaN) is not on the
        front, and beats no point.

    Returns
    -------
    bool array, shape (points,)
    """
    values = np.array([error, time], dtype=np.float64)
    values[:, np.isnan(values).any(axis=0)] = np.nan
    # [k, i, j]: measure k of point j against measure k of point i.
    no_worse = (values[:, np.newaxis] <= values[:, :, np.newaxis]).all(axis=0)
    better = (values[:, np.newaxis] < values[:, :, np.newaxis]).any(axis=0)
    return ~(no_worse & better).any(axis=1) & ~np.isnan(values).any(axis=0)


def _by_scene(points: Sequence[Mapping[str, Any]]) -> dict[tuple[str, int], list[Mapping[str, Any]]]:
    """Points by mesh and exponent. Only points of the same mesh and exponent can be compared."""
    found: dict[tuple[str, int], list] = {}
    for point in points:
        found.setdefault((point["settings"]["source"], point["settings"]["exponent"]), []).append(point)
    return found


def _measured(points: Sequence[Mapping[str, Any]], kind: str, axis: Mapping[str, str]) -> list[float | None]:
    """A measure of points. Its sign is changed if more is better, so that less is always better."""
    # PSNR falls as RMSE grows, and equal images have no PSNR that JSON could hold.
    values = [point[kind][axis["key"].replace("psnr_db", "rmse_lsb")] for point in points]
    if axis["better"] == "less" or axis["key"].endswith("psnr_db"):
        return values
    return [None if value is None else -value for value in values]


def fronts_of(points: Sequence[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Ids of the points on the front of each pair of measures, for all meshes and exponents."""
    found = {}
    scenes = _by_scene(points).values()
    for error in ERRORS:
        for time in TIMES:
            found[f"{error['key']}|{time['key']}"] = [
                scene[index]["id"]
                for scene in scenes
                for index in np.flatnonzero(
                    front(_measured(scene, "errors", error), _measured(scene, "times", time))
                )
            ]
    return found


def text(points: Sequence[Mapping[str, Any]]) -> list[str]:
    """Paragraphs about the points: error and time at each mesh and exponent, and the measures explained."""
    of_error = (
        "Errors are in steps (LSB) of an 8-bit channel of linear light, over the pixels that show the "
        "surface:\n\n"
        "- *Model* error: the reflection model against Blinn's, both in float64 with exact normals. "
        "Arithmetic does not change this error.\n"
        "- *Arithmetic* error: the frame against the same method and model in float64. A correctly rounded "
        "frame has 0.5. Errors from the coefficients of a published variant count as arithmetic error.\n"
        "- *Method* error: the frame against exact normals of every pixel with the same model.\n"
        "- *Total* error: the frame against the exact frame, Phong shading as on a GPU. The exact frame has "
        "exact normals at every pixel and Blinn's model. For `phong`, which does not approximate Blinn's "
        "model, the exact frame has the model (R·V)^n.\n\n"
        "Methods of the documents have points with their operand N.H, and with the more exact operand "
        "1 - N.H. If the published variant differs, it has points, too. FLIP and CIEDE2000 measure the "
        "difference that an eye sees, of frames encoded as sRGB. A frame is *identical to the eye* if its "
        f"largest error is at most {LARGEST_LSB:g} LSB of sRGB. With a larger error two conditions must "
        f"hold. FLIP is at most {FLIP_P99:g} in 99 % of the pixels, and at most {FLIP_MAX:g} in all. "
        f"CIEDE2000 is at most {CIEDE2000_P99:g} in 99 % of the pixels, and at most {CIEDE2000_MAX:g} in all."
    )
    dates = {point["hardware"]["placed"] for point in points if point["hardware"].get("placed")}
    placed = "this report" in dates
    of_time = (
        "There are four run times:\n\n"
        "- cycles a pixel, from the first write of a constant to the last pixel;\n"
        "- nanoseconds a pixel, "
        + (
            f"at the clock rate after place and route on an {DEVICE}: the median of some seeds, and of a "
            "single seed for published methods and most models;\n"
            if placed
            else "at committed clock rates after place and route, if there are any "
            f"({'; '.join(sorted(dates))});\n"
        )
        + "- pixels that the simulation of the hardware computes in a second;\n"
        "- nanoseconds a shown pixel of the same method and model in float64 NumPy, vectorised over the "
        "pixels, without the preparation of spans.\n\n"
        "The scene is white light on a grey, glossy surface. The golden renderer's own shadings have only "
        "software times. Their frames are rounded to 8 bits."
    )
    simulated = [point for point in points if point["settings"]["engine"] == "cxxrtl"]
    modelled = [point for point in points if point["settings"]["engine"] == "model"]
    engines = f"The simulated RTL computed {len(simulated):,} frames"
    if modelled:
        engines += (
            f". Its bit-accurate model computed {len(modelled):,} frames. A simulated pipeline of the "
            "same method with the same spans gives the cycles of these frames. The difference of "
            "latency is added. Without this simulation the cycle model gives the cycles"
        )
    return [*map(_glance, _by_scene(points).values()), of_error, of_time, f"{engines}."]


def _glance(scene: Sequence[Mapping[str, Any]]) -> str:
    """The trade between error and time at a mesh and exponent, in a few sentences.

    Only designs that `_is_comparable` accepts are named.
    """
    settings = scene[0]["settings"]
    hardware = [point for point in scene if point["group"] != "software"]
    alike = sum(point["verdicts"]["total"] for point in hardware)
    text = (
        f"**{Path(settings['source']).stem}, exponent {settings['exponent']}**: {alike} of {len(hardware)} "
        "hardware designs look identical to the exact frame."
    )
    for title, kind, key in (
        ("Fewest cycles", "times", "cycles_per_pixel"),
        ("Smallest total error", "errors", "total_max_lsb"),
        ("Smallest method error", "errors", "method_max_lsb"),
    ):
        measured = [point for point in hardware if point[kind][key] is not None and _is_comparable(point)]
        if measured:
            best = measured[int(np.argmin([point[kind][key] for point in measured]))]
            errors, cycles = best["errors"], best["times"]["cycles_per_pixel"]
            speed = "no simulated cycles" if cycles is None else f"{cycles:.3f} cycles a pixel"
            text += (
                f" {title}: `{best['label']}` with {speed}, a largest total error of "
                f"{errors['total_max_lsb']:.1f} LSB and a largest method error of "
                f"{errors['method_max_lsb']:.2f} LSB."
            )
    border = max((point["border"] for point in hardware), key=itemgetter("pixels"), default=None)
    if border and border["pixels"]:
        most = max(point["border"]["lsb"] for point in hardware)
        text += (
            f" All pixels count. At {border['pixels']:,} of these pixels, the border of a light, |N·L| is at "
            f"most {BORDER:g}, and rounding may switch the light on or off. The largest total error of a "
            f"design at the border is {most:.1f} LSB."
        )
    return text


def _is_comparable(point: Mapping[str, Any]) -> bool:
    """Whether a design computes its dot products itself and draws Blinn's highlight.

    `front.conclusion` compares the same designs.
    """
    method, model = (point["settings"][name] for name in ("method", "model"))
    return not ((method in METHODS and METHODS[method].given_values) or model in MIRROR_LOBES)


def _heading(axis: Mapping[str, str]) -> str:
    return f"{axis['title']}, {axis['unit']}" if axis["unit"] else axis["title"]


def table(points: Sequence[Mapping[str, Any]]) -> Table:
    """Table of every point with every measure."""
    largest = [axis for axis in ERRORS if axis["key"].endswith("max_lsb")]
    others = [axis for axis in ERRORS if axis not in largest]
    hardware = {
        "multipliers": "multipliers",
        "cells": "cells",
        "register_bits": "register bits",
        "memory_bits": "memory bits",
        "luts": "look-up tables",
        "fmax_mhz": "clock rate, MHz",
    }
    columns: dict[str, Callable[[Mapping[str, Any]], Cell]] = {
        "design": itemgetter("label"),
        "group": itemgetter("group"),
        "mesh": lambda point: Path(point["settings"]["source"]).stem,
        "exponent": lambda point: point["settings"]["exponent"],
        "identical to the eye": lambda point: point["verdicts"]["total"],
        **{_heading(axis): _getter("errors", axis["key"]) for axis in largest},
        **{
            _heading(axis): _getter("times", axis["key"])
            for axis in TIMES
            if axis["key"] not in ("multipliers", "luts")
        },
        **{title: _getter("hardware", key) for key, title in hardware.items()},
        **{_heading(axis): _getter("errors", axis["key"]) for axis in others},
        "identical to exact interpolation": lambda point: point["verdicts"]["method"],
        "identical to float64": lambda point: point["verdicts"]["arithmetic"],
        "model identical to Blinn's": lambda point: point["verdicts"]["model"],
        **{name: _getter("settings", name) for name in ("method", "model", "engine")},
    }
    rows = [[value(point) for value in columns.values()] for point in points]
    graded: dict[Cell, Grade] = {True: "good", False: "bad"}
    return Table(
        name="points",
        title="Every point",
        columns=list(columns),
        rows=rows,
        note="The engine `cxxrtl` is simulated RTL, `model` its bit-accurate model, and `float64` the golden "
        "renderer, rounded to 8 bits. Multipliers, cells, register bits and memory bits are counted before "
        "technology mapping. The columns *identical* compare a frame with three references: the exact "
        "frame, exact interpolation with the same model, and the same method and model in float64. ✓ is yes, "
        "✗ is no.",
        grades=[[graded[cell] if isinstance(cell, bool) else "" for cell in row] for row in rows],
    )


def _getter(kind: str, key: str) -> Callable[[Mapping[str, Any]], Cell]:
    return lambda point: point[kind].get(key)


def front_table(points: Sequence[Mapping[str, Any]], fronts: Mapping[str, Sequence[str]]) -> Table:
    """Table of the designs on the fronts of the largest total and method error."""
    rows = []
    for (source, exponent), scene in _by_scene(points).items():
        for error in (axis for axis in ERRORS if axis["key"] in ("total_max_lsb", "method_max_lsb")):
            for time in TIMES:
                ids = set(fronts[f"{error['key']}|{time['key']}"])
                rows += [
                    [
                        Path(source).stem,
                        exponent,
                        _heading(error),
                        _heading(time),
                        point["label"],
                        point["errors"][error["key"]],
                        point["times"][time["key"]],
                    ]
                    for point in scene
                    if point["id"] in ids
                ]
    return Table(
        name="fronts",
        title="Pareto fronts",
        columns=[
            "mesh",
            "exponent",
            "measure of error",
            "measure of time",
            "design",
            "error",
            "time or cost",
        ],
        rows=rows,
        note="Designs on the front. Every design with a smaller error takes more time, and every faster "
        "design has a larger error.",
    )
