"""Count of a word's leading zeros, choice of a word by an index, product with a constant."""

from collections.abc import Sequence

from amaranth.hdl import Const, Mux, Value

__all__ = ["leading_zeros", "select", "times_constant"]


def leading_zeros(code: Value) -> Value:
    """Number of leading zeros, found by halving the word.

    Parameters
    ----------
    code : Value
        Word of one bit or more.
    """
    if len(code) == 1:
        return ~code
    half = 1 << (len(code) - 1).bit_length() - 1
    high, low = code[len(code) - half :], code[: len(code) - half]
    return Mux(high.any(), leading_zeros(high), half + leading_zeros(low))[: len(code).bit_length()]


def select(words: Sequence[Value], index: Value) -> Value:
    """Word at an index. Halves of the words are chosen, which maps to wide multiplexers.

    An index past the last word gives some word, not always the last word.

    Parameters
    ----------
    words : sequence of Value
        Words of equal widths, one or more.
    index : Value
        Index, unsigned.
    """
    if len(words) == 1:
        return words[0]
    half = 1 << (len(words) - 1).bit_length() - 1
    bit = half.bit_length() - 1
    return Mux(index[bit], select(words[half:], index[:bit]), select(words[:half], index[:bit]))


def times_constant(value: Value, factor: int) -> Value:
    """Product of an unsigned value of a few bits and a constant, chosen from all products.

    A product by ``*`` takes a multiplier of an FPGA, even for a constant.
    """
    width = max((((1 << len(value)) - 1) * factor).bit_length(), 1)
    return select([Const(number * factor, width) for number in range(1 << len(value))], value)
