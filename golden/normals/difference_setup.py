"""First values of the forward differences of a quadratic normal curve ([T] figure 2.11)."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.normals.gpq import GPQ
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.reciprocal import step_words
from blysk.golden.number.spans import checked_lengths
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["DifferenceSetup"]


@dataclass(frozen=True)
class DifferenceSetup:
    """First differences ``W_0 = P dt + G dt^2`` and ``2 G dt^2``, ``dt = 1/(m - 1)``, of spans of m pixels.

    [T] has ``W_0 = (G dt + P) dt``. Here W_0 is a sum of two products. So one multiplier computes all: the
    square of dt, three products with P and three with G. dt and its square come from `step_words`. Products
    are shifted and rounded half up to 42 fraction bits.

    ======== ============ ===========================================================
    word     format       why
    ======== ============ ===========================================================
    W_0      SQ(2, 42)    at most 1.5; differences grow with the square of the length
    2 G dt^2 SQ(2, 42)    at most 1
    ======== ============ ===========================================================

    The error at the end of the curve is less than ``2^-17 |P| + (2^-16 + 2^-17 + 2^-34) |G|``, by dt and
    dt^2. The rounding of the differences adds, at pixel k, at most ``2^-42 (k + k^2/2)``, 1.9e-6 after 4095
    pixels.

    A span of one pixel is computed with dt = 1. Nothing reads its differences.

    With ``as_published`` the order of figure 2.11 is kept, ``W_0 = (G dt + P) dt`` and ``2 (G dt) dt``. This
    takes nine products in place of seven. docs/theory/bounds.md#difference-setup has its words and bound.

    Parameters
    ----------
    as_published : bool
        Whether products are in the order of [T].

    Source: docs/theory/interpolation.md#forward-differences; [T] 2.3, figure 2.11.
    """

    as_published: bool = False

    CURVATURE_FORMAT = SQ(0, 18)
    FORMAT = SQ(2, 42)

    def compute(self, g: Fixed, p: Fixed, length: np.ndarray) -> tuple[Fixed, Fixed]:
        """Bit-accurate first and second difference.

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
        reciprocal, shift, square, square_shift = step_words(length)
        if self.as_published:
            curvature = g.extend(COMPONENT) * Fixed(reciprocal.format, reciprocal.codes[:, np.newaxis])
            curvature = curvature.round_half_up(18).wrap(self.CURVATURE_FORMAT)
            step = Fixed(SQ(1, 29), (curvature.codes << 12) >> shift[:, np.newaxis])
            slope = (step + p).round_half_up(17).saturate(COMPONENT)
            first = self._shifted(slope, reciprocal, shift + 1)
            second_order = self._shifted(curvature.scale(1), reciprocal, 2 * shift + 1)
        else:
            first_order = self._shifted(p, reciprocal, shift + 1)
            second_order = self._shifted(g.extend(COMPONENT), square, square_shift)
            first = (first_order + second_order).wrap(self.FORMAT)
        return first, second_order.scale(1).extend(SQ(3, 42)).wrap(self.FORMAT)

    def _shifted(self, operand: Fixed, factor: Fixed, shift: np.ndarray) -> Fixed:
        """``4 * operand * factor * 2**-shift``, rounded half up to 42 fraction bits."""
        product = operand * Fixed(factor.format, factor.codes[:, np.newaxis])
        scaled = product.scale(2).extend(SQ(3, 43))
        return Fixed(SQ(3, 43), scaled.codes >> shift[:, np.newaxis]).round_half_up(42).wrap(self.FORMAT)
