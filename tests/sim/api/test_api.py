"""The Python interface: scenes, designs, frames and Verilog by the words of the command line."""

import base64
import dataclasses
import io
import re
import subprocess
import sys
from typing import Literal, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from PIL import Image

import blysk
from blysk.golden.build import Build
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import METHODS, preset
from blysk.sim.api.options import (
    BUILD,
    DESIGN,
    RENDERING,
    SCENE,
    BuildOptions,
    DesignOptions,
    RenderOptions,
    SceneOptions,
)
from blysk.sim.cli.main import main
from blysk.sim.errors import OptionError
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.value_types import Choice, Few, Truth

TINY = {"triangles": 100, "size": (16, 12)}


@pytest.fixture(scope="module")
def frame():
    return blysk.render("teapot", exponent=200, triangles=500, size=(64, 48))


def test_import_is_quick():
    code = "import sys, blysk; print(*sys.modules.keys() & {'numpy', 'amaranth', 'scipy', 'click'})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "\n"
    assert set(dir(blysk)) == set(blysk.__all__)
    assert all(getattr(blysk, name).__doc__ for name in blysk.__all__)
    with pytest.raises(AttributeError, match="module 'blysk' has no attribute 'paint'"):
        _ = blysk.paint


def test_every_option_has_a_type_for_checkers():
    assert SceneOptions.__annotations__.keys() == SCENE.keys()
    assert DesignOptions.__annotations__.keys() == DESIGN.keys()
    assert BuildOptions.__annotations__.keys() == BUILD.keys()
    assert RenderOptions.__annotations__.keys() == SCENE.keys() | DESIGN.keys() | RENDERING.keys()
    options = {**SCENE, **DESIGN, **RENDERING}
    for table, types in ((options, RenderOptions), (BUILD, BuildOptions)):
        for name, kind in get_type_hints(types).items():
            of = table[name].kind
            if get_origin(kind) is Literal:
                assert set(get_args(kind)) == set(of.names if isinstance(of, Choice) else of.numbers)
            else:
                assert (kind is bool) == isinstance(of, Truth)
                assert not isinstance(of, Few)
    # A scene file has all lights in [[lights]].
    assert {name for name, of in options.items() if not of.key} == {"point_lights", "spot_lights"}
    keys = [option.key for option in options.values() if option.key]
    assert len(set(keys)) == len(keys)


def test_options_of_a_build_are_its_fields():
    """Options have the same defaults as the fields.

    For a core ``None`` means the geometry's default, and the coarse test is a size.
    """
    fields = {field.name: field.default for field in dataclasses.fields(Build)}
    assert fields.keys() - BUILD.keys() - DESIGN.keys() == {"exponent", "geometry_style"}
    for name, option in (BUILD | DESIGN).items():
        if name in fields and name != "top":
            assert option.default == fields[name]
    of_design = {field.name for field in dataclasses.fields(blysk.Design)}
    assert BUILD.keys() - fields.keys() == {"geometry"}
    assert not of_design & fields.keys()


def test_a_scene_warns_of_what_is_not_read(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\np 1\n")
    with pytest.warns(RuntimeWarning, match="^a is drawn without: statements: p$"):
        blysk.scene(path)
    (told,) = blysk.render(path, size=(16, 12)).figures["ignored"]
    assert told == "statements: p"


def test_frame_is_that_of_the_model(frame):
    expected = model_frame(frame.scene, frame.design)
    np.testing.assert_array_equal(frame.image, expected.image)
    assert frame.design == preset("quotient", "blinn", transfer="srgb")
    assert frame.error == compare(frame.scene, frame.design, expected).method_error
    assert (frame.spans, frame.pixels) == (expected.spans, expected.pixels)
    assert frame.cycles == frame.figures["cycles"] > frame.pixels
    assert frame.scene.materials[0].exponent == frame.figures["exponent"] == 200
    assert (frame.engine, frame.figures["mesh"]) == ("cxxrtl", "teapot")


def test_frame_in_a_notebook(frame):
    for png in (frame._repr_png_(), base64.b64decode(re.search(r"base64,([^\"]+)", frame._repr_html_())[1])):
        np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(png))), frame.image)
    assert f"{frame.cycles:,}" in frame._repr_html_()
    assert f"{frame.error.max_lsb:.3f} LSB" in frame._repr_html_()
    assert repr(frame) == f"<RenderedFrame teapot 64x48, quotient, blinn, {frame.cycles:,} cycles>"


