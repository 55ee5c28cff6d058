"""Scene files and options have the same meaning and the same refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.scene import Scene
from blysk.sim.cli.main import main
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.mesh import load_mesh

from .commandline import DEFAULTS, picture

pytestmark = pytest.mark.usefixtures("folder")


SCENE = """
size = [24, 18]
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

SLOW = ["--engine", "pysim"]
SCENE_OPTIONS = [
    *("--size", "24x18", "--background", "0.5", "--back-faces", "show", "--crease", "180"),
    *("--projection", "orthographic", "--view", "0,1,3", "--light", "1,1,1"),
    *("--light=-1,1,1,0.5,0.25,0", "--ambient", "0.1", "--diffuse", "0.5,0.25,0.125"),
    *("--specular", "0.75", "--exponent", "20", "--method", "linear", "--model", "cosquad7"),
]


@pytest.fixture
def scenes():
    """A folder with a scene file and its mesh."""
    Path("scenes").mkdir()
    Path("scenes/a.obj").write_text(trimesh.creation.box().export(file_type="obj"))
    Path("scenes/a.toml").write_text(SCENE)


def figures_of(name):
    figures = json.loads(Path(name).read_text())
    del figures["seconds"], figures["simulated_pixels_per_second"]
    return figures


@pytest.mark.ci
@pytest.mark.long
def test_scene_file_says_what_the_options_say(scenes, capsys):
    assert main(["render", "scenes/a.toml", *SLOW, "--json", "file.json"]) == 0
    options = [*SCENE_OPTIONS, *SLOW, "-o", "b.png", "--json", "options.json"]
    assert main(["render", "scenes/a.obj", *options]) == 0
    assert capsys.readouterr().err == ""
    assert Path("a-blysk.png").read_bytes() == Path("b.png").read_bytes()
    assert figures_of("file.json") == figures_of("options.json")
    figures = figures_of("file.json")
    assert (figures["method"], figures["model"], figures["exponent"]) == ("linear", "cosquad7", 20)
    assert (figures["lights"], figures["width"], figures["mesh"]) == (2, 24, "a")


@pytest.mark.long
def test_options_go_before_the_scene_file(scenes, capsys):
    given = ["--size", "32x24", "--exponent", "70", "--light", "0,0,1", "--view", "1,2,3"]
    given += ["--method", "quadratic", "--model", "cosquad"]
    assert main(["render", "scenes/a.toml", *given, "-o", "a.png", "--json", "a.json"]) == 0
    options = [*SCENE_OPTIONS]
    for name in ("--light", "--light=-1,1,1,0.5,0.25,0"):
        place = options.index(name)
        del options[place : place + 1 + ("=" not in name)]
    assert main(["render", "scenes/a.obj", *options, *given, "-o", "b.png", "--json", "b.json"]) == 0
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()
    assert figures_of("a.json") == figures_of("b.json")
    assert (figures_of("a.json")["lights"], figures_of("a.json")["width"]) == (1, 32)
    # A default that is written out counts as given.
    assert main(["render", "scenes/a.toml", "--exponent", "50", "--json", "a.json"]) == 0
    assert figures_of("a.json")["exponent"] == 50


@pytest.mark.long
def test_position_of_the_camera(capsys):
    """A camera given by its position, in any unit of the mesh. Its target is the middle of the mesh."""

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
            **DEFAULTS,
        )
        assert np.array_equal(
            FrameSimulator(preset("linear", "cosquad", transfer="srgb")).render(scene).image, expected
        )
    # --view replaces the file's position.
    options = ["--size", "64x48", "--method", "linear", "--view", "1,2,3"]
    assert main(["render", "middle.toml", "--view", "1,2,3", "-o", "again.png"]) == 0
    assert main(["render", "a.obj", *options, "-o", "view.png"]) == 0
    assert np.array_equal(picture("again.png"), picture("view.png"))


def test_no_light(capsys):
    """There is only ambient light."""
    Path("a.toml").write_text("lights = []\nsize = [16, 12]\nmesh.file = 'teapot'\nmaterial.ambient = 0.2\n")
    assert main(["render", "a.toml"]) == 0
    assert capsys.readouterr().err == ""
    colors = np.unique(picture("a-blysk.png").reshape(-1, 3), axis=0)
    # The code of sRGB for a fifth of the light is 124.
    assert colors.tolist() == [[0x1A, 0x1C, 0x20], [124, 124, 124]]


OVER_THE_CENTRE = "camera.position = [0, 9, 0]\ncamera.target = [0, 0, 0]"


