"""The design space: which pipelines draw a scene within an error, and what they cost.

``blysk explore`` draws a scene with every design of a sweep over method, model, lights, polynomial degree,
word length, operand and style, and lists the cheapest ones under a given error. Frames are those of the
bit-true twin, which are the simulated ones to the bit; costs are counted in the netlist. Every design is
measured once: results are kept, so that a run that was stopped goes on where it was.
"""

import json
import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from itertools import cycle, product
from typing import Any, NamedTuple, get_args

import click
import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from blysk.bench.command import resumable
from blysk.bench.report.points import front, place_of, scenes_of
from blysk.bench.report.section import Drawing, Section, Table
from blysk.bench.store import Task, results_of
from blysk.bench.tools.pages import svg
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.methods.bisection_interpolator import BisectionInterpolator
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.methods.interpolator import Operand
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.pipeline import STYLES, Design
from blysk.golden.presets import METHODS, MODELS, PUBLISHED, preset
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.cli.main import Choice, OutputFile, Size, Whole
from blysk.sim.cli.scene_file import HIGHLIGHTS
from blysk.sim.errors import InputError
from blysk.sim.frames.animation import turned
from blysk.sim.frames.figures import ERRORS
from blysk.sim.frames.workers import check_address, cluster_executor, local_executor, processors
from blysk.sim.output import check_writable, write_json

__all__ = [
    "COSTS",
    "EXPONENT",
    "Candidate",
    "Explored",
    "Sweep",
    "cheapest",
    "command",
    "costs_of",
    "errors_of",
    "explored",
    "front_of",
    "section",
    "tasks",
    "tasks_of",
]

COSTS = {
    "cells": "cells",
    "multipliers": "multipliers",
    "registers": "register_bits",
    "memory": "memory_bits",
}
"""Names of the costs, and of the figures of `Cost.totals`."""

_OPERANDS = dict(zip(HIGHLIGHTS, get_args(Operand), strict=True))
_HIGHLIGHTS = {operand: name for name, operand in _OPERANDS.items()}

_DEGREES = {ChordInterpolator: (1, 2, 3), QuadraticInterpolator: (2, 3), BisectionInterpolator: (1, 2)}
"""Degrees of a method's polynomial."""

_FITS = {2: "minimax_2", 3: "exact"}
"""Middle normal of each degree."""

_WORDS = range(36, 47, 2)
"""Fraction bits of the chord method's differences."""

_FIGURES = ("max_lsb", "p999_lsb", "rmse_lsb")

_MARKERS = dict(zip(STYLES, ("o", "^"), strict=True))

EXPONENT = 50
"""Of the default sweep."""

_TRIANGLES = 10_000
_SIZE = (320, 240)


