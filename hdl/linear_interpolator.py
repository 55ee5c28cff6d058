"""Linear interpolation of normals, as it comes (``linear``) or brought to unit length (``renormalise``)."""

from amaranth.hdl import Cat, Signal, Value
from amaranth.lib import stream

from golden.gpq import GPQ
from golden.linear_interpolator import LinearInterpolator

from .difference_accumulator import DifferenceAccumulatorUnit
from .difference_setup import DifferenceSetupUnit
from .interpolator import NormalInterpolatorUnit
from .middle_normal import normal_shape
from .renormaliser import RenormaliserUnit
from .stream import BUFFER_LATENCY, connect, connect_buffered

__all__ = ["LinearInterpolatorUnit"]


class LinearInterpolatorUnit(NormalInterpolatorUnit):
    """Normals on a straight line; `golden.linear_interpolator.LinearInterpolator` is the twin.

    The difference setup of a straight line, ``P = N_r - N_l``, the accumulator, and with ``renormalised`` the
    direct renormaliser, of eight multipliers.

    Parameters
    ----------
    parameters : LinearInterpolator
        Renormalised or not, and the specular operand.
    lights : int
        Number of lights, at least 1.
    setup_interval : int
        Clocks from a span to the next at the closest, 1 to 7.

    Source: [T] 2.1; numbers.md, "Rivals to measure against".
    """

    @classmethod
    def setup_intervals(cls, parameters):
        """What the setup can be built for."""
        return range(1, 8)

    def __init__(self, parameters: LinearInterpolator, lights: int, setup_interval: int = 4):
        super().__init__(parameters, lights)
        self.setup_interval = setup_interval
        self._setup = DifferenceSetupUnit(initiation_interval=setup_interval, order=1)
        self._accumulator = DifferenceAccumulatorUnit()
        units = [self._setup, self._accumulator]
        if parameters.renormalised:
            self._renormaliser = RenormaliserUnit()
            units.append(self._renormaliser)
        self.latency = sum(unit.latency for unit in units) + BUFFER_LATENCY + self.product_latency

    def source(self, m):
        """Difference, its share a pixel, the sums."""
        m.submodules.difference_setup = setup = self._setup
        m.submodules.difference_accumulator = accumulator = self._accumulator
        span, operands = self.i.payload, setup.i.payload
        wide = Signal()
        differences = [span.normal_right[c] - span.normal_left[c] for c in range(3)]
        m.d.comb += [
            *(operands.p[c].eq(differences[c].saturate(GPQ.P_FORMAT)) for c in range(3)),
            operands.q.eq(span.normal_left),
            operands.length.eq(span.length),
            setup.i.valid.eq(self.i.valid),
            self.i.ready.eq(setup.i.ready),
        ]
        tops = (Value.cast(difference)[-2:] for difference in differences)
        m.d.sync += wide.eq(self.i.valid & self.i.ready & Cat(top[0] ^ top[1] for top in tops).any())
        connect_buffered(m, "prepared", setup.o, accumulator.i, depth=3)
        if not self.parameters.renormalised:
            return accumulator.o, wide
        m.submodules.renormaliser = renormaliser = self._renormaliser
        connect(m, accumulator.o, renormaliser.i)
        normals = stream.Signature(normal_shape()).create(path=("normals",))
        m.d.comb += [
            normals.payload.eq(renormaliser.o.payload.normal),
            normals.valid.eq(renormaliser.o.valid),
            renormaliser.o.ready.eq(normals.ready),
        ]
        return normals, wide
