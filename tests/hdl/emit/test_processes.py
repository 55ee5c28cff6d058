"""Programs end with the process that starts them, killed or not, and so do the programs that they start."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from blysk.hdl.emit import processes
from blysk.hdl.emit.processes import Process, run_program

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")

# A shell that starts another program, as a compiler does.
PARENT = """
import sys, threading, time
from blysk.hdl.emit import processes
from blysk.hdl.emit.processes import Process, run_program
run_program(["true"])
shell = ["sh", "-c", "sleep 300 & echo $! >> numbers; sleep 300 & echo $! >> numbers; wait"]
threading.Thread(target=run_program, args=(shell,), daemon=True).start()
Process(shell)
# A shell may tell of its programs before its parent has told the guard of the shell.
while len(processes._guard._running) < 2:
    time.sleep(0.01)
print("guarded", flush=True)
"""
WAYS = {"killed": "time.sleep(300)", "over": "sys.stdin.read()"}


def numbers(folder):
    """Numbers of the processes that the shells have written down."""
    path = folder / "numbers"
    return [int(line) for line in path.read_text().split()] if path.exists() else []


def runs(number):
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait(condition):
    deadline = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.parametrize("way", WAYS)
def test_programs_end_with_their_parent(tmp_path, way):
    command = [sys.executable, "-c", PARENT + WAYS[way]]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, cwd=tmp_path, **pipes) as parent:
        assert parent.stdout.readline() == b"guarded\n"
        wait(lambda: len(numbers(tmp_path)) == 4)
        started = numbers(tmp_path)
        assert all(map(runs, started))
        if way == "killed":
            parent.send_signal(signal.SIGKILL)
    wait(lambda: not any(map(runs, started)))


def test_kill_reaches_what_the_program_started(tmp_path):
    with Process(["sh", "-c", "sleep 300 & echo $! > numbers; wait"], cwd=tmp_path) as process:
        wait(lambda: len(numbers(tmp_path)) == 1)
        process.kill()
    assert process.returncode == -signal.SIGKILL
    wait(lambda: not runs(numbers(tmp_path)[0]))


def test_a_guard_that_was_killed_is_replaced(tmp_path):
    """After the guard was killed, running programs are guarded again."""
    code = (
        "import os, signal, sys\n"
        "from blysk.hdl.emit.processes import Process, _guard\n"
        "first = Process(['sleep', '300'])\n"
        "os.kill(_guard._process.pid, signal.SIGKILL); _guard._process.wait()\n"
        "second = Process(['sleep', '300'])\n"
        "print(first.pid, second.pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == -signal.SIGKILL
    wait(lambda: not any(map(runs, map(int, done.stdout.split()))))


def test_the_guard_begins_before_the_first_program(monkeypatch):
    """If a parent is killed as soon as its first program runs, the guard already exists."""
    begun, begin = [], processes._Popen.__init__

    def begins(self, command, *rest, **options):
        begun.append(command[-1])
        begin(self, command, *rest, **options)

    monkeypatch.setattr(processes._Popen, "__init__", begins)
    monkeypatch.setattr(processes, "_guard", guard := processes._Guard())
    run_program(["true"])
    guard.stop()
    assert begun == [processes._GUARD, "true"]


def test_run_program_is_run():
    """The function behaves as subprocess.run: output, errors, status, input and limit of time.

    Without input the program gets none.
    """
    code = "import sys; print(sys.stdin.read()); print('e', file=sys.stderr); sys.exit(3)"
    command = [sys.executable, "-c", code]
    done = run_program(command, input="given", capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (3, "given\n", "e\n")
    assert run_program(command, capture_output=True).stdout == b"\n"
    with pytest.raises(subprocess.CalledProcessError):
        run_program(command, capture_output=True, check=True)
    with pytest.raises(subprocess.TimeoutExpired):
        run_program(["sleep", "300"], timeout=0.1)
    with pytest.raises(OSError, match="none"):
        run_program([os.devnull + "/none"])
