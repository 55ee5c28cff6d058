"""Bisection unit: the normal half-way between two others ([T] figure 2.6)."""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.polynomials import half_angle_factor, largest_error, minimax_quantised
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED

__all__ = ["Bisection"]

_PUBLISHED = {1: (0.64, -0.07), 2: (0.681, -0.119, 0.014)}
"""Coefficients of ``1/sqrt(2 + z)`` as [T] prints them, in ascending powers of z, by degree."""

_PUBLISHED_FIRST_STEP = (0.707, -0.341, 0.193, -0.059)
"""Coefficients of ``h(r)`` as [T] prints them, in ascending powers of r."""


@dataclass(frozen=True)
class Bisection:
    """Normal half-way between two: ``N = (N_a + N_b) / sqrt(2 + z)``, ``z = 2 r``, ``r = N_a . N_b``.

    The unit computes ``N = (N_a + N_b)/2 + e (N_a + N_b)`` with ``e = 1/sqrt(2 + z) - 1/2``. So the word of e
    holds a small number. ``u = 1 - r`` chooses between two polynomials for e, in Horner's form:

    - up to 45 degrees (z in [sqrt 2, 2]) of degree 1 or 2 in u, without a constant: exact at angle 0;
    - from 45 to 90 degrees, the first step of a wide span, a cubic in r for the same function, written
      ``h(r) = 1/sqrt(2 (1 + r))``.

    With ``as_published`` both are polynomials in r with the published coefficients (as z = 2 r, a coefficient
    of z^i is multiplied by 2^i).

    A span wider than `max_angle` by more than the rounding of its normals is flagged. Its result is
    undefined.

    Ends of length ``1 + x`` have a middle normal of length ``1 + x/(1 + r)``. So up to 45 degrees 0.5 to 0.59
    of the length error remains. An end of length 0 counts as 90 degrees away. It is flagged if `max_angle` is
    45. Else the result is 0.7071 times the other end.

    ============= ========== ================================================================
    word          format     why
    ============= ========== ================================================================
    u             SQ(2, 17)  up to 2, for opposite normals
    u or r        SQ(1, 17)  operand of the multiplier, 18 bits
    c, sums       SQ(0, 18)  18 bits; under 0.35 if the span is not flagged; wrap
    e             SQ(-1, 19) 18 bits; at most 0.0412 at 45 degrees, 0.2072 at 90; wraps
    N             SQ(1, 17)  so that the unit can bisect its own results; saturates
    ============= ========== ================================================================

    One factor scales both ends. So its error changes only the length of N, unless a component saturates at 1.

    `model_error`, `arithmetic_error` and `error` have the bounds; docs/theory/bounds.md#bisection derives
    them.

    Parameters
    ----------
    degree : int
        1 or 2: degree of the polynomial for spans up to 45 degrees.
    max_angle : int
        90, or 45 for a unit without the first step and its multiplications.
    as_published : bool
        Whether the coefficients come from [T].

    Raises
    ------
    ValueError
        If ``degree`` or ``max_angle`` is another number.

    Source: docs/theory/interpolation.md#bisection; [T] 2.1, figure 2.6.
    """

    degree: int = 2
    max_angle: int = 90
    as_published: bool = False

    ANGLE_FORMAT = SQ(2, 17)
    OPERAND_FORMAT = SQ(1, 17)
    SUM_FORMAT = SQ(0, 18)
    FACTOR_FORMAT = SQ(-1, 19)
    FORMAT = COMPONENT
    ONE = ONE_SQUARED.round_half_up(17).wrap(OPERAND_FORMAT)
    """Dot product of a unit vector with itself, in the word of r."""

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise ValueError(f"degree must be 1 or 2, not {self.degree!r}")
        if self.max_angle not in (45, 90):
            raise ValueError(f"max_angle must be 45 or 90, not {self.max_angle!r}")

    @property
    def steps(self) -> int:
        """Multiplications of Horner's form, the larger degree of the two polynomials."""
        return self.degree if self.max_angle == 45 else 3

    @staticmethod
    def _limit(angle: float) -> Fixed:
        """``u`` at an angle, plus a margin for the rounding of two normals."""
        return Fixed.round(Bisection.ANGLE_FORMAT, 1 - np.cos(np.radians(angle)) + 4 * COMPONENT.step)

    @cached_property
    def widest_narrow(self) -> Fixed:
        """Largest ``u`` for the polynomial of spans up to 45 degrees."""
        return self._limit(45)

    @cached_property
    def widest(self) -> Fixed:
        """Largest ``u`` that is not flagged."""
        return self._limit(self.max_angle)

    def reads_cosine(self, first_step: bool) -> bool:
        """Whether a polynomial takes r in place of u."""
        return first_step or self.as_published

    def polynomial(self, first_step: bool) -> tuple[Fixed, Fixed]:
        """Coefficients of e.

        Parameters
        ----------
        first_step : bool
            Whether the polynomial is for 45 to 90 degrees, in place of spans up to 45 degrees.

        Returns
        -------
        constant : Fixed, shape (), SQ(-1, 19)
            Coefficient of power 0.
        rest : Fixed, shape (steps,), SQ(0, 18)
            Coefficients of the powers 1, 2, ... of u or r (see `reads_cosine`), padded with 0.
        """
        constant, rest = _polynomials(self)[first_step]
        return constant, rest[: self.steps]

    def model_error(self, first_step: bool, widest: float = 90.0) -> float:
        """Largest error of the factor ``1/2 + e`` as a polynomial in exact arithmetic, up to an angle.

        Parameters
        ----------
        first_step : bool
            As for `polynomial`.
        widest : float
            Widest span in degrees.
        """
        one = ONE_SQUARED.values.item()
        low, high = (45, float(np.clip(widest, 45, 90))) if first_step else (0, min(widest, 45.0))
        low, high = (1 - np.cos(np.radians(angle)) for angle in (low, high))
        constant, rest = _polynomials(self)[first_step]
        coefficients = np.r_[constant.values + 0.5, rest.values]
        coefficients = coefficients * one ** np.arange(len(coefficients))
        if self.reads_cosine(first_step):
            return largest_error(lambda r: half_angle_factor(1 - r), coefficients, 1 - high, 1 - low)[0]
        return largest_error(half_angle_factor, coefficients, low, high)[0]

    def arithmetic_error(self, first_step: bool) -> float:
        """Bound on the error of a component of N against the same polynomial in exact arithmetic."""
        cosine = self.reads_cosine(first_step)
        slope, e = (0.3536, 0.2072) if first_step else (0.1585, 0.0412)
        x = (0.7072 if first_step else 1.0) if cosine else 0.2930
        # The slopes of the published polynomials differ from the function's by less than a fifth.
        slope *= 1.2 if self.as_published else 1.0
        factor = 2.0**-18 * (1 + cosine) * slope + 2.0**-19 * (x + x * x) + 2.0**-20
        return 2 * factor + 2.0**-18 * 2 * e + 2.0**-21 + 2.0**-18

    def error(self, first_step: bool) -> float:
        """Bound on the error of a component of N against the exact function of the same two code vectors."""
        return 2 * self.model_error(first_step) + self.arithmetic_error(first_step)

    def factor(self, u: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate ``e`` and flag.

        Parameters
        ----------
        u : Fixed, any shape, SQ(2, 17)
            One minus the cosine of the span angle.

        Returns
        -------
        e : Fixed, same shape, SQ(-1, 19)
            ``1/sqrt(2 + z) - 1/2``.
        out_of_range : bool array, same shape
            Whether the span is wider than `max_angle`.
        """
        first_step = (u > self.widest_narrow) & (self.max_angle == 90)
        cosine = (self.ONE - u).saturate(self.OPERAND_FORMAT)
        (constant, rest), (first_constant, first_rest) = map(self.polynomial, (False, True))
        codes = np.where(first_step | self.as_published, cosine.codes, u.saturate(self.OPERAND_FORMAT).codes)
        x = Fixed(self.OPERAND_FORMAT, codes)

        def coefficient(power: int) -> Fixed:
            codes = np.where(first_step, first_rest.codes[power - 1], rest.codes[power - 1])
            return Fixed(self.SUM_FORMAT, codes)

        total = coefficient(self.steps)
        for power in range(self.steps - 1, 0, -1):
            total = ((x * total).round_half_up(18) + coefficient(power)).wrap(self.SUM_FORMAT)
        constant = Fixed(self.FACTOR_FORMAT, np.where(first_step, first_constant.codes, constant.codes))
        e = ((x * total).round_half_up(19) + constant).wrap(self.FACTOR_FORMAT)
        return e, u > self.widest

    def compute(self, normal_a: Fixed, normal_b: Fixed) -> tuple[Fixed, Fixed, np.ndarray]:
        """Bit-accurate middle normals.

        Parameters
        ----------
        normal_a, normal_b : Fixed, shape (..., 3), SQ(1, 17)
            Unit normals.

        Returns
        -------
        normal_middle : Fixed, shape (..., 3), SQ(1, 17)
            Normals half-way between them.
        one_minus_cosine : Fixed, shape (...), SQ(2, 17)
            ``u``.
        out_of_range : bool array, shape (...)
            Whether the two normals are further apart than `max_angle`. The middle normal is then undefined.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        dot = DotProduct().compute(normal_a, normal_b)
        u = (ONE_SQUARED - dot).round_half_up(17).saturate(self.ANGLE_FORMAT)
        e, out_of_range = self.factor(u)
        half_sum = (normal_a + normal_b).scale(-1)
        e = Fixed(e.format, e.codes[..., np.newaxis])
        correction = (e * half_sum.truncate(17)).scale(1).truncate(21)
        return (half_sum + correction).round_half_up(17).saturate(self.FORMAT), u, out_of_range


@cache
def _polynomials(bisection: Bisection) -> tuple[tuple[Fixed, Fixed], tuple[Fixed, Fixed]]:
    """Results of `Bisection.polynomial` for narrow spans and for the first step."""
    # The words of u and r hold u and r times `ONE_SQUARED`.
    one = float(ONE_SQUARED.values)
    narrow, widest = float(bisection.widest_narrow.values), float(bisection._limit(90).values)
    if bisection.as_published:
        of_cosine = [c * 2.0**power for power, c in enumerate(_PUBLISHED[bisection.degree])]
        fits: list[tuple[float, list[float]]] = [
            (c[0] - 0.5, [c[power] / one**power for power in range(1, len(c))])
            for c in (of_cosine, _PUBLISHED_FIRST_STEP)
        ]
    else:
        codes = minimax_quantised(
            lambda u: half_angle_factor(u / one),
            0.0,
            narrow,
            dict.fromkeys(range(1, bisection.degree + 1), bisection.SUM_FORMAT),
            held={0: 0.5},
        )
        first = minimax_quantised(
            lambda r: half_angle_factor(1 - r / one),
            one - widest,
            one - narrow,
            {0: UQ(0, 19), 1: bisection.SUM_FORMAT, 2: bisection.SUM_FORMAT, 3: bisection.SUM_FORMAT},
        )
        step = bisection.SUM_FORMAT.step
        fits = [
            (0.0, (codes * step).tolist()),
            (first[0] * bisection.FACTOR_FORMAT.step - 0.5, (first[1:] * step).tolist()),
        ]
    narrow_spans, first_step = (
        (
            Fixed.round(bisection.FACTOR_FORMAT, constant),
            Fixed.round(bisection.SUM_FORMAT, [*rest, *[0.0] * (3 - len(rest))]),
        )
        for constant, rest in fits
    )
    return narrow_spans, first_step
