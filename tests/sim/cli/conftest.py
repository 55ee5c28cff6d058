"""A folder for each test of the command line, and checks of bad input."""

import re

import pytest

from blysk.sim.cli import progress
from blysk.sim.cli.main import main

from .commandline import files


@pytest.fixture(autouse=True)
def no_late_lines(monkeypatch):
    """No line of progress, however busy the machine is."""
    monkeypatch.setattr(progress, "SECONDS", 3600)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Each test runs in its own folder, with the compilers of the machine."""
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def refused(capsys):
    """Run with bad input: one line has thing, reason and remedy, the status is 2, and no file is changed."""

    def refused(*arguments, thing, says=""):
        before = files()
        assert main([str(argument) for argument in arguments]) == 2
        output, line = capsys.readouterr()
        assert output == ""
        assert re.fullmatch(r"blysk: [^\n]+: [^\n]+; [^\n]+\n", line), line
        assert line.startswith(f"blysk: {thing}: ")
        assert says in line
        assert files() == before
        return line

    return refused