@dataclass(frozen=True)
class Candidate:
    """A design of the sweep.

    Parameters
    ----------
    method, model, lights, operand
        See `Design`.
    degree : int, optional
        Of the method's polynomial in the angle: of the middle normal (``quadratic`` and its forms: 2, a plain
        minimax fit, or 3), of the chord method's bend (1 to 3), of the bisection's factor (1 or 2).
    fraction_bits : int, optional
        Of the chord method's differences.
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
        """Its pipeline, and bit-true twin."""
        usual = preset(self.method, self.model, self.lights, operand=self.operand, style=self.style)
        interpolator, changes = usual.interpolator, {}
        if isinstance(interpolator, ChordInterpolator):
            changes = {"terms": self.degree, "fraction_bits": self.fraction_bits}
        elif self.fraction_bits is not None:
            raise ValueError(f"method {self.method} has no choice of words")
        elif self.degree not in (None, *_degrees(self.method)):
            raise ValueError(f"method {self.method} has no polynomial of degree {self.degree}")
        elif self.degree is not None and isinstance(interpolator, QuadraticInterpolator):
            changes = {"middle_normal": MiddleNormal(_FITS[self.degree])}
        elif self.degree is not None:
            changes = {"bisection": replace(interpolator.bisection, degree=self.degree)}
        changes = {name: value for name, value in changes.items() if value is not None}
        return replace(usual, interpolator=replace(interpolator, **changes))

    def unit(self) -> ShadingPipelineUnit:
        """Its hardware."""
        return ShadingPipelineUnit(self.design)

    @property
    def command(self) -> str:
        """What prints it as Verilog, in a shell."""
        usual = preset(self.method, operand=self.operand).interpolator
        if self.method in METHODS and self.design.interpolator == usual:
            words = ["blysk", "verilog", "--method", self.method, "--model", self.model]
            words += ["--lights", str(self.lights)] if self.lights != 1 else []
            words += ["--highlight", _HIGHLIGHTS[self.operand]] if self.operand else []
            words += ["--style", self.style] if self.style != "throughput" else []
            return shlex.join(words)
        given = {field.name: (getattr(self, field.name), field.default) for field in fields(self)}
        # JSON has its strings in double quotes, so that the shell can have the single ones.
        arguments = ", ".join(f"{name}={json.dumps(x)}" for name, (x, usual) in given.items() if x != usual)
        imports = "from blysk.bench.tools.explore import Candidate; from blysk.hdl.emit.verilog import emit"
        return shlex.join(["python", "-c", f'{imports}; print(emit(Candidate({arguments}).unit(), "blysk"))'])


def _degrees(method: str) -> Sequence[int]:
    return _DEGREES.get(type(METHODS.get(method)), ())


class Sweep(NamedTuple):
    """Values that are tried with each other. A method without a choice is taken once.

    Parameters
    ----------
    methods, models, lights, operands, degrees, fraction_bits, styles : sequences
        See `Candidate`.
    """

    methods: Sequence[str] = tuple(METHODS)
    models: Sequence[str] = ("cosquad", "lyon3_refitted", "exp")
    lights: Sequence[int] = (1,)
    operands: Sequence[Operand | None] = tuple(_OPERANDS.values())
    degrees: Sequence[int] = (1, 2, 3)
    fraction_bits: Sequence[int] = (40, 46)
    styles: Sequence[str] = STYLES

    def candidates(self) -> tuple[list[Candidate], dict[str, int]]:
        """Every design once, and how many combinations are impossible, by the reason."""
        found: dict[Candidate, None] = {}
        refused: dict[str, list[str]] = {}
        for method in self.methods:
            degrees = self.degrees if _degrees(method) else (None,)
            words = self.fraction_bits if method == "chord" else (None,)
            usual = (METHODS | PUBLISHED)[method].operand
            operands = [None if operand == usual else operand for operand in self.operands]
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
    """The scene with so many lights in place of its one: evenly round an upright axis, together as bright."""
    (light,) = scene.lights
    directions = turned(light.direction, (0, 1, 0), lights).tolist()
    return replace(scene, lights=[Light(tuple(one), (1 / lights,) * 3) for one in directions])


def errors_of(candidate: Mapping[str, Any], place: Mapping[str, Any], exponent: int) -> dict[str, Any]:
    """Errors of a frame by a design's bit-true twin, whatever its style.

    Parameters
    ----------
    candidate : dict
        Of a `Candidate`.
    place : dict
        Mesh and size, as for `frames`.
    exponent : int
        Of the highlight.

    Returns
    -------
    dict
        ``errors``: by each of `ERRORS`, ``max_lsb``, ``p999_lsb`` and ``rmse_lsb``;
        ``out_of_range_spans``: spans that are too wide for the design, whose pixels are not to be trusted;
        ``lengths``: pairs of a length of spans and how many have it.
    """
    tried = Candidate(**candidate)
    (scene,) = scenes_of(place, [exponent])
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
    """What a design takes, by `Cost.totals`; ``cycles_per_pixel`` and ``setup_interval``."""
    unit = Candidate(**candidate).unit()
    return cost_of(unit).totals | {
        "cycles_per_pixel": unit.cycles_per_pixel,
        "setup_interval": unit.setup_interval,
    }


def tasks_of(candidates: Iterable[Candidate], place: Mapping[str, Any], exponent: int) -> list[Task]:
    """Measurements of designs on a scene; what designs of two styles have in common is one."""
    found = []
    for candidate in candidates:
        found.append(Task(costs_of, {"candidate": asdict(candidate)}))
        common = asdict(replace(candidate, style="throughput"))
        found.append(Task(errors_of, {"candidate": common, "place": place, "exponent": exponent}))
    return list({(task.function, repr(task.settings)): task for task in found}.values())


@dataclass(frozen=True)
class Explored:
    """A design that was measured.

    Parameters
    ----------
    candidate : Candidate
        The design.
    errors : dict of dict
        Of `errors_of`.
    costs : dict
        Of `Cost.totals`.
    cycles_per_pixel : float or None
        At most, as the units state it: of each span ``max(cycles_per_pixel length, setup_interval)``, over
        the pixels. Besides, a frame takes its constants' writes and the latency. It takes fewer where long
        spans pay for short ones or pixels lack terms. ``None`` for ``bisection``, which states no interval
        of the spans that it divides.
    out_of_range_spans : int
        Of `errors_of`.
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
    """Which designs are on the Pareto front of largest error and cost: bool array.

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
        Whether designs count that are given values of each light with a span, in place of normals: what it
        takes to work these out is not in their cost.
    """
    errors = [
        None
        if one.out_of_range_spans or (one.candidate.design.takes_values and not given_values)
        else one.errors[error]["max_lsb"]
        for one in designs
    ]
    return front(errors, [one.costs[COSTS[cost]] for one in designs])


