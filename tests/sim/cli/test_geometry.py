"""``--geometry hardware``: triangles to pixels by simulated hardware, and its Verilog."""

import json
from pathlib import Path

import numpy as np
import pytest

import blysk
from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.render import Renderer
from blysk.sim.cli.main import main

from .commandline import SMALL, picture

pytestmark = pytest.mark.usefixtures("folder")

HARDWARE = "--geometry", "hardware"


@pytest.mark.long
@pytest.mark.ci
def test_picture_and_figures(capsys):
    """The picture equals the model's.

    The figures have errors against exact normals of every pixel, counters and cycles.
    """
    assert main(["render", *SMALL, *HARDWARE, "-v", "-o", "a.png", "--json", "a.json"]) == 0
    figures = json.loads(Path("a.json").read_text())
    drawn = blysk.scene("teapot", triangles=500, size=(64, 48))
    model = triangle_frame(drawn, Renderer(blysk.design()))
    np.testing.assert_array_equal(picture("a.png"), model.image)
    assert figures["geometry"] == "hardware"
    assert 0.3 < figures["method_error"]["max_lsb"] < 0.6
    assert "arithmetic_error" not in figures
    assert figures["spans"] == model.counts["spans"]
    assert figures["pixels"] == model.counts["pixels"]
    assert figures["visible_pixels"] == np.count_nonzero(model.owner >= 0)
    assert figures["counts"]["hidden_pixels"] == model.counts["hidden"]
    assert figures["counts"]["cut_spans"] == model.counts["cut"]
    assert 0 < figures["triangle_cycles"] <= figures["cycles"]
    printed = capsys.readouterr().out
    assert f"hardware, took the last triangle after {figures['triangle_cycles']:,} cycles" in printed
    assert "the same method and model in float64" not in printed


@pytest.mark.long
def test_coarse_depth_test():
    """The picture is the same, and fewer pixels are shaded."""
    found = {}
    for name, options in {"plain": [], "coarse": ["--coarse"]}.items():
        arguments = [*SMALL, *HARDWARE, *options, "-o", f"{name}.png", "--json", f"{name}.json"]
        assert main(["render", *arguments]) == 0
        found[name] = json.loads(Path(f"{name}.json").read_text())
    np.testing.assert_array_equal(picture("plain.png"), picture("coarse.png"))
    plain, coarse = found["plain"], found["coarse"]
    assert coarse["pixels"] + coarse["counts"]["dropped_pixels"] == plain["pixels"]
    assert coarse["counts"]["dropped_pixels"] > 0.05 * plain["pixels"]
    # In such a small picture the triangles' setup takes most of the time.
    assert coarse["cycles"] < 1.01 * plain["cycles"]


@pytest.mark.ci
@pytest.mark.long
def test_coarse_depth_test_in_verilog(capsys):
    """The header names the test, and the register map of a bus has the bit that keeps depths."""
    options = ["--top", "render", "--method", "linear", "--coarse", "64x48", "--bus", "axi", "-o", "core.v"]
    assert main(["verilog", *options]) == 0
    assert "coarse depth test: pictures of at most 64x48, 384 words of 36 bits" in Path("core.v").read_text()
    assert "Each frame clears the depths" in Path("core.v").read_text()
    assert "1: the next frame adds to the picture" in Path("core.md").read_text()


@pytest.mark.long
def test_two_setups():
    """The picture is the same in fewer cycles. With spans from software the option is refused."""
    found = {}
    for setups in ("1", "2"):
        options = [*SMALL, *HARDWARE, "--setups", setups, "-o", f"{setups}.png", "--json", f"{setups}.json"]
        assert main(["render", *options]) == 0
        found[setups] = json.loads(Path(f"{setups}.json").read_text())
        assert found[setups]["setups"] == int(setups)
    np.testing.assert_array_equal(picture("1.png"), picture("2.png"))
    assert found["2"]["cycles"] < found["1"]["cycles"]


@pytest.mark.long
def test_turntable():
    """Each frame equals the model's. Errors, cycles and counters are those of all frames."""
    options = [*SMALL, *HARDWARE, "--frames", "2", "--jobs", "1", "-o", "a.gif", "--json", "a.json"]
    assert main(["render", *options]) == 0
    figures = json.loads(Path("a.json").read_text())
    assert figures["geometry"] == "hardware"
    assert "arithmetic_error" not in figures
    assert figures["cycles"] == sum(frame["cycles"] for frame in figures["frames"])
    drawn = blysk.scene("teapot", triangles=500, size=(64, 48))
    model = triangle_frame(drawn, Renderer(blysk.design()))
    assert figures["frames"][0]["pixels"] > 0
    assert picture(figures["frames"][0]["picture"]).shape == model.image.shape
    assert figures["frames"][0]["method_error"]["max_lsb"] < 0.6


@pytest.mark.long
def test_verilog():
    """The core takes triangles, and has pixels and a memory of depths as output."""
    assert main(["verilog", *HARDWARE, "--method", "linear", "-o", "a.v"]) == 0
    text = Path("a.v").read_text()
    header, body = text.split("module blysk (", 1)
    assert "triangles to pixels" in header
    assert "spans with two unit normals" in header
    for port in ("i_normal_2_2", "memory_read_data", "status_hidden", "constants_limit", "o_depth"):
        assert f"// {port} " in header
    assert "_geometry_normals_normaliser" in body


