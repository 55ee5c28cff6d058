"""Mutation score of every unit: the share of small faults in its hardware that the record's vectors find.

``python -m blysk.bench.quality.mutants [UNIT ...]`` takes faults of a unit at random (Yosys' pass
``mutate``). A fault sets a bit of a cell to 0 or 1, or inverts it. Some faults invert the bit only while
another bit of the same word has a certain value. Each fault gets the runs of the unit's record.
`tests/test_units.py` compares the same runs with the bit-accurate model.

A mutant is killed if an output beat, the cycle of the beat or another output differs from that of the unit.
In a run without stalls the cycles of the inputs count, too. Some runs are repeated with counters of events
that begin at high numbers. The *score* is the share of killed mutants. These mutants do not count in it:

- equivalent mutants: Yosys and ABC (package pyosys) prove that no stimulus distinguishes them from the unit;
- survivors at signals that the record waives. The record gives the reason, or the test that finds them.

Clocks are not mutated, and reset stays low. Other tests and proofs check them. The faults are in the unit's
own cells. Parts that have a record are mutated for their own record.

All mutants of a unit are in one compiled model, with an input that selects the mutant. Survivors that count
are listed. Each of them lacks a stimulus, a proof or a waiver. Each change of a unit makes Yosys choose other
faults, so survivors alone do not change the exit status. The exit status is 1 if a unit's score is less than
`LEAST`, and 2 for bad input.
"""

import re
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import click

from blysk.bench.command import progress, run
from blysk.bench.quality.equivalence import Miter
from blysk.bench.quality.mutation import Mutants, killed, mutate, vectors_of
from blysk.bench.store import Task, results_of
from blysk.bench.tools.tool_runner import ToolError
from blysk.bench.units.registry import RECORDS
from blysk.sim.engines.cache import version_of
from blysk.sim.engines.engine import SimulationError
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import local_executor, processors
from blysk.sim.installation import install_extra
from blysk.sim.output import check_writable, write_json
from blysk.sim.value_types import Whole

__all__ = ["LEAST", "Score", "main", "measure", "scores", "table", "waived"]

COUNT = 200
SEED = 7

LEAST = 0.95
"""Target: the least score of a unit."""


def waived(unit: str, mutant: str) -> bool:
    """Whether the record waives faults at the first register or output that a mutant's fault reaches.

    A waiver is a pattern for the signal's path or for the last parts of the path. It holds for copies of the
    signal in later stages, too. A copy has the name of the signal and a number.

    Parameters
    ----------
    unit : str
        A key of `RECORDS`.
    mutant : str
        Name of the mutant by `mutation.mutate`: ``fault -> unit.path``.
    """
    signal = mutant.rpartition(" -> ")[2].removeprefix("unit.")
    names = (signal, re.sub(r"_\d+$", "", signal))
    return any(
        fnmatch(name, pattern) or fnmatch(name, f"*.{pattern}")
        for pattern in RECORDS[unit].waivers
        for name in names
    )


@dataclass(frozen=True)
class Score:
    """Result of the mutants of a unit.

    Parameters
    ----------
    unit : str
        Name of the unit.
    mutants : int
        Number of mutants.
    equivalent : tuple of str
        Mutants that are proved equivalent to the unit.
    survived : tuple of str
        Mutants that are neither killed nor proved equivalent.
    """

    unit: str
    mutants: int
    equivalent: tuple[str, ...]
    survived: tuple[str, ...]

    @property
    def killed(self) -> int:
        """Number of mutants that the vectors kill."""
        return self.mutants - len(self.equivalent) - len(self.survived)

    @property
    def open(self) -> tuple[str, ...]:
        """Survivors that the record does not waive."""
        return tuple(mutant for mutant in self.survived if not waived(self.unit, mutant))

    @property
    def waived(self) -> int:
        """Number of survivors that the record waives."""
        return len(self.survived) - len(self.open)

    @property
    def score(self) -> float:
        """Share of killed mutants among the mutants that are neither equivalent nor waived.

        The score is 1 if there are no such mutants.
        """
        return self.killed / (self.killed + len(self.open)) if self.open else 1.0


