"""The report's section on rivals: methods of other people beside ours, all measured by the same rules.

docs/theory/rivals.md has the rivals, their words and the rules of counting.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.report.counted import Counted
from blysk.bench.report.rivals_fronts import (
    DRAWN,
    PRODUCT_AREA,
    area_of,
    counts,
    drawings,
    listed,
    placed_table,
    title_of,
)
from blysk.bench.report.section import Cell, Section, Table
from blysk.bench.ring import ring
from blysk.bench.speed.cycle_model import steady_cycles, unit_of
from blysk.bench.store import Task
from blysk.golden.frames.border import border_mask
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.designs import SpanDesign
from blysk.golden.rivals.registry import COMPARED, RIVALS
from blysk.golden.rivals.rival import Rival
from blysk.golden.rivals.trace import Trace
from blysk.golden.rivals.triangles import screen_triangles
from blysk.hdl.emit.cost import cost_of
from blysk.sim.frames.animation import turned
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "LIGHTS",
    "errors",
    "host_work",
    "parts",
    "rastered",
    "section",
    "tasks",
]

LIGHTS = (1, 2, 4, 8)

EXPONENTS = (10, 100, 1000)

QUICK, FULL = (
    ((160, 120), ("teapot-1000", "ring-36")),
    (
        (640, 480),
        ("teapot-1000", "teapot-10000", "teapot-100000", "ring-120"),
    ),
)
"""Size and meshes: a teapot with about so many triangles, or a ring with so many points around."""

SHARED_LSB = 0.25
"""An error of a triangle counts from here on, in LSB before rounding."""


@lru_cache(maxsize=2)
def rastered(mesh: str, size: tuple[int, int]) -> tuple[Scene, Raster]:
    """The scene of a mesh, named as in `FULL`, and its raster."""
    kind, _, count = mesh.partition("-")
    made = teapot(int(count)) if kind == "teapot" else ring(int(count), int(count) // 2)
    scene = scene_for(made, 1, *size)
    return scene, rasterise(scene)


def _lit(scene: Scene, lights: int) -> Scene:
    """The scene with its light divided into equal lights, which stand round an upright axis."""
    if lights == 1:
        return scene
    (light,) = scene.lights
    directions = turned(light.direction, (0, 1, 0), lights).tolist()
    return replace(scene, lights=[Light(tuple(of), (1 / lights,) * 3) for of in directions])


def errors(
    name: str, mesh: str, size: Sequence[int], exponents: Sequence[int], lights: int = 1
) -> list[dict[str, Any]]:
    """Errors, cycles and switched bits of a method in frames.

    Parameters
    ----------
    name : str
        One of `COMPARED`.
    mesh : str
        As in `FULL`.
    size : sequence of int
        Width and height.
    exponents : sequence of int
        Exponents, with a frame for each.
    lights : int
        Number of lights, see `_lit`.

    Returns
    -------
    list of dict
        For each exponent:

        - ``exponent``, ``triangles`` of the mesh, ``shown``: triangles with a visible pixel, ``pixels``;
        - ``max_lsb``: largest error off the border of the light, before rounding to 8 bits;
        - ``pixel_lsb``: the same of the pixels;
        - ``share``: share of the shown triangles with an error over `SHARED_LSB` before rounding;
        - ``cycles``: cycles a pixel, and ``switched``: switched bits a pixel, at the exponent `DRAWN`.
    """
    rival = COMPARED[name]
    scene, raster = rastered(mesh, tuple(size))
    scene = _lit(scene, lights)
    found = []
    for exponent in exponents:
        scene = replace(scene, material=replace(scene.material, exponent=exponent))
        trace = Trace(switches=exponent == DRAWN)
        shades = rival.shade(scene, raster, trace)
        exact = 255 * render(scene, "phong", rival.REFLECTION, raster).image.reshape(-1, 3)
        border = border_mask(scene, raster, rival.REFLECTION).reshape(-1)
        which = np.flatnonzero(raster.visible & ~border[raster.pixel])
        exact, triangle = exact[raster.pixel[which]], raster.triangle[raster.span[which]]
        error = np.abs(shades.light[which] - exact).max(axis=1)
        worst = np.zeros(len(scene.mesh.faces))
        np.maximum.at(worst, triangle, error)
        found.append(
            {
                "exponent": exponent,
                "triangles": len(scene.mesh.faces),
                "shown": len(np.unique(triangle)),
                "pixels": len(raster.span),
                "max_lsb": float(error.max()),
                "pixel_lsb": float(np.abs(shades.color[which] - exact).max()),
                "share": float((worst[np.unique(triangle)] > SHARED_LSB).mean()),
                "cycles": _cycles(rival, scene, raster),
                "switched": trace.switched_a_pixel if trace.switches else None,
            }
        )
    return found


def _cycles(rival: Rival, scene: Scene, raster: Raster) -> float:
    """Cycles a pixel: of a design by the cycle model, else as docs/theory/rivals.md#counting says.

    The filling of a pipeline does not count.
    """
    pixels = len(raster.span)
    if isinstance(rival, SpanDesign):
        _, spans, _ = rival.prepared(scene, raster)
        unit = unit_of(rival.design(len(scene.lights)))
        return steady_cycles(unit, spans) / pixels
    return max(pixels, rival.SETUP_CYCLES * len(np.unique(raster.triangle))) / pixels


def host_work(rival: Rival, scene: Scene, raster: Raster) -> dict[str, dict[str, float]]:
    """Operations of the host by kind, for a ``triangle`` and for a ``span``, without constants of a frame.

    Parameters
    ----------
    rival : Rival
        One of `COMPARED`.
    scene, raster
        A scene with distant lights, and its raster.
    """
    triangles = screen_triangles(scene, raster)
    counts: Counter[str] = Counter()
    names = ("x", "y", "weight", "normal", "point")
    given = {name: Counted.of(getattr(triangles, name), counts) for name in names}
    planes = rival.host(scene, triangles._replace(**given))
    count = triangles.x.shape[1]
    found = {"triangle": {kind: number / count for kind, number in counts.items()}, "span": {}}
    if isinstance(rival, SpanDesign):
        first = triangles.first
        of_span = triangles.triangle[first]
        counts.clear()
        planes = [Counted.of(np.asarray(plane)[:, of_span], counts) for plane in planes]
        place = triangles.i[first], triangles.j[first], np.asarray(raster.length) - 1
        points = triangles.point[0][:, of_span]
        rival.host_span(scene, planes, [Counted.of(of, counts) for of in place], points)
        found["span"] = {kind: number / len(first) for kind, number in counts.items()}
    return found


def parts(name: str, lights: int, mesh: str, size: Sequence[int], netlist: bool) -> dict[str, Any]:
    """Parts of a method with some lights, and the work of its host.

    Parameters
    ----------
    name : str
        One of `COMPARED`.
    lights : int
        Number of lights.
    mesh, size
        Scene in which the words are counted; parts do not depend on it.
    netlist : bool
        Whether a design's netlist with one light is read, too. It takes seconds.

    Returns
    -------
    dict
        - ``multipliers`` for a pixel a cycle, or ``None`` if neither trace nor netlist has them;
        - ``adder_bits``, ``memory_bits``, ``register_bits``;
        - ``products``: products of a ``pixel``, a ``span`` and a ``triangle``;
        - ``netlist``: multipliers of the netlist, or ``None``;
        - ``bits``: bits of a beat, ``beat``: ``span`` or ``triangle``;
        - ``host``: see `host_work`.
    """
    rival = COMPARED[name]
    scene, raster = rastered(mesh, tuple(size))
    scene = _lit(scene, lights)
    trace = Trace(switches=False)
    rival.shade(scene, raster, trace)
    is_design = isinstance(rival, SpanDesign)
    counted = not is_design or rival.COUNTS_SETUP
    of_netlist = None
    if is_design and lights == 1 and (netlist or not counted):
        of_netlist = cost_of(unit_of(rival.design(lights))).multiplier_count
    share = rival.SPAN_CYCLES, rival.SETUP_CYCLES
    return {
        "multipliers": trace.multipliers_at(*share) if counted else of_netlist,
        "adder_bits": trace.adder_bits_at(*share),
        "memory_bits": trace.memory_bits,
        "register_bits": trace.register_bits,
        "products": {rate: trace.multipliers[rate] for rate in ("pixel", "span", "triangle")},
        "netlist": of_netlist,
        "bits": rival.beat_bits(lights),
        "beat": "span" if is_design else "triangle",
        "host": host_work(rival, scene, raster),
    }


def tasks(quick: bool) -> list[Task]:
    """Errors of every method on every mesh, and its parts and errors with each number of `LIGHTS`.

    Errors with several lights are those of the mesh `_middle` at the exponent `DRAWN`.
    """
    size, meshes = QUICK if quick else FULL
    exponents = [DRAWN] if quick else list(EXPONENTS)
    where = {"mesh": QUICK[1][0], "size": list(QUICK[0]), "netlist": not quick}
    found = [
        Task(errors, {"name": name, "mesh": mesh, "size": list(size), "exponents": exponents})
        for mesh in meshes
        for name in COMPARED
    ]
    several = {"mesh": _middle(meshes), "size": list(size), "exponents": [DRAWN]}
    found += [
        Task(errors, {"name": name, **several, "lights": lights})
        for name in COMPARED
        for lights in LIGHTS[1:]
        if counts(name)
    ]
    return found + [
        Task(parts, {"name": name, "lights": lights, **where}) for name in COMPARED for lights in LIGHTS
    ]


def _middle(meshes: Sequence[str]) -> str:
    """Mesh of the comparison by numbers of lights."""
    return meshes[min(1, len(meshes) - 1)]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: parts, host work and errors of every method, and fronts of methods."""
    of_mesh: dict[str, dict[str, list[dict]]] = {}
    of_lights: dict[int, dict[str, dict]] = {}
    frames_of: dict[int, dict[str, list[dict]]] = {1: {}}
    for task, result in zip(tasks, results, strict=True):
        settings = task.settings
        if task.function is errors and "lights" in settings:
            frames_of.setdefault(settings["lights"], {})[settings["name"]] = result
        elif task.function is errors:
            of_mesh.setdefault(settings["mesh"], {})[settings["name"]] = result
        else:
            of_lights.setdefault(settings["lights"], {})[settings["name"]] = result
    frames_of[1] = of_mesh[_middle(list(of_mesh))]
    drawn = drawings(of_mesh, of_lights, frames_of)
    text = [
        "A referee asks for methods of other people, in their best form. This section measures them beside "
        "ours: each by a bit-accurate model or by its hardware, all by the same rules. "
        "`docs/theory/rivals.md` has formulas, words and rules.",
        f"{listed(name for name in COMPARED if COMPARED[name].HARDWARE)} have hardware in this project. "
        f"{listed(name for name in RIVALS if not RIVALS[name].HARDWARE)} are models alone, and have no "
        "clock rate.",
        *(text for _, text in drawn),
        "`quotient, phong` and `loisel` draw highlights of R·V, and their errors are against exact Phong "
        "shading. They are drawn, but they are not on a front. The errors of all others are against exact "
        "Blinn shading. Errors are before the rounding of pixels, which adds half an LSB to each method. "
        "Area times time is the number of bits of adders, times cycles a pixel. A multiplier stands for "
        f"{PRODUCT_AREA} of these bits.",
    ]
    tables = [_parts_table(of_lights), _host_table(of_lights), _errors_table(of_mesh), placed_table(of_mesh)]
    return Section("rivals", "Rivals", text, [*tables, *(drawing for drawing, _ in drawn)])


