"""Pixel joiner: the pixels that several pipelines give on one cycle, as one wide beat."""

from amaranth.hdl import Cat, Module, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.pixel_assembler import pixel_shape

__all__ = ["PixelJoinerUnit", "joined_shape"]


def joined_shape(pipes: int, x_bits: int = 12, y_bits: int = 12) -> data.StructLayout:
    """Shape of a wide beat: a pixel for each pipeline, and in ``present`` a bit for each of these pixels.

    Parameters
    ----------
    pipes : int
        Number of pipelines.
    x_bits, y_bits : int
        Bits of the coordinates.
    """
    pixels = data.ArrayLayout(pixel_shape(x_bits, y_bits), pipes)
    return data.StructLayout({"present": unsigned(pipes), "pixels": pixels})


class PixelJoinerUnit(wiring.Component):
    """Joins several streams of pixels into wide beats, with at most one pixel of each stream.

    A pixel leaves 1 cycle after it was accepted. Without stalls a pixel of every stream is accepted on every
    cycle, and no stream waits for another. The payload in place of a missing pixel has no meaning. The unit
    has no multipliers. For the beats of a pipeline with several lanes see `PixelAssemblerUnit`.

    Parameters
    ----------
    pipes : int
        Number of streams.
    x_bits, y_bits : int
        Bits of the coordinates.

    Members
    -------
    i : :py:`In(stream.Signature(pixel_shape(x_bits, y_bits))).array(pipes)`
        Pixels.
    o : :py:`Out(stream.Signature(joined_shape(pipes, x_bits, y_bits)))`
        Beats of one pixel or more.

    Source: docs/theory/units.md#pipeline.
    """

    latency = 1

    def __init__(self, pipes: int, x_bits: int = 12, y_bits: int = 12):
        super().__init__(
            {
                "i": In(stream.Signature(pixel_shape(x_bits, y_bits))).array(pipes),
                "o": Out(stream.Signature(joined_shape(pipes, x_bits, y_bits))),
            }
        )

    def elaborate(self, platform):
        """A register of all lanes, which keeps its pixels while they wait."""
        m = Module()
        beat, valid, advance = Signal(self.o.payload.shape()), Signal(), Signal()
        present = Cat(each.valid for each in self.i)
        m.d.comb += advance.eq(skid_buffer(m, self.o, valid, beat))
        with m.If(advance):
            m.d.sync += [valid.eq(present.any()), beat.present.eq(present)]
        for k, each in enumerate(self.i):
            m.d.comb += each.ready.eq(advance)
            with m.If(advance):
                m.d.sync += beat.pixels[k].eq(each.payload)
        return m
