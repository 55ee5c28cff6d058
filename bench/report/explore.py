"""The design space: pipelines that draw a scene within an error limit, and their costs.

``blysk explore`` draws a scene with every design of a sweep over method, model, lights, polynomial degree,
word length, operand and style. It lists the cheapest designs under a given error. The bit-accurate model
computes the frames, and is equal to the simulation to the bit. Costs are counted in the netlist. The cache
keeps results. So every design is measured once, and a stopped run can continue.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from blysk.bench.command import resumable
from blysk.bench.report.design_space import (
    Explored,
    cheapest,
    errors_of,
    explored,
    front_of,
    tasks_of,
)
from blysk.bench.report.frames import scenes_of, view_of
from blysk.bench.report.section import Drawing, Section, Table
from blysk.bench.store import Task, results_of
from blysk.bench.svg import svg
from blysk.bench.tools.defaults import EXPONENT, SIZE
from blysk.bench.tools.sweep import COSTS, Candidate, Sweep
from blysk.golden.build import STYLES
from blysk.golden.reference.raster import rasterise
from blysk.sim.errors import InputError
from blysk.sim.frames.error_names import ERRORS
from blysk.sim.frames.workers import cluster_executor, local_executor, processors
from blysk.sim.output import write_json

__all__ = [
    "explore",
    "section",
    "tasks",
]


_MARKERS = dict(zip(STYLES, ("o", "^"), strict=True))

_TRIANGLES = 10_000


# The report's section.


def tasks(quick: bool) -> list[Task]:
    """Measurements of the section, at exponent `EXPONENT`.

    Parameters
    ----------
    quick : bool
        Whether the report is quick. A quick report measures five methods on a teapot of 992 triangles at
        160x120. A full report measures the default `Sweep` on a teapot of 10,712 triangles at 320x240.
    """
    if quick:
        one = {"operands": (None,), "degrees": (3,), "fraction_bits": (46,), "styles": ("throughput",)}
        sweeps = [
            Sweep(methods=("quotient",), models=("blinn", "phong"), **one),
            Sweep(("linear", "renormalise", "quadratic", "chord-local"), models=("blinn", "cosquad"), **one),
        ]
        view = view_of("teapot", 992, 160, 120)
    else:
        sweeps, view = [Sweep()], view_of("teapot", _TRIANGLES, *SIZE)
    return tasks_of([one for sweep in sweeps for one in sweep.candidates()[0]], view, EXPONENT)


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: error against cost of the designs of a sweep."""
    designs = explored(tasks, results)
    view = next(task.settings["view"] for task in tasks if task.function is errors_of)
    fronts = {
        (error, cost): front_of(designs, error, cost, given_values=False)
        for error in ("method", "total")
        for cost in ("cells", "multipliers")
    }
    best = cheapest(designs, "method", 1.0, "cells")
    out_of_range = sum(one.out_of_range_spans > 0 for one in designs)
    text = [
        f"{len(designs)} pipelines draw {view['source']} at {view['width']}x{view['height']} with exponent "
        f"{EXPONENT}. They are all possible combinations of method, reflection model, style, operand of "
        "the specular unit and degree of the method's polynomial. `chord-local` also has several words of "
        "its differences. The bit-accurate model computes the frames, and equals the simulation to the bit. "
        "Costs are counted in the netlist before technology mapping. `blysk explore` does the same for any "
        "mesh, with more choices."
    ]
    if out_of_range:
        text.append(
            f"{out_of_range} of these pipelines flag spans of this scene as too wide, because their "
            "polynomial serves only narrower spans. They are on no front."
        )
    for given, which in (
        (False, "The cheapest design with an error of at most 1 LSB against exact normals in this scene"),
        (True, "The cheapest design whose spans bring values of each light, at a cost that is not counted,"),
    ):
        those = [designs[k] for k in best if designs[k].candidate.design.interpolator.given_values == given]
        if those:
            text.append(
                f"{which} takes {those[0].costs['cells']:,} cells. Its largest error here is "
                f"{those[0].errors['method']['max_lsb']:.2f} LSB of linear light. Its command is "
                f"`{those[0].candidate.command}`."
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
        "The arithmetic error is against the same method and model in float64. The method error is against "
        "exact normals of every pixel with the same model. The total error is against exact normals with "
        "Blinn's power, or for a lobe with its own model. Cycles a pixel follow from the figures of the "
        "units for these spans. A frame takes fewer cycles if short spans are set up during long spans, or "
        "if pixels lack terms. `bisection` states no cycles for spans that it divides. A cell is an operator "
        "of any width, so a multiplier is a cell, too. The compact style has fewer multipliers. The logic "
        "that shares them often makes its number of cells larger."
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
                "Each mark is a pipeline. The line is the Pareto front: no other pipeline is better in both "
                "measures. Marks on the front have black edges. Pipelines of `chord-local` are not on the "
                "front, because their spans bring values of each light, and the cost of these values is not "
                "counted. For `quotient`, the transformation of normals also turns vectors into the frame of "
                "a light. Above: errors against exact normals of every pixel with the same model. Below: "
                "errors against exact normals with Blinn's power, or for a lobe with its own model.",
            ),
            Table("design-space", "Designs", columns, rows, note),
        ],
        {"designs": [one.as_dict() for one in designs]},
    )


