"""Bit-accurate model of the transfer unit: from linear light to the sRGB codes of a picture."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.reference.transfer import encode

__all__ = ["Transfer"]


@dataclass(frozen=True)
class Transfer:
    """The curve of sRGB, correctly rounded: ``floor(255 encode(x/255) + 1/2)`` for every input x.

    The inputs are divided into parts so short that the code rises at most once in each part. A word of a
    table tells the code at the start of a part, and the place of the rise. No product is needed.

    Inputs up to 255/64 are parts of their own. Above, each octave has 128 parts. In an octave from
    ``2^(7+k)`` steps of 1/64 on, a part has ``2^k`` inputs, k = 0 to 6. With f, the last k bits of the
    input::

        code = floor((word + f) / 64)        word = 64 first code + (64 - place of the rise, or 0)

    ======= ======== ============================================================
    word    format   why
    ======= ======== ============================================================
    input   UQ(8, 6) 1/64 LSB: at black the curve makes it 12.92/64 of a code
    address 10 bits  3 of the octave, 7 of the place in it
    f       6 bits   place in the part
    word    UQ(8, 6) ``word + f`` carries into the code where the code rises
    ======= ======== ============================================================

    The table has 1024 words of 14 bits. The only error is the rounding, up to 1/2 LSB of the output. The
    result never falls where the input rises. From 255 on it is 255.

    Source: docs/theory/textures.md#transfer; IEC 61966-2-1.
    """

    OPERAND_FORMAT = UQ(8, 6)
    WORD_FORMAT = UQ(8, 6)
    RESULT_FORMAT = UQ(8, 0)
    PART_BITS = 7
    """Bits of the number of parts in an octave."""

    @property
    def words(self) -> np.ndarray:
        """Words of the table, int64, shape (1024,). `ValueError` if a code rises twice in a part."""
        return _words()

    @classmethod
    def shift(cls, codes: np.ndarray) -> np.ndarray:
        """For each input code, the number k of bits that hold its place within its part."""
        length = np.frexp(codes)[1].astype(np.int64)
        found: np.ndarray = np.maximum(length - 1 - cls.PART_BITS, 0)
        return found

    @classmethod
    def address(cls, codes: np.ndarray) -> np.ndarray:
        """Address of each input code's part."""
        shift = cls.shift(codes)
        found: np.ndarray = (shift << cls.PART_BITS) + (codes >> shift)
        return found

    def compute(self, light: Fixed) -> np.ndarray:
        """Bit-accurate codes.

        Parameters
        ----------
        light : Fixed, any shape, UQ(8, 6)
            Linear light in LSB of an 8-bit channel.

        Returns
        -------
        uint8 array, same shape

        Raises
        ------
        ValueError
            If the operand has another format.
        """
        if light.format != self.OPERAND_FORMAT:
            raise ValueError(f"the operand must be {self.OPERAND_FORMAT}, not {light.format}")
        codes = light.codes
        place = codes & ((1 << self.shift(codes)) - 1)
        total = _words()[self.address(codes)] + place
        found: np.ndarray = (total >> self.WORD_FORMAT.fraction_bits).astype(np.uint8)
        return found


@cache
def _words() -> np.ndarray:
    codes = np.arange(Transfer.OPERAND_FORMAT.max_code + 1)
    exact = np.floor(255 * encode(codes * Transfer.OPERAND_FORMAT.step / 255) + 0.5).astype(np.int64)
    starts = np.flatnonzero(np.diff(Transfer.address(codes), prepend=-1))
    size = np.diff(np.append(starts, len(codes)))
    first, last = exact[starts], exact[starts + size - 1]
    if np.any(last - first > 1):
        raise ValueError("a code rises twice in a part of the table")
    # The place of the rise is the number of inputs with the lower code.
    higher = np.add.reduceat(exact, starts) - first * size
    one = 1 << Transfer.WORD_FORMAT.fraction_bits
    words: np.ndarray = first * one + np.where(higher > 0, one - size + higher, 0)
    return words
