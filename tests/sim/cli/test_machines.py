"""Machines without a home, a cache or a writable folder: one line, and the work is done, or refused."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from blysk.sim.cli import draw
from blysk.sim.cli.main import main
from blysk.sim.errors import InputError

from .commandline import PROGRAM

RENDER = ["render", "teapot", "--triangles", "64", "--size", "8x6", "--engine", "pysim"]
WARNING = "models and tools are compiled again; set XDG_CACHE_HOME to a folder that can be written"
PLACES = ("HOME", "XDG_CACHE_HOME", "BLYSK_CACHE", "YOWASP_CACHE_DIR", "TMPDIR", "COVERAGE_PROCESS_CONFIG")

pytestmark = pytest.mark.skipif(not Path("/proc/self").exists(), reason="/proc is where nobody can write")


def blysk(*arguments, folder, launcher=(), **places):
    """Status, output and lines of errors of a command in an environment with these folders."""
    environment = {name: value for name, value in os.environ.items() if name not in PLACES} | places
    command = [*launcher, *PROGRAM, *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)
    assert "Traceback" not in done.stdout + done.stderr
    return done.returncode, done.stdout, done.stderr.splitlines()


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize(
    ("places", "command"),
    [
        ({"HOME": "/proc"}, [*RENDER, "-o", "a.png"]),
        pytest.param({"HOME": "/nowhere/at/all"}, ["render", "--help"], marks=pytest.mark.long),
        ({"HOME": "{0}", "XDG_CACHE_HOME": "/proc/cache"}, ["render", "--help"]),
    ],
    ids=["home", "no home", "cache"],
)
def test_no_cache(tmp_path, places, command):
    places = {name: value.format(tmp_path) for name, value in places.items()}
    status, _, errors = blysk(*command, folder=tmp_path, **places)
    assert (status, len(errors)) == (0, 1), errors
    assert errors[0].startswith("blysk: warning: cache folder /")
    assert errors[0].endswith(WARNING)
    assert os.listdir(tmp_path) == ["a.png"] * ("a.png" in command)


@pytest.mark.long
def test_no_home_for_other_tools(tmp_path):
    """A command that imports Matplotlib, which prints lines of its own."""
    status, _, errors = blysk("bench", "--help", folder=tmp_path, HOME="/proc")
    assert (status, len(errors)) == (0, 1), errors
    assert errors[0].endswith(WARNING)


@pytest.mark.long
def test_compiled_engine_without_a_cache(tmp_path):
    """Yosys' WebAssembly, the compiler and the model are in a folder that is gone afterwards."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    render = [*RENDER[:-1], "cxxrtl", "-o", tmp_path / "a.png"]
    status, _, errors = blysk(*render, folder=tmp_path, HOME="/proc", TMPDIR=str(temporary))
    assert (status, len(errors)) == (0, 1), errors
    assert os.listdir(temporary) == []


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="needs another user")
def test_user_of_no_name(tmp_path):
    """There is neither HOME nor an entry for the user. `--help` of a command makes the caches, too."""
    change = ["setpriv", "--reuid", "54321", "--clear-groups"]
    if subprocess.run([*change, sys.executable, "-c", "import blysk.sim"], capture_output=True).returncode:
        pytest.skip("another user may not read this installation")
    status, _, errors = blysk("verilog", "--help", folder="/", launcher=change)
    assert (status, len(errors)) == (0, 1)
    assert "there is no home folder" in errors[0]


@pytest.mark.ci
@pytest.mark.long
def test_folder_that_cannot_be_written(tmp_path):
    """This is found before the mesh is read, also for the superuser."""
    status, _, errors = blysk(*RENDER, folder="/proc", HOME=str(tmp_path))
    assert status == 2
    assert len(errors) == 1
    assert errors[0].startswith("blysk: teapot-blysk.png: cannot be written, ")
    assert "; choose a" in errors[0]


