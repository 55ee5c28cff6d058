"""Python takes the text of the command line and Python values; its refusals name both."""

import inspect
import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image

import blysk
from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.api.options import DESIGN, NEEDS, RENDERING, SCENE
from blysk.sim.api.placed import read_store
from blysk.sim.meshes.mesh import given_mesh, load_mesh

TINY = {"triangles": 100}
KEY = blysk.Light((0, 1, 0))


def test_a_text_is_the_value_that_it_says():
    words = {
        "size": "64x48",
        "background": "#ff0000",
        "ambient_light": "0.5",
        "triangles": "100",
        "view": "1,2,3",
        "up": "z",
        "field_of_view": "40",
        "lights": "0,1,0",
        "diffuse": "0.1,0.2,0.3",
        "exponent": "70",
        "fresnel": "0.04",
    }
    values = {
        "size": np.array([64, 48]),
        "background": (1, 0, 0),
        "ambient_light": 0.5,
        "triangles": np.int64(100),
        "view": [1, 2, 3],
        "up": (0, 0, 1),
        "field_of_view": 40,
        "lights": [KEY],
        "diffuse": np.array([0.1, 0.2, 0.3]),
        "exponent": 70,
        "fresnel": 0.04,
    }
    said, given = blysk.scene(**words), blysk.scene(**values)
    for name in ("width", "height", "background", "ambient_light", "camera", "lights", "material"):
        assert getattr(said, name) == getattr(given, name), name
    assert (said.width, said.height) == (64, 48)
    assert blysk.design(lights="2", materials="3") == blysk.design(lights=2, materials=3)


