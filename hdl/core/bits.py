"""Count of a word's leading zeros, and choice of a word by an index."""

from collections.abc import Sequence

from amaranth.hdl import Mux, Value

__all__ = ["leading_zeros", "select"]


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
