"""Linear interpolation of normals."""

from amaranth.hdl import Cat, Signal, Value

from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.normals.gpq import GPQ
from blysk.hdl.core.memory import connect_wide_fifo
from blysk.hdl.core.stream import SLICE_LATENCY
from blysk.hdl.core.views import copy
from blysk.hdl.methods.interpolator import NormalInterpolatorUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit

__all__ = ["LinearInterpolatorUnit"]


class LinearInterpolatorUnit(NormalInterpolatorUnit, model=LinearInterpolator):
    """Normals on a straight line. `LinearInterpolator` is the bit-accurate model.

    The unit has the difference setup of a straight line, ``P = N_r - N_l``, and the accumulator. A span out
    of range is flagged when it is accepted.

    Parameters
    ----------
    model : LinearInterpolator
        Bit-accurate model, with the specular operand.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`, with a ``setup_interval`` of 1 to 7.

    Source: docs/theory/interpolation.md#spans; [T] 2.1.
    """

    @classmethod
    def setup_intervals(cls, model):
        """Initiation intervals of the difference setup."""
        return range(1, 8)

    def __init__(self, model: LinearInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        self._setup = DifferenceSetupUnit(
            initiation_interval=self.setup_interval, length_bits=self.length_bits, order=1
        )
        self._accumulator = DifferenceAccumulatorUnit()
        units = self._setup, self._accumulator
        self.latency = sum(unit.latency for unit in units) + SLICE_LATENCY + self.product_latency

    def source(self, m):
        """Difference, its share for each pixel, and the sums."""
        m.submodules.difference_setup = setup = self._setup
        m.submodules.difference_accumulator = accumulator = self._accumulator
        span, operands = self.i.payload, setup.i.payload
        differences = [span.normal_right[c] - span.normal_left[c] for c in range(3)]
        m.d.comb += [
            *(operands.p[c].eq(differences[c].saturate(GPQ.P_FORMAT)) for c in range(3)),
            copy(operands.q, span.normal_left),
            operands.length.eq(span.length),
            setup.i.valid.eq(self.i.valid),
            self.i.ready.eq(setup.i.ready),
        ]
        tops = (Value.cast(difference)[-2:] for difference in differences)
        far = Cat(top[0] ^ top[1] for top in tops).any()
        connect_wide_fifo(m, "prepared", setup.o, accumulator.i)
        out_of_range = Signal()
        m.d.sync += out_of_range.eq(self.i.valid & self.i.ready & far)
        return accumulator.o, out_of_range
