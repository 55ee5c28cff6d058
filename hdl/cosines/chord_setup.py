"""Chord setup: forward differences of N·L and of half the squared chord from N to H, for each span."""

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
    """Shape of a prepared span: start and differences of N·L and of u for each light; length; flag."""
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
    """A setup of differences, which reads its results from the words of a graph.

    A subclass sets ``_graph`` and ``_results``, a mapping of ``(light, function, name)``, ``length`` and
    ``out_of_range`` to words.
    """

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
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

    `ChordSetup` is the bit-accurate model; it has formats and error bounds.

    The 7 products of a span and the 19 of each light share ``ceil((7 + 19 lights) / I)`` multipliers of 18x18
    bits, I the initiation interval: 7 multipliers for one light and I = 4. Without highlights a light has 9
    products. A table of ``2^(length_bits - 1)`` words of 17 bits holds the reciprocals. The attribute
    ``latency`` depends on how the products share the multipliers.

    Parameters
    ----------
    parameters : ChordSetup
        Bit-accurate model: terms of the polynomial, one product a span each, and bits of the differences.
    lights : int
        Number of lights, 1 or more.
    initiation_interval : int
        Cycles from an input to the next, at least 1.
    length_bits : int
        Bits of the length, 2 to 12: spans have at most ``2^length_bits - 1`` pixels.
    highlights : bool
        Whether there are differences of u.

    Raises
    ------
    ValueError
        If ``initiation_interval`` or ``length_bits`` is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape()))`
        Spans; the length has ``length_bits`` bits and is at least 1.
    o : :py:`Out(stream.Signature(chord_differences_shape(lights, highlights, parameters)))`
        Starts and differences; the length; ``out_of_range``: the span is over 22.5 degrees, and its
        differences are invalid.
    constants : :py:`In(light_vectors_shape(lights))`
        Unit vectors L and H, constant while beats are inside.

    Source: docs/theory/chord.md#differences; [Lyon93].
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
                f"f_{i}_operand", lambda total: total.truncate(16).saturate(p.OPERAND_FORMAT), total
            )
            curvature = g.multiply(f"f_{i}_curvature_exact", e, operand)
            curvature = g.register(
                f"f_{i}_curvature_rounded", lambda product: (-product.scale(2)).round_half_up(20), curvature
            )
            curvature = g.register(
                f"f_{i}_curvature", lambda curvature: curvature.saturate(p.CURVATURE_FORMAT), curvature
            )
            rise = g.register(f"f_{i}_rise", lambda a, b: b - a, *f)
            slope = g.register(f"f_{i}_slope_exact", lambda a, b: a - b, rise, curvature)
            slope = g.register(
                f"f_{i}_slope", lambda slope: slope.round_half_up(18).wrap(p.HIGH_FORMAT), slope
            )
            self._differences(results, i, "diffuse", f[0], slope, curvature, steps)
        return results

    def _highlight(self, results, i: int, u: list[Word], e: Word, steps) -> None:
        """Add the differences of u of a light to the results."""
        g, p = self._graph, self.parameters
        two = FixedValue.constant(UQ(2, 35), 2)
        total = g.register(f"u_{i}_sum", lambda a, b: a + b, *u)
        operand = g.register(f"u_{i}_two_minus_sum", lambda total: two - total, total)
        operand = g.register(
            f"u_{i}_operand", lambda exact: exact.truncate(16).saturate(p.OPERAND_FORMAT), operand
        )
        curvature = g.multiply(f"u_{i}_curvature_exact", e, operand)
        curvature = g.register(
            f"u_{i}_curvature_rounded", lambda product: product.scale(2).round_half_up(20), curvature
        )
        curvature = g.register(
            f"u_{i}_curvature", lambda curvature: curvature.saturate(p.CURVATURE_FORMAT), curvature
        )
        rise = g.register(f"u_{i}_rise", lambda a, b: b - a, *u)
        slope = g.register(f"u_{i}_slope", lambda a, b: (a - b).wrap(p.SLOPE_FORMAT), rise, curvature)
        self._differences(results, i, "highlight", u[0], slope, curvature, steps)

    def _cosine(self, name: str, normal: Word, vector: Callable[[data.View], data.View]) -> Word:
        """Dot product of a normal and a constant vector, saturated."""
        total = dot(self._graph, name, normal, vector, self._sums)
        return self._graph.register(name, lambda total: total.saturate(self.parameters.COSINE_FORMAT), total)

    def _differences(self, results, i, function, start, slope, curvature, steps) -> None:
        """Add the differences of f or u of a light to the results."""
        words = difference_words(
            self._graph,
            self._shifter,
            f"{function}_{i}",
            start,
            slope,
            curvature,
            steps,
            function == "highlight",
            self.parameters,
        )
        results.update({(i, function, name): word for name, word in words.items()})


def shared_shifters(graph: Dataflow, uses: int, parameters: ChordSetup) -> FunctionalUnit:
    """Shifters for so many differences, two of each quadratic; see `difference_words`."""
    format = parameters.shifted_format

    def shift(register, value, amount):
        # Two stages of shift, then rounding half up to the fraction bits of the differences.
        coarse = FixedValue(format, Value.cast(value) >> Cat(Const(0, 2), amount[2:]))
        coarse, fine = register(coarse, "coarse"), register(amount[:2], "fine_amount")
        shifted = register(FixedValue(format, Value.cast(coarse) >> fine), "shifted")
        return register(shifted.round_half_up(parameters.fraction_bits).wrap(parameters.format), "rounded")

    return graph.share("shifter", uses, (FixedShape(format), unsigned(5)), 3, shift)


def step_words(
    graph: Dataflow, length: Word, length_bits: int = LENGTH_BITS
) -> tuple[Word, Word, Word, Word]:
    """Words of ``dt = 2 reciprocal 2^-shift`` and ``dt^2 = 4 square 2^-square_shift``: one multiplication.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    length : Word
        Pixels, 1 or more.
    length_bits : int
        Bits of the length, 2 to 12.

    Returns
    -------
    reciprocal, shift, square, square_shift : Word
        As `ChordSetup.steps` gives them.
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
    curvature: Word,
    steps: tuple[Word, Word, Word, Word],
    has_low: bool,
    parameters: ChordSetup,
) -> dict[str, Word]:
    """Words of the differences ``P dt + G dt^2`` and ``2 G dt^2``: two multiplications, or three.

    `ChordSetup.differences` is their bit-accurate model.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    shifters : FunctionalUnit
        Shifters of `shared_shifters`.
    name : str
        Common part of the words' names.
    start, slope, curvature : Word
        Value at t = 0, P and G.
    steps : tuple of Word
        Words of `step_words`.
    has_low : bool
        Whether P has more bits than a multiplier's operand, up to 35, and is multiplied in two words.
    parameters : ChordSetup
        Bit-accurate model, with the formats.

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
        product = graph.register(f"{name}_slope_product", lambda a, b: a + b.truncate(48), high, low)
    else:
        product = graph.multiply(f"{name}_slope_product", slope, reciprocal)
    first = shifted(f"{name}_first_order", product, shift, 1)
    product = graph.multiply(f"{name}_curvature_product", curvature, square)
    second = shifted(f"{name}_second_order", product, square_shift, 2)
    return {
        "start": start,
        "first": graph.register(f"{name}_first", lambda a, b: (a + b).wrap(p.format), first, second),
        "second": graph.register(
            f"{name}_second", lambda b: b.scale(1).extend(SQ(2, p.fraction_bits)).wrap(p.format), second
        ),
    }


def _constant(number: Fixed) -> FixedValue:
    return FixedValue.constant(number.format, number.values.item())