@pytest.mark.parametrize(
    ("text", "options", "key", "says"),
    [
        ("mesh.file = 'no.obj'", [], "mesh.file", "no.obj, there is no such file"),
        ("mesh.file = 'b.toml'", [], "mesh.file", "unknown mesh type '.toml'"),
        ("mesh.file = '.'", [], "mesh.file", "is not a file name"),
        ("mesh.file = 'empty.obj'", [], "mesh.file", "empty.obj, the file is empty"),
        ("mesh.file = 'teapot'\nexponent = 3", [], "exponent", "unknown key"),
        ("pipeline = {method = 'angular', operand = 'cosine'}", [], "pipeline.operand", "leave it out"),
        ("pipeline.setup_interval = 26", ["--method", "linear"], "pipeline.setup_interval", "linear"),
        ("lights = [{direction = [1, 1, 1], color = 30}]", [], "lights", "make the light darker"),
        (OVER_THE_CENTRE.replace("9", "0"), [], "camera.position", "its target"),
        ("camera.position = [1e300, 0, 0]", [], "camera.position", "too far away"),
        ("camera.view = [0, 1, 0]", ["--frames", "2"], "camera.view", "looks along the axis"),
        (OVER_THE_CENTRE, ["--frames", "2"], "camera.position", "axis"),
    ],
)
def test_bad_scene(refused, text, options, key, says):
    Path("empty.obj").touch()
    Path("b.toml").touch()
    mesh = "" if "mesh." in text else "mesh.file = 'teapot'\n"
    Path("a.toml").write_text(mesh + text)
    refused("render", "a.toml", *options, thing=f"a.toml, {key}", says=says)


def test_bad_options_of_a_scene(refused):
    Path("a.toml").write_text("mesh.file = 'a.obj'")
    Path("a.obj").touch()
    refused("render", "a.toml", "--triangles", "100", thing="--triangles 100", says="leave it out")
    refused("render", "a.toml", "--json", "a.toml", thing="a.toml", says="is a file that this run reads")
    Path("a.toml").write_text("size = ]")
    refused("render", "a.toml", thing="a.toml", says="is not TOML")


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
    smallest = ["--specialise", "--engine", "pysim", "--triangles", "64", "--size", "16x12"]
    assert main(["render", "teapot", *local, *smallest, "--json", "c.json"]) == 0
    assert json.loads(Path("c.json").read_text())["specialisation"]["different_pixels"] == 0
    capsys.readouterr()
    what = "need the values of a span; use method chord-local"
    quotient = ["--point-light", "3,4,5", "--method", "quotient"]
    refused("render", "teapot", *quotient, thing="--method quotient", says=what)
    refused("render", "a.toml", "--method", "linear", thing="--method linear", says=what)
    spot = ["--spot-light", "3,4,5,-3,-3,-5,8,14,1,1,1,0.5,0.1,0", "--method", "chord-local"]
    assert main(["render", "teapot", *spot, "--size", "48x36", "-o", "c.png", "--json", "a.json"]) == 0
    assert json.loads(Path("a.json").read_text())["method_error"]["max_lsb"] < 1
    Path("b.toml").write_text(
        '[mesh]\nfile = "teapot"\n[[lights]]\nposition = [3, 4, 5]\nspot = [-3, -3, -5]\ncone = [8, 14]\n'
        'attenuation = [0.5, 0.1, 0]\n[pipeline]\nmethod = "chord-local"\n'
    )
    assert main(["render", "b.toml", "--size", "48x36", "-o", "d.png"]) == 0
    np.testing.assert_array_equal(picture("c.png"), picture("d.png"))
    capsys.readouterr()
    refused("render", "teapot", *local, "--projection", "orthographic", thing="--viewer near", says="distant")
    refused("render", "teapot", "--short-words", thing="--short-words", says="nothing is specialised")


@pytest.mark.long
def test_unit_of_the_mesh_does_not_matter(capsys):
    """Products of coordinates of the second and the third mesh would underflow and overflow."""
    pictures = []
    for unit in ("", "e-310", "e300"):
        points = [f"v -1{unit} 0 0", f"v 1{unit} 0 0", f"v 0 1{unit} 0", "f 1 2 3"]
        Path("a.obj").write_text("\n".join(points))
        assert main(["render", "a.obj", "--size", "8x6", "--method", "linear"]) == 0
        assert capsys.readouterr().err == ""
        pictures.append(picture("a-blysk.png"))
    assert len(np.unique(pictures[0].reshape(-1, 3), axis=0)) > 1
    assert np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(pictures[0], pictures[2])
