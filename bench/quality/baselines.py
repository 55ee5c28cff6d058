"""Baselines: recorded resources of each unit and pipeline, and cycles of a fixed set of frames.

The figures are in ``bench/quality/baselines.json``. A test fails if a figure changes by more than 2 %, up or
down. ``python -m blysk.bench.quality.baselines`` measures all figures and prints the changes. The exit status
is 1 if a figure changed by more than 2 %, or if an entry is missing or no longer measured. ``--update``
writes the file. If words are given, the command measures only entries whose names have one of the words. The
other entries stay unchanged. After a unit was added, use
``python -m blysk.bench.quality.baselines --update halfway_vector``.

Cycles do not depend on the engine. Amaranth's own simulator would need too long for compact pipelines.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import click

from blysk.bench.command import run
from blysk.bench.store import Task, results_of
from blysk.sim.cli.progress import progress
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import local_executor, processors
from blysk.sim.output import check_writable, write_json
from blysk.sim.value_types import Whole

__all__ = ["FILE", "TOLERANCE", "UPDATE", "Figures", "differences", "main", "read"]

Figures = Mapping[str, Mapping[str, int]]
"""Figures by the entry's name, then by the figure's name."""

TOLERANCE = 0.02
"""A figure may change by this share of its baseline."""

FILE = Path(str(files(__package__))) / "baselines.json"
"""File of the baselines."""

UPDATE = "python -m blysk.bench.quality.baselines --update"
"""Command that writes the baselines."""


def read(path: Path = FILE) -> dict[str, dict[str, int]]:
    """The baselines.

    Raises
    ------
    InputError
        If the file is missing or damaged.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(str(path), f"cannot be read, {error}", f"make it by {UPDATE}") from None


def differences(old: Figures, new: Figures, tolerance: float = 0.0) -> list[str]:
    """Changes by more than a tolerance. Each line has entry, figure, old, new, and change in percent.

    If only one side has an entry or figure, this is a difference at any tolerance. A change from 0 is a
    difference, too.

    Parameters
    ----------
    old, new : figures of entries
        Baselines and measured figures.
    tolerance : float
        Share of the old figure.
    """
    lines = [f"{entry} has no baseline" for entry in new if entry not in old]
    lines += [f"{entry} is not measured any more" for entry in old if entry not in new]
    for entry in (entry for entry in old if entry in new):
        for figure in dict.fromkeys([*old[entry], *new[entry]]):
            was, now = old[entry].get(figure), new[entry].get(figure)
            if was is None or now is None:
                lines.append(
                    f"{entry}: {figure} " + ("has no baseline" if was is None else "is not measured")
                )
            elif abs(now - was) > tolerance * was:
                share = f", {now / was - 1:+.2%}" if was else ""
                lines.append(f"{entry}: {figure} was {was:,}, is {now:,}{share}")
    return lines


@click.command()
@click.argument("words", nargs=-1, metavar="[WORD ...]")
@click.option("--update", is_flag=True, help="Write the baselines in place of comparing with them.")
@click.option("--jobs", type=Whole(1, 64), default=processors, help="Processes.  [default: number of cores]")
def _command(words: Sequence[str], update: bool, jobs: int) -> int:
    """Measure every figure, and print the changes since the baselines were written.

    With WORDs, the command takes only entries that have one of the words in their names.
    """
    from blysk.bench.quality.resources import ENTRIES, measure

    chosen = [name for name in ENTRIES if not words or any(word in name for word in words)]
    if not chosen:
        raise InputError(
            " ".join(words), "no entry has this word in its name", "name a unit, method or model"
        )
    if update:
        check_writable(FILE)
    old = {} if update and not FILE.exists() else read(FILE)
    kept = {name: old[name] for name in old if words and name not in chosen}
    old = {name: old[name] for name in old if name not in kept}
    tasks = [Task(measure, {"name": name}) for name in chosen]
    try:
        with (
            progress(total=len(tasks), unit="entries") as bar,
            local_executor(jobs) as executor,
        ):
            new = dict(zip(chosen, results_of(tasks, executor, bar.update), strict=True))
    except KeyboardInterrupt:
        print("blysk.bench.quality.baselines: interrupted; run it again to continue", file=sys.stderr)
        return 130
    moved, far = differences(old, new), differences(old, new, TOLERANCE)
    for line in moved:
        print(line + f" (over {TOLERANCE:.0%})" * (line in far))
    print(f"{len(new)} entries, {len(moved)} differences, {len(far)} of more than {TOLERANCE:.0%}")
    if update:
        whole = new | kept
        write_json(FILE, {name: whole[name] for name in dict.fromkeys([*ENTRIES, *whole]) if name in whole})
        print(f"written: {FILE}")
    elif far:
        print(f"if this change is intended: {UPDATE}")
    return 0 if update or not far else 1


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the changes, or write the baselines.

    Returns
    -------
    int
        Exit status: 0, or 1 if a figure changed by more than `TOLERANCE`, 2 for bad input (printed in one
        line), 130 if interrupted.
    """
    return run(_command, "blysk.bench.quality.baselines", arguments)


if __name__ == "__main__":
    sys.exit(main())
