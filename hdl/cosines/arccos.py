"""arccos unit ([T] 3.3, table 3.1), and the half-chord unit that takes its place."""

from typing import Literal

import numpy as np
from amaranth.hdl import Array, Cat, Const, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data

from blysk.golden.cosines.arccos import Arccos, HalfChord
from blysk.golden.number.fixed import UQ
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.dataflow import Dataflow, Word, checked_interval
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.stream import PipelinedUnit

__all__ = ["ArccosUnit", "HalfChordUnit", "half_chord_words", "normalised_words"]


class ArccosUnit(PipelinedUnit):
    """``arccos x = c0 + x (c1 + c2 x)`` in five segments; below 0 ``pi - arccos(-x)``.

    Tables, formats and error bounds are those of `Arccos`, the bit-true twin of both forms.

    Sequential, as drawn: c0 goes into the accumulator, ``c2 x`` into the register, ``(c2 x) x`` and ``c1 x``
    are added. The latency is 15 cycles and the initiation interval 4; one multiplier of 18 x 17 bits.

    Pipelined: the same in Horner's order, which has the same bits because ``c1 + c2 x`` is exact. The latency
    is 14 cycles and the initiation interval 1; two multipliers of 18 x 17 bits.

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
        for stage, factor in ((5, c2), (6, c1), (8, scaled)):
            with m.If(at(stage)):
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

    Table, coefficients, formats and error bound are those of `HalfChord`, the bit-true twin.

    Six multiplications of 18 x 17 bits a beat: the interpolation of the root, four Horner steps and the last
    product, which take turns at ``ceil(6/I)`` multipliers for an initiation interval I (`dataflow`). By
    default one does all, busy on every clock. The results are the same to the bit. The table is 512 words of
    36 bits, one block RAM.

    =================== == == == == == ==
    initiation interval 1  2  3  4  5  6
    =================== == == == == == ==
    latency             35 38 37 36 36 40
    multipliers         6  3  2  2  2  1
    =================== == == == == == ==

    Parameters
    ----------
    parameters : HalfChord
        Table and coefficients.
    initiation_interval : int or None
        1 to 6, which ``None`` stands for: distance in cycles of two inputs.

    Raises
    ------
    ValueError
        If `initiation_interval` is none of those.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"chord_squared": UQ(2, 34), "supplement": 1})))`
        ``|N_r - N_l|^2``; or beyond 90 degrees ``|N_r + N_l|^2`` and a 1.
    o : :py:`Out(stream.Signature(UQ(0, 36)))`
        Angle in turns, 0 to 1/2.

    Source: [T] 3.3; numbers.md, "arccos".
    """

    def __init__(self, parameters: HalfChord | None = None, initiation_interval: int | None = None):
        self.parameters = parameters or HalfChord()
        interval = checked_interval(initiation_interval, 6)
        self._graph = Dataflow(interval, 6)
        self._angle = self._describe()
        super().__init__(
            data.StructLayout(
                {"chord_squared": FixedShape(HalfChord.OPERAND_FORMAT), "supplement": unsigned(1)}
            ),
            FixedShape(HalfChord.RESULT_FORMAT),
            latency=self._angle.stage,
            initiation_interval=interval,
        )

    def datapath(self, m, operands):
        """The graph."""
        angle = self._graph.build(m, self, operands)(self._angle, self.latency)
        return FixedValue(self.parameters.RESULT_FORMAT, angle)

    def _describe(self) -> Word:
        """Word of the result."""
        g = self._graph
        chord = g.input("chord_squared", lambda operands: operands.chord_squared)
        supplement = g.input("supplement", lambda operands: operands.supplement)
        return half_chord_words(g, self.parameters, chord, supplement, *normalised_words(g, chord))


def normalised_words(graph: Dataflow, chord_squared: Word) -> tuple[Word, Word]:
    """``v = z 4^j`` in [1/4, 1) and j, for ``z = chord_squared / 4``: three cycles.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    chord_squared : Word
        ``UQ(2, 34)``.

    Returns
    -------
    shift, v : Word
        j, 0 to 17; the bits of v in ``UQ(0, 36)``.
    """

    def pairs_of_zeros(chord):
        code, count = Value.cast(chord), Const(17, 5)
        for j in range(16, -1, -1):
            count = Mux(code[34 - 2 * j :].any(), Const(j, 5), count)
        return count

    shift = graph.register("shift", pairs_of_zeros, chord_squared)
    coarse = graph.register(
        "v_coarse",
        lambda chord, shift: (Value.cast(chord) << Cat(Const(0, 3), shift[2:]))[:36],
        chord_squared,
        shift,
    )
    v = graph.register("v", lambda v, shift: (v << Cat(Const(0, 1), shift[:2]))[:36], coarse, shift)
    return shift, v


