"""Half-chord unit: the angle between two unit vectors from the chord between them."""

from amaranth.hdl import Cat, Const, Mux, Value, unsigned
from amaranth.lib import data

from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.number.fixed import UQ
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.dataflow import Dataflow, checked_interval
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.word import Word

__all__ = ["HalfChordUnit", "half_chord_words", "normalised_words"]


class HalfChordUnit(PipelinedUnit):
    """Angle ``psi = 2 arcsin(|N_r - N_l|/2)`` in turns, from the squared chord.

    `HalfChord`, the bit-accurate model, has table, coefficients, formats and the error bound.

    Each beat needs six multiplications of 18 x 17 bits: the interpolation of the root, four Horner steps and
    the last product. With the initiation interval I they share ``ceil(6/I)`` multipliers (`dataflow`). By
    default there is one multiplier, which is busy in every cycle. Results are the same for every I. The table
    has 512 words of 36 bits, one block RAM.

    =================== == == == == == ==
    initiation interval 1  2  3  4  5  6
    =================== == == == == == ==
    latency             25 28 26 27 26 32
    multipliers         6  3  2  2  2  1
    =================== == == == == == ==

    Parameters
    ----------
    model : HalfChord
        Bit-accurate model, with table and coefficients.
    initiation_interval : int or None
        Cycles from an input to the next, 1 to 6. ``None``: 6.

    Raises
    ------
    ValueError
        If ``initiation_interval`` is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"chord_squared": UQ(2, 34), "supplement": 1})))`
        ``|N_r - N_l|^2`` and 0. For an angle over 90 degrees ``|N_r + N_l|^2`` and 1.
    o : :py:`Out(stream.Signature(UQ(0, 36)))`
        Angle in turns, 0 to 1/2.

    Source: docs/theory/interpolation.md#half-chord; [T] 3.3.
    """

    def __init__(self, model: HalfChord | None = None, *, initiation_interval: int | None = None):
        self.model = model or HalfChord()
        interval = checked_interval(initiation_interval, 6)
        self._graph = Dataflow(interval)
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
        """Describe the registers of the graph."""
        angle = self._graph.build(m, self, operands)(self._angle, self.latency)
        return FixedValue(self.model.RESULT_FORMAT, angle)

    def _describe(self) -> Word:
        """Word of the result."""
        g = self._graph
        chord = g.input("chord_squared", lambda operands: operands.chord_squared)
        supplement = g.input("supplement", lambda operands: operands.supplement)
        return half_chord_words(g, self.model, chord, supplement, *normalised_words(g, chord))


def normalised_words(graph: Dataflow, chord_squared: Word) -> tuple[Word, Word]:
    """Words of j and ``v = z 4^j`` in [1/4, 1), for ``z = chord_squared / 4``: three cycles.

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
    """Word of ``psi`` in turns, bits of ``UQ(0, 36)``: six multiplications of the graph.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    p : HalfChord
        Bit-accurate model, with table and coefficients.
    chord_squared, supplement : Word
        As the operands of `HalfChordUnit`.
    shift, v : Word
        Words of `normalised_words`.
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

    # Operands have 17 unsigned or 18 signed bits; wired shifts align them.
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
        "psi", lambda angle, other: Mux(other, (1 << 35) - angle, angle)[:36], angle, supplement
    )


def _unsigned(product: FixedValue) -> FixedValue:
    """Product of two numbers in [0, 1), as an unsigned number."""
    return FixedValue(UQ(0, 34), Value.cast(product)[:34])
