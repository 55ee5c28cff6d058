"""Renormaliser: a vector of any length divided by its length, with a result in every cycle."""

from typing import ClassVar

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.normals.dot_product import DotProductUnit

__all__ = ["RenormaliserUnit", "vector_shape"]


def vector_shape() -> data.ArrayLayout:
    """Shape of a vector of any length: three components ``SQ(1, 22)``."""
    return data.ArrayLayout(FixedShape(Renormaliser.VECTOR_FORMAT), 3)


class RenormaliserUnit(PipelinedUnit):
    """Unit vector ``N = v / |v|`` by a shift and a reciprocal square root in 64 quadratic segments.

    `Renormaliser`, the bit-accurate model, has segments, formats, error bounds and flag.

    The latency is 25 cycles: leading one, its place, two for the shift, rounding, operands of the squares,
    three for the dot product, octave, segment, two for the table, operand of the polynomial, product,
    difference, rounding, product, difference, rounding, saturation, operand of the last products, product,
    rounding, saturation. The initiation interval is 1. The unit has eight multipliers: three squares, two in
    the polynomial, three products with the factor. The table holds 64 words of 48 bits.

    Parameters
    ----------
    model : Renormaliser
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"vector": vector_shape(), "span": 1})))`
        Vectors, and a bit ``span`` that passes through.
    o : :py:`Out(stream.Signature(StructLayout({"normal", "out_of_range", "span"})))`
        Unit vector, ``SQ(1, 17)``. ``out_of_range``: the vector is too short, and the normal is invalid.
        ``span``: the bit of the vector.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        "square_term": "c_2·x",
        "exact_slope": "c_1 − c_2·x",
        "slope": "c_1 − c_2·x",
        "linear_term": "x·(c_1 − c_2·x)",
        "exact_r": "c_0 − x·(c_1 − c_2·x)",
        r"rounded_r|r_\d+": "r = c_0 − x·(c_1 − c_2·x)",
        r"x_\d+": "x",
        r"c(\d)_\d+": r"c_\1",
        r"product_(\d)": r"r·w_\1",
        r"(rounded|normal)_(\d)": r"N_\2",
        r"word_(\d)_\d+": r"w_\1",
    }

    def __init__(self, model: Renormaliser | None = None):
        self.model = model or Renormaliser()
        super().__init__(
            data.StructLayout({"vector": vector_shape(), "span": 1}),
            data.StructLayout({"normal": normal_shape(), "out_of_range": unsigned(1), "span": 1}),
            latency=25,
        )

    def _delayed(self, m, value, name, first, last):
        """A value, through a register on each stage from ``first`` to ``last``."""
        for stage in range(first, last + 1):
            value = self.register(m, value, f"{name}_{stage}")
        return value

    def datapath(self, m, operands):
        """Shift, square, octave and offset in its segment, ``c0 - x (c1 - x c2)``, ``r w``."""
        register = self.register
        word, too_short = self._scaled(m, operands.vector)
        word = [register(m, word[c], f"word_{c}_6") for c in range(3)]
        m.submodules.dot_product = dot_product = DotProductUnit()
        for c in range(3):
            m.d.comb += [dot_product.i.payload.a[c].eq(word[c]), dot_product.i.payload.b[c].eq(word[c])]
        m.d.comb += [dot_product.i.valid.eq(1), dot_product.o.ready.eq(1)]
        word = [self._delayed(m, word[c], f"word_{c}", 7, 22) for c in range(3)]
        r = self._factor(m, dot_product.o.payload.as_value())

        result = Signal(self.o.payload.shape())
        m.d.comb += result.out_of_range.eq(self._delayed(m, too_short, "too_short", 3, 25))
        m.d.comb += result.span.eq(self._delayed(m, operands.span, "span", 1, 25))
        for c in range(3):
            product = register(m, word[c] * r, f"product_{c}")
            rounded = register(m, product.round_half_up(COMPONENT.fraction_bits), f"rounded_{c}")
            m.d.comb += result.normal[c].eq(register(m, rounded.saturate(COMPONENT), f"normal_{c}"))
        return result

    def _factor(self, m, square):
        """``r = c0 - x (c1 - x c2)``, 13 cycles after the square. Each operand has a register of its own."""
        p, register = self.model, self.register
        octave = sum(square[33 + k :].any() for k in range(p.OCTAVES - 1))
        octave = register(m, octave[:2], "octave")
        square = register(m, square[11:37].as_unsigned(), "square")
        fraction = register(m, (square >> octave)[: p.SEGMENT_BITS + p.OFFSET_FORMAT.width], "fraction")
        octave = register(m, octave, "octave_11")
        bits = p.OFFSET_FORMAT.width
        table = self._coefficients(m, Cat(fraction[bits:], octave))
        c0, c1, c2 = (register(m, c, f"c{k}_13") for k, c in enumerate(table))
        x = FixedValue(p.OFFSET_FORMAT, self._delayed(m, fraction[:bits], "x", 12, 14))

        square_term = register(m, x * register(m, c2, "c2_14"), "square_term")
        c1, x = self._delayed(m, c1, "c1", 14, 15), self._delayed(m, x, "x", 15, 17)
        # Rounding reads a bit under its last place, and no more.
        slope = (c1 - square_term).truncate(p.C1_FORMAT.fraction_bits + 1)
        slope = register(m, slope, "exact_slope").round_half_up(p.C1_FORMAT.fraction_bits)
        linear_term = register(m, x * register(m, slope.wrap(p.C1_FORMAT), "slope"), "linear_term")
        difference = self._delayed(m, c0, "c0", 14, 18) - linear_term
        r = register(m, difference.truncate(p.FACTOR_FORMAT.fraction_bits + 1), "exact_r")
        r = register(m, r.round_half_up(p.FACTOR_FORMAT.fraction_bits), "rounded_r")
        return self._delayed(m, r.saturate(p.FACTOR_FORMAT), "r", 21, 22)

    def _scaled(self, m, vector):
        """Word w five cycles after the vector, and after two cycles whether the vector is too short."""
        p, register = self.model, self.register
        codes = [vector[c].as_value() for c in range(3)]
        magnitudes = [Mux(code[-1], ~code, code)[:-1] for code in codes]
        magnitude = register(m, magnitudes[0] | magnitudes[1] | magnitudes[2], "magnitude")
        codes = [register(m, code, f"code_{c}") for c, code in enumerate(codes)]
        shift, bits = unsigned(3), len(magnitude)
        # The place of the leading one, counted from the top. Beyond `MAX_SHIFT` zeros the vector is too
        # short.
        place = p.MAX_SHIFT
        for k in reversed(range(p.MAX_SHIFT)):
            place = Mux(magnitude[bits - 1 - k], k, place)
        too_short = register(m, ~magnitude[bits - 1 - p.MAX_SHIFT :].any(), "too_short_2")
        place = register(m, Value.cast(place)[: shift.width], "place")
        codes = [register(m, code, f"code_{c}_2") for c, code in enumerate(codes)]
        coarse = [(code << Cat(Const(0, 2), place[2]))[: len(code)] for code in codes]
        coarse = [register(m, code, f"coarse_{c}") for c, code in enumerate(coarse)]
        place = register(m, place[:2], "place_3")
        word = []
        for c, code in enumerate(coarse):
            fine = register(m, (code << place)[: len(code)].as_signed(), f"fine_{c}")
            rounded = FixedValue(p.VECTOR_FORMAT, fine).round_half_up(COMPONENT.fraction_bits)
            word.append(register(m, rounded.saturate(COMPONENT), f"word_{c}_5"))
        return word, too_short

    def _coefficients(self, m, segment):
        """``c0``, ``c1`` and ``c2`` of the segment, one cycle later."""
        p = self.model
        names, formats = ("c0", "c1", "c2"), (p.C0_FORMAT, p.C1_FORMAT, p.C2_FORMAT)
        layout = data.StructLayout(dict(zip(names, map(FixedShape, formats), strict=True)))
        rows = zip(*(word.values.tolist() for word in p.coefficients), strict=True)
        rows = [dict(zip(names, row, strict=True)) for row in rows]
        m.submodules.coefficients = table = Memory(shape=layout, depth=len(rows), init=rows)
        port = table.read_port()
        m.d.comb += port.addr.eq(segment)
        return port.data.c0, port.data.c1, port.data.c2
