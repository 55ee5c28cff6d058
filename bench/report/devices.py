"""The report's section on single devices: the table of ``blysk blocks``, a measurement for each line."""

from collections.abc import Sequence
from typing import Any

from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task
from blysk.bench.tools.blocks import BLOCKS, SAMPLES, Block, rows

__all__ = ["QUICK_SAMPLES", "measure", "section", "tasks"]

QUICK_SAMPLES = 10_000

_QUICK = (
    *("dot_product", "middle_normal", "gpq", "difference_accumulator", "quadratic_evaluator"),
    *("diffuse", "specular", "power", "chord", "intensity"),
)
"""Devices of a quick report: those that take least time."""

_PUBLISHED = ("as published", "as_published")
"""What the names of the variants with the documents' own constants have in them."""

_COLUMNS = (
    *("device", "variant", "source", "as printed", "unit of the errors", "model error", "arithmetic error"),
    *("total error", "latency, cycles", "interval, cycles", "multipliers", "multipliers by a constant"),
    *("ROM, bits", "RAM, bits", "registers, bits", "samples", "operands", "note"),
)


def measure(device: str, variant: str, samples: int) -> dict[str, Any]:
    """A line of the device table, see `Row.as_dict`.

    Parameters
    ----------
    device, variant : str
        Names of the entry.
    samples : int
        About how many random operands.
    """
    (block,) = (block for block in BLOCKS if (block.device, block.variant) == (device, variant))
    (row,) = rows([block], samples)
    return row.as_dict()


def tasks(quick: bool) -> list[Task]:
    """A task a device and variant.

    Parameters
    ----------
    quick : bool
        The devices that are measured soonest, each with `QUICK_SAMPLES` samples.
    """
    samples = QUICK_SAMPLES if quick else SAMPLES
    return [
        Task(measure, {"device": block.device, "variant": block.variant, "samples": samples})
        for block in BLOCKS
        if not quick or (block.device in _QUICK and not _is_slow(block))
    ]


def _is_slow(block: Block) -> bool:
    return "interval" in block.variant or "sequential" in block.variant


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The device table, with a column that tells the documents' printed variants from the others.

    Parameters
    ----------
    tasks : sequence of Task
        See `tasks`.
    results : sequence of dict
        Of `measure`, in their order.
    """
    lines = [
        (
            *(line["device"], line["variant"], line["source"]),
            any(word in line["variant"] for word in _PUBLISHED),
            *(line["error_unit"], line["model_error"], line["arithmetic_error"], line["total_error"]),
            *(line["latency"], line["initiation_interval"]),
            ", ".join(f"{count} of {widths}" for widths, count in line["multipliers"].items()),
            *(line["constant_multipliers"], line["rom_bits"], line["ram_bits"], line["register_bits"]),
            *(line["samples"], line["domain"], line["note"]),
        )
        for line in results
    ]
    text = [
        "Every device by itself: what it errs by, how long it takes and what it is made of. Errors are the "
        "largest found: of the *model*, the device's formula in float64 against the exact function; of the "
        "*arithmetic*, the device against that formula; and in *total*, against the exact function. They "
        "come from the bit-true twins, which tests hold equal to the RTL to the bit; times from the units or "
        "a simulation of them, parts from their netlists. `blysk blocks` prints the same table.",
    ]
    if len(results) < len(BLOCKS):
        text.append(f"A quick report has {len(results)} of the {len(BLOCKS)} lines.")
    note = (
        "An error of 1 is a full term or the length of a unit vector, unless the unit says otherwise: *LSB* "
        "a step of an 8-bit channel, *rad* and *turn* angles, *rate* shares of a gate's decisions (let "
        "through for nothing, stopped by mistake, both). Latency: cycles from an input to its first result; "
        "interval: cycles from a result to the next. *As printed*: with the constants or the structure that "
        "the document prints, which the others mend."
    )
    return Section(
        "devices",
        "Devices, one by one",
        text,
        [Table("devices", "Errors, times and parts of every device", _COLUMNS, lines, note)],
    )
