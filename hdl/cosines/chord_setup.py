"""Chord setup unit: forward differences of N·L and half the squared chord, from three values of a span."""

from amaranth.hdl import Cat, Const, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.number.fixed import SQ, Format
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.dataflow import Dataflow, FunctionalUnit
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.reciprocal import checked_length_bits, reciprocal_words, square_words
from blysk.hdl.core.word import Word

__all__ = [
    "ChordSetupUnit",
    "chord_differences_shape",
    "light_values_shape",
    "span_factors_shape",
    "span_operands_shape",
    "span_values_shape",
]


def light_values_shape(lights: int, *, highlights: bool = True) -> data.ArrayLayout:
    """Shape of N·L and u of each light at one place.

    Parameters
    ----------
    lights : int
        Number of lights.
    highlights : bool
        Whether there is specular light, and so u.
    """
    light = {"diffuse": FixedShape(ChordSetup.DIFFUSE_FORMAT)}
    if highlights:
        light["highlight"] = FixedShape(ChordSetup.HIGHLIGHT_FORMAT)
    return data.ArrayLayout(data.StructLayout(light), lights)


def span_values_shape(lights: int, highlights: bool = True) -> data.ArrayLayout:
    """Shape of N·L and u of each light at the first pixel, in the middle and at the last pixel of a span."""
    light = {"diffuse": data.ArrayLayout(FixedShape(ChordSetup.DIFFUSE_FORMAT), 3)}
    if highlights:
        light["highlight"] = data.ArrayLayout(FixedShape(ChordSetup.HIGHLIGHT_FORMAT), 3)
    return data.ArrayLayout(data.StructLayout(light), lights)


def span_factors_shape(factors: int) -> data.ArrayLayout:
    """Shape of the factors of fading lights at the same three places, in the format of N·L."""
    return data.ArrayLayout(data.ArrayLayout(FixedShape(ChordSetup.DIFFUSE_FORMAT), 3), factors)


def span_operands_shape(
    lights: int, highlights: bool = True, length_bits: int = LENGTH_BITS, factors: int = 0
) -> data.StructLayout:
    """Shape of a span: `span_values_shape`, with factors also `span_factors_shape`, and the length."""
    members: dict = {"values": span_values_shape(lights, highlights)}
    if factors:
        members["factors"] = span_factors_shape(factors)
    return data.StructLayout(members | {"length": unsigned(length_bits)})


def chord_differences_shape(
    lights: int, highlights: bool = True, model: ChordSetup | None = None, factors: int = 0
) -> data.StructLayout:
    """Shape of a span's differences for N·L and u of each light and for factors, and ``out_of_range``."""
    format = (model or ChordSetup()).format
    names = ("diffuse", "highlight") if highlights else ("diffuse",)
    differences = data.StructLayout({"first": FixedShape(format), "second": FixedShape(format)})
    members: dict = {"lights": data.ArrayLayout(data.StructLayout(dict.fromkeys(names, differences)), lights)}
    if factors:
        members["factors"] = data.ArrayLayout(differences, factors)
    return data.StructLayout(members | {"out_of_range": unsigned(1)})


