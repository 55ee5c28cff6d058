"""Scene files: their contents, and every kind of mistake in them."""

import os
import re
import textwrap
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.presets import METHODS, MODELS
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.transfer import color_of_text
from blysk.sim.api.options import DESIGN, RENDERING, SCENE
from blysk.sim.api.scene_file import MAX_BYTES, read_scene_file
from blysk.sim.errors import InputError

EXAMPLE = textwrap.dedent(read_scene_file.__doc__.partition("::\n\n")[2].partition("    The values have")[0])
MESH = '[mesh]\nfile = "teapot"\n'
EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.toml"))


@pytest.fixture
def write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(content):
        Path("a.toml").write_bytes(content if isinstance(content, bytes) else content.encode())
        return "a.toml"

    return write


def test_documented_example(write):
    file = read_scene_file(write(EXAMPLE))
    assert file.path == "a.toml"
    assert file.values == {
        "size": (640, 480),
        "background": tuple(color_of_text("#1a1c20")),
        "ambient_light": (1.0, 1.0, 1.0),
        "back_faces": "flip",
        "mesh": "teapot",
        "triangles": 10000,
        "crease": 40.0,
        "materials": "file",
        "projection": "perspective",
        "view": (0.4, 0.5, 1.0),
        "up": (0.0, 1.0, 0.0),
        "field_of_view": 30.0,
        "viewer": "distant",
        "lights": (Light((-0.5, 0.8, 0.7)),),
        "ambient": (0.08, 0.05, 0.03),
        "diffuse": (0.75, 0.42, 0.2),
        "specular": (0.6, 0.6, 0.6),
        "exponent": 50,
        "method": "quotient",
        "model": "blinn",
        "style": "throughput",
        "transfer": "srgb",
        "gate": False,
    }
    assert file.keys["mesh"] == "mesh.file"
    assert file.keys["exponent"] == "material.exponent"
    assert file.keys["lights"] == "lights"


def test_documented_example_has_every_key(write):
    """An option that is left out stands in a comment, with its default if it is in [pipeline]."""
    parts = re.split(r"^\[+(\w+)\]+.*$", EXAMPLE, flags=re.M)
    sections = dict(zip(["", *parts[1::2]], parts[::2], strict=True))
    for option in (SCENE | DESIGN | RENDERING).values():
        section, _, key = option.key.rpartition(".")
        if option.key != "lights":
            assert not key or re.search(rf"^(# )?(\w+, )?{key}\b", sections[section], re.M)
    pipeline = re.sub(r"^# ", "", sections["pipeline"], flags=re.M)
    values = read_scene_file(write(f"{MESH}[pipeline]\n{pipeline}")).values
    shown = {"method": "quotient", "operand": "cosine", "setup_interval": 4}
    for name, option in (DESIGN | RENDERING).items():
        assert values[name] == shown.get(name, option.default)


def test_only_what_is_there(write):
    assert read_scene_file(write(MESH)).values == {"mesh": "teapot"}
    # As an editor on Windows writes it.
    windows = b"\xef\xbb\xbf" + MESH.replace("\n", "\r\n").encode()
    assert read_scene_file(write(windows)).values == {"mesh": "teapot"}


@pytest.mark.parametrize(
    ("scene", "mesh", "expected"),
    [
        ("a.toml", "x.obj", "x.obj"),
        ("folder/a.toml", "x.obj", "folder/x.obj"),
        ("folder/a.toml", "../x.obj", "folder/../x.obj"),
        ("folder/a.toml", "/tmp/x.obj", "/tmp/x.obj"),
        ("folder/a.toml", "./teapot", "folder/./teapot"),
        ("folder/a.toml", "teapot", "teapot"),
    ],
)
def test_mesh_starts_at_the_scene_files_folder(tmp_path, monkeypatch, scene, mesh, expected):
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path(scene).write_text(f'mesh.file = "{mesh}"\n')
    assert read_scene_file(scene).values["mesh"] == expected


