"""Recurrence setup: start values of the interleaved recurrence, on shared multipliers."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.dataflow import Dataflow, Word
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import light_vectors_shape, span_normals_shape
from blysk.hdl.core.stream import PipelinedUnit
from blysk.hdl.cosines.chord import chord, dot

__all__ = ["RecurrenceSetupUnit", "recurrence_starts_shape"]

_SHIFT_BITS = 6


def recurrence_starts_shape(parameters: RecurrenceSetup, lights: int) -> data.StructLayout:
    """Shape of a prepared span: start values for L and H of each light; coefficient, shift, length, flag."""
    r = parameters.recurrence
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
    """Start values of the four phases of ``N . L`` and ``N . H`` along a span, for each light.

    Equations, formats and error bound are those of `RecurrenceSetup`, the bit-true
    twin.

    The 14 products of a span and the 32 of each light take turns at ``ceil((14 + 32 lights) / I)``
    multipliers of 18x18 bits, I the initiation interval. Half of those of a light are its seven steps of the
    recurrence, twice; each also takes a turn at a shifter of 48 bits, of which there are
    ``ceil(18 lights / I)``. For one light:

    =================== === === === === ===
    initiation interval 1   2   4   8   46
    =================== === === === === ===
    latency             141 144 156 172 282
    multipliers         46  23  12  6   1
    shifters            18  9   5   3   1
    =================== === === === === ===

    Tables: 512 words of 72 bits twice and of 36 once, and 2048 of 35.

    Parameters
    ----------
    parameters : RecurrenceSetup
        Twin.
    lights : int
        Number of lights, 1 or more.
    initiation_interval : int
        Distance in cycles of two inputs, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape()))`
        Spans of length 1 to 4095.
    o : :py:`Out(stream.Signature(recurrence_starts_shape(parameters, lights)))`
        Start values; K of four pixels and its shift; the length; ``out_of_range``: the span is over 90
        degrees and they mean nothing.
    constants : :py:`In(light_vectors_shape(lights))`
        Unit vectors L and H; stay while beats are inside.

    Source: [T] 3.1, 3.3.
    """

    def __init__(
        self, parameters: RecurrenceSetup | None = None, lights: int = 1, initiation_interval: int = 4
    ):
        self.parameters = p = parameters or RecurrenceSetup()
        self.lights = lights
        self._graph = g = Dataflow(initiation_interval, 14 + 32 * lights)
        self.multipliers = g.multiplier.count
        self._shifted = p.steps.bend_format
        self._shifter = g.share(
            "shifter", 18 * lights, (FixedShape(self._shifted), unsigned(_SHIFT_BITS)), 2, self._shift
        )
        self.shifters = self._shifter.count
        self._results = self._describe()
        super().__init__(
            span_normals_shape(),
            recurrence_starts_shape(p, lights),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
            constants=light_vectors_shape(lights),
        )

    def datapath(self, m, operands):
        """The graph, read at the age of its last words."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for key, word in self._results.items():
            if isinstance(key, str):
                target = result[key]
            else:
                light, copy, which, phase = key
                target = result.lights[light][copy][which][phase]
            m.d.comb += target.eq(value(word, self.latency))
        return result

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.parameters
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
        cosines = {}
        for i in range(self.lights):
            for copy, name in (("diffuse", "direction"), ("highlight", "halfway")):
                cosines[i, copy] = [
                    self._cosine(f"{copy}_{i}_{side}", n, lambda _, i=i, name=name: self.constants[i][name])
                    for side, n in (("left", left), ("right", right))
                ]
        reciprocal, reciprocal_square, step_shift, square_shift = self._steps(length)

        product = g.multiply("psi_square_product", q, square)
        psi_square = g.register("psi_square_exact", lambda q, product: q + product, q, product)
        psi_square, over = self._under_one("psi_square", psi_square)
        exponent = g.register(
            "exponent_of_span", lambda a, b, over: (a + b - over)[:_SHIFT_BITS], q_shift, square_shift, over
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
        exponent = g.register("exponent", lambda a, under: (a + under)[:_SHIFT_BITS], exponent, under)
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
        bend, sine = self._looked_up("step", p.step_tables, step_bits)
        (phase_bend,) = self._looked_up("phase", p.step_tables[:1], phase_bits)
        step_k, phase_k = (
            self._coefficient(name, q_square, table)
            for name, table in (("step", bend), ("phase", phase_bend))
        )
        step_s = g.register("step_shift", lambda e: (e - 1)[:_SHIFT_BITS], exponent)
        phase_s = g.register("phase_shift", lambda e: Mux(e >= 5, e - 5, 0)[:_SHIFT_BITS], exponent)

        product = g.multiply("excess_product", inverse, sine)
        excess = g.register("excess_difference", lambda a, b: a - b, inverse, sine)
        excess = g.register("excess_exact", lambda a, product: a - product, excess, product)
        excess = g.register("excess_rounded", lambda c: c.round_half_up(17), excess)
        excess = g.register("excess", lambda c: c.saturate(p.EXCESS_FORMAT), excess)
        product = g.multiply("rho_product", reciprocal, excess)
        rho = g.register("rho_exact", lambda r, product: r + product, reciprocal, product)
        rho, over = self._under_one("rho", rho)
        rho_shift = g.register("rho_shift", lambda shift, over: (shift - over)[:4], step_shift, over)

        results = {"length": length, "out_of_range": out_of_range}
        if p.recurrence.form == "reinsch":
            results |= {"coefficient": phase_k, "shift": phase_s}
        else:
            results["coefficient"] = self._cosine_coefficient(phase_k, phase_s)
        slopes = {key: self._slope(f"{key[1]}_{key[0]}", ends, q, q_shift) for key, ends in cosines.items()}
        along = {key: self._along(f"{key[1]}_{key[0]}", s, rho, rho_shift) for key, s in slopes.items()}
        r, state = p.steps, p.steps.state_format
        half = FixedValue.constant(state, 2.0 ** -(r.fraction_bits + 1))
        # As in the recurrence unit, x is held with half a step of the operand added.
        x = {
            key: [
                g.register(
                    f"{key[1]}_{key[0]}_x_0", lambda a: (a.extend(state) + half).wrap(state), cosines[key][0]
                )
            ]
            for key in along
        }
        difference: dict = {}
        for k in range(7):
            for key, words in x.items():
                name = f"{key[1]}_{key[0]}"
                product = g.multiply(
                    f"{name}_product_{k}", words[k], step_k, lambda x: x.truncate(r.fraction_bits)
                )
                bend = self._right(
                    f"{name}_bend_{k}", product, step_s, lambda v: v.scale(2).extend(self._shifted)
                )
                if k == 0:
                    difference[key] = g.register(
                        f"{name}_difference_0",
                        lambda a, b: (a - b.scale(-1).truncate(b.format.fraction_bits)).wrap(state),
                        along[key],
                        bend,
                    )
                    total = g.register(
                        f"{name}_x_1", lambda x, d: (x + d).wrap(state), words[0], difference[key]
                    )
                else:
                    total = g.register(
                        f"{name}_sum_{k}", lambda x, d: (x + d).wrap(state), words[k], difference[key]
                    )
                    difference[key] = g.register(
                        f"{name}_difference_{k}", lambda d, b: (d - b).wrap(state), difference[key], bend
                    )
                    total = g.register(f"{name}_x_{k + 1}", lambda x, b: (x - b).wrap(state), total, bend)
                words.append(total)
        for (light, copy), words in x.items():
            for j in range(r.interleave):
                name = f"{copy}_{light}_start_{j}"
                first, second = words[j], words[j + r.interleave]
                if p.recurrence.form == "reinsch":
                    first, second = (
                        g.register(f"{name}_first", lambda x: (x - half).wrap(state), first),
                        g.register(f"{name}_second", lambda x, y: (y - x).wrap(state), first, second),
                    )
                else:
                    first, second = (
                        self._short(f"{name}_{which}", word)
                        for which, word in (("first", first), ("second", second))
                    )
                results[light, copy, "first", j] = first
                results[light, copy, "second", j] = second
        return results

    def _short(self, name, word) -> Word:
        """A value of ``direct``, which the half step in the word rounds."""
        format = self.parameters.recurrence.state_format
        return self._graph.register(name, lambda x: x.truncate(format.fraction_bits), word)

    def _cosine_coefficient(self, coefficient, shift) -> Word:
        """``-2 cos 4d`` from K, rounded up."""
        g, format = self._graph, self.parameters.recurrence.coefficient_format
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
        """Dot product, in units of `ONE_SQUARED`."""
        g, p = self._graph, self.parameters
        total = dot(g, name, normal, vector)
        total = g.register(f"{name}_unit", lambda v: v + v.scale(-16).truncate(34), total)
        return g.register(name, lambda v: v.saturate(p.COSINE_FORMAT), total)

    def _slope(self, name, ends, q, q_shift) -> Word:
        """``b - a + a q``."""
        g, p = self._graph, self.parameters
        left, right = ends
        operand = g.register(f"{name}_rounded", lambda a: a.round_half_up(16), left)
        operand = g.register(f"{name}_operand", lambda a: a.saturate(p.OPERAND_FORMAT), operand)
        product = g.multiply(f"{name}_across_product", operand, q)
        across = self._right(f"{name}_across", product, q_shift, lambda v: v.extend(self._shifted))
        rise = g.register(f"{name}_rise", lambda a, b: (b - a).truncate(28), left, right)
        return g.register(
            f"{name}_slope",
            lambda rise, across: (rise + across.truncate(28)).wrap(p.SLOPE_FORMAT),
            rise,
            across,
        )

    def _along(self, name, slope, rho, rho_shift) -> Word:
        """``rho`` times the slope."""
        g, p = self._graph, self.parameters
        low_bits = p.SLOPE_LOW_FORMAT.width
        high = g.multiply(
            f"{name}_high", slope, rho, lambda v: FixedValue(p.OPERAND_FORMAT, Value.cast(v)[low_bits:])
        )
        low = g.multiply(
            f"{name}_low", slope, rho, lambda v: FixedValue(p.SLOPE_LOW_FORMAT, Value.cast(v)[:low_bits])
        )
        total = g.register(f"{name}_along_exact", lambda high, low: (high + low).scale(1), high, low)
        return self._right(f"{name}_along", total, rho_shift, lambda v: v.extend(self._shifted))

    def _right(self, name, value, shift, aligned) -> Word:
        """A word shifted right."""
        return self._graph.use(self._shifter, name, (value, shift), lambda v, s: (aligned(v), s))

    def _shift(self, register, value, amount):
        """In two stages."""
        coarse = FixedValue(self._shifted, Value.cast(value) >> Cat(Const(0, 3), amount[3:]))
        coarse, fine = register(coarse, "coarse"), register(amount[:3], "fine_amount")
        return register(FixedValue(self._shifted, Value.cast(coarse) >> fine), "shifted")

    def _normalised(self, chord: Word) -> tuple[Word, Word]:
        """Word in [1/2, 1), or 0, and its shift."""
        g, p = self._graph, self.parameters

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
        """Rounded to 17 bits under 1."""
        g, p = self._graph, self.parameters
        rounded = g.register(f"{name}_rounded", lambda v: v.round_half_up(17), value)
        return g.register(name, lambda v: v.saturate(p.WORD_FORMAT), rounded)

    def _under_one(self, name, value) -> tuple[Word, Word]:
        """Word under 1 of a value of 34 fraction bits, and whether it is half of the value."""
        g = self._graph

        def halved(value, over):
            code, format = Value.cast(value), value.format
            return FixedValue(format, Mux(over, code[:], (code << 1)[: format.width])).scale(-1)

        over = g.register(f"{name}_over", lambda v: Value.cast(v)[v.format.fraction_bits :].any(), value)
        return self._word(name, g.register(f"{name}_halved", halved, value, over)), over

    def _looked_up(self, name, tables, bits) -> list[Word]:
        """Values of tables at a word, interpolated."""
        g, p = self._graph, self.parameters
        value_bits, change_bits = p.TABLE_VALUE_FORMAT.width, p.TABLE_CHANGE_FORMAT.width
        width = value_bits + change_bits
        words = [
            sum(
                (int(value) << change_bits | int(change)) << (width * place)
                for place, (value, change) in enumerate(row)
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
        found = []
        for place in range(len(tables)):

            def change(entry, start=width * place):
                return FixedValue(p.TABLE_CHANGE_FORMAT, entry[start : start + change_bits])

            def total(entry, product, start=width * place + change_bits):
                value = FixedValue(p.TABLE_VALUE_FORMAT, entry[start : start + value_bits])
                return value + product.round_half_up(22)

            product = g.multiply(f"{name}_{place}_product", entry, fraction, change)
            value = g.register(f"{name}_{place}_sum", total, entry, product)
            found.append(self._word(f"{name}_{place}", value))
        return found

    def _coefficient(self, name, q_square, bend) -> Word:
        """``Q (1 - bend)``."""
        g = self._graph
        product = g.multiply(f"{name}_bend_product", q_square, bend)
        value = g.register(f"{name}_coefficient_exact", lambda q, product: q - product, q_square, product)
        return self._word(f"{name}_coefficient", value)

    def _steps(self, length: Word) -> tuple[Word, Word, Word, Word]:
        """Words of ``1/(m-1)`` and its square, and their shifts."""
        g, p = self._graph, self.parameters
        top, bits = LENGTH_BITS - 1, p.WORD_FORMAT.width

        def position(steps):
            place = Const(0, 4)
            for bit in range(LENGTH_BITS):
                place = Mux(steps[bit], bit, place)
            return place

        def part(entry, start):
            return FixedValue(p.WORD_FORMAT, entry[start : start + bits])

        steps = g.register("steps", lambda length: (length - 1)[:LENGTH_BITS], length)
        place = g.register("position", position, steps)
        address = g.register("address", lambda steps, place: (steps << (top - place)[:4])[:top], steps, place)
        reciprocal, square, small = (
            word.codes if isinstance(word, Fixed) else word for word in p.reciprocals
        )
        words = (small << 2 * bits | square << bits | reciprocal).tolist()
        read = g.look_up("reciprocals", words, 2 * bits + 1, address)
        entry = g.register("reciprocal_entry", lambda word: word, read)
        shift = g.register("place_shift", lambda place, address: (place + address.any())[:4], place, address)
        square_shift = g.register(
            "square_shift", lambda entry, shift: Cat(entry[2 * bits], shift), entry, shift
        )
        return (
            g.register("reciprocal", lambda entry: part(entry, 0), entry),
            g.register("reciprocal_square", lambda entry: part(entry, bits), entry),
            shift,
            square_shift,
        )
