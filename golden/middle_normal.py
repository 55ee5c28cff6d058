"""Middle normal of a span through the h polynomial ([T] 2.2)."""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from .dot_product import DotProduct
from .fixed import SQ, UQ, Fixed
from .polynomials import half_angle_factor, minimax_quantised
from .unit_vector import COMPONENT, ONE_SQUARED

__all__ = ["MAX_SPAN_ANGLE", "MiddleNormal"]

MAX_SPAN_ANGLE = 45.0
"""Largest angle between the end normals of a span, in degrees, for which the formats are made."""


@dataclass(frozen=True)
class MiddleNormal:
    """``N_c = h(r) (N_l + N_r)`` with ``h = 1/sqrt(2 (1 + r))`` and ``r = N_l . N_r``.

    Computed as ``N_c = (N_l + N_r)/2 + e(u) (N_l + N_r)`` with ``u = 1 - r``. The polynomial
    ``e = h - 1/2 = u (c1 + u (c2 + u c3))`` is exact at angle 0, where neighbouring normals of a mesh live,
    and fitted up to `MAX_SPAN_ANGLE`.

    ======== ============= ==========================================================
    word     format        why
    ======== ============= ==========================================================
    u        UQ(-1, 18)    17 bits for the multiplier; holds angles to 60 degrees
    c, sums  UQ(-2, 19)    17 bits; the sums stay under 0.14
    e        UQ(-4, 21)    17 bits; at most 0.0412 at 45 degrees
    E        F = 19        ``-4 E`` and ``4 E`` then have 17 fraction bits, exactly
    N_c      SQ(1, 19)
    ======== ============= ==========================================================

    Arithmetic error of a component of ``N_c`` against the exact function of the same two code vectors, for
    angles to 45 degrees, under `ERROR`: e is off by the fit (8.3e-7), by u cut to 18 fraction bits (times
    the slope 0.18), by two roundings of sums (2^-20 u and 2^-20 u^2) and by its own (2^-22), and is
    multiplied by a component of ``N_l + N_r``, at most 2; ``(N_l + N_r)/2`` is cut by up to 2^-18 and
    multiplied by 2 e <= 0.0824; the last rounding adds 2^-20.

    A wider span is flagged; u and N_c then saturate.

    Source: [T] 2.2; numbers.md, "exact at zero angle".
    """

    ANGLE_FORMAT = UQ(-1, 18)
    SUM_FORMAT = UQ(-2, 19)
    FACTOR_FORMAT = UQ(-4, 21)
    FORMAT = SQ(1, 19)
    ERROR = (
        2 * (8.3e-7 + 2.0**-18 * 0.18 + 2.0**-20 * (0.293 + 0.293**2) + 2.0**-22)
        + 2.0**-18 * 0.0824
        + 2.0**-20
    )

    @property
    def coefficients(self) -> Fixed:
        """``c1, c2, c3``, fitted in words of the hardware."""
        return Fixed(self.SUM_FORMAT, _coefficients())

    @cached_property
    def widest(self) -> Fixed:
        """Largest ``u`` that is not flagged: that of `MAX_SPAN_ANGLE` and the rounding of two normals."""
        limit = 1 - np.cos(np.radians(MAX_SPAN_ANGLE)) + 4 * COMPONENT.step
        return Fixed.round(self.ANGLE_FORMAT, limit)

    def compute(self, normal_left: Fixed, normal_right: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-true middle normals.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (..., 3), SQ(1, 17)
            Unit normals of the span's ends.

        Returns
        -------
        normal_middle : Fixed, shape (..., 3), SQ(1, 19)
            Middle normals.
        wide : bool array, shape (...)
            Whether the span is wider than `MAX_SPAN_ANGLE`: the normal is then saturated.
        """
        dot = DotProduct().compute(normal_left, normal_right)
        difference = (ONE_SQUARED - dot).truncate(self.ANGLE_FORMAT.fraction_bits)
        u = difference.saturate(self.ANGLE_FORMAT)
        c1, c2, c3 = (self.coefficients[i] for i in range(3))
        total = (u * c3).round_half_up(19) + c2
        total = (u * total.wrap(self.SUM_FORMAT)).round_half_up(19) + c1
        e = (u * total.wrap(self.SUM_FORMAT)).round_half_up(21).saturate(self.FACTOR_FORMAT)
        half_sum = (normal_left + normal_right).scale(-1)
        e = Fixed(e.format, e.codes[..., np.newaxis])
        correction = (e * half_sum.truncate(17).saturate(COMPONENT)).scale(1).round_half_up(19)
        return (half_sum + correction).saturate(self.FORMAT), u > self.widest


@cache
def _coefficients() -> np.ndarray:
    # The unit reads u in units of `ONE_SQUARED`.
    one = ONE_SQUARED.values
    return minimax_quantised(
        lambda u: half_angle_factor(u / one),
        0.0,
        one * (1 - np.cos(np.radians(MAX_SPAN_ANGLE))),
        dict.fromkeys((1, 2, 3), MiddleNormal.SUM_FORMAT),
        held={0: 0.5},
    )
