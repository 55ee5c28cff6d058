"""C++ compilers of this machine."""

import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from blysk.hdl.emit.processes import run_program
from blysk.sim.engines.engine import CompilerMissing
from blysk.sim.installation import install_extra

__all__ = ["Compiler", "compiler_missing", "find_compilers"]

# A model is one long function over thousands of members. GCC searches among them for redundant loads and dead
# stores. The search takes half of the compile time, and the model runs as fast without it.
_GCC_FLAGS = ("-fno-gcse", "-fno-tree-dse", "--param", "sccvn-max-alias-queries-per-access=50")
_REMEDY = f"install one, or {install_extra('native')}, or use the engine pysim"


@dataclass(frozen=True)
class Compiler:
    """An installed C++ compiler, which prints its version.

    Parameters
    ----------
    name : str
        Name for messages.
    compile, link : tuple of str
        Commands. The caller appends the input file, and ``-o`` with the output file. ``link`` is empty if
        ``compile`` makes the shared library in one step.
    identity : str
        Path (or name of the package) and version. It is a part of the key of a cached model.
    """

    name: str
    compile: tuple[str, ...]
    link: tuple[str, ...]
    identity: str


def _ask(command: list[str]) -> str | None:
    """Standard output of a command that succeeds, or ``None``."""
    try:
        done = run_program(command, capture_output=True, text=True, errors="replace", timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout if done.returncode == 0 else None


def _system_compiler(command: list[str]) -> Compiler | None:
    path = shutil.which(command[0])
    version = _ask([path, *command[1:], "--version"]) if path else None
    if version is None:
        return None
    # The build runs in another folder, so the path must be absolute.
    path = os.path.abspath(path)
    flags = _GCC_FLAGS if "Free Software Foundation" in version else ()
    own = shlex.split(os.environ.get("CXXFLAGS", ""))
    return Compiler(
        name=shlex.join(command),
        compile=(
            path,
            *command[1:],
            "-std=c++17",
            "-O2",
            *flags,
            *own,
            "-DCXXRTL_NDEBUG",
            "-fPIC",
            "-shared",
        ),
        link=(),
        identity=f"{os.path.realpath(path)} {version}",
    )


def _zig() -> Compiler | None:
    if importlib.util.find_spec("ziglang") is None:
        return None
    zig = [sys.executable, "-m", "ziglang"]
    version = _ask([*zig, "version"])
    if version is None:
        return None
    # Zig takes 40 s to compile its own C++ library on first use; a model needs no C++ library. Zig's default
    # target is this machine's processor. Machines with other processors may share the cache, so we build for
    # the baseline.
    shared = (
        ("-shared", "-nostdlib") if sys.platform != "darwin" else ("-shared", "-undefined", "dynamic_lookup")
    )
    flags = ("-std=c++17", "-O2", "-mcpu=baseline", "-fno-exceptions", "-fno-rtti", "-fPIC")
    return Compiler(
        name="ziglang",
        compile=(
            *zig,
            "c++",
            *flags,
            "-DCXXRTL_NDEBUG",
            "-DBLYSK_FREESTANDING",
            "-D_LIBCPP_VERBOSE_ABORT(...)=__builtin_abort()",
            "-c",
        ),
        link=(*zig, "cc", *shared),
        identity=f"ziglang {version}",
    )


def find_compilers() -> Iterator[Compiler]:
    """Compilers of this machine, best first: ``c++``, ``g++``, ``clang++``, ziglang.

    If ``$CXX`` is set, only this compiler is tried. The flags in ``$CXXFLAGS`` follow the optimisation flags.
    ziglang does not get them.

    Yields
    ------
    Compiler
        Each compiler that is installed and prints its version.
    """
    chosen = os.environ.get("CXX", "").strip()
    for command in [shlex.split(chosen)] if chosen else [["c++"], ["g++"], ["clang++"]]:
        compiler = _system_compiler(command)
        if compiler:
            yield compiler
    if not chosen:
        compiler = _zig()
        if compiler:
            yield compiler


def compiler_missing(failures: list[str]) -> CompilerMissing:
    """An error which says that no compiler works. It names the ``failures``, or the tried compilers."""
    chosen = os.environ.get("CXX", "").strip()
    if failures:
        reason = "; ".join(failures)
    elif chosen:
        reason = f"CXX={chosen} is not found or prints no version"
    else:
        reason = "tried c++, g++, clang++ and the package ziglang"
    return CompilerMissing(f"no working C++ compiler ({reason}): {_REMEDY}")