def test_command_line_prints_and_writes_the_same(frame, tmp_path, capsys):
    options = ["--exponent", "200", "--triangles", "500", "--size", "64x48"]
    assert main(["render", "teapot", *options, "-o", str(tmp_path / "a.png")]) == 0
    short = capsys.readouterr().out.splitlines()
    assert len(short) <= 8
    assert any(f"{frame.cycles:,}" in line for line in short)
    assert any(f"{frame.error.max_lsb:.2f}" in line for line in short)
    assert main(["render", "teapot", *options, "-v", "-o", str(tmp_path / "a.png")]) == 0
    frame.save(tmp_path / "b.png")
    frame.save_comparison(tmp_path / "c.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    with Image.open(tmp_path / "c.png") as picture:
        assert picture.width > 3 * 64
    varying = ("simulated", "seconds", "frame")
    printed = [line for line in capsys.readouterr().out.splitlines() if not line.startswith(varying)]
    assert printed == [line for line in str(frame).splitlines() if not line.startswith(varying)]


@pytest.mark.ci
@pytest.mark.long
def test_design_and_verilog(capsys):
    options = {"lights": 2, "materials": 3, "gate": True, "style": "compact", "setup_interval": 5}
    design = blysk.design(method="quadratic", **options)
    build = Build(style="compact", setup_interval=5)
    assert design == preset("quadratic", "blinn", transfer="srgb", **options)
    assert design.build == build
    assert blysk.design(transfer="linear") == preset("quotient", "blinn") == preset() == blysk.Design()
    assert main(["verilog", "--method", "linear", "--name", "core"]) == 0
    assert blysk.verilog(blysk.design(method="linear"), name="core") == capsys.readouterr().out


@pytest.mark.long
def test_scene_files_scenes_and_meshes(tmp_path):
    """A scene file, its scene, and its mesh with the same options give the same picture."""
    path = tmp_path / "a.toml"
    path.write_text(
        "size = [16, 12]\nbackground = 1\n[mesh]\nfile = 'teapot'\ntriangles = 100\n"
        "[camera]\nposition = [9, 5, 9]\n[material]\nexponent = 9\n[pipeline]\nmethod = 'linear'\n"
    )
    of_file = blysk.render(path)
    scene = blysk.scene(path)
    assert (scene.width, scene.materials[0].exponent, scene.background) == (16, 9, (1, 1, 1))
    mesh = load_mesh("teapot", triangles=100).mesh
    options = {"size": np.array([16, 12]), "background": "#ffffff", "position": (9, 5, 9), "exponent": 9}
    linear = blysk.design(method="linear")
    assert of_file.design == linear
    for other in (
        blysk.render(scene, design=linear),
        blysk.render(blysk.scene(mesh, **options), method="linear"),
    ):
        np.testing.assert_array_equal(other.image, of_file.image)
        assert other.cycles == of_file.cycles
    # A view replaces the file's position. The view None does not.
    plain = {"background": 1, "exponent": 9, "view": (1, 1, 0)}
    seen = blysk.scene(path, view=(1, 1, 0), position=None)
    assert seen.camera == blysk.scene(mesh, size=(16, 12), **plain).camera != scene.camera


@pytest.mark.long
def test_specialised_pipeline():
    frame = blysk.render("teapot", method="linear", specular=0, specialise=True, engine="pysim", **TINY)
    saved = frame.figures["specialisation"]
    assert saved["different_pixels"] == 0
    assert saved["specialised"]["cells"] < saved["full"]["cells"]
    assert frame.design.specular is not None
    assert "left out    no specular path" in str(frame)


@pytest.mark.long
def test_waveforms(tmp_path):
    frame = blysk.render("teapot", method="linear", vcd=tmp_path / "a.vcd", **TINY)
    assert frame.engine == "pysim"
    assert "$enddefinitions" in (tmp_path / "a.vcd").read_text()


@pytest.mark.long
def test_without_a_compiler(monkeypatch, uninstalled):
    """Without a compiler pysim draws a smaller picture, with a warning. A given scene keeps its size."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CXX", raising=False)
    uninstalled("ziglang")
    monkeypatch.setattr("blysk.sim.api.render.SLOW_SIZE", (8, 8))
    with pytest.warns(RuntimeWarning, match=r"^pysim at 8x6 instead of cxxrtl, no working C\+\+ compiler"):
        frame = blysk.render("teapot", method="linear", **TINY)
    assert (frame.engine, frame.image.shape) == ("pysim", (6, 8, 3))
    scene = blysk.scene(triangles=100, size=(9, 7))
    with pytest.warns(RuntimeWarning, match=r"^pysim instead of cxxrtl"):
        assert blysk.render(scene, method="linear").image.shape == (7, 9, 3)
    with pytest.raises(blysk.CompilerMissing):
        blysk.render("teapot", method="linear", engine="cxxrtl", **TINY)


@pytest.mark.long
def test_several_pipelines_give_the_same_picture():
    """Several pipelines take fewer cycles, and the figures name their number."""
    options = {"size": (64, 48), "triangles": 400}
    one, two = (blysk.render("teapot", pipes=pipes, **options) for pipes in (1, 2))
    np.testing.assert_array_equal(two.image, one.image)
    assert one.pixels == two.pixels
    assert two.cycles < 0.8 * one.cycles
    assert (one.figures["pipes"], two.figures["pipes"]) == (1, 2)
    assert any(line.endswith(", 2 pipelines") for line in two.lines())


@pytest.mark.long
@pytest.mark.parametrize(("lanes", "share"), [(2, 0.8), (4, 0.5)])
def test_several_lanes_give_the_same_picture(lanes, share):
    """Several lanes take fewer cycles, and the figures name their number."""
    options = {"size": (160, 120), "triangles": 400}
    one, several = (blysk.render("teapot", lanes=number, **options) for number in (1, lanes))
    np.testing.assert_array_equal(several.image, one.image)
    assert one.pixels == several.pixels
    assert several.cycles < share * one.cycles
    assert (one.figures["lanes"], several.figures["lanes"]) == (1, lanes)
    assert any(line.endswith(f", {lanes} lanes") for line in several.lines())


@pytest.mark.long
def test_two_lanes_of_hardware_geometry_give_the_same_picture():
    """Two lanes behind geometry and depth test draw the picture of one lane in fewer cycles."""
    options = {"size": (160, 120), "triangles": 400, "geometry": "hardware", "setups": 2}
    one, two = (blysk.render("teapot", lanes=lanes, **options) for lanes in (1, 2))
    np.testing.assert_array_equal(two.image, one.image)
    assert one.pixels == two.pixels
    assert one.figures["counts"] == two.figures["counts"]
    assert two.cycles < 0.8 * one.cycles
    assert any(", 2 lanes" in line for line in two.lines())


SCENE_OF_ITS_OWN = blysk.scene(**TINY)


@pytest.mark.parametrize(
    ("source", "options", "line"),
    [
        ("teapot", {"exponent": 0}, "exponent 0: out of range; give a whole number from 1 to 1000"),
        ("teapot", {"method": "x"}, f"method 'x': unknown; use one of {next(iter(METHODS))}, "),
        ("teapot", {"size": 5}, "size 5: not a size; "),
        ("teapot", {"background": "red"}, "background 'red': not a colour; "),
        ("teapot", {"gate": 1}, "gate 1: neither true nor false; "),
        ("teapot", {"up": (0, 0, 0)}, "up [0, 0, 0]: not a direction; "),
        ("teapot", {"lights": [{"position": 3}]}, "lights: [1].position, 3 is not three numbers; "),
        ("teapot", {"lights": [{}]}, "lights: [1].direction, is missing; "),
        (
            "teapot",
            {"position": (1, 2, 3), "view": (1, 2, 3)},
            "view 1,2,3: the camera also has a position; ",
        ),
        ("teapot", {"target": (1, 2, 3)}, "target 1,2,3: the camera has no position; "),
        (
            "teapot",
            {"method": "linear", "model": "phong"},
            "model phong: method linear finds N.H, not R.V; use method quotient; or phong_coplanar, ",
        ),
        (
            "teapot",
            {"method": "angular", "operand": "cosine"},
            "operand cosine: method angular finds no normals",
        ),
        (
            "teapot",
            {"viewer": "near", "method": "quotient"},
            "method quotient: point lights and a near viewer need ",
        ),
        ("teapot", {"pipes": 3}, "pipes 3: not one of the choices; give one of 1, 2, 4, 8"),
        ("teapot", {"pipes": 16}, "pipes 16: out of range; give one of 1, 2, 4, 8"),
        ("teapot", {"pipes": 8, "size": (40, 7)}, "pipes 8: the picture has 7 rows; give at most one for "),
        ("teapot", {"pipes": 2, "geometry": "hardware"}, "geometry hardware: triangles go to one pipeline; "),
        ("teapot", {"lanes": 3}, "lanes 3: not one of the choices; give one of 1, 2, 4"),
        ("teapot", {"lanes": 4, "pipes": 2}, "lanes 4: several pipelines give single pixels; leave out "),
        (
            "teapot",
            {"lanes": 4, "geometry": "hardware"},
            "lanes 4: the renderer serves at most two lanes; take two lanes, or use spans",
        ),
        ("teapot", {"lanes": 2, "method": "linear"}, "lanes 2: method linear makes single pixels; take the "),
        ("teapot", {"lanes": 2, "style": "compact"}, "lanes 2: a pixel of the compact style takes several "),
        (
            "teapot",
            {"lanes": 2, "geometry": "hardware", "style": "compact"},
            "lanes 2: a pixel of the compact style takes several cycles; use the throughput style",
        ),
        ("teapot", {"short_words": True}, "short_words: nothing is specialised; "),
        ("teapot", {"vcd": "a", "engine": "cxxrtl"}, "vcd: the engine cxxrtl writes no waveforms; "),
        ("no.toml", {}, "no.toml: there is no such file; "),
        ("no.obj", {"triangles": 100}, "triangles 100: only the teapot is tessellated; "),
        (SCENE_OF_ITS_OWN, {"exponent": 3}, "exponent 3: the scene has its own; "),
        (
            SCENE_OF_ITS_OWN,
            {"design": preset(), "method": "quotient"},
            "method: the design has its own; ",
        ),
        (SCENE_OF_ITS_OWN, {"design": preset(materials=2)}, "design: the "),
    ],
    ids=str,
)
def test_bad_input_is_one_line(source, options, line):
    with pytest.raises(blysk.InputError) as error:
        blysk.render(source, **options)
    assert str(error.value).startswith(line)
    assert "\n" not in str(error.value)


def test_other_refusals(tmp_path):
    with pytest.raises(OptionError, match=r"^lights 17: out of range"):
        blysk.design(lights=17)
    with pytest.raises(OptionError, match=r"^name 1up: not a Verilog name"):
        blysk.verilog(name="1up")
    with pytest.raises(OptionError, match=r"^pipes 4: triangles go to one pipeline"):
        blysk.verilog(geometry="hardware", pipes=4)
    with pytest.raises(OptionError, match=r"^merged: one pipeline has one stream"):
        blysk.verilog(merged=True)
    with pytest.raises(TypeError, match="there is no option 'shine'; use one of method, "):
        blysk.design(shine=3)
    path = tmp_path / "a.toml"
    path.write_text("[mesh]\nfile = 'teapot'\n[camera]\nview = [1, 0, 0]\nposition = [1, 0, 0]\n")
    with pytest.raises(
        blysk.InputError, match=re.escape(f"{path}, camera.view: the camera also has a position")
    ):
        blysk.scene(path)
