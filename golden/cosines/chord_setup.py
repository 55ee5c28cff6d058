"""Chord setup: forward differences of N·L and of half the squared chord from N to H, for each span."""

from dataclasses import dataclass
from functools import cache
from typing import ClassVar, NamedTuple

import numpy as np

from blysk.golden.cosines.chord import Chord
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.polynomials import half_angle_factor, largest_error, minimax_quantised
from blysk.golden.number.reciprocal import step_words
from blysk.golden.number.spans import LENGTH_BITS, checked_lengths
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED

__all__ = ["ChordSetup", "Differences", "largest_span_angle"]


def largest_span_angle(exponent: int) -> float:
    """Widest span, in degrees, that the quadratic fit shades well: ``min(15, 20 n^(-1/6))``.

    The fit differs from exactly normalised interpolation by about ``c sqrt(n) psi^3`` LSB in the specular
    term, at most 0.25 LSB at this angle, and by at most 0.12 LSB in the diffuse term, at full reflection.

    Parameters
    ----------
    exponent : int
        n, 1 to 1000.

    Source: docs/theory/chord.md#error-bound.
    """
    return min(15.0, 20.0 * exponent ** (-1 / 6))


class Differences(NamedTuple):
    """Start value and first two differences of a quadratic, each a Fixed of shape (spans, lights)."""

    start: Fixed
    first: Fixed
    second: Fixed


