"""Half-chord unit: the angle between two unit vectors from the chord between them."""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.polynomials import minimax_quantised
from blysk.golden.number.unit_vector import ONE_SQUARED

__all__ = ["HalfChord"]


@dataclass(frozen=True)
class HalfChord:
    """Angle ``psi = 2 arcsin(|N_r - N_l|/2)`` in turns, from the squared chord ``w = |N_r - N_l|^2``.

    This is the well-conditioned form of arccos: ``w = N_l . N_l + N_r . N_r - 2 N_l . N_r`` is exact. The
    input of ``sqrt(1 - x) poly(x)`` is imprecise, see docs/theory/bounds.md#half-chord.

    ``z = w/4`` is shifted by an even number of bits to ``v = z 4^j`` in [1/4, 1). ``s = sqrt(v)`` is read
    from a table of 512 words with linear interpolation. Then ``psi = 2^-(j+1) s g(z)`` with ``g(z) = 2
    arcsin(sqrt z)/(pi sqrt z) = 2/pi + z (c1 + z (c2 + z (c3 + z c4)))``. g is exact at angle 0 and fitted up
    to 90 degrees. For angles over 90 degrees the caller gives the squared chord to the opposite vector,
    ``|N_r + N_l|^2``, and sets ``supplement``. The result is then half a turn minus the angle of this chord.
    So angles from 0 to 180 degrees are possible, and the result is well-conditioned at both ends.

    ============ ============ ==================================================================
    word         format       why
    ============ ============ ==================================================================
    w            UQ(2, 34)    exact sum of dot products of vectors of codes
    z            UQ(-1, 18)   17 bits for the multiplier; saturates past 90 degrees
    table        36 bits      s in UQ(0, 21), slope in UQ(0, 15): 512 words are one block RAM
    s            UQ(0, 17)    multiplier operand
    sums         UQ(-2, 19)   17 bits; under 0.15
    g            UQ(0, 17)    multiplier operand
    result       UQ(0, 36)    relative precision down to a chord of one step
    ============ ============ ==================================================================

    Lengths are in units of `ONE`. The coefficients contain this unit.

    The error relative to the angle (beyond 90 degrees: to its supplement) is at most `RELATIVE_ERROR`, and
    the dropped bits of the result add 2^-36 turns. docs/theory/bounds.md#half-chord derives it.

    Source: docs/theory/interpolation.md#half-chord; [T] 3.3.
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
        """Coefficients ``c1`` to ``c4``, fitted in words of the hardware."""
        return Fixed(self.SUM_FORMAT, _half_chord_codes())

    @cached_property
    def constant(self) -> Fixed:
        """The constant ``2/pi`` in units of `ONE`."""
        return Fixed.round(UQ(0, 19), 2 / np.pi / np.sqrt(ONE_SQUARED.values))

    @cached_property
    def roots(self) -> tuple[Fixed, Fixed]:
        """Table of the square root for 512 segments of [0, 1): value at the start of a segment, and slope.

        Each line has the least maximum error. The first 128 words are 0. They are read only if ``w = 0``.
        """
        size = 1 << self.ADDRESS_BITS
        start = np.arange(size) / size
        end = start + 1 / size
        slope = (np.sqrt(end) - np.sqrt(start)) * size
        # The root is farthest above its chord where their slopes are equal.
        sagitta = 1 / (4 * slope) + slope * start - np.sqrt(start)
        used = start >= 1 / 4
        value = np.where(used, np.sqrt(start) + sagitta / 2, 0)
        return (
            Fixed.round(self.TABLE_VALUE_FORMAT, value),
            Fixed.round(self.TABLE_SLOPE_FORMAT, np.where(used, slope, 0)),
        )

    @staticmethod
    def shift(chord_squared: Fixed) -> np.ndarray:
        """Shift j, with ``z 4^j`` in [1/4, 1); 17 for a chord of 0.

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
        """Bit-accurate angles.

        Parameters
        ----------
        chord_squared : Fixed, any shape, UQ(2, 34)
            ``|N_r - N_l|^2``, up to 2; beyond 90 degrees ``|N_r + N_l|^2``.
        supplement : bool array, same shape
            Whether ``chord_squared`` is ``|N_r + N_l|^2``.

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
    found: np.ndarray = 2 * np.arcsin(root) / (np.pi * root)
    return found


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