@pytest.mark.ci
@pytest.mark.long
def test_folder_that_is_gone(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    remove = [
        sys.executable,
        "-c",
        "import os, sys; os.rmdir(os.getcwd()); os.execv(sys.argv[1], sys.argv[1:])",
    ]
    status, _, errors = blysk(*RENDER, folder=gone, launcher=remove, HOME=str(tmp_path))
    reason = "cannot be used (No such file or directory); change to a folder that exists"
    assert (status, errors) == (2, [f"blysk: the current folder: {reason}"])


@pytest.mark.parametrize(("option", "old"), [("--json", True), ("--compare", True), ("--json", False)])
def test_failed_output_leaves_no_picture(tmp_path, monkeypatch, capsys, option, old):
    monkeypatch.chdir(tmp_path)
    suffix = ".json" if option == "--json" else ".png"
    picture = tmp_path / "a.png"
    if old:
        picture.write_text("old")
    for bad in (f"/proc/b{suffix}", tmp_path / "none" / f"b{suffix}", tmp_path / ("b" * 300 + suffix)):
        assert main([*RENDER, "-o", str(picture), option, str(bad)]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
    left = [path.name for path in tmp_path.iterdir() if path.name != ".cache"]
    assert left == ["a.png"] * old
    assert not old or picture.read_text() == "old"


def test_picture_waits_for_the_figures(tmp_path, monkeypatch, capsys):
    """The disk is full when the figures are written, after the picture."""

    def full(path, value):
        raise InputError(path, "cannot be written, the disk is full", "free some space")

    monkeypatch.setattr(draw, "write_json", full)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))
    assert main([*RENDER, "-o", "a.png", "--compare", "b.png", "--json", "c.json"]) == 2
    assert "c.json: cannot be written, the disk is full; free some space\n" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == []


MEMORY = r"""
import re, sys
from blysk.sim.cli import progress
from blysk.sim.cli.main import main
progress.SECONDS = 3600
status = main(sys.argv[1:])
# The largest of getrusage counts the process that this one was started from.
print(re.search(r"VmHWM:\s+(\d+)", open("/proc/self/status").read())[1])
sys.exit(status)
"""


def memory_of(*arguments, folder):
    """Status, errors, and the largest resident memory in MB."""
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, *map(str, arguments)], cwd=folder, capture_output=True, text=True
    )
    return done.returncode, done.stderr, int(done.stdout.split()[-1]) / 1024


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        pytest.param("a." * 40_000 + "a=1", "has over 256 dots in line 1; break the line", id="one key"),
        pytest.param(
            "\n".join(f"a{i}." + "b." * 250 + "a=1" for i in range(190)),
            "unknown key",
            marks=pytest.mark.long,
            id="keys",
        ),
        *(
            pytest.param(
                "\n".join(text.format(i) for i in range(count)), "unknown key", marks=pytest.mark.long
            )
            for text, count in (("[a{}." + "b." * 250 + "a]", 190), ("a{}.b=1", 9000))
        ),
    ],
)
def test_memory_of_a_scene_file(tmp_path, text, reason):
    (tmp_path / "a.toml").write_text(text)
    status, errors, memory = memory_of("render", "a.toml", folder=tmp_path)
    assert status == 2
    assert reason in errors
    assert errors.count("\n") == 1
    assert memory < 400


@pytest.mark.long
def test_memory_of_the_largest_picture(tmp_path):
    """A mesh that fills all 4095 x 4095 pixels."""
    corners = "v -1 -1 0\nv 1 -1 0.1\nv 1 1 0\nv -1 1 0.1\nf 1 2 3\nf 1 3 4\n"
    (tmp_path / "a.obj").write_text(corners)
    size = ["--size", "4095x4095", "--position", "0,0,1", "--compare", "b.png"]
    status, errors, memory = memory_of("render", "a.obj", *size, "-o", "a.png", folder=tmp_path)
    assert status == 0, errors
    assert memory < 2000
