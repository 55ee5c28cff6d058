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

from blysk.bench.command import resumable
from blysk.bench.report.design_space import (
    Explored,
    cheapest,
    explored,
    front_of,
    tasks_of,
)
from blysk.bench.report.frames import scenes_of, view_of
from blysk.bench.store import results_of
from blysk.bench.tools.sweep import COSTS, Candidate
from blysk.golden.reference.raster import rasterise
from blysk.sim.errors import InputError
from blysk.sim.frames.error_names import ERRORS
from blysk.sim.frames.workers import cluster_executor, local_executor, processors
from blysk.sim.output import write_json

__all__ = ["explore"]


_TRIANGLES = 10_000

_CHOICES = ("method", "model", "lights", "operand", "degree", "fraction bits", "style", "lanes")


def _choices(candidate: Candidate) -> tuple[str | int | None, ...]:
    """Choices of a design, as cells of a table."""
    operand = candidate.design.interpolator.operand
    values = asdict(candidate) | {"operand": operand}
    return tuple(values.values())


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
            "the scene has spans wider than these designs can shade"
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
        print(
            "chord-local gets values of each light with each span. The cost of a design leaves out the "
            "computation of these values."
        )
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
