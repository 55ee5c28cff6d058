"""Parts of a datapath, and bits that switch in it, counted while its bit-accurate model runs."""

from collections import Counter

import numpy as np

from blysk.golden.number.fixed import Fixed, Format

__all__ = ["RATES", "Trace", "ones", "tiles"]

RATES = ("pixel", "span", "triangle")
"""How often an operation happens."""


def tiles(format: Format) -> int:
    """Multipliers of 18x18 bits that an operand of a product needs along its side."""
    return -(-format.width // 18)


_ONES = np.array([value.bit_count() for value in range(256)], dtype=np.uint8)


def ones(codes: np.ndarray, format: Format) -> np.ndarray:
    """Number of bits that are 1 in each word: int64 array of the same shape."""
    low = np.ascontiguousarray(codes & ((1 << format.width) - 1), dtype=np.int64)
    found: np.ndarray = _ONES[low[..., np.newaxis].view(np.uint8)].sum(axis=-1, dtype=np.int64)
    return found


def _differs(codes: np.ndarray, format: Format) -> float:
    """Mean number of bits of a row of codes that differ from the row before."""
    if len(codes) < 2:
        return 0.0
    return float(ones(codes[1:] ^ codes[:-1], format).sum()) / (len(codes) - 1)


class Trace:
    """Multipliers, adders, memories and registers of a model, and the bits that switch in them.

    A model passes the words of its pixels in their order, in arrays of shape (pixels, words). So each call
    counts a part for each word of a pixel. Words of spans and triangles are passed in the same way, with
    their own rate.

    - A product takes `tiles` times `tiles` multipliers.
    - An addition takes as many adder bits as its result has.
    - A memory counts its bits. Tables that several words of a pixel read count for each.
    - Every result of the rate ``pixel`` is kept in one register.
    - *Switched bits* count at the rate ``pixel`` alone, from a pixel to the next. They are the changed bits
      of every register, and the changed bits of the array ``a_i b_j`` of partial products of every
      multiplier.

    All models and designs are counted by these rules. They leave out control, flags and wires.
    """

    def __init__(self) -> None:
        self.multipliers: Counter[str] = Counter()
        self.adder_bits: Counter[str] = Counter()
        self.memory_bits = 0
        self.register_bits = 0
        self.switched = 0.0

    def _kept(self, word: Fixed, rate: str) -> None:
        if rate == "pixel":
            self.register_bits += word.format.width * int(np.prod(word.shape[1:]))
            self.switched += _differs(word.codes, word.format)

    def product(self, a: Fixed, b: Fixed, rate: str = "pixel") -> Fixed:
        """Exact product of two arrays of words, counted.

        Parameters
        ----------
        a, b : Fixed
            Arrays that broadcast to shape (pixels, words).
        rate : str
            One of `RATES`.
        """
        result = a * b
        words = int(np.prod(result.shape[1:]))
        self.multipliers[rate] += words * tiles(a.format) * tiles(b.format)
        self._kept(result, rate)
        if rate == "pixel" and len(result.codes) > 1:
            operands = [(np.broadcast_to(of.codes, result.shape), of.format) for of in (a, b)]
            each = np.multiply(*(ones(codes, format) for codes, format in operands))
            both = np.multiply(*(ones(codes[1:] & codes[:-1], format) for codes, format in operands))
            self.switched += float((each[1:] + each[:-1] - 2 * both).sum()) / (len(each) - 1)
        return result

    def added(self, word: Fixed, rate: str = "pixel") -> Fixed:
        """A sum, counted as one adder for each word."""
        self.adder_bits[rate] += word.format.width * int(np.prod(word.shape[1:]))
        self._kept(word, rate)
        return word

    def read(self, memory_bits: int, *columns: Fixed) -> None:
        """Columns of a word that a pixel reads from a memory of this number of bits, for each word."""
        self.memory_bits += memory_bits * int(np.prod(columns[0].shape[1:]))
        for column in columns:
            self._kept(column, "pixel")
