"""The folder of the units' pages, checked before they are made."""

from collections.abc import Sequence
from pathlib import Path

from blysk.sim.errors import InputError
from blysk.sim.output import check_writable

__all__ = ["MADE", "PROJECT", "check_folder"]

PROJECT = Path(__file__).resolve().parents[2]
"""Folder of the project, with its sources and documents if it is a checkout."""

MADE = "made by `blysk pages`"
"""Words on the first page of a folder. They mark a folder that `blysk pages` made."""


def check_folder(folder: Path, units: Sequence[str]) -> None:
    """Make the folder of pages if it does not exist. Refuse a folder with other files that would be replaced.

    Parameters
    ----------
    folder : Path
        Folder of the pages.
    units : sequence of str
        Units whose pages will be written.

    Raises
    ------
    InputError
        If the folder cannot be made or written, or if a file that `blysk pages` did not write would be
        replaced.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(folder), f"cannot be made ({error.strerror})", "give another folder") from None
    first = folder / "README.md"
    check_writable(first)
    if first.is_file() and MADE not in first.read_text(encoding="utf-8", errors="replace"):
        others = [first]
    else:
        others = [] if first.is_file() else [folder / f"{unit}.md" for unit in units]
    for path in others:
        if path.exists():
            reason = "would be replaced, and `blysk pages` did not write it"
            raise InputError(str(path), reason, "give a folder of its own")
