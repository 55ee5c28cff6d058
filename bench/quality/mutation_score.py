"""Scores of units: mutants made and run, survivors proved equivalent or waived, and their table."""

import re
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from blysk.bench.quality.equivalence import Miter
from blysk.bench.quality.mutation import Mutants, killed, mutate, vectors_of
from blysk.bench.store import Task, results_of
from blysk.bench.tools.tool_runner import ToolError
from blysk.bench.units.registry import RECORDS
from blysk.sim.engines.engine import SimulationError

__all__ = ["Score", "measure", "scores", "table", "waived"]


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
        """Number of mutants that the stimuli kill."""
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
    """Make mutants of a unit, run its record's stimuli on them, and try to prove the survivors equivalent.

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
    count: int,
    seed: int,
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
