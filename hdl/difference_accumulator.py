"""Forward-difference accumulator ([T] figure 2.10): two accumulating adders a component."""

from amaranth.hdl import Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from golden.difference_accumulator import DifferenceAccumulator
from golden.unit_vector import COMPONENT

from .difference_setup import difference_shape
from .fixed import FixedShape, FixedValue
from .middle_normal import normal_shape

__all__ = ["DifferenceAccumulatorUnit"]


class DifferenceAccumulatorUnit(wiring.Component):
    """``N += W; W += 2 G dt^2``: the normals of a span, one a clock, first pixel first.

    Formats, rounding and bounds are those of `golden.difference_accumulator.DifferenceAccumulator`, the
    bit-true twin.

    A span of m pixels taken in on one clock gives its first normal 2 clocks later and one more on each of the
    m - 1 clocks after, unless the output waits; the next span is taken in on the clock that leaves no gap. A
    span of length 0 takes one clock and gives nothing. No multipliers.

    Members
    -------
    i : :py:`In(stream.Signature(difference_shape()))`
        Start, differences and length of a span.
    o : :py:`Out(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Normals.

    Source: [T] figure 2.10.
    """

    latency = 2

    def __init__(self):
        super().__init__(
            {"i": In(stream.Signature(difference_shape())), "o": Out(stream.Signature(normal_shape()))}
        )

    def elaborate(self, platform):
        """Accumulators, a pixel counter, and an output register for the saturated normal."""
        m = Module()
        format = DifferenceAccumulator.FORMAT
        remaining = Signal(12)
        advance = Signal()
        load = Signal()
        m.d.comb += [
            advance.eq(~self.o.valid | self.o.ready),
            self.i.ready.eq(advance & (remaining <= 1)),
            load.eq(self.i.valid & self.i.ready),
        ]
        half_step = FixedValue.constant(format, COMPONENT.step / 2)
        with m.If(advance):
            m.d.sync += self.o.valid.eq(remaining != 0)
            with m.If(load):
                m.d.sync += remaining.eq(self.i.payload.length)
            with m.Elif(remaining != 0):
                m.d.sync += remaining.eq(remaining - 1)
        for c in range(3):
            normal = Signal(FixedShape(format), name=f"normal_{c}")
            difference = Signal(FixedShape(format), name=f"difference_{c}")
            second = Signal(FixedShape(format), name=f"second_difference_{c}")
            with m.If(load):
                m.d.sync += [
                    normal.eq((self.i.payload.start[c] + half_step).wrap(format)),
                    difference.eq(self.i.payload.first[c]),
                    second.eq(self.i.payload.second[c]),
                ]
            with m.Elif(advance):
                m.d.sync += [
                    normal.eq((normal + difference).wrap(format)),
                    difference.eq((difference + second).wrap(format)),
                ]
            with m.If(advance):
                m.d.sync += self.o.payload[c].eq(normal.truncate(COMPONENT.fraction_bits).saturate(COMPONENT))
        return m
