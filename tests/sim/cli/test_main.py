"""The command line as a program: help, versions, Verilog, interrupts, closed pipes."""

import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from types import ModuleType

import pytest

import blysk.__main__ as entry
from blysk.sim.api.scene_file import read_scene_file
from blysk.sim.cli.main import main

from .commandline import PROGRAM, files, wait

pytestmark = pytest.mark.usefixtures("folder")


@pytest.mark.long
def test_verilog_with_a_gate(capsys):
    assert main(["verilog", "--method", "quadratic", "--gate"]) == 0
    output = capsys.readouterr().out
    assert "throughput style, highlight gate" in output
    assert "highlight_gate" in output.partition("module")[2]


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], ["render", "--help"], ["verilog", "-h"]])
def test_help_has_an_example(capsys, arguments):
    assert main(arguments) == 0
    output, errors = capsys.readouterr()
    assert errors == ""
    assert re.search(r"Examples?:\n +blysk (render|verilog) ", output)


QUICK = """
import contextlib, io, sys
import blysk
blysk.__all__, dir(blysk)
from blysk.sim.cli.main import main
def loaded(*heavy):
    return [name for name in heavy if name in sys.modules]
with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as errors:
    listed = main(["--help"]), main(["--version"]), main(["nothing"])
    early = loaded("numpy", "tomllib", "blysk.golden.presets")
    helped = [main([command, "--help"]) for command in ("render", "verilog")]
    refused = [main(words.split()) for words in sys.argv[1:]]
heavy = loaded("amaranth", "blysk.golden.geometry", "matplotlib", "scipy", "trimesh")
print(listed, early, helped, set(refused), heavy)
print(errors.getvalue().count("blysk: "))
"""


def test_help_and_refused_options_are_quick():
    """Help and refusals import nothing that takes long."""
    refused = [
        "render teapot --size 3",
        "render missing.obj",
        "render teapot --position 0,0,1 --view front",
        "render teapot --short-words",
        "render teapot -o picture.txt",
        "render teapot --light 0,0,0",
        "verilog --pipes 3",
        "verilog --package ipxact a",
    ]
    done = subprocess.run([sys.executable, "-c", QUICK, *refused], capture_output=True, text=True, check=True)
    assert done.stdout == f"(0, 0, 2) [] [0, 0] {{2}} []\n{1 + len(refused)}\n", done.stdout


def test_help_names_every_key_of_a_scene_file(capsys):
    assert main(["render", "--help"]) == 0
    (keys,) = re.findall(r"Keys of a scene file.*?\n\n", capsys.readouterr().out, re.DOTALL)
    example = read_scene_file.__doc__.partition("::")[2].partition("The values have")[0]
    names = re.findall(r"^ *(\w+) =|^ *(\[+\w+\]+)", example, re.MULTILINE)
    assert len(names) > 20
    for name in [*(first or second for first, second in names), "position", "target"]:
        assert re.search(rf"(?<!\w){re.escape(name)}(?!\w)", keys), name


def test_components_that_nothing_elaborates_are_not_told():
    """Amaranth's warning does not appear, also after the command, when the filters of its run are gone."""
    code = "from blysk.hdl.pipeline import ShadingPipelineUnit; from blysk.sim.cli.main import main"
    code += "; main(['verilog', '-o', 'a.v']); ShadingPipelineUnit(); import gc; gc.collect()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_version(capsys):
    assert main(["--version"]) == 0
    assert re.fullmatch(r"blysk \d+\.\d+\.\d+\n", capsys.readouterr().out)


@pytest.mark.ci
@pytest.mark.long
def test_verilog(capsys):
    command = ["verilog", "--method", "linear", "--model", "cosquad7"]
    assert main([*command, "-o", "core.v"]) == 0
    assert capsys.readouterr() == ("", "")
    text = Path("core.v").read_text()
    assert "model cosquad7, lights 1" in text
    # The text is the same in another process, whatever the order of its sets.
    environment = {**os.environ, "PYTHONHASHSEED": "12345"}
    again = subprocess.run([*PROGRAM, *command], env=environment, capture_output=True, text=True)
    assert (again.stdout, again.stderr) == (text, "")


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_interrupt():
    """After Ctrl-C in a long run there is one line and status 130, and no file is left."""
    options = ["--engine", "pysim", "--vcd", "a.vcd", "--json", "a.json", "--compare", "a.png"]

    def grows():
        # A file that tries whether the folder can be written goes at once.
        with suppress(FileNotFoundError):
            return any(path.stat().st_size for path in Path().iterdir())

    with subprocess.Popen(
        [*PROGRAM, "render", "teapot", *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            # The simulation has begun when its waveforms grow.
            wait(process, grows, 60)
            process.send_signal(signal.SIGINT)
            output, errors = process.communicate(timeout=60)
        finally:
            process.kill()
    assert (process.returncode, output, errors) == (130, "", "blysk: interrupted\n")
    assert files() == {}


def test_interrupt_while_it_is_imported(monkeypatch, capsys):
    """The first second of a command is spent on its imports."""

    class Slow(ModuleType):
        def __getattr__(self, name):
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "blysk.sim.cli.main", Slow("blysk.sim.cli.main"))
    assert entry.main() == 130
    assert capsys.readouterr() == ("", "blysk: interrupted\n")


@pytest.mark.skipif(os.name != "posix", reason="pipes")
def test_output_closed_early():
    process = subprocess.Popen([*PROGRAM, "render", "--help"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    with process.stderr:
        assert process.stderr.read() == b""
    assert process.wait(timeout=60) == 141


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_full_disk_behind_standard_output():
    with open("/dev/full", "w") as full:
        done = subprocess.run([*PROGRAM, "--version"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert re.fullmatch(r"blysk: standard output: No space left on device; [^\n]+\n", done.stderr)


def test_a_command_is_installed():
    program = shutil.which("blysk", path=str(Path(sys.executable).parent))
    if program is None:
        pytest.skip("the package is not installed")
    done = subprocess.run([program, "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
