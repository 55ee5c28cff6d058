"""Angular setup ([T] 3.1): the angles of a span's great circle to a fixed vector."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from blysk.golden.cosines.arccos import SEGMENT_BOUNDS, Arccos
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.reciprocal import reciprocal_address, reciprocal_table
from blysk.golden.number.spans import checked_lengths
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED

__all__ = ["SPAN_ANGLES", "AngularSetup"]

SPAN_ANGLES = ("half_chord", "arccos")
"""Units that can compute psi."""


@dataclass(frozen=True)
class AngularSetup:
    """Angles ``psi``, ``lambda``, ``psi/(m-1)``, and ``cos beta``, of a span and a fixed vector H.

    psi is the angle between ``N_l`` and ``N_r``, and m is the number of pixels. beta is the angle of H to the
    plane of the great circle. lambda is the angle from ``N_l`` to the projection of H on this plane.

    [T] 3.1 takes psi from arccos. Then ``tan lambda = (N_r.H - cos psi N_l.H)/(sin psi N_l.H)``, which
    becomes 0/0 as psi tends to 0. Most spans are narrow. Here, with ``a = N_l.H``, ``b = N_r.H`` and the
    angle counted from the middle of the span,

    - ``cos gamma(t) = x cos((t - 1/2) psi) + y sin((t - 1/2) psi)``,
    - ``x = (a + b)/(2 cos(psi/2))`` and ``y = (b - a)/(2 sin(psi/2))``,
    - ``cos beta = sqrt(x^2 + y^2)``, ``lambda = atan2(y, x) + psi/2``.

    The curve goes through a and b for any psi. So ``sin(psi/2)`` multiplies an error of y. In narrow spans y
    is inaccurate, and this factor is small. Dot products of codes are exact, so differences of nearly equal
    numbers are exact, too: ``w = |N_r - N_l|^2 = N_l.N_l + N_r.N_r - 2 N_l.N_r`` and ``b - a``. Both
    half-angle functions follow from ``z = w/4 = sin^2(psi/2)``:

    - ``1/(2 cos(psi/2)) = 1/2 + e(z)/2`` with e, a small correction, from a table;
    - ``1/(2 sin(psi/2)) = 2^j T(v)`` with T from a table on ``v = z 4^j`` in [1/4, 1), and ``b - a`` shifted
      by j.

    psi comes from `HalfChord`, without arccos.

    Beyond 90 degrees ``|N_r + N_l|^2`` takes the role of w, and x and y are exchanged. So angles from 0 to
    180 degrees are possible. Only opposite normals have no plane. The curve then goes through the pole
    ``x = 0``. The rounding of the normals rotates the plane in proportion to ``1/sin psi``. So spans over 150
    degrees are flagged, by the comparison ``|N_r + N_l|^2 < 4 cos^2(75 degrees)``. The limit is lowered by
    the largest error of rounding. So all spans from 150.01 degrees on are flagged.

    Polar coordinates come from 22 steps of CORDIC [Volder59]. Shifts and additions divide its gain out. A
    span of one pixel gets ``psi/(m-1) = psi``, which no unit reads.

    ============ ============ ====================================================================
    word         format       why
    ============ ============ ====================================================================
    w            UQ(2, 34)    exact; at most 2 for unit vectors
    e            UQ(-1, 18)   multiplier operand; at most 0.4143. Table: UQ(-1, 22), rise UQ(-9, 22)
    T            UQ(0, 17)    multiplier operand; table: UQ(0, 22), fall UQ(-8, 22)
    (b - a) 2^j  SQ(2, 16)    multiplier operand
    x, y         SQ(2, 26)    grow by 1.6468 in CORDIC, to SQ(4, 26)
    atan2        SQ(0, 28)    turns
    psi          UQ(0, 36)    turns
    lambda       SQ(0, 40)    turns
    psi/(m-1)    UQ(0, 40)    turns; psi by its leading 17 bits times the reciprocal
    cos beta     UQ(1, 25)    over 1 only if normals differ in length and are few steps apart
    ============ ============ ====================================================================

    `error` bounds the error of cos gamma(t) at any pixel, against the formula above in exact arithmetic on
    the same codes. The largest errors found in 20,000 random spans of 2 to 4095 pixels, for each angle of the
    span, are 6.4e-7 up to 0.1 degrees, 7.4e-7 at 1, 3.8e-6 at 10, 1.3e-5 at 45, 3.3e-5 from 90 to 150.

    **By arccos**, as published: ``angle="arccos"`` takes psi from `Arccos` of ``r = N_l.N_r``, divided by
    `ONE_SQUARED` as ``r + r/2^16`` and rounded to SQ(2, 16). psi is rounded to UQ(2, 15) radians. A product
    with ``1/(2 pi)`` in UQ(-2, 19) converts it to turns. ``psi/(m-1)`` reads the first 17 bits of the
    product. x and y are as above, so only the error of arccos is added: `arccos_error`. The largest errors of
    cos gamma found in the same spans are, by the angle of the span in degrees:

    ==================== ====== ====== ====== ======
    psi from             1e-4   1      10     45
    ==================== ====== ====== ====== ======
    half chord           5.0e-7 7.4e-7 3.8e-6 1.3e-5
    arccos, refitted     0.0095 0.0012 0.0049 2.6e-4
    arccos, corrected    0.042  0.034  3.5e-4 5.0e-4
    arccos, as published 0.088  0.078  0.045  5.0e-4
    ==================== ====== ====== ====== ======

    The vectors must be of unit length, except for rounding. Words of other vectors saturate or wrap.

    Parameters
    ----------
    angle : str
        Unit that computes psi, one of `SPAN_ANGLES`.
    arccos : Arccos
        Arccos unit for ``angle="arccos"``.

    Raises
    ------
    ValueError
        If ``angle`` is unknown.

    Source: docs/theory/interpolation.md#angular-method; [T] 3.1.
    """

    angle: Literal["half_chord", "arccos"] = "half_chord"
    arccos: Arccos = field(default_factory=Arccos)

    MAX_ANGLE = 150.0
    CHORD_FORMAT = HalfChord.OPERAND_FORMAT
    # The rounding of two normals moves the square of a sum of length 0.52 by less than 3.6 steps.
    SHORTEST_SUM = Fixed(
        UQ(2, 17),
        int((ONE_SQUARED.values * 4 * np.cos(np.radians(MAX_ANGLE / 2)) ** 2 - 4 * COMPONENT.step) * 2.0**17),
    )
    CORRECTION_FORMAT = UQ(-1, 18)
    CORRECTION_VALUE_FORMAT = UQ(-1, 22)
    CORRECTION_RISE_FORMAT = UQ(-9, 22)
    RECIPROCAL_FORMAT = UQ(0, 17)
    RECIPROCAL_VALUE_FORMAT = UQ(0, 22)
    RECIPROCAL_FALL_FORMAT = UQ(-8, 22)
    MINOR_FORMAT = SQ(2, 16)
    AXIS_FORMAT = SQ(2, 26)
    ROTATED_FORMAT = SQ(4, 26)
    DIRECTION_FORMAT = SQ(0, 28)
    MANTISSA_FORMAT = UQ(-1, 18)
    ANGLE_FORMAT = HalfChord.RESULT_FORMAT
    PHASE_FORMAT = HighlightCosine.PHASE_FORMAT
    STEP_FORMAT = HighlightCosine.STEP_FORMAT
    COS_BETA_FORMAT = HighlightCosine.COS_BETA_FORMAT
    ADDRESS_BITS = 9
    FRACTION_BITS = 14
    CORDIC_STEPS = 22
    GAIN_BITS = 30
    RADIANS_FORMAT = UQ(2, 15)
    TURNS_PER_RADIAN = Fixed.round(UQ(-2, 19), 1 / (2 * np.pi))

    def __post_init__(self) -> None:
        if self.angle not in SPAN_ANGLES:
            raise ValueError(f"angle must be {' or '.join(SPAN_ANGLES)}, not {self.angle!r}")

    @staticmethod
    def error(angle: np.ndarray) -> np.ndarray:
        """Bound of the error of cos gamma with the half chord, by the span angle in degrees.

        docs/theory/bounds.md#angular-setup derives it.

        Parameters
        ----------
        angle : array
            Span angle in degrees.
        """
        half = np.radians(angle) / 2
        x = 2.5e-7 + 2.0**-22 + 2.0**-19 + 0.42 * 2.0**-18 + 2.0**-26
        y = 2.0**-17 + 2 * (2.9e-6 + 2.0**-22 + 2.0**-18) + 2.0**-26
        cordic = 2.0**-21 + 22 * 2.0**-26 * np.sqrt(2) + 22 * 2 * np.pi * 2.0**-29 + 2.0**-24
        ends = np.minimum(half, np.pi / 2 - half) * HalfChord.RELATIVE_ERROR
        ends = ends + 2 * half * (2.0**-19 / 0.159 + 2.0**-17)
        acute = half <= np.pi / 4 * (1 + 1e-6)
        found: np.ndarray = (
            x + np.where(acute, np.sin(half), 1) * y + cordic + ends + 2 * np.pi * 4095 * 2.0**-40
        )
        return found

    def arccos_error(self, angle: float) -> float:
        """Bound of the error of cos gamma with ``angle="arccos"``, for one span angle in degrees.

        docs/theory/bounds.md#angular-setup derives it.

        Parameters
        ----------
        angle : float
            Span angle in degrees.
        """
        psi = np.radians(angle)
        around = np.clip(np.cos(psi) + np.array([-1, 0, 1]) * (2.0**-16 + 2.0**-30), -1, 1)
        segments = self.arccos._segment(np.abs(around), SEGMENT_BOUNDS[1:-1])
        x = np.linspace(SEGMENT_BOUNDS[:-1], SEGMENT_BOUNDS[1:], 20001, axis=1)
        x[:, -1] -= 2.0**-40
        model = np.abs(self.arccos.polynomial(x) - np.arccos(x)).max(axis=1)
        table = (model + self.arccos.arithmetic_error)[segments.min() : segments.max() + 1].max()
        off = np.abs(np.arccos(around) - psi).max() + table + 2.0**-16
        off += (psi + off) * 2.0**-20 * 2 * np.pi
        chord = 2 * min(np.sin(psi / 2), np.cos(psi / 2))
        cos_beta = min(1 + 2.0**-17 / max(chord, 2.0**-18), np.sqrt(2))
        found: float = self.error(np.asarray(angle)) + cos_beta * (
            off / 2 + 2 * np.pi * 2.0**-19 + off * 2.0**-17
        )
        return found

    @cached_property
    def corrections(self) -> tuple[Fixed, Fixed]:
        """Table of e for z from 0 to 1/2, ``1/(one sqrt(1 - z/one)) - 1``, with the rise to the next word."""
        one = float(ONE_SQUARED.values)
        start = np.arange(1 << self.ADDRESS_BITS) / (2 << self.ADDRESS_BITS)
        width = start[1]

        def function(z: np.ndarray) -> np.ndarray:
            return 1 / (one * np.sqrt(1 - z / one)) - 1

        return self._chords(function, start, width, self.CORRECTION_VALUE_FORMAT, self.CORRECTION_RISE_FORMAT)

    @cached_property
    def reciprocals(self) -> tuple[Fixed, Fixed]:
        """Table of T for v from 0 to 1, ``1/(2 sqrt(v one))``, with the fall to the next word.

        Words for v below 1/4 are 0. They are read only if ``w = 0``.
        """
        one = float(ONE_SQUARED.values)
        start = np.arange(1 << self.ADDRESS_BITS) / (1 << self.ADDRESS_BITS)
        width = start[1]
        used = start >= 1 / 4

        def function(v: np.ndarray) -> np.ndarray:
            inverse: np.ndarray = 1 / (2 * np.sqrt(np.maximum(v, 1 / 4) * one))
            return inverse

        value, fall = self._chords(
            function, start, width, self.RECIPROCAL_VALUE_FORMAT, self.RECIPROCAL_FALL_FORMAT
        )
        return Fixed(value.format, value.codes * used), Fixed(fall.format, fall.codes * used)

    @staticmethod
    def _chords(
        function: Callable[[np.ndarray], np.ndarray],
        start: np.ndarray,
        width: float,
        value_format: Format,
        change_format: Format,
    ) -> tuple[Fixed, Fixed]:
        """Start and change of lines with nearly least maximum error.

        They are chords, lowered by half the sagitta.
        """
        low, middle, high = (function(start + width * part) for part in (0, 0.5, 1))
        value = np.clip(low - ((low + high) / 2 - middle) / 2, 0, value_format.max_code * value_format.step)
        return Fixed.round(value_format, value), Fixed.round(change_format, np.abs(high - low))

    @cached_property
    def directions(self) -> Fixed:
        """Angles ``arctan 2^-i`` of the steps of CORDIC, in turns."""
        turns = np.arctan(2.0 ** -np.arange(self.CORDIC_STEPS)) / (2 * np.pi)
        return Fixed.round(self.DIRECTION_FORMAT, turns)

    @cached_property
    def gain_terms(self) -> tuple[tuple[int, int], ...]:
        """Signs s and right shifts k: the sum of ``s 2^-k`` is the reciprocal of CORDIC's gain to 2^-28."""
        rest = np.prod(1 / np.sqrt(1 + 4.0 ** -np.arange(self.CORDIC_STEPS)))
        terms = []
        while abs(rest) > 2.0**-28:
            shift = int(-np.round(np.log2(abs(rest) / 1.06066)))
            terms.append((int(np.sign(rest)), shift))
            rest -= np.sign(rest) * 2.0**-shift
        return tuple(terms)

    def compute(
        self, normal_left: Fixed, normal_right: Fixed, vector: Fixed, length: np.ndarray
    ) -> tuple[Fixed, Fixed, Fixed, Fixed, np.ndarray]:
        """Bit-accurate angles of spans.

        Parameters
        ----------
        normal_left, normal_right, vector : Fixed, shape (spans, 3), SQ(1, 17)
            Unit vectors.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.

        Returns
        -------
        angle : Fixed, shape (spans,), UQ(0, 36)
            psi in turns.
        phase : Fixed, shape (spans,), SQ(0, 40)
            lambda in turns.
        step : Fixed, shape (spans,), UQ(0, 40)
            ``psi/(m-1)`` in turns.
        cos_beta : Fixed, shape (spans,), UQ(1, 25)
        out_of_range : bool array, shape (spans,)
            Whether the normals are over `MAX_ANGLE` apart. The plane of the span is then inaccurate.

        Raises
        ------
        ValueError
            If an operand has another format or a length is out of range.
        """
        length = checked_lengths(length)
        if {normal_left.format, normal_right.format, vector.format} != {COMPONENT}:
            raise ValueError(f"operands must be {COMPONENT}")
        dot = DotProduct().compute
        squares = dot(normal_left, normal_left) + dot(normal_right, normal_right)
        cross = dot(normal_left, normal_right)
        obtuse = cross.codes < 0
        chord = squares - Fixed(SQ(5, 34), np.abs(cross.codes)).scale(1).extend(SQ(6, 34))
        chord = chord.saturate(self.CHORD_FORMAT)
        left, right = dot(normal_left, vector), dot(normal_right, vector)
        total, difference = (left + right).extend(SQ(6, 34)), (right - left).extend(SQ(6, 34))
        major = Fixed(SQ(6, 34), np.where(obtuse, difference.codes, total.codes))
        minor = Fixed(SQ(6, 34), np.where(obtuse, total.codes, difference.codes))
        shift = HalfChord.shift(chord)
        x, y = self._major(chord, major), self._minor(chord, minor, shift)
        x, y = np.where(obtuse, y, x), np.where(obtuse, x, y)
        radius, direction = self._polar(x, y)

        if self.angle == "half_chord":
            angle, angle_shift = HalfChord().compute(chord, obtuse), np.where(obtuse, 0, shift)
        else:
            angle, angle_shift = self._by_arccos(cross), np.zeros_like(shift)
        gained = sum(sign * (radius << 4 >> k) for sign, k in self.gain_terms)
        cos_beta = Fixed(SQ(4, self.GAIN_BITS), gained).round_half_up(25).saturate(self.COS_BETA_FORMAT)
        half = angle.scale(-1).extend(UQ(0, 40))
        phase = (direction.extend(self.PHASE_FORMAT) + half).wrap(self.PHASE_FORMAT)
        step = self._step(angle, angle_shift, length)
        out_of_range: np.ndarray = obtuse & (
            chord.truncate(self.SHORTEST_SUM.format.fraction_bits) < self.SHORTEST_SUM
        )
        return angle, phase, step, cos_beta, out_of_range

    def _by_arccos(self, cross: Fixed) -> Fixed:
        """Angle psi in turns by arccos, from the exact dot product of the normals."""
        cosine = Fixed(cross.format, cross.codes + (cross.codes >> 16)).round_half_up(16)
        radians, _ = self.arccos.compute(cosine.saturate(Arccos.OPERAND_FORMAT))
        radians = radians.round_half_up(15).saturate(self.RADIANS_FORMAT)
        return (radians * self.TURNS_PER_RADIAN).extend(self.ANGLE_FORMAT)

    def _looked_up(self, table: tuple[Fixed, Fixed], bits: np.ndarray, width: int) -> tuple[Fixed, Fixed]:
        """Word of a table at the leading bits of an operand, and the word's change times the other bits."""
        values, changes = table
        address = bits >> (width - self.ADDRESS_BITS)
        fraction = bits >> (width - self.ADDRESS_BITS - self.FRACTION_BITS) & ((1 << self.FRACTION_BITS) - 1)
        change = Fixed(UQ(0, self.FRACTION_BITS), fraction) * changes[address]
        return values[address], change.round_half_up(22)

    def _major(self, chord: Fixed, major: Fixed) -> np.ndarray:
        """Codes of ``major/2 (1 + e)`` with 26 fraction bits."""
        bits = np.minimum(chord.codes, (1 << 35) - 1)
        value, change = self._looked_up(self.corrections, bits, 35)
        correction = (value + change).round_half_up(18).saturate(self.CORRECTION_FORMAT)
        half = major.scale(-1)
        factor = half.truncate(17).saturate(COMPONENT)
        product = (correction * factor).round_half_up(26)
        return (half.truncate(26) + product).wrap(self.AXIS_FORMAT).codes

    def _minor(self, chord: Fixed, minor: Fixed, shift: np.ndarray) -> np.ndarray:
        """Codes of ``minor 2^j T`` with 26 fraction bits."""
        value, change = self._looked_up(self.reciprocals, chord.codes << 2 * shift, 36)
        reciprocal = (value - change).round_half_up(17).saturate(self.RECIPROCAL_FORMAT)
        shifted = Fixed(SQ(23, 34), minor.codes << shift).wrap(SQ(3, 34))
        factor = shifted.round_half_up(16).saturate(self.MINOR_FORMAT)
        return (reciprocal * factor).round_half_up(26).wrap(self.AXIS_FORMAT).codes

    def _polar(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, Fixed]:
        """Radius times CORDIC's gain, as codes with 26 fraction bits, and direction."""
        behind = x < 0
        x, y = np.where(behind, -x, x), np.where(behind, -y, y)
        direction = np.where(behind, self.DIRECTION_FORMAT.min_code, 0)
        for i, angle in enumerate(self.directions.codes.tolist()):
            below = y < 0
            x, y = np.where(below, x - (y >> i), x + (y >> i)), np.where(below, y + (x >> i), y - (x >> i))
            direction = np.where(below, direction - angle, direction + angle)
        return x, Fixed(SQ(3, 28), direction).wrap(self.DIRECTION_FORMAT)

    def _step(self, angle: Fixed, shift: np.ndarray, length: np.ndarray) -> Fixed:
        """Step ``psi/(m-1)``, cut to 40 fraction bits. `reciprocal_table` gives the reciprocal."""
        address, halvings = reciprocal_address(length - 1)
        leading = Fixed(UQ(18, 36), angle.codes << shift).round_half_up(18).saturate(self.MANTISSA_FORMAT)
        product = leading * reciprocal_table()[address]
        # The table holds half of 1/f, and the product has 35 fraction bits.
        return Fixed(self.STEP_FORMAT, product.codes << 6 >> (shift + halvings))
