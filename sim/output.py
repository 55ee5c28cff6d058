"""Output files, written whole or not at all."""

import errno
import json
import math
import os
import secrets
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from blysk.sim.errors import InputError
from blysk.sim.run_files import writes

__all__ = [
    "all_or_none",
    "atomic_writer",
    "check_new_folder",
    "check_writable",
    "files_within",
    "plain",
    "write_folder",
    "write_json",
    "write_text",
]

# Files that wait for the end of `all_or_none`: path as given, temporary file, target.
_PENDING: ContextVar[list[tuple[Path, Path, Path]] | None] = ContextVar("pending", default=None)
_REASONS = {
    errno.ENOSPC: ("the disk is full", "free some space or choose another disk"),
    errno.EDQUOT: ("your disk quota is used up", "free some space or choose another disk"),
    errno.EROFS: ("the file system is read-only", "choose another folder"),
    errno.ENOENT: ("its folder takes no files", "choose another folder"),
    errno.EACCES: ("permission denied", "choose a folder that you may write to"),
    errno.EPERM: ("permission denied", "choose a folder that you may write to"),
    errno.ENAMETOOLONG: ("the name is too long", "choose a shorter name"),
    errno.EISDIR: ("it is a folder", "give the name of a file"),
}


def _unwritable(path: Path, error: OSError) -> InputError:
    reason = error.strerror or str(error)
    reason, remedy = _REASONS.get(error.errno, (reason, "choose another file"))
    return InputError(str(path), f"cannot be written, {reason}", remedy)


