"""The end of a command: one line and a status for each kind of error."""

import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

import blysk.bench
from blysk.bench.command import run
from blysk.sim.cli.main import main
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


@pytest.mark.parametrize("name", ["bench", "blocks", "explore", "fpga", "pages", "web"])
def test_help_has_an_example(name, capsys):
    assert main([name, "--help"]) == 0
    assert re.search(rf"Examples?:\n +blysk {name} ", capsys.readouterr().out)
    assert main(["--help"]) == 0
    assert re.search(rf"\n  {name} +\S", capsys.readouterr().out)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["blocks", "--samples", "many"], "--samples many: not a whole number; give a whole number from"),
        (["blocks", "--samples", "999"], "--samples 999: out of range; give a whole number from 1000 to"),
        (["blocks", "--jobs", "0"], "--jobs 0: out of range; give a whole number from 1 to"),
        (["blocks", "--seed", "-1"], "--seed -1: out of range; give a whole number from 0 to"),
        (["blocks", "--json", "nowhere/x"], "nowhere/x: cannot be written, there is no folder nowhere; make"),
        (["pages", "file"], "file: cannot be made (File exists); give another folder"),
        (["pages", "file/new"], "file/new: cannot be made (Not a directory); give another folder"),
        (["pages", ".", "--unit", "x"], "--unit x: unknown unit; use one of "),
    ],
)
def test_bad_input_is_one_line(arguments, line, refused, tmp_path):
    (tmp_path / "file").touch()
    refused(*arguments, line=line)


QUICK = """
import contextlib, io, sys
from blysk.sim.cli.main import cli, main
with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as errors:
    names = cli.list_commands(None)
    helped = [main([name, "--help"]) for name in names]
    refused = [main(words.split()) for words in sys.argv[1:]]
heavy = {"amaranth", "distributed", "jinja2", "matplotlib", "scipy", "skimage", "trimesh"}
print(*names, set(helped), set(refused), heavy & sys.modules.keys(), errors.getvalue().count("blysk: "))
"""


def test_help_and_refused_arguments_load_nothing_heavy(tmp_path):
    """For every command the code that does the work is imported after the checks."""
    refused = [
        "absorb missing.json -o a.json",
        "bench --only nothing",
        "bench --jobs 0",
        "bench --cluster nowhere",
        "bench --mesh missing.obj",
        "bench no/folder",
        "blocks --samples 3",
        "blocks --json no/folder.json",
        "board nothing",
        "board ulx3s-25f",
        "board ulx3s-25f -o a.bit --toggles",
        "board ulx3s-25f -o a --simulate 1 --mesh missing.obj",
        "board ulx3s-25f -o a --simulate 1 --light 0,0,0",
        "explore --models nothing",
        "explore --mesh missing.obj",
        "explore --methods linear --operands cosine --degrees 1 --size 0x1",
        "fpga --unit nothing",
        "fpga --unit gpq --lights 2",
        "fpga --setups 2",
        "fpga --family nothing",
        "pages --unit nothing",
        "pages file/new",
        "render missing.obj",
        "verilog --pipes 3",
        "verilog --attributes tool",
        "verilog --y-bits 5 --testbench bench",
        "verilog --method quotient --gate",
        "verilog -o no/core.v",
        "fpga --method quotient --gate",
        "web --design chord-local/exp",
        "web --report nothing",
        "web -o file",
    ]
    (tmp_path / "file").touch()
    done = subprocess.run(
        [sys.executable, "-c", QUICK, *refused], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    commands = "absorb bench blocks board explore fpga pages render send verilog web"
    assert done.stdout == f"{commands} {{0}} {{2}} set() {len(refused)}\n"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


MODULES = """
import contextlib, io, runpy, sys
def run(module, *arguments):
    sys.argv = [module, *arguments]
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as stop:
        return stop.code or 0
with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as errors:
    found = {(run(module, "--help"), run(module, "--nonsense")) for module in sys.argv[1:]}
print(found, [name for name in HEAVY if name in sys.modules])
print(errors.getvalue().count("No such option"))
"""


def test_help_and_refused_options_of_modules_are_quick():
    """Every module of this layer that is a command loads nothing heavy before its options are checked."""
    (folder,) = blysk.bench.__path__
    commands = [
        "blysk.bench." + ".".join(path.relative_to(folder).with_suffix("").parts)
        for path in sorted(Path(folder).rglob("*.py"))
        if 'if __name__ == "__main__":' in path.read_text()
    ]
    assert len(commands) >= 7
    heavy = ["amaranth", "blysk.golden.presets", "matplotlib", "scipy", "trimesh"]
    code = MODULES.replace("HEAVY", repr(heavy))
    done = subprocess.run([sys.executable, "-c", code, *commands], capture_output=True, text=True, check=True)
    assert done.stdout == f"{{(0, 2)}} []\n{len(commands)}\n", done.stdout


def test_records_load_no_mesh_reader():
    """The records of all units need the teapot, which is computed, and no file of a mesh."""
    code = """
import sys
from blysk.bench.units.registry import RECORDS
meshes = {name for name in sys.modules if name.startswith("blysk.sim.meshes.")}
print(meshes - {"blysk.sim.meshes.teapot"}, {"PIL", "matplotlib", "trimesh"} & sys.modules.keys())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set() set()\n"
