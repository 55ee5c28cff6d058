"""Mutation score of every unit: the share of small faults in its hardware that the record's stimuli find.

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

import sys
from collections.abc import Sequence
from dataclasses import asdict

import click

from blysk.bench.command import run
from blysk.bench.units.names import UNITS
from blysk.sim.cli.progress import progress
from blysk.sim.engines.cache import version_of
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import local_executor, processors
from blysk.sim.installation import install_extra
from blysk.sim.output import check_writable, write_json
from blysk.sim.value_types import Whole

__all__ = ["LEAST", "main"]

COUNT = 200
SEED = 7

LEAST = 0.95
"""Target: the least score of a unit."""


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
    """Inject small faults into every unit or the named units, and print how many faults the stimuli find."""
    unknown = [unit for unit in units if unit not in UNITS]
    if unknown:
        raise InputError(unknown[0], "is not a unit", f"choose from {', '.join(UNITS)}")
    if version_of("pyosys") is None:
        raise InputError("mutants", "pyosys is not installed", install_extra("test"))
    if figures:
        check_writable(figures)
    from blysk.bench.quality.mutation_score import scores, table

    names = units or tuple(UNITS)
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
