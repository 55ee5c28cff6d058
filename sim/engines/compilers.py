"""C++ compilers of this machine."""

import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from blysk.sim.engines.engine import CompilerMissing

__all__ = ["Compiler", "compiler_missing", "find_compilers"]

# A model is one long function over thousands of members: where GCC looks for redundant loads and dead stores
# among them takes half of the time, and finds so few that the model runs as fast without.
_GCC_FLAGS = ("-fno-gcse", "-fno-tree-dse", "--param", "sccvn-max-alias-queries-per-access=50")
_REMEDY = "install one, or pip install 'blysk[native]', or use the engine pysim"


@dataclass(frozen=True)
class Compiler:
    """A C++ compiler that answers.

    Parameters
    ----------
    name : str
        What a message calls it.
    compile, link : tuple of str
        Commands, to which the source and ``-o`` the result are added. ``link`` is empty when ``compile``
        makes the shared library at once.
    identity : str
        Path and version: what a cached model depends on.
    """

    name: str
    compile: tuple[str, ...]
    link: tuple[str, ...]
    identity: str


def _ask(command: list[str]) -> str | None:
    """Standard output of a command that succeeds, or ``None``."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout if done.returncode == 0 else None


def _system_compiler(command: list[str]) -> Compiler | None:
    path = shutil.which(command[0])
    version = _ask([path, *command[1:], "--version"]) if path else None
    if version is None:
        return None
    path = os.path.abspath(path)  # The build runs elsewhere.
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
    # Zig compiles its own C++ library for 40 s on first use; a model does without one. Zig's default is the
    # processor at hand; a cache may be shared by several.
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
    """Compilers of this machine, best first: ``c++``, ``g++``, ``clang++``, ziglang; ``$CXX`` alone if set.

    But for ziglang the flags in ``$CXXFLAGS`` follow ours.

    Yields
    ------
    Compiler
        Each that is there and prints its version.
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
    """The error that no compiler works, with what each one says."""
    chosen = os.environ.get("CXX", "").strip()
    if failures:
        reason = "; ".join(failures)
    elif chosen:
        reason = f"CXX={chosen} is not found or prints no version"
    else:
        reason = "tried c++, g++, clang++ and the package ziglang"
    return CompilerMissing(f"no working C++ compiler ({reason}): {_REMEDY}")