def test_values_are_those_of_their_text(write):
    file = read_scene_file(
        write(
            "background = 0.25\nlights = []\n"
            + MESH
            + "[camera]\nposition = [0, -1.5, 3]\ntarget = [0, 0, 0]\nprojection = 'orthographic'\n"
        )
    )
    assert file.values["background"] == (0.25, 0.25, 0.25)
    assert file.values["lights"] == ()
    assert file.values["position"] == (0.0, -1.5, 3.0)
    assert file.values["target"] == (0.0, 0.0, 0.0)
    two = "[[lights]]\ndirection = [1, 2, 3]\n[[lights]]\ndirection = [0, 0, 1]\ncolor = '#ff0080'\n"
    assert read_scene_file(write(two + MESH)).values["lights"] == (
        Light((1.0, 2.0, 3.0)),
        Light((0.0, 0.0, 1.0), "#ff0080"),
    )


def test_point_lights(write):
    """Point lights stand beside other lights, in their order. A position may be the origin."""
    text = """
    [camera]
    viewer = "near"
    [[lights]]
    position = [0, 0, 0]
    [[lights]]
    direction = [1, 2, 3]
    color = 2
    [[lights]]
    position = [1, -2, 3.5]
    color = [0.5, 0, 4]
    [[lights]]
    position = [1, 2, 3]
    attenuation = [0.5, 0, 2]
    spot = [0, -2, 0]
    cone = [5, 10.5]
    """
    file = read_scene_file(write(MESH + text))
    assert file.values["viewer"] == "near"
    assert file.values["lights"] == (
        Light(position=(0, 0, 0)),
        Light((1, 2, 3), (2, 2, 2)),
        Light(position=(1, -2, 3.5), color=(0.5, 0, 4)),
        Light(position=(1, 2, 3), attenuation=(0.5, 0, 2), spot=(0, -1, 0), cone=(5, 10.5)),
    )
    assert file.keys["viewer"] == "camera.viewer"
    assert read_scene_file(write("lights = []\n" + MESH)).values == {"mesh": "teapot", "lights": ()}


def test_every_method_and_model_can_be_named(write):
    for method in METHODS:
        assert read_scene_file(write(f"{MESH}[pipeline]\nmethod = '{method}'")).values["method"] == method
    for model in MODELS:
        assert read_scene_file(write(f"{MESH}[pipeline]\nmodel = '{model}'")).values["model"] == model


