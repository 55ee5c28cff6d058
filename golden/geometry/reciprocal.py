"""Reciprocal of a number from 1 to 2, by a quadratic in each of 256 segments."""

from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev

from blysk.golden.number.fixed import SQ, UQ, Fixed

__all__ = ["Reciprocal"]


class Reciprocal:
    """Reciprocal ``1/x``, ``1 <= x < 2``, as ``c0 - u (c1 - u c2)``. u is 0 in the middle of a segment.

    ============ ============ =====================================================================
    word         format       why
    ============ ============ =====================================================================
    x            UQ(1, 25)    first bit 1; the next 8 are the segment
    u            SQ(-8, 25)   the other 17, the first of them inverted: -2^-9 to 2^-9
    c0           UQ(0, 28)    fitted last, to the remainder after c1 and c2 are rounded
    c1           UQ(0, 19)
    c2           UQ(0, 10)    below 1, as x is over 1; its error is multiplied by 2^-18
    c1 - u c2    UQ(0, 17)    17 bits for the multiplier; rounded; its error is multiplied by 2^-9
    1/x          UQ(1, 25)    rounded; 1 for x = 1
    ============ ============ =====================================================================

    The error is at most `ERROR`, 0.875 steps of the result. It is the sum of three errors:

    - 2^-27 for the rounding of the slope: 2^-18 times 2^-9;
    - less than 2^-28 for the fit and the rounding of c0;
    - 2^-26 for the last rounding.

    The unit takes two multiplications.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    SEGMENT_BITS = 8
    FORMAT = UQ(1, 25)
    OFFSET_FORMAT = SQ(-8, 25)
    C0_FORMAT = UQ(0, 28)
    C1_FORMAT = UQ(0, 19)
    C2_FORMAT = UQ(0, 10)
    SLOPE_FORMAT = UQ(0, 17)
    ERROR = 2.0**-26 + 2.0**-27 + 2.0**-28

    @cached_property
    def coefficients(self) -> tuple[Fixed, Fixed, Fixed]:
        """Coefficients ``c0, c1, c2`` of every segment, shape (256,) each."""
        segments = 1 << self.SEGMENT_BITS
        middle = 1 + (np.arange(segments) + 0.5) / segments
        half = 0.5 / segments
        u = half * chebyshev.chebpts2(33)[:, np.newaxis]
        exact = 1 / (middle + u)
        series = chebyshev.chebfit(u[:, 0] / half, exact, 5)
        # u^2 is half^2 (T0 + T2)/2.
        c2 = Fixed.round(self.C2_FORMAT, np.minimum(2 / half**2 * series[2], 1 - self.C2_FORMAT.step))
        left = exact - u**2 * c2.values
        c1 = Fixed.round(self.C1_FORMAT, -chebyshev.chebfit(u[:, 0] / half, left, 5)[1] / half)
        left = left + u * c1.values
        return Fixed.round(self.C0_FORMAT, (left.min(axis=0) + left.max(axis=0)) / 2), c1, c2

    def compute(self, x: Fixed) -> Fixed:
        """Bit-accurate reciprocals.

        Parameters
        ----------
        x : Fixed, any shape, UQ(1, 25)
            Numbers from 1 on.

        Returns
        -------
        Fixed, same shape, UQ(1, 25)

        Raises
        ------
        ValueError
            If the operand has another format or is less than 1.
        """
        if x.format != self.FORMAT or (x.codes.size and x.codes.min() < 1 << 25):
            raise ValueError(f"operands must be {self.FORMAT}, from 1 on")
        bits = self.OFFSET_FORMAT.width
        segment = (x.codes >> bits) & ((1 << self.SEGMENT_BITS) - 1)
        u = Fixed(self.OFFSET_FORMAT, (x.codes & ((1 << bits) - 1)) - (1 << (bits - 1)))
        c0, c1, c2 = (c[segment] for c in self.coefficients)
        slope = (c1 - u * c2).round_half_up(17).wrap(self.SLOPE_FORMAT)
        return (c0 - u * slope).round_half_up(25).wrap(self.FORMAT)
