"""Angle between two unit vectors: the piecewise quadratic of [T] table 3.1, and the half-chord form."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Literal

import numpy as np

from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.polynomials import minimax, minimax_quantised
from blysk.golden.number.unit_vector import ONE_SQUARED

__all__ = ["ARCCOS_TABLES", "PRINTED_COEFFICIENTS", "SEGMENT_BOUNDS", "Arccos", "HalfChord"]

ARCCOS_TABLES = ("as_published", "corrected", "refitted")
"""Coefficients that the arccos unit can hold."""

SEGMENT_BOUNDS = (0.0, 0.5, 0.75, 0.9, 0.96, 1.0)
"""Ends of the five segments of [T] table 3.1."""

PRINTED_COEFFICIENTS = np.array(
    [
        [1.57, -0.972, -0.144],
        [1.439, -0.447, -0.677],
        [0.454, 2.154, -2.397],
        [-5.529, 15.47, -9.806],
        [-33.838, 74.547, -40.535],
    ]
)
"""[T] table 3.1 as printed: ``c0, c1, c2`` of ``arccos x = c0 + c1 x + c2 x^2``, a row a segment.

The columns are headed A, B, C there; 74.547 is a misprint of 74.457.
"""


@dataclass(frozen=True)
class Arccos:
    """``arccos x = c0 + x (c1 + c2 x)`` in radians, in five segments; below 0 ``pi - arccos(-x)``.

    ================ ================== ==========================================================
    word             format             why
    ================ ================== ==========================================================
    x                SQ(2, 16)          a dot product that rounding has brought past 1 fits
    abs x            UQ(1, 16)          17 bits for the multiplier; clamped to 1
    c1, c2, c2 x     SQ(i, 18 - i)      i from 2 to 10, by segment: the smallest that holds them
    c0               SQ(9, 16)
    sums             SQ(11, 32)         exact
    result           UQ(2, 16)          rounded half up
    ================ ================== ==========================================================

    Rounded are the coefficients, ``c2 x`` (by up to ``2^-(19-i)``) and the result (2^-17); `arithmetic_error`
    is the bound of the three together. Largest model error by segment, in radians, before any rounding:

    ============ ======== ========== =========
    segment      printed  corrected  refitted
    ============ ======== ========== =========
    [0, 0.5]     0.0012   0.0012     0.00092
    [0.5, 0.75]  0.0011   0.0011     0.00054
    [0.75, 0.9]  0.0019   0.0019     0.00082
    [0.9, 0.96]  0.0012   0.0012     0.00052
    [0.96, 1]    0.174    0.084      0.019
    ============ ======== ========== =========

    arccos has the slope of a square root at 1, where neighbouring normals of a mesh live; no polynomial in x
    follows it there, and a 16-bit x at 1 degree costs 2.5 % of the angle before the unit begins. `HalfChord`
    has neither fault and is what `AngularSetup` uses.

    Parameters
    ----------
    table : str
        ``"as_published"``: [T] table 3.1 digit by digit; ``"corrected"``: with 74.457 for the misprinted
        74.547; ``"refitted"``: least maximum error of each segment, in words of the hardware.

    Raises
    ------
    ValueError
        If the table is unknown.

    Source: [T] 3.3, table 3.1; numbers.md, "arccos".
    """

    table: Literal["as_published", "corrected", "refitted"] = "refitted"

    OPERAND_FORMAT = SQ(2, 16)
    MAGNITUDE_FORMAT = UQ(1, 16)
    CONSTANT_FORMAT = SQ(9, 16)
    SUM_FORMAT = SQ(11, 32)
    RESULT_FORMAT = UQ(2, 16)
    COEFFICIENT_BITS = 18

    def __post_init__(self):
        if self.table not in ARCCOS_TABLES:
            raise ValueError(f"the arccos table must be {', '.join(ARCCOS_TABLES)}, not {self.table!r}")

    @cached_property
    def coefficients(self) -> np.ndarray:
        """``c0, c1, c2`` by segment before rounding to words, shape (5, 3)."""
        if self.table == "refitted":
            return np.array([_fit(segment) for segment in range(5)])
        coefficients = PRINTED_COEFFICIENTS.copy()
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
        return np.maximum(np.floor(np.log2(largest)).astype(np.int64) + 2, 2)

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
            # The coarsest word first: those after it take up its rounding error.
            for segment in range(5):
                held = {}
                for power in (2, 1, 0):
                    fit = _fit(segment, tuple(held.items()))
                    unit = 2.0 ** -fraction_bits[segment, power]
                    held[power] = float(np.floor(fit[power] / unit + 0.5) * unit)
                    coefficients[segment, power] = held[power]
        return np.floor(np.ldexp(coefficients, fraction_bits) + 0.5).astype(np.int64)

    @cached_property
    def bounds(self) -> np.ndarray:
        """First code of the magnitude that belongs to segments 1 to 4, shape (4,)."""
        return np.ceil(np.ldexp(SEGMENT_BOUNDS[1:-1], self.MAGNITUDE_FORMAT.fraction_bits)).astype(np.int64)

    def polynomial(self, x: np.ndarray) -> np.ndarray:
        """The same piecewise quadratic in float64 with unrounded coefficients, for x in [-1, 1]."""
        x = np.asarray(x, dtype=np.float64)
        c0, c1, c2 = self.coefficients[self._segment(np.abs(x), SEGMENT_BOUNDS[1:-1])].T
        angle = c0.T + np.abs(x) * (c1.T + np.abs(x) * c2.T)
        return np.where(x < 0, np.pi - angle, angle)

    @cached_property
    def arithmetic_error(self) -> np.ndarray:
        """Bound of the error of the result against `polynomial`, by segment, in radians, shape (5,)."""
        fraction_bits = self.COEFFICIENT_BITS - self.integer_bits
        words = self.codes * np.stack(
            [np.full(5, self.CONSTANT_FORMAT.step), 2.0**-fraction_bits, 2.0**-fraction_bits], axis=1
        )
        # Refitted words trade their rounding errors against each other, so the error is taken on a grid.
        x = np.linspace(SEGMENT_BOUNDS[:-1], SEGMENT_BOUNDS[1:], 65, axis=1)
        powers = np.stack([np.ones_like(x), x, x * x])
        rounding = np.abs(np.einsum("sc,csx->sx", words - self.coefficients, powers)).max(axis=1)
        return rounding + x[:, -1] * 2.0 ** -(fraction_bits + 1) + 2.0**-17 + 2.0**-33

    @staticmethod
    def _segment(magnitude: np.ndarray, bounds: Sequence | np.ndarray) -> np.ndarray:
        return np.searchsorted(bounds, magnitude, side="right")

    def compute(self, x: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-true angles.

        Parameters
        ----------
        x : Fixed, any shape, SQ(2, 16)
            Cosines.

        Returns
        -------
        angle : Fixed, same shape, UQ(2, 16)
            Radians, 0 to pi.
        outside : bool array, same shape
            Whether x lay outside [-1, 1] and was clamped.

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
    """Quadratic of least maximum error on a segment, some coefficients held."""
    return minimax(
        lambda x: np.arccos(np.minimum(x, 1.0)), *SEGMENT_BOUNDS[segment : segment + 2], 2, dict(held)
    )


@dataclass(frozen=True)
class HalfChord:
    """``psi = 2 arcsin(|N_r - N_l|/2)`` in turns, from the squared chord ``w = |N_r - N_l|^2``.

    The well-posed form of arccos. Of the two replacements that are well-posed, this one and
    ``sqrt(1 - x) poly(x)``, only this one keeps the precision of its input: at 1 degree ``1 - x`` is 1.5e-4,
    and the lengths of two quantised normals move ``x = N_l . N_r`` by up to 2^-18 each, 5 % of it; the chord
    itself moves by the rounding of the components alone, and
    ``w = N_l . N_l + N_r . N_r - 2 N_l . N_r`` is exact.

    With ``z = w/4`` shifted by an even number of bits to ``v = z 4^j`` in [1/4, 1), ``s = sqrt(v)`` is read
    from a table of 512 words with linear interpolation, and ``psi = 2^-(j+1) s g(z)`` with
    ``g(z) = 2 arcsin(sqrt z)/(pi sqrt z) = 2/pi + z (c1 + z (c2 + z (c3 + z c4)))``, exact at angle 0 and
    fitted up to 90 degrees. Beyond, the caller gives the squared chord to the opposite vector,
    ``|N_r + N_l|^2``, and says so: the result is half a turn less the angle. So every angle from 0 to 180
    degrees is served, and well-posed at both ends.

    ============ ============ ==================================================================
    word         format       why
    ============ ============ ==================================================================
    w            UQ(2, 34)    exact sum of dot products of two code vectors
    z            UQ(-1, 18)   17 bits for the multiplier; saturates past 90 degrees
    table        36 bits      s in UQ(0, 21), slope in UQ(0, 15): 512 words are one block RAM
    s            UQ(0, 17)    multiplier operand
    sums         UQ(-2, 19)   17 bits; under 0.15
    g            UQ(0, 17)    multiplier operand
    result       UQ(0, 36)    relative precision down to a chord of one step
    ============ ============ ==================================================================

    Lengths are read in units of `ONE`, which is folded into the coefficients.

    Error relative to the angle (to its supplement beyond 90 degrees) at most `RELATIVE_ERROR`, plus 2^-36
    turns, the cut of the result: the table's fit and slope leave 2^-20 in s, its rounding 2^-18, and s is
    at least 1/2; g has the fit (6.6e-6 relative), z rounded by 2^-19 (times the slope 0.2), four products
    rounded by 2^-20 (times powers of z, which is at most 1/2), the constant by 2^-20, the last rounding
    2^-18, and is at least 0.636.

    Source: [T] 3.3; numbers.md, "arccos".
    """

    OPERAND_FORMAT = UQ(2, 34)
    SQUARE_FORMAT = UQ(-1, 18)
    ROOT_FORMAT = UQ(0, 17)
    TABLE_VALUE_FORMAT = UQ(0, 21)
    TABLE_SLOPE_FORMAT = UQ(0, 15)
    ADDRESS_BITS = 9
    FRACTION_BITS = 14
    SUM_FORMAT = UQ(-2, 19)
    FACTOR_FORMAT = UQ(0, 17)
    RESULT_FORMAT = UQ(0, 36)
    RELATIVE_ERROR = (
        (2.0**-20 + 2.0**-18) / 0.5
        + 6.6e-6
        + (2.0**-19 * 0.2 + 2.0**-20 * (1 / 2 + 1 / 4 + 1 / 8 + 1 / 16) + 2.0**-20 + 2.0**-18) / 0.636
    )

    @cached_property
    def coefficients(self) -> Fixed:
        """``c1`` to ``c4``, fitted in words of the hardware."""
        return Fixed(self.SUM_FORMAT, _half_chord_codes())

    @cached_property
    def constant(self) -> Fixed:
        """``2/pi`` in units of `ONE`."""
        return Fixed.round(UQ(0, 19), 2 / np.pi / np.sqrt(ONE_SQUARED.values))

    @cached_property
    def roots(self) -> tuple[Fixed, Fixed]:
        """The table: square root at the start of each of the 512 segments of [0, 1), and its slope.

        Each line is that of least maximum error. The first 128 words are met by ``w = 0`` alone and hold 0.
        """
        size = 1 << self.ADDRESS_BITS
        start = np.arange(size) / size
        end = start + 1 / size
        slope = (np.sqrt(end) - np.sqrt(start)) * size
        # The root bulges over its chord most where its own slope is the chord's.
        bulge = 1 / (4 * slope) + slope * start - np.sqrt(start)
        used = start >= 1 / 4
        value = np.where(used, np.sqrt(start) + bulge / 2, 0)
        return (
            Fixed.round(self.TABLE_VALUE_FORMAT, value),
            Fixed.round(self.TABLE_SLOPE_FORMAT, np.where(used, slope, 0)),
        )

    @staticmethod
    def shift(chord_squared: Fixed) -> np.ndarray:
        """j, with ``z 4^j`` in [1/4, 1); 17 of a chord of 0.

        Parameters
        ----------
        chord_squared : Fixed, any shape, UQ(2, 34)
            w.

        Returns
        -------
        int64 array, same shape
        """
        shift = np.full_like(chord_squared.codes, 17)
        for j in range(17, -1, -1):
            shift[chord_squared.codes >> (34 - 2 * j) > 0] = j
        return shift

    def compute(self, chord_squared: Fixed, supplement: np.ndarray) -> Fixed:
        """Bit-true angles.

        Parameters
        ----------
        chord_squared : Fixed, any shape, UQ(2, 34)
            ``|N_r - N_l|^2``, or beyond 90 degrees ``|N_r + N_l|^2``; up to 2.
        supplement : bool array, same shape
            Whether it is the latter.

        Returns
        -------
        Fixed, same shape, UQ(0, 36)
            Turns, 0 to 1/2.

        Raises
        ------
        ValueError
            If the operand has another format.
        """
        if chord_squared.format != self.OPERAND_FORMAT:
            raise ValueError(f"operand must be {self.OPERAND_FORMAT}, not {chord_squared.format}")
        z = chord_squared.scale(-2)
        shift = self.shift(chord_squared)
        v = z.codes << 2 * shift
        values, slopes = self.roots
        address = v >> (36 - self.ADDRESS_BITS)
        fraction = Fixed(
            UQ(0, self.FRACTION_BITS),
            v >> (36 - self.ADDRESS_BITS - self.FRACTION_BITS) & ((1 << self.FRACTION_BITS) - 1),
        )
        rise = (fraction * slopes[address]).scale(-self.ADDRESS_BITS).truncate(21)
        root = (values[address] + rise.wrap(UQ(0, 21))).round_half_up(17).saturate(self.ROOT_FORMAT)
        z = z.round_half_up(18).saturate(self.SQUARE_FORMAT)
        c1, c2, c3, c4 = (self.coefficients[i] for i in range(4))
        total = c4
        for c in (c3, c2, c1):
            total = ((z * total).round_half_up(19) + c).wrap(self.SUM_FORMAT)
        factor = (
            ((z * total).round_half_up(19) + self.constant).round_half_up(17).saturate(self.FACTOR_FORMAT)
        )
        product = (root * factor).scale(-1)
        angle = Fixed(UQ(0, 36), (product.codes << 1) >> shift)
        half_turn = Fixed(UQ(0, 36), 1 << 35)
        supplemented = (half_turn - angle).wrap(self.RESULT_FORMAT)
        return Fixed(self.RESULT_FORMAT, np.where(supplement, supplemented.codes, angle.codes))


def _angle_by_root(z: np.ndarray) -> np.ndarray:
    root = np.sqrt(np.maximum(z, 1e-24))
    return 2 * np.arcsin(root) / (np.pi * root)


@cache
def _half_chord_codes() -> np.ndarray:
    one = float(ONE_SQUARED.values)
    return minimax_quantised(
        lambda z: _angle_by_root(z / one) / np.sqrt(one),
        0.0,
        one / 2,
        dict.fromkeys((1, 2, 3, 4), HalfChord.SUM_FORMAT),
        held={0: 2 / np.pi / np.sqrt(one)},
    )
