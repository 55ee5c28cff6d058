"""Band depth: the depths of one band, cleared for the next band by a tag."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.depth_tester import DepthTester
from blysk.golden.geometry.triangles import DEPTH
from blysk.golden.video.band_depth import BandDepth
from blysk.hdl.core.bits import times_constant
from blysk.hdl.geometry.depth_tester import DepthMemory, is_inside

__all__ = ["BandDepthUnit"]


class BandDepthUnit(wiring.Component):
    """The depths of a band behind a `DepthMemory` port. `BandDepth` is the bit-accurate model.

    With ``begin`` the tag counts up, and `BandDepth.swept` words (all words after a reset) are swept, one a
    cycle. Meanwhile ``busy`` is high. Do not use the port then. The unit has no multipliers.

    Parameters
    ----------
    model : BandDepth
        Bit-accurate model.
    x_bits, y_bits : int
        Bits of the coordinates.

    Members
    -------
    memory : :py:`In(DepthMemory(x_bits, y_bits))`
        Depths of the band. A place outside the band reads as cleared. Writes there have no effect.
    begin : :py:`In(1)`
        High if a band begins, with all depths cleared. Set ``begin`` only while ``busy`` is low.
    busy : :py:`Out(1)`
        High while words are swept.

    Source: docs/theory/video.md#bands; not in the documents.
    """

    def __init__(self, model: BandDepth, x_bits: int, y_bits: int):
        self.model = model
        super().__init__({"memory": In(DepthMemory(x_bits, y_bits)), "begin": In(1), "busy": Out(1)})

    def elaborate(self, platform):
        """The memory, the tag and the sweep."""
        m = Module()
        model, port = self.model, self.memory
        bits = model.tag_bits
        m.submodules.depths = memory = Memory(shape=DEPTH.width + bits, depth=model.words, init=[])
        read, write = memory.read_port(), memory.write_port()
        # After a reset no word in the memory is valid.
        fresh = Signal(name="fresh", init=1)
        tag, before = Signal(bits, name="tag"), Signal(bits, name="tag_before")
        place, left = Signal(range(model.words), name="place"), Signal(range(model.words + 1), name="left")
        m.d.comb += [before.eq(tag - 1), self.busy.eq(left != 0)]
        with m.If(self.begin):
            m.d.sync += [tag.eq(tag + 1), left.eq(Mux(fresh, model.words, model.swept)), fresh.eq(0)]
        with m.Elif(self.busy):
            m.d.sync += [left.eq(left - 1), place.eq(Mux(place == model.words - 1, 0, place + 1))]

        def address(place) -> Value:
            return (times_constant(place.y, model.size[0]) + place.x)[: len(read.addr)]

        outside = Signal(name="read_outside")
        with m.If(port.read_enable):
            m.d.sync += outside.eq(~is_inside(port.read_place, model.size))
        depth, its_tag = read.data[: DEPTH.width], read.data[DEPTH.width :]
        m.d.comb += [
            read.addr.eq(address(port.read_place)),
            read.en.eq(port.read_enable),
            port.read_data.eq(Mux((its_tag == tag) & ~outside, depth, DepthTester.CLEARED)),
            write.en.eq((port.write_enable & is_inside(port.write_place, model.size)) | self.busy),
            write.addr.eq(Mux(self.busy, place, address(port.write_place))),
            write.data.eq(Mux(self.busy, Cat(port.write_data, before), Cat(port.write_data, tag))),
        ]
        return m