def half_chord_words(
    graph: Dataflow, p: HalfChord, chord_squared: Word, supplement: Word, shift: Word, v: Word
) -> Word:
    """Bits of ``psi`` in ``UQ(0, 36)``, in turns: six multiplications of the graph.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    p : HalfChord
        Table and coefficients.
    chord_squared, supplement : Word
        As `HalfChordUnit` takes them.
    shift, v : Word
        From `normalised_words`.
    """
    rounded = graph.register("z_rounded", lambda chord: chord.scale(-2).round_half_up(18), chord_squared)
    z = graph.register("z", lambda z: z.saturate(p.SQUARE_FORMAT), rounded)

    values, slopes = p.roots
    bits, unread = p.TABLE_SLOPE_FORMAT.width, 36 - p.ADDRESS_BITS - p.FRACTION_BITS
    entry = graph.look_up(
        "roots",
        (values.codes << bits | slopes.codes).tolist(),
        p.TABLE_VALUE_FORMAT.width + bits,
        graph.wire("root_address", lambda v: v[36 - p.ADDRESS_BITS :], v),
    )
    entry = graph.register("entry", lambda entry: entry, entry)
    value = graph.wire("value", lambda entry: FixedValue(p.TABLE_VALUE_FORMAT, entry[bits:]), entry)
    slope = graph.wire("slope", lambda entry: FixedValue(p.TABLE_SLOPE_FORMAT, entry[:bits]), entry)
    fraction = graph.wire("fraction", lambda v: v[unread:][: p.FRACTION_BITS], v)

    c1, c2, c3, c4 = (FixedValue.constant(p.SUM_FORMAT, value) for value in p.coefficients.values.tolist())
    constant = FixedValue.constant(p.constant.format, p.constant.values.item())
    product = graph.multiply("product_4", z, z, lambda z: z.scale(1), lambda _: c4.scale(2))
    for power, c in ((3, c3), (2, c2), (1, c1)):
        total = graph.register(
            f"total_{power}",
            lambda x, c=c: (_unsigned(x).scale(-3).round_half_up(19) + c).wrap(p.SUM_FORMAT),
            product,
        )
        product = graph.multiply(
            f"product_{power}", z, total, lambda z: z.scale(1), lambda total: total.scale(2)
        )
    total = graph.register(
        "total",
        lambda x: (_unsigned(x).scale(-3).round_half_up(19) + constant).round_half_up(17),
        product,
    )
    factor = graph.register("factor", lambda total: total.saturate(p.FACTOR_FORMAT), total)

    # 17 unsigned and 18 signed bits; wired shifts align what the multipliers are given.
    def aligned(fraction):
        return FixedValue(UQ(0, 17), Cat(Const(0, 17 - p.FRACTION_BITS), fraction))

    rise = graph.multiply("rise", fraction, slope, aligned, lambda slope: slope.extend(COMPONENT))
    root = graph.register(
        "root_sum",
        lambda value, rise: (
            value + _unsigned(rise).scale(-p.ADDRESS_BITS).truncate(21).wrap(p.TABLE_VALUE_FORMAT)
        ),
        value,
        rise,
    )
    root = graph.register("root_rounded", lambda root: root.round_half_up(17), root)
    root = graph.register("root", lambda root: root.saturate(p.ROOT_FORMAT), root)

    product = graph.multiply("angle_exact", root, factor)
    coarse = graph.register(
        "angle_coarse",
        lambda x, shift: Cat(Const(0, 1), Value.cast(_unsigned(x))) >> Cat(Const(0, 2), shift[2:]),
        product,
        shift,
    )
    angle = graph.register("angle", lambda angle, shift: angle >> shift[:2], coarse, shift)
    return graph.register(
        "angle_turned", lambda angle, other: Mux(other, (1 << 35) - angle, angle)[:36], angle, supplement
    )


def _unsigned(product: FixedValue) -> FixedValue:
    """A product of two numbers in [0, 1)."""
    return FixedValue(UQ(0, 34), Value.cast(product)[:34])
