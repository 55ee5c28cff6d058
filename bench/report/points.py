"""Error against run time: frames of every method and model, rivals and documents' printed variants.

A point is a frame: a design on a mesh at an exponent. It has errors of four kinds, run times of four kinds,
what the hardware takes, its picture with two maps of errors, and the settings that make it again.
"""

import base64
import hashlib
import io
import json
import math
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache, partial
from operator import itemgetter
from pathlib import Path
from typing import Any

import click
import numpy as np
from PIL import Image

from blysk.bench import accuracy
from blysk.bench.accuracy import scene_for
from blysk.bench.command import run
from blysk.bench.report import place_and_route
from blysk.bench.report.perception import (
    CIEDE2000_MAX,
    CIEDE2000_P99,
    FLIP_MAX,
    FLIP_P99,
    LARGEST_LSB,
    identical_to_the_eye,
    perceived,
)
from blysk.bench.report.section import Cell, Grade, Section, Table
from blysk.bench.speed.renderer import timed
from blysk.bench.store import Task
from blysk.bench.tools.fpga import DEVICE, tool_versions
from blysk.golden.frames.compare import method_in_float64
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import METHODS, MODELS, PUBLISHED, preset
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.metrics import error_figures
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import SHADINGS, render, shade_spans
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.cxxrtl import find_compilers
from blysk.sim.errors import InputError
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.mesh import load_mesh

__all__ = [
    "DESIGNS",
    "ERRORS",
    "EXPONENTS",
    "GROUPS",
    "QUICK_SIMULATED",
    "STEPS",
    "TIMES",
    "frames",
    "front",
    "hardware",
    "map_colors",
    "place_of",
    "readme_table",
    "scenes_of",
    "section",
    "software_frames",
    "software_speeds",
    "speeds",
    "tasks",
]

EXPONENTS = accuracy.EXPONENTS
"""Those of the full report."""

GROUPS = {
    "documented": "methods of the documents",
    "own": "methods of this project",
    "rival": "rivals: normals as they come, or each divided by its length",
    "printed": "as the documents print them",
    "software": "golden renderer, software alone",
}
"""What kinds of points there are."""

DESIGNS = [(method, "cosquad") for method in METHODS]
DESIGNS += [("chord", model) for model in MODELS if model != "cosquad"]
DESIGNS += [("renormalise", "exp"), ("renormalise", "blinn"), ("linear", "blinn")]
DESIGNS += [(method, "cosquad") for method in PUBLISHED]
"""Method and model of the hardware's points."""

QUICK_SIMULATED = [
    ("linear", "cosquad"),
    ("quadratic", "cosquad"),
    ("renormalise", "cosquad"),
    ("renormalise", "exp"),
    ("chord-local", "cosquad"),
    ("chord", "cosquad"),
]
"""Those that the quick report simulates; of the others it has the model's frames, and no cycles."""

_KINDS = {
    "model": "model error",
    "arithmetic": "arithmetic error",
    "method": "method error",
    "total": "total error",
}

_FIGURES = {
    "max_lsb": ("largest", "LSB", "less"),
    "p999_lsb": ("99.9th percentile", "LSB", "less"),
    "rmse_lsb": ("RMSE", "LSB", "less"),
    "psnr_db": ("PSNR", "dB", "more"),
}

_PERCEIVED = {
    "flip_p99": ("FLIP, 99th percentile", "", "less"),
    "flip_max": ("FLIP, largest", "", "less"),
    "ciede2000_p99": ("CIEDE2000, 99th percentile", "", "less"),
    "ciede2000_max": ("CIEDE2000, largest", "", "less"),
}


def _axes(kinds: Iterable[str], figures: Mapping[str, tuple[str, str, str]]) -> Iterator[dict[str, str]]:
    for kind in kinds:
        for key, (title, unit, better) in figures.items():
            yield {
                "key": f"{kind}_{key}",
                "title": f"{_KINDS[kind]}, {title}",
                "unit": unit,
                "better": better,
            }


ERRORS = [*_axes(("total", "method", "arithmetic", "model"), _FIGURES | _PERCEIVED)]
"""Measures of error: key, title, unit, and whether ``"less"`` or ``"more"`` is better."""

