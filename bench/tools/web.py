"""``blysk web``: a static site in which a browser simulates the pipeline, cycle by cycle, as WebAssembly.

The page gets all formats, addresses, models and words from the Python objects, as JSON. Data and modules are
scripts that are loaded when needed: a page from disk can load nothing else.
"""

import importlib.util
import json
import posixpath
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import click

from blysk.bench.command import resumable
from blysk.bench.report.frames import map_colors
from blysk.bench.report.page import embedded, environment
from blysk.bench.report.report import SECTIONS, about, chosen_tasks, measure_all, measured, write_report
from blysk.bench.store import Task
from blysk.bench.tools.documents import DOCUMENTS, documents
from blysk.bench.tools.pages import PROJECT
from blysk.bench.tools.web_data import (
    BACKGROUND,
    BANDS,
    COLUMNS,
    DESIGNS,
    HEIGHT,
    MESHES,
    REFERENCES,
    RIVAL,
    SERVED,
    START,
    WIDTH,
    method,
    model_table,
    module_of,
    streams_of,
    tables,
)
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.presets import LOBES, METHODS, MIRROR_LOBES, MODELS
from blysk.sim.engines.cache import version_of
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import processors
from blysk.sim.installation import install_extra
from blysk.sim.output import atomic_writer, files_within, write_json, write_text
from blysk.sim.run_files import reads
from blysk.sim.value_types import Whole

__all__ = [
    "check_folder",
    "command",
    "folders_of",
    "tasks",
    "write_site",
]


TABLES = ("blinn", "ggx")
"""Models of N·H with a table that the page's script can make."""

_MARK = "site.json"

_PAGE = "index.html"

_EXTRAS = ("ziglang", "jinja2", "markdown_it", "flip_evaluator", "skimage")


# The site.


def _missing() -> None:
    """Refuse to begin without the packages of the extra ``web``."""
    for name in _EXTRAS:
        if importlib.util.find_spec(name) is None:
            raise InputError("web", f"{name} is not installed", install_extra("web"))


def _read(name: str) -> str:
    package = __package__ if name.startswith("web/") else "blysk.bench.report"
    return resources.files(package).joinpath("templates", *name.split("/")).read_text(encoding="utf-8")


def _script(name: str, value: Any) -> str:
    """A script that hands a value to the page."""
    return f"blysk.given({embedded(name)},{embedded(value)});\n"


