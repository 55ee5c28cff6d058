"""Renormaliser: the vector of each pixel, divided by its length."""

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
    """Unit vector ``N = v / |v|``, for lengths of v from 2^-8 to 1: the exact normal at every pixel.

    v is shifted left until its largest component is 1/2 or more, and rounded to ``w``. With ``s = w . w``,
    1/4 to 3, the result is ``N = r w`` with ``r = (ONE/2^17) / sqrt(s)``, where ``ONE/2^17`` is the length 1
    of `unit_vector`. Let q be the octave of s, and ``m = s 2^-q``, 1 to 2. Each of the four octaves has 16
    segments of m. In each segment r is a quadratic ``c0 - x (c1 - x c2)``, with x from the start of the
    segment on.

    ============ ========== =================================================================
    word         format     why
    ============ ========== =================================================================
    v            SQ(1, 22)  a normal of 1/256 of the largest length has 14 bits left
    w            SQ(1, 17)  multiplier operand; rounded; saturates
    s            SQ(4, 34)  exact
    x            UQ(-4, 21) 17 bits for the multipliers; cut
    c0           UQ(1, 18)  fitted last, to compensate the rounding of c1 and c2
    c1           UQ(1, 16)  its error is multiplied by 1/16
    c2           UQ(1, 11)  its error is multiplied by 1/256
    c1 - x c2    UQ(1, 16)  17 bits for the multiplier; rounded
    r            UQ(1, 16)  17 bits for the multipliers; 0.577 to 2; rounded
    N            SQ(1, 17)  rounded; saturates
    ============ ========== =================================================================

    A vector with all components from -`SHORTEST` to under `SHORTEST` is flagged. Its N is invalid. For other
    vectors the error of direction is at most `DIRECTION_ERROR` radians, without the rounding of v. w has a
    length of 1/2 or more. Its rounding adds ``sqrt(3) 2^-18``, and the rounding of N adds as much. The length
    error is at most `LENGTH_ERROR`: the error of r times |w|, up to sqrt(3), plus the rounding of N.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    VECTOR_FORMAT = SQ(1, 22)
    OCTAVES = 4
    SEGMENT_BITS = 4
    OFFSET_FORMAT = UQ(-4, 21)
    C0_FORMAT = UQ(1, 18)
    C1_FORMAT = UQ(1, 16)
    C2_FORMAT = UQ(1, 11)
    FACTOR_FORMAT = UQ(1, 16)
    FORMAT = COMPONENT
    SHORTEST = 2.0**-8
    MAX_SHIFT = 7
    FIT = 6.0e-6
    DIRECTION_ERROR = 3 * np.sqrt(3) * 2.0**-18
    LENGTH_ERROR = np.sqrt(3) * (FIT + 2.0**-21 + 2.0**-17 / 16 + 2.0**-17 + 2.0**-18)

    @cached_property
    def coefficients(self) -> tuple[Fixed, Fixed, Fixed]:
        """Coefficients ``c0, c1, c2`` of every segment, shape (64,) each, by octave and segment.

        c2 comes from the Chebyshev series of a segment. This is nearly a minimax fit, because the segment is
        short. c1 follows from the linear term and the rounded c2. c0 centres the remaining error.
        """
        width = 2.0**-self.SEGMENT_BITS
        x = chebyshev.chebpts2(33)
        u = width / 2 * (1 + x)[:, np.newaxis]
        segments = np.arange(1 << self.SEGMENT_BITS)
        octave, start = (part.ravel() for part in np.meshgrid(range(self.OCTAVES), segments, indexing="ij"))
        exact = ONE * COMPONENT.step / np.sqrt((1 + width * start + u) * 2.0 ** (octave - 2))
        series = chebyshev.chebfit(x, exact, 6)
        # u^2 is (width/2)^2 (3/2 T0 + 2 T1 + 1/2 T2).
        c2 = Fixed.round(self.C2_FORMAT, 8 / width**2 * series[2])
        c1 = Fixed.round(self.C1_FORMAT, width * c2.values - 2 / width * series[1])
        rest = exact + u * (c1.values - u * c2.values)
        return Fixed.round(self.C0_FORMAT, (rest.min(axis=0) + rest.max(axis=0)) / 2), c1, c2

    def scaled(self, vector: Fixed) -> tuple[Fixed, np.ndarray]:
        """The scaled vector w, and whether a vector is too short.

        Parameters
        ----------
        vector : Fixed, shape (..., 3), SQ(1, 22)
            Vectors v.
        """
        if vector.format != self.VECTOR_FORMAT:
            raise ValueError(f"operand must be {self.VECTOR_FORMAT}, not {vector.format}")
        magnitude = np.bitwise_or.reduce(np.where(vector.codes < 0, ~vector.codes, vector.codes), axis=-1)
        bits = np.frexp(magnitude.astype(np.float64))[1]
        shift = self.VECTOR_FORMAT.fraction_bits - bits
        too_short = shift > self.MAX_SHIFT
        shift = np.minimum(shift, self.MAX_SHIFT)[..., np.newaxis]
        word = Fixed(self.VECTOR_FORMAT, vector.codes << shift).round_half_up(COMPONENT.fraction_bits)
        return word.saturate(COMPONENT), too_short

    def factor(self, square: Fixed) -> Fixed:
        """Bit-accurate r of squared lengths.

        Parameters
        ----------
        square : Fixed, any shape, SQ(4, 34)
            s. Under 1/4 it counts as a value of the lowest octave, and r is invalid.
        """
        codes = square.codes
        octave = sum((codes >> (33 + k)) > 0 for k in range(self.OCTAVES - 1))
        fraction = (codes >> octave) >> 11
        bits = self.OFFSET_FORMAT.width
        segment = (fraction >> bits) & ((1 << self.SEGMENT_BITS) - 1)
        c0, c1, c2 = (c[(octave << self.SEGMENT_BITS) + segment] for c in self.coefficients)
        x = Fixed(self.OFFSET_FORMAT, fraction & ((1 << bits) - 1))
        slope = (c1 - x * c2).round_half_up(self.C1_FORMAT.fraction_bits).wrap(self.C1_FORMAT)
        return (c0 - x * slope).round_half_up(self.FACTOR_FORMAT.fraction_bits).saturate(self.FACTOR_FORMAT)

    def compute(self, vector: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate unit vectors.

        Parameters
        ----------
        vector : Fixed, shape (..., 3), SQ(1, 22)
            Vectors v.

        Returns
        -------
        normal : Fixed, shape (..., 3), SQ(1, 17)
            N.
        out_of_range : bool array, shape (...)
            Whether v is too short.

        Raises
        ------
        ValueError
            If the operand has another format.
        """
        word, too_short = self.scaled(vector)
        r = self.factor(DotProduct().compute(word, word))
        r = Fixed(r.format, r.codes[..., np.newaxis])
        return (word * r).round_half_up(COMPONENT.fraction_bits).saturate(self.FORMAT), too_short