def check_writable(path: str | os.PathLike) -> None:
    """Check, before long work, that a file can be written. The check leaves nothing behind.

    A temporary file is made in the folder and removed. Permissions alone do not show that a file system is
    read-only or takes no files, and they do not restrict the superuser.

    Parameters
    ----------
    path : path
        The output file. It may exist.

    Raises
    ------
    InputError
        - The parent is missing, is no folder, or may not be written.
        - The path is a folder, or a file that may not be written.
        - The path is a file that the run reads (see `RunFiles`).
    """
    writes(path)
    path = Path(path)
    parent = path.parent
    try:
        if path.is_dir():
            raise InputError(str(path), "cannot be written, it is a folder", "give the name of a file")
        if not parent.exists():
            raise InputError(
                str(path), f"cannot be written, there is no folder {parent}", "make the folder first"
            )
        if not parent.is_dir():
            raise InputError(
                str(path), f"cannot be written, {parent} is not a folder", "choose another folder"
            )
        for target in (parent, path):
            if target.exists() and not os.access(target, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        if path.is_file() or not path.exists():
            handle, name = tempfile.mkstemp(prefix=".blysk-", dir=parent)
            os.close(handle)
            os.unlink(name)
    except OSError as error:
        raise _unwritable(path, error) from error


def files_within(folder: str | os.PathLike, first: str) -> list[str]:
    """Check, before long work, that files can be written into a folder, and list the files in it.

    Parameters
    ----------
    folder : path
        The output folder. It may exist.
    first : str
        Name of a file that will be written.

    Returns
    -------
    list of str
        Names of the files in the folder at any depth, in order, without hidden files. Empty if there is no
        folder yet.

    Raises
    ------
    InputError
        If the folder is a file, or the folder or ``first`` may not be written.
    """
    folder = Path(folder)
    if not folder.exists():
        check_writable(folder)
        return []
    if not folder.is_dir():
        raise InputError(str(folder), "it is a file", "give the name of a folder")
    check_writable(folder / first)
    return [
        path.relative_to(folder).as_posix()
        for path in sorted(folder.rglob("*"))
        if not path.is_dir() and not path.name.startswith(".")
    ]


def check_new_folder(folder: str | os.PathLike, first: str) -> None:
    """Check, before long work, that `write_folder` can write a folder. The check writes nothing.

    Parameters
    ----------
    folder : path
        A new or an empty folder.
    first : str
        Name of a file that will be written.

    Raises
    ------
    InputError
        If the folder is a file, holds files, or may not be made or written.
    """
    if names := files_within(folder, first):
        raise InputError(str(folder), f"holds {names[0]} already", "give a new or empty folder")


def write_folder(folder: str | os.PathLike, files: Mapping[str, str]) -> None:
    """Write texts into a folder: all of them, or none. Folders that an error leaves empty are removed.

    Parameters
    ----------
    folder : path
        A new or an empty folder, see `check_new_folder`.
    files : mapping of str to str
        Texts by path in the folder.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    made: list[Path] = []
    fresh = [path for name in files if not (path := Path(folder) / name).exists()]
    try:
        with all_or_none():
            for name, text in files.items():
                path = Path(folder) / name
                for parent in reversed([path.parent, *path.parent.parents]):
                    if not parent.exists():
                        parent.mkdir()
                        made.append(parent)
                write_text(path, text)
    except BaseException as error:
        for path in fresh:
            with suppress(OSError):
                path.unlink()
        for parent in reversed(made):
            with suppress(OSError):
                parent.rmdir()
        if isinstance(error, OSError):
            raise _unwritable(Path(folder), error) from error
        raise


@contextmanager
def atomic_writer(path: str | os.PathLike) -> Iterator[Path]:
    """Path of a temporary file that is renamed to ``path`` when the block ends without an error.

    Within `all_or_none` the file is renamed when the outer block ends. Until then an older file at ``path``
    stays unchanged. An exception in the block (an interrupt, too) removes the temporary file. The new file
    has the permissions of the file that it replaces. If there is no older file, the umask gives the
    permissions. If ``path`` is a link, its target is replaced. If ``path`` is no regular file
    (``/dev/stdout``, a pipe), ``path`` itself is yielded, and written directly.

    Parameters
    ----------
    path : path
        The output file.

    Yields
    ------
    Path
        An empty file in the same folder, with the same suffix, to write to.

    Raises
    ------
    InputError
        If the file cannot be written. An `OSError` that the block raises about the temporary file, as on a
        full disk, becomes an `InputError` too.
    """
    path = Path(path)
    check_writable(path)
    if path.exists() and not path.is_file():
        try:
            yield path
        except OSError as error:
            raise _unwritable(path, error) from error
        return
    target = Path(os.path.realpath(path))
    kept = False
    temporary = target.with_name(f".{target.stem[:100]}-{secrets.token_hex(8)}{target.suffix}")
    try:
        # The umask limits the mode, as for any new file.
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o777)
        yield temporary
        pending = _PENDING.get()
        if pending is None:
            os.replace(temporary, target)
        else:
            pending.append((path, temporary, target))
            kept = True
    except OSError as error:
        # Errors of the block about other files pass unchanged.
        if error.filename is not None and Path(error.filename) not in (temporary, target):
            raise
        raise _unwritable(path, error) from error
    finally:
        if not kept:
            temporary.unlink(missing_ok=True)


@contextmanager
def all_or_none() -> Iterator[None]:
    """All files of `atomic_writer` in the block take their names together, when the block ends.

    If the block ends with an error, no new file is left, and older files stay unchanged. Paths that are no
    regular files are written at once.

    Raises
    ------
    InputError
        If a file cannot take its name.
    """
    pending: list[tuple[Path, Path, Path]] = []
    token = _PENDING.set(pending)
    try:
        yield
        for path, temporary, target in pending:
            try:
                os.replace(temporary, target)
            except OSError as error:
                raise _unwritable(path, error) from error
    finally:
        _PENDING.reset(token)
        for _, temporary, _ in pending:
            temporary.unlink(missing_ok=True)


def write_text(path: str | os.PathLike, text: str) -> None:
    """Write a text in UTF-8 with Unix line ends, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with atomic_writer(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_json(path: str | os.PathLike, value: Any) -> None:
    """Write a value as JSON, whole or not at all. Lines are indented by two, and keys keep their order.

    JSON has no NaN and no infinity, so both are written as ``null``. NumPy scalars and arrays are written as
    numbers and lists.

    Raises
    ------
    InputError
        If the file cannot be written.
    TypeError
        If the value holds an object that has no form in JSON.
    """
    write_text(path, json.dumps(plain(value), indent=2, allow_nan=False, ensure_ascii=False) + "\n")


def plain(value: Any) -> Any:
    """A value as `write_json` writes it: dictionaries, lists, texts, finite numbers, ``None``."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
