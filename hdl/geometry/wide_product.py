"""Products of words wider than a multiplier's operand, as words of a graph."""

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Value

from blysk.golden.geometry.wide_product import GUARD_BITS, low_format
from blysk.golden.number.fixed import Format
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.word import Word

__all__ = ["halves", "three_products", "wide_product"]


def halves(low_bits: int) -> tuple[Callable[[Any], FixedValue], Callable[[Any], FixedValue]]:
    """Two functions of a number, which give its signed high part and its unsigned low part.

    Both are wiring.
    """

    def high(value: FixedValue) -> FixedValue:
        return value.truncate(value.format.fraction_bits - low_bits)

    def low(value: FixedValue) -> FixedValue:
        return FixedValue(low_format(value.format, low_bits), Value.cast(value)[:low_bits])

    return high, low


def three_products(
    graph: Dataflow, name: str, a: Word, b: Word, a_low: int, b_low: int, keep: int
) -> tuple[Word, Word]:
    """The product of the high halves, and the sum of the two products of a high and a low half.

    All three are cut to ``keep`` fraction bits. This takes three multiplications, and a register for the sum.
    Other parameters are those of `wide_product`.
    """
    (a_high, a_rest), (b_high, b_rest) = halves(a_low), halves(b_low)
    high = graph.multiply(f"{name}_high", a, b, a_high, b_high)
    crossed = [
        graph.multiply(f"{name}_low_{k}", a, b, *parts)
        for k, parts in enumerate(((a_high, b_rest), (a_rest, b_high)))
    ]
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

    Returns
    -------
    Word
        The result.
    """
    high, crossed = three_products(graph, name, a, b, a_low, b_low, fraction_bits + GUARD_BITS)
    made = (lambda value: value.wrap(result)) if isinstance(result, Format) else result
    return graph.register(name, lambda x, y: made((x + y).round_half_up(fraction_bits)), high, crossed)


def _cut(product: FixedValue, fraction_bits: int) -> FixedValue:
    return product.truncate(min(fraction_bits, product.format.fraction_bits))
