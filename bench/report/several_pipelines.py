"""The report's section on several pipelines: pixels a cycle by mesh and number of pipelines."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from blysk.bench.report.section import Cell, Section, Table
from blysk.bench.speed import pipes
from blysk.bench.store import Task
from blysk.golden.build import PIPES

__all__ = ["measure", "section", "tasks"]


def measure(count: int, meshes: Sequence[str], size: Sequence[int], method: str) -> list[dict[str, Any]]:
    """Fields of a `pipes.Rate` for each mesh.

    Parameters
    ----------
    count : int
        Number of pipelines.
    meshes, method
        As in `pipes.measure`.
    size : sequence of int
        Width and height.
    """
    return [asdict(rate) for rate in pipes.measure(count, meshes, *size, method)]


def tasks(quick: bool) -> list[Task]:
    """A task for each number of pipelines. Quick tasks have small pictures."""
    counts = (1, 2) if quick else PIPES
    meshes = pipes.MESHES[:2] if quick else pipes.MESHES
    settings = {
        "meshes": list(meshes),
        "size": [160, 120] if quick else [640, 480],
        "method": "linear" if quick else "quotient",
    }
    return [Task(measure, {"count": count, **settings}) for count in counts]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: pixels a cycle, their limits, and whether pictures equal those of a single pipeline."""
    rates = [pipes.Rate(**fields) for result in results for fields in result]
    same = sum(rate.same for rate in rates)
    settings = tasks[0].settings
    width, height = settings["size"]
    text = [
        f"N pipelines have the method `{settings['method']}` at {width}x{height}. Pipeline k takes the spans "
        "of the scanlines y with y mod N = k, from its own FIFO. "
        f"{same} of {len(rates)} pictures equal those of the bit-accurate model of a single pipeline.",
        "The port takes a span in a cycle. So the pixels a cycle are at most the average number of pixels of "
        "a span. Small triangles leave pipelines idle. If the average is about N, each cycle in which a full "
        "FIFO stops the port is lost, too.",
    ]
    columns = (
        "mesh",
        "triangles",
        "pipelines",
        "pixels a span",
        "cycles",
        "pixels a cycle",
        "times a single pipeline",
    )
    rows: list[tuple[Cell, ...]] = [
        (
            *(rate.mesh.split()[0], rate.triangles, rate.pipes, rate.pixels_a_span, rate.cycles),
            *(rate.pixels_a_cycle, pipes.times(rates, rate)),
        )
        for rate in sorted(rates, key=lambda rate: settings["meshes"].index(rate.mesh))
    ]
    note = "Cycles are simulated without stalls, from the first write of a constant to the last pixel."
    table = Table("several-pipelines", "Pixels a cycle of several pipelines", columns, rows, note)
    return Section("several-pipelines", "More than one pixel a cycle", text, [table])
