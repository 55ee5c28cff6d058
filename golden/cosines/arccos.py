"""Arccos unit: the piecewise quadratic of [T] table 3.1."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Literal

import numpy as np

from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.polynomials import minimax

__all__ = ["ARCCOS_TABLES", "PUBLISHED_COEFFICIENTS", "SEGMENT_BOUNDS", "Arccos"]

ARCCOS_TABLES = ("as_published", "corrected", "refitted")
"""Tables of coefficients of the arccos unit."""

SEGMENT_BOUNDS = (0.0, 0.5, 0.75, 0.9, 0.96, 1.0)
"""Ends of the five segments of [T] table 3.1."""

PUBLISHED_COEFFICIENTS = np.array(
    [
        [1.57, -0.972, -0.144],
        [1.439, -0.447, -0.677],
        [0.454, 2.154, -2.397],
        [-5.529, 15.47, -9.806],
        [-33.838, 74.547, -40.535],
    ]
)
"""[T] table 3.1 as published: ``c0, c1, c2`` of ``arccos x = c0 + c1 x + c2 x^2``, one row a segment.

The published columns are A, B, C; 74.547 is a misprint of 74.457.
"""


@dataclass(frozen=True)
class Arccos:
    """Arccosine in radians: ``c0 + x (c1 + c2 x)``, in five segments. For x < 0 it is ``pi - arccos(-x)``.

    ================ ================== ==========================================================
    word             format             why
    ================ ================== ==========================================================
    x                SQ(2, 16)          holds a dot product that rounding has made larger than 1
    abs x            UQ(1, 16)          17 bits for the multiplier; clamped to 1
    c1, c2, c2 x     SQ(i, 18 - i)      i from 2 to 10, by segment: the smallest that holds them
    c0               SQ(9, 16)
    sums             SQ(11, 32)         exact
    result           UQ(2, 16)          rounded half up
    ================ ================== ==========================================================

    Three roundings have errors: of the coefficients, of ``c2 x`` (up to ``2^-(19-i)``), and of the result (up
    to 2^-17). `arithmetic_error` bounds their sum. Largest model error by segment, in radians, before any
    rounding:

    ============ ============= ========== =========
    segment      as published  corrected  refitted
    ============ ============= ========== =========
    [0, 0.5]     0.0012        0.0012     0.00092
    [0.5, 0.75]  0.0011        0.0011     0.00054
    [0.75, 0.9]  0.0019        0.0019     0.00082
    [0.9, 0.96]  0.0012        0.0012     0.00052
    [0.96, 1]    0.174         0.084      0.019
    ============ ============= ========== =========

    x near 1 is the usual case in a smooth mesh. There arccos behaves like a square root, and no polynomial in
    x fits it. Besides, the rounding of x to 16 bits alone is an error of 2.5 % for an angle of 1 degree.
    `HalfChord`, which `AngularSetup` uses, has neither of these problems.

    Parameters
    ----------
    table : str
        - ``"as_published"``: [T] table 3.1 digit by digit;
        - ``"corrected"``: with 74.457 for the misprinted 74.547;
        - ``"refitted"``: fitted for the least maximum error of each segment in words of the hardware.

    Raises
    ------
    ValueError
        If the table is unknown.

    Source: docs/theory/interpolation.md#arccos; [T] 3.3, table 3.1.
    """

    table: Literal["as_published", "corrected", "refitted"] = "refitted"

    OPERAND_FORMAT = SQ(2, 16)
    MAGNITUDE_FORMAT = UQ(1, 16)
    CONSTANT_FORMAT = SQ(9, 16)
    SUM_FORMAT = SQ(11, 32)
    RESULT_FORMAT = UQ(2, 16)
    COEFFICIENT_BITS = 18

    def __post_init__(self) -> None:
        if self.table not in ARCCOS_TABLES:
            raise ValueError(f"the arccos table must be {', '.join(ARCCOS_TABLES)}, not {self.table!r}")

    @cached_property
    def coefficients(self) -> np.ndarray:
        """Coefficients ``c0, c1, c2`` by segment before they are rounded to words, shape (5, 3)."""
        if self.table == "refitted":
            return np.array([_fit(segment) for segment in range(5)])
        coefficients = PUBLISHED_COEFFICIENTS.copy()
        if self.table == "corrected":
            coefficients[4, 1] = 74.457
        return coefficients

    @cached_property
    def integer_bits(self) -> np.ndarray:
        """Integer bits of the words of ``c1``, ``c2`` and ``c1 + c2 x``, by segment, shape (5,)."""
        _, c1, c2 = self.coefficients.T
        largest = np.max(
            np.abs([c1, c2, c1 + c2 * SEGMENT_BOUNDS[:-1], c1 + c2 * SEGMENT_BOUNDS[1:]]), axis=0
        )
        found: np.ndarray = np.maximum(np.floor(np.log2(largest)).astype(np.int64) + 2, 2)
        return found

    @cached_property
    def codes(self) -> np.ndarray:
        """Words of ``c0, c1, c2`` by segment, shape (5, 3)."""
        fraction_bits = np.stack(
            [
                np.full(5, self.CONSTANT_FORMAT.fraction_bits),
                self.COEFFICIENT_BITS - self.integer_bits,
                self.COEFFICIENT_BITS - self.integer_bits,
            ],
            axis=1,
        )
        coefficients = self.coefficients.copy()
        if self.table == "refitted":
            # The coarsest word is rounded first, because the fits of the other words compensate its rounding
            # error.
            for segment in range(5):
                held: dict[int, float] = {}
                for power in (2, 1, 0):
                    fit = _fit(segment, tuple(held.items()))
                    unit = 2.0 ** -fraction_bits[segment, power]
                    held[power] = float(np.floor(fit[power] / unit + 0.5) * unit)
                    coefficients[segment, power] = held[power]
        found: np.ndarray = np.floor(np.ldexp(coefficients, fraction_bits) + 0.5).astype(np.int64)
        return found

    @cached_property
    def bounds(self) -> np.ndarray:
        """First code of the magnitude in each of the segments 1 to 4, shape (4,)."""
        return np.ceil(np.ldexp(SEGMENT_BOUNDS[1:-1], self.MAGNITUDE_FORMAT.fraction_bits)).astype(np.int64)

    def polynomial(self, x: np.ndarray) -> np.ndarray:
        """The piecewise quadratic in float64 with unrounded coefficients, for x in [-1, 1]."""
        x = np.asarray(x, dtype=np.float64)
        c0, c1, c2 = self.coefficients[self._segment(np.abs(x), SEGMENT_BOUNDS[1:-1])].T
        angle = c0.T + np.abs(x) * (c1.T + np.abs(x) * c2.T)
        found: np.ndarray = np.where(x < 0, np.pi - angle, angle)
        return found

    @cached_property
    def arithmetic_error(self) -> np.ndarray:
        """Bound of the error of the result against `polynomial`, by segment, in radians, shape (5,)."""
        fraction_bits = self.COEFFICIENT_BITS - self.integer_bits
        words = self.codes * np.stack(
            [np.full(5, self.CONSTANT_FORMAT.step), 2.0**-fraction_bits, 2.0**-fraction_bits], axis=1
        )
        # The rounding errors of refitted words compensate each other, so their sum is taken on a grid.
        x = np.linspace(SEGMENT_BOUNDS[:-1], SEGMENT_BOUNDS[1:], 65, axis=1)
        powers = np.stack([np.ones_like(x), x, x * x])
        rounding = np.abs(np.einsum("sc,csx->sx", words - self.coefficients, powers)).max(axis=1)
        found: np.ndarray = rounding + x[:, -1] * 2.0 ** -(fraction_bits + 1) + 2.0**-17 + 2.0**-33
        return found

    @staticmethod
    def _segment(magnitude: np.ndarray, bounds: Sequence[float] | np.ndarray) -> np.ndarray:
        return np.searchsorted(bounds, magnitude, side="right")

    def compute(self, x: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate angles.

        Parameters
        ----------
        x : Fixed, any shape, SQ(2, 16)
            Cosines.

        Returns
        -------
        angle : Fixed, same shape, UQ(2, 16)
            Radians, 0 to pi.
        outside : bool array, same shape
            Whether x was outside [-1, 1] and has been clamped.

        Raises
        ------
        ValueError
            If the operand has another format.
        """
        if x.format != self.OPERAND_FORMAT:
            raise ValueError(f"operand must be {self.OPERAND_FORMAT}, not {x.format}")
        one = self.MAGNITUDE_FORMAT.code(1)
        outside = np.abs(x.codes) > one
        magnitude = np.minimum(np.abs(x.codes), one)
        segment = self._segment(magnitude, self.bounds)
        c0, c1, c2 = np.moveaxis(self.codes[segment], -1, 0)
        scaled = (((c2 * magnitude) >> 15) + 1) >> 1
        product = (scaled + c1) * magnitude << (self.integer_bits[segment] - 2)
        total = product + (c0 << 16)
        pi = Fixed.round(self.SUM_FORMAT, np.pi).codes
        angle = Fixed(self.SUM_FORMAT, np.where(x.codes < 0, pi - total, total))
        return angle.round_half_up(16).saturate(self.RESULT_FORMAT), outside


@cache
def _fit(segment: int, held: tuple[tuple[int, float], ...] = ()) -> np.ndarray:
    """Quadratic of least maximum error on a segment, with some coefficients given."""
    low, high = SEGMENT_BOUNDS[segment : segment + 2]
    return minimax(lambda x: np.arccos(np.minimum(x, 1.0)), low, high, 2, dict(held))
