"""The report's section on single units: the table of ``blysk blocks``, with a measurement for each line."""

from collections.abc import Sequence
from typing import Any

from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task
from blysk.bench.tools.blocks import ENTRIES, Entry, entry_of, rows
from blysk.bench.tools.defaults import SAMPLES

__all__ = ["QUICK_SAMPLES", "measure", "section", "tasks"]

QUICK_SAMPLES = 10_000

_QUICK = (
    *("dot_product", "middle_normal", "gpq", "difference_accumulator", "quadratic_evaluator"),
    *("diffuse", "specular", "power", "quotient", "chord", "intensity"),
)
"""Units of a quick report. They take the least time."""

_COLUMNS = (
    *("unit", "variant", "source", "as published", "unit of the errors", "model error", "arithmetic error"),
    *("total error", "latency, cycles", "interval, cycles", "multipliers", "multipliers by a constant"),
    *("ROM, bits", "RAM, bits", "registers, bits", "samples", "operands", "note"),
)


def measure(unit: str, variant: str, samples: int) -> dict[str, Any]:
    """A line of the table of the units, see `Row.as_dict`.

    Parameters
    ----------
    unit, variant : str
        Names.
    samples : int
        Approximate number of random operands.
    """
    (row,) = rows([entry_of(unit, variant)], samples)
    return row.as_dict()


def tasks(quick: bool) -> list[Task]:
    """A task for each variant of a unit.

    Parameters
    ----------
    quick : bool
        Whether only the quickest units are measured, each with `QUICK_SAMPLES` samples.
    """
    samples = QUICK_SAMPLES if quick else SAMPLES
    return [
        Task(measure, {"unit": entry.record.name, "variant": entry.name, "samples": samples})
        for entry in ENTRIES
        if not quick or (entry.record.name in _QUICK and not _is_slow(entry))
    ]


def _is_slow(entry: Entry) -> bool:
    return "interval" in entry.name or "sequential" in entry.name


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: the table of the units, with a column that marks variants as published.

    Parameters
    ----------
    tasks : sequence of Task
        See `tasks`.
    results : sequence of dict
        Results of `measure`, in their order.
    """
    lines = [
        (
            *(line["unit"], line["variant"], line["source"]),
            line["as_published"],
            *(line["error_unit"], line["model_error"], line["arithmetic_error"], line["total_error"]),
            *(line["latency"], line["initiation_interval"]),
            ", ".join(f"{count} of {widths}" for widths, count in line["multipliers"].items()),
            *(line["constant_multipliers"], line["rom_bits"], line["ram_bits"], line["register_bits"]),
            *(line["samples"], line["domain"], line["note"]),
        )
        for line in results
    ]
    text = [
        "The table has the errors, cycles and parts of every unit alone. Each error is the largest error "
        "found:\n\n"
        "- the *model* error, of the unit's formula in float64 against the exact function;\n"
        "- the *arithmetic* error, of the unit against its formula in float64;\n"
        "- the *total* error, of the unit against the exact function.\n\n"
        "Errors come from the bit-accurate models. Tests check that the models equal the RTL to the bit. "
        "Cycles come from the units or their simulation, parts from their netlists. `blysk blocks` prints "
        "the same table.",
    ]
    if len(results) < len(ENTRIES):
        text.append(f"A quick report has {len(results)} of the {len(ENTRIES)} lines.")
    note = (
        "An error of 1 is a full term or the length of a unit vector, if the column *unit of the errors* "
        "names no other unit. *LSB* is a step of an 8-bit channel, *rad* and *turn* are angles. *Rate* is a "
        "share of a gate's decisions: spans let through in vain, spans stopped by mistake, and both. "
        "Latency is the number of cycles from an input to its first result. Interval is the number of "
        "cycles from a result to the next. A variant *as published* has the constants or the structure of "
        "the document. The other variants correct these."
    )
    return Section(
        "units",
        "Units, one by one",
        text,
        [Table("units", "Errors, cycles and parts of every unit", _COLUMNS, lines, note)],
    )
