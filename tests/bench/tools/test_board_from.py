# amaranth: UnusedElaboratable=no
"""``blysk board --from``: another scene in the memories of a routed bitstream."""

import shutil
from dataclasses import replace
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from amaranth.hdl import Module, Signal, Value
from amaranth.lib import data, wiring
from amaranth.lib.wiring import Out

from blysk.bench.tools.board import carried_of, facts_of, planned
from blysk.bench.tools.board_build import BoardNetlist, build
from blysk.bench.tools.board_design import BoardTop
from blysk.bench.tools.board_from import RoutedBitstream, rewrite
from blysk.bench.tools.boards import BOARDS
from blysk.bench.tools.memory_map import MemoryMap, ScenePatterns, carrying, memory_words, packed
from blysk.bench.tools.place_and_route import tool_versions
from blysk.bench.tools.tool_runner import ToolError, ToolRunner
from blysk.golden.gpu import Gpu
from blysk.golden.reference.light import Light
from blysk.golden.video.band_buffer import RGB888, BandBuffer
from blysk.golden.video.clock_plan import clock_plan
from blysk.golden.video.display_timing import VGA, Axis, DisplayMode
from blysk.golden.video.draw_commands import COMMAND_BITS
from blysk.golden.video.draw_unit import Drawing, board_design
from blysk.golden.video.serialiser import LANES
from blysk.hdl.core.scene_memory import contents_from
from blysk.hdl.gpu import GpuUnit
from blysk.hdl.video.draw_commands import DrawCommandsUnit
from blysk.hdl.video.mesh_memory import MeshMemoryUnit
from blysk.hdl.video.motion import MotionUnit
from blysk.hdl.video.triangle_assembly import TriangleAssemblyUnit
from blysk.sim.api.scene import scene
from blysk.sim.cli.main import main
from blysk.sim.errors import InputError
from blysk.sim.frames.display import OneClock, show

from .test_memory_map import HEAD, laid_out, section

BOARD = BOARDS["ulx3s-25f"]


def words_of(drawing):
    """Width and words of the memories of a drawing, with the zeros behind them."""
    mesh, commands, motion = drawing.mesh, drawing.commands.codes, drawing.motion.words
    vertices = mesh.vertex_words + [0] * (mesh.vertex_room - mesh.vertices)
    triangles = mesh.triangle_words + [0] * (mesh.triangle_room - mesh.triangles)
    return {
        "vertices": (mesh.vertex_bits, vertices),
        "triangles": (3 * mesh.index_bits, triangles),
        "commands": (COMMAND_BITS, commands),
        "coefficients": (drawing.motion.WORD_BITS, motion),
    }


def netlist_of(board, top):
    """A netlist whose text is the sizes of the memories. To elaborate a whole drawing would take seconds."""
    patterns = ScenePatterns()
    for name, (width, words) in words_of(top.gpu.model.drawing).items():
        patterns(name, width, words)
    sizes = {name: (width, len(words)) for name, (width, words) in patterns.words.items()}
    return BoardNetlist(repr(sizes).encode(), b"", patterns)


def run(self, name, code, arguments, folder, *others):
    """Tools whose bitstream is the configuration in text."""
    source, target = (folder / arguments[k].rpartition("/")[2] for k in (1, 3))
    if not source.read_bytes().startswith(b".device"):
        raise ToolError(f"{name} ends with status 1")
    shutil.copyfile(source, target)


@pytest.fixture(scope="module")
def routed():
    """Configuration of a teapot of 200 triangles, without place and route."""
    gpu, _, plan = planned(BOARD, "teapot", {"triangles": 200}, "rgb888", 52.5)
    netlist = netlist_of(BOARD, BoardTop(BOARD, GpuUnit(gpu), plan))
    patterns = netlist.patterns
    layout = [(packed(patterns.bits(name)), width) for name, (width, _) in patterns.words.items()]
    blocks = laid_out(layout, 36, np.random.default_rng(1)) | {300: [5] * 2048}
    text = HEAD + "\n".join(section(*block) for block in blocks.items())
    memories = MemoryMap.found(memory_words(text), patterns)
    comment = {
        **carried_of(BOARD, gpu, plan),
        "netlist": netlist.digest,
        "memories": memories.to_json(),
    }
    return carrying(memories.replaced(text, patterns.contents), comment)


@pytest.fixture
def tools(monkeypatch, tmp_path, routed):
    monkeypatch.setattr(ToolRunner, "run", run)
    monkeypatch.setattr(BoardNetlist, "of", netlist_of)
    monkeypatch.setattr("blysk.bench.cli.board.packages_missing", lambda: None)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "teapot.bit").write_text(routed)
    (tmp_path / "other.bit").write_text(HEAD)
    (tmp_path / "text.bit").write_text("no bitstream")
    return tmp_path


