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

from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.sim.api.scene_file import read_scene_file
from blysk.sim.cli.main import main
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.mesh import load_mesh

PROGRAM = [sys.executable, "-c", "import sys; from blysk.sim.cli.main import main; sys.exit(main())"]
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
        importlib.util, "find_spec", lambda name: None if name == "DracoPy" else find_spec(name)
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

KNOWN_METHODS = f"unknown method; use one of {', '.join(METHODS | PUBLISHED)}"


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
        (["--crease", "sharp"], "--crease sharp", "not a number"),
        (["--view", "0,0,0"], "--view 0,0,0", "no direction"),
        (["--view", "1,2"], "--view 1,2", "not a direction; give X,Y,Z"),
        (["--view", "1,nan,2"], "--view 1,nan,2", "out of range"),
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
        (["--operand", "cross"], "--operand cross", "use one of cosine, one_minus_cosine"),
        (["--setup-interval", "0"], "--setup-interval 0", "from 1 to 46"),
        (["--frames", "0"], "--frames 0", "from 1 to 9999"),
        (["--frames", "2", "--jobs", "0"], "--jobs 0", "from 1 to 1024"),
        (["--jobs", "2"], "--jobs", "give --frames, too"),
        (["--cluster", ""], "--cluster", "give --frames, too"),
        (["--frames", "2", "--cluster", ""], "--cluster ", "as tcp://host:8786"),
        (["--frames", "2", "--cluster", "a:1", "--jobs", "2"], "--jobs", "leave out --jobs or --cluster"),
        (["--frames", "2", "--compare", "a.png"], "--compare a.png", "is for one frame"),
        (["--frames", "2", "--vcd", "a.vcd"], "--vcd a.vcd", "is for one frame"),
        (["--frames", "2", "-o", "a.jpg"], "a.jpg", "use .gif or .png"),
        (["--frames", "2", "-o", "no/a.gif"], "no/a.gif", "there is no folder no"),
        (["--frames", "2", "-o", "a.gif", "--json", "a-0002.png"], "a-0002.png", "another output"),
        (["--frames", "2", "--view", "0,1,0"], "--view 0,1,0", "looks along the axis"),
    ],
)
def test_bad_option(refused, options, thing, says):
    refused("render", "teapot", *options, thing=thing, says=says)


@pytest.mark.parametrize("command", [["render", "teapot"], ["verilog", "-o", "core.v"]])
def test_design_that_cannot_be(refused, command):
    says = "the pipeline finds N.H, not R.V; use one of cosquad, "
    refused(*command, "--model", "phong", thing="--model phong", says=says)
    says = "method chord finds no normals"
    refused(*command, "--method", "chord", "--operand", "cosine", thing="--operand cosine", says=says)
    says = "method linear is not built for it; "
    refused(*command, "--method", "linear", "--setup-interval", "26", thing="--setup-interval 26", says=says)


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


# Scene files.

SCENE = """
size = [64, 48]
background = 0.5
back_faces = "show"
[mesh]
file = "a.obj"
crease = 180
[camera]
projection = "orthographic"
view = [0, 1, 3]
[[lights]]
direction = [1, 1, 1]
[[lights]]
direction = [-1, 1, 1]
color = [0.5, 0.25, 0]
[material]
ambient = 0.1
diffuse = [0.5, 0.25, 0.125]
specular = 0.75
exponent = 20
[pipeline]
method = "linear"
model = "cosquad7"
"""
SCENE_OPTIONS = [
    *("--size", "64x48", "--background", "0.5", "--back-faces", "show", "--crease", "180"),
    *("--projection", "orthographic", "--view", "0,1,3", "--light", "1,1,1"),
    *("--light=-1,1,1,0.5,0.25,0", "--ambient", "0.1", "--diffuse", "0.5,0.25,0.125"),
    *("--specular", "0.75", "--exponent", "20", "--method", "linear", "--model", "cosquad7"),
]


@pytest.fixture
def scenes():
    """A folder with a scene file and its mesh."""
    Path("scenes").mkdir()
    Path("scenes/a.obj").write_text(box("obj"))
    Path("scenes/a.toml").write_text(SCENE)


def figures_of(name):
    figures = json.loads(Path(name).read_text())
    del figures["seconds"], figures["simulated_pixels_per_second"]
    return figures


