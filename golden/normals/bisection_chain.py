"""Chain of bisections: repeated halving towards the left end of a span, in closed form ([T] 2.1)."""

from dataclasses import dataclass, field

import numpy as np

from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.polynomials import half_angle_factor
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED

__all__ = ["BisectionChain"]


@dataclass(frozen=True)
class BisectionChain:
    """Normal at ``psi / 2^k`` from the left end of a span: ``N_k = (L_k N_l + N_r) / M_k``.

    ``M_k = 2 M_(k-1) cos(psi/2^k)``, ``L_k = L_(k-1) + M_(k-1)``, ``M_0 = 1``, ``L_0 = 0``. M and L grow as
    2^k. So the unit holds the weights, ``l = L/M`` and ``m = 1/M``. With
    ``f_k = 1 / (2 cos(psi/2^k)) = 1/2 + e``, the factor of `Bisection`,

    ``l_k = (l_(k-1) + 1) f_k``, ``m_k = m_(k-1) f_k``. This takes no division, and both stay in [0, 1].

    The cosine of half the angle comes from the same factor: with ``u = 1 - cos``,
    ``u_(k+1) = u_k/2 - (1 + cos) e``. One dot product of the two normals is needed at the start, and six
    products at the end.

    ============= ========== ================================================================
    word          format     why
    ============= ========== ================================================================
    u, l, m       SQ(2, 20)  three bits below the operands; rounded
    operands      SQ(1, 17)  18 bits of u, ``cos``, ``(l + 1)/2``, ``m/2`` (cut), l, m (rounded); saturate
    e             SQ(-1, 19) as in `Bisection`
    N             SQ(1, 17)  rounded, saturates
    ============= ========== ================================================================

    `error` bounds the error of a component: at most 1.2e-4 to 45 degrees, 2.9e-4 to 90.
    docs/theory/bounds.md#chain-of-bisections derives it. The published coefficients of degree 2 have larger
    errors.

    Ends of length ``1 + x`` give normals whose length is off by x/2 to x. An end of length 0 counts as 90
    degrees away, as in `Bisection`.

    Parameters
    ----------
    bisection : Bisection
        Bisection unit with the factor: degree, widest span, coefficients.

    Source: docs/theory/interpolation.md#bisection; [T] 2.1.
    """

    bisection: Bisection = field(default_factory=Bisection)

    WEIGHT_FORMAT = SQ(2, 20)
    LEVEL_BITS = 4
    FORMAT = COMPONENT

    def error(self, level: int, first_step: bool) -> float:
        """Bound on the error of a component of ``N_k`` against the exact function of the two code vectors.

        Parameters
        ----------
        level : int
            k, 1 to 15.
        first_step : bool
            Whether spans are 45 to 90 degrees wide, in place of up to 45 degrees.
        """
        p = self.bisection
        one = ONE_SQUARED.values.item()
        half = 2.0**-21
        u_error, l_error, m_error, cosine = half, 0.0, 0.0, 0.0 if first_step else np.sqrt(0.5)
        weight_l, weight_m = 0.0, 1.0
        for k in range(1, level + 1):
            first = first_step and k == 1
            constant, rest = p.polynomial(first)
            # Angles of this step: all angles up to the widest, or the angles of the first step.
            cosines = np.linspace(cosine, np.sqrt(0.5) if first else 1.0, 2001)
            x = one * (cosines if p.reads_cosine(first) else 1 - cosines)
            exact = half_angle_factor(1 - cosines) - 0.5
            fitted = np.polynomial.polynomial.polyval(x, np.r_[constant.values, rest.values])
            slope = (0.3536 if first else 0.1585) * (1.2 if p.as_published else 1)
            # e has four errors of its own: of the fit, of u or r in 17 bits, of the sums, and of its
            # rounding. The error of u comes from the step before.
            own_error = (
                np.abs(fitted - exact).max()
                + slope * 2.0**-18 * (1 + p.reads_cosine(first))
                + 2.0**-19 * 1.21
                + 2.0**-20
            )
            e_error = own_error + slope * u_error
            e = exact.max()
            # A step multiplies an error of u by about a quarter, because e follows u: by 0.28, in the first
            # step by 0.37. The 17-bit r, 1 in place of `ONE_SQUARED`, and two roundings add to the error.
            u_error = (0.37 if first else 0.28) * u_error + 2 * own_error + e * 2.0**-15 + 2 * half
            rounding = 2 * e * 2.0**-17 + 2.0**-21 + half
            l_error = (0.5 + e) * l_error + (weight_l + l_error + 1) * e_error + rounding
            m_error = (0.5 + e) * m_error + (weight_m + m_error) * e_error + rounding
            # Largest weights: l < 1 always, m at the widest span.
            weight_l, weight_m = 1 - 2.0**-k, weight_m * (0.5 + e)
            cosine = np.sqrt((1 + cosine) / 2)
        return float(l_error + m_error + 3 * 2.0**-18)

    def compute(self, normal_left: Fixed, normal_right: Fixed, level: np.ndarray) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate normals.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (spans, 3), SQ(1, 17)
            Unit normals of the span's ends.
        level : int array, shape (spans,)
            k, 1 to 15.

        Returns
        -------
        normal : Fixed, shape (spans, 3), SQ(1, 17)
            ``N_k``.
        out_of_range : bool array, shape (spans,)
            Whether the span is wider than the bisection's `max_angle`. The normal is then undefined.

        Raises
        ------
        ValueError
            If an operand has another format or a level is out of range.
        """
        level = np.asarray(level, dtype=np.int64)
        if level.size and not 1 <= level.min() <= level.max() < 1 << self.LEVEL_BITS:
            raise ValueError(f"levels must be 1 to {(1 << self.LEVEL_BITS) - 1}")
        p, word = self.bisection, self.WEIGHT_FORMAT
        dot = DotProduct().compute(normal_left, normal_right)
        u = (ONE_SQUARED - dot).round_half_up(20).saturate(word)
        weight_l = Fixed(word, np.zeros_like(level))
        weight_m = Fixed(word, np.full_like(level, word.code(1)))
        out_of_range = np.zeros(level.shape, dtype=bool)
        for k in range(1, int(level.max(initial=0)) + 1):
            angle = u.round_half_up(17).saturate(p.ANGLE_FORMAT)
            e, flag = p.factor(angle)
            if k == 1:
                out_of_range = flag
            cosine = (p.ONE - angle).saturate(p.OPERAND_FORMAT)
            going = k <= level

            def kept(new: Fixed, old: Fixed, going: np.ndarray = going) -> Fixed:
                return Fixed(old.format, np.where(going, new.codes, old.codes))

            narrower = u.scale(-1) - e - (cosine * e).truncate(21)
            u = kept(narrower.round_half_up(20).saturate(word), u)
            half_l = (weight_l + Fixed(word, word.code(1))).scale(-1)
            weight_l = kept(self._scaled(half_l, e), weight_l)
            weight_m = kept(self._scaled(weight_m.scale(-1), e), weight_m)

        def scale(weight: Fixed, normal: Fixed) -> Fixed:
            factor = weight.round_half_up(17).saturate(COMPONENT)
            return Fixed(COMPONENT, factor.codes[..., np.newaxis]) * normal

        total = scale(weight_l, normal_left) + scale(weight_m, normal_right)
        return total.round_half_up(17).saturate(self.FORMAT), out_of_range

    def _scaled(self, half: Fixed, e: Fixed) -> Fixed:
        """Product of a word and the factor of `Bisection`: ``2 half (1/2 + e)``."""
        operand = half.truncate(17).saturate(COMPONENT)
        total = half + (operand * e).scale(1).truncate(21)
        return total.round_half_up(20).saturate(self.WEIGHT_FORMAT)