BAD = {
    "": ("a.toml, mesh.file", "is missing; name a mesh file, or teapot"),
    "[mesh]": ("a.toml, mesh.file", "is missing"),
    "[mesh": ("a.toml", "is not TOML"),
    "a = " + "[" * 5000: ("a.toml", "is nested too deeply"),
    "a = " + "9" * 5000: ("a.toml", "is not TOML"),
    "a = 1\na = 2": ("a.toml", "is not TOML"),
    "mesh = 'teapot'": ("a.toml, mesh", "'teapot' is not a table; write [mesh]"),
    "mesh = [1]": ("a.toml, mesh", "[1] is not a table"),
    "mesh.file = 3": ("a.toml, mesh.file", "3 is not text"),
    "mesh.file = ''": ("a.toml, mesh.file", "is not a file name"),
    "mesh.file = '/'": ("a.toml, mesh.file", "is not a file name"),
    'mesh.file = "a\\nb.obj"': ("a.toml, mesh.file", "is not a file name"),
    'mesh.file = "a\\u0000.obj"': ("a.toml, mesh.file", "is not a file name"),
    "shine = 3": ("a.toml, shine", "unknown key; use one of size, background, "),
    '"a\\nb" = 3': ("a.toml, 'a\\nb'", "unknown key"),
    '"" = 3': ("a.toml, ''", "unknown key"),
    "material.colour = 3": ("a.toml, material.colour", "use one of ambient, diffuse, specular, exponent"),
    "[[materials]]\nexponent = 3": ("a.toml, materials", "give one [material]"),
    "size = 640": ("a.toml, size", '640 is not a size; give [width, height] or "WIDTHxHEIGHT"'),
    "size = [640]": ("a.toml, size", "[640] is not a size"),
    "size = [640, 480.0]": ("a.toml, size", "[640, 480.0] is not a whole number"),
    "size = [true, 480]": ("a.toml, size", "[true, 480] is not a whole number"),
    "size = [0, 480]": ("a.toml, size", "[0, 480] is out of range; give [width, height]"),
    "size = [640, 4096]": ("a.toml, size", "[640, 4096] is out of range"),
    "size = [640, -0x" + "f" * 9000 + "]": ("a.toml", "is not TOML"),
    "size = [640, 0x" + "f" * 9000 + "]": ("a.toml, size", "out of range"),
    "background = '#12345'": ("a.toml, background", "'#12345' is not a colour"),
    "background = [1, 1]": ("a.toml, background", "] is not a colour"),
    "background = [1, 1, 1.01]": ("a.toml, background", "out of range"),
    "background = nan": ("a.toml, background", "nan is out of range"),
    "background = 2026-11-21": ("a.toml, background", "2026-11-21 is not a number"),
    "ambient_light = 9": ("a.toml, ambient_light", "9 is out of range"),
    "back_faces = 'hide'": ("a.toml, back_faces", "'hide' is unknown; use one of flip, show, cull"),
    "back_faces = []": ("a.toml, back_faces", "] is unknown"),
    "mesh.triangles = 63": ("a.toml, mesh.triangles", "from 64 to 4000000"),
    "mesh.crease = 181": ("a.toml, mesh.crease", "give 0 to 180 degrees"),
    "camera.projection = 'flat'": ("a.toml, camera.projection", "orthographic, perspective"),
    "camera.view = [0, 0, 0]": ("a.toml, camera.view", "not a direction"),
    "camera.view = [0, inf, 0]": ("a.toml, camera.view", "out of range"),
    "camera.view = [0, 0x" + "f" * 9000 + ", 0]": ("a.toml, camera.view", "out of range"),
    "camera.view = [0, '1', 0]": ("a.toml, camera.view", "[0, '1', 0] is not a number"),
    "camera.field_of_view = 180": ("a.toml, camera.field_of_view", "give 1 to 179 degrees"),
    "camera.field_of_view = 0": ("a.toml, camera.field_of_view", "give 1 to 179 degrees"),
    "lights = 3": ("a.toml, lights", "3 is not a light"),
    "lights = [3]": ("a.toml, lights[1]", "[3] is not three or six numbers"),
    "lights = [{color = 1}]": ("a.toml, lights[1].direction", "is missing"),
    "lights = [{direction = [1, 0, 0]}, {direction = [0, 0, 0]}]": (
        "a.toml, lights[2].direction",
        "not a direction",
    ),
    "lights = [{direction = [1, 0, 0], color = -1}]": ("a.toml, lights[1].color", "of 0 or more"),
    "lights = [{position = [1, 0, 0], spot = [0, 1, 0], cone = [3, 2]}]": ("a.toml, lights[1]", "3 and 2; "),
    "lights = [{position = [1, 0, 0], cone = [1, 2]}]": ("a.toml, lights[1]", "cone needs the direction of"),
    "lights = [{position = [1, 0, 0], cone = [1]}]": (
        "a.toml, lights[1].cone",
        'give two angles or "INNER,OUTER"',
    ),
    "lights = [{position = [1, 0, 0], attenuation = [1, 0, -1]}]": ("a.toml, lights[1]", "at least 0, not"),
    "lights = [{direction = [1, 0, 0], attenuation = [1, 1, 0]}]": ("a.toml, lights[1]", "give it a posit"),
    "lights = [{direction = [1, 0, 0], bulb = 1}]": (
        "a.toml, lights[1].bulb",
        "use one of direction, position, color",
    ),
    "lights = [{direction = [1, 0, 0], position = [1, 0, 0]}]": (
        "a.toml, lights[1]",
        "holds both direction and position; leave one of them out",
    ),
    "lights = [{position = [1, 0]}]": ("a.toml, lights[1].position", "] is not three numbers"),
    "lights = [{position = [1, 0, nan]}]": ("a.toml, lights[1].position", "out of range"),
    "camera.viewer = 'far'": ("a.toml, camera.viewer", "'far' is unknown; use one of distant, near"),
    "lights = [" + "{direction = [1, 0, 0]}," * (MAX_LIGHTS + 1) + "]": ("a.toml, lights", "at most 16"),
    "material.exponent = 0": ("a.toml, material.exponent", "from 1 to 1000"),
    "material.exponent = 50.0": ("a.toml, material.exponent", "not a whole number"),
    "material.specular = 1.5": ("a.toml, material.specular", "from 0 to 1"),
    "pipeline.method = 'slurp'": ("a.toml, pipeline.method", f"use one of {next(iter(METHODS))}, "),
    "pipeline.model = 'shiny'": ("a.toml, pipeline.model", "'shiny' is unknown"),
    "pipeline.operand = 'cross'": ("a.toml, pipeline.operand", "cosine, one_minus_cosine"),
    "pipeline.setup_interval = 0": ("a.toml, pipeline.setup_interval", "from 1 to 46"),
    b"a = '\xff'": ("a.toml", "is not UTF-8 (line 1)"),
    b"a\0b": ("a.toml", "is not TOML"),
    b"#" * (MAX_BYTES + 1): ("a.toml", "is over 100,000 bytes"),
}


