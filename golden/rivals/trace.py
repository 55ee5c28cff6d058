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


def _differs(codes: np.ndarray, format: Format) -> int:
    """Number of bits that differ from a row of codes to the next, over all rows."""
    return int(ones(codes[1:] ^ codes[:-1], format).sum())


class Trace:
    """Multipliers, adders, memories and registers of a model, and the bits that switch in them.

    A model passes the words of its pixels in their order, in arrays of shape (pixels, words). So each call
    counts a part for each word of a pixel. Words of spans and triangles are passed in the same way, with
    their own rate.

    - A product takes `tiles` times `tiles` multipliers.
    - An addition takes as many adder bits as its result has.
    - A memory counts its bits. Tables that several words of a pixel read count for each.
    - Every result is kept in one register; ``register_bits`` counts those of the rate ``pixel``.
    - *Switched bits* are the changed bits of every register, and the changed bits of the array ``a_i b_j`` of
      partial products of every multiplier, from a pixel, span or triangle to the next. `switched_a_pixel` is
      their number for a pixel.

    All models and designs are counted by these rules. They leave out control, flags and wires.

    Parameters
    ----------
    switches : bool
        Whether switched bits are counted, too. This takes most of the time.
    """

    def __init__(self, switches: bool = True) -> None:
        self.switches = switches
        self.multipliers: Counter[str] = Counter()
        self.adder_bits: Counter[str] = Counter()
        self.memory_bits = 0
        self.register_bits = 0
        self.switched = 0
        self.pixels = 0

    @property
    def switched_a_pixel(self) -> float:
        """Switched bits of all operations, divided by the number of pixels."""
        return self.switched / max(self.pixels, 1)

    def multipliers_at(self, span_cycles: int = 3, triangle_cycles: int = 8) -> int:
        """Multipliers for a pixel a cycle, if products of a span and of a triangle share multipliers."""
        return self._shared(self.multipliers, span_cycles, triangle_cycles)

    def adder_bits_at(self, span_cycles: int = 3, triangle_cycles: int = 8) -> int:
        """Bits of adders for a pixel a cycle, if additions of a span and of a triangle share adders."""
        return self._shared(self.adder_bits, span_cycles, triangle_cycles)

    @staticmethod
    def _shared(parts: Counter[str], span_cycles: int, triangle_cycles: int) -> int:
        return parts["pixel"] - (-parts["span"] // span_cycles) - (-parts["triangle"] // triangle_cycles)

    def _kept(self, word: Fixed, rate: str) -> None:
        if rate == "pixel":
            self.register_bits += word.format.width * int(np.prod(word.shape[1:]))
            self.pixels = max(self.pixels, len(word.codes))
        if self.switches:
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
        if self.switches and len(result.codes) > 1:
            operands = [(np.broadcast_to(of.codes, result.shape), of.format) for of in (a, b)]
            each = np.multiply(*(ones(codes, format) for codes, format in operands))
            both = np.multiply(*(ones(codes[1:] & codes[:-1], format) for codes, format in operands))
            self.switched += int((each[1:] + each[:-1] - 2 * both).sum())
        return result

    def added(self, word: Fixed, rate: str = "pixel") -> Fixed:
        """A sum, counted as one adder for each word."""
        self.adder_bits[rate] += word.format.width * int(np.prod(word.shape[1:]))
        self._kept(word, rate)
        return word

    def summed(self, product: Fixed, rate: str = "pixel") -> Fixed:
        """Sum of products along the last axis, counted as a row of adders."""
        total = product[..., 0]
        for k in range(1, product.shape[-1]):
            total = total + product[..., k]
            word = Fixed(total.format, total.codes if total.codes.ndim > 1 else total.codes[:, np.newaxis])
            self.added(word, rate)
        return total

    def read(self, memory_bits: int, *columns: Fixed) -> None:
        """Columns of a word that a pixel reads from a memory of this number of bits, for each word."""
        self.memory_bits += memory_bits * int(np.prod(columns[0].shape[1:]))
        for column in columns:
            self._kept(column, "pixel")