def measure(unit: str, count: int, seed: int) -> dict[str, Any]:
    """Make mutants of a unit, run its record's vectors on them, and try to prove the survivors equivalent.

    Parameters
    ----------
    unit : str
        A key of `RECORDS`.
    count, seed : int
        Number of mutants, and seed for the choice of mutants.

    Returns
    -------
    dict
        The fields of a `Score`.

    Raises
    ------
    ToolError
        If a tool fails, or mutant 0 does not behave as the unit. The message has the unit's name.
    """
    try:
        return _measured(unit, count, seed)
    except SimulationError as error:
        raise ToolError(f"{unit}: {error}") from error


def _measured(unit: str, count: int, seed: int) -> dict[str, Any]:
    record = RECORDS[unit]
    vectors = vectors_of(record)
    with tempfile.TemporaryDirectory(prefix="blysk-") as name:
        folder = Path(name)
        component = record.variants[record.default].unit()
        mutants = mutate(component, count, seed, folder)
        model = Mutants(component, folder)
        alive = sorted(set(mutants) - killed(model, vectors, mutants))
        miter = Miter(folder) if alive else None
        verdicts = {k: miter.is_equivalent(k, mutants[k].rpartition(" ")[2]) for k in alive}
    return {
        "unit": unit,
        "mutants": len(mutants),
        "equivalent": [mutants[k] for k, same in verdicts.items() if same],
        "survived": [mutants[k] for k, same in verdicts.items() if not same],
    }


def scores(
    units: Sequence[str],
    count: int = COUNT,
    seed: int = SEED,
    executor: Executor | None = None,
    progress: Callable[[], object] = lambda: None,
) -> list[Score]:
    """Scores of units, in their order. Scores in the cache are not measured again.

    Parameters
    ----------
    units : sequence of str
        Keys of `RECORDS`.
    count, seed : int
        As in `measure`.
    executor, progress
        As in `results_of`.
    """
    tasks = [Task(measure, {"unit": unit, "count": count, "seed": seed}) for unit in units]
    return [
        Score(r["unit"], r["mutants"], tuple(r["equivalent"]), tuple(r["survived"]))
        for r in results_of(tasks, executor, progress)
    ]


def table(rows: Sequence[Score]) -> str:
    """Table in Markdown."""
    lines = [
        "| unit | mutants | equivalent | killed | waived | survived | score |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {row.unit} | {row.mutants} | {len(row.equivalent)} | {row.killed} | {row.waived} "
        f"| {len(row.open)} | {row.score:.1%} |"
        for row in rows
    ]
    return "\n".join(lines)


@click.command()
@click.argument("units", nargs=-1, metavar="[UNIT ...]")
@click.option(
    "--count",
    type=click.IntRange(1, 10_000),
    default=COUNT,
    show_default=True,
    help="Number of mutants for each unit.",
)
@click.option("--seed", default=SEED, show_default=True, help="Seed for the choice of mutants.")
@click.option("--jobs", type=Whole(1, 64), default=processors, help="Processes.  [default: number of cores]")
@click.option("--json", "figures", type=click.Path(), help="JSON file with every figure.")
def _command(units, count, seed, jobs, figures) -> int:
    """Inject small faults into every unit or the named units, and print how many its vectors find."""
    unknown = [unit for unit in units if unit not in RECORDS]
    if unknown:
        raise InputError(unknown[0], "is not a unit", f"choose from {', '.join(RECORDS)}")
    if version_of("pyosys") is None:
        raise InputError("mutants", "pyosys is not installed", install_extra("test"))
    if figures:
        check_writable(figures)
    names = units or tuple(RECORDS)
    with (
        local_executor(jobs) as executor,
        progress(total=len(names), unit="units") as bar,
    ):
        rows = scores(names, count, seed, executor, bar.update)
    if figures:
        write_json(
            figures,
            [asdict(row) | {"killed": row.killed, "waived": row.waived, "score": row.score} for row in rows],
        )
    click.echo(table(rows))
    for row in rows:
        for mutant in row.open:
            click.echo(f"survived without a waiver: {row.unit}: {mutant}", err=True)
    return 1 if any(row.score < LEAST for row in rows) else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, and compare with the target.

    Returns
    -------
    int
        Exit status: 0, or 1 if a score is less than `LEAST` or a tool fails, 2 for bad input (printed in one
        line).
    """
    return run(_command, "blysk.bench.quality.mutants", arguments)


if __name__ == "__main__":
    sys.exit(main())
