"""Checks of output files before long work."""

import os
from collections.abc import Mapping, Sequence

from blysk.sim.errors import InputError
from blysk.sim.frames.picture import check_image_path
from blysk.sim.output import check_writable
from blysk.sim.run_files import reads

__all__ = ["animation_paths", "check_outputs"]


def check_outputs(
    inputs: Sequence[str], pictures: Sequence[str | None], others: Sequence[str | None]
) -> None:
    """Refuse an output that cannot be written, that is also another output, or that the run reads.

    Parameters
    ----------
    inputs : sequence of str
        Known files that the run reads. A mesh file may name further files.
    pictures, others : sequences of str or None
        Files to be written.

    Raises
    ------
    InputError
        If an output is refused.
    """
    for path in inputs:
        reads(path)
    seen = set()
    for path in [*pictures, *others]:
        if path:
            if os.path.realpath(path) in seen:
                raise InputError(path, "is also another output", "choose another file")
            seen.add(os.path.realpath(path))
            (check_image_path if path in pictures else check_writable)(path)


def animation_paths(output: str, count: int, others: Mapping[str, str | None]) -> tuple[list[str], str]:
    """Names of a turntable's files: PNG files of the frames, and a GIF file of the animation.

    Parameters
    ----------
    output : str
        Output that the user names. Its suffix gives way to a number and ``.png``, and to ``.gif``.
    count : int
        Number of frames.
    others : dict
        Output files of options that serve a single frame alone, by option.

    Raises
    ------
    InputError
        If ``others`` has a file, or the name has another suffix than ``.gif`` or ``.png``.
    """
    for option, path in others.items():
        if path:
            raise InputError(f"{option} {path}", "is for one frame", f"leave out {option} or --frames")
    stem, suffix = os.path.splitext(output)
    if suffix.lower() not in (".gif", ".png"):
        raise InputError(
            output, "the frames are PNG files, and the animation is a GIF file", "use .gif or .png"
        )
    return [f"{stem}-{number:04}.png" for number in range(1, count + 1)], f"{stem}.gif"