def test_another_scene_is_written(tools, capsys, routed):
    """A smaller mesh with another material, light and axis. Then the first scene gives the first bytes."""
    changes = ["--exponent=200", "--light=1,0,0.5", "--up=z"]
    given = ["board", "ulx3s-25f", "--triangles=100", *changes, "--from=teapot.bit", "-o", "new.bit"]
    assert main(given) == 0
    told = capsys.readouterr().out.splitlines()
    text = (tools / "new.bit").read_text()
    source = RoutedBitstream.of("new.bit", text)
    options = {"triangles": 100, "exponent": 200, "lights": [Light((1, 0, 0.5))], "up": "z"}
    drawing = planned(BOARD, "teapot", options, "rgb888", 52.5, source)[0].drawing
    assert source.contents == {name: words for name, (_, words) in words_of(drawing).items()}
    assert text.partition(".bram_init")[0] == routed.partition(".bram_init")[0]
    assert told[-1] == f"bitstream   new.bit, {len(text):,} bytes, read back and equal"
    before = RoutedBitstream.of("teapot.bit", routed).contents
    for name, line in zip(before, told[-6:-2], strict=True):
        changed = sum(a != b for a, b in zip(before[name], source.contents[name], strict=True))
        assert changed
        assert line.startswith(f"{name:<13}{changed:,} of {len(before[name]):,} words of ")
    blocks = len(memory_words(text))
    equal = sum((memory_words(text)[k] == words).all() for k, words in memory_words(routed).items())
    assert equal >= 1
    assert told[-2] == f"unchanged    {equal} of {blocks} block RAMs, and everything that is no memory"
    assert main(["board", "ulx3s-25f", "--triangles=200", "--from=new.bit", "-o", "back.bit"]) == 0
    assert (tools / "back.bit").read_text() == routed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--triangles=700", "--from=teapot.bit"],
            "--mesh teapot: its 552 triangles with 302 vertices do not fit the memories of teapot.bit; use a "
            "mesh of at most 512 triangles and 512 vertices, or build without --from",
        ),
        (
            ["--model=phong", "--from=teapot.bit"],
            "--from teapot.bit: shading of its design: quotient, blinn, 1 light, compact geometry, codes of "
            "sRGB; of this design: quotient, phong, 1 light, compact geometry, codes of sRGB; give the "
            "options with which it was built, or build without --from",
        ),
        (
            ["--background=#ffffff", "--from=teapot.bit"],
            "--from teapot.bit: background of its design: #1a1c20; of this design: #ffffff; give the options "
            "with which it was built, or build without --from",
        ),
        (
            ["--from=other.bit"],
            "--from other.bit: does not carry a map of its memories; build it anew with this version of "
            "blysk board, without --from",
        ),
        (
            ["--from=text.bit"],
            "--from text.bit: is no bitstream of an ECP5; give a bitstream of blysk board",
        ),
        (
            ["--from=none.bit"],
            "--from none.bit: cannot be read (No such file or directory); give a bitstream of blysk board",
        ),
        (
            ["--from=teapot.bit", "--seeds=2"],
            "--seeds: nothing is placed with --from; leave out --seeds",
        ),
        (
            ["--from=teapot.bit", "--simulate=1", "--toggles"],
            "--toggles: counts bits of the mesh itself; leave out --from or --toggles",
        ),
    ],
)
def test_what_would_change_more_is_refused_in_a_line(arguments, message, refused, tools):
    refused("board", "ulx3s-25f", "--triangles=100", *arguments, "-o", "new.bit", line=message)
    assert not (tools / "new.bit").exists()


def test_lines_of_the_bands(routed):
    """The bitstream carries the lines of a band, which another mesh keeps."""
    source = RoutedBitstream.of("x.bit", routed)
    assert source.lines == 8
    display = source.facts["display"].replace("8 l", "4 l")
    fewer = replace(source, lines=4, facts={**source.facts, "display": display})
    gpu, _, plan = planned(BOARD, "teapot", {"triangles": 200}, "rgb888", 52.5)
    with pytest.raises(InputError, match=r"display of its design: .* 4 lines"):
        fewer.check_facts(facts_of(BOARD, gpu, plan))
    gpu, *_ = planned(BOARD, "teapot", {"triangles": 200}, "rgb888", 52.5, fewer)
    assert gpu.buffer.lines == gpu.drawing.lines == 4


def test_another_netlist_is_refused(routed):
    """The facts are equal, but the netlist differs outside the memories."""
    source = RoutedBitstream.of("x.bit", routed)
    patterns = ScenePatterns({n: (w, [0] * d) for n, (d, w) in source.memories.sizes.items()})
    with pytest.raises(InputError, match=r"^--from x.bit: its netlist differs in more than memories: "):
        source.check_netlist(BoardNetlist(b"other", b"", patterns))


class MemoriesTop(wiring.Component):
    """The memories of a drawing, each walked through all its words. The words make the pairs of bits."""

    def __init__(self, gpu):
        self.model = gpu
        super().__init__({"pairs": Out(data.ArrayLayout(2, LANES))})

    def elaborate(self, platform):
        m = Module()
        drawing = self.model.drawing
        m.submodules.mesh = mesh = MeshMemoryUnit(drawing.mesh)
        m.submodules.assembly = assembly = TriangleAssemblyUnit(drawing.assembly)
        m.submodules.commands = commands = DrawCommandsUnit(drawing.commands)
        m.submodules.motion = motion = MotionUnit(drawing.motion)
        count = Signal(16)
        m.d.sync += count.eq(count + 1)
        for unit in (mesh, assembly, commands, motion):
            m.d.comb += [
                unit.i.valid.eq(1),
                Value.cast(unit.i.payload).eq(count * 0x9E37),
                unit.o.ready.eq(1),
            ]
        written = Signal.like(Value.cast(assembly.write.payload))
        m.d.sync += written.eq(mesh.o.payload)
        m.d.comb += [
            assembly.write.valid.eq(count[-1]),
            Value.cast(assembly.write.payload).eq(written),
            assembly.constants.bottom.eq(count),
        ]
        found, shown, sent = (Signal(8, name=name) for name in ("found", "shown", "sent"))
        for unit in (mesh, assembly, commands, motion):
            word = Value.cast(unit.o.payload)
            kept = Signal(len(word))
            m.d.sync += kept.eq(word)
            for low in range(0, len(word), 64):
                part = Signal()
                m.d.sync += part.eq(kept[low : low + 64].xor())
                found = found ^ part
        m.d.pixel += shown.eq(shown.rotate_left(1) ^ found)
        m.d.serial += sent.eq(shown ^ sent.rotate_left(1))
        m.d.comb += Value.cast(self.pairs).eq(sent)
        return m


def small_gpu(room=None, **options):
    """A teapot on a small display."""
    mode = DisplayMode(Axis(64, 4, 8, 1000), Axis(48, 2, 2, 8))
    given = scene("teapot", size=mode.size, back_faces="cull", **options)
    design = board_design().built(top="render", geometry_style="compact")
    drawing = Drawing.of([given], design, lines=8)
    return Gpu(drawing.padded(room or drawing.room), BandBuffer(mode, 8, RGB888, (26, 28, 32)))


@pytest.mark.long
def test_a_placed_design_draws_another_scene(tmp_path):
    """The memories of a small placed design are rewritten and read back.

    With the words that are read back, the drawing of the first scene draws the second scene's frame to the
    bit.
    """
    if find_spec("amaranth_boards") is None or None in tool_versions().values():
        pytest.skip("the tools of the extra board are not installed")
    first = small_gpu(triangles=100)
    second = small_gpu(first.drawing.room, triangles=200, exponent=150, lights=[(0, 1, 0.3)], view="left")
    plan = clock_plan(BOARD.reference, VGA.pixel_rate, 40e6)
    rates = {name: float(rate) / 1e6 for name, rate in plan.rates.items()}
    room = first.drawing.room
    built = build(
        BOARD,
        BoardTop(BOARD, MemoriesTop(first), plan),
        rates,
        carried={"facts": {"board": "x"}, "room": room, "lines": 8},
    )
    (tmp_path / "first.bit").write_bytes(built.bitstream)
    source = RoutedBitstream.read(str(tmp_path / "first.bit"))
    assert source.room == room
    assert source.contents == {name: words for name, (_, words) in words_of(first.drawing).items()}

    netlist = BoardNetlist.of(BOARD, BoardTop(BOARD, MemoriesTop(second), plan))
    source.check_netlist(netlist)
    assert str(Path(__file__).parents[3]).encode() not in netlist.netlist
    rewritten = rewrite(source, netlist.patterns.contents)
    (tmp_path / "second.bit").write_bytes(rewritten.bitstream)
    read = RoutedBitstream.read(str(tmp_path / "second.bit")).contents
    assert read == {name: words for name, (_, words) in words_of(second.drawing).items()}
    assert all(changed for _, _, changed in rewritten.changed.values())

    with contents_from(lambda name, width, words: read[name]):
        found = show(OneClock(GpuUnit(first), Fraction(1, 2)), first.buffer.mode, 1)
    np.testing.assert_array_equal(found.frames, second.frames(1))
    assert (found.frames != first.frames(1)).any()
