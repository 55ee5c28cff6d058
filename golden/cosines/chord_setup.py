"""Chord setup: forward differences of N·L and of half the squared chord, from three values a span."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.reciprocal import step_words
from blysk.golden.number.spans import LENGTH_BITS, checked_lengths
from blysk.golden.number.unit_vector import ONE_SQUARED

__all__ = ["ChordSetup", "Differences", "SpanValues"]


class SpanValues(NamedTuple):
    """Values of each light along a span: at its first pixel centre, its middle and its last pixel centre.

    Parameters
    ----------
    diffuse, highlight : int64 arrays, shape (spans, lights, 3)
        Codes of N·L in ``SQ(1, 25)``, and of ``u = |N - H|^2 / 2`` in ``UQ(1, 26)``. `ONE_SQUARED` is their
        unit.
    """

    diffuse: np.ndarray
    highlight: np.ndarray

    @classmethod
    def quantise(cls, diffuse: np.ndarray, highlight: np.ndarray, scale: int = 0) -> "SpanValues":
        """Nearest codes of exact values.

        Parameters
        ----------
        diffuse, highlight : float64 arrays, shape (spans, lights, 3)
            N·L from -1 to 1, and u from 0 to 2.
        scale : int
            s. If it is over 0, the words of u are ``min(2^s u, 1)``, see `LocalChordInterpolator`.

        Raises
        ------
        ValueError
            If a value is out of range.
        """
        one = float(ONE_SQUARED.values)
        if scale:
            highlight = np.minimum(np.ldexp(highlight, scale), 1)
        return cls(
            Fixed.round(ChordSetup.DIFFUSE_FORMAT, np.multiply(diffuse, one)).codes,
            Fixed.round(ChordSetup.HIGHLIGHT_FORMAT, np.multiply(highlight, one)).codes,
        )


class Differences(NamedTuple):
    """Start value, first and second difference of a quadratic, each a Fixed of shape (spans, lights)."""

    start: Fixed
    first: Fixed
    second: Fixed


@dataclass(frozen=True)
class ChordSetup:
    """Quadratics through given values of ``f = N·L`` and ``u = |N - H|^2 / 2`` at t = 0, 1/2 and 1.

    For unit vectors ``u = 1 - N·H``. But u depends on the length of a normal only at second order. Near the
    peak of a highlight u needs no difference of nearly equal numbers. f and u are each
    ``v = v_l + P t + G t^2`` with

    ``G = 2 (v_l + v_r - 2 v_m)`` and ``P = v_r - v_l - G``.

    P is the *slope* at t = 0 and G the *curvature*, half the second derivative. The first difference is
    ``P dt + G dt^2``, the second ``2 G dt^2``, with dt and dt^2 from `step_words`. This takes five products a
    light and one a span, all of 18 bits or less.

    ============ ============ =====================================================================
    word         format       why
    ============ ============ =====================================================================
    u            UQ(1, 26)    given; half a step costs ``1.25 n 255 2^-27``, 0.0024 LSB at n = 1000
    f            SQ(1, 25)    given; as many fraction bits as the N·L of a pixel
    a            SQ(1, 25)    given, for lights that fade; all formats of f hold for a
    G            SQ(-2, 20)   multiplier operand; saturates
    P of u       SQ(0, 26)    exact, two words of 18 and 8 bits: every bit counts at the end of a span;
                              saturates
    P of f       SQ(0, 18)    multiplier operand; rounded; saturates
    differences  SQ(1, 46)    at pixel k their rounding adds up to ``2^-46 (k + k^2/2)``: 1.2e-7; fewer
                              fraction bits are enough for scenes of short spans
    ============ ============ =====================================================================

    A span with ``|G| >= 1/8`` or ``|P| >= 1/2`` is flagged, and its words are invalid. No sum along a span
    wraps. u_l is in [0, 2), f_l in [-1, 1). The curve of every span, also of a flagged span, is at most
    ``|P| + |G|``, 5/8, away from its start. The sums hold -4 to 4.

    `highlight_error` and `diffuse_error` bound the errors of u and f at any pixel against the quadratic
    through the exact values.

    Parameters
    ----------
    fraction_bits : int
        Fraction bits of the differences, 36 to 46. The number is even, because a span of twice the length
        needs two more bits.

    Raises
    ------
    ValueError
        If the parameter is out of range.

    Source: docs/theory/chord.md#differences; [Lyon93].
    """

    fraction_bits: int = 46

    DIFFUSE_FORMAT = SQ(1, 25)
    HIGHLIGHT_FORMAT = UQ(1, 26)
    CURVATURE_FORMAT = SQ(-2, 20)
    SLOPE_FORMAT = SQ(0, 26)
    DIFFUSE_SLOPE_FORMAT = SQ(0, 18)
    HIGH_FORMAT = SQ(0, 18)
    LOW_FORMAT = UQ(-18, 26)
    MOST_SCALE = 6

    @classmethod
    def check_scale(cls, scale: int) -> None:
        """Refuse a scale of u that is out of range, see `LocalChordInterpolator`.

        Raises
        ------
        ValueError
            If the scale is not 0 to `MOST_SCALE`.
        """
        if scale not in range(cls.MOST_SCALE + 1):
            raise ValueError(f"scale must be 0 to {cls.MOST_SCALE}, not {scale}")

    def __post_init__(self) -> None:
        if self.fraction_bits not in range(36, 47, 2):
            raise ValueError(f"fraction_bits must be even and 36 to 46, not {self.fraction_bits}")

    @property
    def format(self) -> Format:
        """Format of the differences."""
        return SQ(1, self.fraction_bits)

    @property
    def longest(self) -> int:
        """Longest span in pixels for which the error bounds hold. Such a span drifts by less than 1.3e-7."""
        return (1 << LENGTH_BITS - (46 - self.fraction_bits) // 2) - 1

    @property
    def shifted_format(self) -> Format:
        """Format of products before their shift.

        It has one more fraction bit than the differences, for rounding.
        """
        return SQ(2, self.fraction_bits + 1)

    def shifted(self, product: Fixed) -> Fixed:
        """A product in `shifted_format`, cut."""
        if product.format.fraction_bits > self.shifted_format.fraction_bits:
            product = product.truncate(self.shifted_format.fraction_bits)
        return product.extend(self.shifted_format)

    def compute(
        self, diffuse: Fixed, highlight: Fixed, length: np.ndarray, factor: Fixed | None = None
    ) -> tuple[Any, ...]:
        """Bit-accurate differences of f and of u, and of the factors a of lights that fade.

        Parameters
        ----------
        diffuse : Fixed, shape (spans, lights, 3), SQ(1, 25)
            f at the centre of the first pixel, in the middle, and at the centre of the last pixel.
        highlight : Fixed, shape (spans, lights, 3), UQ(1, 26)
            u at the same three points.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.
        factor : Fixed, shape (spans, fading lights, 3), SQ(1, 25), optional
            a at the same three points.

        Returns
        -------
        diffuse, highlight : Differences
            Differences of f and of u.
        factor : Differences
            Differences of a, only if ``factor`` is given.
        out_of_range : bool array, shape (spans,)
            Whether P or G of the span outgrows its word. The differences are then invalid.

        Raises
        ------
        ValueError
            If an operand has another format or a length is out of range.
        """
        length = checked_lengths(length)
        if (diffuse.format, highlight.format) != (self.DIFFUSE_FORMAT, self.HIGHLIGHT_FORMAT):
            raise ValueError(
                f"operands must be {self.DIFFUSE_FORMAT} and {self.HIGHLIGHT_FORMAT}, "
                f"not {diffuse.format}, {highlight.format}"
            )
        functions = [(diffuse, self.DIFFUSE_SLOPE_FORMAT), (highlight, self.SLOPE_FORMAT)]
        if factor is not None:
            if factor.format != self.DIFFUSE_FORMAT:
                raise ValueError(f"factors must be {self.DIFFUSE_FORMAT}, not {factor.format}")
            functions.append((factor, self.DIFFUSE_SLOPE_FORMAT))
        steps = self.steps(length)
        out_of_range = np.zeros(len(length), dtype=bool)
        results = []
        for values, slope_format in functions:
            left, middle, right = (values[..., k] for k in range(3))
            exact = (left + right - middle.scale(1)).scale(1)
            exact = exact.round_half_up(self.CURVATURE_FORMAT.fraction_bits)
            curvature = exact.saturate(self.CURVATURE_FORMAT)
            out_of_range |= (exact != curvature).any(axis=1)
            exact = (right - left - curvature).round_half_up(slope_format.fraction_bits)
            slope = exact.saturate(slope_format)
            out_of_range |= (exact != slope).any(axis=1)
            results.append(self.differences(left, slope, curvature, *steps))
        return *results, out_of_range

    def highlight_error(self, slope: np.ndarray, curvature: np.ndarray) -> np.ndarray:
        """Largest error of u at any pixel of a span that is not flagged, against the exact quadratic.

        The error is in units of `ONE_SQUARED`, like u. The error of the three values is half a step, which
        the quadratic multiplies by at most 1.25. The rounding of G is 2^-21. ``t (1 - t)``, at most 1/4,
        multiplies this rounding, so it has no effect at both ends. The rest is `walk_error`.

        Parameters
        ----------
        slope, curvature : arrays
            Absolute values of P and G.
        """
        return 1.25 * self.HIGHLIGHT_FORMAT.step / 2 + 2.0**-23 + self.walk_error(slope, curvature)

    def diffuse_error(self, slope: np.ndarray, curvature: np.ndarray) -> np.ndarray:
        """Largest error of f, like `highlight_error` for u; the rounding of P adds 2^-19.

        Parameters
        ----------
        slope, curvature : arrays
            Absolute values of P and G.
        """
        rounding = 1.25 * self.DIFFUSE_FORMAT.step / 2 + 2.0**-23 + 2.0**-19
        return rounding + self.walk_error(slope, curvature)

    def walk_error(self, slope: np.ndarray, curvature: np.ndarray) -> np.ndarray:
        """Error at the end of a span of `longest` pixels by dt and by the rounding of the differences.

        It is ``2^-17 |P| + (2^-16 + 2^-17 + 2^-34) |G|`` by dt and ``2^-fraction_bits (k + k^2/2)`` by drift.

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
        """Words of `step_words` for dt and dt^2, with an axis for the lights.

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
            Results of `step_words`, each of shape (spans, 1).
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
            Value at t = 0, in any format; P in `SLOPE_FORMAT` or `DIFFUSE_SLOPE_FORMAT`; G in
            `CURVATURE_FORMAT`.
        reciprocal, shift, square, square_shift
            Results of `steps`.
        """
        first_order = slope * reciprocal
        if slope.format.width > self.HIGH_FORMAT.width:
            bits = self.LOW_FORMAT.fraction_bits - self.HIGH_FORMAT.fraction_bits
            high = Fixed(self.HIGH_FORMAT, slope.codes >> bits) * reciprocal
            first_order = high + Fixed(self.LOW_FORMAT, slope.codes & self.LOW_FORMAT.max_code) * reciprocal
        first_order = first_order.scale(1)
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
