"""``blysk web``: a static site in which a browser simulates the pipeline, cycle by cycle, as WebAssembly.

The page gets all formats, addresses, models and words from the Python objects, as JSON. Data and modules are
scripts that are loaded when needed, because a page from disk can load nothing else.
"""

import json
import posixpath
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from blysk.bench.command import resumable
from blysk.bench.report.frames import map_colors
from blysk.bench.report.page import embedded, environment
from blysk.bench.report.report import about, chosen_tasks, measure_all, measured, write_report
from blysk.bench.report.sections import SECTIONS
from blysk.bench.store import Task
from blysk.bench.web.web_data import (
    BACKGROUND,
    BANDS,
    HEIGHT,
    REFERENCES,
    RIVAL,
    START,
    WIDTH,
    method,
    model_table,
    module_of,
    streams_of,
    tables,
    texture_of,
)
from blysk.bench.web.web_designs import COLORED, DESIGNS
from blysk.bench.web.web_folder import MARK, PAGE, check_folder, docs_files, earlier, report_files
from blysk.bench.web.web_meshes import MESHES
from blysk.bench.web.web_spans import COLUMNS
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.presets import LOBES, MIRROR_LOBES, MODELS
from blysk.sim.engines.cache import version_of
from blysk.sim.output import atomic_writer, write_json, write_text

__all__ = ["DOCUMENTS", "LIVE", "make_site", "tasks", "write_site"]

DOCUMENTS = {
    "docs/latest/guide/index.html": ("Guide", "how to use and to embed it, and its words"),
    "docs/latest/api/index.html": ("Python", "functions and classes, with their options"),
    "docs/latest/theory/index.html": ("Theory", "models, methods, error bounds, sources"),
    "docs/latest/blocks/index.html": ("Units", "equations, formats, structure, timing and errors of each"),
    "docs/latest/boards/index.html": ("Boards", "bitstreams, and what you should see"),
}
"""First pages of documents that a site may have: title, and contents."""

LIVE = """\
// Adds the live page of this site to the list of a page.
{
  const link = document.createElement("a");
  link.className = "reference";
  link.href = new URL("../index.html", document.currentScript.src);
  link.textContent = "Live page";
  document.getElementById("live").appendChild(document.createElement("li")).appendChild(link);
}
"""
"""A script that every page of the documents loads."""

# The site.


def _read(name: str) -> str:
    package = __package__ if name.startswith("web/") else "blysk.bench.report"
    return resources.files(package).joinpath("templates", *name.split("/")).read_text(encoding="utf-8")


def _script(name: str, value: Any) -> str:
    """A script that hands a value to the page."""
    return f"blysk.given({embedded(name)},{embedded(value)});\n"


def _answers(report: Path) -> list[dict[str, str]]:
    """Conclusions of a report: title and sentence."""
    sections = json.loads((report / "report.json").read_text(encoding="utf-8")).get("sections", {})
    return [section["conclusion"] for section in sections.values() if section.get("conclusion")]


def tasks(designs: Sequence[tuple[str, str]], views: Mapping[str, int]) -> list[Task]:
    """Tasks of a site: its modules, then its spans.

    If `COLORED` is among the designs, there is also its module with an albedo. Otherwise meshes that need an
    albedo are left out.

    Parameters
    ----------
    designs : sequence of (method, model)
        Designs of the modules.
    views : mapping
        Number of views by mesh.
    """
    colored = [pair for pair in designs if pair == COLORED]
    settings = [{"method": method, "model": model} for method, model in designs]
    settings += [{"method": method, "model": model, "albedo": True} for method, model in colored]
    found = [Task(module_of, of) for of in settings]
    for mesh, count in views.items():
        served = colored if MESHES[mesh].albedo else designs
        methods = list(dict.fromkeys(method for method, _ in served))
        found += [
            Task(streams_of, {"mesh": mesh, "view": view, "methods": methods})
            for view in range(count if methods else 0)
        ]
    return found