def test_a_scene_file_takes_the_texts(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text('size = "64x48"\nlights = ["0,1,0"]\n[mesh]\nfile = "teapot"\ntriangles = 100\n')
    made = blysk.scene(path)
    assert (made.width, made.height, made.lights) == (64, 48, (KEY,))


@pytest.mark.parametrize(
    "lights",
    [
        KEY,
        (0, 1, 0),
        ["0,1,0"],
        [(0, 1, 0, 1, 1, 1)],
        np.array([[0, 2, 0]]),
        {"direction": "0,1,0"},
        [{"direction": np.array([0, 1, 0]), "color": "#ffffff"}],
    ],
    ids=str,
)
def test_lights_in_every_form(lights):
    assert blysk.scene(lights=lights, **TINY).lights == (KEY,)


def test_lights_of_other_kinds():
    point, spot = "3,4,5,1,0,0", (3, 6, 5, -3, -5, -5, 8, 14)
    made = blysk.scene(lights="0,1,0", point_lights=point, spot_lights=[spot], **TINY)
    alone = blysk.scene(point_lights=[(3, 4, 5, 1, 0, 0)], **TINY)
    assert made.lights[0] == KEY
    # The scene's unit differs from the mesh's by a power of two.
    assert alone.lights == made.lights[1:2]
    assert made.lights[1].color == (1, 0, 0)
    assert made.lights[2].cone == (8, 14)
    assert not {light.position is None for light in made.lights[1:]} - {False}


V = [[-1.0, -1, 0], [1, -1, 0], [0, 1, 0.5]]
F = [[0, 1, 2]]


def same(mesh, expected):
    for name in ("vertices", "faces", "normals"):
        np.testing.assert_array_equal(getattr(mesh, name), getattr(expected, name), name)


def test_meshes_of_arrays_and_of_trimesh_are_those_of_a_file(tmp_path):
    box = trimesh.creation.icosphere(1)
    box.apply_translation((1, 2, 3))
    path = tmp_path / "a.obj"
    lines = [f"v {' '.join(map(repr, map(float, v)))}" for v in box.vertices]
    path.write_text("\n".join([*lines, *(f"f {' '.join(str(k + 1) for k in f)}" for f in box.faces)]))
    expected = load_mesh(str(path)).mesh
    plain = trimesh.Trimesh(box.vertices, box.faces, process=False)
    same(given_mesh(plain).mesh, expected)
    same(given_mesh(trimesh.Scene(plain)).mesh, expected)
    same(given_mesh((box.vertices, box.faces)).mesh, expected)
    same(given_mesh((expected.vertices.tolist(), expected.faces, expected.normals)).mesh, expected)
    same(blysk.Mesh(V, F, [[0, 0, 1]] * 3), blysk.Mesh(*map(np.array, (V, F, [[0.0, 0, 1]] * 3))))
    # Flaws are repaired and counted as those of a file.
    assert given_mesh((V, [*F, [0, 0, 1]], np.zeros((3, 3)))).repaired_normals == 3


def test_a_frame_of_arrays():
    frame = blysk.render((V, F), size="16x12", crease="0")
    assert (frame.name, frame.image.shape) == ("arrays", (12, 16, 3))
    assert frame.error_map.shape == (12, 16)
    assert frame.error_map.max() == pytest.approx(frame.error.max_lsb)
    exact = 255 * frame.comparison.golden
    np.testing.assert_array_equal(frame.error_map, np.abs(frame.image - exact).max(axis=2))
    # The default model comes from a table, so the model adds no error.
    assert frame.total_error == frame.error


def test_a_mesh_with_colours_is_told(recwarn):
    ball = trimesh.creation.icosphere(1)
    ball.visual.face_colors = (255, 0, 0, 255)
    blysk.scene(ball)
    assert "without: materials and colours of trimesh" in str(recwarn.pop(RuntimeWarning).message)


@pytest.mark.parametrize(
    ("source", "options", "says"),
    [
        ("teapot", {"size": "640"}, "size '640': not a size; give (width, height) or \"WIDTHxHEIGHT\", 1 to"),
        ("teapot", {"size": (640, 0)}, 'size [640, 0]: out of range; give (width, height) or "WIDTH'),
        ("teapot", {"view": "1,2"}, "view '1,2': not a direction; give three numbers or \"X,Y,Z\", a vec"),
        ("teapot", {"gate": "on"}, "gate 'on': neither true nor false; give True or False"),
        ("teapot", {"background": "red"}, "background 'red': not a colour; give \"#rrggbb\", red, gre"),
        (
            "teapot",
            {"lights": 5},
            "lights 5: not a light; give a Light, a dict with direction or position,",
        ),
        ("teapot", {"lights": [None]}, "lights: [1], None is not a light; give a Light, a dict"),
        ("teapot", {"lights": "red"}, "lights: [1], 'red' is not three or six numbers; give three or six"),
        ("teapot", {"lights": [(0, 0, 0)]}, "lights: [1], a light's direction must not be 0; give a dir"),
        ("teapot", {"point_lights": "3,4"}, "point_lights: [1], '3,4' is not three, six or nine numbers"),
        ("teapot", {"lights": [KEY] * 9, "spot_lights": [blysk.Light(position=(1, 1, 1))] * 8}, "lights: 17"),
        ("teapot", {"engine": "verilator"}, "engine 'verilator': unknown; use one of auto, cxxrtl, pysim"),
        (5, {}, 'a mesh of type int: cannot be drawn; give "teapot", the name of a mesh or scene'),
        (trimesh.Trimesh(), {}, "trimesh.Trimesh: it has no faces; use a mesh of triangles; "),
        ((V,), {}, 'a mesh of type tuple: cannot be drawn; give "teapot"'),
        (
            (V, [[0, 1, 3]]),
            {},
            "the arrays of a mesh: a face refers to vertex 3, counted from 0, but the number of vertices "
            "is 3; mend",
        ),
        (
            (V, [[0, 1, 1.5]]),
            {},
            "the arrays of a mesh: faces must be whole numbers of shape (count, 3)",
        ),
        ((V, F, [[0, 0, 1]]), {}, "the arrays of a mesh: there are 1 normals for 3 vertices; give (vertices"),
        (([[0, 1]], F), {}, "the arrays of a mesh: vertices must be numbers of shape (count, 3), and are"),
        (([[0, 1, np.inf]] * 3, F), {}, "the arrays of a mesh: 3 of its vertices are NaN or infinite; mend"),
    ],
    ids=str,
)
def test_refusals_name_what_python_takes(source, options, says):
    with pytest.raises(blysk.InputError) as error:
        blysk.render(source, **options)
    assert str(error.value).startswith(says)


def test_help_has_every_option_with_its_default():
    table = {**SCENE, **DESIGN, **RENDERING}
    parameters = inspect.signature(blysk.render).parameters
    assert parameters.keys() - {"source", "design", "engine", "vcd", "progress"} == table.keys()
    assert {name: parameters[name].default for name in table} == {n: of.default for n, of in table.items()}
    text = blysk.render.__doc__
    for name, option in table.items():
        default = "" if option.default is None else f", default {option.default!r}"
        assert re.search(rf"^{name} : .+{re.escape(default)}$", text, re.MULTILINE), name
    assert not re.search("--[a-z]", text)
    assert 'needs method="chord-local"' in " ".join(text.split())
    assert 'setup_interval="' not in text
    assert inspect.signature(blysk.design).parameters.keys() == NEEDS.keys() | DESIGN.keys()
    for function, options in ((blysk.scene, SCENE), (blysk.design, {**NEEDS, **DESIGN})):
        described = re.findall(r"^\s*([a-z_, ]+)( : .*)?$", function.__doc__, re.MULTILINE)
        assert options.keys() <= {name for names, _ in described for name in names.split(", ")}
        for name, words in re.findall(r"^\s*([a-z_]+) : \{(.*)\}", function.__doc__, re.MULTILINE):
            assert set(re.findall(r'"(\w+)"', words)) == set(options[name].kind.names), name


def test_methods_and_models_are_listed():
    assert list(blysk.METHODS) == [*METHODS, *PUBLISHED]
    assert {"blinn", "cosquad", "ggx", "phong"} <= blysk.MODELS.keys()
    for line in (*blysk.METHODS.values(), *blysk.MODELS.values()):
        assert len(line.split()) > 1


def test_a_turntable(tmp_path):
    tiny = {"size": "24x16", "triangles": 100}
    turned = blysk.turntable("teapot", "3", **tiny)
    assert (len(turned), str(turned)) == (3, "<Turntable teapot 3 frames 24x16, quotient, blinn>")
    first = blysk.render("teapot", **tiny)
    np.testing.assert_array_equal(turned[0].image, first.image)
    images = [frame.image for frame in turned]
    assert len({image.tobytes() for image in images}) == 3
    np.testing.assert_array_equal(turned[-1].image, images[2])
    assert turned[2].scene.camera.position != first.scene.camera.position
    path, told = tmp_path / "a.gif", []
    turned.save(path, progress=lambda *counts: told.append(counts))
    assert told == [(1, 3), (2, 3), (3, 3)]
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.size) == (3, (24, 16))
    with pytest.raises(blysk.InputError, match="the animation is a GIF; use a name that ends in"):
        turned.save(tmp_path / "a.png")
    with pytest.raises(blysk.InputError, match=r"^frames 0: out of range; give a whole number"):
        blysk.turntable(frames=0)
    with pytest.raises(blysk.InputError, match="looks along the axis that it would turn about"):
        blysk.turntable(view=(0, 1, 0), **tiny)


