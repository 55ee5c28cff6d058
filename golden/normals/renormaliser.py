"""Renormaliser: a vector of about unit length divided by its length, each pixel by itself."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev

from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE

__all__ = ["Renormaliser"]


@dataclass(frozen=True)
class Renormaliser:
    """Unit vector ``N = v/sqrt(s)``, ``s = v . v``: the baseline, a normal divided by its length.

    Computed as ``N = v + e v`` with ``e = (ONE/2^17)/sqrt(s) - 1``, small where v is nearly a unit vector in
    the codes of `unit_vector`. e is a quadratic ``c0 - u (c1 - u c2)`` in each of 18 segments of s, 1/32
    wide, u from the start of the segment. Linear interpolation across spans up to 90 degrees needs the 16
    segments from 1/2 to 1; one more on either side is for the rounding of the ends.

    ============ ========== =================================================================
    word         format     why
    ============ ========== =================================================================
    s            SQ(4, 34)  exact
    u            UQ(-5, 22) 17 bits for the multipliers; cut
    c0           SQ(0, 20)  fitted last, for what the others' rounding leaves
    c1           UQ(1, 16)  its error counts 1/32
    c2           UQ(2, 10)  its error counts 1/1024
    c1 - u c2    UQ(1, 16)  17 bits for the multiplier; rounded
    e            SQ(0, 18)  18 bits for the multipliers; -0.016 to 0.461; rounded
    N            SQ(1, 17)  rounded; saturates
    ============ ========== =================================================================

    Lengths from 0.685 to 1.0155 are in range (`LOW` <= s < `HIGH`). Any other vector is flagged and stays as
    it is.

    The length of N is off by at most `ERROR`, 2^-16.3: |v| times the error of e, which is that of the fit
    (|v| times it is at most `FIT`), the cut of u (2^-22 times c1, which is ``1/(2 |v|^3)``), the rounding of
    ``c1 - u c2`` (2^-17 times 1/32) and of e (2^-19); then the rounding of three components,
    ``sqrt(3) 2^-18``, which alone changes the direction.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    SEGMENT_BITS = 5
    SEGMENTS = 18
    LOW = 15 / 32
    HIGH = 33 / 32
    OFFSET_FORMAT = UQ(-5, 22)
    C0_FORMAT = SQ(0, 20)
    C1_FORMAT = UQ(1, 16)
    C2_FORMAT = UQ(2, 10)
    FACTOR_FORMAT = SQ(0, 18)
    FORMAT = COMPONENT
    FIT = 3.0e-6
    ERROR = FIT + 2.0**-22 / (2 * LOW) + np.sqrt(HIGH) * (2.0**-22 + 2.0**-19) + np.sqrt(3) * 2.0**-18

    @staticmethod
    def factor(square: np.ndarray) -> np.ndarray:
        """Exact ``e`` in float64 of a squared length s."""
        return ONE * COMPONENT.step / np.sqrt(square) - 1

    @cached_property
    def coefficients(self) -> tuple[Fixed, Fixed, Fixed]:
        """Coefficients ``c0, c1, c2`` of every segment, shape (18,) each.

        The Chebyshev series of a segment, nearly a minimax fit as the segment is short, gives c2; c1 follows
        from its linear term and the rounded c2, and c0 is the middle of the error that is left.
        """
        width = 2.0**-self.SEGMENT_BITS
        x = chebyshev.chebpts2(33)
        u = width / 2 * (1 + x)[:, np.newaxis]
        exact = self.factor(self.LOW + width * np.arange(self.SEGMENTS) + u)
        series = chebyshev.chebfit(x, exact, 6)
        # u^2 is (width/2)^2 (3/2 T0 + 2 T1 + 1/2 T2).
        c2 = Fixed.round(self.C2_FORMAT, 8 / width**2 * series[2])
        c1 = Fixed.round(self.C1_FORMAT, width * c2.values - 2 / width * series[1])
        rest = exact + u * (c1.values - u * c2.values)
        return Fixed.round(self.C0_FORMAT, (rest.min(axis=0) + rest.max(axis=0)) / 2), c1, c2

    def correction(self, square: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate ``e`` of squared lengths.

        Parameters
        ----------
        square : Fixed, any shape, SQ(4, 34)
            s.

        Returns
        -------
        correction : Fixed, same shape, SQ(0, 18)
            e; 0 for a length out of range.
        out_of_range : bool array, same shape
            Whether the length is out of range.
        """
        low = Fixed(UQ(0, 22), UQ(0, 22).code(self.LOW))
        offset = (square.truncate(22) - low).codes
        bits = self.OFFSET_FORMAT.width
        segment = offset >> bits
        out_of_range = (segment < 0) | (segment >= self.SEGMENTS)
        c0, c1, c2 = (c[np.where(out_of_range, 0, segment)] for c in self.coefficients)
        u = Fixed(self.OFFSET_FORMAT, offset & ((1 << bits) - 1))
        slope = (c1 - u * c2).round_half_up(16)
        slope = slope.wrap(self.C1_FORMAT)
        e = (c0 - u * slope).round_half_up(18).wrap(self.FACTOR_FORMAT)
        return Fixed(e.format, np.where(out_of_range, 0, e.codes)), out_of_range

    def compute(self, vector: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate unit vectors.

        Parameters
        ----------
        vector : Fixed, shape (..., 3), SQ(1, 17)
            Vectors v.

        Returns
        -------
        normal : Fixed, shape (..., 3), SQ(1, 17)
            N; v itself where ``out_of_range``.
        out_of_range : bool array, shape (...)
            Whether the length of v is out of range.

        Raises
        ------
        ValueError
            If the operand has another format.
        """
        e, out_of_range = self.correction(DotProduct().compute(vector, vector))
        e = Fixed(e.format, e.codes[..., np.newaxis])
        return (vector + e * vector).round_half_up(17).saturate(self.FORMAT), out_of_range