def write_site(
    folder: Path,
    tasks: Sequence[Task],
    results: Sequence[Any],
    report: Path | None = None,
    docs: Path | None = None,
) -> None:
    """Write the site. Each file is whole or not there. Files that only an earlier site has are removed.

    Parameters
    ----------
    folder : Path
        See `check_folder`.
    tasks, results : sequences
        Tasks of `tasks`, and their results.
    report : Path, optional
        Folder of a report, which becomes part of the site.
    docs : Path, optional
        Folder of ``make docs``, which becomes part of the site.

    Raises
    ------
    InputError
        If a file cannot be written, ``report`` holds no report, or ``docs`` no documents.
    """
    check_folder(folder)
    files = {
        "style.css": _read("report.css") + _read("web/site.css"),
        "blysk.js": _read("web/core.js") + _read("web/worker.js") + _read("web/app.js"),
    }
    scripts, designs, meshes = _scripts(tasks, results)
    files |= scripts
    copies = {} if report is None else {f"report/{path.name}": path for path in report_files(report)}
    if docs is not None:
        copies |= {f"docs/{name}": path for name, path in docs_files(docs).items()}
        # In the documents alone this script does nothing.
        del copies["docs/live.js"]
        files["docs/live.js"] = LIVE
    files[PAGE] = (
        environment(__package__)
        .get_template("web/index.html")
        .render(
            site=_site(designs, meshes),
            models=[
                model
                for model in LOBES | MIRROR_LOBES | MODELS
                if any(d["model"] == model for d in designs.values())
            ],
            version=version_of("blysk"),
            documents={place: of for place, of in DOCUMENTS.items() if place in copies},
            has_report=report is not None,
            answers=_answers(report) if report else [],
            modules=len(designs),
            colored=any(mesh["albedo"] for mesh in meshes.values()),
        )
    )
    _write(folder, files, copies)


def _scripts(tasks: Sequence[Task], results: Sequence[Any]) -> tuple[dict[str, str], dict, dict]:
    """Scripts with the data, and the page's descriptions of designs and meshes."""
    files: dict[str, str] = {}
    designs, meshes = {}, {}
    for task, result in zip(tasks, results, strict=True):
        if task.function is module_of:
            settings = {"albedo": False} | task.settings
            name = "{method}-{model}".format(**settings) + ("-albedo" if settings["albedo"] else "")
            files[f"modules/{name}.js"] = _script(name, result)
            designs[name] = settings | {"bytes": result["bytes"]}
        else:
            mesh, view = task.settings["mesh"], task.settings["view"]
            names = [f"{mesh}-{view}-{number}" for number in range(len(result["data"]))]
            files |= {
                f"spans/{name}.js": _script(name, data)
                for name, data in zip(names, result["data"], strict=True)
            }
            streams = {method: [names[k] for k in numbers] for method, numbers in result["streams"].items()}
            body = MESHES[mesh]
            entry = meshes.setdefault(
                mesh, {"title": body.title, "text": body.text, "albedo": body.albedo, "views": []}
            )
            entry["views"].append({"axes": result["axes"], "streams": streams})
    for mesh, entry in meshes.items():
        if entry["albedo"]:
            files[f"textures/{mesh}.js"] = _script(f"texture-{mesh}", texture_of(mesh))
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
    before = (earlier(folder) or {"files": []})["files"]
    everything = [*files, *copies]
    folder.mkdir(exist_ok=True)
    # This file is written first. It marks the folder as a site's folder, even after an interrupt.
    known = list(dict.fromkeys([*everything, *before]))
    write_json(folder / MARK, {"program": "blysk", "version": version_of("blysk"), "files": known})
    for name in sorted({posixpath.dirname(name) for name in everything} - {""}):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for name, path in copies.items():
        with atomic_writer(folder / name) as temporary:
            shutil.copyfile(path, temporary)
    for name, text in files.items():
        write_text(folder / name, text)
    for name in set(before) - set(everything):
        if ".." not in Path(name).parts and not Path(name).is_absolute():
            (folder / name).unlink(missing_ok=True)
    write_json(folder / MARK, {"program": "blysk", "version": version_of("blysk"), "files": everything})


def make_site(
    folder: Path,
    report: Path | None,
    docs: Path | None,
    designs: Sequence[tuple[str, str]],
    jobs: int,
) -> None:
    """Make the parts of a site, and write the site.

    Parameters
    ----------
    folder, report, docs
        As in `write_site`. Without a report a quick report is measured.
    designs : sequence of (method, model)
        Designs of the modules. `DESIGNS` if empty.
    jobs : int
        Number of processes.

    Raises
    ------
    InputError
        As in `write_site`.
    """
    work = tasks(designs or DESIGNS, {name: body.views for name, body in MESHES.items()})
    chosen = chosen_tasks(quick=True) if report is None else []
    total = len(work) + sum(len(own) for _, own in chosen)
    with resumable(total, "parts") as count, tempfile.TemporaryDirectory(prefix="blysk-") as temporary:
        results = measure_all(work, jobs, count)
        if report is None:
            report = Path(temporary, "report")
            write_report(report, measured(chosen, jobs, count), about(True, (), list(SECTIONS)))
        write_site(folder, work, results, report, docs)