def test_scene_file_says_what_the_options_say(scenes, capsys):
    assert main(["render", "scenes/a.toml", "--json", "file.json"]) == 0
    assert main(["render", "scenes/a.obj", *SCENE_OPTIONS, "-o", "b.png", "--json", "options.json"]) == 0
    assert capsys.readouterr().err == ""
    assert Path("a-blysk.png").read_bytes() == Path("b.png").read_bytes()
    assert figures_of("file.json") == figures_of("options.json")
    figures = figures_of("file.json")
    assert (figures["method"], figures["model"], figures["exponent"]) == ("linear", "cosquad7", 20)
    assert (figures["lights"], figures["width"], figures["mesh"]) == (2, 64, "a")


@pytest.mark.long
def test_options_go_before_the_scene_file(scenes, capsys):
    given = [
        "--size",
        "32x24",
        "--exponent",
        "70",
        "--light",
        "0,0,1",
        "--method",
        "quadratic",
        "--model",
        "cosquad",
        "--view",
        "1,2,3",
    ]
    assert main(["render", "scenes/a.toml", *given, "-o", "a.png", "--json", "a.json"]) == 0
    options = [*SCENE_OPTIONS]
    for name in ("--light", "--light=-1,1,1,0.5,0.25,0"):
        place = options.index(name)
        del options[place : place + 1 + ("=" not in name)]
    assert main(["render", "scenes/a.obj", *options, *given, "-o", "b.png", "--json", "b.json"]) == 0
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()
    assert figures_of("a.json") == figures_of("b.json")
    assert (figures_of("a.json")["lights"], figures_of("a.json")["width"]) == (1, 32)
    # A default that is written out is given, too.
    assert main(["render", "scenes/a.toml", "--exponent", "50", "--json", "a.json"]) == 0
    assert figures_of("a.json")["exponent"] == 50


@pytest.mark.long
def test_place_of_the_camera(capsys):
    """A camera by its place, in any unit of the mesh, and the middle of the mesh as its target."""

    def draw(unit, name, place):
        mesh = trimesh.creation.box((2, 1, 1))
        vertices = [" ".join(f"{value * unit:.17g}" for value in vertex) for vertex in mesh.vertices]
        text = "".join(f"v {vertex}\n" for vertex in vertices)
        text += "".join("f {} {} {}\n".format(*(face + 1)) for face in mesh.faces)
        Path("a.obj").write_text(text)
        head = "size = [64, 48]\nmesh.file = 'a.obj'\npipeline.method = 'linear'\n[camera]\n"
        Path(f"{name}.toml").write_text(head + place.format(x=1 * unit, y=2 * unit, z=3 * unit, up=unit / 2))
        assert main(["render", f"{name}.toml", "-o", f"{name}.png"]) == 0
        assert capsys.readouterr().err == ""
        return picture(f"{name}.png")

    target = "position = [{x}, {y}, {z}]\ntarget = [0, {up}, 0]\n"
    pictures = [draw(2.0**power, f"target{power}", target) for power in (-600, 0, 600)]
    assert np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(pictures[2], pictures[1])
    middle = draw(1.0, "middle", "position = [{x}, {y}, {z}]\n")

    mesh = load_mesh("a.obj").mesh
    for expected, place in ((pictures[1], (0, 0.5, 0)), (middle, (0, 0, 0))):
        scene = Scene(
            mesh=mesh,
            camera=Camera((1, 2, 3), place, projection="perspective", near=0.001),
            width=64,
            height=48,
            material=Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 50),
            lights=[Light((-0.5, 0.8, 0.7))],
            background=(int("1a", 16) / 255, int("1c", 16) / 255, int("20", 16) / 255),
        )
        assert np.array_equal(FrameSimulator(preset("linear")).render(scene).image, expected)
    # --view takes the place of the file's position.
    options = ["--size", "64x48", "--method", "linear", "--view", "1,2,3"]
    assert main(["render", "middle.toml", "--view", "1,2,3", "-o", "again.png"]) == 0
    assert main(["render", "a.obj", *options, "-o", "view.png"]) == 0
    assert np.array_equal(picture("again.png"), picture("view.png"))


def test_no_light(capsys):
    """Ambient light only."""
    Path("a.toml").write_text("lights = []\nsize = [16, 12]\nmesh.file = 'teapot'\nmaterial.ambient = 0.2\n")
    assert main(["render", "a.toml"]) == 0
    assert capsys.readouterr().err == ""
    colors = np.unique(picture("a-blysk.png").reshape(-1, 3), axis=0)
    assert colors.tolist() == [[0x1A, 0x1C, 0x20], [51, 51, 51]]


