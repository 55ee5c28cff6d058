"""Runs of nextpnr: when a run is given up, and which options a next run leaves out."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from blysk.bench.tools.tool_runner import GivenUp, ToolRunner, Watch

__all__ = ["CROWDED", "SLOW", "is_crowded", "is_slow", "run_nextpnr"]

_SLACK = re.compile(r"ripped up due to negative slack WNS=(-?[\d.]+)ns")
_ROUNDS = 10
"""Rounds of the router for paths that are too slow.

Within these rounds the slowest path must become faster.
"""

_OVERLAP = re.compile(r"^Info: overlap: COMB=([\d.]+)%, FF=([\d.]+)%", re.MULTILINE)
_SPREAD, _ROUNDS_SPREAD = 5, 200
"""Percentage of overlapping logic cells, and rounds of the static placer.

If fewer logic cells overlap in all of the last rounds, then the placer does not end.
"""

SLOW = f"no faster in {_ROUNDS} rounds"
CROWDED = f"block RAMs or multipliers overlap after {_ROUNDS_SPREAD} rounds"
_LEFT_OUT = {SLOW: ("--tmg-ripup",), CROWDED: ("--placer", "static")}
"""Options that are left out when nextpnr is run again, by the reason for which it was given up."""


def is_slow(said: str) -> bool:
    """Whether the router does not end, from nextpnr's log.

    nextpnr routes wires of slow paths again as long as there are slow paths. If the target cannot be met,
    nextpnr does not end. For example, the bisection's slowest path stayed the same to 10 ps in 27 rounds.
    """
    slack = [float(worst) for worst in _SLACK.findall(said)]
    return len(slack) > _ROUNDS and max(slack[-_ROUNDS:]) <= max(slack[:-_ROUNDS])


def is_crowded(said: str) -> bool:
    """Whether the static placer does not end, from nextpnr's log.

    The static placer goes on until no kind of cell overlaps. With 20 block RAMs, 4 of them overlapped in 300
    rounds after all else had found its place. Placements that ended did so with 10 % of overlapping logic.
    """
    overlaps = [max(map(float, found)) for found in _OVERLAP.findall(said)]
    return len(overlaps) > _ROUNDS_SPREAD and max(overlaps[-_ROUNDS_SPREAD:]) < _SPREAD


def run_nextpnr(
    runner: ToolRunner,
    code: str,
    arguments: Sequence[str],
    folder: Path,
    step: str,
    tell: Callable[[str], object],
    stuck: Callable[[str], str],
) -> tuple[str, ...]:
    """Run nextpnr. If it is given up for `SLOW` or `CROWDED`, run it again with fewer options.

    Parameters
    ----------
    runner, code, arguments, folder
        As for `ToolRunner.run`.
    step, tell, stuck
        As for `Watch`.

    Returns
    -------
    tuple of str
        Reasons for which earlier runs were given up.

    Raises
    ------
    GivenUp
        If it is given up for another reason.
    """
    given_up: tuple[str, ...] = ()
    while True:
        watch = Watch("; ".join([step, *given_up]), tell, stuck)
        try:
            runner.run("nextpnr", code, arguments, folder, watch=watch)
            return given_up
        except GivenUp as error:
            reason = str(error)
            if reason not in _LEFT_OUT:
                raise
            given_up = (*given_up, reason)
            arguments = [option for option in arguments if option not in _LEFT_OUT[reason]]