_CHOICES = ("method", "model", "lights", "operand", "degree", "fraction bits", "style")


def _choices(candidate: Candidate) -> tuple[str | int | None, ...]:
    """Choices of a design, as cells of a table."""
    operand = candidate.design.interpolator.operand
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


# The list.


def _executor(jobs: int, address: str | None) -> AbstractContextManager[Executor | None]:
    if address is not None:
        return cluster_executor(address)
    return local_executor(jobs) if jobs > 1 else nullcontext()


def explore(
    candidates: Sequence[Candidate],
    mesh: str,
    exponent: int,
    size: tuple[int, int],
    error: str,
    largest: float,
    cost: str,
    limit: int,
    jobs: int | None,
    address: str | None,
    figures: str | None,
    impossible: Mapping[str, int],
) -> None:
    """Measure designs, and print the designs under an error: `blysk explore` after its checks.

    Parameters
    ----------
    candidates, impossible
        Results of `Sweep.candidates`.
    mesh, exponent, size
        The scene.
    error, largest, cost, limit
        Kind and limit of the error, kind of the cost, and number of designs to list.
    jobs, address
        Processes, or a Dask scheduler.
    figures : str or None
        JSON file for every design.

    Raises
    ------
    InputError
        If the mesh shows no pixel, or no design is under the error.
    """
    left_out = "; ".join(f"{count} of {reason}" for reason, count in impossible.items())
    view = view_of(mesh, _TRIANGLES, *size)
    if not rasterise(*scenes_of(view, [exponent])).visible.any():
        reason = f"no pixel shows the surface at {size[0]}x{size[1]}"
        raise InputError(mesh, reason, "choose another mesh, or a larger --size")
    todo = tasks_of(candidates, view, exponent)
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
    most = f"{largest:g} LSB of linear light"
    print(f"designs     {len(best)} of {len(designs)} have a {error} error of at most {most} here")
    if not best:
        usable = [one.errors[error]["max_lsb"] for one in designs if not one.out_of_range_spans]
        least = f"the least is {min(usable):.2f} LSB" if usable else "all of them flag spans as too wide"
        raise InputError(
            f"--largest-error {largest:g}",
            f"no design of the sweep reaches it, {least}",
            "allow a larger error, or sweep more designs",
        )
    listed = best[:limit]
    print(_table([designs[index] for index in listed], on_front[listed]))
    if any(designs[index].candidate.design.interpolator.given_values for index in listed):
        print("chord-local gets values of each light with each span. Its cost leaves out their computation.")
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
