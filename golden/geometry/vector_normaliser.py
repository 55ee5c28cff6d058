"""Vector normaliser: a vector of any length brought to unit length."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT, ONE

__all__ = ["VectorNormaliser"]


@dataclass(frozen=True)
class VectorNormaliser:
    """Unit vector ``v / |v|``, by a shift, a reciprocal root in 384 linear segments, and products.

    The components are shifted left together, by at most 15 places, until a component has no second sign bit.
    Then they are rounded to 18 bits. Their squared length s is then 1/4 to 3. Let ``s' = s``, or ``s' = s /
    4`` if s is 1 or more. The table gives ``f = (ONE/2^17) / sqrt(s')``. The result is ``v + e v`` with ``e =
    f - 1``, or with ``e = f/2 - 1`` if s is 1 or more.

    ============ ============ =====================================================================
    word         format       why
    ============ ============ =====================================================================
    v            SQ(1, 26)    shifted left by 0 to 15
    shifted v    SQ(1, 17)    18 bits for the multipliers; rounded half up; saturates to ONE
    s            SQ(4, 34)    exact
    s'           UQ(0, 20)    cut; the first 9 bits are the segment
    u            SQ(-9, 21)   the other bits of s' less the segment's middle, plus half a step for the cut
    f            UQ(1, 20)    ``c0 - c1 u``
    c1           UQ(2, 9)     its error is multiplied by 2^-10
    e            SQ(1, 17)    18 bits for the multipliers; rounded; no factor overflows
    v / |v|      SQ(1, 17)    rounded half up; saturates to ONE
    ============ ============ =====================================================================

    A vector whose components are all in [-2^-16, 2^-16) is *lost*, because it has too few bits for a
    direction.

    The length of the result is off by at most `LENGTH_ERROR`, 2^-15.7, its direction by at most
    `DIRECTION_ERROR`, 2^-15.6. docs/theory/bounds.md#vector-normaliser derives both.

    The unit takes six multiplications. Adders make a further product of 12 by 11 bits.

    Parameters
    ----------
    format : Format
        Number format of the components, signed, with one or two integer bits.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    format: Format = SPAN_NORMAL

    LARGEST_SHIFT = 15
    SEGMENT_BITS = 9
    SQUARE_FORMAT = UQ(0, 20)
    OFFSET_FORMAT = SQ(-9, 21)
    C0_FORMAT = UQ(1, 20)
    C1_FORMAT = UQ(2, 9)
    FACTOR_FORMAT = SQ(1, 17)
    FIT = 24 * 2.0**-18 / 16 / 2 + 2.0**-22 + 2.0**-21
    LENGTH_ERROR = FIT + 2.0**-19 + 1.74 * 2.0**-18 + np.sqrt(3) * 2.0**-18
    DIRECTION_ERROR = np.sqrt(3) * (2.0**-17 + 2.0**-18)

    @cached_property
    def coefficients(self) -> tuple[Fixed, Fixed]:
        """Coefficients of the segments from 1/4 to 1, shape (512,) each. The first 128 are 0 and not used."""
        segments = 1 << self.SEGMENT_BITS
        middle = (np.arange(segments // 4, segments) + 0.5) / segments
        u = np.linspace(-0.5, 0.5, 65)[:, np.newaxis] / segments
        exact = ONE * COMPONENT.step / np.sqrt(middle + u)
        # The best line has the slope of the chord.
        c1 = Fixed.round(self.C1_FORMAT, (exact[0] - exact[-1]) * segments)
        left = exact + c1.values * u
        c0 = Fixed.round(self.C0_FORMAT, (left.min(axis=0) + left.max(axis=0)) / 2)
        unused = np.zeros(segments // 4, dtype=int)
        return Fixed(c0.format, np.r_[unused, c0.codes]), Fixed(c1.format, np.r_[unused, c1.codes])

    def shifted(self, vector: Fixed) -> tuple[Fixed, np.ndarray]:
        """Components shifted left together until one fills the word, SQ(1, 17), and flags of lost vectors."""
        codes, width = vector.codes, self.format.width - 1
        ones = np.bitwise_or.reduce(np.where(codes < 0, ~codes, codes), axis=-1)
        length = np.frexp(ones.astype(np.float64))[1].astype(np.int64)
        lost = width - length > self.LARGEST_SHIFT
        shift = np.minimum(width - length, self.LARGEST_SHIFT)
        scaled = Fixed(SQ(1, width), codes << shift[..., np.newaxis])
        rounded = scaled.round_half_up(COMPONENT.fraction_bits).codes
        return Fixed(COMPONENT, np.clip(rounded, -ONE, ONE)), lost

    def factor(self, square: Fixed) -> Fixed:
        """Bit-accurate ``e`` of squared lengths, ``SQ(4, 34)``."""
        s = square.truncate(22).codes
        large = s >> 22 > 0
        s = np.where(large, s >> 2, s) >> 2
        bits = self.OFFSET_FORMAT.width - 1
        segment, rest = s >> bits, s & ((1 << bits) - 1)
        u = Fixed(self.OFFSET_FORMAT, 2 * (rest - (1 << (bits - 1))) + 1)
        c0, c1 = (c[segment] for c in self.coefficients)
        f = (c0 - (c1 * u).truncate(20)).wrap(self.C0_FORMAT).codes
        one = 1 << 20
        # The result is in steps of 2^-21, so that f keeps all its bits when it is halved.
        e = Fixed(SQ(2, 21), np.where(large, f - 2 * one, 2 * (f - one)))
        return e.round_half_up(17).wrap(self.FACTOR_FORMAT)

    def compute(self, vector: Fixed, flip: np.ndarray) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate unit vectors.

        Parameters
        ----------
        vector : Fixed, shape (..., 3), `format`
            Vectors v.
        flip : bool array, shape (...)
            Whether the result is negated.

        Returns
        -------
        normal : Fixed, shape (..., 3), SQ(1, 17)
            From ``-ONE`` to ``ONE``; without meaning for a lost vector.
        lost : bool array, shape (...)
            Whether the vector has no direction.

        Raises
        ------
        ValueError
            If the operand has another format.
        """
        if vector.format != self.format:
            raise ValueError(f"operands must be {self.format}, not {vector.format}")
        v, lost = self.shifted(vector)
        e = self.factor(DotProduct().compute(v, v))
        product = Fixed(e.format, e.codes[..., np.newaxis]) * v
        total = (v + product).codes
        turned = Fixed((v + product).format, np.where(np.asarray(flip)[..., np.newaxis], -total, total))
        rounded = turned.round_half_up(COMPONENT.fraction_bits)
        return Fixed(COMPONENT, np.clip(rounded.codes, -ONE, ONE)), lost
