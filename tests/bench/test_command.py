"""The end of a command: one line and a status for each kind of error."""

import click
import pytest

from blysk.bench.command import run
from blysk.sim.engines.engine import CompilerMissing, SimulationError
from blysk.sim.errors import InputError


@pytest.mark.parametrize(
    ("error", "status", "text"),
    [
        (None, 3, ""),
        (InputError("a.obj", "is empty", "give another"), 2, "bench.x: a.obj: is empty; give another\n"),
        (CompilerMissing("no compiler"), 2, "bench.x: no compiler\n"),
        (SimulationError("does not end"), 1, "bench.x: does not end\n"),
        (click.UsageError("No such option."), 2, "bench.x: No such option; see --help\n"),
    ],
)
def test_errors_are_one_line_and_a_status(error, status, text, capsys):
    @click.command()
    def command():
        if error:
            raise error
        return 3

    assert run(command, "bench.x", []) == status
    assert capsys.readouterr() == ("", text)