def cheapest(designs: Sequence[Explored], error: str, largest: float, cost: str) -> list[int]:
    """Indices of the designs whose largest error is at most that, the cheapest first.

    Of equally cheap ones the more exact comes first. Designs that flag spans as too wide are left out.

    Parameters
    ----------
    designs, error, cost
        As for `front_of`.
    largest : float
        LSB.
    """
    usable = [
        (one.costs[COSTS[cost]], one.errors[error]["max_lsb"], index)
        for index, one in enumerate(designs)
        if not one.out_of_range_spans and one.errors[error]["max_lsb"] <= largest
    ]
    return [index for *_, index in sorted(usable)]


# The report's section.


def tasks(quick: bool) -> list[Task]:
    """What to measure.

    Parameters
    ----------
    quick : bool
        Four methods on a teapot of 992 triangles at 160x120; else the default `Sweep` on one of 10,712 at
        320x240. Exponent `EXPONENT`.
    """
    if quick:
        sweep = Sweep(
            methods=("linear", "renormalise", "chord", "chord-local"),
            models=("cosquad",),
            operands=(None,),
            degrees=(3,),
            fraction_bits=(46,),
            styles=("throughput",),
        )
        place = place_of("teapot", 992, 160, 120)
    else:
        sweep, place = Sweep(), place_of("teapot", _TRIANGLES, *_SIZE)
    return tasks_of(sweep.candidates()[0], place, EXPONENT)


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """Error against cost of the designs of a sweep."""
    designs = explored(tasks, results)
    place = next(task.settings["place"] for task in tasks if task.function is errors_of)
    fronts = {
        (error, cost): front_of(designs, error, cost, given_values=False)
        for error in ("method", "total")
        for cost in ("cells", "multipliers")
    }
    best = cheapest(designs, "method", 1.0, "cells")
    out_of_range = sum(one.out_of_range_spans > 0 for one in designs)
    text = [
        f"{len(designs)} pipelines draw {place['source']} at {place['width']}x{place['height']}, exponent "
        f"{EXPONENT}: methods, reflection models, operands of the specular unit, degrees of the methods' "
        "polynomials, words of the chord method's differences, and styles, each with each where that is "
        "possible. The frames are those of the bit-true twin, which are the simulated ones to the bit; what "
        "a design takes is counted in its netlist before technology mapping. `blysk explore` does the same "
        "for any mesh, and for more choices."
    ]
    if out_of_range:
        text.append(
            f"{out_of_range} of them flag spans of this scene as too wide, and are on no front: their "
            "polynomial is for narrower ones."
        )
    for given, which in (
        (False, "The cheapest within 1 LSB of exactly normalised interpolation"),
        (True, "The cheapest that is given values of each light with a span, and counts none of that work,"),
    ):
        those = [designs[k] for k in best if designs[k].candidate.design.takes_values == given]
        if those:
            text.append(
                f"{which} takes {those[0].costs['cells']:,} cells and is off by "
                f"{those[0].errors['method']['max_lsb']:.2f} LSB at most: `{those[0].candidate.command}`."
            )
    rows = [
        (
            *_choices(one.candidate),
            *(one.errors[name]["max_lsb"] for name in ERRORS),
            *(one.costs[name] for name in COSTS.values()),
            one.cycles_per_pixel,
            one.out_of_range_spans,
            *(bool(on_front[index]) for on_front in fronts.values()),
        )
        for index, one in enumerate(designs)
    ]
    columns = (
        *_CHOICES,
        *(f"largest {name} error, LSB" for name in ERRORS),
        *("cells", "multipliers", "register bits", "memory bits", "cycles a pixel at most", "spans too wide"),
        *(f"front of {error} error and {cost}" for error, cost in fronts),
    )
    note = (
        "Errors: arithmetic, against the same method and model in float64; method, against exactly "
        "normalised interpolation with the same model; total, against the exact Blinn frame. Clocks a pixel "
        "are what the units state for these spans: a frame takes fewer where long spans pay for short ones "
        "or pixels lack terms; bisection states none for spans that it divides. A cell is an operator of any "
        "width, a multiplier, too: the compact style has fewer multipliers and, with what shares them, often "
        "more cells."
    )
    return Section(
        "explore",
        "Design space",
        text,
        [
            Drawing(
                "design-space",
                "Largest error against cells, and against multipliers",
                svg(_drawing(designs, fronts)),
                "Each mark is a pipeline; the line is the Pareto front of those that no other beats in both, "
                "whose marks are edged in black. Those of chord-local are not on it: they are given values "
                "of each light with a span, and what it takes to work these out is not counted. Above: "
                "against exactly normalised interpolation with the same model. Below: against the exact "
                "Blinn frame.",
            ),
            Table("design-space", "Designs", columns, rows, note),
        ],
        {"designs": [one.as_dict() for one in designs]},
    )


