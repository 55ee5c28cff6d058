"""Linear interpolation of normals, as it is (``linear``) or brought to unit length (``renormalise``)."""

from amaranth.hdl import Cat, Signal, Value
from amaranth.lib import fifo, stream

from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.normals.gpq import GPQ
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import SLICE_LATENCY, connect, connect_slice, skid_buffer
from blysk.hdl.methods.interpolator import NormalInterpolatorUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.renormaliser import RenormaliserUnit

__all__ = ["LinearInterpolatorUnit"]


class LinearInterpolatorUnit(NormalInterpolatorUnit, parameters=LinearInterpolator):
    """Normals on a straight line; `LinearInterpolator` is the bit-accurate model.

    The difference setup of a straight line, ``P = N_r - N_l``, the accumulator, and with ``renormalised`` the
    direct renormaliser, of eight multipliers. A span that is out of range is flagged when it is accepted;
    with ``renormalised`` at its first pixel that is out of range of the difference or of the renormaliser.

    Parameters
    ----------
    parameters : LinearInterpolator
        Renormalised or not, and the specular operand.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`; ``setup_interval`` is 1 to 7.

    Source: docs/theory/interpolation.md#spans, docs/theory/interpolation.md#renormaliser; [T] 2.1.
    """

    PREPARED = 3
    """Spans before the accumulator: one at the output of the setup, two in the register slice."""

    @classmethod
    def setup_intervals(cls, parameters):
        """Initiation intervals of the difference setup."""
        return range(1, 8)

    def __init__(self, parameters: LinearInterpolator, lights: int, **options):
        super().__init__(parameters, lights, **options)
        self._setup = DifferenceSetupUnit(
            initiation_interval=self.setup_interval, length_bits=self.length_bits, order=1
        )
        self._accumulator = DifferenceAccumulatorUnit()
        units = [self._setup, self._accumulator]
        if parameters.renormalised:
            self._renormaliser = RenormaliserUnit()
            units.append(self._renormaliser)
        self.latency = sum(unit.latency for unit in units) + SLICE_LATENCY + self.product_latency

    def source(self, m):
        """Difference, its share a pixel, the sums."""
        m.submodules.difference_setup = setup = self._setup
        m.submodules.difference_accumulator = accumulator = self._accumulator
        span, operands = self.i.payload, setup.i.payload
        differences = [span.normal_right[c] - span.normal_left[c] for c in range(3)]
        m.d.comb += [
            *(operands.p[c].eq(differences[c].saturate(GPQ.P_FORMAT)) for c in range(3)),
            operands.q.eq(span.normal_left),
            operands.length.eq(span.length),
            setup.i.valid.eq(self.i.valid),
            self.i.ready.eq(setup.i.ready),
        ]
        tops = (Value.cast(difference)[-2:] for difference in differences)
        far = Cat(top[0] ^ top[1] for top in tops).any()
        connect_slice(m, setup.o, accumulator.i)
        out_of_range = Signal()
        if not self.parameters.renormalised:
            m.d.sync += out_of_range.eq(self.i.valid & self.i.ready & far)
            return accumulator.o, out_of_range
        m.submodules.renormaliser = renormaliser = self._renormaliser
        connect(m, accumulator.o, renormaliser.i)
        normals = stream.Signature(normal_shape()).create(path=("normals",))
        m.d.comb += [
            normals.payload.eq(renormaliser.o.payload.normal),
            normals.valid.eq(renormaliser.o.valid),
            renormaliser.o.ready.eq(normals.ready),
        ]
        first, far = self._flags_of_pixels(m, far)
        # Whether an earlier pixel of this span was out of range.
        flagged, flag = Signal(), Signal()
        before = flagged & ~first
        m.d.comb += flag.eq((first & far) | renormaliser.o.payload.out_of_range)
        m.d.sync += out_of_range.eq(0)
        with m.If(normals.valid & normals.ready):
            m.d.sync += [out_of_range.eq(flag & ~before), flagged.eq(flag | before)]
        return normals, out_of_range

    def _flags_of_pixels(self, m, far):
        """For each normal of the renormaliser: whether it is the first of its span, and ``far`` of the span.

        ``far`` is of a span at the input. Registers parallel to those of the accumulator and the renormaliser
        carry both flags.
        """
        setup, accumulator, renormaliser = self._setup, self._accumulator, self._renormaliser
        # Never full: it has room for every span between the input and the accumulator.
        depth = -(-setup.latency // self.setup_interval) + 1 + self.PREPARED
        m.submodules.far = spans = fifo.SyncFIFOBuffered(width=1, depth=depth)
        load = accumulator.i.valid & accumulator.i.ready
        m.d.comb += [
            spans.w_data.eq(far),
            spans.w_en.eq(self.i.valid & self.i.ready),
            spans.r_en.eq(load),
        ]
        flags = Cat(load, spans.r_data)
        for name, unit in (("accumulator_flags", accumulator), ("renormaliser_flags", renormaliser)):
            stages = Signal(2 * unit.latency, name=name)
            output = stream.Signature(2).create(path=(name,))
            advance = skid_buffer(m, output, unit.o.valid, stages[-2:])
            m.d.comb += output.ready.eq(unit.o.ready)
            with m.If(advance):
                m.d.sync += stages.eq(Cat(flags, stages))
            flags = output.payload
        return flags[0], flags[1]