@dataclass(frozen=True)
class ChordSetup:
    """Quadratics through the exact values at t = 0, 1/2 and 1 of ``f = N·L`` and ``u = |N - H|^2 / 2``.

    For unit vectors ``u = 1 - N·H``, but u depends on the length of a normal only at second order, and near
    the peak of a highlight it is not a difference of nearly equal numbers. With ``w = |N_r - N_l|^2 / 2`` and
    the middle normal ``h (N_l + N_r)``, ``h = 1/2 + e(w)``, the values in the middle need no middle normal:

    - ``u = u_l + P t + G t^2`` with ``G = 4 e (2 - u_l - u_r)`` and ``P = (u_r - u_l) - G``;
    - ``f = f_l + P t + G t^2`` with ``G = -4 e (f_l + f_r)`` and ``P = (f_r - f_l) - G``.

    P is the *slope* at t = 0 and G the *curvature*, half the second derivative. The first difference is
    ``P dt + G dt^2``, the second ``2 G dt^2``, with dt and dt^2 of `step_words`. A span needs 7 products, and
    19 for each light, all of 18 bits or less. ``e = w (c1 + w (c2 + w c3))`` is exact at angle 0 and fitted
    up to `MAX_ANGLE`. With fewer terms, for scenes of narrow spans, it is fitted as closely up to a smaller
    angle (`ANGLES`); each term less saves a product.

    ============= ============ =====================================================================
    word          format       why
    ============= ============ =====================================================================
    u, w          UQ(2, 35)    of `Chord`
    f             SQ(2, 34)    exact
    w             UQ(-3, 20)   for the polynomial; 17 bits, rounded; to 0.076
    c, sums       UQ(-2, 19)   17 bits
    e             UQ(-6, 23)   17 bits; at most 0.0098
    2 - u_l - u_r SQ(2, 16)    multiplier operand, cut; so is f_l + f_r
    G             SQ(-2, 20)   multiplier operand; at most 0.079
    P of u        SQ(0, 35)    two words of 18 and 17 bits: every bit counts at the end of a span
    P of f        SQ(0, 18)    multiplier operand; rounded
    differences   SQ(1, 46)    at pixel k their rounding adds up to ``2^-46 (k + k^2/2)``: 1.2e-7; fewer
                               fraction bits are enough for scenes of short spans
    ============= ============ =====================================================================

    Error of u at any pixel against the quadratic through the exact values: `highlight_error`; of f:
    `diffuse_error`.

    A span over `max_angle` is flagged; its words saturate or wrap. Vectors need not be of unit length, but
    start values saturate at lengths far from 1.

    Parameters
    ----------
    terms : int
        Terms of the polynomial, 1 to 3.
    fraction_bits : int
        Fraction bits of the differences, 36 to 46; even, as a span of twice the length needs two more.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Source: docs/theory/chord.md#differences; [Lyon93].
    """

    terms: int = 3
    fraction_bits: int = 46

    CHORD_FORMAT = Chord.FORMAT
    COSINE_FORMAT = SQ(2, 34)
    ANGLE_FORMAT = UQ(-3, 20)
    SUM_FORMAT = UQ(-2, 19)
    FACTOR_FORMAT = UQ(-6, 23)
    OPERAND_FORMAT = SQ(2, 16)
    CURVATURE_FORMAT = SQ(-2, 20)
    SLOPE_FORMAT = SQ(0, 35)
    HIGH_FORMAT = SQ(0, 18)
    LOW_FORMAT = UQ(-18, 35)
    MAX_ANGLE = 22.5
    ANGLES: ClassVar = {1: 3.0, 2: 12.0, 3: MAX_ANGLE}

    def __post_init__(self):
        if self.terms not in self.ANGLES:
            raise ValueError(f"terms must be 1 to 3, not {self.terms}")
        if self.fraction_bits not in range(36, 47, 2):
            raise ValueError(f"fraction_bits must be even and 36 to 46, not {self.fraction_bits}")

    @property
    def max_angle(self) -> float:
        """Widest span in degrees that is not flagged."""
        return self.ANGLES[self.terms]

    @property
    def format(self) -> Format:
        """Format of the differences."""
        return SQ(1, self.fraction_bits)

    @property
    def longest(self) -> int:
        """Longest span in pixels for which the error bounds hold: it drifts by less than 1.3e-7."""
        return (1 << LENGTH_BITS - (46 - self.fraction_bits) // 2) - 1

    @property
    def shifted_format(self) -> Format:
        """Format of products before their shift: one fraction bit more than the differences, for rounding."""
        return SQ(2, self.fraction_bits + 1)

    def shifted(self, product: Fixed) -> Fixed:
        """A product in `shifted_format`, cut."""
        if product.format.fraction_bits > self.shifted_format.fraction_bits:
            product = product.truncate(self.shifted_format.fraction_bits)
        return product.extend(self.shifted_format)

    @property
    def coefficients(self) -> Fixed:
        """``c1, c2, c3``, or as many as there are terms, fitted in words of the hardware."""
        return Fixed(self.SUM_FORMAT, _coefficients(self.terms))

    @property
    def widest(self) -> Fixed:
        """Largest ``w`` that is not flagged."""
        return Fixed.round(self.ANGLE_FORMAT, 1 - np.cos(np.radians(self.max_angle)) + 4 * COMPONENT.step)

    def compute(
        self, normal_left: Fixed, normal_right: Fixed, direction: Fixed, halfway: Fixed, length: np.ndarray
    ) -> tuple[Differences, Differences, np.ndarray]:
        """Bit-accurate differences of f and of u.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (spans, 3), SQ(1, 17)
            Unit normals of the spans' ends.
        direction, halfway : Fixed, shape (lights, 3), SQ(1, 17)
            Unit vectors L and H of each light.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.

        Returns
        -------
        diffuse, highlight : Differences
            Of f and of u.
        out_of_range : bool array, shape (spans,)
            Whether a span is over `max_angle`; its differences are then invalid.

        Raises
        ------
        ValueError
            If an operand has another format or a length is out of range.
        """
        length = checked_lengths(length)
        if {v.format for v in (normal_left, normal_right, direction, halfway)} != {COMPONENT}:
            raise ValueError(f"operands must be {COMPONENT}")
        w = Chord().compute(normal_right, normal_left).round_half_up(20).saturate(self.ANGLE_FORMAT)
        out_of_range = w > self.widest
        coefficients = [self.coefficients[i] for i in range(self.terms)]
        total = coefficients.pop()
        while coefficients:
            total = ((w * total).round_half_up(19) + coefficients.pop()).wrap(self.SUM_FORMAT)
        e = (w * total).round_half_up(23).saturate(self.FACTOR_FORMAT)
        e = Fixed(e.format, e.codes[:, np.newaxis])

        left, right = (Fixed(COMPONENT, n.codes[:, np.newaxis]) for n in (normal_left, normal_right))
        steps = self.steps(length)
        u_left, u_right = Chord().compute(left, halfway), Chord().compute(right, halfway)
        two = Fixed(UQ(2, 35), 2 << 35)
        two_minus_sum = (two - (u_left + u_right)).truncate(16).saturate(self.OPERAND_FORMAT)
        curvature = (e * two_minus_sum).scale(2).round_half_up(20).saturate(self.CURVATURE_FORMAT)
        slope = (u_right - u_left - curvature).wrap(self.SLOPE_FORMAT)
        highlight = self.differences(u_left, slope, curvature, *steps)

        f_left, f_right = (
            DotProduct().compute(n, direction).saturate(self.COSINE_FORMAT) for n in (left, right)
        )
        f_sum = (f_left + f_right).truncate(16).saturate(self.OPERAND_FORMAT)
        curvature = (-(e * f_sum).scale(2)).round_half_up(20).saturate(self.CURVATURE_FORMAT)
        slope = (f_right - f_left - curvature).round_half_up(18).wrap(self.HIGH_FORMAT)
        diffuse = self.differences(f_left, slope.extend(self.SLOPE_FORMAT), curvature, *steps)
        return diffuse, highlight, out_of_range

    def highlight_error(self, angle: float, u: np.ndarray = 2.0) -> np.ndarray:
        """Largest error of u at any pixel against the quadratic through the exact values.

        The exact values are those of the vectors' directions, in units of `ONE_SQUARED`, as u is. Lengths
        are off by at most d, half a step. With ``E`` for the error of a word:

        - ends, ``(d_l - d_r)^2/2 + (d_l + d_r) u``: ``E_u = 2 d^2 + 2 d (1 + d) u``, and from ``u = 1/2`` on,
          where a component may reach 1, the cut of `Chord`;
        - ``E_w = 2^-21 + 2 d^2 + 2 d (1 + d) w``: the rounding of w and the lengths;
        - ``E_e``: the fit; ``E_w`` times the largest slope ``(4 - 2 w)^(-3/2)``; three roundings,
          ``(w + w^2) 2^-20 + 2^-24``;
        - ``2 - u_l - u_r``: ``2 E_u``, the cut, 2^-16, and 2^-15 because 2 stands for ``2 ONE_SQUARED``;
        - ``E_G``: ``8 E_e``, 4 e times the error of ``2 - u_l - u_r``, and 2^-21 for the rounding.

        G does not move the ends, so its error counts as ``E_G t (1 - t)``, at most a quarter of it. The error
        of dt is a relative 2^-17 of P and ``2^-16 + 2^-17 + 2^-34`` of G, with ``|G| <= 8 e`` and ``|P - G|``
        at most the chord of the angle, or u. The drift is added to these.

        Parameters
        ----------
        angle : float
            Widest span in degrees, up to `max_angle`.
        u : array
            Larger u of a span's two ends; the error grows with it.
        """
        d = COMPONENT.step / 2 * (1 + 2.0**-10)
        end = 2 * d**2 + 2 * d * (1 + d) * np.asarray(u, dtype=np.float64)
        far = np.sqrt(3) * COMPONENT.step * 2 + 3 * 2.0**-35
        end = end + far * (np.asarray(u) >= 0.5 - 2.0**-15)
        chord = 2 * np.sin(np.radians(angle) / 2)
        e, e_error = self._factor_error(angle)
        curvature_error = 8 * e_error + 4 * e * (2 * end + 2.0**-16 + 2.0**-15) + 2.0**-21
        return end + curvature_error / 4 + self.walk_error(np.minimum(chord, u) + 8 * e, 8 * e)

    def diffuse_error(self, angle: float) -> float:
        """Largest error of f at any pixel against the quadratic through the exact values.

        As `highlight_error`, but the ends are off by ``E_f = 2 d + d^2``, the sum ``f_l + f_r`` by
        ``2 E_f + 2^-16`` only, and the rounding of P adds 2^-19.

        Parameters
        ----------
        angle : float
            Widest span in degrees, up to `max_angle`.
        """
        d = COMPONENT.step / 2 * (1 + 2.0**-10)
        end = 2 * d + d**2
        chord = 2 * np.sin(np.radians(angle) / 2)
        e, e_error = self._factor_error(angle)
        curvature_error = 8 * e_error + 4 * e * (2 * end + 2.0**-16) + 2.0**-21
        return float(end + curvature_error / 4 + 2.0**-19 + self.walk_error(chord + 8 * e, 8 * e))

    def _factor_error(self, angle: float) -> tuple[float, float]:
        """Largest e up to an angle, and the largest error of e."""
        one = float(ONE_SQUARED.values)
        w = one * (1 - np.cos(np.radians(angle)))
        d = COMPONENT.step / 2 * (1 + 2.0**-10)
        coefficients = np.r_[0.5, self.coefficients.values]
        fit, _ = largest_error(lambda w: half_angle_factor(w / one), coefficients, 0.0, w)
        moved = (2.0**-21 + 2 * d**2 + 2 * d * (1 + d) * w) * (4 - 2 * w / one) ** -1.5 / one
        rounded = (w + w**2) * 2.0**-20 + 2.0**-24
        return float(half_angle_factor(w / one)) - 0.5, fit + moved + rounded

    def walk_error(self, slope: np.ndarray, curvature: np.ndarray) -> np.ndarray:
        """Error at the end of a span that dt and the rounding of the differences cause, for `longest` pixels.

        ``2^-17 |P| + (2^-16 + 2^-17 + 2^-34) |G|`` for dt, ``2^-fraction_bits (k + k^2/2)`` for the drift.

        Parameters
        ----------
        slope, curvature : arrays
            Absolute values of P and G.
        """
        last = self.longest - 1
        drift = self.format.step * (last + last**2 / 2)
        return 2.0**-17 * slope + (2.0**-16 + 2.0**-17 + 2.0**-34) * curvature + drift

    @staticmethod
    def steps(length: np.ndarray) -> tuple[Fixed, np.ndarray, Fixed, np.ndarray]:
        """Words of ``dt = 2 reciprocal 2^-shift`` and ``dt^2 = 4 square 2^-square_shift`` for all lights.

        Parameters
        ----------
        length : int64 array, shape (spans,)
            Pixels, 1 to 4095.

        Returns
        -------
        reciprocal : Fixed
        shift : int64 array
        square : Fixed
        square_shift : int64 array
            Of `step_words`, in shape (spans, 1).
        """
        reciprocal, shift, square, square_shift = step_words(length)
        return (
            Fixed(reciprocal.format, reciprocal.codes[:, np.newaxis]),
            shift[:, np.newaxis],
            Fixed(square.format, square.codes[:, np.newaxis]),
            square_shift[:, np.newaxis],
        )

    def differences(
        self,
        start: Fixed,
        slope: Fixed,
        curvature: Fixed,
        reciprocal: Fixed,
        shift: np.ndarray,
        square: Fixed,
        square_shift: np.ndarray,
    ) -> Differences:
        """Bit-accurate differences ``P dt + G dt^2`` and ``2 G dt^2``.

        Parameters
        ----------
        start, slope, curvature : Fixed, shape (spans, lights)
            Value at t = 0, in any format; P in `SLOPE_FORMAT`; G in `CURVATURE_FORMAT`.
        reciprocal, shift, square, square_shift
            As `steps` gives them.
        """
        high = Fixed(self.HIGH_FORMAT, slope.codes >> 17) * reciprocal
        low = Fixed(self.LOW_FORMAT, slope.codes & self.LOW_FORMAT.max_code) * reciprocal
        first_order = (high + low.truncate(48)).scale(1)
        second_order = (curvature * square).scale(2)
        first_order, second_order = (
            Fixed(self.shifted_format, self.shifted(value).codes >> shift)
            .round_half_up(self.fraction_bits)
            .wrap(self.format)
            for value, shift in ((first_order, shift), (second_order, square_shift))
        )
        return Differences(
            start,
            (first_order + second_order).wrap(self.format),
            second_order.scale(1).extend(SQ(2, self.fraction_bits)).wrap(self.format),
        )


@cache
def _coefficients(terms: int) -> np.ndarray:
    # The unit reads w in units of `ONE_SQUARED`.
    one = ONE_SQUARED.values
    return minimax_quantised(
        lambda w: half_angle_factor(w / one),
        0.0,
        one * (1 - np.cos(np.radians(ChordSetup.ANGLES[terms]))),
        dict.fromkeys(range(1, terms + 1), ChordSetup.SUM_FORMAT),
        held={0: 0.5},
    )