_CHOICES = ("method", "model", "lights", "operand", "degree", "fraction bits", "style")


def _choices(candidate: Candidate) -> tuple[str | int | None, ...]:
    """What tells a design from others, as tables have it."""
    operand = _HIGHLIGHTS[candidate.design.interpolator.operand]
    values = asdict(candidate) | {"operand": operand}
    return tuple(values.values())


def _drawing(designs: Sequence[Explored], fronts: Mapping[tuple[str, str], np.ndarray]) -> Figure:
    figure = Figure(figsize=(9.5, 7.6), layout="constrained")
    shades = colormaps["tab20"].colors
    methods = dict.fromkeys(one.candidate.method for one in designs)
    colors = dict(zip(methods, cycle(shades[::2] + shades[1::2]), strict=False))
    grid = figure.subplots(2, 2, sharex="col", sharey="row")
    for axes, ((error, cost), on_front) in zip(grid.flat, fronts.items(), strict=True):
        line = []
        for one, chosen in zip(designs, on_front.tolist(), strict=True):
            if one.out_of_range_spans:
                continue
            point = (one.costs[cost], one.errors[error]["max_lsb"])
            line += [point] if chosen else []
            axes.plot(
                *point,
                _MARKERS[one.candidate.style],
                color=colors[one.candidate.method],
                markersize=6,
                markeredgecolor="black" if chosen else "white",
                markeredgewidth=1.2 if chosen else 0.4,
                zorder=3 if chosen else 2,
            )
        if line:
            axes.step(*zip(*sorted(line), strict=True), where="post", color="black", linewidth=1)
        axes.set(xscale="log", yscale="log", xlabel=cost, ylabel=f"largest {error} error, LSB")
        axes.label_outer()
        for axis, steps in ((axes.xaxis, (1, 1.5, 2, 3, 4, 5, 7)), (axes.yaxis, (1, 2, 5))):
            axis.set_major_locator(LogLocator(subs=steps))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_locator(NullLocator())
        axes.grid(alpha=0.25)
    keys = {method: Line2D([], [], color=color, marker="s", ls="") for method, color in colors.items()}
    keys |= {style: Line2D([], [], color="0.4", marker=mark, ls="") for style, mark in _MARKERS.items()}
    keys["Pareto front"] = Line2D([], [], color="black", linewidth=1)
    figure.legend(keys.values(), keys, loc="outside lower center", ncols=7, fontsize=8)
    return figure