@pytest.mark.parametrize(
    ("text", "options", "thing", "says"),
    [
        ("mesh.file = 'no.obj'", [], "a.toml, mesh.file", "no.obj, there is no such file"),
        ("mesh.file = 'b.toml'", [], "a.toml, mesh.file", "unknown mesh type '.toml'"),
        ("mesh.file = '.'", [], "a.toml, mesh.file", "is no file's name"),
        ("mesh.file = 'empty.obj'", [], "a.toml, mesh.file", "empty.obj, the file is empty"),
        ("mesh.file = 'empty.obj'", ["--triangles", "100"], "--triangles 100", "leave it out"),
        ("mesh.file = 'teapot'\nexponent = 3", [], "a.toml, exponent", "unknown key"),
        ("mesh.file = 'teapot'\nsize = ]", [], "a.toml", "is no TOML"),
        ("pipeline = {method = 'chord', operand = 'cosine'}", [], "a.toml, pipeline.operand", "leave it out"),
        (
            "pipeline = {setup_interval = 26}",
            ["--method", "linear"],
            "a.toml, pipeline.setup_interval",
            "linear",
        ),
        ("lights = [{direction = [1, 1, 1], color = 30}]", [], "a.toml, lights", "make the light darker"),
        (
            "camera.position = [0, 0, 0]\ncamera.target = [0, 0, 0]",
            [],
            "a.toml, camera.position",
            "its target",
        ),
        ("camera.position = [1e300, 0, 0]", [], "a.toml, camera.position", "too far away"),
        ("camera.view = [0, 1, 0]", ["--frames", "2"], "a.toml, camera.view", "looks along the axis"),
        (
            "camera.position = [0, 9, 0]\ncamera.target = [0, 0, 0]",
            ["--frames", "2"],
            "a.toml, camera.position",
            "axis",
        ),
        ("", ["--json", "a.toml"], "a.toml", "another output"),
    ],
)
def test_bad_scene(refused, text, options, thing, says):
    Path("empty.obj").touch()
    Path("b.toml").touch()
    mesh = "" if "mesh." in text else "mesh.file = 'teapot'\n"
    Path("a.toml").write_text(mesh + text)
    refused("render", "a.toml", *options, thing=thing, says=says)


def test_no_scene(refused):
    refused("render", "no.toml", thing="no.toml", says="there is no such file")
    Path("folder.toml").mkdir()
    refused("render", "folder.toml", thing="folder.toml", says="is a folder")


# Turntables.


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """One turntable with its figures: its folder and what it printed."""
    folder = tmp_path_factory.mktemp("turned")
    arguments = ["render", *TINY, "--frames", "5", "--jobs", "2", "--method", "linear"]
    with contextlib.redirect_stdout(io.StringIO()) as output:
        assert main([*arguments, "-o", str(folder / "a.gif"), "--json", str(folder / "a.json")]) == 0
    return folder, output.getvalue()


def test_files_of_a_turntable(turned):
    folder, output = turned
    names = [f"a-000{number}.png" for number in range(1, 6)]
    assert sorted(path.name for path in folder.iterdir()) == sorted(["a.gif", "a.json", *names])
    frames = [picture(folder / name) for name in names]
    assert {frame.shape for frame in frames} == {(12, 16, 3)}
    assert len({frame.tobytes() for frame in frames}) == 5
    with Image.open(folder / "a.gif") as animation:
        assert (animation.n_frames, animation.size) == (5, (16, 12))
    for name in ("a-0001.png", "a-0005.png", "a.gif", "a.json"):
        assert str(folder / name) in output


