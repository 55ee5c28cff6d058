"""arccos unit ([T] 3.3, table 3.1), and the half-chord unit that takes its place."""

from typing import Literal

import numpy as np
from amaranth.hdl import Array, Cat, Const, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from golden.arccos import Arccos, HalfChord
from golden.fixed import UQ
from golden.unit_vector import COMPONENT

from .fixed import FixedShape, FixedValue
from .stream import PipelinedUnit

__all__ = ["ArccosUnit", "HalfChordUnit"]


class ArccosUnit(PipelinedUnit):
    """``arccos x = c0 + x (c1 + c2 x)`` in five segments; below 0 ``pi - arccos(-x)``.

    Tables, formats and error bounds are those of `golden.arccos.Arccos`, the bit-true twin of both forms.

    Sequential, as drawn: c0 goes into the accumulator, ``c2 x`` into the register, ``(c2 x) x`` and ``c1 x``
    are added. The latency is 15 clocks and the initiation interval 4; one multiplier of 18 x 17 bits.

    Pipelined: the same in Horner's order, which has the same bits because ``c1 + c2 x`` is exact. The latency
    is 14 clocks and the initiation interval 1; two multipliers of 18 x 17 bits.

    Parameters
    ----------
    parameters : Arccos
        Table.
    form : str
        ``"pipelined"`` or ``"sequential"``.

    Members
    -------
    i : :py:`In(stream.Signature(SQ(2, 16)))`
        Cosine.
    o : :py:`Out(stream.Signature(StructLayout({"angle": UQ(2, 16), "outside": 1})))`
        Angle in radians; ``outside``: the cosine lay outside [-1, 1] and was clamped.

    Raises
    ------
    ValueError
        If the form is unknown.

    Source: [T] 3.3, table 3.1.
    """

    def __init__(
        self, parameters: Arccos | None = None, form: Literal["pipelined", "sequential"] = "pipelined"
    ):
        if form not in ("pipelined", "sequential"):
            raise ValueError(f"form must be 'pipelined' or 'sequential', not {form!r}")
        self.parameters = parameters or Arccos()
        self.form = form
        pipelined = form == "pipelined"
        super().__init__(
            FixedShape(Arccos.OPERAND_FORMAT),
            data.StructLayout({"angle": FixedShape(Arccos.RESULT_FORMAT), "outside": unsigned(1)}),
            latency=14 if pipelined else 15,
            initiation_interval=1 if pipelined else 4,
        )

    def datapath(self, m, operands):
        """Magnitude, clamp, segment, coefficients; the polynomial; the supplement, rounding, saturation."""
        p, register = self.parameters, self.register
        code = Value.cast(operands)
        negative = register(m, code[-1], "negative_1")
        magnitude = register(m, Mux(code[-1], -code, code)[:18], "magnitude")
        one = p.MAGNITUDE_FORMAT.code(1)
        negative = register(m, negative, "negative_2")
        outside = register(m, magnitude > one, "outside_2")
        x = register(m, Mux(magnitude > one, one, magnitude)[:17], "x_2")

        negative = register(m, negative, "negative_3")
        outside = register(m, outside, "outside_3")
        segment = register(m, sum(x >= int(bound) for bound in p.bounds), "segment_3")
        x = register(m, x, "x_3")
        if self.form == "pipelined":
            flags, total = self._pipelined(m, x, segment, Cat(negative, outside))
        else:
            flags, total = self._sequential(m, x, segment, Cat(negative, outside))

        pi = FixedValue.constant(p.SUM_FORMAT, np.floor(np.ldexp(np.pi, 32) + 0.5) / 2.0**32)
        turned = register(m, Mux(flags[0], Value.cast(pi) - total, total)[: p.SUM_FORMAT.width], "turned")
        rounded = register(m, FixedValue(p.SUM_FORMAT, turned).round_half_up(16), "rounded")
        angle = register(m, rounded.saturate(p.RESULT_FORMAT), "angle")
        outside = flags[1]
        for stage in range(3):
            outside = register(m, outside, f"outside_late_{stage}")
        result = Signal(self.o.payload.shape())
        m.d.comb += [result.angle.eq(angle), result.outside.eq(outside)]
        return result

    def _coefficients(self, segment):
        """Words of the segment; both forms read them into registers."""
        return [
            Array(Const(int(code), signed(width)) for code in column)[segment]
            for column, width in zip(
                self.parameters.codes.T, (self.parameters.CONSTANT_FORMAT.width, 18, 18), strict=True
            )
        ]

    def _aligned(self, product, segment):
        """Product of a segment's word with x, at 32 fraction bits."""
        shifts = self.parameters.integer_bits - 2
        return Array(
            (product << int(shift))[: self.parameters.SUM_FORMAT.width].as_signed() for shift in shifts
        )[segment]

    def _pipelined(self, m, x, segment, flags):
        register = self.register
        c0, c1, c2 = (
            register(m, word, f"c{power}_4") for power, word in enumerate(self._coefficients(segment))
        )
        carried = {"x": x, "segment": segment, "flags": flags, "c0": c0, "c1": c1}

        def carry(stage, *names):
            for name in names:
                carried[name] = register(m, carried[name], f"{name}_{stage}")

        carry(4, "x", "segment", "flags")
        product = register(m, c2 * carried["x"], "product_5")
        carry(5, "x", "segment", "flags", "c0", "c1")
        scaled = register(m, _rounded(product), "scaled_6")
        carry(6, "x", "segment", "flags", "c0", "c1")
        slope = register(m, (scaled + carried["c1"])[:18].as_signed(), "slope_7")
        carry(7, "x", "segment", "flags", "c0")
        product = register(m, slope * carried["x"], "product_8")
        carry(8, "segment", "flags", "c0")
        # A word of its own for the shift, and one for the sum.
        aligned = register(m, self._aligned(product, carried["segment"]), "aligned_9")
        carry(9, "flags", "c0")
        total = register(m, (aligned + (carried["c0"] << 16))[:43].as_signed(), "total_10")
        carry(10, "flags")
        total = register(m, total, "total_11")
        carry(11, "flags")
        return carried["flags"], total

    def _sequential(self, m, x, segment, flags):
        """Ages: words at 5, products at 5 (c2 x), 6 (c1 x) and 8 ((c2 x) x), sum ready at 12."""
        at, register = self.at, self.register
        c0, c1, c2 = (
            register(m, word, f"c{power}", when=at(4))
            for power, word in enumerate(self._coefficients(segment))
        )
        x = register(m, x, "x_held", when=at(4))
        segment = register(m, segment, "segment_held", when=at(4))
        segment_late = register(m, segment, "segment_late", when=at(8))
        flags = register(m, flags, "flags_held", when=at(4))
        flags = register(m, flags, "flags_late", when=at(8))
        word, operand = Signal(signed(18)), Signal(17)
        product = register(m, word * operand, "product")
        scaled = register(m, _rounded(product), "scaled", when=at(7))
        for age, factor in ((5, c2), (6, c1), (8, scaled)):
            with m.If(at(age)):
                m.d.sync += [word.eq(factor), operand.eq(x)]
        aligned = register(m, self._aligned(product, Mux(at(8), segment, segment_late)), "aligned")
        total = Signal(signed(43))
        with m.If(at(8)):
            m.d.sync += total.eq(c0 << 16)
        with m.If(at(9) | at(11)):
            m.d.sync += total.eq(total + aligned)
        return flags, total