# The command.


class _Some(click.ParamType):
    """Names or whole numbers with commas between them."""

    def __init__(self, values: Sequence[str | int]):
        self.values = tuple(values)
        self.name = "LIST"

    def get_metavar(self, param, ctx):
        return self.name

    def convert(self, value, param, ctx):
        """Each once, or one line that refuses them."""
        if isinstance(value, tuple):
            return value
        known = {str(one): one for one in self.values}
        unknown = [word for word in value.split(",") if word not in known]
        if unknown:
            reason = f"{unknown[0]!r} is none of the choices"
            raise InputError(f"{param.opts[0]} {value}", reason, f"use some of {','.join(known)}")
        return tuple(dict.fromkeys(known[word] for word in value.split(",")))


class _Error(click.ParamType):
    """A largest error."""

    name = "LSB"

    def convert(self, value, param, ctx):
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not 0 < number <= 255:
            raise InputError(f"{param.opts[0]} {value}", "no such error", "give a number up to 255, in LSB")
        return number


def _executor(jobs: int, address: str | None) -> AbstractContextManager[Executor | None]:
    if address is not None:
        return cluster_executor(address)
    return local_executor(jobs) if jobs > 1 else nullcontext()


def _option(name: str, values: Sequence[str | int], default: Sequence[str | int], text: str):
    listed = ",".join(map(str, default))
    return click.option(name, type=_Some(values), default=listed, show_default=True, help=text)


_USUAL = Sweep()


