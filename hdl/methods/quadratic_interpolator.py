"""Quadratic interpolation of normals ([T] 2.2): methods ``quadratic``, ``-eval`` and ``-horner``."""

from amaranth.lib import fifo, stream

from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.hdl.core.memory import connect_wide_fifo
from blysk.hdl.core.stream import SLICE_LATENCY, connect_slice
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.methods.interpolator import NormalInterpolatorUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.gpq import GPQUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit

__all__ = ["QuadraticInterpolatorUnit"]


class QuadraticInterpolatorUnit(NormalInterpolatorUnit, model=QuadraticInterpolator):
    """Normals on a quadratic curve. `QuadraticInterpolator` is the bit-accurate model.

    Middle normal and G/P/Q find the coefficients of a span. Forward differences, or an evaluator, find the
    normals of its pixels. A FIFO carries the lengths past middle normal and G/P/Q.

    =============== ======================== ===================== ============
    form            multipliers              setup interval        cycles/pixel
    =============== ======================== ===================== ============
    ``differences`` those of the two setups  ``setup_interval``    1
    ``direct``      7 and the middle normal  7                     1
    ``horner``      3 and the middle normal  8                     2
    =============== ======================== ===================== ============

    Parameters
    ----------
    model : QuadraticInterpolator
        Bit-accurate model, with form and specular operand.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`. ``setup_interval`` of the form ``differences`` is 1 to 7.

    Source: docs/theory/interpolation.md#quadratic-normals, docs/theory/interpolation.md#forward-differences;
    [T] 2.2, 2.3, figures 2.8 to 2.11.
    """

    @classmethod
    def setup_intervals(cls, model):
        """Initiation intervals of the middle normal and the difference setup."""
        return range(1, 8) if model.form == "differences" else range(0)

    def __init__(self, model: QuadraticInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        differences = model.form == "differences"
        interval = self.setup_interval if differences else 4
        self._middle = MiddleNormalUnit(model.middle_normal, initiation_interval=interval)
        self._gpq = GPQUnit()
        before = self._middle.latency + self._gpq.latency
        if differences:
            self._setup = DifferenceSetupUnit(initiation_interval=interval, length_bits=self.length_bits)
            self._accumulator = DifferenceAccumulatorUnit()
            after = self._setup.latency + SLICE_LATENCY + self._accumulator.latency
        else:
            self._evaluator = QuadraticEvaluatorUnit(QuadraticEvaluator(model.form))
            # If a pixel takes two cycles, an interval of 7 would end inside a pixel.
            self.setup_interval = 7 if model.form == "direct" else 8
            self.cycles_per_pixel = max(self.cycles_per_pixel, self._evaluator.cycles_per_pixel)
            after = self._evaluator.latency
        self.latency = before + after + self.product_latency

    def source(self, m):
        """Coefficients, and the normals of the form."""
        m.submodules.middle_normal = middle = self._middle
        m.submodules.gpq = gpq = self._gpq
        # The FIFO is never full. Its depth is the largest number of spans inside both units, plus one at each
        # output.
        depth = -(-middle.latency // middle.initiation_interval) + gpq.latency + 2
        m.submodules.lengths = lengths = fifo.SyncFIFOBuffered(width=self.length_bits, depth=depth)
        length = stream.Signature(self.length_bits).create(path=("length",))
        connect_slice(m, lengths.r_stream, length)
        differences = self.model.form == "differences"
        curve = self._setup if differences else self._evaluator
        span = self.i.payload
        # The length is written a cycle late, because the handshake comes late in a cycle.
        m.d.sync += [lengths.w_en.eq(self.i.valid & self.i.ready), lengths.w_data.eq(span.length)]
        m.d.comb += [
            self.i.ready.eq(middle.i.ready),
            middle.i.valid.eq(self.i.valid),
            copy(middle.i.payload.normal_left, span.normal_left),
            copy(middle.i.payload.normal_right, span.normal_right),
            *copy_fields(gpq.i.payload, middle.o.payload, ("normal_left", "normal_middle", "normal_right")),
            gpq.i.valid.eq(middle.o.valid),
            middle.o.ready.eq(gpq.i.ready),
            # A length comes before its coefficients. Both start on the same cycle, and the coefficients take
            # more cycles than the length.
            *copy_fields(curve.i.payload, gpq.o.payload, "gpq"),
            curve.i.payload.length.eq(length.payload),
            curve.i.valid.eq(gpq.o.valid),
            gpq.o.ready.eq(curve.i.ready),
            length.ready.eq(gpq.o.valid & curve.i.ready),
        ]
        if differences:
            m.submodules.difference_setup = curve
            m.submodules.difference_accumulator = accumulator = self._accumulator
            connect_wide_fifo(m, "prepared", curve.o, accumulator.i)
            normals = accumulator.o
        else:
            m.submodules.evaluator = curve
            normals = curve.o
        return normals, middle.o.valid & middle.o.ready & middle.o.payload.out_of_range