def test_figures_of_a_turntable(turned):
    folder, output = turned
    figures = json.loads((folder / "a.json").read_text())
    frames = figures["frames"]
    assert [Path(frame["picture"]).name for frame in frames] == [
        f"a-000{number}.png" for number in range(1, 6)
    ]
    for name in ("pixels", "visible_pixels", "cycles"):
        assert figures[name] == sum(frame[name] for frame in frames)
        assert f"{figures[name]:,}" in output
    for name in ("arithmetic", "method", "total"):
        errors = [frame[f"{name}_error"] for frame in frames]
        worst = figures[f"{name}_error"]
        for key in ("max_lsb", "p999_lsb", "rmse_lsb"):
            assert worst[key] == max(error[key] for error in errors) > min(error[key] for error in errors)
        assert worst["psnr_db"] == min(error["psnr_db"] for error in errors)
        (row,) = re.findall(rf"^  {name} +([\d. ]+?)   [a-z]", output, re.MULTILINE)
        values = [worst[key] for key in ERROR_NAMES]
        assert [float(value) for value in row.split()] == pytest.approx(values, abs=0.005)


def test_a_turntable_of_one_frame_is_the_frame(capsys):
    assert main(["render", *TINY, "--frames", "1", "-o", "a.gif"]) == 0
    assert main(["render", *TINY, "-o", "b.png"]) == 0
    assert capsys.readouterr().err == ""
    assert Path("a-0001.png").read_bytes() == Path("b.png").read_bytes()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_interrupt_of_a_turntable():
    """Ctrl-C in a terminal reaches all processes: frames done stay, whole, and no process goes on."""
    arguments = ["render", "teapot", "--triangles", "500", "--size", "64x48", "--engine", "pysim"]
    process = subprocess.Popen(
        [*PROGRAM, *arguments, "--frames", "200", "--jobs", "2", "-o", "a.gif"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        idle_timeout = time.monotonic() + 120
        while not Path("a-0001.png").exists():
            assert process.poll() is None
            assert time.monotonic() < idle_timeout
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGINT)
        # Returns when nobody holds the pipes any more: neither the program nor one of its workers.
        output, errors = process.communicate(timeout=60)
        assert (process.returncode, output, errors) == (130, "", "blysk: interrupted\n")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    names = sorted(str(path) for path in files())
    assert all(re.fullmatch(r"a-\d{4}\.png", name) for name in names), names
    assert 1 <= len(names) < 200
    for name in names:
        assert picture(name).shape == (48, 64, 3)


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


@pytest.mark.long
def test_fit_says_what_it_leaves_out(folder, capsys):
    options = ["--method", "chord", "--gate", "--specialise", "--size", "64x48", "--specular", "0"]
    options += ["--engine", "pysim", "--triangles", "64"]
    assert main(["render", "teapot", *options, "-o", "a.png", "--json", "a.json"]) == 0
    output = capsys.readouterr().out
    assert re.search(
        r"^left out +no specular path: every k_s is 0; saves [\d,]+ cells, \d+ mult", output, re.M
    )
    assert re.search(r"^left out +x in 6 bits: 64 columns; saves ", output, re.M)
    assert re.search(
        r"^specialised +[\d,]+ of [\d,]+ cells, \d+ of \d+ multipliers, .* cycles$", output, re.M
    )
    assert re.search(r"^ +the frame is that of the full pipeline, to the bit$", output, re.M)
    fit = json.loads(Path("a.json").read_text())["specialisation"]
    assert (fit["largest_difference"], fit["different_pixels"]) == (0, 0)
    for name, count in fit["specialised"].items():
        saved = sum(reduction["saves"][name] for reduction in fit["reductions"])
        assert count == fit["full"][name] - saved < fit["full"][name]


@pytest.mark.long
def test_fitted_turntable(folder, capsys):
    options = ["--method", "chord", "--specialise", "--size", "32x24", "--frames", "2", "--jobs", "1"]
    assert main(["render", "teapot", *options, "-o", "a.gif"]) == 0
    assert main(["render", "teapot", *[o for o in options if o != "--specialise"], "-o", "b.gif"]) == 0
    for number in (1, 2):
        np.testing.assert_array_equal(picture(f"a-000{number}.png"), picture(f"b-000{number}.png"))


@pytest.mark.long
def test_point_lights(folder, refused, capsys):
    local = ["--method", "chord-local", "--point-light", "3,4,5,1,0.5,0.5", "--viewer", "near"]
    assert main(["render", "teapot", *local, "--size", "48x36", "-o", "a.png", "--json", "a.json"]) == 0
    assert json.loads(Path("a.json").read_text())["method_error"]["max_lsb"] < 1
    Path("a.toml").write_text(
        '[mesh]\nfile = "teapot"\n[[lights]]\nposition = [3, 4, 5]\ncolor = [1, 0.5, 0.5]\n'
        '[camera]\nviewer = "near"\n[pipeline]\nmethod = "chord-local"\n'
    )
    assert main(["render", "a.toml", "--size", "48x36", "-o", "b.png"]) == 0
    np.testing.assert_array_equal(picture("a.png"), picture("b.png"))
    fitted = ["--specialise", "--engine", "pysim", "--triangles", "64", "--size", "16x12", "--json", "c.json"]
    assert main(["render", "teapot", *local, *fitted, "-o", "c.png"]) == 0
    assert json.loads(Path("c.json").read_text())["specialisation"]["different_pixels"] == 0
    capsys.readouterr()
    what = "need the values of a span; use chord-local"
    refused("render", "teapot", "--point-light", "3,4,5", thing="--method quadratic", says=what)
    refused("render", "a.toml", "--method", "chord", thing="--method chord", says=what)
    refused("render", "teapot", *local, "--projection", "orthographic", thing="--viewer near", says="distant")
    refused("render", "teapot", *local, "--gate", thing="--gate", says="has no normals for one")
    refused("render", "teapot", "--short-words", thing="--short-words", says="nothing is specialised")


def test_verilog_with_a_gate(capsys):
    assert main(["verilog", "--method", "chord", "--gate"]) == 0
    output = capsys.readouterr().out
    assert "throughput style, highlight gate" in output
    assert "value_gate" in output.partition("module")[2]


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], ["render", "--help"], ["verilog", "-h"]])
def test_help_has_an_example(capsys, arguments):
    assert main(arguments) == 0
    output, errors = capsys.readouterr()
    assert errors == ""
    assert re.search(r"Examples?:\n +blysk (render|verilog) ", output)


