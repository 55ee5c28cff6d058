"""The chord method for point lights and a near viewer, from three values of N·L and of the chord."""

from collections.abc import Iterator

import numpy as np
from amaranth.hdl import Module, Signal
from amaranth.lib import data, wiring

from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import copy
from blysk.hdl.cosines.chord_setup import span_operands_shape
from blysk.hdl.methods.chord_spans import ChordSpansUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit

__all__ = ["LocalChordInterpolatorUnit"]


class LocalChordInterpolatorUnit(InterpolatorUnit, model=LocalChordInterpolator):
    """Turns spans with values into the operands of their pixels, by chord setup and accumulators.

    `LocalChordInterpolator` is the bit-accurate model. Pixels need no multiplier. The attribute
    ``multipliers`` is the number of the setup's multipliers. A span of two pixels takes two cycles, as two
    spans of one pixel do.

    Spans carry values in place of normals, so there are no vectors of lights. A span is flagged if one of its
    words is out of range.

    Parameters
    ----------
    model : LocalChordInterpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`, with a ``setup_interval`` of 1 to 6.

    Source: docs/theory/chord.md#local-lights.
    """

    room_after = 0

    @property
    def shortest_interval(self):
        """Least cycles from any span to the next: 1, after a span of one pixel."""
        return 1

    def span_intervals(self, spans):
        """Intervals of the spans. They are shorter for spans of one or two pixels."""
        return np.minimum(spans.length, 3) * self.setup_interval // 3

    @classmethod
    def setup_intervals(cls, model):
        """Initiation intervals of the chord setup that save multipliers with one light."""
        return (1, 2, 3, 6)

    @classmethod
    def span_shape(cls, lights, *, highlights=True, length_bits=LENGTH_BITS, factors=0):
        """Shape of a span: three values of each light's operands, three of each factor, and the length."""
        return span_operands_shape(lights, highlights, length_bits, factors)

    def __init__(self, model: LocalChordInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        self._spans = ChordSpansUnit(
            model,
            lights,
            initiation_interval=self.setup_interval,
            highlights=self.highlights,
            length_bits=self.length_bits,
            factors=self.factors,
        )
        self.multipliers = self._spans.multipliers
        self.latency = self._spans.latency

    def elaborate(self, platform):
        """A span of two pixels becomes two spans, the second from registers. Other spans pass unchanged."""
        m = Module()
        m.submodules.chord_spans = spans = self._spans
        span, second, pair = self.i.payload, Signal(name="second"), Signal()
        m.d.comb += [
            pair.eq(span.length == 2),
            spans.i.valid.eq(self.i.valid | second),
            copy(spans.i.payload, span),
            spans.long.eq((span.length > 2) & ~second),
            self.i.ready.eq(spans.i.ready & ~second),
            self.out_of_range.eq(spans.out_of_range),
        ]
        with m.If(pair | second):
            m.d.comb += spans.i.payload.length.eq(1)
        with m.If(spans.i.valid & spans.i.ready):
            m.d.sync += second.eq(pair & ~second)
        for name, given, values in self._values(spans.i.payload, span):
            end = Signal.like(values[2], name=f"{name}_end", reset_less=True)
            with m.If(second):
                m.d.comb += copy(given[0], end)
            with m.Else():
                m.d.sync += copy(end, values[2])
        connect(m, spans.o, wiring.flipped(self.o))
        return m

    def _values(self, *spans: data.View) -> Iterator[tuple]:
        """Name of each operand, and its three values in each of the spans."""
        for index, lights in enumerate(zip(*(span["values"] for span in spans), strict=True)):
            for name in lights[0].shape().members:
                yield f"{name}_{index}", *(light[name] for light in lights)
        for index in range(len(self.factors)):
            yield f"factor_{index}", *(span.factors[index] for span in spans)

    def constant_members(self):
        """No ports, because spans bring values in place of L and H."""
        return {}

    @property
    def light_vectors(self):
        """No ports, because the method does not read L and H."""
        return ()