TIMES = [
    {"key": key, "title": title, "unit": unit, "better": better}
    for key, title, unit, better in (
        ("cycles_per_pixel", "hardware, cycles", "cycles a pixel", "less"),
        ("ns_per_pixel", "hardware, at the clock rate after place and route", "ns a pixel", "less"),
        ("simulated_pixels_per_second", "simulation of the hardware", "pixels a second", "more"),
        ("golden_ns_per_pixel", "the same in float64 NumPy", "ns a pixel", "less"),
    )
]
"""Measures of run time, in the same form."""

_REPEATS = 3

_SIDE = 280
"""Largest width of the embedded pictures."""

STEPS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 255.0)
"""Largest error, in LSB, of each colour of an error map: the first is correct rounding."""


# Measurements.


@lru_cache(maxsize=2)
def _mesh(source: str, triangles: int | None) -> Mesh:
    options = {} if triangles is None else {"triangles": triangles}
    return load_mesh(source, materials=False, **options).mesh


def _digest(mesh: Mesh) -> str:
    parts = (mesh.vertices, mesh.faces, mesh.normals)
    return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).hexdigest()


def scenes_of(place: Mapping[str, Any], exponents: Sequence[int]) -> list[Scene]:
    """Scenes of `scene_for`, one for each exponent, of what `place_of` gives."""
    mesh = _mesh(place["source"], place["triangles"])
    return [scene_for(mesh, exponent, place["width"], place["height"]) for exponent in exponents]


def frames(
    method: str, model: str, place: Mapping[str, Any], exponents: Sequence[int], simulated: bool
) -> list[dict[str, Any]]:
    """Frames of a design: their errors, cycles and pictures.

    Each error is between two images, over the pixels that show the surface:

    - ``model``: Phong shading (normals interpolated over the triangle and normalised at every pixel, as on a
      GPU) with the design's model, against the same with Blinn's; both in float64. No arithmetic cures it;
    - ``arithmetic``: the frame against the same method and model in float64; coefficients that a document
      prints count as arithmetic;
    - ``method``: the frame against exactly normalised interpolation along the spans with the same model;
    - ``total``: the frame against the exact one, Phong shading with Blinn's model.

    Parameters
    ----------
    method, model : str
        Of a `Design`.
    place : dict
        ``source`` and ``triangles`` of the mesh (see `load_mesh`; ``None`` for a file), ``digest``
        of its arrays, by which the result is kept, ``width`` and ``height`` of the picture.
    exponents : sequence of int
        One frame each.
    simulated : bool
        Whether the frames are simulated; else they are those of the bit-accurate model, equal to the bit.

    Returns
    -------
    list of dict
        By exponent: ``settings``, ``errors`` (keys of `ERRORS`; no PSNR of equal images), ``verdicts``
        (``total``, ``method``: whether they look identical), ``pictures`` (see `section`), ``pixels`` shaded,
        ``shown`` ones, ``spans``, ``out_of_range_spans`` and ``cycles`` (``None`` if not simulated).
    """
    design = preset(method, model)
    simulator = FrameSimulator(design, "cxxrtl") if simulated else None
    results = []
    for scene in scenes_of(place, exponents):
        frame = simulator.render(scene) if simulator else model_frame(scene, design)
        same_method = method_in_float64(scene, design, frame.cut_raster)
        names = {"method": method, "model": model, "engine": simulator.engine if simulator else "model"}
        results.append(
            {
                "settings": {**_settings(place, scene), **names},
                **_judged(place, scene, frame.raster, frame.image, same_method, model),
                "pixels": frame.pixels,
                "spans": frame.spans,
                "out_of_range_spans": frame.out_of_range_spans,
                "cycles": frame.cycles if simulated else None,
            }
        )
    return results


