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
        "Every unit by itself: what it errs by, how long it takes and what it is made of. Errors are the "
        "largest found: of the *model*, the formula of the unit in float64 against the exact function; of "
        "the *arithmetic*, the unit against that formula; and in *total*, against the exact function. They "
        "come from the bit-accurate models, which tests hold equal to the RTL to the bit; times from the "
        "units or a simulation of them, parts from their netlists. `blysk blocks` prints the same table.",
    ]
    if len(results) < len(ENTRIES):
        text.append(f"A quick report has {len(results)} of the {len(ENTRIES)} lines.")
    note = (
        "An error of 1 is a full term or the length of a unit vector, unless the unit says otherwise: *LSB* "
        "a step of an 8-bit channel, *rad* and *turn* angles, *rate* shares of a gate's decisions (let "
        "through for nothing, stopped by mistake, both). Latency: cycles from an input to its first result; "
        "interval: cycles from a result to the next. *As published*: with the constants or the structure of "
        "the document, which the others mend."
    )
    return Section(
        "units",
        "Units, one by one",
        text,
        [Table("units", "Errors, times and parts of every unit", _COLUMNS, lines, note)],
    )
