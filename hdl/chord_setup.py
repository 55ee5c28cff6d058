"""Chord setup: forward differences of N·L and of half the squared chord from N to H, span by span."""

from collections.abc import Callable

from amaranth.hdl import Cat, Const, Signal, Value, unsigned
from amaranth.lib import data

from golden.chord_setup import ChordSetup
from golden.difference_setup import LENGTH_BITS
from golden.fixed import SQ, UQ, Fixed
from golden.unit_vector import COMPONENT

from .chord import chord
from .dataflow import Dataflow, Word, dot, shared_sums
from .difference_setup import checked_length_bits, reciprocal_words, square_words
from .fixed import FixedShape, FixedValue
from .interpolator import light_vectors_shape, span_normals_shape
from .stream import PipelinedUnit

__all__ = ["ChordSetupUnit", "chord_differences_shape"]


def chord_differences_shape(lights: int) -> data.StructLayout:
    """Shape of a prepared span: start and differences of N·L and of u for each light, and the length."""
    p = ChordSetup

    def differences(start):
        return data.StructLayout(
            {"start": FixedShape(start), "first": FixedShape(p.FORMAT), "second": FixedShape(p.FORMAT)}
        )

    light = {"diffuse": differences(p.COSINE_FORMAT), "highlight": differences(p.CHORD_FORMAT)}
    return data.StructLayout(
        {
            "lights": data.ArrayLayout(data.StructLayout(light), lights),
            "length": unsigned(LENGTH_BITS),
            "wide": unsigned(1),
        }
    )


