"""Renormalisation at every pixel: perspective-correct normals of wide spans."""

from amaranth.hdl import Signal
from amaranth.lib import data, stream

from blysk.golden.methods.renormalise_interpolator import RenormaliseInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.memory import connect_wide_fifo
from blysk.hdl.core.shapes import normal_shape, span_normals_shape
from blysk.hdl.core.stream import SLICE_LATENCY
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.methods.interpolator import NormalInterpolatorUnit, flag_spans
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit
from blysk.hdl.normals.line_setup import LineSetupUnit, line_shape
from blysk.hdl.normals.renormaliser import RenormaliserUnit, vector_shape

__all__ = ["LineAccumulatorUnit", "RenormaliseInterpolatorUnit"]


class LineAccumulatorUnit(AccumulatorUnit):
    """Vectors of a straight line, and a bit that changes from span to span.

    Parameters
    ----------
    model : RenormaliseInterpolator
        Bit-accurate model, with the formats.
    length_bits : int
        Bits of the length.
    """

    def __init__(self, model: RenormaliseInterpolator, length_bits: int = LENGTH_BITS):
        self.model = model
        members = {"line": line_shape(length_bits), "length": line_shape(length_bits)["length"].shape}
        super().__init__(
            data.StructLayout(members | {"span": 1}),
            data.StructLayout({"vector": vector_shape(), "span": 1}),
        )

    def carried(self, values):
        """The bit that changes from span to span."""
        yield self.span.span, values.span

    def quadratics(self, values):
        """The components, with second differences of 0."""
        p, line = self.model.accumulator, self.span.line
        zero = FixedValue.constant(p.difference_format, 0)
        for c in range(3):
            yield f"vector_{c}", p, (line.start[c], line.step[c], zero), values.vector[c]


class RenormaliseInterpolatorUnit(NormalInterpolatorUnit, model=RenormaliseInterpolator):
    """Line setup, accumulator, renormaliser. `RenormaliseInterpolator` is the bit-accurate model.

    The renormaliser has eight multipliers, the setup ``ceil(9 / setup_interval)``. A span is flagged at its
    first pixel out of range.

    Parameters
    ----------
    model : RenormaliseInterpolator
        Bit-accurate model, with the specular operand.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`, with a ``setup_interval`` of 1 to 5 or 9.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    DEFAULT_INTERVAL = 3
    """Largest default of `setup_interval`. An interval of 4 takes as many multipliers as 3."""

    @classmethod
    def setup_intervals(cls, model):
        """Initiation intervals of the line setup that save multipliers."""
        return (1, 2, 3, 4, 5, 9)

    @classmethod
    def span_shape(cls, lights, *, highlights=True, length_bits=LENGTH_BITS):
        """Shape of a span: ends of the line, which are vectors in ``SQ(1, 22)``, and the length."""
        members = span_normals_shape(length_bits).members
        ends = dict.fromkeys(("normal_left", "normal_right"), vector_shape())
        return data.StructLayout({**members, **ends})

    def __init__(self, model: RenormaliseInterpolator, lights: int, **options):
        super().__init__(model, lights, **options)
        self._setup = LineSetupUnit(initiation_interval=self.setup_interval, length_bits=self.length_bits)
        self._accumulator = LineAccumulatorUnit(model, self.length_bits)
        self._renormaliser = RenormaliserUnit()
        units = self._setup, self._accumulator, self._renormaliser
        self.latency = sum(unit.latency for unit in units) + SLICE_LATENCY + self.product_latency

    def source(self, m):
        """Lines, their vectors, unit vectors, and a flag for each span with a vector that is too short."""
        m.submodules.line_setup = setup = self._setup
        m.submodules.line_accumulator = accumulator = self._accumulator
        m.submodules.renormaliser = renormaliser = self._renormaliser
        line = stream.Signature(accumulator.i.payload.shape()).create(path=("line",))
        parity = Signal()
        m.d.comb += [
            *copy_fields(setup.i.payload, self.i.payload, self.i.payload.shape().members),
            setup.i.valid.eq(self.i.valid),
            self.i.ready.eq(setup.i.ready),
            copy(line.payload.line, setup.o.payload),
            line.payload.length.eq(setup.o.payload.length),
            line.payload.span.eq(parity),
            line.valid.eq(setup.o.valid),
            setup.o.ready.eq(line.ready),
        ]
        with m.If(line.valid & line.ready):
            m.d.sync += parity.eq(~parity)
        connect_wide_fifo(m, "prepared", line, accumulator.i)
        normals = stream.Signature(normal_shape()).create(path=("normals",))
        result = renormaliser.o.payload
        m.d.comb += [
            copy(renormaliser.i.payload, accumulator.o.payload),
            renormaliser.i.valid.eq(accumulator.o.valid),
            accumulator.o.ready.eq(renormaliser.i.ready),
            copy(normals.payload, result.normal),
            normals.valid.eq(renormaliser.o.valid),
            renormaliser.o.ready.eq(normals.ready),
        ]
        return normals, flag_spans(m, normals.valid & normals.ready, result)