def test_help_names_every_key_of_a_scene_file(capsys):
    assert main(["render", "--help"]) == 0
    (keys,) = re.findall(r"Keys of a scene file.*?\n\n", capsys.readouterr().out, re.DOTALL)
    example = read_scene_file.__doc__.partition("::")[2].partition("The values'")[0]
    names = re.findall(r"^ *(\w+) =|^ *(\[+\w+\]+)", example, re.MULTILINE)
    assert len(names) > 20
    for name in [*(first or second for first, second in names), "position", "target"]:
        assert re.search(rf"(?<!\w){re.escape(name)}(?!\w)", keys), name


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
    expected = FrameSimulator(preset()).render(scene).image
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
        "method": "chord",
        "model": "cosquad",
        "exponent": 50,
        "lights": 1,
        "engine": "cxxrtl",
        "width": 64,
        "height": 48,
    }
    assert {name: figures[name] for name in fixed} == fixed
    whole = ["triangles", "spans", "pixels", "visible_pixels", "cycles"]
    assert all(type(figures[name]) is int and figures[name] > 0 for name in whole)
    assert figures["triangles"] == len(load_mesh("teapot", triangles=500).mesh.faces)
    assert figures["spans"] <= figures["visible_pixels"] <= figures["pixels"] <= figures["cycles"]
    assert figures["cycles_per_pixel"] == figures["cycles"] / figures["pixels"]
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
    assert figures["mnse_published"] > 0

    # Every figure is printed, and every printed file is there.
    for name in whole:
        assert f"{figures[name]:,}" in output
    assert f"{figures['cycles_per_pixel']:.3f} a pixel" in output
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
    assert (figures["spans"], figures["pixels"], figures["cycles_per_pixel"]) == (0, 0, None)
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
    # To the last pixel, and 64 cycles more to see that no other comes.
    assert figures["cycles"] <= ticks <= figures["cycles"] + 70
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
    monkeypatch.setattr("blysk.sim.api.render.SLOW_SIZE", (24, 18))
    assert main(["render", "teapot", "--triangles", "100", "--size", "48x18", "--json", "a.json"]) == 0
    output, errors = capsys.readouterr()
    warning, line = errors.splitlines()
    assert re.match(
        r"blysk: warning: cache folder \S+/shared can be written by others \(chmod go-w\): ", warning
    )
    assert re.fullmatch(
        r"blysk: warning: pysim at 24x9 instead of cxxrtl, no working C\+\+ compiler .+", line
    )
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
        idle_timeout = time.monotonic() + 60
        # The simulation has begun when its waveforms grow.
        while not any(path.stat().st_size for path in Path().iterdir()):
            assert process.poll() is None
            assert time.monotonic() < idle_timeout
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
