"""Line setup: the difference from pixel to pixel along a straight line between two vectors."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.reciprocal import reciprocal_address, reciprocal_table
from blysk.golden.number.spans import checked_lengths

__all__ = ["LineSetup", "quantise_line"]


def quantise_line(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Codes of the ends of straight lines, in ``SQ(1, 22)``, scaled so that the longer end has length 1.

    Parameters
    ----------
    left, right : float64 arrays, shape (spans, 3)
        Vectors at the two ends; not both 0.
    """
    length = np.maximum(np.linalg.norm(left, axis=1), np.linalg.norm(right, axis=1))[:, np.newaxis]
    one = Renormaliser.VECTOR_FORMAT.max_code
    return tuple(np.rint(end / length * one).astype(np.int64) for end in (left, right))


@dataclass(frozen=True)
class LineSetup:
    """First difference ``W = P dt``, ``P = N_r - N_l``, of vectors in ``SQ(1, 22)``; ``dt = 1/(m - 1)``.

    The vector may be short at one end of the line. A renormaliser magnifies every error at that end. So P and
    dt have more bits than a multiplier's operand. This takes three products a component, nine a span.

    ========== ============ ============================================================
    word       format       why
    ========== ============ ============================================================
    P          SQ(2, 22)    exact; two words, SQ(2, 15) and UQ(-15, 22)
    reciprocal UQ(0, 24)    r in ``dt = 2 r 2^-shift``; two words of 17 and 7 bits
    P r        SQ(2, 39)    without the product of the two lower words, under 2^-32
    W          SQ(2, 40)    at pixel k its rounding adds up to ``k 2^-41``
    ========== ============ ============================================================

    The error of a point of the line at any pixel is at most `ERROR`, for P up to 2 in a component. It is the
    sum of ``2^-24 |P|`` by the reciprocal, 2^-31 by the product that is left out, and ``4094 2^-41`` by the
    drift.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    VECTOR_FORMAT = Renormaliser.VECTOR_FORMAT
    P_FORMAT = SQ(2, 22)
    HIGH_FORMAT = SQ(2, 15)
    LOW_FORMAT = UQ(-15, 22)
    RECIPROCAL_FORMAT = UQ(0, 24)
    RECIPROCAL_HIGH_FORMAT = UQ(0, 17)
    RECIPROCAL_LOW_FORMAT = UQ(-17, 24)
    FORMAT = SQ(2, 40)
    ERROR = float(np.sqrt(3) * (2.0**-23 + 2.0**-31 + 4094 * 2.0**-41))

    def compute(self, left: Fixed, right: Fixed, length: np.ndarray) -> Fixed:
        """Bit-accurate first difference W.

        Parameters
        ----------
        left, right : Fixed, shape (spans, 3), SQ(1, 22)
            Ends of the line.
        length : int array, shape (spans,)
            Pixels m, 1 to 4095; 1 counts as 2.

        Returns
        -------
        Fixed, shape (spans, 3), SQ(2, 40)

        Raises
        ------
        ValueError
            If an operand has another format or a length is out of range.
        """
        if {left.format, right.format} != {self.VECTOR_FORMAT}:
            raise ValueError(f"operands must be {self.VECTOR_FORMAT}")
        address, shift = reciprocal_address(checked_lengths(length) - 1)
        reciprocal = reciprocal_table(self.RECIPROCAL_FORMAT)[address].codes[:, np.newaxis]
        p = (right - left).codes
        bits = self.LOW_FORMAT.width
        high, low = Fixed(self.HIGH_FORMAT, p >> bits), Fixed(self.LOW_FORMAT, p & ((1 << bits) - 1))
        r_high = Fixed(self.RECIPROCAL_HIGH_FORMAT, reciprocal >> bits)
        r_low = Fixed(self.RECIPROCAL_LOW_FORMAT, reciprocal & ((1 << bits) - 1))
        total = high * r_high + high * r_low + low * r_high
        # 2^(1 - shift), rounded half up to 40 fraction bits from 41.
        shifted = (total.codes << 3) >> shift[:, np.newaxis]
        return Fixed(self.FORMAT, self.FORMAT.wrap((shifted + 1) >> 1))
