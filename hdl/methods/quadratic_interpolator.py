"""Quadratic interpolation of normals ([T] 2.2): methods ``quadratic``, ``-eval`` and ``-horner``."""

from amaranth.lib import fifo, stream

from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.hdl.core.stream import SLICE_LATENCY, connect_slice
from blysk.hdl.methods.interpolator import NormalInterpolatorUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.gpq import GPQUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit

__all__ = ["QuadraticInterpolatorUnit"]


class QuadraticInterpolatorUnit(NormalInterpolatorUnit):
    """Normals on a quadratic curve; `QuadraticInterpolator` is the twin.

    Middle normal and G/P/Q prepare spans; forward differences, or an evaluator, make their pixels. The
    lengths go round the preparation in a FIFO.

    =============== ======================== ===================== ============
    form            multipliers              setup interval        cycles/pixel
    =============== ======================== ===================== ============
    ``differences`` those of the two setups  ``setup_interval``    1
    ``direct``      7 and the middle normal  7                     1
    ``horner``      3 and the middle normal  8                     2
    =============== ======================== ===================== ============

    Parameters
    ----------
    parameters : QuadraticInterpolator
        Form and specular operand.
    lights : int
        Number of lights, at least 1.
    setup_interval : int
        Clocks from a span to the next at the closest, 1 to 7: what the middle normal and the difference
        setup are built for.
    options
        As for `InterpolatorUnit`.

    Source: [T] 2.2, 2.3, figures 2.8 to 2.11.
    """

    @classmethod
    def setup_intervals(cls, parameters):
        """What the setup can be built for."""
        return range(1, 8) if parameters.form == "differences" else range(0)

    def __init__(self, parameters: QuadraticInterpolator, lights: int, setup_interval: int = 4, **options):
        super().__init__(parameters, lights, **options)
        self._middle, self._gpq = MiddleNormalUnit(parameters.middle_normal, setup_interval), GPQUnit()
        before = self._middle.latency + self._gpq.latency
        if parameters.form == "differences":
            self._setup = DifferenceSetupUnit(
                initiation_interval=setup_interval, length_bits=self.length_bits
            )
            self._accumulator = DifferenceAccumulatorUnit()
            self.setup_interval = setup_interval
            after = self._setup.latency + SLICE_LATENCY + self._accumulator.latency
        else:
            self._evaluator = QuadraticEvaluatorUnit(QuadraticEvaluator(parameters.form))
            # A pixel comes every two cycles, on which an interval of 7 does not end.
            self.setup_interval = 7 if parameters.form == "direct" else 8
            self.cycles_per_pixel = self._evaluator.cycles_per_pixel
            after = self._evaluator.latency
        self.latency = before + after + self.product_latency

    def source(self, m):
        """Coefficients, and the form that takes them to normals."""
        m.submodules.middle_normal = middle = self._middle
        m.submodules.gpq = gpq = self._gpq
        # As many as both units hold, each with one that waits: never full.
        depth = -(-middle.latency // middle.initiation_interval) + gpq.latency + 2
        m.submodules.lengths = lengths = fifo.SyncFIFOBuffered(width=self.length_bits, depth=depth)
        length = stream.Signature(self.length_bits).create(path=("length",))
        connect_slice(m, lengths.r_stream, length)
        differences = self.parameters.form == "differences"
        curve = self._setup if differences else self._evaluator
        span = self.i.payload
        m.d.comb += [
            self.i.ready.eq(middle.i.ready),
            middle.i.valid.eq(self.i.valid),
            middle.i.payload.normal_left.eq(span.normal_left),
            middle.i.payload.normal_right.eq(span.normal_right),
            lengths.w_en.eq(self.i.valid & middle.i.ready),
            lengths.w_data.eq(span.length),
            *(
                gpq.i.payload[name].eq(middle.o.payload[name])
                for name in ("normal_left", "normal_middle", "normal_right")
            ),
            gpq.i.valid.eq(middle.o.valid),
            middle.o.ready.eq(gpq.i.ready),
            # A length is always there before its coefficients: the two have left together.
            *(curve.i.payload[name].eq(gpq.o.payload[name]) for name in "gpq"),
            curve.i.payload.length.eq(length.payload),
            curve.i.valid.eq(gpq.o.valid),
            gpq.o.ready.eq(curve.i.ready),
            length.ready.eq(gpq.o.valid & curve.i.ready),
        ]
        if differences:
            m.submodules.difference_setup = curve
            m.submodules.difference_accumulator = accumulator = self._accumulator
            connect_slice(m, curve.o, accumulator.i)
            normals = accumulator.o
        else:
            m.submodules.evaluator = curve
            normals = curve.o
        return normals, middle.o.valid & middle.o.ready & middle.o.payload.out_of_range
