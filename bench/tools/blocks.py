"""The table of the units: errors, latency, interval and cost of each variant.

``blysk blocks`` prints the table, from the records of `blysk.bench.units`. Errors come from the bit-accurate
models and float64 mathematics. Latency and interval come from the units or from a simulation. Parts come from
the netlists.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from amaranth.lib.wiring import Component

from blysk.bench.tools.defaults import SAMPLES, SEED
from blysk.bench.units.record import Record, Variant
from blysk.bench.units.registry import RECORDS
from blysk.bench.units.sample import Sample
from blysk.hdl.emit.cost import Cost, cost_of
from blysk.sim.engines.beats import dtype_of
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.workers import local_executor

__all__ = [
    "ENTRIES",
    "Entry",
    "Row",
    "cells_of",
    "entries_of",
    "entries_shown",
    "entry_of",
    "row_of",
    "rows",
    "sample_of",
    "table",
]

_CHUNK = 1 << 17
"""Number of samples that are measured at a time. This number bounds the memory."""


@dataclass(frozen=True)
class Entry:
    """A line of the table: a variant of a unit.

    Parameters
    ----------
    record : Record
        Record of the unit.
    name : str
        Name of the variant.
    """

    record: Record
    name: str

    @property
    def variant(self) -> Variant:
        """The variant in the unit's record."""
        return self.record.variants[self.name]

    @property
    def title(self) -> str:
        """Name of unit and variant, as in the baselines and in ``blysk fpga``."""
        return f"{self.record.name} {self.name}".rstrip()


def entries_of(record: Record) -> tuple[Entry, ...]:
    """Entries of a unit's variants whose errors are measured."""
    return tuple(Entry(record, name) for name, variant in record.variants.items() if variant.measure)


def entries_shown(unit: str) -> tuple[Entry, ...]:
    """Entries of a unit: the measured variants, or the default variant if none is measured."""
    record = RECORDS[unit]
    return entries_of(record) or (Entry(record, record.default),)


def entry_of(unit: str, variant: str) -> Entry:
    """The entry of a unit and a variant.

    Raises
    ------
    KeyError
        If there is no such entry.
    """
    entry = Entry(RECORDS[unit], variant)
    _ = entry.variant
    return entry


ENTRIES: tuple[Entry, ...] = tuple(entry for record in RECORDS.values() for entry in entries_of(record))
"""Every measured variant of every unit, in the order of the table."""


@dataclass(frozen=True)
class Row:
    """Figures of a line of the table.

    Parameters
    ----------
    entry : Entry
        The variant.
    samples : int
        Number of compared results. Each component of a vector counts.
    errors : tuple of float or None
        Model, arithmetic and total error.
    latency : int
        Cycles from an input to its first result.
    interval : int
        Initiation interval: cycles from a result to the next.
    cost : Cost
        Parts of the netlist.
    """

    entry: Entry
    samples: int
    errors: tuple[float | None, float | None, float | None]
    latency: int
    interval: int
    cost: Cost

    def as_dict(self) -> dict[str, Any]:
        """The line under stable names."""
        entry, cost = self.entry, self.cost
        variant = entry.variant
        model, arithmetic, total = self.errors
        return {
            "unit": entry.record.name,
            "variant": entry.name,
            "source": entry.record.source_of(entry.name),
            "as_published": variant.as_published,
            "domain": variant.domain,
            "exhaustive": variant.exhaustive,
            "samples": self.samples,
            "error_unit": variant.scale or "1",
            "model_error": model,
            "arithmetic_error": arithmetic,
            "total_error": total,
            "latency": self.latency,
            "initiation_interval": self.interval,
            "multipliers": {f"{a}x{b}": count for (a, b), count in sorted(cost.multipliers.items())},
            "constant_multipliers": cost.constant_multipliers,
            "rom_bits": cost.rom_bits,
            "ram_bits": cost.ram_bits,
            "register_bits": cost.register_bits,
            "note": variant.note,
        }


def _times(entry: Entry, unit: Component) -> tuple[int, int]:
    """Latency, and cycles from a result to the next.

    If the unit does not state them, a simulation finds them.
    """
    variant, latency = entry.variant, getattr(unit, "latency", None)
    interval = getattr(unit, "initiation_interval", getattr(unit, "cycles_per_pixel", None))
    if isinstance(latency, int) and isinstance(interval, int):
        return latency, interval
    if variant.beat:
        beats = np.zeros(3, dtype_of(unit.i.payload.shape()))
        for name, value in variant.beat.items():
            beats[name] = value
        run = simulate(unit, beats, count=3 * variant.beat.get("length", 1), engine="pysim")
    else:
        given = entry.record.example(entry.name, unit)
        case = given.case
        run = simulate(unit, case.beats, count=given.count, engine="pysim", **case.sent)
    return int(run.cycles[0] - run.input_cycles[0]), int(np.median(np.diff(run.cycles)))


