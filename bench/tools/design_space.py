"""The design space: pipelines, their errors in a scene, their costs, and the cheapest of them."""

import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple, get_args

import numpy as np

from blysk.bench.report.frames import scenes_of
from blysk.bench.report.points_text import front
from blysk.bench.store import Task
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.methods.bisection_interpolator import BisectionInterpolator
from blysk.golden.methods.interpolator import Operand
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.pipeline import STYLES, Design
from blysk.golden.presets import METHODS, MODELS, PUBLISHED, preset
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.animation import turned
from blysk.sim.frames.figures import ERRORS

__all__ = [
    "COSTS",
    "DEGREES",
    "OPERANDS",
    "Candidate",
    "Explored",
    "Sweep",
    "cheapest",
    "costs_of",
    "errors_of",
    "explored",
    "front_of",
    "tasks_of",
]


COSTS = {
    "cells": "cells",
    "multipliers": "multipliers",
    "registers": "register_bits",
    "memory": "memory_bits",
}
"""Names of the costs, with their figures in `Cost.totals`."""

OPERANDS = get_args(Operand)
"""Operands of the specular unit."""


DEGREES = {QuadraticInterpolator: (2, 3), BisectionInterpolator: (1, 2)}
"""Degrees of a method's polynomial."""

_FITS = {2: "minimax_2", 3: "exact"}
"""Middle normal of each degree."""

_FIGURES = ("max_lsb", "p999_lsb", "rmse_lsb")


@dataclass(frozen=True)
class Candidate:
    """A design of the sweep.

    Parameters
    ----------
    method, model, lights, operand
        See `Design`.
    degree : int, optional
        Degree of the method's polynomial in the angle: for the middle normal (``quadratic`` and its forms: 2,
        a plain minimax fit, or 3), or for the bisection's factor (1 or 2).
    fraction_bits : int, optional
        Fraction bits of the differences of ``chord-local``.
    style : str
        See `ShadingPipelineUnit`.

    Raises
    ------
    ValueError
        If there is no such design.
    """

    method: str
    model: str = "cosquad"
    lights: int = 1
    operand: Operand | None = None
    degree: int | None = None
    fraction_bits: int | None = None
    style: str = "throughput"

    def __post_init__(self):
        _ = self.design

    @cached_property
    def design(self) -> Design:
        """Its `Design`: the bit-accurate model of the pipeline."""
        usual = preset(self.method, self.model, self.lights, operand=self.operand, style=self.style)
        interpolator, changes = usual.interpolator, {}
        if usual.takes_vectors and self.model in MODELS:
            raise ValueError(f"method {self.method} has tables of lobes, and no circuits of other models")
        if self.fraction_bits is not None and not isinstance(interpolator, LocalChordInterpolator):
            raise ValueError(f"method {self.method} has no choice of words")
        if self.degree not in (None, *_degrees(self.method)):
            raise ValueError(f"method {self.method} has no polynomial of degree {self.degree}")
        if self.fraction_bits is not None:
            changes = {"fraction_bits": self.fraction_bits}
        elif self.degree is not None and isinstance(interpolator, QuadraticInterpolator):
            changes = {"middle_normal": MiddleNormal(_FITS[self.degree])}
        elif self.degree is not None:
            changes = {"bisection": replace(interpolator.bisection, degree=self.degree)}
        return replace(usual, interpolator=replace(interpolator, **changes))

    def unit(self) -> ShadingPipelineUnit:
        """Its hardware."""
        return ShadingPipelineUnit(self.design)

    @property
    def command(self) -> str:
        """Shell command that prints it as Verilog."""
        usual = preset(self.method, self.model, operand=self.operand).interpolator
        if self.method in METHODS and self.design.interpolator == usual:
            words = ["blysk", "verilog", "--method", self.method, "--model", self.model]
            words += ["--lights", str(self.lights)] if self.lights != 1 else []
            words += ["--operand", self.operand] if self.operand else []
            words += ["--style", self.style] if self.style != "throughput" else []
            return shlex.join(words)
        given = {field.name: (getattr(self, field.name), field.default) for field in fields(self)}
        # JSON has its strings in double quotes, so that the shell can have the single ones.
        arguments = ", ".join(f"{name}={json.dumps(x)}" for name, (x, usual) in given.items() if x != usual)
        imports = "from blysk.bench.tools.explore import Candidate; from blysk.hdl.emit.verilog import emit"
        return shlex.join(["python", "-c", f'{imports}; print(emit(Candidate({arguments}).unit(), "blysk"))'])