class ChordSetupUnit(PipelinedUnit):
    """Differences of ``f = N·L`` and ``u = |N - H|^2 / 2`` along a span, for each light.

    Formats and error bounds are those of `golden.chord_setup.ChordSetup`, the bit-true twin.

    The 7 products of a span and the 19 of each light take turns at ``ceil((7 + 19 lights) / I)`` multipliers
    of 18x18 bits, I the initiation interval: 7 for one light and an interval of 4. A table of
    ``2^(length_bits - 1)`` words of 17 bits holds the reciprocals. The latency, `latency`, follows from the
    turns.

    Parameters
    ----------
    lights : int
        Number of lights, 1 or more.
    initiation_interval : int
        Distance in clocks of two inputs, at least 1.
    length_bits : int
        Bits of the length, 2 to 12: spans have at most ``2^length_bits - 1`` pixels.

    Raises
    ------
    ValueError
        If `initiation_interval` or `length_bits` is none of those.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape()))`
        Spans; their length has `length_bits` bits and is at least 1.
    o : :py:`Out(stream.Signature(chord_differences_shape(lights)))`
        Starts and differences; the length; ``wide``: the span is over 22.5 degrees and they mean nothing.
    constants : :py:`In(light_vectors_shape(lights))`
        Unit vectors L and H; stay while beats are inside.

    Source: chord.md.
    """

    def __init__(self, lights: int = 1, initiation_interval: int = 4, length_bits: int = LENGTH_BITS):
        self.parameters = ChordSetup()
        self.lights = lights
        self.length_bits = checked_length_bits(length_bits)
        self._graph = Dataflow(initiation_interval, 7 + 19 * lights)
        self.multipliers = self._graph.multiplier.count
        self._shifter = self._graph.share(
            "shifter", 4 * lights, (FixedShape(_SHIFTED), unsigned(5)), 3, _shift
        )
        self._sums = shared_sums(self._graph, 2 * lights, COMPONENT * COMPONENT)
        self._results = self._describe()
        super().__init__(
            data.StructLayout({**span_normals_shape().members, "length": unsigned(length_bits)}),
            chord_differences_shape(lights),
            latency=max(word.age for word in self._results.values()),
            initiation_interval=initiation_interval,
            constants=light_vectors_shape(lights),
        )

    def datapath(self, m, operands):
        """The graph, read at the age of its last words."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for index, light in enumerate(result.lights):
            for function in ("diffuse", "highlight"):
                for name in ("start", "first", "second"):
                    word = self._results[index, function, name]
                    m.d.comb += light[function][name].eq(value(word, self.latency))
        for name in ("length", "wide"):
            m.d.comb += result[name].eq(value(self._results[name], self.latency))
        return result

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
        results["wide"] = g.register("wide", lambda w: w > _constant(p.widest), w)
        steps = self._steps(length)
        products = {}
        for i in range(self.lights):
            u = [
                chord(g, f"u_{i}_{side}", n, lambda i=i: self.constants[i].halfway)
                for side, n in (("left", left), ("right", right))
            ]
            f = [
                self._cosine(f"f_{i}_{side}", n, lambda _, i=i: self.constants[i].direction)
                for side, n in (("left", left), ("right", right))
            ]
            products[i] = u, f
        c1, c2, c3 = (_constant(p.coefficients[k]) for k in range(3))
        total = g.multiply("product_3", w, w, right=lambda _: c3)
        for power, coefficient in ((2, c2), (1, c1)):
            total = g.register(
                f"horner_{power}",
                lambda product, c=coefficient: (product.round_half_up(19) + c).wrap(p.SUM_FORMAT),
                total,
            )
            total = g.multiply(f"product_{power}", w, total)
        e = g.register("e_rounded", lambda product: product.round_half_up(23), total)
        e = g.register("e", lambda e: e.saturate(p.FACTOR_FORMAT), e)

        two = FixedValue.constant(UQ(2, 35), 2)
        for i, (u, f) in products.items():
            total = g.register(f"u_{i}_sum", lambda a, b: a + b, *u)
            across = g.register(f"u_{i}_rest", lambda total: two - total, total)
            operand = g.register(
                f"u_{i}_across", lambda rest: rest.truncate(16).saturate(p.OPERAND_FORMAT), across
            )
            bend = g.multiply(f"u_{i}_bend", e, operand)
            bend = g.register(f"u_{i}_bend_rounded", lambda product: product.scale(2).round_half_up(20), bend)
            bend = g.register(f"u_{i}_bend_word", lambda bend: bend.saturate(p.BEND_FORMAT), bend)
            rise = g.register(f"u_{i}_rise", lambda a, b: b - a, *u)
            slope = g.register(
                f"u_{i}_slope", lambda rise, bend: (rise - bend).wrap(p.SLOPE_FORMAT), rise, bend
            )
            self._differences(results, i, "highlight", u[0], slope, bend, steps)

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

    def _cosine(self, name: str, normal: Word, vector: Callable[[data.View], data.View]) -> Word:
        total = dot(self._graph, name, normal, vector, self._sums)
        return self._graph.register(name, lambda total: total.saturate(self.parameters.COSINE_FORMAT), total)

    def _steps(self, length: Word) -> tuple[Word, Word, Word, Word]:
        """``dt = 2 reciprocal 2^-shift`` and ``dt^2 = 4 square 2^-shift``, with their shifts."""
        g = self._graph
        reciprocal, shift = reciprocal_words(g, length, length_bits=self.length_bits)
        square = g.multiply("square_exact", reciprocal, reciprocal)
        return reciprocal, shift, *square_words(g, square, shift)

    def _differences(self, results, i, function, start, slope, bend, steps) -> None:
        g, p = self._graph, self.parameters
        reciprocal, shift, square, square_shift = steps
        name = f"{function}_{i}"
        if function == "highlight":
            high = g.multiply(
                f"{name}_high",
                slope,
                reciprocal,
                lambda slope: FixedValue(p.HIGH_FORMAT, Value.cast(slope)[p.LOW_FORMAT.width :]),
            )
            low = g.multiply(
                f"{name}_low",
                slope,
                reciprocal,
                lambda slope: FixedValue(p.LOW_FORMAT, Value.cast(slope)[: p.LOW_FORMAT.width]),
            )
            along = g.register(f"{name}_along", lambda high, low: high + low.truncate(48), high, low)
        else:
            along = g.multiply(f"{name}_along", slope, reciprocal)
        first = self._shifted(f"{name}_first_order", along, shift, 1)
        across = g.multiply(f"{name}_across", bend, square)
        second = self._shifted(f"{name}_second_order", across, square_shift, 2)
        results[i, function, "start"] = start
        results[i, function, "first"] = g.register(
            f"{name}_first", lambda a, b: (a + b).wrap(p.FORMAT), first, second
        )
        results[i, function, "second"] = g.register(
            f"{name}_second", lambda b: b.scale(1).extend(SQ(2, 46)).wrap(p.FORMAT), second
        )

    def _shifted(self, name: str, value: Word, shift: Word, scale: int) -> Word:
        """``value 2^(scale - shift)``, rounded half up to the fraction bits of the differences."""

        def operands(value, shift):
            return value.scale(scale).extend(_SHIFTED), shift

        return self._graph.use(self._shifter, name, (value, shift), operands)


_SHIFTED = SQ(2, 47)


def _shift(register, value, amount):
    """``value 2^-amount``, in two stages, rounded half up to the fraction bits of the differences."""
    coarse = FixedValue(_SHIFTED, Value.cast(value) >> Cat(Const(0, 2), amount[2:]))
    coarse, fine = register(coarse, "coarse"), register(amount[:2], "fine_amount")
    shifted = register(FixedValue(_SHIFTED, Value.cast(coarse) >> fine), "shifted")
    return register(shifted.round_half_up(46).wrap(ChordSetup.FORMAT), "rounded")


def _constant(number: Fixed) -> FixedValue:
    return FixedValue.constant(number.format, number.values.item())
