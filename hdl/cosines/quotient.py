"""Quotient unit: N·L and the place of the squared sine, by one reciprocal root for each pixel."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value
from amaranth.lib import data

from blysk.golden.cosines.quotient import OCTAVES, Quotient
from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.number.fixed import UQ
from blysk.hdl.core.bits import leading_zeros, select
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.word import Word

_FRACTION, _NUMERATOR = UQ(0, 12), UQ(0, 17)
"""Formats of the place within a step of the table, and of the numerator."""

_CUT = Quotient.COSINE_FORMAT.fraction_bits

__all__ = ["QuotientUnit", "pixel_words_shape", "quotients_shape"]


def pixel_words_shape(spans: QuotientSpans) -> data.StructLayout:
    """Shape of the words of a pixel: m, w, l and ``z < 0``, and a bit that alternates from span to span.

    `QuotientSpans` defines m, w, l and z.

    Parameters
    ----------
    spans : QuotientSpans
        The words of a span: lights, highlights, mirror.
    """
    square, line = (FixedShape(format) for format in (spans.square_format, spans.LINE_FORMAT))
    members = {"rest": square, "line": data.ArrayLayout(line, spans.lights), "span": 1}
    if spans.highlights:
        members["numerator"] = data.ArrayLayout(square, spans.lights)
    if spans.takes_heights:
        members["away"] = spans.lights
    return data.StructLayout(members)


def quotients_shape(model: Quotient) -> data.StructLayout:
    """Shape of a result: N·L and a place for each light, ``out_of_range``, and ``span``, the pixel's bit.

    Parameters
    ----------
    model : Quotient
        Bit-accurate model, with the formats.
    """
    light = {"cosine": FixedShape(model.COSINE_FORMAT)}
    if model.spans.highlights:
        light["highlight"] = FixedShape(model.place_format)
    lights = data.ArrayLayout(data.StructLayout(light), model.spans.lights)
    return data.StructLayout({"lights": lights, "out_of_range": 1, "span": 1})


class QuotientUnit(PipelinedUnit):
    """Operands of every light: ``N·L = l/sqrt(q)``, and the place of ``s = m/q`` in a lobe's table.

    `Quotient`, the bit-accurate model, has formats, table and error bounds.

    One product makes the reciprocal root r from the table, and one makes r^2. Each light has a product for
    N·L and a product for s. Without highlights there is no r^2, and no s. With an initiation interval of 1
    each product has a multiplier. With a longer interval the products share
    ``ceil((2 + 2 lights) / initiation_interval)`` multipliers, without highlights
    ``ceil((1 + lights) / initiation_interval)``. The latency follows from the graph. At intervals of 1 to 5
    it is 16, 22, 21, 24, 25 cycles with one light, and 16, 22, 22, 23, 21 cycles with two lights. Without
    highlights it is 10 at an interval of 1.

    Parameters
    ----------
    model : Quotient
        Bit-accurate model.
    initiation_interval : int
        Cycles from an input to the next, at least 1.
    memories : bool
        Whether words that wait for some cycles are in memories of look-up tables. If not, they are in
        flip-flops. Only at an interval of 1.

    Members
    -------
    i : :py:`In(stream.Signature(pixel_words_shape(model.spans)))`
        Words of a pixel.
    o : :py:`Out(stream.Signature(quotients_shape(model)))`
        Operands of each light. ``out_of_range``: q is too small, and the operands are invalid.

    Source: docs/theory/quotient.md#pixel.
    """

    def __init__(self, model: Quotient | None = None, initiation_interval: int = 1, memories: bool = True):
        self.model = p = model or Quotient()
        self._graph = Dataflow(initiation_interval, memories=memories)
        self._results = self._describe()
        super().__init__(
            pixel_words_shape(p.spans),
            quotients_shape(p),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        at = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        m.d.comb += [result.span.eq(at(self._results["span"], self.latency))]
        m.d.comb += result.out_of_range.eq(at(self._results["out_of_range"], self.latency))
        for light, found in enumerate(result.lights):
            for name in ("cosine", "highlight")[: 1 + self.model.spans.highlights]:
                m.d.comb += found[name].eq(at(self._results[f"{name}_{light}"], self.latency))
        return result

    def _product(self, name: str, a: Word, b: Word, left=lambda x: x, right=lambda x: x) -> Word:
        """Product, with registers that the multiplier block can take in."""
        g = self._graph
        if g.interval > 1:
            return g.multiply(name, a, b, left, right)
        a, b = g.register(f"{name}_a", left, a), g.register(f"{name}_b", right, b)
        return g.register(name, lambda x, y: x * y, a, b)

    def _describe(self) -> dict[str, Word]:
        """All words, from the words of a pixel to the results."""
        p, g, spans = self.model, self._graph, self.model.spans
        rest = g.input("rest", lambda operands: operands.rest, "w")
        span = g.input("span", lambda operands: operands.span)
        numerators = [
            g.input(f"numerator_{k}", lambda operands, k=k: operands.numerator[k], "m")
            for k in range(spans.lights * spans.highlights)
        ]

        def whole(code):
            return Value.cast(code.truncate(34))

        def squared(rest, *numerator):
            return sum((whole(code) for code in numerator), whole(rest))[:36]

        square = g.register("square", squared, rest, *numerators[:1], formula="q = m + w")
        shift = g.register(
            "shift", lambda q: leading_zeros(Cat(q[2 * k : 2 * k + 2].any() for k in range(11, 18))), square
        )
        too_small = g.register("too_small", lambda q: ~q[20:].any(), square)

        def shifted(square, shift):
            padded = Cat(Const(0, 2 * p.SHIFTS), square)
            return select([padded[29 - 2 * k : 50 - 2 * k] for k in range(p.SHIFTS + 1)], shift)

        normal = g.register("normal", shifted, square, shift, formula="2^2k·q")
        root = self._root(normal)
        results = {}
        for k in range(spans.lights):
            line = g.input(f"line_{k}", lambda operands, k=k: operands.line[k], "l")

            def shifted_line(line, shift):
                padded = Cat(Const(0, p.SHIFTS), Value.cast(line))
                first = p.SHIFTS + spans.LINE_FORMAT.width - p.LINE_FORMAT.width
                words = [padded[first - n :][: p.LINE_FORMAT.width] for n in range(p.SHIFTS + 1)]
                return FixedValue(p.LINE_FORMAT, select(words, shift))

            normal_line = g.register(f"normal_line_{k}", shifted_line, line, shift, formula="2^k·l")
            cosine = self._product(f"cosine_{k}", normal_line, root)
            results[f"cosine_{k}"] = g.wire(f"cut_{k}", lambda x: x.truncate(_CUT), cosine)
        marks, compared = {"span": span, "out_of_range": too_small}, []
        for k in range(spans.lights * spans.highlights):
            compared.append(self._compare(k, numerators, rest))
            if not spans.mirror:
                marks[f"second_{k}"] = compared[-1][1]
                marks[f"away_{k}"] = g.input(f"away_{k}", lambda operands, k=k: operands.away[k], "z < 0")
        # All bits that are needed at the end wait together in one word.
        together = g.register("marks", lambda *bits: Cat(bits), *marks.values())
        marks = {
            name: g.wire(f"mark_{name}", lambda bits, place=place: bits[place], together)
            for place, name in enumerate(marks)
        }
        if spans.highlights:
            square_root = self._product("square_root", root, root)
            for k, (chosen, _) in enumerate(compared):
                further = [marks[f"{name}_{k}"] for name in ("second", "away") if not spans.mirror]
                results[f"highlight_{k}"] = self._place(k, chosen, shift, square_root, further)
        return results | {name: marks[name] for name in ("span", "out_of_range")}

    def _root(self, normal: Word) -> Word:
        """Word of r, from the shifted word of q."""
        p, g = self.model, self._graph
        bits = p.BASE_FORMAT.width + p.SLOPE_FORMAT.width
        fraction_bits = 21 - p.TABLE_BITS
        base, slope = (word.codes for word in p.table)
        words = [int(b) | int(s) << p.BASE_FORMAT.width for b, s in zip(base, slope, strict=True)]
        address = g.wire("address", lambda normal: normal[fraction_bits:], normal)
        entry = g.look_up("roots", words, bits, address, registered=True)
        fraction = g.wire("fraction", lambda normal: normal[:fraction_bits], normal, "f")

        def as_slope(word):
            return FixedValue(p.SLOPE_FORMAT, word[p.BASE_FORMAT.width :])

        def as_fraction(fraction):
            return FixedValue(_FRACTION, fraction)

        bend = self._product("bend", entry, fraction, as_slope, as_fraction)

        def rounded(word, bend):
            base = FixedValue(p.BASE_FORMAT, word[: p.BASE_FORMAT.width])
            root = (base - bend.truncate(p.BASE_FORMAT.fraction_bits)).truncate(p.ROOT_FORMAT.fraction_bits)
            return root.wrap(p.ROOT_FORMAT)

        return g.register("root", rounded, entry, bend, formula="r")

    def _compare(self, light: int, numerators: list[Word], rest: Word) -> tuple[Word, Word | None]:
        """The smaller of m and w of a light, and whether this is w. For R·V it is always m."""
        p, g, mirror = self.model, self._graph, self.model.spans.mirror
        numerator, name = numerators[light], f"{light}"
        cut, width = p.PIXEL_FRACTION, p.PIXEL_FRACTION + 2
        if light:

            def sum_of(numerator, rest):
                return numerator.truncate(cut) + rest.truncate(cut)

            def rest_of(total, numerator):
                return total - numerator.truncate(cut)

            total = g.register(f"total_{name}", sum_of, numerators[0], rest, formula="q")
            rest = g.register(f"rest_{name}", rest_of, total, numerator, formula="q − m")

        def code(word):
            # Two integer bits: the sign and one more.
            return Value.cast(word.truncate(cut))[:width].as_signed()

        def positive(word):
            return Mux(word[width - 1], 0, word[: width - 1])[: width - 1]

        if mirror:
            return g.register(f"chosen_{name}", lambda m: positive(code(m)), numerator, formula="m"), None
        first = width - p.COMPARED

        def is_larger(m, w):
            # The sign of a difference is the end of its carry chain. A comparison would add logic
            # behind the carries.
            return (code(w)[first:].as_signed() - code(m)[first:].as_signed())[p.COMPARED]

        second = g.register(f"second_{name}", is_larger, numerator, rest, formula="m > w")
        chosen = g.register(
            f"chosen_{name}",
            lambda m, w, second: positive(Mux(second, code(w), code(m))),
            numerator,
            rest,
            second,
            formula="min(m, w)",
        )
        return chosen, second

    def _place(self, light: int, chosen: Word, shift: Word, square_root: Word, marks: list[Word]) -> Word:
        """Word of the place of a light. ``marks`` are the part and ``z < 0``; for R·V there are no marks."""
        p, g, mirror = self.model, self._graph, self.model.spans.mirror
        width, name = p.PIXEL_FRACTION + 2, f"{light}"

        def group_of(chosen):
            word = Cat(chosen, Const(0, 1))[width - 4 * p.GROUPS :]
            return leading_zeros(Cat(word[4 * k : 4 * k + 4].any() for k in range(p.GROUPS)))

        group = g.register(f"group_{name}", group_of, chosen)

        def grouped(chosen, group):
            padded = Cat(Const(0, 4 * p.GROUPS), chosen, Const(0, 1))
            first = 4 * p.GROUPS + width - 17
            words = [padded[first - 4 * n :][:17] for n in range(p.GROUPS + 1)]
            return FixedValue(_NUMERATOR, select(words, group))

        operand = g.register(f"grouped_{name}", grouped, chosen, group)
        octave = g.register(
            f"octave_{name}",
            lambda group, shift: (Cat(Const(0, 2), group) - Cat(Const(0, 1), shift) - 2)[:6].as_signed(),
            group,
            shift,
        )

        def squared(word):
            return word.truncate(p.SQUARE_ROOT_FORMAT.fraction_bits).wrap(p.SQUARE_ROOT_FORMAT)

        product = self._product(f"sine_{name}", operand, square_root, right=squared)
        zeros = g.register(f"zeros_{name}", lambda s: leading_zeros(Value.cast(s)[27:34]), product)

        def mantissa(product, zeros):
            padded = Cat(Const(0, 7), Value.cast(product))
            return select([padded[7 + 17 - n :][:17] for n in range(8)], zeros)

        mantissa = g.register(f"mantissa_{name}", mantissa, product, zeros)
        octaves = g.register(
            f"octaves_{name}", lambda octave, zeros: (octave + zeros)[:6].as_signed(), octave, zeros
        )

        def row(octaves, away=0):
            # From OCTAVES = 15 on, below the octaves of the table, the leading 1 is a part of the position.
            # The largest octave is 4 GROUPS + 5.
            under = ~octaves[5] & (octaves[4] | octaves[:4].all())
            low = Mux(under, octaves[:4] - (OCTAVES - 1), 0)[:4]
            past = octaves[5] | (~octaves.any() if mirror else away)
            return Cat(low, Mux(under, 0, ~octaves[:4])[:4], past)

        def place(mantissa, row, second=0):
            low, row, past = row[:4], row[4:8], row[8]
            inside = (mantissa >> low)[:16], row, second
            return FixedValue(p.place_format, Cat(Mux(past, 0, Cat(inside[: 3 - mirror])), past))

        second, away = marks[:1], marks[1:]
        row = g.register(f"row_{name}", row, octaves, *away)
        return g.register(f"place_{name}", place, mantissa, row, *second)