def _degrees(method: str) -> Sequence[int]:
    return DEGREES.get(type(METHODS.get(method)), ())


class Sweep(NamedTuple):
    """Values to combine in all ways. A method that lacks a choice is taken once.

    Parameters
    ----------
    methods, models, lights, operands, degrees, fraction_bits, styles : sequences
        See `Candidate`.
    """

    methods: Sequence[str] = tuple(METHODS)
    models: Sequence[str] = ("blinn", "phong", "cosquad", "lyon3_refitted", "exp")
    lights: Sequence[int] = (1,)
    operands: Sequence[Operand | None] = OPERANDS
    degrees: Sequence[int] = (1, 2, 3)
    fraction_bits: Sequence[int] = (40, 46)
    styles: Sequence[str] = STYLES

    def candidates(self) -> tuple[list[Candidate], dict[str, int]]:
        """Every design once, and the number of impossible combinations for each reason."""
        found: dict[Candidate, None] = {}
        refused: dict[str, list[str]] = {}
        for method in self.methods:
            degrees = self.degrees if _degrees(method) else (None,)
            words = self.fraction_bits if method == "chord-local" else (None,)
            usual = (METHODS | PUBLISHED)[method].operand
            operands = [None if operand == usual else operand for operand in self.operands]
            if usual not in OPERANDS:
                operands = [None]
            for values in product(self.models, self.lights, operands, degrees, words, self.styles):
                try:
                    found[Candidate(method, *values)] = None
                except ValueError as error:
                    reason = str(error).removeprefix(f"method {method} ")
                    refused.setdefault(reason, []).append(method)
        reasons = {
            f"{', '.join(dict.fromkeys(methods))}: {reason}": len(methods)
            for reason, methods in refused.items()
        }
        return list(found), reasons


# Measurements.


def _lit(scene: Scene, lights: int) -> Scene:
    """The scene with its light replaced by several, evenly round an upright axis, together as bright."""
    (light,) = scene.lights
    directions = turned(light.direction, (0, 1, 0), lights).tolist()
    return replace(scene, lights=[Light(tuple(one), (1 / lights,) * 3) for one in directions])


def errors_of(candidate: Mapping[str, Any], view: Mapping[str, Any], exponent: int) -> dict[str, Any]:
    """Errors of a frame by a design's bit-accurate model, whatever its style.

    Parameters
    ----------
    candidate : dict
        Fields of a `Candidate`.
    view : dict
        Mesh and size, as for `frames`.
    exponent : int
        Exponent of the highlight.

    Returns
    -------
    dict
        ``errors``: for each of `ERRORS` ``max_lsb``, ``p999_lsb`` and ``rmse_lsb``;
        ``out_of_range_spans``: number of spans that are too wide for the design, whose pixels may be wrong;
        ``lengths``: pairs of a length and the number of spans that have it.
    """
    tried = Candidate(**candidate)
    (scene,) = scenes_of(view, [exponent])
    scene = _lit(scene, tried.lights)
    frame = model_frame(scene, tried.design)
    comparison = compare(scene, tried.design, frame)
    figures = {name: asdict(getattr(comparison, f"{name}_error")) for name in ERRORS}
    lengths, counts = np.unique(frame.cut_raster.length, return_counts=True)
    return {
        "errors": {name: {key: of[key] for key in _FIGURES} for name, of in figures.items()},
        "out_of_range_spans": frame.out_of_range_spans,
        "lengths": [list(pair) for pair in zip(lengths.tolist(), counts.tolist(), strict=True)],
    }


def costs_of(candidate: Mapping[str, Any]) -> dict[str, int]:
    """Resources of a design by `Cost.totals`, with its ``cycles_per_pixel`` and ``setup_interval``."""
    unit = Candidate(**candidate).unit()
    return cost_of(unit).totals | {
        "cycles_per_pixel": unit.cycles_per_pixel,
        "setup_interval": unit.setup_interval,
    }


