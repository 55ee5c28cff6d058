"""Error against run time: frames of every method and model, baselines and variants as published.

A point is a frame: a design on a mesh at an exponent. It has errors of four kinds, run times, the resources
of the hardware, its picture with two error maps, and the settings that reproduce it.
"""

import json
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from blysk.bench.accuracy import model_of
from blysk.bench.colors import style_of
from blysk.bench.report import front, front_scenes, place_and_route
from blysk.bench.report.frames import (
    ERRORS,
    EXPONENTS,
    STEPS,
    TIMES,
    frames,
    hardware,
    map_colors,
    software_frames,
    software_speeds,
    speeds,
    view_of,
)
from blysk.bench.report.placed import placed
from blysk.bench.report.points_text import front_table, fronts_of, table, text
from blysk.bench.report.section import Section
from blysk.bench.store import Task
from blysk.bench.tools.families import DEVICE
from blysk.bench.tools.place_and_route import tool_versions
from blysk.golden.presets import METHODS, MODELS, PUBLISHED
from blysk.golden.reference.renderer import SHADINGS
from blysk.sim.engines.compilers import find_compilers

__all__ = [
    "BEST",
    "DESIGNS",
    "GROUPS",
    "LANES",
    "QUICK_SIMULATED",
    "points_of",
    "section",
    "tasks",
]


GROUPS = {
    "documents": "methods of the documents",
    "own": "methods of this project",
    "baseline": "baselines: linear normals, unchanged or each divided by its length",
    "published": "variants as published",
    "software": "golden renderer, only software",
}
"""Titles of the groups of points, by key."""

DESIGNS = [(method, model_of(method)) for method in METHODS]

DESIGNS += [("quotient", "phong")]

DESIGNS += [("renormalise", model) for model in ("blinn", *MODELS) if model != "cosquad"]

DESIGNS += [("linear", "blinn_product")]

DESIGNS += [(method, "cosquad") for method in PUBLISHED]
"""Method and model of the hardware's points, with the method's own operand of the specular unit."""

BEST = [method for method, interpolator in METHODS.items() if interpolator.operand == "cosine"]
"""Methods whose own operand is N·H, as in their documents.

These methods are more exact with 1 - N·H than with N·H. They have points with both operands, so each method
is also compared in its best form. Variants as published are in `PUBLISHED`.
"""

_BEST_OPERAND = {"operand": "one_minus_cosine"}

_BEST_MODEL = "blinn"
"""A model with an exact table. Each method in its best form also has points with this model."""

LANES = [{"method": "quotient", "model": "blinn", "lanes": lanes} for lanes in (2, 4)]
"""Pipelines with several lanes, which have the errors of the same pipeline with one lane."""

QUICK_SIMULATED = [(method, model_of(method)) for method in (*METHODS, *PUBLISHED)]
QUICK_SIMULATED += [("quotient", "phong")]
"""Designs that the quick report simulates: one pipeline of every method, and true Phong.

The other designs have frames of the bit-accurate model. Their cycles are the cycles of the same method with
the same spans, plus the difference of latency.
"""

_SPREAD_MODELS = ("cosquad", "exp", "blinn", "blinn_product", "phong")
"""Models of the designs that are measured over several scenes."""


def tasks(quick: bool, meshes: Sequence[str] = ()) -> list[Task]:
    """Measurements of the section.

    Parameters
    ----------
    quick : bool
        Whether the report is quick. A quick report draws a teapot of 992 triangles at 160x120 with exponent
        100. It simulates the designs of `QUICK_SIMULATED`, and the bit-accurate model computes the other
        designs. Clock rates are the committed rates (`placed`). A full report draws a teapot of 10,712
        triangles at 640x480 with all `EXPONENTS`. It simulates every design. If the tools are installed, it
        places and routes every design. Without a C++ compiler nothing is simulated. `front_scenes` has the
        further scenes.
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
        view = view_of(source, triangles, width, height)
        where = {"view": view, "exponents": exponents}
        for design in _designs():
            pair = design["method"], design["model"]
            usual = pair in QUICK_SIMULATED and len(design) == len(pair)
            simulated = compiles and (not quick or usual)
            settings = {**design, **where, "simulated": simulated}
            found += [Task(frames, settings), Task(speeds, settings, timed=True)]
        for shading in SHADINGS:
            settings = {"shading": shading, **where}
            found += [Task(software_frames, settings), Task(software_speeds, settings, timed=True)]
    for design in _designs():
        pair = design["method"], design["model"]
        found.append(Task(hardware, design))
        if design["model"] in _SPREAD_MODELS:
            scenes = front_scenes.QUICK_SCENES if quick else front_scenes.FULL_SCENES
            found.append(Task(front_scenes.measure, {**design, "scenes": json.loads(json.dumps(scenes))}))
        if not quick and len(design) == len(pair) and all(tool_versions().values()):
            found.append(place_and_route.task(*pair))
    return found


def _designs() -> list[dict[str, Any]]:
    """Options of the hardware's points."""
    designs: list[dict[str, Any]] = [{"method": method, "model": model} for method, model in DESIGNS]
    designs += [{"method": method, "model": "cosquad"} | _BEST_OPERAND for method in BEST]
    best = [
        {"method": method, "model": _BEST_MODEL} for method in METHODS if (method, _BEST_MODEL) not in DESIGNS
    ]
    return [*designs, *(of | (_BEST_OPERAND if of["method"] in BEST else {}) for of in best), *LANES]


