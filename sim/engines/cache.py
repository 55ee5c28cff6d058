"""The folder of compiled models."""

import atexit
import functools
import os
import shutil
import tempfile
import warnings
from pathlib import Path

import platformdirs

__all__ = ["cache_folder", "private_folder", "warn_of_cache"]


def _unsafe(folder: Path) -> str | None:
    """Why no model may be loaded from a folder, or ``None``."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError as error:
        return f"cannot be made ({error.strerror})"
    if hasattr(os, "getuid"):
        if status.st_uid != os.getuid():
            return "belongs to another user"
        if status.st_mode & 0o022:
            return "can be written by others (chmod go-w)"
    if not os.access(folder, os.W_OK | os.X_OK):
        return "cannot be written"
    return None


@functools.cache
def private_folder() -> Path:
    """A folder of this process, removed at its end."""
    folder = Path(tempfile.mkdtemp(prefix="blysk-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def cache_folder() -> Path:
    """Folder of the compiled models: ``$BLYSK_CACHE``, or the user's cache folder.

    A model is code that gets run, so a folder that belongs to another user, or that others can write, is not
    used: a warning says so, and the models live in a private temporary folder until the process ends.

    Returns
    -------
    Path
        An existing folder.
    """
    chosen = os.environ.get("BLYSK_CACHE")
    folder = Path(chosen).absolute() if chosen else platformdirs.user_cache_path("blysk")
    reason = _unsafe(folder)
    if reason is None:
        return folder
    warn_of_cache(folder, reason)
    return private_folder()


def warn_of_cache(folder: Path, reason: str) -> None:
    """Warn that a cache folder is not used."""
    text = f"cache folder {folder} {reason}: compiled models are kept for this run only"
    warnings.warn(text, RuntimeWarning, stacklevel=3)
