"""The report's section on place and route: parts and clock rate of the pipeline of every method."""

from collections.abc import Sequence
from typing import Any

from golden.pipeline import METHODS, ShadingPipeline
from hdl.pipeline import ShadingPipelineUnit
from sim.errors import InputError

from .fpga import DEVICE, SEEDS, ToolError, lay_out, tool_versions
from .section import Cell, Section, Table
from .store import Task

__all__ = ["measure", "section", "tasks"]

MODEL = "cosquad"

_FIGURES = {
    "look-up tables": "luts",
    "flip-flops": "flip_flops",
    "multipliers": "multipliers",
    "block RAMs": "block_rams",
    "RAMs in look-up tables": "distributed_rams",
    "clock rate, smallest, MHz": "fmax_min_mhz",
    "clock rate, median, MHz": "fmax_median_mhz",
    "clock rate, largest, MHz": "fmax_max_mhz",
}


def measure(method: str, model: str, seeds: int, tools: dict[str, str | None]) -> dict[str, Any]:
    """Layout of a pipeline with one light: `bench.fpga.Layout.as_dict`, or a ``reason`` why there is none.

    Parameters
    ----------
    method, model : str
        The design.
    seeds : int
        Placements.
    tools : dict of str to str or None
        Versions of the tools, which the result depends on.
    """
    try:
        return lay_out(method, ShadingPipelineUnit(ShadingPipeline(method, model)), seeds).as_dict()
    except (InputError, ToolError) as error:
        return {"reason": str(error)}


def tasks(quick: bool) -> list[Task]:
    """A task a method, of minutes each.

    Parameters
    ----------
    quick : bool
        None.
    """
    settings = {"model": MODEL, "seeds": SEEDS, "tools": tool_versions()}
    return [] if quick else [Task(measure, {"method": method, **settings}) for method in METHODS]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """A table of the methods, or why there is none.

    Parameters
    ----------
    tasks : sequence of Task
        See `tasks`.
    results : sequence of dict
        Of `measure`, in their order.
    """
    name, title = "place-and-route", "Place and route"
    if not tasks:
        return Section(name, title, ["Left out of a quick report; `blysk fpga` does it alone."], [])
    versions = tasks[0].settings["tools"]
    missing = [package for package, version in versions.items() if version is None]
    if missing:
        text = (
            f"Not measured: {' and '.join(missing)} not installed. `pip install 'blysk[fpga]'` brings what "
            "is needed; the next report then has the table."
        )
        return Section(name, title, [text], [])
    rows: list[tuple[Cell, ...]] = [
        (task.settings["method"], *(result.get(key) for key in _FIGURES.values()), result.get("reason", ""))
        for task, result in zip(tasks, results, strict=True)
    ]
    text = (
        f"The pipeline of every method, {MODEL}, one light, three channels, on an {DEVICE}, out of context, "
        f"by {' and '.join(f'{package} {version}' for package, version in versions.items())}. Placement "
        f"starts from a seed; clock rates are over {SEEDS} of them. At one pixel a clock, 1920x1080 pixels "
        f"60 times a second ask for {1920 * 1080 * 60 / 1e6:.0f} MHz."
    )
    note = (
        "Look-up tables have four inputs; those that serve as carries, as memories and as wires count. "
        "Multipliers have 18x18 bits and are used without the registers inside them, through which the tool "
        "does not time. Ports have a register each, which is not counted."
    )
    columns = ("method", *_FIGURES, "why there is no figure")
    return Section(
        name, title, [text], [Table(name, "Parts and clock rate of every method", columns, rows, note)]
    )
