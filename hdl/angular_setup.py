"""Angular setup ([T] 3.1): a dot product, a half-chord unit, one more multiplier, and CORDIC."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from golden.angular_setup import AngularSetup
from golden.difference_setup import DifferenceSetup
from golden.fixed import SQ, UQ
from golden.unit_vector import COMPONENT

from .arccos import HalfChordUnit
from .dot_product import DotProductUnit
from .fixed import FixedShape, FixedValue
from .middle_normal import normal_shape
from .stream import PipelinedUnit

__all__ = ["AngularSetupUnit"]


class AngularSetupUnit(PipelinedUnit):
    """``psi``, ``lambda``, ``psi/(m-1)`` and ``cos beta`` of a span and a fixed vector.

    Equations, tables, formats and error bound are those of `golden.angular_setup.AngularSetup`, the bit-true
    twin.

    The latency is 55 clocks and the initiation interval 6. Five multipliers of 18 x 18 bits at most: three in
    the dot product (five products of vectors a span), one in the half-chord unit, and one for the two other
    interpolations, x, y and the step. Four tables: 512 words of 36 bits twice and of 34 once, and 2048 of 17.
    CORDIC is unrolled, 22 steps of three adders, as is the sum that takes back its gain.

    Parameters
    ----------
    parameters : AngularSetup
        Tables and formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left", "normal_right", "vector", "length"})))`
        Unit vectors, three components ``SQ(1, 17)`` each; length 1 to 4095.
    o : :py:`Out(stream.Signature(StructLayout({...})))`
        ``angle`` UQ(0, 36), ``phase`` SQ(0, 40), ``step`` UQ(0, 40), all in turns; ``cos_beta`` UQ(1, 25);
        ``length``; ``opposite``: the normals are opposite, and their plane arbitrary.

    Source: [T] 3.1.
    """

    def __init__(self, parameters: AngularSetup | None = None):
        self.parameters = parameters or AngularSetup()
        super().__init__(
            data.StructLayout(
                {
                    "normal_left": normal_shape(),
                    "normal_right": normal_shape(),
                    "vector": normal_shape(),
                    "length": unsigned(DifferenceSetup.LENGTH_BITS),
                }
            ),
            data.StructLayout(
                {
                    "angle": FixedShape(AngularSetup.ANGLE_FORMAT),
                    "phase": FixedShape(AngularSetup.PHASE_FORMAT),
                    "step": FixedShape(AngularSetup.STEP_FORMAT),
                    "cos_beta": FixedShape(AngularSetup.COS_BETA_FORMAT),
                    "length": unsigned(DifferenceSetup.LENGTH_BITS),
                    "opposite": unsigned(1),
                }
            ),
            latency=55,
            initiation_interval=6,
        )

    def datapath(self, m, operands):
        """Ages: dot products 1 to 9, chord at 10, x at 22, y at 25, psi at 36, polar at 49."""
        p, at, register = self.parameters, self.at, self.register
        chord, obtuse, major, minor = self._products(m, operands)
        m.submodules.half_chord = half_chord = HalfChordUnit()
        m.d.comb += [
            half_chord.i.valid.eq(at(10)),
            half_chord.i.payload.chord_squared.eq(chord),
            half_chord.i.payload.supplement.eq(obtuse),
            half_chord.o.ready.eq(1),
        ]
        angle = half_chord.o.payload
        opposite = register(m, obtuse & ~Value.cast(chord).any(), "opposite", when=at(10))

        shift = Signal(5, name="shift")
        with m.If(at(10)):
            for j in range(17, -1, -1):
                with m.If(Value.cast(chord)[34 - 2 * j :].any() if j < 17 else Const(1)):
                    m.d.sync += shift.eq(j)
        minor_operand = self._shifted_minor(m, minor, shift)
        half_operand = register(
            m, major.scale(-1).truncate(17).saturate(COMPONENT), "half_operand", when=at(12)
        )

        # One multiplier, of 17 unsigned and 18 signed bits, for what is issued to it below.
        factor, operand = Signal(17, name="factor"), Signal(signed(18), name="operand")
        product = register(m, factor * operand, "product")

        bits = Value.cast(chord)
        bits = register(m, Mux(bits[35], (1 << 35) - 1, bits[:35]), "correction_bits", when=at(10))
        value, rise = self._entry(m, "corrections", p.corrections, bits, 12)
        change = FixedValue(UQ(-9, 36), product[:27]).round_half_up(22)
        correction = register(m, value + change, "correction_sum", when=at(15))
        correction = register(m, correction.round_half_up(18), "correction_rounded", when=at(16))
        correction = register(m, correction.saturate(p.CORRECTION_FORMAT), "correction", when=at(17))
        x_product = register(m, FixedValue(SQ(0, 35), product).round_half_up(26), "x_product", when=at(20))
        half = self._hold(m, major, "major", 11, 21).scale(-1).truncate(26)
        x = register(m, (half + x_product).wrap(p.AXIS_FORMAT), "x", when=at(21))

        coarse = register(m, (Value.cast(chord) << Cat(Const(0, 3), shift[2:]))[:36], "v_coarse", when=at(11))
        v = register(m, (coarse << Cat(Const(0, 1), shift[:2]))[:36], "v", when=at(12))
        start, fall = self._entry(m, "reciprocals", p.reciprocals, v, 14)
        change = FixedValue(UQ(-8, 36), product[:28]).round_half_up(22)
        reciprocal = register(m, start - change, "reciprocal_sum", when=at(17))
        reciprocal = register(m, reciprocal.round_half_up(17), "reciprocal_rounded", when=at(18))
        reciprocal = register(m, reciprocal.saturate(p.RECIPROCAL_FORMAT), "reciprocal", when=at(19))
        y_rounded = FixedValue(SQ(2, 33), product).round_half_up(26)
        y = register(m, y_rounded.wrap(p.AXIS_FORMAT), "y", when=at(24))

        leading, step_reciprocal, places = self._step_operands(m, operands.length, angle, shift, obtuse)
        step = register(
            m,
            (Cat(Const(0, 6), product[:34]) >> Cat(Const(0, 3), places[3:]))[:40],
            "step_coarse",
            when=at(43),
        )
        places_late = self._hold(m, places, "places", 40, 44)
        step = register(m, (step >> places_late[:3])[:40], "step", when=at(44))

        for age, a, b in (
            (13, self._fraction(bits), rise),
            (15, self._fraction(v), fall),
            (18, Value.cast(correction), Value.cast(half_operand)),
            (22, Value.cast(reciprocal), Value.cast(self._hold(m, minor_operand, "minor_operand", 15, 22))),
            (41, leading, step_reciprocal),
        ):
            with m.If(at(age)):
                m.d.sync += [factor.eq(a), operand.eq(b)]

        swap = self._hold(m, obtuse, "obtuse", 8, 25)
        cos_beta, direction = self._polar(m, x, y, swap)
        half_angle = self._hold(m, angle, "angle", 36, 50).scale(-1).extend(UQ(0, 40))
        phase = (direction.extend(p.PHASE_FORMAT) + half_angle).wrap(p.PHASE_FORMAT)
        phase = register(m, phase, "phase", when=at(50))

        result = Signal(self.o.payload.shape())
        m.d.comb += [
            result.angle.eq(self._hold(m, angle, "angle_out", 36, 55)),
            result.phase.eq(phase),
            result.step.eq(FixedValue(p.STEP_FORMAT, self._hold(m, step, "step", 45, 55))),
            result.cos_beta.eq(cos_beta),
            result.length.eq(self._hold(m, operands.length, "length_out", 1, 55)),
            result.opposite.eq(self._hold(m, opposite, "opposite", 11, 55)),
        ]
        return result

    def _hold(self, m, value, name, since, until):
        """A value that stays for six ages from ``since``, copied on until it can be read at ``until``."""
        interval = self.initiation_interval
        while until >= since + interval:
            since += interval
            value = self.register(m, value, f"{name}_{since}", when=self.at(since - 1))
        return value

    def _products(self, m, operands):
        """Squared chord (from age 10), whether it is the supplement's (8), and both numerators (11)."""
        p, at, register = self.parameters, self.at, self.register
        m.submodules.dot_product = unit = DotProductUnit()
        a, b = Signal(normal_shape(), name="dot_a"), Signal(normal_shape(), name="dot_b")
        left, right, vector = operands.normal_left, operands.normal_right, operands.vector
        pairs = ((left, left), (right, right), (left, right), (left, vector), (right, vector))
        for age, (first, second) in enumerate(pairs, start=1):
            with m.If(at(age)):
                m.d.sync += [a.eq(first), b.eq(second)]
        m.d.comb += [
            unit.i.payload.a.eq(a),
            unit.i.payload.b.eq(b),
            unit.i.valid.eq(1),
            unit.o.ready.eq(1),
        ]
        dot = unit.o.payload
        code = Value.cast(dot)
        own = register(m, dot, "own_left", when=at(5))
        own = register(m, own + dot, "own", when=at(6))
        obtuse = register(m, code[-1], "obtuse", when=at(7))
        cross = register(m, Mux(code[-1], -code, code)[:39].as_signed(), "cross", when=at(7))
        cross = FixedValue(SQ(5, 34), cross).scale(1).extend(SQ(6, 34))
        chord = register(m, own - cross, "chord_wide", when=at(8))
        chord = register(m, chord.saturate(p.CHORD_FORMAT), "chord", when=at(9))
        first = register(m, dot, "dot_left", when=at(8))
        total = register(m, first + dot, "dot_sum", when=at(9))
        difference = register(m, dot - first, "dot_difference", when=at(9))
        major, minor = (
            register(m, _choice(obtuse, x, y), name, when=at(10))
            for name, x, y in (("major", difference, total), ("minor", total, difference))
        )
        return chord, obtuse, major, minor

    def _shifted_minor(self, m, minor, shift):
        """``minor 2^j`` as an operand, from age 15."""
        p, at, register = self.parameters, self.at, self.register
        coarse = register(
            m, (Value.cast(minor) << Cat(Const(0, 2), shift[2:]))[:37], "minor_coarse", when=at(11)
        )
        shifted = register(m, (coarse << shift[:2])[:37], "minor_shifted", when=at(12))
        rounded = FixedValue(SQ(3, 34), shifted).round_half_up(16)
        rounded = register(m, rounded, "minor_rounded", when=at(13))
        return register(m, rounded.saturate(p.MINOR_FORMAT), "minor_operand", when=at(14))

    def _fraction(self, bits):
        """Bits below the address of a table."""
        p = self.parameters
        below = len(bits) - p.ADDRESS_BITS
        return bits[below - p.FRACTION_BITS : below]

    def _entry(self, m, name, table, bits, age):
        """Value and change of a table's word, in registers that are loaded at ``age``."""
        values, changes = table
        width = changes.format.width
        m.submodules[name] = memory = Memory(
            shape=values.format.width + width,
            depth=len(values.codes),
            init=(values.codes << width | changes.codes).tolist(),
        )
        port = memory.read_port()
        m.d.comb += port.addr.eq(bits[len(bits) - self.parameters.ADDRESS_BITS :])
        entry = self.register(m, port.data, f"{name}_entry", when=self.at(age))
        return FixedValue(values.format, entry[width:]), entry[:width]

    def _step_operands(self, m, length, angle, shift, obtuse):
        """Leading bits of psi, the reciprocal's word, and the shift of their product; all from age 40."""
        p, at, register = self.parameters, self.at, self.register
        bits = DifferenceSetup.LENGTH_BITS
        shift = register(m, Mux(obtuse, 0, shift), "angle_shift", when=at(12))
        shift = self._hold(m, shift, "angle_shift", 13, 36)
        coarse = register(
            m, (Value.cast(angle) << Cat(Const(0, 2), shift[2:]))[:36], "psi_coarse", when=at(36)
        )
        shift = self._hold(m, shift, "angle_shift_late", 31, 37)
        leading = register(m, (coarse << shift[:2])[:36], "psi_shifted", when=at(37))
        leading = register(m, FixedValue(UQ(0, 36), leading).round_half_up(18), "psi_rounded", when=at(38))
        leading = register(m, leading.saturate(p.MANTISSA_FORMAT), "psi_leading", when=at(39))

        length = self._hold(m, length, "length", 1, 35)
        steps = register(m, (length - 1)[:bits], "steps", when=at(35))
        position, below_top = Signal(range(bits)), Signal(range(bits))
        with m.If(at(36)):
            m.d.sync += [position.eq(0), below_top.eq(bits - 1)]
            for bit in range(bits):
                with m.If(steps[bit]):
                    m.d.sync += [position.eq(bit), below_top.eq(bits - 1 - bit)]
        address = register(m, (steps << below_top)[: bits - 1], "address", when=at(37))
        table = DifferenceSetup().reciprocals
        m.submodules.lengths = memory = Memory(
            shape=table.format.width, depth=len(table.codes), init=table.codes.tolist()
        )
        port = memory.read_port()
        m.d.comb += port.addr.eq(address)
        reciprocal = register(m, port.data, "length_reciprocal", when=at(39))
        places = register(m, position + address.any(), "length_places", when=at(38))
        places = register(m, (places + shift)[:5], "places", when=at(39))
        return Value.cast(leading), reciprocal, places

    def _polar(self, m, x, y, swap):
        """CORDIC: one step a clock from age 27 on; cos beta at age 55, the direction from 50."""
        p, at, register = self.parameters, self.at, self.register
        width = p.ROTATED_FORMAT.width
        pairs = {"x_26": (y, x), "y_26": (x, y)}
        first, second = (
            Value.cast(register(m, _choice(swap, *pair).extend(p.ROTATED_FORMAT), name))
            for name, pair in pairs.items()
        )
        behind = first[-1]
        turned = FixedValue(p.DIRECTION_FORMAT, Mux(behind, p.DIRECTION_FORMAT.min_code, 0)[:28].as_signed())
        direction = Value.cast(register(m, turned, "direction"))
        across = register(m, Mux(behind, -second, second)[:width].as_signed(), "across")
        along = register(m, Mux(behind, -first, first)[:width].as_signed(), "along")
        for i, turn in enumerate(p.directions.codes.tolist()):
            below = across[-1]
            rotated = {
                "along": _added(along, _halved(across, i), below),
                "across": _added(across, _halved(along, i), ~below),
                "direction": (direction + Mux(below, -turn, turn))[: len(direction)],
            }
            along, across, direction = (
                register(m, value.as_signed(), f"{name}_{i}") for name, value in rotated.items()
            )
        direction = register(m, FixedValue(p.DIRECTION_FORMAT, direction), "direction_held", when=at(49))
        # The gain is taken back by a tree of additions.
        wide = Cat(Const(0, p.GAIN_BITS - p.ROTATED_FORMAT.fraction_bits), along).as_signed()
        terms = [wide >> places if sign > 0 else -(wide >> places) for sign, places in p.gain_terms]
        stage = 0
        while len(terms) > 1:
            stage += 1
            sums = [Signal(signed(len(wide)), name=f"gain_{stage}_{k}") for k in range((len(terms) + 1) // 2)]
            m.d.sync += [total.eq(sum(terms[2 * k : 2 * k + 2])) for k, total in enumerate(sums)]
            terms = sums
        cos_beta = FixedValue(SQ(4, p.GAIN_BITS), terms[0]).round_half_up(25)
        cos_beta = register(m, cos_beta, "cos_beta_rounded")
        return register(m, cos_beta.saturate(p.COS_BETA_FORMAT), "cos_beta"), direction


def _choice(condition, a, b):
    """One of two fixed-point values of a format."""
    return FixedValue(a.format, Mux(condition, Value.cast(a), Value.cast(b)))


def _halved(a, times):
    """``a / 2**times``, cut, in as many bits."""
    return Cat(a[times:], a[-1].replicate(times))


def _added(a, b, negate):
    """``a + b``, or ``a - b`` where told, with one adder: the negative is the inverse and a carry."""
    return (Cat(Const(1, 1), a) + Cat(negate, b ^ negate.replicate(len(b))))[1 : len(a) + 1]
