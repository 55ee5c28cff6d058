"""Folders that a site is made from and written into, checked before long work."""

import importlib.util
import json
from pathlib import Path
from typing import Any

from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra
from blysk.sim.output import files_within

__all__ = ["MARK", "PAGE", "check_extras", "check_folder", "docs_files", "earlier", "report_files"]

MARK, PAGE = "site.json", "index.html"
"""Two files of a site: the mark and the first page. The mark tells that this program wrote the site."""

_EXTRAS = ("ziglang", "jinja2", "markdown_it", "flip_evaluator", "skimage")


def docs_files(folder: Path) -> dict[str, Path]:
    """Files of documents, by their places. `InputError` if the folder has no documents."""
    if not (folder / "live.js").is_file() or not (folder / "latest" / PAGE).is_file():
        raise InputError(
            f"--docs {folder}", "holds no documents", "make them with `make docs`, in build/docs"
        )
    return {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if path.is_file()}


def check_extras() -> None:
    """Refuse to begin without the packages of the extra ``web``."""
    for name in _EXTRAS:
        if importlib.util.find_spec(name) is None:
            raise InputError("web", f"{name} is not installed", install_extra("web"))


def earlier(folder: Path) -> dict[str, Any] | None:
    """The mark of a folder if this program wrote it as a site, else ``None``."""
    try:
        mark = json.loads((folder / MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(mark, dict) or mark.get("program") != "blysk":
        return None
    names = mark.get("files")
    return mark if isinstance(names, list) and all(isinstance(name, str) for name in names) else None


def check_folder(folder: Path) -> None:
    """Check, before long work, that a site can be written into a folder. The check writes nothing.

    Parameters
    ----------
    folder : Path
        A folder that is new, is empty, or holds an earlier site.

    Raises
    ------
    InputError
        If the folder is a file, holds other files, or may not be written.
    """
    names = files_within(folder, PAGE)
    mark = earlier(folder)
    ours = {MARK, *(mark["files"] if mark else ())}
    others = [name for name in names if name not in ours]
    if others:
        reason = f"holds {others[0]}, which is not part of a site"
        raise InputError(str(folder), reason, "give a new or empty folder, or an earlier site's folder")


def report_files(folder: Path) -> list[Path]:
    """Files of a report. `InputError` if the folder is no report."""
    try:
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        names = report["files"] if report["program"] == "blysk" else []
    except (OSError, ValueError, KeyError, TypeError):
        names = []
    files = [folder / name for name in names if Path(name).name == name]
    if not files or not all(path.is_file() for path in files):
        raise InputError(f"--report {folder}", "is not a report", "make one with `blysk bench FOLDER`")
    return files