class ChordSetupUnit(PipelinedUnit):
    """Differences of ``f = N·L`` and ``u = |N - H|^2 / 2`` along a span, from three values of each.

    `ChordSetup`, the bit-accurate model, has formats and error bounds.

    A span has one product for its step, 3 for each u (with highlights), 2 for each f and 2 for each factor.
    The products share multipliers of 18x18 bits. For one light and an initiation interval of 3 there are 2
    multipliers. The attribute ``multipliers`` is their number. Beats may come any number of cycles apart,
    from the interval on. A table of ``2^(length_bits - 1)`` words of 17 bits holds the reciprocals. The
    attribute ``latency`` depends on how the products share the multipliers.

    Parameters
    ----------
    model : ChordSetup
        Bit-accurate model.
    lights : int
        Number of lights, 1 or more.
    initiation_interval : int
        Cycles from an input to the next, at least 1.
    length_bits : int
        Bits of the length, 2 to 12. Spans have at most ``2^length_bits - 1`` pixels.
    highlights : bool
        Whether there are differences of u.
    factors : int
        Number of lights that fade.

    Raises
    ------
    ValueError
        If ``initiation_interval`` or ``length_bits`` is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"values": span_values_shape(...), "length": length_bits})))`
        Spans of length 1 or more. If lights fade, there is also ``factors``, `span_factors_shape`.
    o : :py:`Out(stream.Signature(chord_differences_shape(lights, highlights, model, factors)))`
        Differences. ``out_of_range``: P or G outgrows its word, and the differences are invalid.

    Source: docs/theory/chord.md#differences; [Lyon93].
    """

    def __init__(
        self,
        model: ChordSetup | None = None,
        lights: int = 1,
        *,
        initiation_interval: int = 3,
        length_bits: int = LENGTH_BITS,
        highlights: bool = True,
        factors: int = 0,
    ):
        self.model = model or ChordSetup()
        self.highlights = highlights
        self.lights = lights
        self.factors = factors
        self.length_bits = checked_length_bits(length_bits)
        self._graph = Dataflow(initiation_interval, spaced=True)
        self._shifters = shared_shifters(self._graph, self.model)
        self._results = self._describe()
        self.multipliers = self._graph.multiplier.count
        super().__init__(
            span_operands_shape(lights, highlights, length_bits, factors),
            chord_differences_shape(lights, highlights, self.model, factors),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
            spaced=True,
        )

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.model
        length = g.input("length", lambda operands: operands.length)
        steps = step_words(g, length, self.length_bits)
        functions = [("diffuse", p.DIFFUSE_SLOPE_FORMAT)]
        if self.highlights:
            functions.insert(0, ("highlight", p.SLOPE_FORMAT))
        quadratics = [(i, *function) for i in range(self.lights) for function in functions]
        quadratics += [(k, "factor", p.DIFFUSE_SLOPE_FORMAT) for k in range(self.factors)]
        results, flags = {}, []
        for i, function, slope_format in quadratics:
            slope, curvature = self._quadratic(i, function, slope_format, flags)
            words = difference_words(
                g,
                self._shifters,
                f"{function}_{i}",
                slope,
                curvature,
                steps,
                has_low=slope_format.width > p.HIGH_FORMAT.width,
                model=p,
            )
            results.update({(i, function, name): word for name, word in words.items()})
        results["out_of_range"] = g.register("out_of_range", lambda *flags: Cat(flags).any(), *flags)
        return results

    def _quadratic(self, i: int, function: str, slope_format: Format, flags: list[Word]):
        """Words of P and G of f, u or a. Adds to ``flags`` whether G, and whether P, is out of range."""
        g, p = self._graph, self.model
        name = f"{function}_{i}"
        values = g.input(
            name,
            lambda operands: operands.factors[i] if function == "factor" else operands["values"][i][function],
            {"diffuse": "f", "highlight": "u", "factor": "a"}[function],
        )
        ends = g.register(f"{name}_ends", lambda v: v[0] + v[2], values)
        rise = g.register(f"{name}_rise", lambda v: v[2] - v[0], values)
        exact = g.register(
            f"{name}_curvature_exact", lambda ends, v: (ends - v[1].scale(1)).scale(1), ends, values
        )
        exact = g.register(
            f"{name}_curvature_rounded", lambda x: x.round_half_up(p.CURVATURE_FORMAT.fraction_bits), exact
        )
        curvature = g.register(
            f"{name}_curvature", lambda x: x.saturate(p.CURVATURE_FORMAT), exact, formula="G"
        )
        flags.append(self._flag(f"{name}_curvature", exact, p.CURVATURE_FORMAT))
        exact = g.register(f"{name}_slope_exact", lambda a, b: a - b, rise, curvature)
        exact = g.register(
            f"{name}_slope_rounded", lambda x: x.round_half_up(slope_format.fraction_bits), exact
        )
        slope = g.register(f"{name}_slope", lambda x: x.saturate(slope_format), exact, formula="P")
        flags.append(self._flag(f"{name}_slope", exact, slope_format))
        return slope, curvature

    def _flag(self, name: str, exact: Word, format: Format) -> Word:
        """Whether a value is outside a signed format with the same fraction bits."""

        def exceeds(value):
            above = value.as_value()[format.width - 1 :]
            return above.any() & ~above.all()

        return self._graph.register(f"{name}_out_of_range", exceeds, exact)

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for index, light in enumerate(result.lights):
            for function in light.shape().members:
                for name in ("first", "second"):
                    word = self._results[index, function, name]
                    m.d.comb += light[function][name].eq(value(word, self.latency))
        for index in range(self.factors):
            for name in ("first", "second"):
                word = self._results[index, "factor", name]
                m.d.comb += result.factors[index][name].eq(value(word, self.latency))
        m.d.comb += result.out_of_range.eq(value(self._results["out_of_range"], self.latency))
        return result


def shared_shifters(graph: Dataflow, model: ChordSetup) -> FunctionalUnit:
    """Shifters of the differences. A quadratic uses them twice; see `difference_words`."""
    format = model.shifted_format

    def shift(register, value, amount):
        # Two stages shift. Then the result is rounded half up to the fraction bits of the differences.
        coarse = FixedValue(format, Value.cast(value) >> Cat(Const(0, 2), amount[2:]))
        coarse, fine = register(coarse, "coarse"), register(amount[:2], "fine_amount")
        shifted = register(FixedValue(format, Value.cast(coarse) >> fine), "shifted")
        return register(shifted.round_half_up(model.fraction_bits).wrap(model.format), "rounded")

    return graph.share("shifter", (FixedShape(format), unsigned(5)), 3, shift)


def step_words(
    graph: Dataflow, length: Word, length_bits: int = LENGTH_BITS
) -> tuple[Word, Word, Word, Word]:
    """Words of ``dt = 2 reciprocal 2^-shift`` and ``dt^2 = 4 square 2^-square_shift``: one multiplication.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    length : Word
        Length of the span, 1 or more.
    length_bits : int
        Bits of the length, 2 to 12.

    Returns
    -------
    reciprocal, shift, square, square_shift : Word
        As `ChordSetup.steps` gives them.
    """
    reciprocal, shift = reciprocal_words(graph, length, length_bits=length_bits)
    square = graph.multiply("square_exact", reciprocal, reciprocal, formula="dt²")
    return reciprocal, shift, *square_words(graph, square, shift)


def difference_words(
    graph: Dataflow,
    shifters: FunctionalUnit,
    name: str,
    slope: Word,
    curvature: Word,
    steps: tuple[Word, Word, Word, Word],
    has_low: bool,
    model: ChordSetup,
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
    slope, curvature : Word
        P and G.
    steps : tuple of Word
        Words of `step_words`.
    has_low : bool
        Whether P has more bits than a multiplier's operand, and is multiplied as two words.
    model : ChordSetup
        Bit-accurate model, with the formats.

    Returns
    -------
    dict of Word
        ``first`` and ``second``.
    """
    p = model
    reciprocal, shift, square, square_shift = steps

    def shifted(name, value, shift, scale, formula):
        # value 2^(scale - shift), rounded half up to the fraction bits of the differences.
        def operands(value, shift):
            value, format = value.scale(scale), p.shifted_format
            if value.format.fraction_bits > format.fraction_bits:
                value = value.truncate(format.fraction_bits)
            return value.extend(format), shift

        return graph.use(shifters, name, (value, shift), operands, formula=formula)

    def half(format, bits):
        return lambda slope: FixedValue(format, Value.cast(slope)[bits])

    if has_low:
        width = p.LOW_FORMAT.fraction_bits - p.HIGH_FORMAT.fraction_bits
        high = graph.multiply(
            f"{name}_high", slope, reciprocal, half(p.HIGH_FORMAT, slice(width, None)), formula="P_high·dt"
        )
        low = graph.multiply(
            f"{name}_low", slope, reciprocal, half(p.LOW_FORMAT, slice(width)), formula="P_low·dt"
        )
        product = graph.register(f"{name}_slope_product", lambda a, b: a + b, high, low)
    else:
        product = graph.multiply(f"{name}_slope_product", slope, reciprocal)
    first = shifted(f"{name}_first_order", product, shift, 1, "P·dt")
    product = graph.multiply(f"{name}_curvature_product", curvature, square)
    second = shifted(f"{name}_second_order", product, square_shift, 2, "G·dt²")
    return {
        "first": graph.register(f"{name}_first", lambda a, b: (a + b).wrap(p.format), first, second),
        "second": graph.register(
            f"{name}_second", lambda b: b.scale(1).extend(SQ(2, p.fraction_bits)).wrap(p.format), second
        ),
    }