def tasks_of(candidates: Iterable[Candidate], view: Mapping[str, Any], exponent: int) -> list[Task]:
    """Measurements of designs on a scene; the errors of a design are one task for both styles."""
    found = []
    for candidate in candidates:
        found.append(Task(costs_of, {"candidate": asdict(candidate)}))
        common = asdict(replace(candidate, style="throughput"))
        found.append(Task(errors_of, {"candidate": common, "view": view, "exponent": exponent}))
    return list({(task.function, repr(task.settings)): task for task in found}.values())


@dataclass(frozen=True)
class Explored:
    """A design that was measured.

    Parameters
    ----------
    candidate : Candidate
        The design.
    errors : dict of dict
        Errors of `errors_of`.
    costs : dict
        Figures of `Cost.totals`.
    cycles_per_pixel : float or None
        Upper bound from the figures of the units: the sum of ``max(cycles_per_pixel length, setup_interval)``
        of all spans, over the number of pixels; writes of constants and latency come on top. A frame takes
        less where a span is set up during the pixels of a longer one, or pixels lack terms. ``None`` for
        ``bisection``, which states no interval of the spans that it divides.
    out_of_range_spans : int
        Number of spans that are too wide, of `errors_of`.
    """

    candidate: Candidate
    errors: dict[str, dict[str, float]]
    costs: dict[str, int]
    cycles_per_pixel: float | None
    out_of_range_spans: int

    def as_dict(self) -> dict[str, Any]:
        """The figures under stable names."""
        figures = {name: x for name, x in asdict(self).items() if name != "candidate"}
        return {**asdict(self.candidate), **figures, "command": self.candidate.command}


def explored(tasks: Sequence[Task], results: Sequence[Any]) -> list[Explored]:
    """Designs, from the results of `tasks_of`."""
    measured = {
        (task.function, Candidate(**task.settings["candidate"])): result
        for task, result in zip(tasks, results, strict=True)
    }
    found = []
    for (function, candidate), result in measured.items():
        if function is not costs_of:
            continue
        frame = measured[errors_of, replace(candidate, style="throughput")]
        lengths, counts = np.array(frame["lengths"]).T
        cycles = np.maximum(result["cycles_per_pixel"] * lengths, result["setup_interval"])
        divides = isinstance(candidate.design.interpolator, BisectionInterpolator)
        found.append(
            Explored(
                candidate,
                frame["errors"],
                {name: result[name] for name in COSTS.values()},
                None if divides else float((cycles * counts).sum() / (lengths * counts).sum()),
                frame["out_of_range_spans"],
            )
        )
    return found


def front_of(designs: Sequence[Explored], error: str, cost: str, *, given_values: bool = True) -> np.ndarray:
    """Whether each design is on the Pareto front of largest error and cost: bool array.

    A design that flags spans as too wide is not on it.

    Parameters
    ----------
    designs : sequence of Explored
        The designs.
    error : str
        One of `ERRORS`.
    cost : str
        One of `COSTS`.
    given_values : bool
        Whether to include designs whose spans carry values of each light in place of normals: their cost does
        not contain the computation of the values.
    """
    errors = [
        None
        if one.out_of_range_spans or (one.candidate.design.takes_values and not given_values)
        else one.errors[error]["max_lsb"]
        for one in designs
    ]
    return front(errors, [one.costs[COSTS[cost]] for one in designs])


def cheapest(designs: Sequence[Explored], error: str, largest: float, cost: str) -> list[int]:
    """Indices of the designs whose largest error is at most ``largest``, the cheapest first.

    Designs of equal cost are sorted by error. Designs that flag spans as too wide are left out.

    Parameters
    ----------
    designs, error, cost
        As for `front_of`.
    largest : float
        Limit of the largest error, in LSB.
    """
    usable = [
        (one.costs[COSTS[cost]], one.errors[error]["max_lsb"], index)
        for index, one in enumerate(designs)
        if not one.out_of_range_spans and one.errors[error]["max_lsb"] <= largest
    ]
    return [index for *_, index in sorted(usable)]
