"""Vector normaliser: a vector of any length brought to unit length."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.number.fixed import SQ
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import PipelinedUnit
from blysk.hdl.geometry.booth import booth_term
from blysk.hdl.normals.dot_product import DotProductUnit

__all__ = ["VectorNormaliserUnit"]


class VectorNormaliserUnit(PipelinedUnit):
    """Unit vector along a vector of any length: that of `VectorNormaliser`, the bit-accurate model.

    The latency is `DotProductUnit`'s and 14 cycles: four for shift and rounding; segment, table, three for
    ``c0 - c1 u``, one for e; four for ``v + e v``. The initiation interval is 1. Six multipliers of 18x18
    bits: three squares and three scalings; ``c1 u`` is a sum of Booth digits. The table holds 512 words of
    34 bits.

    Parameters
    ----------
    parameters : VectorNormaliser
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"vector": ..., "flip": 1})))`
        A vector, and whether its unit vector is negated.
    o : :py:`Out(stream.Signature(StructLayout({"normal": ..., "lost": 1})))`
        Unit vector, ``SQ(1, 17)``; ``lost``: the vector has no direction.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    def __init__(self, parameters: VectorNormaliser | None = None):
        self.parameters = parameters or VectorNormaliser()
        vector = data.ArrayLayout(FixedShape(self.parameters.format), 3)
        self._dot = DotProductUnit()
        super().__init__(
            data.StructLayout({"vector": vector, "flip": unsigned(1)}),
            data.StructLayout({"normal": normal_shape(), "lost": unsigned(1)}),
            latency=self._dot.latency + 14,
        )

    def datapath(self, m, operands):
        """Shifted, squared, its factor from the table, scaled."""
        dot = self._dot
        m.submodules.dot_product = dot
        words, lost = self._shift(m, operands)
        m.d.comb += [dot.i.valid.eq(1), dot.o.ready.eq(1)]
        for side in (dot.i.payload.a, dot.i.payload.b):
            m.d.comb += [to.eq(word) for to, word in zip(side, words, strict=True)]
        at_factor = dot.latency + 10
        e = self._factor(m, dot.o.payload)
        late = [self._delay(m, word, f"v_{k}", at_factor - 4) for k, word in enumerate(words)]
        flip = self._delay(m, operands.flip, "flip", at_factor + 3)
        result = Signal(self.o.payload.shape(), name="result")
        m.d.comb += result.lost.eq(self._delay(m, lost, "lost", self.latency - 4))
        one = FixedValue.constant(SQ(2, 34), 0.5 * COMPONENT.step)
        for k, word in enumerate(late):
            product = self.register(m, self.register(m, e * word, f"product_{k}"), f"scaled_{k}")
            word = self._delay(m, word, f"late_{k}", 2)
            total = self.register(m, word + product, f"total_{k}")
            code = Value.cast(total)
            turned = (code[:] ^ flip.replicate(len(code))).as_signed() + flip + Value.cast(one)
            rounded = turned >> (total.format.fraction_bits - COMPONENT.fraction_bits)
            clipped = Mux(rounded > ONE, ONE, Mux(rounded < -ONE, -ONE, rounded))
            m.d.comb += Value.cast(result.normal[k]).eq(
                self.register(m, clipped[: COMPONENT.width], f"normal_{k}")
            )
        return result

    def _delay(self, m: Module, value, name: str, cycles: int):
        for k in range(cycles):
            value = self.register(m, value, f"{name}_{k}")
        return value

    def _shift(self, m: Module, operands) -> tuple[list[FixedValue], Value]:
        """Components without common sign copies, rounded to 18 bits, and whether they are lost: age 4."""
        bits = self.parameters.format.width - 1
        codes = [Value.cast(component).as_signed() for component in operands.vector]
        ones = 0
        for code in codes:
            ones = ones | (code[:bits] ^ code[-1].replicate(bits))
        ones = self.register(m, ones, "ones_1")
        codes = [self.register(m, code, f"vector_1_{k}") for k, code in enumerate(codes)]
        for age, steps in ((2, (8, 4)), (3, (2, 1))):
            for step in steps:
                empty = ~ones[-step:].any()
                ones = Mux(empty, ones << step, ones)[:bits]
                codes = [Mux(empty, code << step, code)[: bits + 1].as_signed() for code in codes]
            ones = self.register(m, ones, f"ones_{age}")
            codes = [self.register(m, code, f"vector_{age}_{k}") for k, code in enumerate(codes)]
        lost = self.register(m, ~ones[-1], "lost")
        words = []
        for k, code in enumerate(codes):
            places = bits - COMPONENT.fraction_bits
            rounded = (code + (1 << (places - 1))) >> places
            clipped = Mux(rounded > ONE, ONE, Mux(rounded < -ONE, -ONE, rounded))
            word = self.register(m, clipped[: COMPONENT.width], f"shifted_{k}")
            words.append(FixedValue(COMPONENT, word.as_signed()))
        return words, lost

    def _factor(self, m: Module, square: FixedValue) -> FixedValue:
        """``e`` of a squared length, 6 cycles later."""
        p, register = self.parameters, self.register
        s = Value.cast(square.truncate(22))
        large = s[22:].any()
        s = Mux(large, s[2:], s)[2:22]
        bits = p.OFFSET_FORMAT.width - 1
        segment = register(m, s[bits:], "segment")
        rest = register(m, s[:bits], "rest")
        large = self._delay(m, large, "large", 5)
        c0, c1 = self._coefficients(m, segment)
        # In halves of a step, odd: the half step that the cut leaves out.
        u = register(m, Cat(Const(1, 1), rest[:-1], ~rest[-1]).as_signed(), "u")
        # c1 has no sign: a zero above makes its last Booth digit whole.
        digits = Cat(Const(0, 1), Value.cast(c1), Const(0, 2))
        count = (len(Value.cast(c1)) + 2) // 2
        terms = [booth_term(u, digits[2 * k : 2 * k + 3]) << (2 * k) for k in range(count)]
        pairs = [register(m, sum(terms[k : k + 2]), f"pair_{k}") for k in range(0, count, 2)]
        c0 = self._delay(m, c0, "c0", 2)
        product = register(m, sum(pairs), "product")
        point = p.OFFSET_FORMAT.fraction_bits + p.C1_FORMAT.fraction_bits
        width = p.C0_FORMAT.width
        f = register(m, (Value.cast(c0) - (product >> (point - p.C0_FORMAT.fraction_bits)))[:width], "f")
        one = 1 << p.C0_FORMAT.fraction_bits
        # In steps of 2^-21: f is halved with all its bits.
        e = FixedValue(SQ(3, 21), Mux(large, f - 2 * one, (f - one) << 1)[:24].as_signed())
        return register(m, e.round_half_up(17).saturate(p.FACTOR_FORMAT), "e")

    def _coefficients(self, m: Module, segment: Value) -> tuple[FixedValue, FixedValue]:
        """``c0`` and ``c1`` of the segment, a cycle later."""
        p = self.parameters
        layout = data.StructLayout({"c0": FixedShape(p.C0_FORMAT), "c1": FixedShape(p.C1_FORMAT)})
        rows = zip(*(column.values.tolist() for column in p.coefficients), strict=True)
        rows = [dict(zip(("c0", "c1"), row, strict=True)) for row in rows]
        m.submodules.roots = table = Memory(shape=layout, depth=len(rows), init=rows)
        port = table.read_port()
        m.d.comb += port.addr.eq(segment)
        return port.data.c0, port.data.c1
