"""The report's section on specialisation: parts that sample scenes do not need, and the savings."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.ticker import PercentFormatter

from blysk.bench.labels import Label, place_labels
from blysk.bench.report.section import Cell, Conclusion, Drawing, Grade, Section, Table
from blysk.bench.ring import ring
from blysk.bench.store import Task
from blysk.bench.svg import panels, svg
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.sim.frames.figures import difference_figures, saving_figures
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.frames.specialise import Reduction, Specialisation, specialise
from blysk.sim.meshes.teapot import teapot

__all__ = ["QUICK_SCENES", "SCENES", "measure", "section", "simulate_both", "tasks"]

_KEY = Light((-0.5, 0.8, 0.7))
_COPPER = Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.20), (0.6,) * 3, 50)
_FULL, _QUICK = (480, 360, 10_000), (160, 120, 1000)
_RESOURCES = ("cells", "multipliers", "register_bits", "memory_bits")


def _teapot(width, height, triangles, material=_COPPER, lights=(_KEY,), **options) -> Scene:
    mesh = teapot(triangles)
    camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), "perspective", width / height)
    return Scene(mesh, camera, width, height, material, lights, **options)


def _grey(*size: int) -> Scene:
    return _teapot(*size, Material((0.05,) * 3, (0.4,) * 3, (0.55,) * 3, 50))


def _half_lit(*size: int) -> Scene:
    return _teapot(*size, lights=(_KEY, Light((1, 0, 0), (0, 0, 0))))


def _alike(*size: int) -> Scene:
    scene = _teapot(*size)
    parts = replace(scene.mesh, material=np.arange(len(scene.mesh.faces)) % 3)
    return replace(scene, mesh=parts, material=(_COPPER,) * 3)


def _floor(width: int, height: int, _: int) -> Scene:
    corners = np.array([[0.0, 0, 0], [4, 0, 0], [4, 0, -4], [0, 0, -4]])
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 1, 0], (4, 1)))
    camera = Camera.framing(corners, (0.4, 0.5, 1.0), "perspective", width / height)
    return Scene(mesh, camera, width, height, replace(_COPPER, exponent=500), [Light((0.3, 0.3, -1))])


def _ring(width: int, height: int, _: int) -> Scene:
    camera = Camera((2.2, 3.2, 4.6), (0, 0, 0), projection="perspective", field_of_view=32)
    steel = Material((0.06,) * 3, (0.42, 0.44, 0.48), (0.7,) * 3, 120)
    lights = [Light((-0.6, 0.9, 0.5), (0.9, 0.88, 0.84)), Light((0.9, 0.1, 0.6), "#304a70")]
    return Scene(ring(), camera, width, height, steel, lights)


def _lamp(width: int, height: int, triangles: int) -> Scene:
    camera = Camera((3.5, 5.0, 7.5), (0.2, 1.4, 0), projection="perspective", field_of_view=34)
    clay = Material((0.04,) * 3, (0.5, 0.52, 0.55), (0.6,) * 3, 80)
    lamp = Light(color=(1.0, 0.9, 0.75), position=(-2.6, 3.4, 3.0))
    lights = [lamp, Light((0.8, 0.2, -0.3), "#203460")]
    return Scene(teapot(triangles), camera, width, height, clay, lights, viewer="near")


_GATED = {"method": "quadratic", "model": "cosquad", "gate": True}
"""A method whose spans are equal with and without highlights.

Its gate can prove that spans have no highlight.
"""

SCENES: dict[str, tuple[Callable[[int, int, int], Scene], dict[str, Any] | None]] = {
    "copper teapot": (_teapot, None),
    "matt teapot, k_s = 0": (lambda *size: _teapot(*size, replace(_COPPER, specular=(0, 0, 0))), _GATED),
    "teapot in ambient light": (lambda *size: _teapot(*size, lights=()), None),
    "grey teapot": (_grey, None),
    "three materials alike": (_alike, None),
    # A method that cuts spans by the error of every light cannot leave out a light.
    "one of two lights is off": (_half_lit, {"method": "renormalise", "model": "cosquad"}),
    "floor lit from behind, exponent 500": (_floor, _GATED),
    "steel ring, two lights": (
        _ring,
        {"method": "quadratic", "model": "cosquad_lin", "operand": "one_minus_cosine", "gate": True},
    ),
    "teapot beside a lamp": (_lamp, {"method": "chord-local", "model": "cosquad_lin"}),
}
"""Scenes, and options of the full pipeline.

