"""Chord setup: forward differences of N·L and of half the squared chord from N to H, span by span."""

from collections.abc import Callable

from amaranth.hdl import Cat, Const, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.dataflow import Dataflow, FunctionalUnit, Word, dot, shared_sums
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.reciprocal import checked_length_bits, reciprocal_words, square_words
from blysk.hdl.core.shapes import light_vectors_shape, span_normals_shape
from blysk.hdl.core.stream import PipelinedUnit
from blysk.hdl.cosines.chord import chord

__all__ = [
    "ChordDifferencesUnit",
    "ChordSetupUnit",
    "chord_differences_shape",
    "difference_words",
    "shared_shifters",
    "step_words",
]


def chord_differences_shape(
    lights: int, highlights: bool = True, parameters: ChordSetup | None = None
) -> data.StructLayout:
    """Shape of a prepared span: start and differences of N·L and of u for each light, and the length."""
    p = parameters or ChordSetup()

    def differences(start):
        return data.StructLayout(
            {"start": FixedShape(start), "first": FixedShape(p.format), "second": FixedShape(p.format)}
        )

    light = {"diffuse": differences(p.COSINE_FORMAT)}
    if highlights:
        light["highlight"] = differences(p.CHORD_FORMAT)
    return data.StructLayout(
        {
            "lights": data.ArrayLayout(data.StructLayout(light), lights),
            "length": unsigned(LENGTH_BITS),
            "out_of_range": unsigned(1),
        }
    )


