"""The command line as its users meet it: what it writes, what it says, and every bad input."""

import contextlib
import importlib.util
import io
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import sim.mesh
from golden.camera import Camera
from golden.lighting import Light, Material
from golden.pipeline import METHODS, ShadingPipeline
from golden.scene import Scene
from sim.cli import main
from sim.frame import FrameSimulator
from sim.mesh import load_mesh

PROGRAM = [sys.executable, "-c", "import sys; from sim.cli import main; sys.exit(main())"]
SMALL = ["teapot", "--triangles", "500", "--size", "64x48"]
TINY = ["teapot", "--triangles", "100", "--size", "16x12"]
ERROR_NAMES = ["max_lsb", "p999_lsb", "rmse_lsb", "psnr_db"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Each test runs in a folder of its own, with the compilers of the machine."""
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def picture(path):
    with Image.open(path) as image:
        return np.asarray(image)


def files():
    return {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}


@pytest.fixture
def refused(capsys):
    """Run with bad input: one line of thing, reason and remedy, status 2, and no file touched."""

    def refused(*arguments, thing, says=""):
        before = files()
        assert main([str(argument) for argument in arguments]) == 2
        output, line = capsys.readouterr()
        assert output == ""
        assert re.fullmatch(r"blysk: [^\n]+: [^\n]+; [^\n]+\n", line), line
        assert line.startswith(f"blysk: {thing}: ")
        assert says in line
        assert files() == before
        return line

    return refused


# Meshes that are none.


def glb(document):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<IIIII", 0x46546C67, 2, 20 + len(text), len(text), 0x4E4F534A)
    return head + text


def draco():
    extension = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    primitive = {"attributes": {"POSITION": 0}, "extensions": extension}
    return glb(
        {
            "asset": {"version": "2.0"},
            "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}],
            "meshes": [{"primitives": [primitive]}],
        }
    )


def box(file_type):
    return trimesh.creation.box().export(file_type=file_type)


CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
BAD_MESHES = {
    "unknown.dae": (b"x", "unknown mesh type '.dae'"),
    "empty.obj": (b"", "the file is empty"),
    "empty.glb": (b"", "the file is empty"),
    "truncated.ply": (box("ply")[:-20], "cannot be read"),
    "truncated.glb": (box("glb")[:-20], "cut short"),
    "index.obj": (CORNERS + b"f 1 2 4\n", "out of bounds"),
    "lines.obj": (CORNERS + b"l 1 2\n", "it has no faces"),
    "faceless.obj": (CORNERS, "it has no faces"),
    "nan.obj": (CORNERS + b"v nan 0 0\nf 1 2 4\n", "NaN or infinite"),
    "infinite.obj": (CORNERS + b"v 0 inf 0\nf 1 2 4\n", "NaN or infinite"),
    "point.obj": (b"v 1 2 3\n" * 3 + b"f 1 2 3\n", "all its vertices are at one point"),
    "flat.obj": (b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "none of its faces has an area"),
    "draco.glb": (draco(), "the decoder DracoPy is not installed; pip install DracoPy"),
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_mesh(refused, monkeypatch, name):
    data, reason = BAD_MESHES[name]
    find_spec = importlib.util.find_spec
    monkeypatch.setattr(
        sim.mesh.importlib.util, "find_spec", lambda name: None if name == "DracoPy" else find_spec(name)
    )
    Path(name).write_bytes(data)
    refused("render", name, "--size", "8x6", "-o", "out.png", "--json", "out.json", thing=name, says=reason)


def test_no_mesh(refused):
    refused("render", "nowhere.obj", thing="nowhere.obj", says="there is no such file")
    Path("folder.obj").mkdir()
    refused("render", "folder.obj", thing="folder.obj", says="is a folder")
    refused("render", "", thing="MESH ''", says="is no file's name")
    refused("render", "/", thing="MESH '/'")


# Options.

KNOWN_METHODS = f"unknown method; use one of {', '.join(METHODS)}"


@pytest.mark.parametrize(
    ("options", "thing", "says"),
    [
        (["--exponent", "0"], "--exponent 0", "from 1 to 1000"),
        (["--exponent", "1001"], "--exponent 1001", "from 1 to 1000"),
        (["--exponent", "-3"], "--exponent -3", "from 1 to 1000"),
        (["--exponent", "2.5"], "--exponent 2.5", "not a whole number"),
        (["--exponent", "x"], "--exponent x", "not a whole number"),
        (["--exponent", ""], "--exponent ", "not a whole number"),
        (["--size", "0x0"], "--size 0x0", "1 to 4095 each"),
        (["--size", "5000x10"], "--size 5000x10", "1 to 4095 each"),
        (["--size", "10x4096"], "--size 10x4096", "1 to 4095 each"),
        (["--size", "abc"], "--size abc", "not a size"),
        (["--size", "-1x5"], "--size -1x5", "not a size"),
        (["--method", "slurp"], "--method slurp", KNOWN_METHODS),
        (["--model", "shiny"], "--model shiny", "use one of phong, blinn, cosquad, cosquad7, "),
        (["--engine", "steam"], "--engine steam", "use one of auto, cxxrtl, pysim"),
        (["--projection", "flat"], "--projection flat", "orthographic"),
        (["--back-faces", "hide"], "--back-faces hide", "flip, show, cull"),
        (["--triangles", "63"], "--triangles 63", "from 64 to 4000000"),
        (["--crease", "181"], "--crease 181", "0 to 180"),
        (["--crease", "sharp"], "--crease sharp", "not an angle"),
        (["--view", "0,0,0"], "--view 0,0,0", "no direction"),
        (["--view", "1,2"], "--view 1,2", "not a direction; give X,Y,Z"),
        (["--view", "1,nan,2"], "--view 1,nan,2", "not a direction"),
        (["--light", "0,0,0"], "--light 0,0,0", "a direction other than 0"),
        (["--light", "1,2,3,4"], "--light 1,2,3,4", "give X,Y,Z or X,Y,Z,R,G,B"),
        (["--light", "1,1,1,-1,0,0"], "--light 1,1,1,-1,0,0", "colours of 0 or more"),
        (["--light", "1,1,1,0,0,50"], "--light", "make the light darker"),
        (["--light", "1,1,1"] * 17, "--light", "17 lights; give at most 16"),
        (["--ambient", "1.5"], "--ambient 1.5", "from 0 to 1"),
        (["--diffuse", "0,0,-0.1"], "--diffuse 0,0,-0.1", "from 0 to 1"),
        (["--specular", "0.1,0.2"], "--specular 0.1,0.2", "not a colour; give #rrggbb"),
        (["--background", "#12345"], "--background #12345", "not a colour"),
        (["--vcd", "a.vcd", "--engine", "cxxrtl"], "--vcd", "use --engine pysim"),
    ],
)
def test_bad_option(refused, options, thing, says):
    refused("render", "teapot", *options, thing=thing, says=says)


@pytest.mark.parametrize("command", [["render", "teapot"], ["verilog", "-o", "core.v"]])
def test_method_that_cannot_serve_the_model(refused, monkeypatch, command):
    monkeypatch.setitem(METHODS, "quadratic", ("cosquad", "cosquad7"))
    says = "method quadratic cannot serve it; use one of cosquad, cosquad7"
    refused(*command, "--method", "quadratic", "--model", "blinn", thing="--model blinn", says=says)


def test_triangles_of_a_file(refused):
    Path("a.obj").write_bytes(CORNERS + b"f 1 2 3\n")
    refused("render", "a.obj", "--triangles", "100", thing="--triangles 100", says="leave it out for a file")


@pytest.mark.parametrize(
    ("options", "thing", "says"),
    [
        (["--model", "shiny"], "--model shiny", "use one of phong"),
        (["--method", "slurp"], "--method slurp", KNOWN_METHODS),
        (["--lights", "0"], "--lights 0", "from 1 to 16"),
        (["--lights", "17"], "--lights 17", "from 1 to 16"),
        (["--name", "1up"], "--name 1up", "letters, digits and underscores"),
        (["--name", "module"], "--name module", "choose another name"),
        (["-o", "no/such/folder.v"], "no/such/folder.v", "there is no folder no/such"),
    ],
)
def test_bad_option_of_verilog(refused, options, thing, says):
    refused("verilog", *options, thing=thing, says=says)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "Missing command"),
        (["paint"], "No such command 'paint'"),
        (["render"], "Missing argument 'MESH'"),
        (["render", "teapot", "kettle"], "unexpected extra argument (kettle)"),
        (["render", "teapot", "--shiny"], "No such option"),
        (["render", "teapot", "--size"], "'--size' requires an argument"),
        (["--shiny"], "No such option"),
    ],
)
def test_wrong_command(capsys, arguments, says):
    assert main(arguments) == 2
    output, line = capsys.readouterr()
    assert (output, files()) == ("", {})
    assert re.fullmatch(r"blysk: [^\n]+; see blysk --help\n", line)
    assert says in line


# Outputs that cannot be.


@pytest.mark.parametrize("option", ["-o", "--compare", "--json", "--vcd"])
def test_unwritable_output(refused, option):
    suffix = {"--json": "json", "--vcd": "vcd"}.get(option, "png")
    Path(f"folder.{suffix}").mkdir()
    Path("file").write_text("x")
    for name, says in (
        (f"nowhere/a.{suffix}", "there is no folder nowhere; make the folder first"),
        (f"folder.{suffix}", "it is a folder"),
        (f"file/a.{suffix}", "file is no folder"),
    ):
        refused("render", *TINY, option, name, thing=name, says=says)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_folder_without_permission(refused):
    Path("locked").mkdir(mode=0o500)
    refused("render", *TINY, "-o", "locked/a.png", thing="locked/a.png", says="permission denied")


def test_wrong_suffix_of_picture(refused):
    refused("render", *TINY, "-o", "a.obj", thing="a.obj", says="use .png")
    refused("render", *TINY, "--compare", "a", thing="a", says="the name has no suffix")


def test_two_outputs_with_one_name(refused):
    says = "is the mesh or another output; choose another file"
    refused("render", *TINY, "-o", "a.png", "--compare", "./a.png", thing="./a.png", says=says)
    refused("render", *TINY, "--json", "a", "--vcd", "a", thing="a", says=says)
    Path("link.png").symlink_to("a.png")
    refused("render", *TINY, "-o", "a.png", "--compare", "link.png", thing="link.png", says=says)


def test_output_over_the_mesh(refused):
    Path("a.obj").write_bytes(CORNERS + b"f 1 2 3\n")
    refused("render", "a.obj", "--json", "a.obj", thing="a.obj", says="is the mesh")


# Help and version.


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], ["render", "--help"], ["verilog", "-h"]])
def test_help_has_an_example(capsys, arguments):
    assert main(arguments) == 0
    output, errors = capsys.readouterr()
    assert errors == ""
    assert re.search(r"Examples?:\n +blysk (render|verilog) ", output)


def test_version(capsys):
    assert main(["--version"]) == 0
    assert re.fullmatch(r"blysk \d+\.\d+\.\d+\n", capsys.readouterr().out)


# What a run writes.


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """One run with every output of the compiled engine: its folder and what it printed."""
    folder = tmp_path_factory.mktemp("rendered")
    names = [folder / name for name in ("a.png", "both.png", "a.json")]
    with contextlib.redirect_stdout(io.StringIO()) as output:
        status = main(
            ["render", *SMALL, "-o", str(names[0]), "--compare", str(names[1]), "--json", str(names[2])]
        )
    assert status == 0
    return folder, output.getvalue()


def test_picture_is_the_simulated_frame(rendered):
    mesh = load_mesh("teapot", triangles=500).mesh
    gray = int("1a", 16) / 255, int("1c", 16) / 255, int("20", 16) / 255
    scene = Scene(
        mesh=mesh,
        camera=Camera.framing(mesh.vertices, (0.4, 0.5, 1), "perspective", 64 / 48),
        width=64,
        height=48,
        material=Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 50),
        lights=[Light((-0.5, 0.8, 0.7))],
        background=gray,
    )
    expected = FrameSimulator(ShadingPipeline()).render(scene).image
    folder, _ = rendered
    assert np.array_equal(picture(folder / "a.png"), expected)
    both = picture(folder / "both.png")
    where = np.lib.stride_tricks.sliding_window_view(both, (48, 64, 3))[:, :, 0, 0, 0, 0] == expected[0, 0, 0]
    assert any(np.array_equal(both[y : y + 48, x : x + 64], expected) for y, x in np.argwhere(where).tolist())


def test_figures(rendered):
    folder, output = rendered
    assert sorted(path.name for path in folder.iterdir()) == ["a.json", "a.png", "both.png"]
    figures = json.loads((folder / "a.json").read_text())
    fixed = {
        "mesh": "teapot",
        "method": "quadratic",
        "model": "cosquad",
        "exponent": 50,
        "lights": 1,
        "engine": "cxxrtl",
        "width": 64,
        "height": 48,
    }
    assert {name: figures[name] for name in fixed} == fixed
    whole = ["triangles", "spans", "pixels", "visible_pixels", "clocks"]
    assert all(type(figures[name]) is int and figures[name] > 0 for name in whole)
    assert figures["triangles"] == len(load_mesh("teapot", triangles=500).mesh.faces)
    assert figures["spans"] <= figures["visible_pixels"] <= figures["pixels"] <= figures["clocks"]
    assert figures["clocks_per_pixel"] == figures["clocks"] / figures["pixels"]
    seconds = figures["seconds"]
    assert {"load", "raster", "golden", "simulate", "total"} <= set(seconds)
    assert figures["simulated_pixels_per_second"] == figures["pixels"] / seconds["simulate"]
    assert sum(seconds.values()) - seconds["total"] <= seconds["total"]
    for name in ("arithmetic_error", "method_error", "total_error"):
        error = figures[name]
        assert list(error) == ERROR_NAMES
        assert 0 < error["rmse_lsb"] <= error["max_lsb"]
        assert error["p999_lsb"] <= error["max_lsb"]
        assert error["psnr_db"] == pytest.approx(20 * np.log10(255 / error["rmse_lsb"]), rel=1e-12)
    # Half an LSB of rounding and as much of arithmetic; the model itself is off by tens of LSB.
    assert figures["arithmetic_error"]["max_lsb"] <= 1 < figures["total_error"]["max_lsb"]
    assert 0 < figures["nmse"] < 1
    assert figures["mnse_printed"] > 0

    # Every figure is printed, and every printed file is there.
    for name in whole:
        assert f"{figures[name]:,}" in output
    assert f"{figures['clocks_per_pixel']:.3f} a pixel" in output
    for name in ("arithmetic", "method", "total"):
        values = [figures[f"{name}_error"][key] for key in ERROR_NAMES]
        (row,) = re.findall(rf"^  {name} +([\d. ]+?)   [a-z]", output, re.MULTILINE)
        assert [float(value) for value in row.split()] == pytest.approx(values, abs=0.005)
    for name in ("a.png", "both.png", "a.json"):
        assert str(folder / name) in output


def test_default_output_is_named_like_the_mesh(capsys):
    Path("my.leaf.obj").write_bytes(CORNERS + b"f 1 2 3\n")
    assert main(["render", "my.leaf.obj", "--size", "16x12"]) == 0
    assert {str(path) for path in files()} == {"my.leaf.obj", "my.leaf-blysk.png"}
    output, errors = capsys.readouterr()
    assert errors == ""
    assert re.search(r"^frame +my\.leaf-blysk\.png$", output, re.MULTILINE)


def test_repairs_are_counted(capsys):
    rows = ["0 0 0 0 0 1", "1 0 0 0 0 0", "1 1 0 nan 0 1", "0 1 0 0 0.6 0.8", "0 2 0 0 0 1"]
    faces = ["3 0 1 2", "3 0 2 3", "3 0 3 4"]
    names = ("x", "y", "z", "nx", "ny", "nz")
    header = ["ply", "format ascii 1.0", f"element vertex {len(rows)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    Path("a.ply").write_text("\n".join(header + rows + faces) + "\n")
    assert main(["render", "a.ply", "--size", "16x12", "--json", "a.json"]) == 0
    output, _ = capsys.readouterr()
    counts = json.loads(Path("a.json").read_text())["counts"]
    assert (counts["repaired_normals"], counts["dropped_faces"]) == (2, 1)
    assert re.search(r"^counted +stored normals repaired: 2$", output, re.MULTILINE)
    assert re.search(r"^counted +faces without area dropped: 1$", output, re.MULTILINE)


def test_no_pixel_shows_the_surface(capsys):
    Path("a.obj").write_bytes(CORNERS + b"f 1 2 3\n")
    options = ["--size", "16x12", "--view", "1,0,0", "--projection", "orthographic"]
    assert main(["render", "a.obj", *options, "--json", "a.json", "--compare", "both.png"]) == 0
    output, errors = capsys.readouterr()
    assert errors == ""
    assert "nan" not in output
    assert "no pixel shows the surface" in output
    figures = json.loads(Path("a.json").read_text())
    assert (figures["spans"], figures["pixels"], figures["clocks_per_pixel"]) == (0, 0, None)
    assert figures["arithmetic_error"] == dict.fromkeys(ERROR_NAMES)
    assert figures["nmse"] is None


def test_unit_of_the_mesh_does_not_matter(capsys):
    """Products of the coordinates of the second and third would under- and overflow."""
    pictures = []
    for unit in ("", "e-310", "e300"):
        points = [f"v -1{unit} 0 0", f"v 1{unit} 0 0", f"v 0 1{unit} 0", "f 1 2 3"]
        Path("a.obj").write_text("\n".join(points))
        assert main(["render", "a.obj", "--size", "16x12"]) == 0
        assert capsys.readouterr().err == ""
        pictures.append(picture("a-blysk.png"))
    assert len(np.unique(pictures[0].reshape(-1, 3), axis=0)) > 1
    assert np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(pictures[0], pictures[2])


def test_waveforms(capsys):
    assert main(["render", *TINY, "--vcd", "a.vcd", "--json", "a.json"]) == 0
    assert capsys.readouterr().err == ""
    figures = json.loads(Path("a.json").read_text())
    assert figures["engine"] == "pysim"
    head, mark, changes = Path("a.vcd").read_text().partition("$enddefinitions $end")
    assert mark
    clock = set(re.findall(r"\$var wire 1 (\S+) clk \$end", head))
    assert len(clock) == 1
    ticks = changes.splitlines().count(f"1{clock.pop()}")
    # To the last pixel, and 64 clocks more to see that no other comes.
    assert figures["clocks"] <= ticks <= figures["clocks"] + 70
    assert set(files()) == {Path("a.vcd"), Path("a.json"), Path("teapot-blysk.png")}


def test_verilog(capsys):
    assert main(["verilog", "--model", "cosquad7"]) == 0
    printed, errors = capsys.readouterr()
    assert errors == ""
    assert main(["verilog", "--model", "cosquad7", "-o", "core.v"]) == 0
    assert capsys.readouterr() == ("", "")
    assert Path("core.v").read_text() == printed
    assert "model cosquad7, lights 1" in printed
    # The same text in another process, whatever the order of its sets.
    environment = {**os.environ, "PYTHONHASHSEED": "12345"}
    again = subprocess.run(
        [*PROGRAM, "verilog", "--model", "cosquad7"], env=environment, capture_output=True, text=True
    )
    assert again.stdout == printed


# Compilers.


def hide_compilers(monkeypatch):
    monkeypatch.setenv("PATH", "")
    find_spec = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == "ziglang" else find_spec(name, *rest)
    )


def break_compiler(monkeypatch):
    script = Path("compiler").absolute()
    script.write_text(
        '#!/bin/sh\ncase "$1" in --version) echo 1.0; exit 0;; esac\necho "error: out of luck"; exit 1\n'
    )
    script.chmod(0o755)
    monkeypatch.setenv("CXX", str(script))


@pytest.mark.parametrize("obstacle", [hide_compilers, break_compiler])
def test_without_compiler(capsys, monkeypatch, obstacle):
    obstacle(monkeypatch)
    before = files()
    assert main(["render", *TINY, "--engine", "cxxrtl"]) == 2
    output, line = capsys.readouterr()
    assert output == ""
    assert re.fullmatch(r"blysk: no working C\+\+ compiler \([^\n]+\): [^\n]+\n", line)
    assert "pip install 'blysk[native]'" in line
    assert files() == before


def test_fallback_without_compiler(capsys, monkeypatch):
    """One line and a smaller picture; the line of a cache that others can write is one of its own."""
    hide_compilers(monkeypatch)
    Path("shared").mkdir()
    Path("shared").chmod(0o777)
    monkeypatch.setenv("BLYSK_CACHE", "shared")
    monkeypatch.setattr("sim.cli.SLOW_SIZE", (24, 18))
    assert main(["render", "teapot", "--triangles", "100", "--size", "48x18", "--json", "a.json"]) == 0
    output, errors = capsys.readouterr()
    warning, line = errors.splitlines()
    assert re.match(
        r"blysk: warning: cache folder \S+/shared can be written by others \(chmod go-w\): ", warning
    )
    assert re.fullmatch(r"blysk: pysim at 24x9 instead of cxxrtl, no working C\+\+ compiler .+", line)
    figures = json.loads(Path("a.json").read_text())
    assert (figures["engine"], figures["width"], figures["height"]) == ("pysim", 24, 9)
    assert picture("teapot-blysk.png").shape == (9, 24, 3)
    assert "teapot, 24x9" in output


# Ends before the end.


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_interrupt():
    """Ctrl-C in a long run: one line, status 130, nothing left behind."""
    options = ["--engine", "pysim", "--vcd", "a.vcd", "--json", "a.json", "--compare", "a.png"]
    process = subprocess.Popen(
        [*PROGRAM, "render", "teapot", *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        patience = time.monotonic() + 60
        # The simulation has begun when its waveforms grow.
        while not any(path.stat().st_size for path in Path().iterdir()):
            assert process.poll() is None
            assert time.monotonic() < patience
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=60)
    finally:
        process.kill()
    assert (process.returncode, output, errors) == (130, "", "blysk: interrupted\n")
    assert files() == {}


@pytest.mark.skipif(os.name != "posix", reason="pipes")
def test_output_closed_early():
    process = subprocess.Popen([*PROGRAM, "render", "--help"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    with process.stderr:
        assert process.stderr.read() == b""
    assert process.wait(timeout=60) == 141


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_full_disk_behind_standard_output():
    with open("/dev/full", "w") as full:
        done = subprocess.run([*PROGRAM, "--version"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert re.fullmatch(r"blysk: standard output: No space left on device; [^\n]+\n", done.stderr)


def test_a_command_is_installed():
    program = shutil.which("blysk", path=str(Path(sys.executable).parent))
    if program is None:
        pytest.skip("the package is not installed")
    done = subprocess.run([program, "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