A scene is a function of width, height and approximate number of triangles. The default pipeline has the
method quotient and the model blinn.
"""

QUICK_SCENES = (
    "copper teapot",
    "matt teapot, k_s = 0",
    "teapot in ambient light",
    "grey teapot",
    "three materials alike",
    "floor lit from behind, exponent 500",
)
"""Scenes of the quick report."""


def _specialised(name: str, size: Sequence[int]) -> tuple[Scene, Specialisation]:
    build, options = SCENES[name]
    scene = build(*size)
    counts = {"lights": max(len(scene.lights), 1), "materials": len(scene.materials)}
    options = options or {"method": "quotient", "model": "blinn"}
    return scene, specialise(scene, preset(**counts | options))


def measure(name: str, size: Sequence[int]) -> dict[str, Any]:
    """Savings of a scene's reductions, each alone and all together, and a comparison of both frames.

    The bit-accurate models compute the frames of the full and of the specialised pipeline.

    Parameters
    ----------
    name : str
        One of `SCENES`.
    size : sequence of int
        Width, height and triangles.

    Returns
    -------
    dict
        ``full`` and ``specialised`` of `saving_figures`, and `difference_figures`; ``reasons`` of the
        reductions; ``alone``, the resources that each reduction alone saves; ``method``, ``model`` and
        ``pixels``.
    """
    scene, found = _specialised(name, size)
    full, smaller = model_frame(scene, found.full), model_frame(found.scenes[0], found.design)
    changes = {key: value for reduction in found.reductions for key, value in reduction.changes.items()}
    together = saving_figures(replace(found, reductions=(Reduction("all of it", changes),)))
    alone = [saving_figures(replace(found, reductions=(each,)))["reductions"][0] for each in found.reductions]
    return {
        **{which: together[which] for which in ("full", "specialised")},
        **difference_figures(smaller, full),
        "alone": [each["saves"] for each in alone],
        "reasons": [reduction.reason for reduction in found.reductions],
        "method": found.full.method,
        "model": found.full.model,
        "pixels": full.pixels,
    }


def simulate_both(name: str, size: Sequence[int]) -> dict[str, int]:
    """``cycles`` and ``full_cycles`` of the simulated pipelines, and ``different_pixels`` of their frames.

    Parameters
    ----------
    name, size
        As in `measure`.
    """
    scene, found = _specialised(name, size)
    full = FrameSimulator(found.full, "cxxrtl").render(scene)
    smaller = FrameSimulator(found.design, "cxxrtl").render(found.scenes[0])
    different = difference_figures(smaller, full)["different_pixels"]
    return {"cycles": smaller.cycles, "full_cycles": full.cycles, "different_pixels": different}


def tasks(quick: bool) -> list[Task]:
    """Measurements of each scene by the bit-accurate models and, if not quick, by simulation."""
    size = list(_QUICK if quick else _FULL)
    settings = [{"name": name, "size": size} for name in (QUICK_SCENES if quick else SCENES)]
    counted = [Task(measure, each) for each in settings]
    return counted + [Task(simulate_both, each) for each in settings if not quick]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: reductions of each scene, their savings, and whether the scene's frame stays the same."""
    found: dict[str, dict[str, Any]] = {}
    for task, result in zip(tasks, results, strict=True):
        # Models and simulation both count different pixels. The larger number is kept.
        of = found.setdefault(task.settings["name"], {"cycles": None, "full_cycles": None})
        different = of.get("different_pixels", 0)
        of |= result
        of["different_pixels"] = max(different, result["different_pixels"])
    simulated = sum(of["cycles"] is not None for of in found.values())
    same = sum(of["different_pixels"] == 0 for of in found.values())
    least = min(found, key=lambda name: _left(found[name], "cells"))
    most = max(found, key=lambda name: _left(found[name], "cells"))
    text = [
        "`--specialise` builds only the parts that a scene needs. It changes no word of the arithmetic, so "
        "the frame must equal that of the full pipeline to the bit. The bit-accurate models of both "
        f"pipelines have compared {len(found)} frames, simulation {simulated} of these. {same} of "
        f"{len(found)} frames are equal.",
        f"The specialised pipeline keeps {_left(found[least], 'cells'):.0%} of the cells (*{least}*) to "
        f"{_left(found[most], 'cells'):.0%} (*{most}*). Cells are operators, multiplexers, registers and "
        "memories of any width, before technology mapping.",
    ]
    parts = [_totals(found), _alone(found)]
    return Section("needs", "Parts that a scene does not need", text, parts, conclusion=_conclusion(found))


def _shares_alone(found: dict[str, dict]) -> dict[str, list[tuple[str, dict[str, float]]]]:
    """Scenes of each kind of reduction, and the share of each resource that this reduction alone saves."""
    shares: dict[str, list[tuple[str, dict[str, float]]]] = {}
    for name, of in found.items():
        for reason, saves in zip(of["reasons"], of["alone"], strict=True):
            kind = re.sub(r"\d+", "n", reason.partition(":")[0])
            share = {resource: saves[resource] / max(of["full"][resource], 1) for resource in _RESOURCES}
            shares.setdefault(kind, []).append((name, share))
    return shares