def _parts_table(of_lights: Mapping[int, Mapping[str, Mapping[str, Any]]]) -> Table:
    columns = ["method", "source", "hardware", "lights", "multipliers", "multipliers of the netlist"]
    columns += [f"products a {rate}" for rate in ("pixel", "span", "triangle")]
    columns += ["adders, bits", "tables, bits", "registers a pixel, bits", "area, bits of adders"]
    columns += ["beat", "bits a beat"]
    rows: list[list[Cell]] = []
    for name, rival in COMPARED.items():
        for lights, found in of_lights.items():
            of = found[name]
            rows.append(
                [
                    *(name, rival.TITLE, rival.HARDWARE or "none, a model", lights),
                    *(of["multipliers"], of["netlist"], *of["products"].values()),
                    *(of["adder_bits"], of["memory_bits"], of["register_bits"], area_of(of)),
                    *(of["beat"], of["bits"]),
                ]
            )
    note = (
        "Multipliers have 18x18 bits. Products of a span share multipliers over three cycles (`renormalise`: "
        "over its interval), and products of a triangle over eight. Parts are counted from the words of the "
        "models. With one light the multipliers of the netlist check the count. `kuijk-blake` has the "
        "multipliers of its netlist, and no adders, tables and registers of its setup."
    )
    return Table("rivals-parts", "Parts of every method, for a pixel a cycle", columns, rows, note)


