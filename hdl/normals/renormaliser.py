"""Renormaliser: a vector of about unit length divided by its length, one in every cycle."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import SQ, UQ
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import PipelinedUnit
from blysk.hdl.normals.dot_product import DotProductUnit

__all__ = ["RenormaliserUnit"]


class RenormaliserUnit(PipelinedUnit):
    """Unit vector ``N = v/sqrt(v . v)``, by a reciprocal square root in 18 quadratic segments.

    `Renormaliser`, the bit-accurate model, has segments, formats, error bound and flag.

    The latency is 12 cycles (dot product 3, segment, table, four for the polynomial, scaling, sum,
    saturation), the initiation interval 1. Eight multipliers: three squares, two in the polynomial,
    three scalings. The table holds 18 words of 49 bits.

    Parameters
    ----------
    parameters : Renormaliser
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Vectors.
    o : :py:`Out(stream.Signature(StructLayout({"normal", "out_of_range"})))`
        Unit vector, ``SQ(1, 17)``; ``out_of_range``: the length is, and the vector is that of the input.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    def __init__(self, parameters: Renormaliser | None = None):
        self.parameters = parameters or Renormaliser()
        super().__init__(
            normal_shape(),
            data.StructLayout({"normal": normal_shape(), "out_of_range": unsigned(1)}),
            latency=12,
        )

    def datapath(self, m, operands):
        """Square, segment and offset in it, ``c0 - u (c1 - u c2)``, and ``v + e v``."""
        p, register = self.parameters, self.register
        m.submodules.dot_product = dot_product = DotProductUnit()
        m.d.comb += [
            dot_product.i.payload.a.eq(operands),
            dot_product.i.payload.b.eq(operands),
            dot_product.i.valid.eq(1),
            dot_product.o.ready.eq(1),
        ]
        vector = [operands]
        for stage in range(1, 11):
            vector.append(register(m, vector[-1], f"vector_{stage}"))

        square = dot_product.o.payload.truncate(p.OFFSET_FORMAT.fraction_bits)
        low = FixedValue.constant(UQ(0, 22), p.LOW)
        offset = Value.cast(register(m, square - low, "offset"))
        bits = p.OFFSET_FORMAT.width
        segment = offset[bits:]
        # A negative offset has high bits, too.
        out_of_range = register(m, segment >= p.SEGMENTS, "out_of_range_5")
        u = FixedValue(p.OFFSET_FORMAT, register(m, offset[:bits], "u_5"))
        c0, c1, c2 = self._coefficients(m, segment[: p.SEGMENT_BITS])

        square_term = register(m, u * c2, "square_term")
        c0, c1, u = register(m, c0, "c0_6"), register(m, c1, "c1_6"), register(m, u, "u_6")
        with_half = FixedValue(UQ(1, 17), Cat(Const(1, 1), Value.cast(c1)))
        slope = register(m, (with_half - square_term).truncate(16).wrap(p.C1_FORMAT), "slope")
        c0, u = register(m, c0, "c0_7"), register(m, u, "u_7")
        linear_term = register(m, u * slope, "linear_term")
        c0 = register(m, c0, "c0_8")
        for stage in range(6, 9):
            out_of_range = register(m, out_of_range, f"out_of_range_{stage}")
        e = (c0 - linear_term).truncate(18).wrap(p.FACTOR_FORMAT)
        e = FixedValue(p.FACTOR_FORMAT, register(m, Mux(out_of_range, 0, Value.cast(e)), "e"))
        for stage in range(9, 13):
            out_of_range = register(m, out_of_range, f"out_of_range_{stage}")

        result = Signal(self.o.payload.shape())
        m.d.comb += result.out_of_range.eq(out_of_range)
        for c in range(3):
            scaled = register(m, e * vector[9][c], f"scaled_{c}")
            with_half = FixedValue(SQ(1, 18), Cat(Const(1, 1), Value.cast(vector[10][c])))
            total = register(m, (with_half + scaled).truncate(17), f"total_{c}")
            m.d.comb += result.normal[c].eq(register(m, total.saturate(COMPONENT), f"normal_{c}"))
        return result

    def _coefficients(self, m, segment):
        """``c0``, ``c1`` and ``c2`` of the segment, one cycle later; c0 with half a step of e added."""
        p = self.parameters
        c0, c1, c2 = p.coefficients
        layout = data.StructLayout(
            {
                "c0": FixedShape(p.C0_FORMAT),
                "c1": FixedShape(p.C1_FORMAT),
                "c2": FixedShape(p.C2_FORMAT),
            }
        )
        half = p.FACTOR_FORMAT.step / 2
        rows = zip((c0.values + half).tolist(), c1.values.tolist(), c2.values.tolist(), strict=True)
        rows = [dict(zip(("c0", "c1", "c2"), row, strict=True)) for row in rows]
        m.submodules.coefficients = table = Memory(shape=layout, depth=1 << p.SEGMENT_BITS, init=rows)
        port = table.read_port()
        m.d.comb += port.addr.eq(segment)
        return port.data.c0, port.data.c1, port.data.c2
