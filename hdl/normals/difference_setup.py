"""Difference setup ([T] figure 2.11): first and second difference of a quadratic normal curve."""

from collections.abc import Sequence
from typing import Literal

from amaranth.hdl import Cat, Const, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.number.fixed import SQ
from blysk.golden.number.reciprocal import RECIPROCAL_FORMAT
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.dataflow import MULTIPLIER_LATENCY, Dataflow, checked_interval, registered_product
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.reciprocal import checked_length_bits, reciprocal_words, square_words
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.word import Word
from blysk.hdl.normals.gpq import curve_shapes

__all__ = ["DifferenceSetupUnit", "difference_shape"]


def difference_shape() -> data.StructLayout:
    """Shape of a prepared span: start, first and second difference, and length in pixels, 12 bits."""
    difference = data.ArrayLayout(FixedShape(DifferenceSetup.FORMAT), 3)
    return data.StructLayout(
        {"start": normal_shape(), "first": difference, "second": difference, "length": unsigned(12)}
    )


class DifferenceSetupUnit(PipelinedUnit):
    """First difference ``W_0 = P dt + G dt^2`` and second difference ``2 G dt^2``, with ``dt = 1/(m - 1)``.

    m is the length of the span. `DifferenceSetup`, the bit-accurate model, has formats and error bound.

    A span needs seven multiplications: the square of dt, three products with P and three with G. With an
    initiation interval I, ``ceil(7 / I)`` multipliers share them (`blysk.hdl.core.dataflow`), each with its
    own shifter. By default one multiplier makes all products. The results are the same for every I. A table
    of ``2^(length_bits - 1)`` words of 17 bits holds the reciprocals.

    =========== == == == == == == ==
    interval    1  2  3  4  5  6  7
    =========== == == == == == == ==
    latency     17 18 18 20 21 21 24
    multipliers 7  4  3  2  2  2  1
    =========== == == == == == == ==

    For a straight line, `order` 1, there are only the three products with P:

    =========== == == == == == == ==
    interval    1  2  3  4  5  6  7
    =========== == == == == == == ==
    latency     11 13 14 14 14 14 14
    multipliers 3  2  1  1  1  1  1
    =========== == == == == == == ==

    In the order of [T] there are nine products, first the three of ``G dt``:

    =========== == == == == == == == == ==
    interval    1  2  3  4  5  6  7  8  9
    =========== == == == == == == == == ==
    latency     20 21 23 22 25 23 22 22 29
    multipliers 9  5  3  3  2  2  2  2  1
    =========== == == == == == == == == ==

    Parameters
    ----------
    model : DifferenceSetup
        Bit-accurate model, with the order of the products.
    initiation_interval : int or None
        Cycles from an input to the next, 1 to 7, or to 9 in the order of [T]. ``None``: the number of
        products.
    order : int
        Degree of the curve, 2 or 1. A straight line (1) has no port for G, and its second difference is 0.
    length_bits : int
        Bits of the length, 2 to 12. Spans have at most ``2^length_bits - 1`` pixels.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"g", "p", "q", "length"})))`
        Coefficients in the formats of `GPQ`, and the length in `length_bits` bits, at least 1.
    o : :py:`Out(stream.Signature(difference_shape()))`
        The start ``q``, both differences in ``SQ(2, 42)``, the length.

    Source: docs/theory/interpolation.md#forward-differences; [T] figure 2.11.
    """

    def __init__(
        self,
        model: DifferenceSetup | None = None,
        *,
        initiation_interval: int | None = None,
        order: Literal[1, 2] = 2,
        length_bits: int = LENGTH_BITS,
    ):
        if order not in (1, 2):
            raise ValueError(f"order must be 1 or 2, not {order!r}")
        self.model = model or DifferenceSetup()
        self.order = order
        self.length_bits = checked_length_bits(length_bits)
        longest = 9 if self.model.as_published else 7
        uses = longest if order == 2 else 3
        interval = checked_interval(initiation_interval, longest, uses)
        self._graph = Dataflow(interval)
        shapes = FixedShape(RECIPROCAL_FORMAT), FixedShape(COMPONENT), unsigned(5)
        self._multiplier = self._graph.share("multiplier", shapes, MULTIPLIER_LATENCY + 3, _multiply)
        self._words = self._describe()
        coefficients = curve_shapes()
        if order == 1:
            del coefficients["g"]
        super().__init__(
            data.StructLayout({**coefficients, "length": unsigned(length_bits)}),
            difference_shape(),
            latency=max(word.stage for word in self._words.values()),
            initiation_interval=interval,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for index, word in self._words.items():
            target = result[index] if isinstance(index, str) else result[index[0]][index[1]]
            m.d.comb += target.eq(value(word, self.latency))
        return result

    def _describe(self) -> dict:
        """Words of the results."""
        g = self._graph
        start, length = (g.input(name, lambda i, name=name: i[name]) for name in ("q", "length"))
        words = {"start": start, "length": length}
        reciprocal, shift = reciprocal_words(g, length, length_bits=self.length_bits)
        p = g.input("p", lambda operands: operands.p)
        if self.order == 1:
            for c in range(3):
                words["first", c] = self._shifted(
                    f"first_{c}", reciprocal, p, shift, lambda p, c=c: p[c], _plus_one
                )
            return words
        describe = self._as_published if self.model.as_published else self._products
        describe(words, p, g.input("g", lambda operands: operands.g), reciprocal, shift)
        return words

    def _products(self, words, p, g, reciprocal, shift) -> None:
        """Words of ``P dt + G dt^2`` and ``2 G dt^2``."""
        graph = self._graph
        product = self._product(
            "square_exact", reciprocal, reciprocal, lambda reciprocal: reciprocal.extend(COMPONENT)
        )
        firsts = [
            self._shifted(f"first_order_{c}", reciprocal, p, shift, lambda p, c=c: p[c], _plus_one)
            for c in range(3)
        ]
        square, square_shift = square_words(graph, product, shift)
        for c, first in enumerate(firsts):
            second = self._shifted(
                f"second_order_{c}", square, g, square_shift, lambda g, c=c: g[c].extend(COMPONENT)
            )
            words["first", c] = graph.register(
                f"first_{c}", lambda a, b: (a + b).wrap(DifferenceSetup.FORMAT), first, second
            )
            words["second", c] = graph.register(f"second_{c}", _twice, second)

    def _as_published(self, words, p, g, reciprocal, shift) -> None:
        """Words of ``(G dt + P) dt`` and ``2 (G dt) dt``. The word of ``G dt`` lacks the shift of dt."""
        graph = self._graph
        curvature_format, step_format = DifferenceSetup.CURVATURE_FORMAT, SQ(1, 29)
        products = [
            self._product(f"curvature_exact_{c}", reciprocal, g, lambda g, c=c: g[c].extend(COMPONENT))
            for c in range(3)
        ]
        curvatures = [
            graph.register(f"curvature_{c}", lambda x: x.round_half_up(18).wrap(curvature_format), product)
            for c, product in enumerate(products)
        ]
        for c, curvature in enumerate(curvatures):
            second = self._shifted(
                f"second_order_{c}",
                reciprocal,
                curvature,
                shift,
                lambda curvature: curvature.scale(1),
                lambda shift: Cat(Const(1, 1), shift),
            )
            words["second", c] = graph.register(f"second_{c}", _twice, second)
        for c, curvature in enumerate(curvatures):
            # ``G dt``, exact with 29 fraction bits, shifted in two stages.
            step = graph.register(
                f"step_coarse_{c}",
                lambda curvature, shift: FixedValue(
                    step_format,
                    Value.cast(curvature.scale(1).extend(step_format)) >> Cat(Const(0, 2), shift[2:]),
                ),
                curvature,
                shift,
            )
            step = graph.register(
                f"step_{c}",
                lambda step, shift: FixedValue(step_format, Value.cast(step) >> shift[:2]),
                step,
                shift,
            )
            slope = graph.register(f"slope_sum_{c}", lambda step, p, c=c: step + p[c], step, p)
            slope = graph.register(f"slope_rounded_{c}", lambda slope: slope.round_half_up(17), slope)
            slope = graph.register(f"slope_{c}", lambda slope: slope.saturate(COMPONENT), slope)
            words["first", c] = self._shifted(
                f"first_{c}", reciprocal, slope, shift, lambda slope: slope, _plus_one
            )

    def _product(self, name: str, factor: Word, operand: Word, wiring) -> Word:
        """Word of an exact product."""

        def operands(factor, operand):
            return factor, wiring(operand), Const(0, 5)

        return self._graph.use(
            self._multiplier,
            name,
            (factor, operand),
            operands,
            lambda results: results[0],
            latency=MULTIPLIER_LATENCY,
        )

    def _shifted(
        self, name: str, factor: Word, operand: Word, shift: Word, wiring, amount=lambda shift: shift
    ) -> Word:
        """``4 product 2^-amount``, rounded half up to 42 fraction bits."""

        def operands(factor, operand, shift):
            return factor, wiring(operand), amount(shift)

        return self._graph.use(
            self._multiplier, name, (factor, operand, shift), operands, lambda results: results[1]
        )


def _plus_one(shift: Value) -> Value:
    """Shift amount of a product with ``dt = 2 reciprocal 2^-shift``, see `_shifted`."""
    return shift + 1


def _twice(second: FixedValue) -> FixedValue:
    """Second difference: twice ``G dt^2``."""
    return second.scale(1).extend(SQ(3, 42)).wrap(DifferenceSetup.FORMAT)


def _multiply(register, a: FixedValue, b: FixedValue, amount: Value) -> Sequence[FixedValue]:
    """The product, and ``4 product 2^-amount`` in two stages, rounded half up to 42 fraction bits."""
    product = registered_product(register, a, b)
    for cycle in range(MULTIPLIER_LATENCY):
        amount = register(amount, f"amount_{cycle}")
    scaled = product.scale(2).extend(SQ(3, 43))
    coarse = FixedValue(scaled.format, Value.cast(scaled) >> Cat(Const(0, 3), amount[3:]))
    coarse, fine = register(coarse, "coarse"), register(amount[:3], "fine_amount")
    shifted = register(FixedValue(scaled.format, Value.cast(coarse) >> fine), "shifted")
    return product, register(shifted.round_half_up(42).wrap(DifferenceSetup.FORMAT), "rounded")
