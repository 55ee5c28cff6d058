"""The quotient method: N·L and highlights as quotients of quadratics, without a unit normal."""

from types import SimpleNamespace

import numpy as np
from amaranth.hdl import Cat, Module
from amaranth.lib.wiring import Out

from blysk.golden.cosines.quotient import Quotient
from blysk.golden.cosines.quotient_lanes import QuotientLanes
from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.methods.quotient_interpolator import QuotientInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import copy
from blysk.hdl.cosines.quotient import QuotientUnit
from blysk.hdl.cosines.quotient_lanes import QuotientLanesUnit
from blysk.hdl.cosines.quotient_spans import QuotientSpansUnit, vectors_shape
from blysk.hdl.methods.interpolator import InterpolatorUnit, flag_spans

__all__ = ["QuotientInterpolatorUnit"]


class QuotientInterpolatorUnit(InterpolatorUnit, model=QuotientInterpolator):
    """From spans of vectors to N·L and places in lobes' tables. Bit-accurate model: `QuotientInterpolator`.

    `QuotientSpansUnit` gives the words of the pixels, and `QuotientUnit` their quotients. A span of one pixel
    takes one cycle. A longer span takes at least three cycles. A span is flagged at its first pixel out of
    range.

    With several lanes `QuotientLanesUnit` gives the words of all pixels of a beat. Each lane has a
    `QuotientUnit`. All have the same handshakes, so they are in the same state on every cycle. With pairs
    spans bring their lines, so the constants are not read.

    Parameters
    ----------
    model : QuotientInterpolator
        Bit-accurate model, with the kind of highlight.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`. The method has one setup interval.

    Members
    -------
    begun : :py:`Out(1)`
        Whether words of the offered span were taken already. Payload and constants then have to stay.

    Source: docs/theory/quotient.md.
    """

    @classmethod
    def span_shape(cls, lights, *, highlights=True, length_bits=LENGTH_BITS, mirror=False, pairs=False):
        """Shape of a span: vectors in the frames of the lights, their steps, and the length.

        For several lanes (``pairs``) with highlights, lines follow.
        """
        model = QuotientLanes if pairs else QuotientSpans
        return vectors_shape(model(lights, highlights, mirror and highlights), length_bits)

    @classmethod
    def span_options(cls, model):
        """Whether highlights are those of R·V, for which y is times cos a, and whether spans may be pairs."""
        return {"mirror": model.mirror, "pairs": model.pairs}

    room_after = 0

    @property
    def shortest_interval(self):
        """Least cycles from any span to the next: 1, after a span of one pixel."""
        return 1

    def span_intervals(self, spans):
        """Intervals of the spans. They are shorter for spans of one or two pixels."""
        return np.maximum(np.minimum(spans.length, 3) * self.setup_interval // 3, 1)

    @property
    def has_begun(self):
        """Whether words of the offered span were taken already: the port ``begun``."""
        return self.begun

    def further_members(self):
        """The port ``begun``, for the pipeline."""
        return {"begun": Out(1)}

    def __init__(self, model: QuotientInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        spans = model.spans(lights, self.highlights)
        if self.lanes > 1:
            beats = QuotientLanes(spans.lights, spans.highlights, spans.mirror, self.lanes, model.pairs)
            self._spans = QuotientLanesUnit(beats, self.length_bits)
        else:
            # If a pixel takes several cycles, one multiplier has enough time for a span.
            self._spans = QuotientSpansUnit(spans, self.length_bits, serial=self.product_interval > 1)
        # Memories of several lanes would take many look-up tables.
        memories, quotient = self.lanes == 1, Quotient(spans)
        self._quotients = [QuotientUnit(quotient, self.product_interval, memories) for _ in range(self.lanes)]
        self._quotient = self._quotients[0]
        self.setup_interval = self._spans.initiation_interval
        self.cycles_per_pixel = self.product_interval
        self.latency = self._spans.latency + self._quotient.latency

    def elaborate(self, platform):
        """Words of pixels, quotients, and a flag for each span with a pixel that is out of range."""
        m = Module()
        m.submodules.quotient_spans = spans = self._spans
        m.submodules.quotient = quotient = self._quotient
        for lane, further in enumerate(self._quotients[1:], 1):
            m.submodules[f"quotient_{lane}"] = further
        for name in self.i.payload.shape().members:
            m.d.comb += copy(spans.i.payload[name], self.i.payload[name])
        m.d.comb += [
            spans.i.valid.eq(self.i.valid),
            self.i.ready.eq(spans.i.ready),
            self.begun.eq(spans.begun),
        ]
        if "constants" in spans.signature.members:
            for given, light in zip(spans.constants, self.constants, strict=True):
                m.d.comb += [given[0].eq(light.direction[0]), given[1].eq(light.direction[2])]
        if self.lanes == 1:
            connect(m, spans.o, quotient.i)
            result, results = quotient.o.payload, [self.o.payload]
        else:
            result, results = self._connect_lanes(m), self.o.payload
        for unit, of_lane in zip(self._quotients, results, strict=True):
            for light, operands in zip(unit.o.payload.lights, of_lane, strict=True):
                for name in light.shape().members:
                    m.d.comb += operands[name].eq(light[name])
        m.d.comb += [
            self.o.valid.eq(quotient.o.valid),
            quotient.o.ready.eq(self.o.ready),
            self.out_of_range.eq(flag_spans(m, self.o.valid & self.o.ready, result)),
        ]
        return m

    def _connect_lanes(self, m: Module) -> SimpleNamespace:
        """Connect the quotient unit of each lane. Returns the marks of a beat, for `flag_spans`."""
        given, lost = self._spans.o, []
        for lane, quotient in enumerate(self._quotients):
            m.d.comb += [
                copy(quotient.i.payload, given.payload[lane]),
                quotient.i.valid.eq(given.valid),
                quotient.o.ready.eq(self.o.ready),
            ]
            marks = quotient.o.payload
            # In further lanes the bit tells whether there is a pixel.
            lost.append(marks.out_of_range & (marks.span if lane else 1))
        m.d.comb += given.ready.eq(self._quotient.i.ready)
        return SimpleNamespace(out_of_range=Cat(lost).any(), span=self._quotient.o.payload.span)
