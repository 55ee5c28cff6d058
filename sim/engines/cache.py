"""Cache folders of the compiled models and of the started tools; the version of the code."""

import atexit
import functools
import hashlib
import os
import shutil
import tempfile
import warnings
from importlib import import_module
from pathlib import Path

import platformdirs

from blysk.sim.errors import InputError

__all__ = [
    "cache_folder",
    "code_version",
    "private_folder",
    "provide_caches",
    "version_of",
    "warn_of_cache",
]


def _unsafe(folder: Path) -> str | None:
    """Reason not to load a model from a folder. ``None`` if a model may be loaded."""
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
    """A temporary folder of this process, removed when the process ends.

    Raises
    ------
    InputError
        If no temporary folder can be written.
    """
    try:
        folder = Path(tempfile.mkdtemp(prefix="blysk-"))
    except OSError as error:
        remedy = "free some space there, or name another folder in TMPDIR"
        raise InputError("the temporary folder", f"cannot be used ({error.strerror})", remedy) from error
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _unwritable(folder: Path) -> str | None:
    """Reason why no file can be made in a folder, or ``None``.

    A file is made as a trial, because permission bits do not bind root.
    """
    try:
        os.rmdir(tempfile.mkdtemp(prefix=".blysk-", dir=folder))
    except OSError as error:
        return error.strerror
    return None


@functools.cache
def provide_caches() -> None:
    """Give the started tools a private cache folder, if the user's cache folder cannot be written.

    Yosys (as WebAssembly), nextpnr, Zig and Matplotlib each have a cache below the user's cache or home
    folder. Some tools end with an error if their cache cannot be written. The private folder is set in
    environment variables, once in a process: in ``XDG_CACHE_HOME``, and in a tool's own variable if it is
    unset. A warning says that models and tools are compiled again. If only the home folder cannot be written,
    Matplotlib alone gets the private folder, without a warning.

    Raises
    ------
    InputError
        If the temporary folder cannot be used either.
    """
    folder = Path("of the user")
    try:
        folder, home = Path(platformdirs.user_cache_path()), Path.home()
        no_home = _unwritable(home)
        # A home folder that does not exist is not made.
        if no_home is None or not folder.is_relative_to(home):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        reason = _unwritable(folder)
    # No HOME, and no entry of the user in the password database.
    except RuntimeError:
        reason = no_home = "there is no home folder"
    except OSError as error:
        reason = error.strerror
    if reason is not None:
        private = private_folder()
        os.environ["XDG_CACHE_HOME"] = str(private)
        os.environ.setdefault("YOWASP_CACHE_DIR", str(private / "YoWASP"))
        os.environ.setdefault("ZIG_GLOBAL_CACHE_DIR", str(private / "zig"))
        text = f"cache folder {folder} cannot be written ({reason}): models and tools are compiled again"
        remedy = "set XDG_CACHE_HOME to a folder that can be written"
        warnings.warn(f"{text}; {remedy}", RuntimeWarning, stacklevel=3)
    if reason is not None or no_home is not None:
        os.environ.setdefault("MPLCONFIGDIR", str(private_folder() / "matplotlib"))


def cache_folder() -> Path:
    """Folder of the compiled models, ``$BLYSK_CACHE``, or the user's cache folder.

    A model is code that is executed. So a folder is not used if it belongs to another user, if other users
    can write to it, or if it cannot be made or written. A warning says so, and a private temporary folder
    keeps the models until the process ends.

    Returns
    -------
    Path
        An existing folder.
    """
    provide_caches()
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


def version_of(package: str) -> str | None:
    """Version of a package, without importing it; ``None`` if it is not installed."""
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


@functools.cache
def code_version(*libraries: str) -> str:
    """Hash of the files of `golden`, `hdl` and `sim` and of the versions of the installed ``libraries``."""
    installed = {name: version for name in libraries if (version := version_of(name))}
    digest = hashlib.sha256(repr(installed).encode())
    for package in ("golden", "hdl", "sim"):
        for path in sorted(Path(import_module(f"blysk.{package}").__path__[0]).rglob("*.*")):
            if "__pycache__" not in path.parts:
                digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
