"""Pixel merger: the pixels of several pipelines as one stream, in the order of the spans."""

from functools import reduce
from operator import or_

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.pixel_assembler import pixel_shape

__all__ = ["PixelMergerUnit"]


class PixelMergerUnit(wiring.Component):
    """Takes spans of pixels from several streams in turns, and gives one stream, a pixel a cycle.

    A turn is the index of an input. The pixels of one span are taken from this input, up to the last pixel of
    the span. A pixel leaves 1 cycle after it was accepted. The unit has no multipliers.

    Parameters
    ----------
    pipes : int
        Number of inputs, 2 or more.
    x_bits, y_bits : int
        Bits of the coordinates.

    Members
    -------
    turns : :py:`In(stream.Signature(range(pipes)))`
        Index of the input for each span, in the order of the output. A span has 1 pixel or more.
    i : :py:`In(stream.Signature(pixel_shape(x_bits, y_bits))).array(pipes)`
        Pixels.
    o : :py:`Out(stream.Signature(pixel_shape(x_bits, y_bits)))`
        Pixels of all inputs.

    Source: docs/theory/units.md#pipeline.
    """

    latency = 1

    def __init__(self, pipes: int, x_bits: int = 12, y_bits: int = 12):
        pixels = stream.Signature(pixel_shape(x_bits, y_bits))
        super().__init__(
            {
                "turns": In(stream.Signature(range(pipes))),
                "i": In(pixels).array(pipes),
                "o": Out(pixels),
            }
        )

    def elaborate(self, platform):
        """The input whose turn it is, and a pixel register."""
        m = Module()
        turn = self.turns.payload
        pixel, valid, advance = Signal(self.o.payload.shape()), Signal(), Signal()
        chosen, present = Signal.like(pixel), Signal()
        m.d.comb += [
            Value.cast(chosen).eq(
                reduce(or_, (Mux(turn == k, each.payload.as_value(), 0) for k, each in enumerate(self.i)))
            ),
            present.eq(
                self.turns.valid & reduce(or_, ((turn == k) & each.valid for k, each in enumerate(self.i)))
            ),
            advance.eq(skid_buffer(m, self.o, valid, pixel)),
            self.turns.ready.eq(advance & present & chosen.last),
        ]
        for k, each in enumerate(self.i):
            m.d.comb += each.ready.eq(advance & self.turns.valid & (turn == k))
        with m.If(advance):
            m.d.sync += [valid.eq(present), pixel.eq(chosen)]
        return m
