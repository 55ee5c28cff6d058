"""The installation of a user: the wheel of the source archive, its contents, an environment without a
compiler, and renders with the oldest versions that it allows."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.metadata import Distribution, distribution, entry_points
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from PIL import Image

import blysk

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


def committed():
    """Names of the committed files that are still there."""
    files = run("git", "ls-files", "-z", cwd=PROJECT).split("\0")[:-1]
    return [name for name in files if (PROJECT / name).is_file()]


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A copy of the committed files, because a build leaves folders behind, and other files do not belong in
    the wheel."""
    folder = tmp_path_factory.mktemp("source")
    for name in committed():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(PROJECT / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def archives(source, tmp_path_factory):
    """Folder with the source archive, and the wheel that was built from the unpacked archive."""
    pytest.importorskip("build", reason="build is not installed")
    folder = tmp_path_factory.mktemp("archives")
    run(sys.executable, "-m", "build", "--no-isolation", "-o", folder, source)
    return folder


@pytest.fixture(scope="module")
def wheel(archives):
    (path,) = archives.glob("*.whl")
    return path


@pytest.mark.parametrize("requirement", requirements(), ids=str)
def test_every_dependency_has_both_bounds(requirement):
    assert {specifier.operator for specifier in requirement.specifier} == {">=", "<"}


def test_version_is_that_of_the_changes_and_the_citation():
    version = metadata()["version"]
    assert re.findall(r"^## ([\d.]+)", (PROJECT / "CHANGELOG.md").read_text("utf-8"), re.M)[0] == version
    assert f"\nversion: {version}\n" in (PROJECT / "CITATION.cff").read_text("utf-8")


@pytest.mark.ci
@pytest.mark.long
def test_wheel_holds_the_packages_and_no_more(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names, largest = archive.namelist(), max(file.compress_size for file in archive.infolist())
    packages = {name.split("/")[0] for name in names}
    assert packages - {f"blysk-{metadata()['version']}.dist-info"} == {"blysk"}
    assert "blysk/py.typed" in names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    unwanted = [name for name in names if re.search(r"/(test|conftest)|\.(png|gif|vcd|obj|glb|pyc)$", name)]
    # The writer of the bench to take away, and the bench.
    assert unwanted == ["blysk/sim/frames/testbench.py", "blysk/sim/frames/templates/test_core.py"]
    # Only sources; data would be larger.
    assert largest < 32_000
    # Every file that is no module, and that a command may read.
    layers = ("blysk", "golden", "hdl", "sim", "bench")
    data = {name for name in committed() if name.startswith(layers) and not name.endswith(".py")}
    data = {name for name in data if not name.startswith("bench/quality/")}
    assert len(data) > 10
    assert {f"blysk/{name}".replace("blysk/blysk/", "blysk/") for name in data} - set(names) == set()


@pytest.mark.ci
@pytest.mark.long
def test_source_archive_has_every_file_and_makes_the_same_wheel(source, archives, wheel, tmp_path):
    """The wheel of the archive equals a wheel of the clone."""
    (archive,) = archives.glob("*.tar.gz")
    with tarfile.open(archive) as files:
        names = {name.partition("/")[2] for name in files.getnames()}
    assert set(committed()) - names == set()
    added = {name.split("/")[0] for name in names - set(committed())} - {
        name.split("/")[0] for name in committed()
    }
    assert added <= {"", "PKG-INFO", "setup.cfg", "blysk.egg-info"}
    run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", tmp_path, source)
    (other,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as one, zipfile.ZipFile(other) as two:
        assert {name: one.read(name) for name in one.namelist()} == {
            name: two.read(name) for name in two.namelist()
        }


def required() -> dict[str, Distribution]:
    """What pip installs with the wheel and without an extra, by name, as this environment has it."""
    found: dict[str, Distribution] = {}
    asked = [Requirement(text) for text in metadata()["dependencies"]]
    while asked:
        one = asked.pop()
        name = canonicalize_name(one.name)
        extras = ("", *one.extras)
        wanted = one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in extras)
        if wanted and name not in found:
            found[name] = distribution(name)
            asked += map(Requirement, found[name].requires or ())
    return found


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Python of a new environment without pip, which has the wheel and its libraries.

    The libraries are links to those of this environment: what the wheel requires, and what this requires. So
    neither extras, such as the compiler of ``native``, nor this checkout are there.
    """
    folder = tmp_path_factory.mktemp("installed")
    run(sys.executable, "-m", "venv", "--without-pip", folder)
    python = folder / "bin" / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index", wheel)
    (site,) = folder.glob("lib/python*/site-packages")
    for of in required().values():
        for top in {file.parts[0] for file in of.files or ()} - {"..", "__pycache__"}:
            if not (site / top).is_symlink():
                (site / top).symlink_to(of.locate_file(top))
    return python


_TABLE = """
from blysk.bench.units.registry import RECORDS
for name in RECORDS.keys() - {"dot_product"}:
    del RECORDS[name]
from blysk.sim.cli.main import main
raise SystemExit(main())
"""

_UNIT = """
import blysk
from blysk.hdl.emit.verilog import emit
from blysk.bench.units.registry import RECORDS
print(blysk.__file__)
record = RECORDS["dot_product"]
print(emit(record.variants[record.default].unit(), "unit").partition("module")[2])
"""


@pytest.mark.ci
@pytest.mark.long
def test_wheel_in_a_project_with_packages_of_the_same_names(installed, tmp_path):
    """A render, a Verilog file, the table of units and a unit work beside a project's own hdl, sim and
    bench."""
    for name in ("golden", "hdl", "sim", "bench", "tests"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('this is the project of a user')\n")
    run(installed.with_name("blysk"), *RENDER, "a.png", cwd=tmp_path)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (48, 36)
    assert "\nmodule core (" in run(installed, "-m", "blysk", "verilog", "--name", "core", cwd=tmp_path)
    # The table of all units takes minutes.
    table = run(installed, "-c", _TABLE, "blocks", "--samples", "1000", "--jobs", "1", cwd=tmp_path)
    assert "dot_product" in table
    where, _, verilog = run(installed, "-c", _UNIT, cwd=tmp_path).partition("\n")
    assert Path(where).is_relative_to(installed.parents[1])
    assert "endmodule" in verilog


_BARE = """
import importlib.util
import blysk
print(blysk.__file__, importlib.util.find_spec("ziglang"))
"""


@pytest.mark.ci
@pytest.mark.long
def test_wheel_on_a_bare_machine(installed, tmp_path):
    """Without a compiler, a source tree and a cache. The picture is that of the compiled engine."""
    program, home = installed.with_name("blysk"), tmp_path / "home"
    home.mkdir()
    bare = {"env": {"PATH": str(installed.parent), "HOME": str(home)}, "cwd": tmp_path}
    assert not [name for name in ("c++", "g++", "clang++") if shutil.which(name, path=bare["env"]["PATH"])]
    where, zig = run(installed, "-c", _BARE, **bare).split()
    assert Path(where).is_relative_to(installed.parents[1])
    assert zig == "None"
    size = ("render", "teapot", "--size", "160x120", "--json", tmp_path / "a.json", "-o")
    done = subprocess.run([program, *size, "a.png"], capture_output=True, text=True, **bare)
    assert done.returncode == 0, done.stderr
    # One line tells the engine, why, and a remedy. Others tell the progress.
    (line,) = (line for line in done.stderr.splitlines() if "warning" in line)
    expected = "blysk: warning: pysim at 160x120 instead of cxxrtl, no working C++ compiler (tried c++, "
    assert line.startswith(expected)
    assert "pip install 'blysk[native] @ file://" in line
    assert json.loads((tmp_path / "a.json").read_text())["engine"] == "pysim"
    run(sys.executable, "-m", "blysk", *size, tmp_path / "b.png", "--engine", "cxxrtl")
    assert json.loads((tmp_path / "a.json").read_text())["engine"] == "cxxrtl"
    ours, other = (np.asarray(Image.open(tmp_path / name)) for name in ("a.png", "b.png"))
    assert ours.shape == (120, 160, 3)
    np.testing.assert_array_equal(ours, other)
    text = run(program, "verilog", **bare)
    assert text.count("\nmodule ") == text.count("\nendmodule") > 0
    commands = {entry.name for entry in entry_points(group="blysk.commands")} | {"render", "verilog"}
    assert set(re.findall(r"^  (\w+)  ", run(program, "--help", **bare), re.M)) == commands
    # A command of an extra names what is missing, and how to install it from this wheel.
    done = subprocess.run([program, "fpga"], capture_output=True, text=True, **bare)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert "pip install 'blysk[fpga] @ file://" in done.stderr


_USER = """
import numpy as np

import blysk

scene: blysk.Scene = blysk.scene("teapot", size=(64, 48), lights=[blysk.Light((1, 1, 1))], background="#fff")
design: blysk.Design = blysk.design(method="quadratic", lights=2, gate=True)
frame: blysk.RenderedFrame = blysk.render(scene, design=design, engine="auto")
other = blysk.render("teapot", method="quotient", exponent=200, view=(0, 0, 1))
image: np.ndarray = frame.image
figures: tuple[float, float, int, int] = frame.error.max_lsb, frame.error.psnr_db, frame.cycles, frame.spans
text: str = blysk.verilog(design, name="core")
materials: tuple[blysk.Material, ...] = scene.materials
mesh: blysk.Mesh = scene.mesh
texture: blysk.Texture = blysk.Texture(np.ones((2, 2, 3)), filter="nearest")
camera: blysk.Camera = scene.camera
cost: int = design.cost().multipliers
error_map: np.ndarray = other.error_map
total: float = other.total_error.max_lsb
turned: blysk.Turntable = blysk.turntable("teapot", 4, size="64x48", lights="0,1,1")
arrays = blysk.render((np.zeros((3, 3)), [[0, 1, 2]]), lights=[{"direction": (0, 1, 1)}, (0, 0, 1)])
names: list[str] = [*blysk.METHODS, *blysk.MODELS]
errors = (blysk.InputError, blysk.SimulationError, blysk.CompilerMissing)
"""


@pytest.mark.ci
@pytest.mark.long
def test_types_of_the_wheel(wheel, tmp_path):
    """The public modules pass mypy's defaults, and a program that uses every public name passes ``--strict``.

    mypy reads the types of other modules, and does not check them: `follow_imports = silent`.
    """
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    (tmp_path / "user.py").write_text(_USER)
    assert all(f"blysk.{name}" in _USER for name in blysk.__all__)
    check = [sys.executable, "-m", "mypy", "--follow-imports=silent", "--no-incremental"]
    paths = os.environ | {"MYPYPATH": str(tmp_path / "site")}
    public = [getattr(blysk, name) for name in blysk.__all__]
    modules = ["blysk", *sorted({one.__module__ for one in public if not isinstance(one, dict)})]
    words = [word for name in modules for word in ("-m", name)]
    run(*check, "--disable-error-code=import-untyped", *words, cwd=tmp_path, env=paths)
    run(*check, "--strict", "user.py", cwd=tmp_path, env=paths)
    wrong = _USER + "blysk.render('teapot', exponent='high', shine=3)\n"
    (tmp_path / "wrong.py").write_text(wrong)
    done = subprocess.run(
        [*check, "--strict", "wrong.py"], capture_output=True, text=True, cwd=tmp_path, env=paths
    )
    assert "exponent" in done.stdout
    assert "shine" in done.stdout


@pytest.mark.long
@pytest.mark.skipif(
    sys.version_info >= (3, 12),
    reason="the oldest versions have wheels for the oldest Python only",
)
def test_wheel_renders_with_the_oldest_versions(wheel, tmp_path):
    """The picture is the same as here, from a new environment that has nothing else."""
    from blysk.sim.cli.main import main

    python = tmp_path / "environment" / "bin" / "python"
    run(sys.executable, "-m", "venv", tmp_path / "environment")
    oldest = [lowest(Requirement(text)) for text in metadata()["dependencies"]]
    run(python, "-m", "pip", "install", "-q", "--disable-pip-version-check", wheel, *oldest)
    run(python.with_name("blysk"), *RENDER, tmp_path / "old.png", cwd=tmp_path)
    assert main([*RENDER, str(tmp_path / "new.png")]) == 0
    old, new = (np.asarray(Image.open(tmp_path / name)) for name in ("old.png", "new.png"))
    np.testing.assert_array_equal(old, new)
    # The commands of the extras are there, and name what is missing.
    done = subprocess.run([python.with_name("blysk"), "fpga"], capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("blysk: fpga: ")
    assert done.stderr.endswith(f" -m pip install 'blysk[fpga] @ {Path(wheel).as_uri()}'\n")
