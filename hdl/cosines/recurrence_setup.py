"""Recurrence setup: start values of the interleaved recurrence, on shared multipliers."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import light_vectors_shape, span_normals_shape
from blysk.hdl.core.word import Word
from blysk.hdl.cosines.chord import chord, dot

__all__ = ["RecurrenceSetupUnit", "recurrence_starts_shape"]

_SHIFT_BITS = 6


def recurrence_starts_shape(model: RecurrenceSetup, lights: int) -> data.StructLayout:
    """Shape of a prepared span: starts for L and H of each light, the step's words, length and flag.

    The step's words are the coefficient, and its shift in the form ``reinsch``. The flag is ``out_of_range``.
    """
    r = model.recurrence
    words = data.ArrayLayout(FixedShape(r.state_format), r.interleave)
    start = data.StructLayout(dict.fromkeys(("first", "second"), words))
    members = {
        "lights": data.ArrayLayout(data.StructLayout({"diffuse": start, "highlight": start}), lights),
        "coefficient": FixedShape(r.coefficient_format),
    }
    if r.form == "reinsch":
        members["shift"] = unsigned(r.SHIFT_BITS)
    return data.StructLayout({**members, "length": unsigned(LENGTH_BITS), "out_of_range": unsigned(1)})


class RecurrenceSetupUnit(PipelinedUnit):
    """Start values of ``N . L`` and ``N . H`` along a span, for each light and each phase.

    Pixel k of a span belongs to phase k mod 4. `RecurrenceSetup`, the bit-accurate model, has equations,
    formats and the error bound.

    A span has 14 products, and 32 more for each light. Let I be the initiation interval. The products share
    ``ceil((14 + 32 lights) / I)`` multipliers of 18x18 bits. The seven steps of the recurrence take 14 of a
    light's products, seven for L and seven for H. The 18 shifts of a light share ``ceil(18 lights / I)``
    shifters of 48 bits. For one light:

    =================== === === === === ===
    initiation interval 1   2   4   8   46
    =================== === === === === ===
    latency             112 121 126 138 225
    multipliers         46  23  12  6   1
    shifters            18  9   5   3   1
    =================== === === === === ===

    There are four tables: two of 512 words of 72 bits, one of 512 words of 36 bits, one of 2048 words of 35
    bits.

    Parameters
    ----------
    model : RecurrenceSetup
        Bit-accurate model.
    lights : int
        Number of lights, 1 or more.
    initiation_interval : int
        Cycles from an input to the next, at least 1.

    Raises
    ------
    ValueError
        If ``initiation_interval`` is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape()))`
        Spans of length 1 to 4095.
    o : :py:`Out(stream.Signature(recurrence_starts_shape(model, lights)))`
        Start values, the coefficient K of a step of four pixels and its shift, and the length. If
        ``out_of_range`` is 1, the span is over 90 degrees and its words are invalid.
    constants : :py:`In(light_vectors_shape(lights))`
        Unit vectors L and H, constant while beats are inside.

    Source: docs/theory/interpolation.md#recurrence; [T] 3.1, 3.3.
    """

    def __init__(
        self, model: RecurrenceSetup | None = None, lights: int = 1, *, initiation_interval: int = 4
    ):
        self.model = p = model or RecurrenceSetup()
        self.lights = lights
        self._graph = g = Dataflow(initiation_interval)
        self._shifted = p.steps.curvature_format
        shapes = FixedShape(self._shifted), unsigned(_SHIFT_BITS)
        self._shifter = g.share("shifter", shapes, 2, self._shift)
        self._results = self._describe()
        self.multipliers, self.shifters = g.multiplier.count, self._shifter.count
        super().__init__(
            span_normals_shape(),
            recurrence_starts_shape(p, lights),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
            constants=light_vectors_shape(lights),
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for key, word in self._results.items():
            if isinstance(key, str):
                target = result[key]
            else:
                light, function, which, phase = key
                target = result.lights[light][function][which][phase]
            m.d.comb += target.eq(value(word, self.latency))
        return result

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.model
        left, right = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in ("normal_left", "normal_right")
        )
        length = g.input("length", lambda operands: operands.length)
        widest = FixedValue.constant(p.WIDEST.format, p.WIDEST.values.item())
        u = chord(g, "span", right, left)
        u = g.register("chord_unit", lambda u: u + u.scale(-16).truncate(35), u)
        out_of_range = g.register("out_of_range", lambda u: u >= widest, u)
        u = g.register("chord", lambda u: u.saturate(p.CHORD_FORMAT), u)
        q, q_shift = self._normalised(u)
        square, inverse = self._looked_up("chord", p.chord_tables, g.register("chord_bits", Value.cast, u))
        cosines = self._cosines(left, right)
        reciprocal, reciprocal_square, step_shift, square_shift = self._steps(length)

        q_square, exponent = self._step_square(q, q_shift, square, reciprocal_square, square_shift)
        sine, step, phase = self._step_functions(q_square, exponent)
        rho, rho_shift = self._rho(inverse, sine, reciprocal, step_shift)

        results = {"length": length, "out_of_range": out_of_range}
        if p.recurrence.form == "reinsch":
            results |= dict(zip(("coefficient", "shift"), phase, strict=True))
        else:
            results["coefficient"] = self._cosine_coefficient(*phase)
        slopes = {key: self._slope(_name(key), ends, q, q_shift) for key, ends in cosines.items()}
        differences = {key: self._rho_slope(_name(key), s, rho, rho_shift) for key, s in slopes.items()}
        firsts = {key: ends[0] for key, ends in cosines.items()}
        return results | self._starts(self._states(firsts, differences, *step))

    def _cosines(self, left: Word, right: Word) -> dict[tuple[int, str], list[Word]]:
        """Words of the cosines ``a`` and ``b`` at the left and right end, for L and H of each light."""
        return {
            (i, function): [
                self._cosine(f"{function}_{i}_{side}", n, lambda _, i=i, name=name: self.constants[i][name])
                for side, n in (("left", left), ("right", right))
            ]
            for i in range(self.lights)
            for function, name in (("diffuse", "direction"), ("highlight", "halfway"))
        }

    def _step_square(
        self, q: Word, q_shift: Word, square: Word, reciprocal_square: Word, square_shift: Word
    ) -> tuple[Word, Word]:
        """Word and exponent of Q: ``Q = 8 word 2^-exponent``. The word is 1/2 or more, or 0 if Q is 0."""
        g = self._graph
        product = g.multiply("psi_square_product", q, square)
        psi_square = g.register("psi_square_exact", lambda q, product: q + product, q, product)
        psi_square, over = self._under_one("psi_square", psi_square)
        exponent = g.register(
            "span_exponent", lambda a, b, over: (a + b - over)[:_SHIFT_BITS], q_shift, square_shift, over
        )
        product = g.multiply("q_square_product", psi_square, reciprocal_square)
        under = g.register("q_square_under", lambda product: ~Value.cast(product)[-1], product)
        q_square = g.register(
            "q_square_doubled",
            lambda product: FixedValue(
                product.format,
                Mux(Value.cast(product)[-1], Value.cast(product), Cat(Const(0, 1), Value.cast(product)[:-1])),
            ),
            product,
        )
        q_square = self._word("q_square", q_square)
        return q_square, g.register("exponent", lambda a, under: (a + under)[:_SHIFT_BITS], exponent, under)

    def _step_functions(
        self, q_square: Word, exponent: Word
    ) -> tuple[Word, tuple[Word, Word], tuple[Word, Word]]:
        """Words of ``1 - sin d/d``, of K for a step d with its shift, and of K for 4d with its shift."""
        g, p = self._graph, self.model
        bits = g.register(
            "step_coarse",
            lambda word, e: Cat(Const(0, 11), Value.cast(word)) >> Cat(Const(0, 3), e[3:]),
            q_square,
            exponent,
        )
        bits = g.register("step_fine", lambda bits, e: bits >> e[:3], bits, exponent)
        width = p.SQUARE_FORMAT.width
        step_bits = g.register("step_bits", lambda bits: bits[4 : 4 + width], bits)
        phase_bits = g.register("phase_bits", lambda bits: bits[:width], bits)
        step_table, sine = self._looked_up("step", p.step_tables, step_bits)
        (phase_table,) = self._looked_up("phase", p.step_tables[:1], phase_bits)
        step, phase = (
            self._coefficient(name, q_square, table)
            for name, table in (("step", step_table), ("phase", phase_table))
        )
        step_shift = g.register("step_shift", lambda e: (e - 1)[:_SHIFT_BITS], exponent)
        phase_shift = g.register("phase_shift", lambda e: Mux(e >= 5, e - 5, 0)[:_SHIFT_BITS], exponent)
        return sine, (step, step_shift), (phase, phase_shift)

    def _rho(self, inverse: Word, sine: Word, reciprocal: Word, step_shift: Word) -> tuple[Word, Word]:
        """Word of rho (see `RecurrenceSetup`) and its shift."""
        g, p = self._graph, self.model
        product = g.multiply("excess_product", inverse, sine)
        excess = g.register("excess_difference", lambda a, b: a - b, inverse, sine)
        excess = g.register("excess_exact", lambda a, product: a - product, excess, product)
        excess = g.register("excess_rounded", lambda c: c.round_half_up(17), excess)
        excess = g.register("excess", lambda c: c.saturate(p.EXCESS_FORMAT), excess)
        product = g.multiply("rho_product", reciprocal, excess)
        rho = g.register("rho_exact", lambda r, product: r + product, reciprocal, product)
        rho, over = self._under_one("rho", rho)
        return rho, g.register("rho_shift", lambda shift, over: (shift - over)[:4], step_shift, over)

    def _states(self, firsts: dict, differences: dict, step_k: Word, step_s: Word) -> dict:
        """Words of x(0) to x(7) for L and H of each light, with half a step added as in the recurrence unit.

        Parameters
        ----------
        firsts, differences : dict of Word
            The cosines ``a``, and the products ``rho (b - a + a q)``.
        step_k, step_s : Word
            K of a step d, and its shift.
        """
        g, r = self._graph, self.model.steps
        state, half = r.state_format, self._half_step
        x = {
            key: [g.register(f"{_name(key)}_x_0", lambda a: (a.extend(state) + half).wrap(state), first)]
            for key, first in firsts.items()
        }
        differences = dict(differences)
        for k in range(7):
            for key, words in x.items():
                name, difference = _name(key), differences[key]
                product = g.multiply(
                    f"{name}_product_{k}", words[k], step_k, lambda x: x.truncate(r.fraction_bits)
                )
                curvature = self._right(
                    f"{name}_curvature_{k}", product, step_s, lambda v: v.scale(2).extend(self._shifted)
                )
                if k == 0:
                    difference = g.register(
                        f"{name}_difference_0",
                        lambda a, b: (a - b.scale(-1).truncate(b.format.fraction_bits)).wrap(state),
                        difference,
                        curvature,
                    )
                    total = g.register(f"{name}_x_1", lambda x, d: (x + d).wrap(state), words[0], difference)
                else:
                    total = g.register(
                        f"{name}_sum_{k}", lambda x, d: (x + d).wrap(state), words[k], difference
                    )
                    difference = g.register(
                        f"{name}_difference_{k}", lambda d, b: (d - b).wrap(state), difference, curvature
                    )
                    total = g.register(
                        f"{name}_x_{k + 1}", lambda x, b: (x - b).wrap(state), total, curvature
                    )
                differences[key] = difference
                words.append(total)
        return x

    def _starts(self, states: dict) -> dict:
        """Words of the start values, by light, function, ``first`` or ``second``, and phase."""
        g, r, half = self._graph, self.model.recurrence, self._half_step
        state, results = self.model.steps.state_format, {}
        for key, words in states.items():
            for j in range(r.interleave):
                name = f"{_name(key)}_start_{j}"
                first, second = words[j], words[j + r.interleave]
                if r.form == "reinsch":
                    first, second = (
                        g.register(f"{name}_first", lambda x: (x - half).wrap(state), first),
                        g.register(f"{name}_second", lambda x, y: (y - x).wrap(state), first, second),
                    )
                else:
                    first, second = (
                        self._short(f"{name}_{which}", word)
                        for which, word in (("first", first), ("second", second))
                    )
                results[*key, "first", j] = first
                results[*key, "second", j] = second
        return results

    @property
    def _half_step(self) -> FixedValue:
        """Half a step of the recurrence's operand."""
        r = self.model.steps
        return FixedValue.constant(r.state_format, 2.0 ** -(r.fraction_bits + 1))

    def _short(self, name, word) -> Word:
        """Word of a start value of ``direct``, truncated. Half a step was added before, so this rounds."""
        format = self.model.recurrence.state_format
        return self._graph.register(name, lambda x: x.truncate(format.fraction_bits), word)

    def _cosine_coefficient(self, coefficient, shift) -> Word:
        """Word of ``-2 cos 4d`` from K, rounded up."""
        g, format = self._graph, self.model.recurrence.coefficient_format
        code = g.register(
            "cosine_negative",
            lambda k, s: (-(Value.cast(k) << 1)) >> Cat(Const(0, 3), s[3:]),
            coefficient,
            shift,
        )
        code = g.register("cosine_shifted", lambda code, s: code >> s[:3], code, shift)
        exact = g.register(
            "cosine_exact",
            lambda code: FixedValue(SQ(4, 16), (-code - (2 << 16))[: SQ(4, 16).width]),
            code,
        )
        return g.register("cosine_coefficient", lambda c: c.saturate(format), exact)

    def _cosine(self, name, normal, vector) -> Word:
        """Word of a dot product in units of `ONE_SQUARED`."""
        g, p = self._graph, self.model
        total = dot(g, name, normal, vector)
        total = g.register(f"{name}_unit", lambda v: v + v.scale(-16).truncate(34), total)
        return g.register(name, lambda v: v.saturate(p.COSINE_FORMAT), total)

    def _slope(self, name, ends, q, q_shift) -> Word:
        """Word of ``b - a + a q``."""
        g, p = self._graph, self.model
        left, right = ends
        operand = g.register(f"{name}_rounded", lambda a: a.round_half_up(16), left)
        operand = g.register(f"{name}_operand", lambda a: a.saturate(p.OPERAND_FORMAT), operand)
        product = g.multiply(f"{name}_a_q_product", operand, q)
        product = self._right(f"{name}_a_q", product, q_shift, lambda v: v.extend(self._shifted))
        rise = g.register(f"{name}_rise", lambda a, b: (b - a).truncate(28), left, right)
        return g.register(
            f"{name}_slope",
            lambda rise, a_q: (rise + a_q.truncate(28)).wrap(p.SLOPE_FORMAT),
            rise,
            product,
        )

    def _rho_slope(self, name, slope, rho, rho_shift) -> Word:
        """Word of ``rho (b - a + a q)``."""
        g, p = self._graph, self.model
        low_bits = p.SLOPE_LOW_FORMAT.width
        high = g.multiply(
            f"{name}_high", slope, rho, lambda v: FixedValue(p.OPERAND_FORMAT, Value.cast(v)[low_bits:])
        )
        low = g.multiply(
            f"{name}_low", slope, rho, lambda v: FixedValue(p.SLOPE_LOW_FORMAT, Value.cast(v)[:low_bits])
        )
        total = g.register(f"{name}_rho_slope_exact", lambda high, low: (high + low).scale(1), high, low)
        return self._right(f"{name}_rho_slope", total, rho_shift, lambda v: v.extend(self._shifted))

    def _right(self, name, value, shift, aligned) -> Word:
        """Word of a value shifted right."""
        return self._graph.use(self._shifter, name, (value, shift), lambda v, s: (aligned(v), s))

    def _shift(self, register, value, amount):
        """Shifter of two stages."""
        coarse = FixedValue(self._shifted, Value.cast(value) >> Cat(Const(0, 3), amount[3:]))
        coarse, fine = register(coarse, "coarse"), register(amount[:3], "fine_amount")
        return register(FixedValue(self._shifted, Value.cast(coarse) >> fine), "shifted")

    def _normalised(self, chord: Word) -> tuple[Word, Word]:
        """Word of a chord, and its left shift. The word is in [1/2, 1), unless the chord is 0."""
        g, p = self._graph, self.model

        def shift_of(chord):
            code, shift = Value.cast(chord), Const(p.CHORD_SHIFT, _SHIFT_BITS)
            for j in range(p.CHORD_SHIFT - 1, -1, -1):
                shift = Mux(code[34 - j :].any(), j, shift)
            return shift

        width = p.CHORD_FORMAT.width
        shift = g.register("chord_shift", shift_of, chord)
        word = g.register(
            "chord_coarse",
            lambda chord, s: (Value.cast(chord) << Cat(Const(0, 3), s[3:]))[:width],
            chord,
            shift,
        )
        word = g.register(
            "chord_fine",
            lambda word, s: FixedValue(p.CHORD_FORMAT, (word << s[:3])[:width]),
            word,
            shift,
        )
        return self._word("chord_word", word), shift

    def _word(self, name, value) -> Word:
        """Word of a value rounded to 17 bits and saturated under 1."""
        g, p = self._graph, self.model
        rounded = g.register(f"{name}_rounded", lambda v: v.round_half_up(17), value)
        return g.register(name, lambda v: v.saturate(p.WORD_FORMAT), rounded)

    def _under_one(self, name, value) -> tuple[Word, Word]:
        """Word under 1 of a value with 34 fraction bits, and a bit.

        The bit is 1 if the value is 1 or more. Then the word is half of the value.
        """
        g = self._graph

        def halved(value, over):
            code, format = Value.cast(value), value.format
            return FixedValue(format, Mux(over, code[:], (code << 1)[: format.width])).scale(-1)

        over = g.register(f"{name}_over", lambda v: Value.cast(v)[v.format.fraction_bits :].any(), value)
        return self._word(name, g.register(f"{name}_halved", halved, value, over)), over

    def _looked_up(self, name, tables, bits) -> list[Word]:
        """One word for each table: the table's value at an operand, interpolated."""
        g, p = self._graph, self.model
        value_bits, change_bits = p.TABLE_VALUE_FORMAT.width, p.TABLE_CHANGE_FORMAT.width
        width = value_bits + change_bits
        words = [
            sum(
                (int(value) << change_bits | int(change)) << (width * k)
                for k, (value, change) in enumerate(row)
            )
            for row in zip(*(zip(v.codes, c.codes, strict=True) for v, c in tables), strict=True)
        ]
        address = g.register(f"{name}_address", lambda bits: bits[-p.ADDRESS_BITS :], bits)
        fraction = g.register(
            f"{name}_fraction",
            lambda bits: FixedValue(
                UQ(0, p.FRACTION_BITS), bits[-p.ADDRESS_BITS - p.FRACTION_BITS : -p.ADDRESS_BITS]
            ),
            bits,
        )
        read = g.look_up(f"{name}_tables", words, width * len(tables), address)
        entry = g.register(f"{name}_entry", lambda word: word, read)
        looked_up = []
        for k in range(len(tables)):

            def change(entry, start=width * k):
                return FixedValue(p.TABLE_CHANGE_FORMAT, entry[start : start + change_bits])

            def total(entry, product, start=width * k + change_bits):
                value = FixedValue(p.TABLE_VALUE_FORMAT, entry[start : start + value_bits])
                return value + product.round_half_up(22)

            product = g.multiply(f"{name}_{k}_product", entry, fraction, change)
            value = g.register(f"{name}_{k}_sum", total, entry, product)
            looked_up.append(self._word(f"{name}_{k}", value))
        return looked_up

    def _coefficient(self, name, q_square, one_minus_k) -> Word:
        """Word of K = ``Q k(Q)``."""
        g = self._graph
        product = g.multiply(f"{name}_coefficient_product", q_square, one_minus_k)
        value = g.register(f"{name}_coefficient_exact", lambda q, product: q - product, q_square, product)
        return self._word(f"{name}_coefficient", value)

    def _steps(self, length: Word) -> tuple[Word, Word, Word, Word]:
        """Words of ``1/(m-1)`` and its square, and their shifts. They take six cycles."""
        g, p = self._graph, self.model
        top, bits = LENGTH_BITS - 1, p.WORD_FORMAT.width

        def leading(steps):
            position = Const(0, 4)
            for bit in range(LENGTH_BITS):
                position = Mux(steps[bit], bit, position)
            return position

        def part(entry, start):
            return FixedValue(p.WORD_FORMAT, entry[start : start + bits])

        steps = g.register("steps", lambda length: (length - 1)[:LENGTH_BITS], length)
        position = g.register("position", leading, steps)
        address = g.register("address", lambda a, b: (a << (top - b)[:4])[:top], steps, position)
        reciprocal, square, small = (
            word.codes if isinstance(word, Fixed) else word for word in p.reciprocals
        )
        words = (small << 2 * bits | square << bits | reciprocal).tolist()
        read = g.look_up("reciprocals", words, 2 * bits + 1, address)
        entry = g.register("reciprocal_entry", lambda word: word, read)
        shift = g.register("reciprocal_shift", lambda a, b: (a + b.any())[:4], position, address)
        square_shift = g.register(
            "square_shift", lambda entry, shift: Cat(entry[2 * bits], shift), entry, shift
        )
        return (
            g.register("reciprocal", lambda entry: part(entry, 0), entry),
            g.register("reciprocal_square", lambda entry: part(entry, bits), entry),
            shift,
            square_shift,
        )


def _name(key: tuple[int, str]) -> str:
    """Common part of the names of a light's words."""
    light, function = key
    return f"{function}_{light}"