def test_a_design_has_its_cost():
    design, same = blysk.design(method="renormalise", transfer="linear"), preset("renormalise")
    assert design == same
    assert same == design
    assert hash(design) == hash(same)
    assert repr(design).removeprefix("Design") == repr(same).removeprefix("ShadingPipeline")
    assert design != preset("linear")
    cost = design.cost()
    unit = ShadingPipelineUnit(same)
    assert (cost.latency, cost.cycles_per_pixel) == (unit.latency, unit.cycles_per_pixel)
    (entry,) = (e for e in read_store() if e["design"] == "pipeline renormalise, blinn, 1 light")
    assert (cost.luts, cost.flip_flops, cost.device) == (entry["luts"], entry["flip_flops"], entry["device"])
    # The mapper makes a multiplier of 18x18 bits of each of these.
    assert cost.multipliers == sum(cost.multiplier_widths.values()) == entry["multipliers"]
    assert f"{entry['luts']:,} LUT" in str(cost)
    # Other devices may have the design as mapped, without a clock rate.
    assert blysk.design(transfer="linear").placed()["device"] == entry["device"]
    # There are no figures of another design. A design with more lights, or another build, was not placed.
    for other in (replace(design, lights=2), design.built(setup_interval=3), replace(design, grey=True)):
        assert isinstance(other, blysk.Design)
        assert other.placed() == {}