@click.command(short_help="Sweep the design space: the cheapest designs under an error.")
@click.option("--mesh", default="teapot", show_default=True, help="File, or teapot.")
@click.option(
    "--exponent", type=Whole(1, MAX_EXPONENT), default=EXPONENT, show_default=True, help="Of the highlight."
)
@click.option(
    "--size", type=Size(), default="x".join(map(str, _SIZE)), show_default=True, help="Of the picture."
)
@click.option(
    "--largest-error", "largest", type=_Error(), default=1.0, show_default=True, help="Of any channel."
)
@click.option(
    "--error",
    type=Choice("error", ERRORS),
    default="method",
    show_default=True,
    help="Against the same method and model in float64, exactly normalised interpolation with the same "
    "model, or the exact Blinn frame.",
)
@click.option(
    "--cost", type=Choice("cost", COSTS), default="cells", show_default=True, help="What is to be little."
)
@_option(
    "--methods",
    [*METHODS, *PUBLISHED],
    _USUAL.methods,
    f"Interpolation along a span; also {', '.join(PUBLISHED)}.",
)
@_option("--models", MODELS, _USUAL.models, f"Of the reflection models {', '.join(MODELS)}.")
@_option("--lights", range(1, MAX_LIGHTS + 1), _USUAL.lights, f"Numbers of lights, to {MAX_LIGHTS}.")
@_option("--highlights", HIGHLIGHTS, HIGHLIGHTS, "Forms of the specular argument.")
@_option(
    "--degrees",
    sorted({degree for degrees in _DEGREES.values() for degree in degrees}),
    _USUAL.degrees,
    "Of the polynomial: chord 1 to 3, quadratic in its forms 2 and 3, bisection 1 and 2.",
)
@_option("--fraction-bits", _WORDS, _USUAL.fraction_bits, "Of the differences of chord: 36 to 46, even.")
@_option("--styles", STYLES, _USUAL.styles, "One pixel a clock, or few multipliers.")
@click.option("--limit", type=Whole(1, 1000), default=10, show_default=True, help="Designs that are listed.")
@click.option("--jobs", type=Whole(1, 1024), help="Processes.  [default: processors]")
@click.option(
    "--cluster", "address", metavar="ADDRESS", help="Dask scheduler whose workers measure: tcp://host:8786."
)
@click.option("--json", "figures", type=OutputFile(), help="Every design, with every figure.")
def command(mesh, exponent, size, largest, error, cost, highlights, limit, jobs, address, figures, **choices):
    """Draw a scene with every design of a sweep, and list the cheapest under an error.

    Choices are lists with commas, and are tried each with each; a method without a choice is taken once.
    Errors are in LSB of an 8-bit channel. Cells, multipliers, register and memory bits are counted in the
    netlist, before technology mapping. Clocks are the most that a pixel takes, by what the units state for
    the scene's spans; bisection states none for those that it divides. Designs with a * are on the Pareto
    front of the sweep: none is better in error and cost. Several lights stand evenly round the scene. What
    was measured before comes from the cache.

    \b
    Example:
        blysk explore --methods chord,quadratic --models exp --largest-error 0.6 --cost multipliers
    """
    if jobs and address is not None:
        raise InputError("--jobs", "a cluster has its own workers", "leave out --jobs or --cluster")
    if address is not None:
        check_address(address)
    if figures:
        check_writable(figures)
    sweep = Sweep(operands=tuple(_OPERANDS[name] for name in highlights), **choices)
    candidates, impossible = sweep.candidates()
    left_out = "; ".join(f"{count} of {reason}" for reason, count in impossible.items())
    if not candidates:
        raise InputError("the sweep", f"holds no possible design, {left_out}", "choose other combinations")
    place = place_of(mesh, _TRIANGLES, *size)
    if not rasterise(*scenes_of(place, [exponent])).visible.any():
        reason = f"no pixel shows the surface at {size[0]}x{size[1]}"
        raise InputError(mesh, reason, "choose another mesh, or a larger --size")
    todo = tasks_of(candidates, place, exponent)
    with (
        resumable(len(todo), "measurements") as progress,
        _executor(jobs or processors(), address) as executor,
    ):
        results = results_of(todo, executor, progress)
    designs = explored(todo, results)
    on_front = front_of(designs, error, cost)
    if figures:
        write_json(
            figures,
            {
                "mesh": mesh,
                "exponent": exponent,
                "width": size[0],
                "height": size[1],
                "error": error,
                "largest_error": largest,
                "cost": cost,
                "impossible": impossible,
                "designs": [
                    {**one.as_dict(), "front": bool(chosen)}
                    for one, chosen in zip(designs, on_front, strict=True)
                ],
            },
        )
    if impossible:
        print(f"impossible  {sum(impossible.values())} combinations: {left_out}")
    out_of_range = sum(one.out_of_range_spans > 0 for one in designs)
    if out_of_range:
        print(
            f"too narrow  {out_of_range} of {len(designs)} designs: "
            "the scene has spans wider than they can shade"
        )
    best = cheapest(designs, error, largest, cost)
    print(f"designs     {len(best)} of {len(designs)} have a {error} error of at most {largest:g} LSB")
    if not best:
        usable = [one.errors[error]["max_lsb"] for one in designs if not one.out_of_range_spans]
        least = f"the least is {min(usable):.2f} LSB" if usable else "all of them flag spans as too wide"
        raise InputError(
            f"--largest-error {largest:g}",
            f"no design of the sweep reaches it, {least}",
            "allow more, or sweep more",
        )
    listed = best[:limit]
    print(_table([designs[index] for index in listed], on_front[listed]))
    if any(designs[index].candidate.design.takes_values for index in listed):
        print("chord-local is given values of each light with a span; to work them out is not in its cost")
    for number, index in enumerate(listed, 1):
        print(f"{number:>3}  {designs[index].candidate.command}")


_HEAD = ("", "", *_CHOICES, *(f"{name} error" for name in ERRORS), *COSTS, "cycles")


def _table(designs: Sequence[Explored], on_front: Sequence[bool]) -> str:
    """Designs as aligned text."""
    lines = [_HEAD]
    for number, (one, chosen) in enumerate(zip(designs, on_front, strict=True), 1):
        lines.append(
            (
                str(number),
                "*" if chosen else "",
                *("-" if x is None else str(x) for x in _choices(one.candidate)),
                *(f"{one.errors[name]['max_lsb']:.2f}" for name in ERRORS),
                *(f"{one.costs[name]:,}" for name in COSTS.values()),
                "-" if one.cycles_per_pixel is None else f"{one.cycles_per_pixel:.2f}",
            )
        )
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    left = {_HEAD.index(name) for name in ("method", "model", "operand", "style")}
    return "\n".join(
        "  ".join(
            text.ljust(width) if k in left else text.rjust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )
