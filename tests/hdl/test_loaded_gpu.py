# amaranth: UnusedElaboratable=no
"""Another mesh by a serial line: from the packets to the bits of a monitor's lanes."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from blysk.golden.bus.loader import Loader
from blysk.golden.bus.packets import FLAG, framed, packets_of, stream_of
from blysk.golden.bus.uart_receiver import UartReceiver
from blysk.golden.gpu import Gpu
from blysk.golden.video.band_buffer import RGB888, BandBuffer
from blysk.golden.video.display_timing import Axis, DisplayMode
from blysk.golden.video.draw_unit import Drawing, Room, board_design
from blysk.hdl.gpu import GpuUnit
from blysk.sim.api.scene import scene
from blysk.sim.frames.display import OneClock, show

BACKGROUND = (26, 28, 32)
MODE = DisplayMode(Axis(64, 4, 8, 1000), Axis(48, 2, 2, 8))
DIVISOR = 128
"""A byte takes 80 cycles, and a packet of 63 bytes about as many."""
FLAGS, REST = 300, 40_000
"""Flags for the longest band, and a time of rest that is longer."""


def drawing(triangles, **options):
    given = scene("teapot", triangles=triangles, size=MODE.size, back_faces="cull", **options)
    design = board_design().built(top="render", geometry_style="compact")
    return Drawing.of([given], design, lines=8)


def loaded(made):
    loader = Loader.of(made, UartReceiver(DIVISOR), rest=REST)
    return Gpu(made, BandBuffer(MODE, 8, RGB888, BACKGROUND), loader)


def meshes():
    """Two drawings in memories of the same sizes: the mesh at power-up, and another mesh and material."""
    old, new = drawing(200), drawing(72, exponent=300, view=(1, 0.2, 0.4))
    room = Room(*map(max, old.room, new.room))
    return tuple(loaded(each.padded(room)) for each in (old, new))


def wrong_packets(decoder):
    """Packets that would write zeros, each wrong in its own way, and the counter of each."""
    start, zeros = decoder.start, bytes(14)
    right = framed(bytes((0, 0, 0, 14)) + zeros, start)
    deep = decoder.memories[0].depth
    return {
        "damaged": [
            right[:9] + b"\x01" + right[10:],
            right[:6] + right[7:],
            framed(bytes((0, 0, 0, 14)) + zeros),
        ],
        "unknown": [framed(bytes((4, 0, 0, 5)) + zeros[:5], start)],
        "lengths": [
            framed(bytes((0, 0, 0, 13)) + zeros, start),
            framed(bytes((0, 0, 0, 7)) + zeros[:7], start),
        ],
        "beyond": [framed(bytes((0, deep & 255, deep >> 8, 14)) + zeros, start)],
    }


def test_packets_are_for_every_drawing_of_the_same_sizes():
    """Both drawings have the same start of the CRC. A drawing with memories of other sizes has another."""
    old, new = meshes()
    assert old.loader.decoder.start == new.loader.decoder.start
    other = drawing(72)
    assert Loader.of(other, UartReceiver(DIVISOR)).decoder.start != new.loader.decoder.start
    sent = np.frombuffer(stream_of(new.drawing.memories, old.loader.decoder.start), dtype=np.uint8)
    writes, counts = old.loader.decoder.compute(sent)
    assert counts["packets"] == sum(counts.values())
    memories = old.loader.decoder.written(writes)
    for found, expected in zip(memories, new.drawing.memories, strict=True):
        assert found.words[: len(expected.words)] == expected.words
    with pytest.raises(ValueError, match="the loader is for the memories of another drawing"):
        replace(old, drawing=new.drawing)


@pytest.mark.ci
@pytest.mark.long
def test_another_mesh_by_a_serial_line():
    """Frames before the packets are those of the first mesh, and later frames those of the other mesh.

    Wrong packets are counted, each by its kind, and change nothing. While packets come, bands show the
    background.
    """
    old, new = meshes()
    decoder, wrong = old.loader.decoder, wrong_packets(old.loader.decoder)
    packets = list(packets_of(new.drawing.memories, decoder.start))
    spread = [packet for kind in wrong.values() for packet in kind]
    for number, packet in enumerate(spread):
        packets.insert((number + 1) * len(packets) // (len(spread) + 1), packet + bytes((FLAG,)))
    # The last packets are wrong, too.
    packets += spread
    first = framed(bytes(4), decoder.start)
    sent = bytes((FLAG,)) + first + bytes((FLAG,)) * FLAGS + b"".join(packets)
    expected, counts = decoder.compute(np.frombuffer(sent, dtype=np.uint8))
    assert len(expected["target"]) == sum(len(of.words) for of in new.drawing.memories)
    # The clock of the display is twice as fast as the clock of the drawing. The first frame is shown before.
    frame = 5 * MODE.cycles
    line = np.r_[np.ones(frame + 20_000, dtype=np.uint8), UartReceiver(2 * DIVISOR).line(sent, 1)]
    frames = 4 + len(line) // frame
    found = show(OneClock(GpuUnit(old), Fraction(1, 2)), MODE, frames, line)
    assert {name: found.status[name] for name in counts} == counts
    assert {name: count for name, count in counts.items() if name != "packets"} == {
        name: 2 * len(kind) for name, kind in wrong.items()
    }
    assert found.status["framing"] == found.status["overruns"] == 0
    np.testing.assert_array_equal(found.frames[0], old.frames(1)[0])
    # The last frame is one of the last two that were begun.
    controls, state, last = new.drawing.controls, new.drawing.controls.start, []
    for _ in range(found.status["frames"]):
        state = controls.advance(state)
        last.append(state.angle)
    shown = [(found.frames[-1] == new.frame(angle)).all() for angle in last[-2:]]
    assert any(shown)
    assert found.status["late_bands"] > 0
