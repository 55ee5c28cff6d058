"""The report's section on place and route: parts and clock rate of the pipeline, a table for each family."""

from collections.abc import Sequence
from statistics import median
from typing import Any

from blysk.bench.accuracy import model_of
from blysk.bench.report.section import Cell, Section, Table
from blysk.bench.store import Task
from blysk.bench.tools.defaults import SEEDS
from blysk.bench.tools.families import ECP5, FAMILIES
from blysk.bench.tools.place_and_route import lay_out, tool_versions
from blysk.bench.tools.tool_runner import TooLarge
from blysk.golden.presets import METHODS, preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.api.placed import read_store
from blysk.sim.installation import install_extra

__all__ = ["measure", "section", "task", "tasks"]

OTHERS = ("quadratic", "quotient")
"""Methods for the families after the first."""

OTHERS_SEEDS = 3

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


def measure(method: str, model: str, family: str, seeds: int, tools: dict[str, str | None]) -> dict[str, Any]:
    """Place and route a pipeline with one light: `Layout.as_dict`, or the ``reason`` of a failure.

    Parameters
    ----------
    method, model : str
        The design.
    family : str
        One of `FAMILIES`.
    seeds : int
        Number of placements.
    tools : dict of str to str or None
        Versions of the tools. The result depends on them.
    """
    design = ShadingPipelineUnit(preset(method, model))
    if None in tools.values():
        return {"reason": f"place and route is not installed: {install_extra('fpga')}"}
    try:
        return lay_out(method, design, seeds, family=FAMILIES[family]).as_dict()
    except TooLarge as error:
        return {"reason": str(error)}


def task(method: str, model: str | None = None, family: str = "ecp5") -> Task:
    """Task that measures a pipeline. Published methods, and other models than `model_of`, have one seed.

    Parameters
    ----------
    method, family
        As in `measure`.
    model : str, optional
        As in `measure`. The default is `model_of` the method.
    """
    seeds, model = 1, model or model_of(method)
    if method in METHODS and model == model_of(method):
        seeds = SEEDS if FAMILIES[family] is ECP5 else OTHERS_SEEDS
    settings = {"method": method, "model": model, "family": family, "seeds": seeds}
    return Task(measure, settings | {"tools": tool_versions(FAMILIES[family])})


def tasks(quick: bool) -> list[Task]:
    """Tasks of some minutes each: every method for the first family, `OTHERS` for the other families.

    Parameters
    ----------
    quick : bool
        Whether the report is quick. A quick report has no tasks.
    """
    if quick:
        return []
    return [
        task(method, family=name)
        for name, family in FAMILIES.items()
        for method in (METHODS if family is ECP5 else OTHERS)
    ]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: for each family a table, or the reason for a missing table.

    Parameters
    ----------
    tasks : sequence of Task
        See `tasks`.
    results : sequence of dict
        Results of `measure`, in their order.
    """
    name, title = "place-and-route", "Place and route"
    if not tasks:
        return Section(name, title, *_committed())
    text = [
        "The pipelines have the model `cosquad`, but `blinn` for `quotient`, with one light and three "
        "channels, out of context. Placement starts from a seed, and clock rates are over several seeds. At "
        f"one pixel a cycle, 1920x1080 pixels 60 times a second need {1920 * 1080 * 60 / 1e6:.0f} MHz."
    ]
    tables = []
    for family in FAMILIES:
        of_family = [
            (task.settings, result)
            for task, result in zip(tasks, results, strict=True)
            if task.settings["family"] == family
        ]
        said, table = _table(family, of_family)
        text.append(said)
        tables += [table] if table else []
    return Section(name, title, text, tables)


def _committed() -> tuple[list[str], list[Table]]:
    """Text and table of a quick report. It has the figures of the store, each with its date and command."""
    rows: list[list[Cell]] = [
        [
            *(
                entry[name]
                for name in ("design", "device", "luts", "flip_flops", "multipliers", "block_rams")
            ),
            *(
                min(entry["fmax_mhz"], default=None),
                median(entry["fmax_mhz"]) if entry["fmax_mhz"] else None,
                max(entry["fmax_mhz"], default=None),
                len(entry["fmax_mhz"]),
            ),
            *(entry["date"], entry["command"]),
        ]
        for entry in read_store()
    ]
    columns = ["design", "device", "look-up tables", "flip-flops", "multipliers", "block RAMs"]
    columns += [f"clock rate, {which}, MHz" for which in ("smallest", "median", "largest")]
    columns += ["seeds", "date", "command"]
    text = (
        "Placing a design takes minutes, so a quick report places no design. It shows the committed figures, "
        "each with its date and command. Measure more with `blysk fpga --json FILE`, and add them with "
        "`python -m blysk.bench.report.placed FILE`. A full report measures all figures anew."
    )
    table = Table(
        "place-and-route-committed", "Committed figures", columns, rows, "Out of context, with one light."
    )
    return [text], [table]


def _table(family: str, results: Sequence[tuple[dict[str, Any], Any]]) -> tuple[str, Table | None]:
    """Text and table of a family. ``results`` are pairs of settings and figures."""
    device = FAMILIES[family].device
    settings = results[0][0]
    versions = settings["tools"]
    missing = [package for package, version in versions.items() if version is None]
    if missing:
        return (
            f"{device}: not measured, because {' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} "
            f"not installed. Run `{install_extra('fpga')}`. The next report then has the table."
        ), None
    rows: list[tuple[Cell, ...]] = [
        (settings["method"], *(result.get(key) for key in _FIGURES.values()), result.get("reason", ""))
        for settings, result in results
    ]
    tools = " and ".join(f"{package} {version}" for package, version in versions.items())
    note = (
        "Look-up tables have four inputs. Look-up tables that serve as carries, memories or wires count, "
        f"too. Multipliers have 18x18 bits. {FAMILIES[family].registers} Each port has a register, which is "
        "not counted."
    )
    columns = ("method", *_FIGURES, "reason without figures")
    return (
        f"{device}: {settings['seeds']} seeds, by {tools}.",
        Table(f"place-and-route-{family}", f"Parts and clock rate, {device}", columns, rows, note),
    )