@pytest.mark.long
def test_verilog_of_two_lanes(capsys):
    """Beats have two pixels, depths are in two memories, and L is read. Geometry alone has no lanes."""
    assert main(["verilog", *HARDWARE, "--lanes", "2", "-o", "a.v"]) == 0
    header = Path("a.v").read_text().split("module blysk (", 1)[0]
    for port in ("o_present", "o_colors_1_b", "o_depths_1", "memory_0_read_data", "memory_1_write_place_x"):
        assert f"// {port} " in header
    assert "// o_depth " not in header
    assert "constants: as L write sin a, 0, cos a" in header
    capsys.readouterr()
    assert main(["verilog", "--top", "geometry", "--lanes", "2"]) == 2
    assert capsys.readouterr().err.endswith(
        "--lanes 2: geometry gives spans, and no pixels; leave out lanes\n"
    )


@pytest.mark.long
def test_same_from_python(capsys):
    """Functions of the package give the same frame and Verilog, here of lines without a normaliser."""
    assert main(["render", *SMALL, *HARDWARE, "-o", "a.png", "--json", "a.json"]) == 0
    drawn = blysk.scene("teapot", triangles=500, size=(64, 48))
    frame = blysk.render(drawn, geometry="hardware")
    np.testing.assert_array_equal(frame.image, picture("a.png"))
    assert frame.cycles == json.loads(Path("a.json").read_text())["cycles"]
    assert main(["verilog", *HARDWARE, "-o", "a.v"]) == 0
    assert blysk.verilog(blysk.design(), geometry="hardware") == Path("a.v").read_text()
    capsys.readouterr()
    assert main(["verilog", *HARDWARE, "--method", "renormalise"]) == 0
    text = capsys.readouterr().out
    assert "true lines, uncut" in text
    assert "_geometry_normals_normaliser" not in text
    assert main(["verilog", *HARDWARE, "--method", "quotient", "--model", "blinn"]) == 0
    text = capsys.readouterr().out
    assert "N/W and its step, cut where N/W grows short" in text
    assert "vertex normal in the frame of the light (H along z, L and V in the xz plane)" in text
    assert "_geometry_normals_normaliser" not in text


@pytest.mark.long
def test_several_lights(capsys):
    """With the defaults errors are within the printed bound, and the Verilog explains the axes."""
    lights = "--light", "1,1,1", "--light", "-1,0.5,1"
    assert main(["render", *SMALL, *HARDWARE, *lights, "-o", "a.png", "--json", "a.json"]) == 0
    frame = json.loads(Path("a.json").read_text())
    assert 0.4 < frame["method_error"]["steady_lsb"] <= frame["bound_lsb"] < 1.5
    capsys.readouterr()
    assert main(["verilog", *HARDWARE, "--lights", "2", "--model", "phong"]) == 0
    text = capsys.readouterr().out
    assert "276 to 278  axis y cos a in the frame of light 0, SQ(1, 17) (light 1)" in text
    assert "vertex normal in the frame of light 0 (H along z, L and V in the xz plane)" in text


RENDER, VERILOG = ("render", *SMALL), ("verilog",)
POINT_LIGHT = "--point-light", "3,4,5"
SPANS = "a specialised pipeline takes spans; leave out specialise"
VALUES = "triangles give normals, and chord-local takes values"
LOCAL = "--method", "chord-local"
NO_SETUP = "spans need no triangle setup; "
UNKNOWN = "use one of software, hardware"


@pytest.mark.parametrize(
    ("arguments", "thing", "says"),
    [
        ((*RENDER, "--geometry", "x"), "--geometry x", UNKNOWN),
        ((*VERILOG, "--geometry", "x"), "--geometry x", UNKNOWN),
        ((*RENDER, *HARDWARE, "--specialise"), "", SPANS),
        # This takes values of spans. Another method does not help, because no method draws a point light from
        # triangles.
        ((*RENDER, *HARDWARE, *LOCAL), "", VALUES),
        ((*RENDER, *HARDWARE, *POINT_LIGHT), "", "the values of a span; use software"),
        ((*RENDER, *HARDWARE, *POINT_LIGHT, *LOCAL), "", "the values of a span; use software"),
        ((*RENDER, *HARDWARE, "--size", "4095x4095"), "--geometry hardware at 4095x4095", "2,097,152 pixels"),
        # The remedy must not be refused, too.
        ((*RENDER, *HARDWARE, "--short-words"), "--short-words", "leave it out"),
        ((*RENDER, "--coarse"), "--coarse", "also give geometry hardware"),
        ((*RENDER, "--setups", "2"), "--setups 2", NO_SETUP + "also give geometry hardware"),
        ((*VERILOG, *HARDWARE, *LOCAL), "", "takes values"),
        ((*VERILOG, "--coarse", "64x48"), "--coarse", "also give top render"),
        ((*VERILOG, "--setups", "2"), "--setups 2", NO_SETUP + "use top geometry or render"),
        ((*VERILOG, "--setups", "3"), "--setups 3", "give one of 1, 2, 4"),
    ],
)
def test_what_is_refused(refused, arguments, thing, says):
    refused(*arguments, thing=thing or "--geometry hardware", says=says)


@pytest.mark.parametrize(
    ("text", "key", "says"),
    [
        ("geometry = 'hardware'\nspecialise = true", "geometry", "takes spans"),
        ("setups = 2", "setups", NO_SETUP),
    ],
)
def test_what_is_refused_of_a_scene_file(refused, text, key, says):
    Path("a.toml").write_text(f"[mesh]\nfile = 'teapot'\n[pipeline]\n{text}\n")
    refused("render", "a.toml", thing=f"a.toml, pipeline.{key}", says=says)
