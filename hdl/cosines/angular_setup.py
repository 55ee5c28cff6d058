"""Angular setup ([T] 3.1): dot products, the angle of a span and CORDIC, on shared multipliers."""

from collections.abc import Sequence

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import Arccos
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.number.fixed import SQ, UQ
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.dataflow import Dataflow, checked_interval
from blysk.hdl.core.dot import dot, shared_sums
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.reciprocal import reciprocal_words
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.views import choose
from blysk.hdl.core.word import Word
from blysk.hdl.cosines.arccos import ArccosUnit
from blysk.hdl.cosines.half_chord import half_chord_words, normalised_words

__all__ = ["AngularSetupUnit"]


class AngularSetupUnit(PipelinedUnit):
    """Angles ``psi``, ``lambda``, ``psi/(m-1)`` and ``cos beta`` of a span and a fixed vector.

    `AngularSetup`, the bit-accurate model, has equations, tables, formats and the error bound.

    A beat needs 26 multiplications. Five dot products take three each, and the half chord takes six. Two are
    for further interpolations, and one each for x, y and the step. With the initiation interval I they share
    ``ceil(26/I)`` multipliers (`dataflow`). With ``angle="arccos"`` the pipelined arccos unit takes the place
    of the half chord. It has two multipliers of its own. One multiplication from radians to turns takes the
    place of six. There are then ``2 + ceil(21/I)`` multipliers. Results are the same for every I.

    =================== == == == == == ==
    initiation interval 1  2  3  4  5  6
    =================== == == == == == ==
    latency             53 54 55 58 58 59
    multipliers         26 13 9  7  6  5
    by arccos: latency  53 54 56 59 59 58
    multipliers         23 13 9  8  7  6
    =================== == == == == == ==

    There are four tables. Two have 512 words of 36 bits (by arccos one table). One has 512 words of 34 bits,
    and one has 2048 words of 17 bits. CORDIC is unrolled to 22 steps of three adders. The sum that divides by
    its gain is unrolled, too.

    Parameters
    ----------
    model : AngularSetup
        Bit-accurate model: the method of psi (``angle``), tables and formats.
    initiation_interval : int or None
        Cycles from an input to the next, 1 to 26, by arccos 1 to 21. ``None``: 6.

    Raises
    ------
    ValueError
        If ``initiation_interval`` is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left", "normal_right", "vector", "length"})))`
        Unit vectors of three components ``SQ(1, 17)``; length 1 to 4095.
    o : :py:`Out(stream.Signature(StructLayout({...})))`
        ``angle`` UQ(0, 36), ``phase`` SQ(0, 40), ``step`` UQ(0, 40), all in turns; ``cos_beta`` UQ(1, 25);
        ``length``. ``out_of_range``: the span is over 150 degrees, and its plane is inaccurate.

    Source: docs/theory/interpolation.md#angular-method; [T] 3.1.
    """

    def __init__(self, model: AngularSetup | None = None, *, initiation_interval: int | None = None):
        self.model = p = model or AngularSetup()
        products = 26 if p.angle == "half_chord" else 21
        interval = checked_interval(initiation_interval, products, 6)
        self._graph = Dataflow(interval)
        self._words = self._describe()
        super().__init__(
            data.StructLayout(
                {
                    "normal_left": normal_shape(),
                    "normal_right": normal_shape(),
                    "vector": normal_shape(),
                    "length": unsigned(LENGTH_BITS),
                }
            ),
            data.StructLayout(
                {
                    "angle": FixedShape(AngularSetup.ANGLE_FORMAT),
                    "phase": FixedShape(AngularSetup.PHASE_FORMAT),
                    "step": FixedShape(AngularSetup.STEP_FORMAT),
                    "cos_beta": FixedShape(AngularSetup.COS_BETA_FORMAT),
                    "length": unsigned(LENGTH_BITS),
                    "out_of_range": unsigned(1),
                }
            ),
            latency=max(word.stage for word in self._words.values()),
            initiation_interval=interval,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        self._m = m
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for name, word in self._words.items():
            read = value(word, self.latency)
            format = getattr(AngularSetup, f"{name.upper()}_FORMAT", None)
            m.d.comb += result[name].eq(FixedValue(format, read) if format else read)
        return result

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.model
        left, right, vector, length = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in ("normal_left", "normal_right", "vector", "length")
        )
        sums = shared_sums(g, COMPONENT * COMPONENT)
        pairs = ((left, left), (right, right), (left, right), (left, vector), (right, vector))
        square_left, square_right, cross, dot_left, dot_right = (
            dot(g, f"dot_{k}", a, b, sums) for k, (a, b) in enumerate(pairs)
        )

        squares = g.register("squares", lambda a, b: a + b, square_left, square_right)
        obtuse = g.register("obtuse", lambda cross: Value.cast(cross)[-1], cross)
        size = g.register("cross", _magnitude, cross)
        chord = g.register("chord_exact", lambda a, b: a - b.scale(1).extend(SQ(6, 34)), squares, size)
        chord = g.register("chord", lambda chord: chord.saturate(p.CHORD_FORMAT), chord)
        total = g.register("dot_sum", lambda a, b: a + b, dot_left, dot_right)
        difference = g.register("dot_difference", lambda a, b: b - a, dot_left, dot_right)
        major, minor = (
            g.register(name, lambda *words: choose(*words), obtuse, *words)
            for name, words in (("major", (difference, total)), ("minor", (total, difference)))
        )
        shortest = p.SHORTEST_SUM
        limit = FixedValue.constant(shortest.format, shortest.values.item())
        out_of_range = g.register(
            "out_of_range",
            lambda obtuse, chord: obtuse & (chord.truncate(shortest.format.fraction_bits) < limit),
            obtuse,
            chord,
        )
        shift, v = normalised_words(g, chord)

        y = self._minor(minor, shift, v)
        x = self._major(major, chord)
        cos_beta, direction = self._polar(x, y, obtuse)
        if p.angle == "half_chord":
            angle = half_chord_words(g, HalfChord(), chord, obtuse, shift, v)
        else:
            angle = self._by_arccos(cross)
        phase = g.register(
            "phase",
            lambda direction, angle: (
                direction.extend(p.PHASE_FORMAT)
                + FixedValue(p.ANGLE_FORMAT, angle).scale(-1).extend(UQ(0, 40))
            ).wrap(p.PHASE_FORMAT),
            direction,
            angle,
        )
        return {
            "angle": angle,
            "phase": phase,
            "step": self._step(angle, obtuse, shift, length),
            "cos_beta": cos_beta,
            "length": length,
            "out_of_range": out_of_range,
        }

    def _by_arccos(self, cross: Word) -> Word:
        """Word of psi by arccos, and the product that converts it to turns."""
        g, p = self._graph, self.model

        def exact(cross):
            # The square of the code of length 1 is less than 1 by 2^-16.
            code = Value.cast(cross)
            return FixedValue(cross.format, (code + (code >> 16))[: len(code)].as_signed())

        unit = ArccosUnit(p.arccos)

        def arccos(register, cosine):
            self._m.submodules.arccos = unit
            self._m.d.comb += [unit.i.valid.eq(1), unit.i.payload.eq(cosine), unit.o.ready.eq(1)]
            return unit.o.payload.angle

        cosine = g.register("cosine_exact", exact, cross)
        cosine = g.register("cosine_rounded", lambda cosine: cosine.round_half_up(16), cosine)
        functional_unit = g.share("arccos", [FixedShape(Arccos.OPERAND_FORMAT)], unit.latency, arccos)
        radians = g.use(
            functional_unit,
            "radians_exact",
            [cosine],
            lambda cosine: [cosine.saturate(Arccos.OPERAND_FORMAT)],
        )
        radians = g.register(
            "radians", lambda radians: radians.round_half_up(15).saturate(p.RADIANS_FORMAT), radians
        )
        factor = FixedValue.constant(p.TURNS_PER_RADIAN.format, p.TURNS_PER_RADIAN.values.item())
        turns = g.multiply("turns_exact", radians, radians, right=lambda _: factor)
        return g.register("turns", lambda turns: Value.cast(turns.extend(p.ANGLE_FORMAT)), turns)

    def _looked_up(self, name: str, table, address: Word, fraction: Word, sign: int, format) -> Word:
        """Interpolated word of a table, rounded to a format. It takes at least seven cycles."""
        g = self._graph
        values, changes = table
        width = changes.format.width
        words = (values.codes << width | changes.codes).tolist()
        entry = g.look_up(name, words, values.format.width + width, address)
        entry = g.register(f"{name}_entry", lambda entry: entry, entry)
        value = g.wire(f"{name}_value", lambda entry: FixedValue(values.format, entry[width:]), entry)
        change = g.wire(f"{name}_change", lambda entry: FixedValue(changes.format, entry[:width]), entry)
        fraction_format = UQ(0, self.model.FRACTION_BITS)
        product = g.multiply(
            f"{name}_product", fraction, change, lambda fraction: FixedValue(fraction_format, fraction)
        )

        def interpolated(value, product):
            product = product.round_half_up(22)
            return value + product if sign > 0 else value - product

        total = g.register(f"{name}_sum", interpolated, value, product)
        rounded = g.register(
            f"{name}_rounded", lambda total: total.round_half_up(format.fraction_bits), total
        )
        return g.register(f"{name}_result", lambda rounded: rounded.saturate(format), rounded)

    def _address(self, name: str, bits: Word, width: int) -> tuple[Word, Word]:
        """Address of a table from the leading bits, and fraction from the bits below."""
        g, p = self._graph, self.model
        below = width - p.ADDRESS_BITS
        return (
            g.wire(f"{name}_address", lambda bits: bits[below:], bits),
            g.wire(f"{name}_fraction", lambda bits: bits[below - p.FRACTION_BITS : below], bits),
        )

    def _major(self, major: Word, chord: Word) -> Word:
        """Word of ``major/2 (1 + e)``, which is x for spans up to 90 degrees."""
        g, p = self._graph, self.model

        def clamped(chord):
            bits = Value.cast(chord)
            return Mux(bits[35], (1 << 35) - 1, bits[:35])[35 - p.ADDRESS_BITS - p.FRACTION_BITS :]

        bits = g.register("correction_bits", clamped, chord)
        operand = self._address("correction", bits, p.ADDRESS_BITS + p.FRACTION_BITS)
        correction = self._looked_up("corrections", p.corrections, *operand, 1, p.CORRECTION_FORMAT)
        half = g.wire("major_half", lambda major: major.scale(-1).truncate(26), major)
        operand = g.register(
            "half_operand", lambda major: major.scale(-1).truncate(17).saturate(COMPONENT), major
        )
        product = g.multiply("x_exact", correction, operand)
        product = g.register("x_product", lambda product: product.round_half_up(26), product)
        return g.register("x", lambda half, x: (half + x).wrap(p.AXIS_FORMAT), half, product)

    def _minor(self, minor: Word, shift: Word, v: Word) -> Word:
        """Word of ``minor 2^j T``, which is y for spans up to 90 degrees."""
        g, p = self._graph, self.model
        operand = self._address("reciprocal", v, 36)
        reciprocal = self._looked_up("inverse_roots", p.reciprocals, *operand, -1, p.RECIPROCAL_FORMAT)
        code = g.register(
            "minor_coarse",
            lambda minor, shift: (Value.cast(minor) << Cat(Const(0, 2), shift[2:]))[:37],
            minor,
            shift,
        )
        code = g.register("minor_shifted", lambda minor, shift: (minor << shift[:2])[:37], code, shift)
        operand = g.register(
            "minor_rounded", lambda code: FixedValue(SQ(3, 34), code).round_half_up(16), code
        )
        operand = g.register("minor_operand", lambda operand: operand.saturate(p.MINOR_FORMAT), operand)
        product = g.multiply("y_exact", reciprocal, operand)
        return g.register("y", lambda y: y.round_half_up(26).wrap(p.AXIS_FORMAT), product)

    def _step(self, angle: Word, obtuse: Word, shift: Word, length: Word) -> Word:
        """Word of the bits of ``psi/(m-1)``."""
        g, p = self._graph, self.model
        leading = angle
        if p.angle == "half_chord":
            shift = g.register("angle_shift", lambda obtuse, shift: Mux(obtuse, 0, shift)[:5], obtuse, shift)
            leading = g.register(
                "psi_coarse", lambda psi, shift: (psi << Cat(Const(0, 2), shift[2:]))[:36], leading, shift
            )
            leading = g.register("psi_shifted", lambda psi, shift: (psi << shift[:2])[:36], leading, shift)
        leading = g.register(
            "psi_rounded", lambda psi: FixedValue(p.ANGLE_FORMAT, psi).round_half_up(18), leading
        )
        leading = g.register("psi_leading", lambda psi: psi.saturate(p.MANTISSA_FORMAT), leading)
        reciprocal, step_shift = reciprocal_words(g, length, since=angle)
        if p.angle == "half_chord":
            step_shift = g.register("step_shift", lambda a, b: (a + b)[:5], step_shift, shift)
        else:
            step_shift = g.wire("step_shift", lambda shift: Cat(shift, Const(0, 1))[:5], step_shift)
        product = g.multiply("step_exact", leading, reciprocal)
        step = g.register(
            "step_coarse",
            lambda product, shift: (Cat(Const(0, 6), product) >> Cat(Const(0, 3), shift[3:]))[:40],
            product,
            step_shift,
        )
        return g.register("step", lambda step, shift: (step >> shift[:3])[:40], step, step_shift)

    def _polar(self, x: Word, y: Word, obtuse: Word) -> tuple[Word, Word]:
        """Words of cos beta and of the direction, by CORDIC with one step on each cycle."""
        g, p = self._graph, self.model
        width, direction_width = p.ROTATED_FORMAT.width, p.DIRECTION_FORMAT.width
        first, second = (
            g.register(
                name, lambda *words: Value.cast(choose(*words).extend(p.ROTATED_FORMAT)), obtuse, *words
            )
            for name, words in (("x_exchanged", (y, x)), ("y_exchanged", (x, y)))
        )

        def negated(value, x):
            return Mux(x[-1], -value, value)[:width].as_signed()

        # If x is negative, the vector is turned by half a turn.
        y = g.register("cordic_y", negated, second, first)
        x = g.register("cordic_x", negated, first, first)
        direction = g.register(
            "direction",
            lambda x: Mux(x[-1], p.DIRECTION_FORMAT.min_code, 0)[:direction_width].as_signed(),
            first,
        )
        for i, angle in enumerate(p.directions.codes.tolist()):

            def rotated(a, b, y, negate, i=i):
                below = y[-1]
                return _added(a, _halved(b, i), ~below if negate else below).as_signed()

            def added(direction, y, angle=angle):
                return (direction + Mux(y[-1], -angle, angle))[:direction_width].as_signed()

            direction = g.register(f"direction_{i}", added, direction, y)
            x, y = (
                g.register(f"cordic_x_{i}", lambda x, y, r=rotated: r(x, y, y, False), x, y),
                g.register(f"cordic_y_{i}", lambda y, x, r=rotated: r(y, x, y, True), y, x),
            )
        # A tree of additions divides by the gain.
        zeros = p.GAIN_BITS - p.ROTATED_FORMAT.fraction_bits

        def term(x, sign, shift):
            shifted = Cat(Const(0, zeros), x).as_signed() >> shift
            return shifted if sign > 0 else -shifted

        terms = [
            g.wire(f"gain_{shift}", lambda x, t=(sign, shift): term(x, *t), x) for sign, shift in p.gain_terms
        ]
        while len(terms) > 1:
            terms = [
                g.register(f"{terms[k].name}_sum", lambda *pair: _sum(pair, zeros + width), *terms[k : k + 2])
                for k in range(0, len(terms), 2)
            ]
        cos_beta = g.register(
            "cos_beta_rounded", lambda x: FixedValue(SQ(4, p.GAIN_BITS), x).round_half_up(25), terms[0]
        )
        cos_beta = g.register("cos_beta", lambda x: x.saturate(p.COS_BETA_FORMAT), cos_beta)
        return cos_beta, g.wire("direction", lambda x: FixedValue(p.DIRECTION_FORMAT, x), direction)


def _magnitude(cross: FixedValue) -> FixedValue:
    """Absolute value of a dot product."""
    code = Value.cast(cross)
    return FixedValue(SQ(5, 34), Mux(code[-1], -code, code)[:39].as_signed())


def _sum(terms: Sequence[Value], width: int) -> Value:
    """Sum of terms in a signed word."""
    return sum(terms)[:width].as_signed()


def _halved(a, times):
    """``a / 2**times``, cut, with the width of a."""
    return Cat(a[times:], a[-1].replicate(times))


def _added(a, b, negate):
    """``a - b`` if ``negate``, else ``a + b``, with one adder: -b is the inverted b plus a carry."""
    return (Cat(Const(1, 1), a) + Cat(negate, b ^ negate.replicate(len(b))))[1 : len(a) + 1]
