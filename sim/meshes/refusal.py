"""Shared parts of the readers of mesh files: refusals, names in messages, and files that a file refers to."""

import os
import re
from pathlib import Path

from blysk.sim.errors import one_line
from blysk.sim.run_files import reads

__all__ = ["MAX_FACES", "ONE_MATERIAL", "REEXPORT", "Refused", "inside", "refers", "shown"]

MAX_FACES = 20_000_000
"""Largest number of triangles of a mesh."""

REEXPORT = "check the file or export it again"
ONE_MATERIAL = "mend it, or shade the mesh with one material"


class Refused(Exception):
    """A file is refused. The exception has reason and remedy, and the caller adds the file's name."""

    def __init__(self, reason: str, remedy: str = REEXPORT):
        super().__init__(reason)
        self.reason = reason
        self.remedy = remedy


def shown(text: str) -> str:
    """Text of a file for a message, in one line of at most 60 characters."""
    return one_line(text, 60)


def refers(folder: Path, *names: str) -> None:
    """Record existing files that a file refers to, read or not, so that no output replaces them."""
    for name in names:
        if os.path.isfile(folder / name):
            reads(folder / name)


def inside(folder: Path, reference: str, name: str | None = None) -> Path:
    """The file that a reference means, in the folder or below; `Refused` if outside. It need not exist."""
    name = reference if name is None else name
    # For a name that is too long, and for links in a circle, `Path.resolve` may raise exceptions.
    target = Path(os.path.realpath(folder / name))
    outside = re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", reference) or reference.startswith(("/", "\\"))
    if outside or ".." in Path(name).parts or not target.is_relative_to(folder.resolve()):
        raise Refused(f"it refers to {reference!r}, outside its folder", "put that file beside it")
    return target