def _group(method: str) -> str:
    return "published" if method in PUBLISHED else METHODS[method].ORIGIN


def _command(settings: Mapping[str, Any]) -> str:
    """Command line that reproduces a point: `blysk render`, or Python for shadings of the golden renderer."""
    if settings["engine"] == "float64":
        view = {name: settings[name] for name in ("source", "triangles", "width", "height")}
        call = f"software_frames({settings['method']!r}, {view}, [{settings['exponent']}])"
        return shlex.join(
            [
                "python",
                "-c",
                f"from blysk.bench.report.frames import software_frames; print({call}[0]['errors'])",
            ]
        )
    words = ["blysk", "render", settings["source"]]
    if settings["triangles"] is not None:
        words += ["--triangles", str(settings["triangles"])]
    for name in ("operand", "lanes"):
        words += [f"--{name}", str(settings[name])] if name in settings else []
    for name in ("method", "model", "exponent", "ambient", "diffuse", "specular"):
        words += [f"--{name}", str(settings[name])]
    words += ["--size", f"{settings['width']}x{settings['height']}"]
    words += ["--transfer", "linear", "--materials", "one", "--background", "0"]
    return shlex.join([*words, "--json", "figures.json"])


def points_of(tasks: Sequence[Task], results: Sequence[Any]) -> list[dict[str, Any]]:
    """The points, sorted by mesh in the order of the tasks, then by exponent, then by design.

    Without tasks of `speeds` and `software_speeds` they lack the run times of software.
    """
    of_design = _of_designs(tasks, results)
    of_frame: dict[tuple, dict] = {}
    for task, result in zip(tasks, results, strict=True):
        if task.function in (speeds, software_speeds):
            for key, speed in zip(_keys(task), result, strict=True):
                of_frame[key] = speed
    cycles_of = _Cycles(tasks, results, of_design)
    points = []
    for task, result in zip(tasks, results, strict=True):
        if task.function not in (frames, software_frames):
            continue
        for key, found in zip(_keys(task), result, strict=True):
            settings = found["settings"]
            method = settings["method"]
            software = task.function is software_frames
            taken = {} if software else of_design.get(front.design_of(settings), {})
            fmax = taken.get("fmax_mhz")
            cycles = None if software else cycles_of(key, found)
            points.append(
                {
                    "id": "/".join(map(str, key)),
                    "label": f"{method}, software" if software else _label(settings),
                    "group": "software" if software else _group(method),
                    "colors": list(style_of("" if software else method)[:2]),
                    "settings": settings,
                    "command": _command(settings),
                    "errors": found["errors"],
                    "verdicts": found["verdicts"],
                    "border": found["border"],
                    "times": {
                        "cycles_per_pixel": cycles,
                        "ns_per_pixel": None if None in (cycles, fmax) else cycles * 1e3 / fmax,
                        "multipliers": taken.get("multipliers"),
                        "luts": taken.get("luts"),
                        **of_frame.get(key, {}),
                    },
                    "hardware": {name: taken.get(name) for name in _HARDWARE},
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


_HARDWARE = (
    "multipliers",
    "cells",
    "register_bits",
    "memory_bits",
    "luts",
    "fmax_mhz",
    "seeds_mhz",
    "placed",
)


def _of_designs(tasks: Sequence[Task], results: Sequence[Any]) -> dict[tuple, dict[str, Any]]:
    """Resources of designs, from the netlist and from place and route, measured now or committed."""
    found: dict[tuple, dict[str, Any]] = {}
    for design, entry in placed(DEVICE).items():
        rates = {"fmax_mhz": entry["fmax_median_mhz"], "seeds_mhz": entry["fmax_mhz"]}
        found[design] = {"luts": entry["luts"], **rates, "placed": f"{entry['date']}, {entry['device']}"}
    for task, result in zip(tasks, results, strict=True):
        of = found.setdefault(front.design_of(task.settings), {}) if "method" in task.settings else {}
        if task.function is hardware:
            of |= result
        elif task.function is place_and_route.measure and "fmax_median_mhz" in result:
            rates = [seed["fmax"] for seed in result.get("seeds", ())]
            of |= {"fmax_mhz": result["fmax_median_mhz"], "seeds_mhz": rates or [result["fmax_median_mhz"]]}
            of |= {"luts": result.get("luts"), "placed": "this report"}
    return found


class _Cycles:
    """Cycles a pixel of frames: from simulation, from a frame of the same method, or from the cycle model."""

    def __init__(self, tasks: Sequence[Task], results: Sequence[Any], of_design: Mapping[tuple, dict]):
        self._of_design = of_design
        self._simulated: dict[tuple, tuple[tuple, dict]] = {}
        for task, result in zip(tasks, results, strict=True):
            if task.function is frames:
                for key, found in zip(_keys(task), result, strict=True):
                    if found["cycles"] is not None:
                        design = front.design_of(task.settings)
                        self._simulated.setdefault(self._alike(key, found), (design, found))

    @staticmethod
    def _alike(key: tuple, found: Mapping[str, Any]) -> tuple:
        """What frames have in common whose cycles differ by the latency alone."""
        return *key[:2], found["settings"].get("lanes", 1), key[-1]

    def __call__(self, key: tuple, found: Mapping[str, Any]) -> float | None:
        if found["cycles"] is not None:
            return found["cycles"] / found["pixels"]
        other, simulated = self._simulated.get(self._alike(key, found), (None, None))
        latency, others = (self._of_design.get(of, {}).get("latency") for of in (key[1:-1], other))
        same = simulated and all(simulated[name] == found[name] for name in ("spans", "pixels"))
        if None in (latency, others) or not same:
            cycles = found.get("modelled_cycles")
            return None if cycles is None else cycles / found["pixels"]
        return (simulated["cycles"] + latency - others) / found["pixels"]


def _label(settings: Mapping[str, Any]) -> str:
    """Name of a hardware design."""
    lanes = f", {settings['lanes']} lanes" if "lanes" in settings else ""
    return f"{settings['method']}, {settings['model']}" + ", 1 - N.H" * ("operand" in settings) + lanes


def _keys(task: Task) -> list[tuple]:
    """Keys of a task's points: mesh, design and exponent."""
    settings = task.settings
    design = (settings["shading"],) if "shading" in settings else front.design_of(settings)
    return [(settings["view"]["source"], *design, exponent) for exponent in settings["exponents"]]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section "Error against run time".

    The page's script reads `Section.figures`:

    - ``points``: a dictionary for each point, with

      - ``id``, ``label``: texts; ``group``: a key of ``groups``;
      - ``settings``: all settings of the frame, such as ``source`` (the mesh), ``exponent``, ``method``,
        ``model``, ``width``, ``height``, ``operand`` if it is not the method's own, ``lanes`` if there are
        several, and ``engine`` (``cxxrtl``: simulated, ``model``: by the bit-accurate model, ``float64``: by
        the golden renderer);
      - ``command``: a line for a shell that reproduces the point;
      - ``errors``, ``times``: value or ``None`` for each key of ``errors`` or ``times`` below;
      - ``verdicts``: whether both frames look identical, for each kind of error: ``total``, ``method``,
        ``arithmetic``, ``model``;
      - ``colors``: colours of the method, on light and on dark paper;
      - ``hardware``: ``multipliers``, ``cells``, ``register_bits``, ``memory_bits``; after place and route
        ``luts``, ``fmax_mhz`` (the median), ``seeds_mhz``, and ``placed`` (the date); or ``None``;
      - ``counts``: ``pixels``, ``shown``, ``spans``, ``out_of_range_spans``, ``cycles``;
      - ``pictures``: ``frame``, ``error`` (map of the method error) and ``total`` (map of the total error),
        as data URIs of PNGs of the same size. Maps are transparent where there is no surface;

    - ``groups``: ``[{key, title}]``;
    - ``errors``, ``times``: ``[{key, title, unit, better}]``. ``better`` is ``"less"`` or ``"more"``;
    - ``fronts``: ``{"error|time": [ids]}``, points on the Pareto front of each mesh and exponent;
    - ``error_map``: ``{"colors": [...], "limits": [...]}``, the scale of all maps. Each step has a colour
      ``#rrggbb`` and a largest error in LSB.

    Parameters
    ----------
    tasks, results
        Tasks of `tasks` and their results, in any order.
    """
    points = points_of(tasks, results)
    fronts = fronts_of(points)
    spread = {
        front.design_of(task.settings): result
        for task, result in zip(tasks, results, strict=True)
        if task.function is front_scenes.measure
    }
    found = front.summaries(points, spread)
    return Section(
        name="points",
        title="Error against run time",
        text=text(points),
        parts=[front.spread_table(found), table(points), front_table(points, fronts)],
        conclusion=front.conclusion(found),
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
