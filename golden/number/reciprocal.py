"""Reciprocals ``1/(m - 1)`` of the steps of a span, by a table that all units share."""

from functools import cache

import numpy as np

from blysk.golden.number.fixed import UQ, Fixed, Format
from blysk.golden.number.spans import LENGTH_BITS

__all__ = ["RECIPROCAL_FORMAT", "reciprocal_address", "reciprocal_table", "step_words"]

RECIPROCAL_FORMAT = UQ(0, 17)
"""Format of a reciprocal and of its square: an unsigned operand of an 18 x 18 multiplier."""


@cache
def reciprocal_table(format: Format = RECIPROCAL_FORMAT) -> Fixed:
    """Table of ``1/f``, f in [1, 2): ``1/(1 + k/2048)`` at address k, rounded half up.

    The format does not hold 1, so the word at address 0 is 1/2. `reciprocal_address` shifts this word by one
    bit less. The error of a word is at most half a step of the format. With F fraction bits this is at most a
    relative ``2^-F``.

    Parameters
    ----------
    format : Format
        Format of a word, unsigned, for numbers under 1.

    Returns
    -------
    Fixed, shape (2048,)
        Read only.
    """
    size = 1 << (LENGTH_BITS - 1)
    values = 1 / (1 + np.arange(size) / size)
    values[0] = 0.5
    table = Fixed.round(format, values)
    table.codes.setflags(write=False)
    return table


def reciprocal_address(steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Address in `reciprocal_table`, and the shift s of ``1/steps = 2 reciprocal 2^-s``.

    ``steps`` is ``f 2^p`` with f in [1, 2). The address is the fraction of f. s is p if f is 1, else p + 1.

    Parameters
    ----------
    steps : int64 array
        0 to 4094; 0 counts as 1.

    Returns
    -------
    address, shift : int64 arrays
        0 to 2047, and 0 to 12.
    """
    top = LENGTH_BITS - 1
    position = np.zeros_like(steps)
    for bit in range(1, LENGTH_BITS):
        position[steps >> bit > 0] = bit
    address = (steps << (top - position)) & ((1 << top) - 1)
    return address, position + (address > 0)


def step_words(length: np.ndarray) -> tuple[Fixed, np.ndarray, Fixed, np.ndarray]:
    """Bit-accurate ``dt = 1/(m - 1) = 2 reciprocal 2^-shift`` and ``dt^2 = 4 square 2^-square_shift``.

    The square of the reciprocal is shifted up by one bit where it is under 1/2, and rounded half up. The
    relative error of dt is at most 2^-17, and of dt^2 at most ``2^-16 + 2^-17 + 2^-34``.

    Parameters
    ----------
    length : int64 array, any shape
        m, 1 to 4095; 1 counts as 2.

    Returns
    -------
    reciprocal : Fixed, same shape, UQ(0, 17)
    shift : int64 array, same shape
        0 to 12.
    square : Fixed, same shape, UQ(0, 17)
    square_shift : int64 array, same shape
        0 to 25.
    """
    address, shift = reciprocal_address(length - 1)
    reciprocal = reciprocal_table()[address]
    square = reciprocal * reciprocal
    small = square < Fixed(UQ(0, 1), 1)
    square = Fixed(square.format, square.codes << small).round_half_up(RECIPROCAL_FORMAT.fraction_bits)
    return reciprocal, shift, square.saturate(RECIPROCAL_FORMAT), 2 * shift + small
