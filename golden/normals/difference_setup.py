"""First values of the forward differences of a quadratic normal curve ([T] figure 2.11)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from blysk.golden.normals.gpq import GPQ
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["LENGTH_BITS", "DifferenceSetup", "reciprocal_place", "reciprocal_table"]

LENGTH_BITS = 12
"""Bits of a span's length."""


def checked_lengths(length: np.ndarray, least: int = 1) -> np.ndarray:
    """Lengths of spans as int64.

    Parameters
    ----------
    length : int array
        Pixels of each span.
    least : int
        Least length that a device takes.

    Raises
    ------
    ValueError
        If one is out of range.
    """
    length = np.asarray(length, dtype=np.int64)
    if length.size and not least <= length.min() <= length.max() < 1 << LENGTH_BITS:
        raise ValueError(f"lengths must be {least} to {(1 << LENGTH_BITS) - 1}")
    return length


def reciprocal_table(format: Format) -> Fixed:
    """``1/(1 + k/2048)`` at address k, rounded half up, and 1/2 at address 0, as no format here holds 1."""
    size = 1 << (LENGTH_BITS - 1)
    values = 1 / (1 + np.arange(size) / size)
    values[0] = 0.5
    return Fixed.round(format, values)


def reciprocal_place(steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Address in the reciprocal table, and the shift s of ``1/steps = 2 reciprocal 2^-s``.

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


@dataclass(frozen=True)
class DifferenceSetup:
    """``W_0 = (G dt + P) dt`` and ``2 G dt^2`` with ``dt = 1/(m - 1)``, for spans of ``m`` pixels.

    Written ``W_0 = P dt + G dt^2``, so that one multiplier does all: the square of dt, then three products
    with P and three with G.

    ``m - 1`` is shifted to ``f 2^s`` with f in [1, 2), and ``1/f`` read from a table of 2048 words
    ``UQ(0, 17)``; a 1 itself is held as 1/2 and one shift less. ``dt^2`` is the rounded square of that word,
    shifted up again when under 1/2. Products are shifted and rounded half up to 42 fraction bits.

    ======== ============ ===========================================================
    word     format       why
    ======== ============ ===========================================================
    W_0      SQ(2, 42)    at most 1.5; differences grow with the square of the length
    2 G dt^2 SQ(2, 42)    at most 1
    ======== ============ ===========================================================

    Error over the span: dt is off by a relative 2^-17 at most, dt^2 by 2^-16 + 2^-17 + 2^-34, which moves
    the end of the curve by under ``2^-17 |P| + (2^-16 + 2^-17 + 2^-34) |G|``; the rounding of the
    differences adds, at pixel k, at most ``2^-42 (k + k^2/2)``, 1.9e-6 after 4095 pixels.

    A span of one pixel has no dt; it gets dt = 1, which nothing reads.

    With ``as_published`` the order of figure 2.11 is kept, ``W_0 = (G dt + P) dt`` and ``2 (G dt) dt``: nine
    products in place of seven. With ``dt = 2 f' 2^-s``, f' the word of the table, ``G f'`` is rounded to
    ``SQ(0, 18)``, and ``G dt + P`` to ``SQ(1, 17)``, where it saturates; it is the mean slope of the first
    step, under 0.84 up to 45 degrees. dt^2 then is the square of the same dt, off by 2^-16 + 2^-34.
    Over the span the end moves by under ``2^-17 |P| + (2^-16 + 2^-34) |G|``, 2^-18 for the rounding of
    ``G dt + P``, 2^-18 for that of ``G f'`` (each with 2^-17 of it), and the rounding of the differences.

    Parameters
    ----------
    as_published : bool
        Keep the order of the products of [T].

    Source: [T] 2.3, figure 2.11; numbers.md, "Recurrences in fixed point".
    """

    as_published: bool = False

    RECIPROCAL_FORMAT = UQ(0, 17)
    SLOPE_FORMAT = SQ(0, 18)
    FORMAT = SQ(2, 42)
    LENGTH_BITS = LENGTH_BITS

    @cached_property
    def reciprocals(self) -> Fixed:
        """The table: ``1/(1 + k/2048)`` at address k; 1/2 at address 0."""
        return reciprocal_table(self.RECIPROCAL_FORMAT)

    def compute(self, g: Fixed, p: Fixed, length: np.ndarray) -> tuple[Fixed, Fixed]:
        """Bit-true first and second difference.

        Parameters
        ----------
        g, p : Fixed, shape (spans, 3)
            Coefficients in the formats of `GPQ`.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.

        Returns
        -------
        first, second : Fixed, shape (spans, 3), SQ(2, 42)
            ``W_0`` and ``2 G dt^2``.

        Raises
        ------
        ValueError
            If an operand has another format or a length is out of range.
        """
        length = checked_lengths(length)
        if (g.format, p.format) != (GPQ.G_FORMAT, GPQ.P_FORMAT):
            raise ValueError(
                f"operands must be {GPQ.G_FORMAT} and {GPQ.P_FORMAT}, not {g.format}, {p.format}"
            )
        reciprocal, shift, square, square_shift = self.steps(length)
        if self.as_published:
            bend = g.extend(COMPONENT) * Fixed(reciprocal.format, reciprocal.codes[:, np.newaxis])
            bend = bend.round_half_up(18).wrap(self.SLOPE_FORMAT)
            step = Fixed(SQ(1, 29), (bend.codes << 12) >> shift[:, np.newaxis])
            slope = (step + p).round_half_up(17).saturate(COMPONENT)
            second_order = self._shifted(bend.scale(1), reciprocal, 2 * shift + 1)
            return (
                self._shifted(slope, reciprocal, shift + 1),
                second_order.scale(1).extend(SQ(3, 42)).wrap(self.FORMAT),
            )
        first_order = self._shifted(p, reciprocal, shift + 1)
        second_order = self._shifted(g.extend(COMPONENT), square, square_shift)
        return (
            (first_order + second_order).wrap(self.FORMAT),
            second_order.scale(1).extend(SQ(3, 42)).wrap(self.FORMAT),
        )

    def steps(self, length: np.ndarray) -> tuple[Fixed, np.ndarray, Fixed, np.ndarray]:
        """Bit-true ``dt = 2 reciprocal 2^-shift`` and ``dt^2 = 4 square 2^-square_shift``.

        Parameters
        ----------
        length : int64 array, any shape
            Pixels, 1 to 4095.

        Returns
        -------
        reciprocal : Fixed, same shape, UQ(0, 17)
        shift : int64 array, same shape
            0 to 12.
        square : Fixed, same shape, UQ(0, 17)
        square_shift : int64 array, same shape
            0 to 25.
        """
        address, shift = reciprocal_place(length - 1)
        reciprocal = self.reciprocals[address]
        square = reciprocal * reciprocal
        small = square < Fixed(UQ(0, 1), 1)
        square = Fixed(square.format, square.codes << small).round_half_up(17)
        return reciprocal, shift, square.saturate(self.RECIPROCAL_FORMAT), 2 * shift + small

    def _shifted(self, operand: Fixed, factor: Fixed, shift: np.ndarray) -> Fixed:
        """``4 * operand * factor * 2**-shift``, rounded half up to 42 fraction bits."""
        product = operand * Fixed(factor.format, factor.codes[:, np.newaxis])
        scaled = product.scale(2).extend(SQ(3, 43))
        return Fixed(SQ(3, 43), scaled.codes >> shift[:, np.newaxis]).round_half_up(42).wrap(self.FORMAT)
