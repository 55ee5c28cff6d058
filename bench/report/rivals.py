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
from blysk.bench.colors import style_of
from blysk.bench.labels import Label, place_labels
from blysk.bench.report.counted import Counted
from blysk.bench.report.section import Cell, Drawing, Section, Table
from blysk.bench.ring import ring
from blysk.bench.speed.cycle_model import frame_cycles, unit_of
from blysk.bench.store import Task
from blysk.bench.svg import panels, svg
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
    "PRODUCT_AREA",
    "area_of",
    "errors",
    "front_of",
    "host_work",
    "parts",
    "section",
    "tasks",
]

LIGHTS = (1, 2, 4, 8)

EXPONENTS = (10, 100, 1000)

DRAWN = 100
"""Exponent of the drawings, and of switched bits."""

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

PRODUCT_AREA = 18 * 18
"""Bits of adders that stand for a multiplier of 18x18 bits: one for each partial product."""


@lru_cache(maxsize=2)
def _rastered(mesh: str, size: tuple[int, int]) -> tuple[Scene, Raster]:
    kind, _, count = mesh.partition("-")
    made = teapot(int(count)) if kind == "teapot" else ring(int(count), int(count) // 2)
    scene = scene_for(made, 1, *size)
    return scene, rasterise(scene)


def _lit(scene: Scene, lights: int) -> Scene:
    """The scene with its light divided into equal lights, which stand round an upright axis."""
    (light,) = scene.lights
    directions = turned(light.direction, (0, 1, 0), lights).tolist()
    return replace(scene, lights=[Light(tuple(of), (1 / lights,) * 3) for of in directions])


def errors(name: str, mesh: str, size: Sequence[int], exponents: Sequence[int]) -> list[dict[str, Any]]:
    """Errors, cycles and switched bits of a method in frames with one light.

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
    scene, raster = _rastered(mesh, tuple(size))
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
    """Cycles a pixel: by the cycle model of a design, else as docs/theory/rivals.md#counting says."""
    pixels = len(raster.span)
    if isinstance(rival, SpanDesign):
        _, spans, _ = rival.prepared(scene, raster)
        unit = unit_of(rival.design(len(scene.lights)))
        return (frame_cycles(unit, spans, 0) - unit.latency) / pixels
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
    scene, raster = _rastered(mesh, tuple(size))
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
    """Errors of every method on every mesh, and its parts with each number of `LIGHTS`."""
    size, meshes = QUICK if quick else FULL
    exponents = [DRAWN] if quick else list(EXPONENTS)
    where = {"mesh": QUICK[1][0], "size": list(QUICK[0]), "netlist": not quick}
    found = [
        Task(errors, {"name": name, "mesh": mesh, "size": list(size), "exponents": exponents})
        for mesh in meshes
        for name in COMPARED
    ]
    return found + [
        Task(parts, {"name": name, "lights": lights, **where}) for name in COMPARED for lights in LIGHTS
    ]


def area_of(of: Mapping[str, Any]) -> int | None:
    """Area of the result of `parts`, in bits of adders: `PRODUCT_AREA` for a multiplier, and its adders."""
    if of["multipliers"] is None:
        return None
    area: int = PRODUCT_AREA * of["multipliers"] + of["adder_bits"]
    return area


def front_of(points: Mapping[str, tuple[float, float]]) -> list[str]:
    """Names of the points that no other point beats in both numbers, from the smallest first number on.

    A point beats another if it is at most as large in both numbers, and smaller in one.
    """
    found = []
    for name, (x, y) in points.items():
        better = any(
            a <= x and b <= y and (a, b) != (x, y) for other, (a, b) in points.items() if other != name
        )
        if not better:
            found.append(name)
    return sorted(found, key=lambda name: points[name])


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: parts, host work and errors of every method, and fronts of methods."""
    of_mesh: dict[str, dict[str, list[dict]]] = {}
    of_lights: dict[int, dict[str, dict]] = {}
    for task, result in zip(tasks, results, strict=True):
        settings = task.settings
        if task.function is errors:
            of_mesh.setdefault(settings["mesh"], {})[settings["name"]] = result
        else:
            of_lights.setdefault(settings["lights"], {})[settings["name"]] = result
    drawings = _drawings(of_mesh, of_lights)
    text = [
        "A referee asks for methods of other people, in their best form. This section measures them beside "
        "ours: each by a bit-accurate model or by its hardware, all by the same rules. "
        "`docs/theory/rivals.md` has formulas, words and rules.",
        f"{_listed(name for name in COMPARED if COMPARED[name].HARDWARE)} have hardware in this project. "
        f"{_listed(name for name in RIVALS if not RIVALS[name].HARDWARE)} are models alone. Models have no "
        "clock rate, and nothing here compares clock rates.",
        *(text for _, text in drawings),
        "`quotient, phong` and `loisel` draw highlights of R·V, and their errors are against exact Phong "
        "shading. They are drawn, but they are not on a front. The errors of all others are against exact "
        "Blinn shading. Errors are before the rounding of pixels, which adds half an LSB to each method. "
        "Area times time is the number of bits of adders, times cycles a pixel. A multiplier stands for "
        f"{PRODUCT_AREA} of these bits.",
    ]
    parts = [_parts_table(of_lights), _host_table(of_lights), _errors_table(of_mesh)]
    return Section("rivals", "Rivals", text, [*parts, *(drawing for drawing, _ in drawings)])


def _listed(names) -> str:
    names = [f"`{name}`" for name in names]
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _title(mesh: str, of: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    kind = "teapot" if mesh.startswith("teapot") else "torus"
    return f"{kind}, {next(iter(of.values()))[0]['triangles']:,} triangles"


def _drawn(found: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The frame of the drawn exponent."""
    return next(of for of in found if of["exponent"] == DRAWN)


def _drawings(of_mesh: Mapping, of_lights: Mapping) -> list[tuple[Drawing, str]]:
    """Drawings of the fronts, each with a sentence."""
    parts = of_lights[1]
    by_area = {
        _title(mesh, of): {
            name: (area_of(parts[name]) * _drawn(found)["cycles"], _drawn(found)["max_lsb"])
            for name, found in of.items()
        }
        for mesh, of in of_mesh.items()
    }
    by_energy = {
        _title(mesh, of): {
            name: (_drawn(found)["switched"], _drawn(found)["max_lsb"])
            for name, found in of.items()
            if _counts(name)
        }
        for mesh, of in of_mesh.items()
    }
    middle = list(of_mesh)[min(1, len(of_mesh) - 1)]
    by_lights = {
        f"{lights} light{'s' * (lights > 1)}": {
            name: (area_of(of[name]) * _drawn(found)["cycles"], _drawn(found)["max_lsb"])
            for name, found in of_mesh[middle].items()
            if area_of(of[name])
        }
        for lights, of in of_lights.items()
    }
    x = "area times time, bits of adders times cycles a pixel"
    note = f"Exponent {DRAWN}. The line is the front of the methods that draw Blinn's highlight. "
    partly = "`kuijk-blake` counts only the multipliers of its setup, so its area is a lower bound. "
    return [
        _drawing("rivals-area", "Error against area times time, by mesh", x, by_area, note + partly),
        _drawing(
            "rivals-lights",
            "Error against area times time, by number of lights",
            x,
            by_lights,
            f"{note}{partly}Mesh: {_title(middle, of_mesh[middle])}. Errors are those of one light.",
        ),
        _drawing(
            "rivals-energy",
            "Error against switched bits, by mesh",
            "switched bits a pixel",
            by_energy,
            f"{note}Every method gives one pixel a cycle, or waits without switching. `kuijk-blake` is left "
            "out, because the switched bits of its setup are not counted.",
        ),
    ]


_STYLES = {
    "duff": ("#7a4fbf", "p"),
    "bishop-weimer": ("#999933", "v"),
    "bishop-weimer-six": ("#999933", "^"),
    "loisel": ("#cc6677", "X"),
    "abbas": ("#44aa99", "P"),
}
"""Colours and markers of the rivals without hardware."""


def _style(name: str) -> tuple[str, str]:
    """Colour and marker of a method."""
    style = style_of(COMPARED[name].HARDWARE)
    return _STYLES.get(name, (style.color, style.marker))


def _drawing(
    name: str, title: str, x: str, groups: Mapping[str, Mapping[str, tuple[float, float]]], note: str
) -> tuple[Drawing, str]:
    """A panel for each group of points, with its front, and a sentence about the fronts."""
    figure, axes = panels(4.6 * len(groups), 4.2, len(groups), sharey=True)
    said = []
    for panel, (group, points) in zip(axes, groups.items(), strict=True):
        same = {of: at for of, at in points.items() if COMPARED[of].REFLECTION.name == "blinn"}
        front = front_of(same)
        said.append(f"{group}: {_listed(front) if len(front) > 1 else f'`{front[0]}`'}")
        for of, at in points.items():
            color, marker = _style(of)
            shown = color if of in same else "none"
            panel.plot(*at, marker, color=color, markerfacecolor=shown, markersize=6)
        panel.step(*zip(*(points[of] for of in front), strict=True), where="post", color="#1c2126", lw=1.1)
        panel.set(xscale="log", yscale="log", title=group, xlabel=x)
        panel.margins(0.16)
        labels = [
            Label(*at, of, _style(of)[0], "bold" if of in front else "normal") for of, at in points.items()
        ]
        place_labels(panel, labels, list(points.values()))
    axes[0].set_ylabel("largest error before rounding, LSB of linear light")
    text = f"*{title}*: the front has, from the smallest on, for {'; for '.join(said)}."
    return Drawing(name, title, svg(figure), note), text


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
            *(name, _title(mesh, found), of["exponent"], of["max_lsb"], of["pixel_lsb"]),
            *(100 * of["share"], of["cycles"], of["switched"] if _counts(name) else None),
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


def _counts(name: str) -> bool:
    rival = COMPARED[name]
    return not isinstance(rival, SpanDesign) or rival.COUNTS_SETUP
