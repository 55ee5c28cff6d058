"""Faults of the machine: killed programs, full and forbidden disks, damaged and foreign caches."""

import contextlib
import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from blysk.bench.store import Task, results_of
from blysk.sim.engines import cxxrtl
from blysk.sim.errors import InputError
from blysk.sim.frames.picture import write_image
from blysk.sim.frames.workers import local_executor
from blysk.sim.output import check_writable, write_json

from ..engines.scale import BEATS, entries, left_in, scaled, script, start
from .commandline import PROGRAM, wait

THREE = (3 * BEATS).tolist()
NOBODY = 65534

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="signals, users and permissions"),
    pytest.mark.usefixtures("cache"),
    *(pytest.mark.ci, pytest.mark.long),
]


@pytest.fixture
def small_disk(tmp_path):
    """A file system of a few pages, of which one is free."""
    folder = tmp_path / "disk"
    folder.mkdir(mode=0o700)
    options = ["-t", "tmpfs", "-o", "size=16k,mode=700", "tmpfs", str(folder)]
    if not shutil.which("mount") or subprocess.run(["mount", *options], capture_output=True).returncode:
        pytest.skip("may not mount a file system")
    (folder / "old.json").write_text("old")
    (folder / "filling").write_bytes(bytes(2 * 4096))
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


@contextlib.contextmanager
def an_ordinary_user():
    """The superuser, to whom nothing is forbidden, becomes an ordinary user for a while."""
    if os.geteuid():
        yield
        return
    os.setresuid(NOBODY, NOBODY, 0)
    try:
        yield
    finally:
        os.setresuid(0, 0, 0)


# The compiler.


def test_killed_while_compiling(cache, temporary, tmp_path):
    """A process that is killed leaves no half of a model in the cache, and the next process builds the
    model."""
    text = 'case "$1" in --version) echo 1.0; exit 0;; esac; echo $$ > "$STARTED"; exec sleep 60'
    started = tmp_path / "started"
    program = "print(simulate(Triple(), np.arange(5), count=5).beats.tolist())"
    process = start(program, CXX=script(tmp_path, "slow", text), STARTED=str(started))
    wait(process, lambda: started.exists() and started.read_text().endswith("\n"), 60)
    process.kill()
    os.kill(int(started.read_text()), signal.SIGKILL)
    process.communicate(timeout=60)
    assert left_in(cache) == []
    again = start(program)
    assert again.communicate(timeout=60) == ("[0, 3, 6, 9, 12]\n", "")
    assert len(entries(cache)) == 1


def test_full_cache(small_disk, temporary, monkeypatch):
    """The first compiler still builds the model, and it is used. A warning tells why it is not kept."""
    before = left_in(small_disk)
    monkeypatch.setenv("BLYSK_CACHE", str(small_disk))
    warning = rf"^cache folder {re.escape(str(small_disk))} cannot be written \(No space left on device\): "
    with pytest.warns(RuntimeWarning, match=warning):
        assert scaled() == THREE
    assert left_in(small_disk) == before