@pytest.mark.parametrize(
    "data",
    [
        b"\xef\xbb\xbf\r\n [mesh]\r\nfile = 'teapot'\r\n",
        b"# C:\\scenes\\\r[mesh]\rfile = 'teapot'\r",
        "[mesh]\nfile = 'teapot'\n".encode("utf-16"),
    ],
    ids=["mark and CR LF", "CR", "UTF-16"],
)
def test_text_however_it_was_saved(write, data):
    assert read_scene_file(write(data)).values == {"mesh": "teapot"}


@pytest.mark.parametrize("content", BAD, ids=lambda content: str(content[:40]))
def test_bad_file(write, content):
    thing, says = BAD[content]
    with pytest.raises(InputError) as error:
        read_scene_file(write(content))
    assert error.value.thing == thing
    assert says in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


def test_no_file(write, tmp_path):
    missing = "there is no such file; check the path"
    for path, says in (("no.toml", missing), (".", "is a folder; name a scene file in it"), ("a\0", missing)):
        with pytest.raises(InputError, match=re.escape(f": {says}")):
            read_scene_file(path)
    if hasattr(os, "mkfifo"):
        os.mkfifo("pipe.toml")
        with pytest.raises(InputError, match="is not a regular file"):
            read_scene_file("pipe.toml")
    if hasattr(os, "geteuid") and os.geteuid() != 0:
        Path(write(MESH)).chmod(0)
        with pytest.raises(InputError, match="Permission denied"):
            read_scene_file("a.toml")


def test_largest_file(write):
    content = MESH.encode()
    assert read_scene_file(write(content + b"#" * (MAX_BYTES - len(content)))).values == {"mesh": "teapot"}


TOKENS = re.findall(r"[A-Za-z_]+|[0-9.]+|\n|[^\w\s]", EXAMPLE)
ODD = [
    *("nan", "-inf", "true", "1e999", "0x" + "f" * 400, "1979-05-27", "'''", '"""', "[[", "{", "\0"),
    *("-0", "''", "[]", "{}", "[[lights]]", "[mesh]", "position", "target", "1_000", "\\", '"\\uD800"'),
]


