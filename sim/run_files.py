"""Files of a run. No output replaces a file that the run reads, or a file that another program wrote."""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from blysk.sim.errors import InputError

__all__ = ["MARK", "OutputIsInput", "RunFiles", "check_beside", "reads", "writes"]

MARK = "written by blysk"
"""Text in files that a command writes beside the file that the user names."""


class OutputIsInput(InputError):
    """An output would replace a file that the run reads."""

    def __init__(self, path: str | os.PathLike):
        super().__init__(os.fspath(path), "is a file that this run reads", "choose another file")


_Path = str | os.PathLike[str]


class RunFiles:
    """Files that a run reads and files that it will write, in any order. A link counts as its target."""

    def __init__(self) -> None:
        self._read: set[object] = set()
        self._written: list[_Path] = []

    def reads(self, path: _Path) -> None:
        """Record a file that the run reads, or may read. `OutputIsInput` if the file is an output."""
        keys = _keys(path)
        self._read |= keys
        for output in self._written:
            if _keys(output) & keys:
                raise OutputIsInput(output)

    def writes(self, path: _Path) -> None:
        """Record an output. `OutputIsInput` if the run reads the file."""
        if _keys(path) & self._read:
            raise OutputIsInput(path)
        self._written.append(path)

    @contextmanager
    def active(self) -> Iterator["RunFiles"]:
        """Let the functions `reads` and `writes` record into this run within the block."""
        token = _CURRENT.set(self)
        try:
            yield self
        finally:
            _CURRENT.reset(token)

    @staticmethod
    def current() -> "RunFiles":
        """The run of the surrounding block, or a new run."""
        return _CURRENT.get() or RunFiles()


_CURRENT: ContextVar[RunFiles | None] = ContextVar("run", default=None)


def _keys(path: _Path) -> set[object]:
    """Keys that all names of one file share: the path without links, the file's number on its disk."""
    real = os.path.realpath(path)
    keys: set[object] = {os.path.normcase(real)}
    try:
        found = os.stat(real)
    except (OSError, ValueError):
        return keys
    if not os.path.isfile(real):
        # The run may read and write the same pipe or terminal.
        return set()
    return keys | ({(found.st_dev, found.st_ino)} if found.st_ino else set())


def reads(path: _Path) -> _Path:
    """The path of a file that the current run reads. `RunFiles.reads` records it if there is a run."""
    if run := _CURRENT.get():
        run.reads(path)
    return path


def writes(path: _Path) -> None:
    """Record a file that the current run will write, see `RunFiles.writes`."""
    if run := _CURRENT.get():
        run.writes(path)


def check_beside(paths: Iterable[_Path]) -> None:
    """Check files that are written beside the file that the user names.

    Raises
    ------
    InputError
        If there is a file of this name without `MARK` in it, because another program or the user wrote it.
    """
    for path in map(Path, paths):
        try:
            found = path.read_bytes()
        except FileNotFoundError:
            continue
        except OSError as error:
            raise InputError(
                str(path), f"cannot be read ({error.strerror})", "choose another name"
            ) from error
        if MARK.encode() not in found:
            reason = "would be replaced, and blysk did not write it"
            raise InputError(str(path), reason, "move it, or choose another output")
