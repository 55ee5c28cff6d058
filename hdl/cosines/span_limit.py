"""Span limit unit: whether a span is wider than the chord method's error bound allows at an exponent."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.number.fixed import Fixed
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import PipelinedUnit
from blysk.hdl.cosines.chord import chord_exact

__all__ = ["SpanLimitUnit", "octave_limit"]


def octave_limit(m: Module, name: str, exponent: Value, limits: Fixed) -> FixedValue:
    """Limit of an exponent, from a table by the number of its bits: two cycles.

    Parameters
    ----------
    m : Module
        Module that gets the registers.
    name : str
        Name of the second register.
    exponent : Value
        Ten bits.
    limits : Fixed
        Limits by the number of bits of the exponent, 0 to 10.
    """
    count = Const(0, range(len(exponent) + 1))
    for bit in range(len(exponent)):
        count = Mux(exponent[bit], bit + 1, count)
    octave = Signal(range(len(exponent) + 1), name=f"{name}_octave", reset_less=True)
    register = Signal(FixedShape(limits.format), name=name, reset_less=True)
    m.d.sync += octave.eq(count)
    # Bit by bit: from a choice among constants a mapper would make resets of the registers.
    codes = limits.codes.tolist()
    for place, bit in enumerate(Value.cast(register)):
        m.d.sync += bit.eq(Cat(octave == k for k, code in enumerate(codes) if code >> place & 1).any())
    return register


class SpanLimitUnit(PipelinedUnit):
    """Whether a span is too wide for the error bound; `SpanLimit` is the bit-accurate model.

    Latency 10 cycles, initiation interval 3; three products share one multiplier. Beats come at any distance
    from 3 cycles on.

    Parameters
    ----------
    parameters : SpanLimit
        Bit-accurate model.
    highlights : bool
        Whether there is specular light.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left": ..., "normal_right": ...})))`
        Unit normals at the ends of spans.
    o : :py:`Out(stream.Signature(StructLayout({"wide": 1, "wide_if_lit": 1})))`
        ``wide``: a span of four pixels or more is too wide under any light; ``wide_if_lit``: it is if a light
        that is not behind the span may have a highlight there.
    constants : :py:`In(10)`
        Specular exponent, 1 to 1000, constant from 3 cycles before a beat. Only with highlights.

    Source: docs/theory/chord.md#where-spans-are-cut.
    """

    def __init__(self, parameters: SpanLimit | None = None, *, highlights: bool = True):
        self.parameters = parameters or SpanLimit()
        self.highlights = highlights
        self._graph = g = Dataflow(3, spaced=True)
        left, right = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in ("normal_left", "normal_right")
        )
        # The limits are under the largest code of `Chord.FORMAT`, so that nothing need be saturated.
        half = chord_exact(g, "chord", right, left)
        self._result = g.register("result", self._compare, half)
        self.multipliers = g.multiplier.count
        super().__init__(
            data.StructLayout({"normal_left": normal_shape(), "normal_right": normal_shape()}),
            data.StructLayout({"wide": 1, "wide_if_lit": 1}),
            latency=self._result.stage,
            initiation_interval=3,
            constants=unsigned(self.parameters.EXPONENT_BITS) if highlights else None,
            spaced=True,
        )

    def _compare(self, chord):
        p = self.parameters
        wide = Value.cast(chord) > p.widest.codes.item()
        lit = Value.cast(chord) > Value.cast(self._limit) if self.highlights else wide
        return Cat(wide, lit)

    def datapath(self, m, operands):
        """Describe the registers of the graph."""
        if self.highlights:
            self._limit = octave_limit(m, "limit", self.constants, self.parameters.chords)
        value = self._graph.build(m, self, operands)
        return self.o.payload.shape()(value(self._result, self.latency))
