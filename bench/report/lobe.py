"""Errors and costs of the lobe unit, and errors of frames with it, beside baselines."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task
from blysk.bench.surfaces import grid, sphere
from blysk.golden.frames.compare import method_in_float64
from blysk.golden.frames.frame import model_frame
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import Fixed
from blysk.golden.presets import preset
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lobes import BECKMANN, GGX
from blysk.golden.reference.reflection import BLINN, COSQUAD, REFLECTION_MODELS, ReflectionModel
from blysk.golden.reference.renderer import render
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.lobe import LobeUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.sim.meshes.mesh import load_mesh

__all__ = [
    "CASES",
    "FRONT",
    "MESHES",
    "SIZES",
    "Case",
    "errors_of_size",
    "frame_errors",
    "largest_error",
    "section",
    "tasks",
    "unit_cost",
]

SIZES = ((8, 16), (12, 16), (12, 32), (14, 32), (15, 16), (15, 32), (20, 16))
"""Sizes of the table to compare: number of octaves, and steps of an octave."""

MESHES = ("teapot", "sphere", "torus", "waves")
"""Surfaces of the frames."""

FRONT = (
    *(("quotient", model) for model in ("blinn", "phong")),
    *(("renormalise", model) for model in ("blinn", "cosquad", "lyon3_refitted", "exp", "blinn_product")),
)
"""Method and model of the compared pipelines: with a table, and baselines with other circuits."""

EXPONENTS = (1, 10, 100, 1000)

ROUGHNESSES = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)


@dataclass(frozen=True)
class Case:
    """A model, and the exponents or alphas of its table."""

    reflection: ReflectionModel
    label: str
    values: tuple[float, ...]

    def parameter(self, value: float) -> float:
        """Parameter of the model: an exponent, or the roughness of an alpha."""
        return value if self.reflection.PARAMETER == "exponent" else value**0.5


CASES = (
    Case(BLINN, "n", (1, 2, 10, 100, 1000)),
    Case(BECKMANN, "alpha", (0.03, 0.1, 0.3, 0.6, 1)),
    Case(GGX, "alpha", (0.0025, 0.01, 0.03, 0.05, 0.1, 0.3, 0.6, 1)),
)
"""Models and values of the columns of the table of sizes."""


def largest_error(lobe: Lobe, parameter: float | None, samples: int = 256) -> float:
    """Largest error of a table's terms against the model, in LSB of an 8-bit channel at intensity 1.

    Parameters
    ----------
    lobe : Lobe
        A lobe with the operand ``one_minus_cosine``.
    parameter : float or None
        Parameter of the model.
    samples : int
        Sampled operands in each step of the table, the first and the last operand among them. A step with
        fewer operands has all operands.
    """
    knots = np.ldexp(lobe.knots, lobe.fraction_bits).astype(np.int64)
    first, last = knots[:-1, np.newaxis], knots[1:, np.newaxis] - 1
    codes = np.unique(first + (last - first) * np.arange(samples) // (samples - 1))
    terms = lobe.compute(
        Fixed(lobe.operand_format, codes), np.zeros(codes.shape, bool), lobe.table(parameter)
    )
    exact = lobe.reflection.reflect(1 - np.ldexp(codes, -lobe.fraction_bits), parameter)
    return 255 * float(np.abs(terms.values - exact).max())


def errors_of_size(octaves: int, steps: int, samples: int = 256) -> list[list[float]]:
    """Largest errors of a size of the table, for each of `CASES`, see `largest_error`."""
    lobe = Lobe(BLINN, "one_minus_cosine", octaves, steps)
    return [
        [
            largest_error(replace(lobe, reflection=case.reflection), case.parameter(value), samples)
            for value in case.values
        ]
        for case in CASES
    ]


_UNITS = {
    "lobe, table loaded": lambda lobe: LobeUnit(lobe),
    "lobe, table fixed": lambda lobe: LobeUnit(lobe, tables=[lobe.table(20)]),
    "lobe, memory outside": lambda lobe: LobeUnit(lobe, shares_memory=True),
    "cosquad": lambda lobe: SpecularUnit(Specular(COSQUAD, lobe.operand)),
    "cosquad, exponent fixed": lambda lobe: SpecularUnit(Specular(COSQUAD, lobe.operand), exponent=20),
    "lyon3_refitted": lambda lobe: SpecularUnit(Specular(REFLECTION_MODELS["lyon3_refitted"], lobe.operand)),
    "exp": lambda lobe: SpecularUnit(Specular(REFLECTION_MODELS["exp"], lobe.operand)),
    "power by products": lambda lobe: PowerUnit(Power(lobe.operand)),
    "power by products, sequential": lambda lobe: PowerUnit(Power(lobe.operand), form="sequential"),
}
"""Units that turn 1 - N·H into a specular term."""


def unit_cost(name: str) -> dict[str, int]:
    """`Cost.totals` of one of the units, its latency and its initiation interval."""
    unit = _UNITS[name](Lobe(BLINN, "one_minus_cosine"))
    return {
        **cost_of(unit).totals,
        "latency": unit.latency,
        "initiation_interval": unit.initiation_interval,
    }


def mesh_of(name: str) -> Mesh:
    """One of `MESHES`."""
    if name == "teapot":
        return load_mesh("teapot", triangles=10_000).mesh
    if name == "sphere":
        return sphere(48)
    around, along = np.meshgrid(*[np.linspace(0, 1, 97)] * 2, indexing="ij")
    if name == "torus":
        a, b = 2 * np.pi * around, 2 * np.pi * along
        out = 1 + 0.4 * np.cos(b)
        points = np.stack([out * np.cos(a), 0.4 * np.sin(b), -out * np.sin(a)], -1)
        normals = np.stack([np.cos(b) * np.cos(a), np.sin(b), -np.cos(b) * np.sin(a)], -1)
    else:
        x, z = 2 * around - 1, 2 * along - 1
        height, slope = 0.15 * np.sin(7 * x) * np.cos(6 * z), 1.05 * np.cos(7 * x) * np.cos(6 * z)
        points = np.stack([x, height, -z], -1)
        normals = np.stack([-slope, np.ones_like(x), -0.9 * np.sin(7 * x) * np.sin(6 * z)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return grid(points, normals)


def frame_errors(
    mesh: str, method: str, model: str, values: Sequence[float], size: Sequence[int] = (640, 480)
) -> list[dict[str, float]]:
    """Largest errors of frames, in LSB, where ``|N·L| > 0.002``.

    Parameters
    ----------
    mesh : str
        One of `MESHES`.
    method : str
        Method of interpolation.
    model : str
        A key of `MODELS` or `LOBES`. With ``quotient`` also a key of `MIRROR_LOBES`.
    values : sequence of float
        Exponents, or roughnesses if the model takes them.
    size : two ints
        Width and height.

    Returns
    -------
    list of dict
        For each value:

        - ``units``: error against method and model in float64;
        - ``total``: error against the exact frame. This frame has Blinn's model, or the model itself if the
          model comes from a table;
        - ``total_spans``: the total error of the method in exact arithmetic with the exact model;
        - ``everywhere``: the total error at any N·L.
    """
    design, surface, found = preset(method, model), mesh_of(mesh), []
    target = design.specular.reflection if design.loads_tables else BLINN
    for value in values:
        scene = scene_for(surface, 10, *size)
        change = {"exponent": value} if target.PARAMETER == "exponent" else {"roughness": value}
        scene = replace(scene, material=replace(scene.material, **change))
        frame = model_frame(scene, design)
        exact = render(scene, "phong", target, raster=frame.raster)
        normals = fragment_normals(scene, frame.raster, frame.raster.visible)
        lit = np.zeros(exact.mask.size, dtype=bool)
        lit[frame.raster.pixel[frame.raster.visible]] = np.abs(normals @ scene.lights[0].direction) > 0.002
        lit = lit.reshape(exact.mask.shape) & exact.mask
        of_method = method_in_float64(scene, design, frame.cut_raster)
        exact_model = design if design.loads_tables else replace(design, specular=Lobe(target))
        of_spans = method_in_float64(scene, exact_model, frame.cut_raster)

        def largest(image, reference, mask):
            return float(np.abs(image[mask] - 255 * reference[mask]).max())

        found.append(
            {
                "value": value,
                "units": largest(frame.image.astype(float), of_method, lit),
                "total": largest(frame.image.astype(float), exact.image, lit),
                "total_spans": largest(255 * of_spans, exact.image, lit),
                "everywhere": largest(frame.image.astype(float), exact.image, exact.mask),
            }
        )
    return found


def tasks(quick: bool) -> list[Task]:
    """Measurements: errors by table size, costs of units, errors of frames."""
    size = [160, 120] if quick else [640, 480]
    found = [
        Task(errors_of_size, {"octaves": octaves, "steps": steps, "samples": 16 if quick else 256})
        for octaves, steps in (SIZES[-1:] if quick else SIZES)
    ]
    found += [Task(unit_cost, {"name": name}) for name in _UNITS]
    names = ("method", "model", "values")
    for mesh in MESHES[:1] if quick else MESHES:
        frames = [(*design, list(EXPONENTS)) for design in FRONT]
        frames += [
            (method, model, list(ROUGHNESSES))
            for model in ("ggx", "beckmann")
            for method in ("quotient", "renormalise")
        ]
        found += [
            Task(frame_errors, {"mesh": mesh, **dict(zip(names, frame, strict=True)), "size": size})
            for frame in frames
        ]
    return found


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: tables of errors and costs."""
    made: dict[str, list[tuple[dict, Any]]] = {}
    for task, result in zip(tasks, results, strict=True):
        made.setdefault(task.function.__name__, []).append((task.settings, result))
    frames = [
        (given["mesh"], (given["method"], given["model"]), row)
        for given, rows in made["frame_errors"]
        for row in rows
    ]
    worst = {
        design: max(row["total"] for _, of, row in frames if of == design)
        for design in dict.fromkeys(of for _, of, _ in frames)
    }
    sharp = _serves(frames, "ggx"), _serves(frames, "beckmann")
    text = [
        "A small table with one multiplier gives Blinn's power at every exponent. The table is addressed by "
        "octaves. It also gives any other curve of N·H, for example Beckmann's and GGX. With `quotient` it "
        "is addressed by sin² and cos² of the angle, and has 512 words. Addressed by sin² of half the "
        "angle, it gives true Phong, (R·V)^n. With the other methods it is addressed by 1 - N·H, and has "
        "336 words.",
        "Largest errors against exact shading with Blinn's power: "
        + ", ".join(
            f"`{method}`, `{model}` {worst[method, model]:.2f} LSB"
            for method, model in FRONT[:1] + FRONT[2:4]
        )
        + ". True Phong against exact shading with its own power: "
        f"{worst['quotient', 'phong']:.2f} LSB. The section *Error against run time* has the costs of these "
        "pipelines.",
        "The column *spans alone* has the error of the normals that the spans give in exact arithmetic. "
        "Spans of both methods follow the true line of N/W, so this error comes only from the words of "
        "their ends.",
        "Sharp lobes: of the measured roughnesses, frames of `quotient` are within 1 LSB from "
        f"{sharp[0]:g} on with `ggx`, and from {sharp[1]:g} on with `beckmann`. Below roughness 0.2 the "
        "words of 18 bits do not guarantee this error.",
    ]
    heads = [
        f"{case.reflection.name} {case.label} = {value:g}, LSB" for case in CASES for value in case.values
    ]
    sizes = [
        [f"{given['octaves']}, {given['steps']}", (given["octaves"] + 1) * given["steps"], *chain(*errors)]
        for given, errors in made["errors_of_size"]
    ]
    names = ("multipliers", "cells", "register_bits", "memory_bits", "latency")
    parts = [
        Table(
            "lobe-errors",
            "Largest error of the lobe unit, by the size of its table",
            ["octaves, steps", "words", *heads],
            sizes,
            "Bit-accurate terms against the model in float64, in LSB of a channel at full brightness.",
        ),
        Table(
            "lobe-units",
            "Units that turn 1 - N·H into a specular term",
            ["unit", *names, "initiation interval"],
            [
                [given["name"], *(cost[name] for name in names), cost["initiation_interval"]]
                for given, cost in made["unit_cost"]
            ],
            "Counted by Yosys before mapping to an FPGA.",
        ),
        Table(
            "lobe-frames",
            "Largest errors of frames",
            [
                "mesh",
                "method",
                "model",
                "exponent or roughness",
                "units, LSB",
                "total, LSB",
                "spans alone, LSB",
                "anywhere, LSB",
            ],
            [
                [
                    mesh,
                    *design,
                    *(row[name] for name in ("value", "units", "total", "total_spans", "everywhere")),
                ]
                for mesh, design, row in frames
            ],
            "White light, k_d 0.4 and k_s 0.55. Only pixels with |N·L| over 0.002 count, except in the last "
            "column. *Units*: against the method and the model in float64, with the rounding of a pixel. "
            "*Total* and *anywhere*: against exact normals of every pixel with Blinn's power. For `phong`, "
            "`ggx` and `beckmann` the reference has their own model.",
        ),
    ]
    return Section("lobe", "Exact highlights from one small table", text, parts)


def _serves(frames: Sequence[tuple[str, tuple[str, str], dict]], model: str) -> float:
    """Least roughness from which `quotient` is within 1 LSB."""
    off = [row["value"] for _, of, row in frames if of == ("quotient", model) and row["total"] > 1]
    values = sorted({row["value"] for _, of, row in frames if of == ("quotient", model)})
    return next((value for value in values if value > max(off, default=0)), float("inf"))