def software_frames(shading: str, place: Mapping[str, Any], exponents: Sequence[int]) -> list[dict[str, Any]]:
    """Frames of the golden renderer with Blinn's model, rounded to 8 bits: errors and pictures.

    Errors are those of `frames`; the model's is 0, and the arithmetic error that of rounding the frame.

    Parameters
    ----------
    shading : str
        One of `SHADINGS`.
    place, exponents
        As for `frames`.

    Returns
    -------
    list of dict
        As from `frames`, without cycles.
    """
    results = []
    for scene in scenes_of(place, exponents):
        raster = rasterise(scene)
        own = render(scene, shading, REFLECTION_MODELS["blinn"], raster=raster)
        image = np.floor(own.image * 255 + 0.5).astype(np.uint8)
        names = {"method": shading, "model": "blinn", "engine": "float64"}
        results.append(
            {
                "settings": {**_settings(place, scene), **names},
                **_judged(place, scene, raster, image, own.image, "blinn"),
                "pixels": len(raster.span),
                "spans": len(raster.length),
                "out_of_range_spans": 0,
                "cycles": None,
            }
        )
    return results


def _settings(place: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    return {
        **place,
        "exponent": scene.material.exponent,
        "ambient": scene.material.ambient[0],
        "diffuse": scene.material.diffuse[0],
        "specular": scene.material.specular[0],
        "light": list(scene.lights[0].direction),
        "camera": asdict(scene.camera),
        "background": list(scene.background),
        "back_faces": scene.back_faces,
    }


def _judged(
    place: Mapping[str, Any],
    scene: Scene,
    raster: Raster,
    image: np.ndarray,
    same_method: np.ndarray,
    model: str,
) -> dict[str, Any]:
    """Every error of a frame, its verdicts and its pictures."""
    exact = render(scene, "phong", REFLECTION_MODELS["blinn"], raster=raster)
    if not exact.mask.any():
        size = f"{scene.width}x{scene.height}"
        raise InputError(place["source"], f"no pixel shows the surface at {size}", "choose another mesh")
    golden = shade_spans(scene, raster, "normalised", REFLECTION_MODELS[model])
    of_model = render(scene, "phong", REFLECTION_MODELS[model], raster=raster)
    pairs = {
        "model": (of_model.image * 255, exact.image),
        "arithmetic": (image, same_method),
        "method": (image, golden),
        "total": (image, exact.image),
    }
    values, verdicts = {}, {}
    for kind, (shown, reference) in pairs.items():
        figures = error_figures(shown, reference * 255, exact.mask)
        values |= {f"{kind}_{key}": value for key, value in asdict(figures).items()}
        difference = perceived(shown, reference * 255, exact.mask)
        values |= {f"{kind}_{key}": value for key, value in asdict(difference).items()}
        verdicts[kind] = identical_to_the_eye(figures.max_lsb, difference)
    return {
        "errors": {key: value if math.isfinite(value) else None for key, value in values.items()},
        "verdicts": verdicts,
        "pictures": _pictures(image, {"error": golden, "total": exact.image}, exact.mask),
        "shown": int(np.count_nonzero(exact.mask)),
    }


def hardware(method: str, model: str) -> dict[str, int]:
    """What the pipeline of a design takes before technology mapping, see `Cost`.

    Returns
    -------
    dict
        See `Cost.totals`.
    """
    return cost_of(ShadingPipelineUnit(preset(method, model))).totals


def speeds(
    method: str, model: str, place: Mapping[str, Any], exponents: Sequence[int], simulated: bool
) -> list[dict[str, float | None]]:
    """Run times of a design in software, the best of three.

    Parameters
    ----------
    method, model, place, exponents, simulated
        As for `frames`.

    Returns
    -------
    list of dict
        By exponent: ``simulated_pixels_per_second``, pixels that come out of the simulated pipeline, hidden
        ones included, in a second of its simulation (``None`` if not simulated), and ``golden_ns_per_pixel``,
        nanoseconds a shown pixel to shade the same spans by the same method and model in float64 NumPy.
    """
    design = preset(method, model)
    simulator = FrameSimulator(design, "cxxrtl") if simulated else None
    results = []
    for scene in scenes_of(place, exponents):
        prepared = prepare(scene, design)
        rates = []
        for _ in range(_REPEATS if simulator else 0):
            frame = simulator.render(scene)
            rates.append(frame.pixels / frame.seconds["simulate"])
        timing, _ = timed(partial(method_in_float64, scene, design, prepared.cut_raster), _REPEATS)
        results.append(
            {
                "simulated_pixels_per_second": max(rates, default=None),
                "golden_ns_per_pixel": _ns(timing.one_core, prepared.raster),
            }
        )
    return results


def software_speeds(
    shading: str, place: Mapping[str, Any], exponents: Sequence[int]
) -> list[dict[str, float | None]]:
    """Run times of `software_frames`, as from `speeds`."""
    results = []
    for scene in scenes_of(place, exponents):
        raster = rasterise(scene)
        timing, _ = timed(
            partial(render, scene, shading, REFLECTION_MODELS["blinn"], raster=raster), _REPEATS
        )
        results.append(
            {
                "simulated_pixels_per_second": None,
                "golden_ns_per_pixel": _ns(timing.one_core, raster),
            }
        )
    return results


def _ns(seconds: float, raster: Raster) -> float:
    return seconds * 1e9 / int(np.count_nonzero(raster.visible))


# Pictures.


def _png(picture: Image.Image, **options: Any) -> str:
    buffer = io.BytesIO()
    picture.save(buffer, "png", optimize=True, **options)
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"


def map_colors() -> list[list[int]]:
    """Red, green and blue of each of `STEPS`."""
    from matplotlib import colormaps

    return (colormaps["viridis"](np.linspace(0, 1, len(STEPS)))[:, :3] * 255).round().astype(int).tolist()


def _pictures(image: np.ndarray, references: Mapping[str, np.ndarray], mask: np.ndarray) -> dict[str, Any]:
    """The frame and its error maps, cropped to the object and at most `_SIDE` wide."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    shown = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    factor = -(-(columns[-1] + 1 - columns[0]) // _SIDE)
    # Grey, so that one channel is all: `scene_for` has white light on a grey surface.
    pictures = {"frame": _png(Image.fromarray(image[shown]).convert("L").reduce(factor))}
    inside = _largest(mask[shown].astype(np.float64), factor) > 0
    for name, reference in references.items():
        error = _largest(np.abs(image - reference * 255).max(axis=-1)[shown] * mask[shown], factor)
        codes = np.where(inside, np.searchsorted(STEPS, error), len(STEPS)).astype(np.uint8)
        picture = Image.fromarray(codes).convert("P")
        picture.putpalette(np.ravel([*map_colors(), [0, 0, 0]]).tolist())
        pictures[name] = _png(picture, transparency=len(STEPS), bits=4)
    return pictures


def _largest(values: np.ndarray, factor: int) -> np.ndarray:
    """Largest value of each square of pixels: an error stays visible in a smaller picture."""
    height, width = (-(-side // factor) for side in values.shape)
    padded = np.zeros((height * factor, width * factor))
    padded[: values.shape[0], : values.shape[1]] = values
    return padded.reshape(height, factor, width, factor).max(axis=(1, 3))


# The section.


def front(error: Sequence[float | None], time: Sequence[float | None]) -> np.ndarray:
    """Which points are on the Pareto front: no other is better in one measure and at least as good in both.

    Parameters
    ----------
    error, time : sequences of float
        Of each point; less is better. A point without one of them (``None`` or NaN) is not on the front, and
        beats none.

    Returns
    -------
    bool array
        By point.
    """
    values = np.array([error, time], dtype=np.float64)
    values[:, np.isnan(values).any(axis=0)] = np.nan
    # [k, i, j]: measure k of point j against that of point i.
    no_worse = (values[:, np.newaxis] <= values[:, :, np.newaxis]).all(axis=0)
    better = (values[:, np.newaxis] < values[:, :, np.newaxis]).any(axis=0)
    return ~(no_worse & better).any(axis=1) & ~np.isnan(values).any(axis=0)


def place_of(source: str, triangles: int, width: int, height: int) -> dict[str, Any]:
    """What a frame shows, as settings of a `Task`: a mesh, with a hash of it, and a size.

    Parameters
    ----------
    source : str
        ``"teapot"`` or a mesh file.
    triangles : int
        Of the teapot.
    width, height : int
        Size of the picture.

    Raises
    ------
    InputError
        If the mesh cannot be read.
    """
    triangles = triangles if source == "teapot" else None
    digest = _digest(_mesh(source, triangles))
    return {"source": source, "triangles": triangles, "digest": digest, "width": width, "height": height}


def tasks(quick: bool, meshes: Sequence[str] = ()) -> list[Task]:
    """What to measure.

    Parameters
    ----------
    quick : bool
        A teapot of 992 triangles at 160x120 and exponent 100, `QUICK_SIMULATED` designs through the
        simulation, the others through the model, no clock rates. Else one of 10,712 triangles at 640x480, all
        `EXPONENTS`, every design simulated, and placed and routed where the tools are installed. Without
        a C++ compiler nothing is simulated.
    meshes : sequence of str
        Files of further meshes.

    Raises
    ------
    InputError
        If a mesh cannot be read.
    """
    triangles, width, height = (992, 160, 120) if quick else (10_000, 640, 480)
    exponents = [100] if quick else list(EXPONENTS)
    compiles = next(find_compilers(), None) is not None
    found = []
    for source in ("teapot", *dict.fromkeys(meshes)):
        place = place_of(source, triangles, width, height)
        where = {"place": place, "exponents": exponents}
        for method, model in DESIGNS:
            simulated = compiles and (not quick or (method, model) in QUICK_SIMULATED)
            settings = {"method": method, "model": model, **where, "simulated": simulated}
            found += [Task(frames, settings), Task(speeds, settings, timed=True)]
        for shading in SHADINGS:
            settings = {"shading": shading, **where}
            found += [Task(software_frames, settings), Task(software_speeds, settings, timed=True)]
    for method, model in DESIGNS:
        if not quick or (method, model) in QUICK_SIMULATED:
            found.append(Task(hardware, {"method": method, "model": model}))
        if not quick and all(tool_versions().values()):
            found.append(place_and_route.task(method, model))
    return found


def _group(method: str) -> str:
    if method in PUBLISHED:
        return "printed"
    if method.startswith("chord"):
        return "own"
    return "rival" if method in ("linear", "renormalise") else "documented"


def _command(settings: Mapping[str, Any]) -> str:
    """What makes a point again: `blysk render`, or Python for the golden renderer's shadings."""
    if settings["engine"] == "float64":
        place = {name: settings[name] for name in ("source", "triangles", "width", "height")}
        call = f"software_frames({settings['method']!r}, {place}, [{settings['exponent']}])"
        return shlex.join(
            ["python", "-c", f"from blysk.bench.report.points import *; print({call}[0]['errors'])"]
        )
    words = ["blysk", "render", settings["source"]]
    if settings["triangles"] is not None:
        words += ["--triangles", str(settings["triangles"])]
    for name in ("method", "model", "exponent", "ambient", "diffuse", "specular"):
        words += [f"--{name}", str(settings[name])]
    words += ["--size", f"{settings['width']}x{settings['height']}"]
    return shlex.join([*words, "--materials", "one", "--background", "0", "--json", "figures.json"])


def _points(tasks: Sequence[Task], results: Sequence[Any]) -> list[dict[str, Any]]:
    """The points, by mesh in the order of the tasks, exponent and design."""
    of_design: dict[tuple, dict] = {}
    of_frame: dict[tuple, dict] = {}
    for task, result in zip(tasks, results, strict=True):
        if task.function in (hardware, place_and_route.measure):
            taken = result if task.function is hardware else {"fmax_mhz": result.get("fmax_median_mhz")}
            of_design.setdefault((task.settings["method"], task.settings["model"]), {}).update(taken)
        elif task.function in (speeds, software_speeds):
            for key, speed in zip(_keys(task), result, strict=True):
                of_frame[key] = speed
    points = []
    for task, result in zip(tasks, results, strict=True):
        if task.function not in (frames, software_frames):
            continue
        for key, found in zip(_keys(task), result, strict=True):
            settings = found["settings"]
            method, model = settings["method"], settings["model"]
            software = task.function is software_frames
            taken = {} if software else of_design.get((method, model), {})
            fmax = taken.get("fmax_mhz")
            cycles = None if found["cycles"] is None else found["cycles"] / found["pixels"]
            points.append(
                {
                    "id": "/".join(map(str, key)),
                    "label": f"{method}, software" if software else f"{method}, {model}",
                    "group": "software" if software else _group(method),
                    "settings": settings,
                    "command": _command(settings),
                    "errors": found["errors"],
                    "verdicts": found["verdicts"],
                    "times": {
                        "cycles_per_pixel": cycles,
                        "ns_per_pixel": None if None in (cycles, fmax) else cycles * 1e3 / fmax,
                        **of_frame[key],
                    },
                    "hardware": {
                        name: taken.get(name)
                        for name in ("multipliers", "cells", "register_bits", "memory_bits", "fmax_mhz")
                    },
                    "counts": {
                        name: found[name]
                        for name in ("pixels", "shown", "spans", "out_of_range_spans", "cycles")
                    },
                    "pictures": found["pictures"],
                }
            )
    sources = list(dict.fromkeys(point["settings"]["source"] for point in points))
    return sorted(
        points,
        key=lambda point: (sources.index(point["settings"]["source"]), point["settings"]["exponent"]),
    )


def _keys(task: Task) -> list[tuple]:
    """What tells the points of a task apart."""
    settings = task.settings
    design = (settings["shading"],) if "shading" in settings else (settings["method"], settings["model"])
    return [(settings["place"]["source"], *design, exponent) for exponent in settings["exponents"]]


def _by_scene(points: Sequence[Mapping[str, Any]]) -> dict[tuple[str, int], list[Mapping[str, Any]]]:
    """Points by mesh and exponent: no others can be compared."""
    found: dict[tuple[str, int], list] = {}
    for point in points:
        found.setdefault((point["settings"]["source"], point["settings"]["exponent"]), []).append(point)
    return found


def _measured(points: Sequence[Mapping[str, Any]], kind: str, axis: Mapping[str, str]) -> list[float | None]:
    """A measure of points, made so that less is better."""
    # PSNR falls as RMSE grows, and equal images have no PSNR that JSON could hold.
    values = [point[kind][axis["key"].replace("psnr_db", "rmse_lsb")] for point in points]
    if axis["better"] == "less" or axis["key"].endswith("psnr_db"):
        return values
    return [None if value is None else -value for value in values]


def _fronts(points: Sequence[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Ids on the front of each pair of measures, over the meshes and exponents."""
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


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section "Error against run time".

    `Section.figures` is what the page's script reads:

    - ``points``: a dictionary each, with

      - ``id``, ``label``: texts; ``group``: a key of ``groups``;
      - ``settings``: everything that the frame depends on; among them ``source`` (the mesh), ``exponent``,
        ``method``, ``model``, ``width``, ``height``, ``engine`` (``cxxrtl``: simulated, ``model``: its
        bit-accurate model, ``float64``: the golden renderer);
      - ``command``: a line for a shell that makes it again;
      - ``errors``: value or ``None`` by key of ``errors``; ``times``: by key of ``times``;
      - ``verdicts``: whether both frames look identical, by kind of error: ``total``, ``method``,
        ``arithmetic``, ``model``;
      - ``hardware``: ``multipliers``, ``cells``, ``register_bits``, ``memory_bits``, ``fmax_mhz``, or
        ``None``;
      - ``counts``: ``pixels``, ``shown``, ``spans``, ``out_of_range_spans``, ``cycles``;
      - ``pictures``: ``frame``, ``error`` (map of the method error) and ``total`` (of the total error), data
        URIs of PNGs of one size, the maps transparent where no surface is;

    - ``groups``: ``[{key, title}]``;
    - ``errors``, ``times``: ``[{key, title, unit, better}]``, ``better`` being ``"less"`` or ``"more"``;
    - ``fronts``: ``{"error|time": [ids]}``, points on the Pareto front of each mesh and exponent;
    - ``error_map``: ``{"colors": [...], "limits": [...]}``: the one scale of all maps, ``#rrggbb`` and the
      largest error in LSB of each step.

    Parameters
    ----------
    tasks, results
        Those of `tasks`, in any order.
    """
    points = _points(tasks, results)
    fronts = _fronts(points)
    return Section(
        name="points",
        title="Error against run time",
        text=_text(points),
        parts=[_table(points), _front_table(points, fronts)],
        figures={
            "points": points,
            "groups": [{"key": key, "title": title} for key, title in GROUPS.items()],
            "errors": ERRORS,
            "times": TIMES,
            "fronts": fronts,
            "error_map": {
                "colors": ["#{:02x}{:02x}{:02x}".format(*color) for color in map_colors()],
                "limits": list(STEPS),
            },
        },
    )


def _text(points: Sequence[Mapping[str, Any]]) -> list[str]:
    """What the points say, and what they are."""
    of_error = (
        "Errors are steps (LSB) of an 8-bit channel, over the pixels that show the surface. *Model*: the "
        "reflection model against Blinn's, both in float64 with exact normals: no arithmetic cures it. "
        "*Arithmetic*: the frame against the same method and model in float64; 0.5 is a correctly rounded "
        "frame, and the coefficients of a printed variant count as arithmetic. *Method*: against exactly "
        "normalised interpolation along the spans with the same model. *Total*: against the exact "
        "frame, Phong shading as on a GPU with Blinn's model. FLIP and CIEDE2000 tell what an eye sees of "
        "an error; *identical to the eye* is a largest error "
        f"of {LARGEST_LSB:g} LSB, or FLIP to {FLIP_P99:g} in 99 % of the pixels and {FLIP_MAX:g} in all, and "
        f"CIEDE2000 to {CIEDE2000_P99:g} and {CIEDE2000_MAX:g}."
    )
    placed = any(point["hardware"]["fmax_mhz"] for point in points)
    of_time = (
        "Run times: cycles a pixel from the simulation, first write of a constant to last pixel; nanoseconds "
        + (
            f"at the clock rate after place and route on an {DEVICE}, the median of some seeds, of one for "
            f"printed methods and other models than `{place_and_route.MODEL}`; "
            if placed
            else "in a full report; "
        )
        + "pixels that the simulation of the hardware does in a second; and nanoseconds a shown pixel of the "
        "same method and model in float64 NumPy, spans at hand, vectorised over the pixels. White light on a "
        "grey, glossy surface. The golden renderer's own shadings have software times alone; their frames "
        "are rounded to 8 bits."
    )
    simulated = [point for point in points if point["settings"]["engine"] == "cxxrtl"]
    modelled = [point for point in points if point["settings"]["engine"] == "model"]
    engines = f"{len(simulated):,} frames went through the simulated RTL"
    if modelled:
        engines += f", {len(modelled):,} through its bit-accurate model, which has no cycles"
    return [*map(_glance, _by_scene(points).values()), of_error, of_time, f"{engines}."]


def _glance(scene: Sequence[Mapping[str, Any]]) -> str:
    """The trade of a mesh and an exponent in a few sentences."""
    settings = scene[0]["settings"]
    hardware = [point for point in scene if point["group"] != "software"]
    alike = sum(point["verdicts"]["total"] for point in hardware)
    text = (
        f"**{Path(settings['source']).stem}, exponent {settings['exponent']}**: {alike} of {len(hardware)} "
        "hardware designs look identical to the exact frame."
    )
    for point in scene:
        if point["settings"]["engine"] == "float64" and point["settings"]["method"] == "phong":
            apart = point["errors"]["method_max_lsb"]
            text += (
                " The exact frame interpolates normals over triangles, the hardware along spans: that alone "
                f"is up to {apart:.1f} LSB (`{point['label']}`)."
            )
    for title, kind, key in (
        ("Fewest cycles", "times", "cycles_per_pixel"),
        ("Smallest total error", "errors", "total_max_lsb"),
        ("Smallest method error", "errors", "method_max_lsb"),
    ):
        measured = [point for point in hardware if point[kind][key] is not None]
        if measured:
            best = measured[int(np.argmin([point[kind][key] for point in measured]))]
            errors, cycles = best["errors"], best["times"]["cycles_per_pixel"]
            speed = "not simulated here" if cycles is None else f"{cycles:.3f} cycles a pixel"
            text += (
                f" {title}: `{best['label']}`, {speed}, largest total error "
                f"{errors['total_max_lsb']:.1f} LSB, method error {errors['method_max_lsb']:.2f}."
            )
    return text


def _heading(axis: Mapping[str, str]) -> str:
    return f"{axis['title']}, {axis['unit']}" if axis["unit"] else axis["title"]


def _table(points: Sequence[Mapping[str, Any]]) -> Table:
    largest = [axis for axis in ERRORS if axis["key"].endswith("max_lsb")]
    others = [axis for axis in ERRORS if axis not in largest]
    hardware = {
        "multipliers": "multipliers",
        "cells": "cells",
        "register_bits": "register bits",
        "memory_bits": "memory bits",
        "fmax_mhz": "clock rate, MHz",
    }
    columns: dict[str, Callable[[Mapping[str, Any]], Cell]] = {
        "design": itemgetter("label"),
        "group": itemgetter("group"),
        "mesh": lambda point: Path(point["settings"]["source"]).stem,
        "exponent": lambda point: point["settings"]["exponent"],
        "identical to the eye": lambda point: point["verdicts"]["total"],
        **{_heading(axis): _getter("errors", axis["key"]) for axis in largest},
        **{_heading(axis): _getter("times", axis["key"]) for axis in TIMES},
        **{title: _getter("hardware", key) for key, title in hardware.items()},
        **{_heading(axis): _getter("errors", axis["key"]) for axis in others},
        "identical to exact interpolation": lambda point: point["verdicts"]["method"],
        "identical to the same in float64": lambda point: point["verdicts"]["arithmetic"],
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
        note="Engine cxxrtl: simulated RTL; model: its bit-accurate model; float64: the golden renderer, "
        "rounded to 8 bits. Multipliers, cells, register and memory bits are counted before technology "
        "mapping. Identical to the eye: to the exact frame, to exact interpolation with the same model, and "
        "to the same method and model in float64; good: yes, bad: no.",
        grades=[[graded[cell] if isinstance(cell, bool) else "" for cell in row] for row in rows],
    )


def _getter(kind: str, key: str) -> Callable[[Mapping[str, Any]], Cell]:
    return lambda point: point[kind][key]


def _front_table(points: Sequence[Mapping[str, Any]], fronts: Mapping[str, Sequence[str]]) -> Table:
    """Designs on the fronts of the largest total and method error."""
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
        columns=["mesh", "exponent", "error", "run time", "design", "its error", "its run time"],
        rows=rows,
        note="Designs that no other beats: for each, all that err less take longer, and all that are faster "
        "err more.",
    )


def readme_table(points: Sequence[Mapping[str, Any]]) -> str:
    """README's table of accuracy, as Markdown: the designs of `DESIGNS`.

    Largest arithmetic and method error in LSB at each exponent; largest total error, cycles a pixel and
    millions of simulated pixels a second at exponent 100.

    Parameters
    ----------
    points : sequence of dict
        Those of `section`; every design was simulated, and exponent 100 is among the exponents.
    """
    points = [point for point in points if point["group"] != "software"]
    exponents = sorted({point["settings"]["exponent"] for point in points})
    lines = [
        "| mesh | method | model | "
        + " | ".join(f"n = {exponent}" for exponent in exponents)
        + " | total | cycles a pixel | Mpixel/s simulated |",
        f"|---|---|---|{'---:|' * (len(exponents) + 3)}",
    ]
    rows = {
        (point["settings"]["source"], point["settings"]["method"], point["settings"]["model"]): {}
        for point in points
    }
    for point in points:
        settings = point["settings"]
        rows[settings["source"], settings["method"], settings["model"]][settings["exponent"]] = point
    for (source, method, model), row in rows.items():
        if (method, model) not in accuracy.DESIGNS:
            continue
        errors = [row[exponent]["errors"] for exponent in exponents]
        times = row[100]["times"]
        cells = [Path(source).stem, method, model]
        cells += [f"{error['arithmetic_max_lsb']:.2f} / {error['method_max_lsb']:.2f}" for error in errors]
        cells += [f"{row[100]['errors']['total_max_lsb']:.1f}", f"{times['cycles_per_pixel']:.3f}"]
        cells += [f"{times['simulated_pixels_per_second'] / 1e6:.1f}"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


@click.command()
@click.argument("report", type=click.Path())
def _print(report):
    """Print README's table of accuracy from the report.json of a full report."""
    try:
        sections = json.loads(Path(report).read_text(encoding="utf-8"))["sections"]
        click.echo(readme_table(sections["points"]["figures"]["points"]), nl=False)
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(report, "is no full report", "give the report.json of `blysk bench`") from None


if __name__ == "__main__":
    sys.exit(run(_print, "blysk.bench.report.points", None))
