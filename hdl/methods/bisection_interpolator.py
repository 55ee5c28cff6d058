"""Bisection of spans into segments short enough for straight lines ([T] figure 2.7): method ``bisection``."""

import numpy as np
from amaranth.lib import stream

from blysk.golden.methods.bisection_interpolator import BisectionInterpolator
from blysk.golden.number.unit_vector import ONE
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.views import copy
from blysk.hdl.methods.interpolator import NormalInterpolatorUnit, span_words
from blysk.hdl.normals.adaptive_normaliser import SEGMENT_CYCLES, AdaptiveNormaliserUnit

__all__ = ["BisectionInterpolatorUnit"]

EMPTY_SEGMENT_CYCLES = 3
"""Cycles of the adaptive normaliser for a segment without a pixel."""


class BisectionInterpolatorUnit(NormalInterpolatorUnit, model=BisectionInterpolator):
    """Operands by normals of the adaptive normaliser. `BisectionInterpolator` is the bit-accurate model.

    `latency` and `setup_interval` hold for a span of one segment. A span of several segments takes more
    cycles (see `AdaptiveNormaliserUnit`).

    Parameters
    ----------
    model : BisectionInterpolator
        Bit-accurate model, with threshold, factor of the bisection unit, and specular operand.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`.

    Source: docs/theory/interpolation.md#adaptive-normaliser; [T] 2.1, figure 2.7.
    """

    def __init__(self, model: BisectionInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        self._normaliser = AdaptiveNormaliserUnit(model.normaliser)
        self.latency = self._normaliser.preparation(0) + self.product_latency
        self.setup_interval = self._normaliser.interval(0)

    def span_intervals(self, spans):
        """Intervals of the spans. If a span has several segments, its interval is longer.

        A span's levels are counted while the previous span is divided.
        """
        unit = self._normaliser
        normaliser = unit.model
        steps = np.asarray(spans.length) - 1
        cosine = np.einsum("ij,ij->i", spans.normal_left / ONE, spans.normal_right / ONE)
        q = (1 - cosine) / 4
        levels = ((q + q * q)[:, np.newaxis] > normaliser.limits.values).sum(axis=1)
        levels = np.minimum(levels, np.where(steps < 3, np.maximum(steps - 1, 0), normaliser.depth))
        counting = np.array([unit.counting(level) for level in range(normaliser.depth + 1)])
        empty = np.maximum((1 << levels) - steps, 0)
        segments = SEGMENT_CYCLES * ((1 << levels) + 1) - (SEGMENT_CYCLES - EMPTY_SEGMENT_CYCLES) * empty
        return np.maximum(counting[levels], np.r_[0, segments[:-1]])

    def source(self, m):
        """The normaliser's normals. Its flag comes on the last pixel of a span."""
        m.submodules.adaptive_normaliser = normaliser = self._normaliser
        m.d.comb += [
            *(normaliser.i.payload[name].eq(word) for name, word in span_words(self.i.payload)),
            normaliser.i.valid.eq(self.i.valid),
            self.i.ready.eq(normaliser.i.ready),
        ]
        normals = stream.Signature(normal_shape()).create(path=("normals",))
        pixel = normaliser.o.payload
        m.d.comb += [
            copy(normals.payload, pixel.normal),
            normals.valid.eq(normaliser.o.valid),
            normaliser.o.ready.eq(normals.ready),
        ]
        return normals, normals.valid & normals.ready & pixel.last & pixel.out_of_range