def rows(
    entries: Sequence[Entry] = ENTRIES, samples: int = SAMPLES, seed: int = SEED, jobs: int = 1
) -> Iterator[Row]:
    """Lines of the table, one after the other.

    Parameters
    ----------
    entries : sequence of Entry
        Variants.
    samples : int
        Approximate number of random operands, 40 or more.
    seed : int
        Seed of the operands. Every entry starts from this seed, so a line does not depend on other lines.
    jobs : int
        Number of processes. This number does not change the lines or their order.
    """
    if jobs == 1 or len(entries) < 2:
        for entry in entries:
            yield _row(entry, samples, seed)
        return
    with local_executor(min(jobs, len(entries))) as pool:
        # A process gets the names, because some records cannot be sent to it.
        waiting = [pool.submit(_found, e.record.name, e.name, samples, seed) for e in entries]
        for entry, found in zip(entries, waiting, strict=True):
            yield Row(entry, *found.result())


def _found(unit: str, variant: str, samples: int, seed: int) -> tuple:
    """Figures of a row, in a process."""
    row = _row(entry_of(unit, variant), samples, seed)
    return row.samples, row.errors, row.latency, row.interval, row.cost


def _row(entry: Entry, samples: int, seed: int) -> Row:
    """Row of an entry, measured in parts. Of each part only the extreme errors are kept."""
    count, worst = 0, []
    for sample in _chunks(entry, samples, seed):
        count += np.size(sample.found)
        worst.append(sample.extremes)
    return replace(row_of(entry, Sample.joined(worst)), samples=count)


def _chunks(entry: Entry, samples: int, seed: int) -> Iterator[Sample]:
    rng, variant = np.random.default_rng(seed), entry.variant
    parts = 1 if variant.exhaustive else -(-samples // _CHUNK)
    for part in range(parts):
        yield variant.measure(rng, samples * (part + 1) // parts - samples * part // parts)


def sample_of(entry: Entry, samples: int = SAMPLES, seed: int = SEED) -> Sample:
    """Measure an entry."""
    chunks = list(_chunks(entry, samples, seed))
    return chunks[0] if len(chunks) == 1 else Sample.joined(chunks)


def row_of(entry: Entry, sample: Sample | None) -> Row:
    """Row of an entry and its measured errors. Without a sample the row has no errors."""
    count, errors = (0, (None, None, None)) if sample is None else (np.size(sample.found), sample.errors)
    unit = entry.variant.unit()
    return Row(entry, count, errors, *_times(entry, unit), cost_of(unit))


_HEAD = (
    "unit",
    "variant",
    "",
    "model",
    "arithm",
    "total",
    "lat",
    "int",
    "ROM",
    "regs",
    "multipliers",
)


def _figure(error: float | None) -> str:
    if error is None:
        return "-"
    if 10 <= error < 1000:
        return f"{error:.0f}"
    if error == 0 or 0.1 <= error < 10:
        return f"{error:.2g}"
    return f"{error:.1e}".replace("e-0", "e-")


def cells_of(row: Row) -> tuple[str, ...]:
    """A line's cells in the printed table."""
    cost = row.cost
    errors = map(_figure, row.errors)
    widths = sorted(cost.multipliers.items(), reverse=True)
    multipliers = [f"{count}*{a}" if a == b else f"{count}*{a}x{b}" for (a, b), count in widths]
    if cost.constant_multipliers:
        multipliers.append(f"{cost.constant_multipliers}*c")
    return (
        row.entry.record.name,
        row.entry.name,
        row.entry.variant.scale,
        *errors,
        *map(str, (row.latency, row.interval, cost.rom_bits, cost.register_bits)),
        " ".join(multipliers) or "-",
    )


def table(lines: Sequence[Row]) -> str:
    """The table as aligned text."""
    cells = [_HEAD, *map(cells_of, lines)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    left = {0, 1, 2, len(_HEAD) - 1}
    return "\n".join(
        " ".join(
            text.ljust(width) if k in left else text.rjust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in cells
    )