def _earlier(folder: Path) -> dict[str, Any] | None:
    """The mark of a folder, if this program wrote it as a site; else ``None``."""
    try:
        mark = json.loads((folder / _MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(mark, dict) or mark.get("program") != "blysk":
        return None
    names = mark.get("files")
    return mark if isinstance(names, list) and all(isinstance(name, str) for name in names) else None


def check_folder(folder: Path) -> None:
    """Check, before long work, that a site can be written into a folder; writes nothing.

    Parameters
    ----------
    folder : Path
        A folder that is new, is empty, or holds an earlier site.

    Raises
    ------
    InputError
        If it is a file, holds other files, or may not be written.
    """
    names = files_within(folder, _PAGE)
    mark = _earlier(folder)
    ours = {_MARK, *(mark["files"] if mark else ())}
    others = [name for name in names if name not in ours]
    if others:
        reason = f"holds {others[0]}, which is of no site"
        raise InputError(str(folder), reason, "give a new or empty folder, or that of an earlier site")


def _report_files(folder: Path) -> list[Path]:
    """Files of a report; `InputError` if the folder is none."""
    try:
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        names = report["files"] if report["program"] == "blysk" else []
    except (OSError, ValueError, KeyError, TypeError):
        names = []
    files = [folder / name for name in names if Path(name).name == name]
    if not files or not all(path.is_file() for path in files):
        raise InputError(f"--report {folder}", "is no report", "make one with `blysk bench FOLDER`")
    for path in files:
        reads(path)
    return files


def _answers(report: Path) -> list[dict[str, str]]:
    """Conclusions of a report: title and sentence."""
    sections = json.loads((report / "report.json").read_text(encoding="utf-8")).get("sections", {})
    return [section["conclusion"] for section in sections.values() if section.get("conclusion")]


def tasks(designs: Sequence[tuple[str, str]], views: Mapping[str, int]) -> list[Task]:
    """Tasks of a site: its modules, then its spans.

    Parameters
    ----------
    designs : sequence of (method, model)
        Designs of the modules.
    views : mapping
        Number of views by mesh.
    """
    methods = list(dict.fromkeys(method for method, _ in designs))
    found = [Task(module_of, {"method": method, "model": model}) for method, model in designs]
    found += [
        Task(streams_of, {"mesh": mesh, "view": view, "methods": methods})
        for mesh, count in views.items()
        for view in range(count)
    ]
    return found


def write_site(
    folder: Path,
    tasks: Sequence[Task],
    results: Sequence[Any],
    report: Path | None = None,
    folders: Mapping[str, Path] | None = None,
) -> None:
    """Write the site. Each file is whole or not there; files that only an earlier site has are removed.

    Parameters
    ----------
    folder : Path
        See `check_folder`.
    tasks, results : sequences
        Tasks of `tasks`, and their results.
    report : Path, optional
        Folder of a report, which becomes part of the site.
    folders : mapping of str to Path, optional
        Folders of Markdown that become part of the site: see `documents`.

    Raises
    ------
    InputError
        If a file cannot be written, or ``report`` holds no report.
    """
    check_folder(folder)
    files = {
        "style.css": _read("report.css") + _read("web/site.css"),
        "blysk.js": _read("web/core.js") + _read("web/worker.js") + _read("web/app.js"),
    }
    scripts, designs, meshes = _scripts(tasks, results)
    pages, pictures = documents(folders or {})
    files |= scripts | pages
    if report is not None:
        pictures |= {f"report/{path.name}": path for path in _report_files(report)}
    files[_PAGE] = (
        environment()
        .get_template("web/index.html")
        .render(
            site=_site(designs, meshes),
            models=[
                model
                for model in LOBES | MIRROR_LOBES | MODELS
                if any(d["model"] == model for d in designs.values())
            ],
            version=version_of("blysk"),
            documents={name: DOCUMENTS[name] for name in folders or {}},
            has_report=report is not None,
            answers=_answers(report) if report else [],
            modules=len(designs),
        )
    )
    _write(folder, files, pictures)


def _scripts(tasks: Sequence[Task], results: Sequence[Any]) -> tuple[dict[str, str], dict, dict]:
    """Scripts with the data, and the page's descriptions of designs and meshes."""
    files: dict[str, str] = {}
    designs, meshes = {}, {}
    for task, result in zip(tasks, results, strict=True):
        if task.function is module_of:
            name = "{method}-{model}".format(**task.settings)
            files[f"modules/{name}.js"] = _script(name, result)
            designs[name] = task.settings | {"bytes": result["bytes"]}
        else:
            mesh, view = task.settings["mesh"], task.settings["view"]
            names = [f"{mesh}-{view}-{number}" for number in range(len(result["data"]))]
            files |= {
                f"spans/{name}.js": _script(name, data)
                for name, data in zip(names, result["data"], strict=True)
            }
            streams = {method: [names[k] for k in numbers] for method, numbers in result["streams"].items()}
            entry = meshes.setdefault(mesh, {"title": MESHES[mesh].title, "views": []})
            entry["views"].append({"axes": result["axes"], "streams": streams})
    for model in dict.fromkeys([*(design["model"] for design in designs.values()), "blinn"]):
        files[f"models/{model}.js"] = _script(f"model-{model}", model_table(model))
    return files, designs, meshes


def _site(designs: Mapping[str, Mapping[str, Any]], meshes: Mapping[str, Any]) -> dict[str, Any]:
    """Values that the page reads at its start."""
    first = next(iter(designs.values()))
    rivals = [design["model"] for design in designs.values() if design["method"] == RIVAL]
    start = START | {"mesh": next(iter(meshes)), "method": first["method"], "model": first["model"]}
    if any(START["method"] == d["method"] and START["model"] == d["model"] for d in designs.values()):
        start |= {"method": START["method"], "model": START["model"]}
    if START["mesh"] in meshes:
        start |= {"mesh": START["mesh"]}
    return {
        "width": WIDTH,
        "height": HEIGHT,
        "bands": BANDS,
        "columns": COLUMNS,
        "tables": tables(),
        "background": BACKGROUND,
        "start": start,
        "references": REFERENCES,
        "designs": designs,
        "meshes": meshes,
        "methods": {name: method(name) for name in dict.fromkeys(d["method"] for d in designs.values())},
        "errorMap": {"colors": map_colors()},
        "rival": RIVAL if rivals else None,
        "rivalModel": rivals[0] if rivals else None,
        "mostExponent": MAX_EXPONENT,
        "rough": ["ggx"],
        "mirrored": [*MIRROR_LOBES],
    }


def _write(folder: Path, files: Mapping[str, str], copies: Mapping[str, Path]) -> None:
    """Write texts and copies of files, the page last, and remove the other files of an earlier site."""
    earlier = _earlier(folder) or {"files": []}
    everything = [*files, *copies]
    folder.mkdir(exist_ok=True)
    # First: it tells that the folder is ours, whatever comes between.
    known = list(dict.fromkeys([*everything, *earlier["files"]]))
    write_json(folder / _MARK, {"program": "blysk", "version": version_of("blysk"), "files": known})
    for name in sorted({posixpath.dirname(name) for name in everything} - {""}):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for name, path in copies.items():
        with atomic_writer(folder / name) as temporary:
            shutil.copyfile(path, temporary)
    for name, text in files.items():
        write_text(folder / name, text)
    for name in set(earlier["files"]) - set(everything):
        if ".." not in Path(name).parts and not Path(name).is_absolute():
            (folder / name).unlink(missing_ok=True)
    write_json(folder / _MARK, {"program": "blysk", "version": version_of("blysk"), "files": everything})


def folders_of(pages: Path | None) -> dict[str, Path]:
    """Existing folders of Markdown: documents of the project, and pages of the units.

    Parameters
    ----------
    pages : Path, optional
        Folder that ``blysk pages`` wrote; ``None``: the project's folder, if there is one.

    Raises
    ------
    InputError
        If the folder has no pages.
    """
    if pages is not None and not (pages / "README.md").is_file():
        raise InputError(f"--pages {pages}", "holds no pages of units", "make them with `blysk pages FOLDER`")
    docs = PROJECT / "docs"
    folders = {"guide": docs / "guide", "theory": docs / "theory", "blocks": pages or docs / "blocks"}
    return {name: path for name, path in folders.items() if any(path.glob("*.md"))}


# The command.


class _Design(click.ParamType):
    """Type of an option: a method and a model with a stroke between them."""

    name = "METHOD/MODEL"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        method, _, model = value.partition("/")
        if method not in SERVED:
            raise InputError(f"--design {value}", "unknown method", f"use one of {', '.join(SERVED)}")
        served = (*TABLES, *MIRROR_LOBES) if METHODS[method].TAKES_VECTORS else (*MODELS, *TABLES)
        if model not in served:
            raise InputError(f"--design {value}", "unknown model", f"use one of {', '.join(served)}")
        return method, model


@click.command()
@click.option(
    "-o",
    "--output",
    "folder",
    type=click.Path(path_type=Path),
    default="site",
    show_default=True,
    help="Folder of the site; it is made, or an earlier site in it replaced.",
)
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="A report by `blysk bench`, in place of the quick one that is measured for the site.",
)
@click.option(
    "--pages",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Pages of the units by `blysk pages`.  [default: docs/blocks of the project, if it is there]",
)
@click.option(
    "--design",
    "designs",
    type=_Design(),
    multiple=True,
    help=f"A module of this method and model alone; repeat for more.  [default: {len(DESIGNS)} of them]",
)
@click.option(
    "--jobs",
    type=Whole(1, 64),
    default=processors,
    show_default="number of cores",
    help="Processes that compile.",
)
def command(folder, report, pages, designs, jobs):
    """Write a static site: the pipeline as WebAssembly, simulated live while the light is moved.

    The page index.html opens from disk and from any web server, and loads only files of the site. The site
    also has the report of error against run time, guide and theory, and the pages of the units. The first
    time takes some minutes; modules, spans and measurements are kept in the cache, and made again after the
    code has changed.

    \b
    Example:
        blysk web -o site
        blysk web -o site --report report
    """
    check_folder(folder)
    folders = folders_of(pages)
    if report is not None:
        _report_files(report)
    _missing()
    work = tasks(designs or DESIGNS, {name: body.views for name, body in MESHES.items()})
    chosen = chosen_tasks(quick=True) if report is None else []
    total = len(work) + sum(len(own) for _, own in chosen)
    with resumable(total, "parts") as count, tempfile.TemporaryDirectory(prefix="blysk-") as temporary:
        results = measure_all(work, jobs, count)
        if report is None:
            report = Path(temporary, "report")
            write_report(report, measured(chosen, jobs, count), about(True, (), list(SECTIONS)))
        write_site(folder, work, results, report, folders)
    click.echo(f"{'site':<12}{folder / _PAGE}")
