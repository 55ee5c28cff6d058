"""Products of words wider than a multiplier's operand, as words of a graph."""

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Value

from blysk.golden.geometry.wide_product import GUARD_BITS, low_format
from blysk.golden.number.fixed import SQ, Format
from blysk.hdl.core.accumulator import Accumulator, half
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.word import Word

__all__ = ["halves", "three_products", "wide_product"]

_INTEGER_BITS = 7
"""Integer bits of a sum in an accumulator. Factors are at most 32 in magnitude, and 1."""


def halves(low_bits: int) -> tuple[Callable[[Any], FixedValue], Callable[[Any], FixedValue]]:
    """Two functions of a number, which give its signed high part and its unsigned low part.

    Both are wiring.
    """

    def high(value: FixedValue) -> FixedValue:
        return value.truncate(value.format.fraction_bits - low_bits)

    def low(value: FixedValue) -> FixedValue:
        return FixedValue(low_format(value.format, low_bits), Value.cast(value)[:low_bits])

    return high, low


def _products(graph: Dataflow, name: str, a: Word, b: Word, a_low: int, b_low: int) -> list[Word]:
    """The product of the high halves, and both products of a high and a low half."""
    (a_high, a_rest), (b_high, b_rest) = halves(a_low), halves(b_low)
    return [
        graph.multiply(f"{name}_{part}", a, b, *parts)
        for part, parts in (
            ("high", (a_high, b_high)),
            ("low_0", (a_high, b_rest)),
            ("low_1", (a_rest, b_high)),
        )
    ]


def three_products(
    graph: Dataflow, name: str, a: Word, b: Word, a_low: int, b_low: int, keep: int
) -> tuple[Word, Word]:
    """The product of the high halves, and the sum of the two products of a high and a low half.

    All three are cut to ``keep`` fraction bits. This takes three multiplications, and a register for the sum.
    Other parameters are those of `wide_product`.
    """
    high, *crossed = _products(graph, name, a, b, a_low, b_low)
    total = graph.register(f"{name}_crossed", lambda x, y: _cut(x, keep) + _cut(y, keep), *crossed)
    return graph.wire(f"{name}_cut", lambda x: _cut(x, keep), high), total


def wide_product(
    graph: Dataflow,
    name: str,
    a: Word,
    b: Word,
    a_low: int,
    b_low: int,
    fraction_bits: int,
    result: Callable[[FixedValue], FixedValue] | Format,
    sums: Accumulator | None = None,
) -> Word:
    """The word of `blysk.golden.geometry.wide_product.wide_product`: three multiplications, two registers.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    name : str
        Name of the result.
    a, b : Word
        Operands.
    a_low, b_low : int
        Bits of their low halves.
    fraction_bits : int
        Fraction bits of the result.
    result : Format or callable
        Format to which the rounded sum wraps, or a function of the rounded sum.
    sums : Accumulator or None
        Accumulator of the graph, for the three products. ``None``: the sums have adders of their own.

    Returns
    -------
    Word
        The result.
    """
    made = (lambda value: value.wrap(result)) if isinstance(result, Format) else result
    if sums is not None:
        products = _products(graph, name, a, b, a_low, b_low)
        exact = SQ(_INTEGER_BITS, fraction_bits + GUARD_BITS)
        total = sums.sum(f"{name}_sum", products, exact, half(fraction_bits))
        return graph.register(name, lambda x: made(x.truncate(fraction_bits)), total)
    high, crossed = three_products(graph, name, a, b, a_low, b_low, fraction_bits + GUARD_BITS)
    return graph.register(name, lambda x, y: made((x + y).round_half_up(fraction_bits)), high, crossed)


def _cut(product: FixedValue, fraction_bits: int) -> FixedValue:
    return product.truncate(min(fraction_bits, product.format.fraction_bits))