def _conclusion(found: dict[str, dict]) -> Conclusion:
    """Least and largest saving of a scene, and the single reduction that saves most."""
    least, most = (of(found, key=lambda name: _left(found[name], "cells")) for of in (min, max))

    def says(name):
        parts = [
            f"{1 - _left(found[name], resource):.0%} of the {resource.replace('_', ' ')}"
            for resource in _RESOURCES
        ]
        return f"{', '.join(parts[:-1])} and {parts[-1]}"

    same = sum(of["different_pixels"] == 0 for of in found.values())
    sentence = (
        f"Specialisation saves least in the scene *{most}*: {says(most)}. It saves most in the scene "
        f"*{least}*: **{says(least)}**. In {same} of {len(found)} scenes no pixel changes."
    )
    shares = _shares_alone(found)
    if shares:
        kind = max(shares, key=lambda kind: max(share["cells"] for _, share in shares[kind]))
        name, share = max(shares[kind], key=lambda one: one[1]["cells"])
        sentence += (
            f" The single omission that saves most is *{kind}*. In the scene *{name}* it saves "
            f"{share['cells']:.0%} of the cells and {share['multipliers']:.0%} of the multipliers."
        )
    return Conclusion("Which parts does a scene not need?", sentence, _saved_drawing(found))


def _saved_drawing(found: dict[str, dict]) -> Drawing:
    figure, axes = panels(9.2, 0.36 * max(len(found), 5) + 1.3, 2)
    place = np.arange(len(found))
    left = np.array(
        [[1 - _left(of, resource) for resource in ("cells", "multipliers")] for of in found.values()]
    )
    for column, (color, name) in enumerate((("#0072b2", "cells"), ("#d55e00", "multipliers"))):
        axes[0].barh(place + (column - 0.5) * 0.36, left[:, column], 0.34, color=color, label=name)
        for y, value in zip(place + (column - 0.5) * 0.36, left[:, column], strict=True):
            axes[0].text(value + 0.01, y, f"{value:.0%} {name}", va="center", fontsize=6.5, color=color)
    axes[0].set(
        yticks=place,
        yticklabels=list(found),
        xlim=(0, 1.35),
    )
    axes[0].set_title("all omissions together, by scene", fontsize=9, loc="left")
    axes[1].set_title("each omission alone, in its best scene", fontsize=9, loc="left")
    axes[0].invert_yaxis()
    labels = []
    for kind, each in _shares_alone(found).items():
        x, y = (max(share[resource] for _, share in each) for resource in ("cells", "multipliers"))
        labels.append(Label(x, y, kind.replace(" n ", " ")))
    labels.sort(key=lambda label: -label.x - label.y)
    axes[1].scatter([of.x for of in labels], [of.y for of in labels], s=16, color="#1c2126")
    axes[1].set(ylabel="multipliers saved, share")
    for panel in axes:
        panel.xaxis.set_major_formatter(PercentFormatter(1))
    axes[1].yaxis.set_major_formatter(PercentFormatter(1))
    axes[0].set_xlabel("saved, share of the full pipeline")
    axes[1].set_xlabel("cells saved, share of the full pipeline")
    axes[0].set_xticks(np.arange(0, 1.01, 0.25))
    axes[1].set(xlim=(-0.04, 1.12), ylim=(-0.06, 1.12))
    place_labels(axes[1], labels, [(of.x, of.y) for of in labels])
    note = "Counted in the netlist before technology mapping. The pixels equal those of the full pipeline."
    return Drawing("needs-saved", "Savings of specialisation", svg(figure), note)


def _alone(found: dict[str, dict]) -> Table:
    columns = ["scene", "omission and reason", *(f"saves {name.replace('_', ' ')}" for name in _RESOURCES)]
    columns += ["cells, share of the full", "multipliers, share of the full"]
    rows: list[list[Cell]] = [
        [
            *(name, reason, *(saves[resource] for resource in _RESOURCES)),
            *(saves[resource] / max(of["full"][resource], 1) for resource in ("cells", "multipliers")),
        ]
        for name, of in found.items()
        for reason, saves in zip(of["reasons"], of["alone"], strict=True)
    ]
    note = "Each omission alone, from the full pipeline, counted in the netlist."
    return Table("needs-alone", "Savings of each omission alone", columns, rows, note)


def _left(figures: dict, resource: str) -> float:
    """Remaining share of a resource. The share is 1 if the full pipeline does not have the resource."""
    full = figures["full"][resource]
    return figures["specialised"][resource] / full if full else 1.0


def _totals(found: dict[str, dict]) -> Table:
    columns = ["scene", "method", "model", "pixels"]
    for resource in _RESOURCES:
        name = resource.replace("_", " ")
        columns += [f"{name}, full", f"{name}, specialised"]
    columns += ["cycles, full", "cycles, specialised", "pixels of another colour"]
    rows: list[list[Cell]] = []
    grades: list[list[Grade]] = []
    for name, of in found.items():
        row: list[Cell] = [name, of["method"], of["model"], of["pixels"]]
        for resource in _RESOURCES:
            row += [of[which][resource] for which in ("full", "specialised")]
        rows.append([*row, of["full_cycles"], of["cycles"], of["different_pixels"]])
        grades.append([""] * (len(columns) - 1) + ["bad" if of["different_pixels"] else "good"])
    note = (
        "The full pipeline has as many lights and materials as the scene. It has 12-bit coordinates and "
        "lengths, a PROM of exponents and three channels. If the method can have a highlight gate, the "
        "pipeline has a gate."
    )
    return Table("needs", "The full and the specialised pipeline", columns, rows, note, grades)
