"""Middle normal of a span through the h polynomial ([T] 2.2)."""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.polynomials import half_angle_factor, largest_error, minimax, minimax_quantised
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED

__all__ = ["MAX_SPAN_ANGLE", "MIDDLE_NORMAL_FITS", "MiddleNormal"]

MIDDLE_NORMAL_FITS = ("exact", "as_published", "minimax_2", "minimax_3")
"""Names of the polynomials for h."""

_PUBLISHED = (0.707, -0.341, 0.193, -0.059)
"""Coefficients of ``h(r)`` as [T] prints them, in ascending powers of r."""

MAX_SPAN_ANGLE = 45.0
"""Largest angle between the end normals of a span, in degrees, for which the formats are made."""


@dataclass(frozen=True)
class MiddleNormal:
    """Middle normal ``N_c = h(r) (N_l + N_r)``, ``h = 1/sqrt(2 (1 + r))``, ``r = N_l . N_r``.

    The unit computes ``N_c = (N_l + N_r)/2 + e(u) (N_l + N_r)`` with ``u = 1 - r``. Most spans of a mesh are
    narrow. So the polynomial ``e = h - 1/2 = u (c1 + u (c2 + u c3))`` is exact at angle 0, and fitted up to
    `MAX_SPAN_ANGLE`.

    ======== ============= ==========================================================
    word     format        why
    ======== ============= ==========================================================
    u        UQ(-1, 18)    17 bits for the multiplier; holds angles to 60 degrees
    c, sums  UQ(-2, 19)    17 bits; the sums are less than 0.15
    e        UQ(-4, 21)    17 bits; at most 0.0412 at 45 degrees
    N_c      SQ(1, 19)     ``4 N_c`` has 17 fraction bits, exactly
    ======== ============= ==========================================================

    The error of a component of ``N_c``, against the exact function of the same two code vectors, is at most
    `ERROR` for angles up to 45 degrees. docs/theory/bounds.md#middle-normal derives it.

    A wider span is flagged. u and N_c then saturate.

    Ends of length ``1 + x`` have a middle normal of length ``1 + x/(1 + r)``. If u would be negative, the
    middle normal is half the sum of the ends, and at most as long as the ends. A span with an end of length 0
    is flagged.

    The other fits are for comparison, and need the same hardware. docs/theory/bounds.md#middle-normal has a
    table of their `model_error`. The fit of [T] is exact at angle 0, too. A plain minimax fit has an error
    there, and its e is ``SQ(-3, 21)``, 18 bits.

    Parameters
    ----------
    fit : str
        One of `MIDDLE_NORMAL_FITS`: a fit that is exact at angle 0, the coefficients of [T], or a plain
        minimax fit of degree 2 or 3.

    Raises
    ------
    ValueError
        If ``fit`` is unknown.

    Source: docs/theory/interpolation.md#middle-normal; [T] 2.2.
    """

    fit: str = "exact"

    ANGLE_FORMAT = UQ(-1, 18)
    SUM_FORMAT = UQ(-2, 19)
    FACTOR_FORMAT = UQ(-4, 21)
    FORMAT = SQ(1, 19)
    ARITHMETIC_ERROR = (
        2 * (2.0**-18 * 0.18 + 2.0**-20 * (0.293 + 0.293**2) + 2.0**-22) + 2.0**-18 * 0.0824 + 2.0**-20
    )
    """Bound on the error of a component against the same polynomial in exact arithmetic."""
    ERROR = 2 * 8.3e-7 + ARITHMETIC_ERROR
    """Bound on the error of a component with the fit that is exact at angle 0."""

    def __post_init__(self) -> None:
        if self.fit not in MIDDLE_NORMAL_FITS:
            raise ValueError(f"fit must be one of {', '.join(MIDDLE_NORMAL_FITS)}, not {self.fit!r}")

    @property
    def coefficients(self) -> Fixed:
        """Coefficients ``c1, c2, c3``, shape (3,), UQ(-2, 19)."""
        return Fixed(self.SUM_FORMAT, _coefficients(self.fit)[1])

    @property
    def constant(self) -> Fixed:
        """Constant of ``e``, its value at angle 0. It is 0 except for the plain minimax fits."""
        return Fixed(self.factor_format, _coefficients(self.fit)[0])

    @property
    def factor_format(self) -> Format:
        """Format of ``e``: `FACTOR_FORMAT`, or ``SQ(-3, 21)`` where a fit can make e negative."""
        return SQ(-3, 21) if self.fit.startswith("minimax") else self.FACTOR_FORMAT

    @property
    def model_error(self) -> float:
        """Largest error of ``1/2 + e`` as a polynomial in exact arithmetic, up to `MAX_SPAN_ANGLE`."""
        one = ONE_SQUARED.values.item()
        coefficients = np.r_[0.5 + self.constant.values, self.coefficients.values] * one ** np.arange(4)
        widest = 1 - np.cos(np.radians(MAX_SPAN_ANGLE))
        return largest_error(half_angle_factor, coefficients, 0.0, widest)[0]

    @property
    def error(self) -> float:
        """Bound on the error of a component against the exact function of the same two code vectors."""
        # e multiplies the error of the half sum's dropped bits. e may be too large by the fit's error.
        return 2 * (1 + 2.0**-18) * self.model_error + self.ARITHMETIC_ERROR

    @cached_property
    def widest(self) -> Fixed:
        """Largest ``u`` that is not flagged: u at `MAX_SPAN_ANGLE`, plus a margin for rounded normals."""
        limit = 1 - np.cos(np.radians(MAX_SPAN_ANGLE)) + 4 * COMPONENT.step
        return Fixed.round(self.ANGLE_FORMAT, limit)

    def compute(self, normal_left: Fixed, normal_right: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate middle normals.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (..., 3), SQ(1, 17)
            Unit normals of the span's ends.

        Returns
        -------
        normal_middle : Fixed, shape (..., 3), SQ(1, 19)
            Middle normals.
        out_of_range : bool array, shape (...)
            Whether the span is wider than `MAX_SPAN_ANGLE`. The normal is then saturated.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        dot = DotProduct().compute(normal_left, normal_right)
        difference = (ONE_SQUARED - dot).truncate(self.ANGLE_FORMAT.fraction_bits)
        u = difference.saturate(self.ANGLE_FORMAT)
        c1, c2, c3 = (self.coefficients[i] for i in range(3))
        total = (u * c3).round_half_up(19) + c2
        total = (u * total.wrap(self.SUM_FORMAT)).round_half_up(19) + c1
        e = (u * total.wrap(self.SUM_FORMAT)).round_half_up(21) + self.constant
        e = e.saturate(self.factor_format)
        half_sum = (normal_left + normal_right).scale(-1)
        e = Fixed(e.format, e.codes[..., np.newaxis])
        correction = (e * half_sum.truncate(17).saturate(COMPONENT)).scale(1).round_half_up(19)
        return (half_sum + correction).saturate(self.FORMAT), u > self.widest


@cache
def _coefficients(fit: str) -> tuple[int, np.ndarray]:
    """Code of the constant of e, and codes of c1, c2, c3."""
    # The word of u is u times `ONE_SQUARED`.
    one = ONE_SQUARED.values.item()
    if fit == "exact":
        codes = minimax_quantised(
            lambda u: half_angle_factor(u / one),
            0.0,
            one * (1 - np.cos(np.radians(MAX_SPAN_ANGLE))),
            dict.fromkeys((1, 2, 3), MiddleNormal.SUM_FORMAT),
            held={0: 0.5},
        )
        return 0, codes
    if fit == "as_published":
        in_u = np.polynomial.Polynomial(_PUBLISHED)(np.polynomial.Polynomial([1, -1])).coef
    else:
        in_u = minimax(half_angle_factor, 0.0, 1.0, int(fit[-1]))
    in_u = np.pad(in_u, (0, 4 - len(in_u))) / one ** np.arange(4)
    constant = Fixed.round(SQ(-3, 21), in_u[0] - 0.5)
    return constant.codes.item(), Fixed.round(MiddleNormal.SUM_FORMAT, in_u[1:]).codes