def test_full_cache_without_mounting(cache, temporary, monkeypatch):
    copyfile = shutil.copyfile

    def full(source, target):
        if Path(target).parent == cache:
            Path(target).write_bytes(b"half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return copyfile(source, target)

    monkeypatch.setattr(shutil, "copyfile", full)
    with pytest.warns(RuntimeWarning, match=r"cannot be written \(No space left on device\): compiled"):
        assert scaled() == THREE
    # To move a file within a file system takes no room.
    assert all(path.suffix == ".model" for path in left_in(cache))
    assert scaled() == THREE


def test_full_temporary_folder(cache, small_disk, monkeypatch):
    before = left_in(small_disk)
    monkeypatch.setattr(tempfile, "tempdir", str(small_disk))
    with pytest.raises(
        InputError, match=r"^the temporary folder: cannot be used \(No space left on device\); "
    ):
        scaled()
    assert left_in(cache, small_disk) == before


@pytest.mark.parametrize(
    ("at", "value"),
    [
        pytest.param(4, b"\1", marks=pytest.mark.long, id="32 bits"),
        pytest.param(18, b"\xf7\0", id="other processor"),
    ],
)
def test_model_of_another_machine(cache, at, value):
    """A library with a right checksum, but for another kind of processor, is built again."""
    assert scaled() == THREE
    (entry,) = entries(cache)
    content = entry.read_bytes()
    if content[:4] != b"\x7fELF":
        pytest.skip("libraries are of another format")
    key = entry.stem.split("-")[0]
    entry.unlink()
    other = cache / "other"
    other.write_bytes(content[:at] + value + content[at + len(value) :])
    planted = other.rename(cache / f"{key}-{cxxrtl._digest(other)}.model")
    assert scaled() == THREE
    (again,) = entries(cache)
    assert again != planted


# Users and permissions.


@pytest.fixture
def open_folder():
    """A folder that an ordinary user may read. The folders above it are open, too."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder)


def test_forbidden_output(open_folder):
    path = open_folder / "locked" / "a.json"
    path.parent.mkdir(mode=0o500)
    message = f"{path}: cannot be written, permission denied; choose a folder that you may write to"
    with an_ordinary_user():
        for attempt in (check_writable, lambda path: write_json(path, 1)):
            with pytest.raises(InputError) as caught:
                attempt(path)
            assert str(caught.value) == message
    assert left_in(open_folder) == []


# Full disks.


@pytest.mark.parametrize("name", ["old.json", "new.json", "new.png"])
def test_full_disk(small_disk, name):
    """The old file is unchanged, and there is no part of the new file."""
    before = {path: path.read_bytes() for path in left_in(small_disk)}
    noise = np.random.default_rng(1).integers(0, 256, (60, 60, 3)).astype(np.uint8)
    write = write_image if name.endswith(".png") else write_json
    with pytest.raises(InputError) as caught:
        write(small_disk / name, noise)
    reason = "cannot be written, the disk is full; free some space or choose another disk"
    assert str(caught.value) == f"{small_disk / name}: {reason}"
    assert {path: path.read_bytes() for path in left_in(small_disk)} == before


LIMITED = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)); "


@pytest.fixture
def unmeasured(monkeypatch):
    """Line coverage is switched off, because its file would be larger than the process may write."""
    monkeypatch.delenv("COVERAGE_PROCESS_CONFIG", raising=False)


def test_largest_file_of_a_process(unmeasured, tmp_path):
    """A limit of the shell stands for a full disk."""
    program = "from blysk.sim.output import write_text; write_text(sys.argv[1], 5000 * 'x')"
    path = tmp_path / "a.txt"
    path.write_text("old")
    done = subprocess.run(
        [sys.executable, "-c", LIMITED + program, str(path)], capture_output=True, text=True
    )
    message = f"blysk.sim.errors.InputError: {path}: cannot be written, File too large; choose another file\n"
    assert done.stderr.endswith(message)
    assert path.read_text() == "old"
    assert left_in(tmp_path) == [path]


def test_yosys_that_cannot_work(unmeasured, cache):
    """Yosys ends with a traceback, and the message has its last line."""
    run = start(LIMITED + "simulate(Triple(), np.arange(5), count=5, engine='cxxrtl')")
    _, errors = run.communicate(timeout=60)
    assert re.search(r"\nblysk\.sim\.errors\.SimulationError: Yosys: \S.*File too large.*\n\Z", errors)
    assert left_in(cache) == []


# Sweeps.


def measured(number, mark):
    """A measurement whose first run of number 3 ends with its process."""
    if number == 3 and not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return {"number": number, "run": time.time()}


def test_killed_worker_of_a_sweep(cache, tmp_path):
    tasks = [Task(measured, {"number": number, "mark": str(tmp_path / "mark")}) for number in range(6)]
    reason = "^--jobs 1: a process died, perhaps because memory ran out; use fewer jobs, or smaller pictures$"
    with pytest.raises(InputError, match=reason), local_executor(1) as executor:
        results_of(tasks, executor)
    kept = {path: path.read_bytes() for path in (cache / "results").iterdir()}
    assert sorted(json.loads(entry)["result"]["number"] for entry in kept.values()) == [0, 1, 2]
    with local_executor(1) as executor:
        found = results_of(tasks, executor)
    assert [result["number"] for result in found] == list(range(6))
    assert all(path.read_bytes() == entry for path, entry in kept.items())


SWEEP = ["explore", "--size", "24x18", "--methods", "linear,renormalise,quadratic", "--models", "cosquad"]
SWEEP += ["--degrees", "3", "--fraction-bits", "46", "--operands", "one_minus_cosine"]
SWEEP += ["--largest-error", "255"]


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="there is no /proc")
def test_killed_worker_of_a_command(cache):
    """The command prints one line and ends with status 2.

    Measured values are kept, and the next run continues from there.
    """
    arguments = [*PROGRAM, *SWEEP, "--jobs", "2"]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait(process, lambda: left_in(cache / "results"))
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    worker = next(pid for pid in children if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes())
    os.kill(int(worker), signal.SIGKILL)
    output, errors = process.communicate(timeout=60)
    assert (process.returncode, output) == (2, "")
    reason = "a process died, perhaps because memory ran out; use fewer jobs, or smaller pictures"
    told = [line for line in errors.splitlines() if "measurements]" not in line]
    assert told == [f"blysk: --jobs 2: {reason}"]
    kept = {path: path.stat().st_mtime_ns for path in left_in(cache / "results")}
    assert kept
    done = subprocess.run(arguments, capture_output=True, text=True)
    # On a busy machine this takes over 10 s, and then prints its progress.
    lines = [line for line in done.stderr.splitlines() if "measurements]" not in line]
    assert (done.returncode, lines) == (0, [])
    assert "designs     6 of 6 have" in done.stdout
    assert kept.items() < {path: path.stat().st_mtime_ns for path in left_in(cache / "results")}.items()
