"""Runs the tools that map, place and route, in a folder, with a limit to their attempts."""

import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from blysk.hdl.emit.processes import Process
from blysk.sim.cli.progress import TOLD, elapsed
from blysk.sim.engines.engine import SimulationError

__all__ = ["MOUNT", "GivenUp", "TooLarge", "ToolError", "ToolRunner", "Watch"]

_SECONDS = 5
"""Seconds between two readings of a tool's output."""

_ROUND = re.compile(r"^Info:\s+iter=(\d+) wires=\d+ overused=(\d+)", re.MULTILINE)
"""A round of the router in nextpnr's log, and the number of wires that are used twice."""

_SPREAD = re.compile(r"^Info: overlap: COMB=([\d.]+)%", re.MULTILINE)
"""A round of the static placer in nextpnr's log, and the share of logic cells that overlap."""

MOUNT = "/job"
"""Path, in the tool's sandbox, of the folder in which it runs. The tool sees only this folder."""


class ToolError(SimulationError):
    """Yosys or nextpnr failed, or nextpnr cannot time the result."""


class TooLarge(ToolError):
    """A design takes more parts than the FPGA has."""


class GivenUp(ToolError):
    """A tool was stopped because it would not have finished."""


class Watch:
    """Tells every 30 seconds how far a tool is, and says when the tool is to be given up.

    Parameters
    ----------
    step : str
        Name of the step, such as ``placement 2``.
    tell : callable
        Called with each line: the step, the last round of router or placer, and the time since the watch was
        made.
    stuck : callable, optional
        Called with the tool's output so far. It returns the reason to give the tool up, or an empty text.
    """

    def __init__(
        self, step: str, tell: Callable[[str], object], stuck: Callable[[str], str] = lambda said: ""
    ):
        self._step, self._tell, self._stuck = step, tell, stuck
        self._begin = self._told = time.monotonic()

    def __call__(self, said: str) -> str:
        """Judge the output so far. Returns the reason to give the tool up, or an empty text."""
        now = time.monotonic()
        if now - self._told >= TOLD:
            self._told = now
            rounds = [
                *(
                    f"placer's round {k}, {share} % overlap"
                    for k, share in enumerate(_SPREAD.findall(said), 1)
                ),
                *(f"round {number}, {wires} wires used twice" for number, wires in _ROUND.findall(said)),
            ]
            self._tell(f"{self._step}: {', '.join([*rounds[-1:], elapsed(self._begin)])}")
        return self._stuck(said)


class ToolRunner:
    """Runs several tools at a time, and can stop all of them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[Process] = set()
        self._stopped = False

    def run(
        self,
        name: str,
        code: str,
        arguments: Sequence[str],
        folder: Path,
        text: str = "",
        watch: Callable[[str], str] | None = None,
    ) -> None:
        """Run Python code in a folder, with a text as its standard input.

        `watch` is called every few seconds with the tool's output so far. If it returns a reason, the tool
        is stopped, and `GivenUp` is raised. `ToolError` is raised if the tool fails or if `stop` stops it.
        """
        # Python's own warnings do not belong to the tool's output.
        command = [sys.executable, "-W", "ignore", "-c", code, *arguments]
        with tempfile.TemporaryFile(dir=folder) as given, tempfile.TemporaryFile(dir=folder) as log:
            given.write(text.encode())
            given.seek(0)
            with self._lock:
                if self._stopped:
                    raise ToolError(f"{name} was stopped")
                process = Process(
                    command,
                    cwd=folder,
                    # The tool's own temporary files go with the folder, also when the tool is killed.
                    env={**os.environ, "TMPDIR": str(folder), "YOWASP_MOUNT": f"{MOUNT}=."},
                    stdin=given,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                )
                self._running.add(process)
            try:
                while process.returncode is None:
                    try:
                        process.wait(_SECONDS if watch else None)
                    except subprocess.TimeoutExpired:
                        # The tool writes at the file's position. `pread` does not move this position.
                        size = os.fstat(log.fileno()).st_size
                        if reason := watch(os.pread(log.fileno(), size, 0).decode(errors="replace")):
                            raise GivenUp(reason) from None
            finally:
                process.kill()
                process.wait()
                with self._lock:
                    self._running.discard(process)
            if process.returncode:
                log.seek(0)
                lines = log.read().decode(errors="replace").strip().splitlines()
                errors = [line for line in lines if line.startswith("ERROR")] or lines[-1:] or ["no message"]
                raise ToolError(f"{name} ends with status {process.returncode}: {errors[0].strip()}")

    def stop(self) -> None:
        """Stop all running tools, and start no more."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                process.kill()
