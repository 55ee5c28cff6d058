"""Programs that are killed when this process ends."""

import atexit
import contextlib
import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from typing import Any

__all__ = ["Process", "run_program"]

_GUARD = """
import os, signal, sys
for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
    signal.signal(number, signal.SIG_IGN)
running = set()
for line in open(0, "rb", buffering=0):
    (running.add if line[:1] == b"+" else running.discard)(int(line[1:]))
for number in running:
    try:
        os.killpg(number, signal.SIGKILL)
    except OSError:
        pass
"""


class _Guard:
    """A small process that guards process groups: it kills them when a pipe from this process closes.

    From this pipe the guard reads which groups run, by their numbers. If this process ends, the system closes
    the pipe, even after SIGKILL.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[int] = set()
        self._process: subprocess.Popen | None = None
        self._owner = 0

    def begin(self) -> None:
        """Start the guard, unless it runs. Call this before the guarded program starts."""
        with self._lock:
            if self._process is None or self._owner != os.getpid():
                self._start()

    def add(self, number: int) -> None:
        """Guard a process group. The guard must have begun."""
        with self._lock:
            self._running.add(number)
            self._tell(b"+%d\n" % number)

    def discard(self, number: int) -> None:
        """End guarding a process group. If the group is not guarded, nothing happens."""
        with self._lock:
            if number in self._running:
                self._running.discard(number)
                self._tell(b"-%d\n" % number)

    def stop(self) -> None:
        """End the guard. It kills the process groups that still run."""
        with self._lock:
            if self._process is not None and self._owner == os.getpid():
                with contextlib.suppress(OSError):
                    self._process.stdin.close()
                self._process.wait()
                self._process = None

    def _start(self) -> None:
        if self._owner != os.getpid():
            atexit.register(self.stop)
        self._owner = os.getpid()
        self._process = _Popen(
            [sys.executable, "-I", "-S", "-c", _GUARD],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd="/",
            bufsize=0,
            start_new_session=True,
        )
        for number in self._running:
            self._process.stdin.write(b"+%d\n" % number)

    def _tell(self, line: bytes) -> None:
        try:
            self._process.stdin.write(line)
        except OSError:
            self._process.wait()
            self._start()


_Popen = subprocess.Popen
_guard = _Guard()


class Process(_Popen):
    """A program in a process group of its own. When this process ends, even by SIGKILL, the group is killed.

    `kill` kills the group, with all processes that the program started. On systems other than POSIX this is
    ``subprocess.Popen``.

    Parameters
    ----------
    command : sequence of str or path
        The program and its arguments.
    **options
        Options of ``subprocess.Popen``.
    """

    def __init__(self, command: Sequence[Any], *rest: Any, **options: Any):
        self._grouped = os.name == "posix"
        if self._grouped:
            _guard.begin()
            if not options.get("start_new_session"):
                options.setdefault("process_group", 0)
        super().__init__(command, *rest, **options)
        if self._grouped:
            _guard.add(self.pid)

    def poll(self) -> int | None:
        """Exit status, or ``None`` while the program runs."""
        return self._seen(super().poll())

    def wait(self, timeout: float | None = None) -> int:
        """Exit status, after the end of the program; raises ``subprocess.TimeoutExpired``."""
        return self._seen(super().wait(timeout))

    def kill(self) -> None:
        """Kill the program and its process group, if it runs."""
        if not self._grouped:
            super().kill()
        elif self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.pid, 9)

    def _seen(self, status):
        if status is not None and self._grouped:
            _guard.discard(self.pid)
        return status


def run_program(
    command: Sequence[Any],
    *,
    input: str | bytes | None = None,
    capture_output: bool = False,
    timeout: float | None = None,
    check: bool = False,
    **options: Any,
) -> subprocess.CompletedProcess:
    """Run a program as ``subprocess.run`` does, in a `Process`. By default its standard input is empty.

    Parameters
    ----------
    command, input, capture_output, timeout, check, **options
        As for ``subprocess.run``.

    Raises
    ------
    subprocess.TimeoutExpired
        If the program has not ended after ``timeout`` seconds. It is killed.
    subprocess.CalledProcessError
        With ``check``, if the program fails.
    OSError
        If the program cannot be started.
    """
    if input is not None:
        options["stdin"] = subprocess.PIPE
    if capture_output:
        options["stdout"] = options["stderr"] = subprocess.PIPE
    options.setdefault("stdin", subprocess.DEVNULL)
    with Process(command, **options) as process:
        try:
            output, errors = process.communicate(input, timeout)
        except BaseException:
            process.kill()
            raise
    done = subprocess.CompletedProcess(process.args, process.returncode, output, errors)
    if check:
        done.check_returncode()
    return done