class ChordDifferencesUnit(PipelinedUnit):
    """What two setups share: their results, by name, from the words of a graph.

    A subclass sets ``_graph`` and ``_results``: words by ``(light, function, name)``, ``length``,
    ``out_of_range``.
    """

    def datapath(self, m, operands):
        """The graph, read at the age of its last words."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for index, light in enumerate(result.lights):
            for function in light.shape().members:
                for name in ("start", "first", "second"):
                    word = self._results[index, function, name]
                    m.d.comb += light[function][name].eq(value(word, self.latency))
        for name in ("length", "out_of_range"):
            m.d.comb += result[name].eq(value(self._results[name], self.latency))
        return result


class ChordSetupUnit(ChordDifferencesUnit):
    """Differences of ``f = N·L`` and ``u = |N - H|^2 / 2`` along a span, for each light.

    Formats and error bounds are those of `ChordSetup`, the bit-true twin.

    The 7 products of a span and the 19 of each light take turns at ``ceil((7 + 19 lights) / I)`` multipliers
    of 18x18 bits, I the initiation interval: 7 for one light and an interval of 4. Without highlights there
    are 9 products a light. A table of ``2^(length_bits - 1)`` words of 17 bits holds the reciprocals. The
    latency, `latency`, follows from the turns.

    Parameters
    ----------
    parameters : ChordSetup
        Terms of the polynomial, each of which is a product of a span, and bits of the differences.
    lights : int
        Number of lights, 1 or more.
    initiation_interval : int
        Distance in cycles of two inputs, at least 1.
    length_bits : int
        Bits of the length, 2 to 12: spans have at most ``2^length_bits - 1`` pixels.
    highlights : bool
        Whether there is u.

    Raises
    ------
    ValueError
        If `initiation_interval` or `length_bits` is none of those.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape()))`
        Spans; their length has `length_bits` bits and is at least 1.
    o : :py:`Out(stream.Signature(chord_differences_shape(lights, highlights, parameters)))`
        Starts and differences; the length; ``out_of_range``: the span is over 22.5 degrees and they mean
        nothing.
    constants : :py:`In(light_vectors_shape(lights))`
        Unit vectors L and H; stay while beats are inside.

    Source: chord.md.
    """

    def __init__(
        self,
        parameters: ChordSetup | None = None,
        lights: int = 1,
        *,
        initiation_interval: int = 4,
        length_bits: int = LENGTH_BITS,
        highlights: bool = True,
    ):
        self.parameters = p = parameters or ChordSetup()
        self.highlights = highlights
        self.lights = lights
        self.length_bits = checked_length_bits(length_bits)
        of_a_light = 19 if highlights else 9
        self._graph = Dataflow(initiation_interval, 4 + p.terms + of_a_light * lights)
        self.multipliers = self._graph.multiplier.count
        self._shifter = shared_shifters(self._graph, (4 if highlights else 2) * lights, p)
        self._sums = shared_sums(self._graph, 2 * lights, COMPONENT * COMPONENT)
        self._results = self._describe()
        super().__init__(
            span_normals_shape(length_bits),
            chord_differences_shape(lights, highlights, p),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
            constants=light_vectors_shape(lights),
        )

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.parameters
        left, right = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in ("normal_left", "normal_right")
        )
        length = g.input("length", lambda operands: operands.length)
        results = {"length": length}

        rounded = g.register("w_rounded", lambda w: w.round_half_up(20), chord(g, "span", right, left))
        w = g.register("w", lambda w: w.saturate(p.ANGLE_FORMAT), rounded)
        results["out_of_range"] = g.register("out_of_range", lambda w: w > _constant(p.widest), w)
        steps = step_words(g, length, self.length_bits)
        products = {}
        for i in range(self.lights):
            u = [
                chord(g, f"u_{i}_{side}", n, lambda i=i: self.constants[i].halfway)
                for side, n in (("left", left), ("right", right))
                if self.highlights
            ]
            f = [
                self._cosine(f"f_{i}_{side}", n, lambda _, i=i: self.constants[i].direction)
                for side, n in (("left", left), ("right", right))
            ]
            products[i] = u, f
        *lower, highest = (_constant(p.coefficients[k]) for k in range(p.terms))
        total = g.multiply(f"product_{p.terms}", w, w, right=lambda _: highest)
        for power in reversed(range(1, p.terms)):
            total = g.register(
                f"horner_{power}",
                lambda product, c=lower[power - 1]: (product.round_half_up(19) + c).wrap(p.SUM_FORMAT),
                total,
            )
            total = g.multiply(f"product_{power}", w, total)
        e = g.register("e_rounded", lambda product: product.round_half_up(23), total)
        e = g.register("e", lambda e: e.saturate(p.FACTOR_FORMAT), e)

        for i, (u, f) in products.items():
            if u:
                self._highlight(results, i, u, e, steps)
            total = g.register(f"f_{i}_sum", lambda a, b: a + b, *f)
            operand = g.register(
                f"f_{i}_along", lambda total: total.truncate(16).saturate(p.OPERAND_FORMAT), total
            )
            bend = g.multiply(f"f_{i}_bend", e, operand)
            bend = g.register(
                f"f_{i}_bend_rounded", lambda product: (-product.scale(2)).round_half_up(20), bend
            )
            bend = g.register(f"f_{i}_bend_word", lambda bend: bend.saturate(p.BEND_FORMAT), bend)
            rise = g.register(f"f_{i}_rise", lambda a, b: b - a, *f)
            slope = g.register(f"f_{i}_slope_exact", lambda rise, bend: rise - bend, rise, bend)
            slope = g.register(
                f"f_{i}_slope", lambda slope: slope.round_half_up(18).wrap(p.HIGH_FORMAT), slope
            )
            self._differences(results, i, "diffuse", f[0], slope, bend, steps)
        return results

    def _highlight(self, results, i: int, u: list[Word], e: Word, steps) -> None:
        g, p = self._graph, self.parameters
        two = FixedValue.constant(UQ(2, 35), 2)
        total = g.register(f"u_{i}_sum", lambda a, b: a + b, *u)
        across = g.register(f"u_{i}_rest", lambda total: two - total, total)
        operand = g.register(
            f"u_{i}_across", lambda rest: rest.truncate(16).saturate(p.OPERAND_FORMAT), across
        )
        bend = g.multiply(f"u_{i}_bend", e, operand)
        bend = g.register(f"u_{i}_bend_rounded", lambda product: product.scale(2).round_half_up(20), bend)
        bend = g.register(f"u_{i}_bend_word", lambda bend: bend.saturate(p.BEND_FORMAT), bend)
        rise = g.register(f"u_{i}_rise", lambda a, b: b - a, *u)
        slope = g.register(f"u_{i}_slope", lambda rise, bend: (rise - bend).wrap(p.SLOPE_FORMAT), rise, bend)
        self._differences(results, i, "highlight", u[0], slope, bend, steps)

    def _cosine(self, name: str, normal: Word, vector: Callable[[data.View], data.View]) -> Word:
        total = dot(self._graph, name, normal, vector, self._sums)
        return self._graph.register(name, lambda total: total.saturate(self.parameters.COSINE_FORMAT), total)

    def _differences(self, results, i, function, start, slope, bend, steps) -> None:
        words = difference_words(
            self._graph,
            self._shifter,
            f"{function}_{i}",
            start,
            slope,
            bend,
            steps,
            function == "highlight",
            self.parameters,
        )
        results.update({(i, function, name): word for name, word in words.items()})


def shared_shifters(graph: Dataflow, uses: int, parameters: ChordSetup) -> FunctionalUnit:
    """What shifts for so many differences, two of each quadratic; see `difference_words`."""
    format = parameters.shifted_format

    def shift(register, value, amount):
        # In two stages, then rounded half up to the fraction bits of the differences.
        coarse = FixedValue(format, Value.cast(value) >> Cat(Const(0, 2), amount[2:]))
        coarse, fine = register(coarse, "coarse"), register(amount[:2], "fine_amount")
        shifted = register(FixedValue(format, Value.cast(coarse) >> fine), "shifted")
        return register(shifted.round_half_up(parameters.fraction_bits).wrap(parameters.format), "rounded")

    return graph.share("shifter", uses, (FixedShape(format), unsigned(5)), 3, shift)


def step_words(
    graph: Dataflow, length: Word, length_bits: int = LENGTH_BITS
) -> tuple[Word, Word, Word, Word]:
    """``dt = 2 reciprocal 2^-shift`` and ``dt^2 = 4 square 2^-shift``, with their shifts: one multiplication.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    length : Word
        Pixels, 1 or more.
    length_bits : int
        Bits of the length, 2 to 12.
    """
    reciprocal, shift = reciprocal_words(graph, length, length_bits=length_bits)
    square = graph.multiply("square_exact", reciprocal, reciprocal)
    return reciprocal, shift, *square_words(graph, square, shift)


def difference_words(
    graph: Dataflow,
    shifters: FunctionalUnit,
    name: str,
    start: Word,
    slope: Word,
    bend: Word,
    steps: tuple[Word, Word, Word, Word],
    has_low: bool,
    parameters: ChordSetup,
) -> dict[str, Word]:
    """Differences of `ChordSetup.differences`: two multiplications, or three.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    shifters : Operator
        From `shared_shifters`.
    name : str
        Of the words.
    start, slope, bend : Word
        Value at t = 0, P and G.
    steps : four of Word
        From `step_words`.
    has_low : bool
        Whether P has more bits than a multiplier's operand, to 35, and is multiplied in two words.
    parameters : ChordSetup
        Formats.

    Returns
    -------
    dict of Word
        ``start``, ``first`` and ``second``.
    """
    p = parameters
    reciprocal, shift, square, square_shift = steps

    def shifted(name, value, shift, scale):
        # value 2^(scale - shift), rounded half up to the fraction bits of the differences.
        def operands(value, shift):
            value, format = value.scale(scale), p.shifted_format
            if value.format.fraction_bits > format.fraction_bits:
                value = value.truncate(format.fraction_bits)
            return value.extend(format), shift

        return graph.use(shifters, name, (value, shift), operands)

    def half(format, bits):
        return lambda slope: FixedValue(format, Value.cast(slope.extend(p.SLOPE_FORMAT))[bits])

    if has_low:
        width = p.LOW_FORMAT.width
        high = graph.multiply(f"{name}_high", slope, reciprocal, half(p.HIGH_FORMAT, slice(width, None)))
        low = graph.multiply(f"{name}_low", slope, reciprocal, half(p.LOW_FORMAT, slice(width)))
        along = graph.register(f"{name}_along", lambda high, low: high + low.truncate(48), high, low)
    else:
        along = graph.multiply(f"{name}_along", slope, reciprocal)
    first = shifted(f"{name}_first_order", along, shift, 1)
    across = graph.multiply(f"{name}_across", bend, square)
    second = shifted(f"{name}_second_order", across, square_shift, 2)
    return {
        "start": start,
        "first": graph.register(f"{name}_first", lambda a, b: (a + b).wrap(p.format), first, second),
        "second": graph.register(
            f"{name}_second", lambda b: b.scale(1).extend(SQ(2, p.fraction_bits)).wrap(p.format), second
        ),
    }


def _constant(number: Fixed) -> FixedValue:
    return FixedValue.constant(number.format, number.values.item())
