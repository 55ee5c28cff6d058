"""What a user installs: the wheel, what is in it, and that it renders with the oldest versions it allows."""

import re
import subprocess
import sys
import tomllib
import zipfile
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from PIL import Image

PROJECT = Path(__file__).parents[1]
RENDER = ("render", "teapot", "--triangles", "500", "--size", "48x36", "-o")


def metadata():
    return tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def requirements():
    """Every requirement of the project and its extras, without the project's own name."""
    project = metadata()
    texts = chain(project["dependencies"], *project["optional-dependencies"].values())
    return [requirement for requirement in map(Requirement, texts) if requirement.name != project["name"]]


def lowest(requirement: Requirement) -> str:
    (bound,) = (s.version for s in requirement.specifier if s.operator == ">=")
    return f"{requirement.name}=={bound}.*"


def run(*command: object, **options) -> str:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    # A copy of what is checked in: a build leaves folders behind, and what lies about does not belong in it.
    files = run("git", "ls-files", "-z", cwd=PROJECT).split("\0")[:-1]
    for name in files:
        if (PROJECT / name).is_file():
            (folder / "source" / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / "source" / name).write_bytes((PROJECT / name).read_bytes())
    run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, folder / "source")
    (path,) = folder.glob("*.whl")
    return path


@pytest.mark.parametrize("requirement", requirements(), ids=str)
def test_every_dependency_has_both_bounds(requirement):
    assert {specifier.operator for specifier in requirement.specifier} == {">=", "<"}


def test_version_is_that_of_the_changes_and_the_citation():
    version = metadata()["version"]
    assert re.findall(r"^## ([\d.]+)", (PROJECT / "CHANGELOG.md").read_text("utf-8"), re.M)[0] == version
    assert f"\nversion: {version}\n" in (PROJECT / "CITATION.cff").read_text("utf-8")


@pytest.mark.long
def test_wheel_holds_the_packages_and_no_more(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    packages = {name.split("/")[0] for name in names}
    assert packages - {f"blysk-{metadata()['version']}.dist-info"} == {"golden", "hdl", "sim", "bench"}
    assert any(name.endswith("licenses/LICENSE") for name in names)
    unwanted = [name for name in names if re.search(r"test|\.(png|gif|vcd|obj|glb|pyc)$", name)]
    # What writes a bench to take away, and the bench.
    assert unwanted == ["sim/frames/testbench.py", "sim/frames/templates/test_pipeline.py"]
    assert wheel.stat().st_size < 1_000_000


@pytest.mark.long
@pytest.mark.skipif(
    sys.version_info >= (3, 12),
    reason="the oldest versions have wheels for the oldest Python only",
)
def test_wheel_renders_with_the_oldest_versions(wheel, tmp_path):
    """The same picture as here, from a new environment that has nothing else."""
    from blysk.sim.cli.main import main

    python = tmp_path / "environment" / "bin" / "python"
    run(sys.executable, "-m", "venv", tmp_path / "environment")
    oldest = [lowest(Requirement(text)) for text in metadata()["dependencies"]]
    run(python, "-m", "pip", "install", "-q", "--disable-pip-version-check", wheel, *oldest)
    run(python.with_name("blysk"), *RENDER, tmp_path / "old.png", cwd=tmp_path)
    assert main([*RENDER, str(tmp_path / "new.png")]) == 0
    old, new = (np.asarray(Image.open(tmp_path / name)) for name in ("old.png", "new.png"))
    np.testing.assert_array_equal(old, new)
    # The commands of the extras are there, and say what is missing.
    done = subprocess.run(
        [python.with_name("blysk"), "fpga", "--device", "gpq"], capture_output=True, text=True, cwd=tmp_path
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("blysk: fpga: ")
    assert done.stderr.endswith("pip install 'blysk[fpga]'\n")