_KINDS = ("multiplications", "additions", "divisions", "roots", "functions")


def _host_table(of_lights: Mapping[int, Mapping[str, Mapping[str, Any]]]) -> Table:
    columns = ["method", "lights"]
    columns += [f"{kind} a {rate}" for rate in ("triangle", "span") for kind in _KINDS]
    rows: list[list[Cell]] = [
        [
            *(name, lights),
            *(of[name]["host"][rate].get(kind, 0) for rate in ("triangle", "span") for kind in _KINDS),
        ]
        for name in COMPARED
        for lights, of in of_lights.items()
    ]
    note = (
        "Operations of the host for a triangle and a span, from corners on the screen with their normals and "
        "depths. They are counted while the float64 part of each model runs. Distant lights and viewer. "
        "Functions are powers. Comparisons, and conversions to words, are not counted."
    )
    return Table("rivals-host", "Work of the host", columns, rows, note)


def _errors_table(of_mesh: Mapping[str, Mapping[str, Sequence[Mapping[str, Any]]]]) -> Table:
    columns = ["method", "mesh", "exponent", "largest error before rounding, LSB", "of pixels, LSB"]
    columns += [f"triangles over {SHARED_LSB} LSB, %", "cycles a pixel", "switched bits a pixel"]
    rows: list[list[Cell]] = [
        [
            *(name, title_of(mesh, found), of["exponent"], of["max_lsb"], of["pixel_lsb"]),
            *(100 * of["share"], of["cycles"], of["switched"] if counts(name) else None),
        ]
        for name in COMPARED
        for mesh, found in of_mesh.items()
        for of in found[name]
    ]
    note = (
        "Against exact shading with the same highlight, off the border of the light, in linear light. The "
        "material has k_a 0.05, k_d 0.4 and k_s 0.55, and the light is white. Triangles: share of the "
        "visible triangles."
    )
    return Table("rivals-errors", "Errors, cycles and switched bits", columns, rows, note)