@pytest.mark.ci
@pytest.mark.long
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_mutated_files_are_read_or_refused_in_one_line(write, data):
    """The documented file with pieces replaced, left out or inserted, and bytes changed, never gives a
    traceback."""
    pieces = re.split(r"([A-Za-z_]+|[0-9.]+|[^\w\s])", EXAMPLE)
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(pieces) - 1))
        pieces[place] = data.draw(st.sampled_from([*ODD, *TOKENS, ""]) | st.text(max_size=8))
    content = bytearray("".join(pieces), "utf-8", "surrogatepass")
    if data.draw(st.booleans()):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    try:
        file = read_scene_file(write(bytes(content)))
    except InputError as error:
        refusal = error
    else:
        assert file.values.keys() == file.keys.keys()
        assert "mesh" in file.values
        return
    assert refusal.thing.startswith("a.toml")
    assert str(refusal).isprintable()


NUMBERS = st.floats(-1e300, 1e300, allow_nan=False)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS).filter(any)


def colors(most):
    shares = st.floats(0, most)
    return st.tuples(shares, shares, shares)


LIGHTS = st.lists(st.tuples(VECTORS, st.none() | colors(1e300)), max_size=MAX_LIGHTS)
VALUES = {
    "size": st.tuples(st.integers(1, 4095), st.integers(1, 4095)),
    "background": colors(1),
    "ambient_light": colors(8),
    "back_faces": st.sampled_from(["flip", "show", "cull"]),
    "mesh.crease": st.floats(0, 180),
    "mesh.materials": st.sampled_from(["file", "one"]),
    "mesh.triangles": st.integers(64, 4_000_000),
    "camera.projection": st.sampled_from(["perspective", "orthographic"]),
    "camera.view": VECTORS,
    "camera.up": VECTORS,
    "camera.field_of_view": st.floats(1, 179),
    "camera.viewer": st.sampled_from(["distant", "near"]),
    "material.ambient": colors(1),
    "material.diffuse": colors(1),
    "material.specular": colors(1),
    "material.exponent": st.integers(1, 1000),
    "pipeline.method": st.sampled_from(sorted(METHODS)),
    "pipeline.model": st.sampled_from(sorted(MODELS)),
    "pipeline.operand": st.sampled_from(["cosine", "one_minus_cosine"]),
    "pipeline.setup_interval": st.integers(1, 46),
    "pipeline.style": st.sampled_from(["throughput", "compact"]),
    "pipeline.gate": st.booleans(),
    "pipeline.specialise": st.booleans(),
    "pipeline.short_words": st.booleans(),
    "pipeline.lanes": st.sampled_from([1, 2, 4]),
    "pipeline.pipes": st.sampled_from([1, 2, 4, 8]),
}


def toml(value):
    """A value as TOML has it, with every bit of a float."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(toml, value))}]"
    return str(value).lower() if isinstance(value, bool) else repr(value)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(values=st.fixed_dictionaries({}, optional=VALUES), lights=st.none() | LIGHTS)
def test_what_is_written_is_read(write, values, lights):
    """Every key with any value of its range is read as it was written, to the bit."""
    lines = ["mesh.file = 'teapot'", *(f"{key} = {toml(value)}" for key, value in values.items())]
    expected = {"mesh": "teapot"} | {key.split(".")[-1]: value for key, value in values.items()}
    if lights is not None:
        lines += ["lights = []"] * (not lights)
        for direction, color in lights:
            lines += ["[[lights]]", f"direction = {toml(direction)}"]
            lines += [f"color = {toml(color)}"] if color else []
        expected["lights"] = tuple(Light(direction, color or (1, 1, 1)) for direction, color in lights)
    assert read_scene_file(write("\n".join(lines))).values == expected


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=200))
def test_any_bytes_are_refused_in_one_line(write, content):
    with pytest.raises(InputError) as error:
        read_scene_file(write(content))
    assert str(error.value).isprintable()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_examples_are_read(path):
    file = read_scene_file(path)
    assert file.values["mesh"] == "teapot" or Path(file.values["mesh"]).is_file()


def test_there_are_examples():
    assert EXAMPLES