def _rounded(product):
    """A word times x, brought back to the format of the word, half up."""
    return ((product >> 16) + product[15])[:18].as_signed()


class HalfChordUnit(PipelinedUnit):
    """``psi = 2 arcsin(|N_r - N_l|/2)`` in turns, from the squared chord.

    Table, coefficients, formats and error bound are those of `golden.arccos.HalfChord`, the bit-true twin.

    The latency is 26 clocks and the initiation interval 6. One multiplier of 18 x 17 bits does the
    interpolation of the root, four Horner steps and the last product in turn, busy on every clock. The table
    is 512 words of 36 bits, one block RAM.

    Parameters
    ----------
    parameters : HalfChord
        Table and coefficients.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"chord_squared": UQ(2, 34), "supplement": 1})))`
        ``|N_r - N_l|^2``; or beyond 90 degrees ``|N_r + N_l|^2`` and a 1.
    o : :py:`Out(stream.Signature(UQ(0, 36)))`
        Angle in turns, 0 to 1/2.

    Source: [T] 3.3; numbers.md, "arccos".
    """

    def __init__(self, parameters: HalfChord | None = None):
        self.parameters = parameters or HalfChord()
        super().__init__(
            data.StructLayout(
                {"chord_squared": FixedShape(HalfChord.OPERAND_FORMAT), "supplement": unsigned(1)}
            ),
            FixedShape(HalfChord.RESULT_FORMAT),
            latency=26,
            initiation_interval=6,
        )

    def datapath(self, m, operands):
        """Ages: table at 4, interpolation at 6, Horner steps at 7, 10, 14, 17, product at 21, shift at 23."""
        p, at, register = self.parameters, self.at, self.register
        z = operands.chord_squared.scale(-2)
        code = Value.cast(z)
        shift = Signal(5, name="shift_2")
        for j in range(17, -1, -1):
            with m.If(code[34 - 2 * j :].any() if j < 17 else Const(1)):
                m.d.sync += shift.eq(j)
        coarse = register(m, (code << Cat(Const(0, 3), shift[2:]))[:36], "v_coarse")
        shift = register(m, shift, "shift_3", when=at(2))
        v = register(m, (coarse << Cat(Const(0, 1), shift[:2]))[:36], "v", when=at(3))
        for age in (8, 14, 20):
            shift = register(m, shift, f"shift_{age + 1}", when=at(age))
        supplement = operands.supplement
        for age in (6, 12, 18, 24):
            supplement = register(m, supplement, f"supplement_{age + 1}", when=at(age))
        rounded = register(m, z.round_half_up(18), "z_rounded")
        z = [register(m, rounded.saturate(p.SQUARE_FORMAT), "z_4", when=at(3))]
        for age in (9, 15):
            z.append(register(m, z[-1], f"z_{age + 1}", when=at(age)))

        values, slopes = p.roots
        bits = p.TABLE_SLOPE_FORMAT.width
        m.submodules.roots = table = Memory(
            shape=p.TABLE_VALUE_FORMAT.width + bits,
            depth=1 << p.ADDRESS_BITS,
            init=(values.codes << bits | slopes.codes).tolist(),
        )
        port = table.read_port()
        m.d.comb += port.addr.eq(v[36 - p.ADDRESS_BITS :])
        entry = register(m, port.data, "entry", when=at(5))
        value = FixedValue(p.TABLE_VALUE_FORMAT, entry[bits:])
        fraction = v[36 - p.ADDRESS_BITS - p.FRACTION_BITS : 36 - p.ADDRESS_BITS]

        # One multiplier, of 17 unsigned and 18 signed bits; wired shifts align what it is given.
        factor = Signal(FixedShape(UQ(0, 17)))
        operand = Signal(FixedShape(COMPONENT))
        product = register(m, factor * operand, "product")
        unsigned_product = FixedValue(UQ(0, 34), Value.cast(product)[:34])
        rise = unsigned_product.scale(-p.ADDRESS_BITS).truncate(21).wrap(p.TABLE_VALUE_FORMAT)
        horner = FixedValue(UQ(-3, 37), Value.cast(unsigned_product.scale(-3))).round_half_up(19)
        root = register(m, value + rise, "root_sum", when=at(8))
        root = register(m, root.round_half_up(17), "root_rounded", when=at(9))
        root = register(m, root.saturate(p.ROOT_FORMAT), "root", when=at(10))
        root = register(m, root, "root_late", when=at(16))

        c1, c2, c3, c4 = (
            FixedValue.constant(p.SUM_FORMAT, value) for value in p.coefficients.values.tolist()
        )
        total_9, total_12, total_16 = (
            register(m, (horner + c).wrap(p.SUM_FORMAT), f"total_{age}", when=at(age))
            for age, c in ((9, c3), (12, c2), (16, c1))
        )
        constant = FixedValue.constant(p.constant.format, p.constant.values.item())
        total_19 = register(m, (horner + constant).round_half_up(17), "total_19", when=at(19))
        last = register(m, total_19.saturate(p.FACTOR_FORMAT), "factor_last", when=at(20))
        issues = [
            (6, FixedValue(UQ(0, 17), fraction << 3), FixedValue(UQ(0, 15), entry[:bits]).extend(COMPONENT)),
            (7, z[0].scale(1), c4.scale(2)),
            (10, z[1].scale(1), total_9.scale(2)),
            (14, z[1].scale(1), total_12.scale(2)),
            (17, z[2].scale(1), total_16.scale(2)),
            (21, root, last),
        ]
        for age, a, b in issues:
            with m.If(at(age)):
                m.d.sync += [factor.eq(a), operand.eq(b)]

        wide = Cat(Const(0, 1), Value.cast(unsigned_product))
        coarse = register(m, (wide >> Cat(Const(0, 2), shift[2:]))[:36], "angle_coarse", when=at(23))
        angle = register(m, (coarse >> shift[:2])[:36], "angle", when=at(24))
        turned = register(m, Mux(supplement, (1 << 35) - angle, angle)[:36], "angle_turned", when=at(25))
        return FixedValue(p.RESULT_FORMAT, turned)
