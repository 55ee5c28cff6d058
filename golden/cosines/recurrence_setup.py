"""Recurrence setup: start values of the interleaved recurrence, from the dot products of a span."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.reciprocal import reciprocal_address, reciprocal_table
from blysk.golden.number.spans import LENGTH_BITS, checked_lengths
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["RecurrenceSetup"]


@dataclass(frozen=True)
class RecurrenceSetup:
    """Start values of ``x(k) = A cos(lambda - k d)``, ``d = psi/(m-1)``, along a span and a fixed vector H.

    lambda is the angle from ``N_l`` to the projection of H on the plane of the great circle. A is the cosine
    of the angle of H to this plane. m is the number of pixels.

    With ``a = N_l.H``, ``b = N_r.H`` and ``q = |N_r - N_l|^2/2 = 1 - cos psi``, the curve is ``x(k) = (a
    sin(psi - k d) + b sin(k d))/sin psi``, so that

    - ``x(0) = a``,
    - ``x(1) - x(0) = rho (b - a + a q) - a K/2``, ``rho = sin d/sin psi``, ``K = 4 sin^2(d/2)``.

    This needs no lambda, no A, no arctangent and no root. rho and K are even in psi and therefore smooth in
    q. Equal normals are no special case: ``rho = 1/(m-1)`` and ``K = 0``, so every x is exactly a. All but 16
    products are the same for every H:

    - ``psi^2 = 2 q p(q)``, ``d^2 = Q = psi^2/(m-1)^2``, ``K = Q k(Q)`` and, for the coefficient of four
      pixels, ``16 Q k(16 Q)``;
    - ``rho = (1 + c)/(m-1)``, ``1 + c = i(q) (1 - s(Q))`` with ``i = psi/sin psi``, ``s = 1 - sin d/d``.

    The differences of the four functions from 1 are tables with linear interpolation. q, psi^2, Q and K each
    have a floating scale, a word in [1/2, 1) and a shift. So a small angle keeps its relative precision.
    Seven steps of the recurrence, one product each, lead from ``x(0)`` and ``x(1) - x(0)`` to the start
    values of the four phases (`Recurrence.prologue`).

    =============== ============ =================================================================
    word            format       why
    =============== ============ =================================================================
    a, b            SQ(2, 34)    times 1 + 2^-16, so that the code of length 1 counts as 1
    q               UQ(0, 35)    also times 1 + 2^-16; saturates. Word UQ(0, 17), rounded; shift 0 to 34
    p-1, i-1        UQ(0, 17)    from 512 words UQ(0, 22), with rises UQ(-8, 22), by q
    1-k, s          UQ(0, 17)    from the same formats, by Q in UQ(2, 21)
    psi^2/2, Q/8    UQ(0, 17)    word, 1/2 or more, rounded; their shifts are added
    1/(m-1)         UQ(0, 17)    table of 2048 words, with ``1/(m-1)^2`` of the same precision
    c               SQ(1, 17)    -2^-16 to 0.571
    rho             UQ(0, 17)    word, 1/2 or more, and shift
    a q             SQ(2, 33)    a rounded to SQ(2, 16); shifted and cut to 28 fraction bits
    b - a + a q     SQ(2, 28)    multiplied in two words, the upper 18 and the lower 12 bits
    K               UQ(0, 17)    as in `Recurrence`
    results         SQ(2, 44)    `Recurrence.state_format`; SQ(2, 16) in ``direct``
    =============== ============ =================================================================

    `error` bounds the error of x at any pixel, for unit vectors. At pixel k an error e of the first
    difference becomes ``k e``, and a relative error f of K becomes ``(k d)^2/2 f``. Largest error found, and
    the bound, in units of 1e-6, by the angle of the span in degrees:

    ======= ===== ===== ===== ===== =====
    angle   0     1     10    45    90
    ======= ===== ===== ===== ===== =====
    found   0.02  0.3   2.7   12    31
    bound   0.06  0.6   6.6   50    171
    ======= ===== ===== ===== ===== =====

    Up to 90 degrees no used word wraps (docs/theory/bounds.md#recurrence-setup). Spans over 90 degrees are
    flagged, from ``q = 1 + 2^-13`` on. Their words are invalid. A span of one pixel is computed with
    ``m - 1 = 1``, and nothing reads its words. The coefficient is for a step of 4d, limited to 90 degrees.

    Parameters
    ----------
    recurrence : Recurrence
        Recurrence that takes the start values: interleaved, 16 fraction bits. The start values of ``direct``
        are computed from the start values of ``reinsch``. ``x(j+4)`` is rounded half up, and
        ``-2 cos 4d = K 2^(2-s) - 2`` is rounded up.

    Raises
    ------
    ValueError
        If the recurrence is not interleaved or does not have 16 fraction bits.

    Source: docs/theory/interpolation.md#recurrence; [T] 3.1, 3.3.
    """

    recurrence: Recurrence = field(default_factory=lambda: Recurrence(interleave=4, result_format=SQ(2, 25)))

    COSINE_FORMAT = SQ(2, 34)
    CHORD_FORMAT = UQ(0, 35)
    WORD_FORMAT = UQ(0, 17)
    TABLE_VALUE_FORMAT = UQ(0, 22)
    TABLE_CHANGE_FORMAT = UQ(-8, 22)
    SQUARE_FORMAT = UQ(2, 21)
    EXCESS_FORMAT = SQ(1, 17)
    OPERAND_FORMAT = SQ(2, 16)
    SLOPE_FORMAT = SQ(2, 28)
    SLOPE_LOW_FORMAT = UQ(-16, 28)
    ADDRESS_BITS = 9
    FRACTION_BITS = 14
    CHORD_SHIFT = 34
    WIDEST = Fixed(UQ(1, 13), (1 << 13) + 1)
    TABLE_ERROR = 8e-7

    def __post_init__(self) -> None:
        r = self.recurrence
        if (r.interleave, r.fraction_bits) != (4, 16):
            raise ValueError("the recurrence must be interleaved, with 16 fraction bits")

    @cached_property
    def steps(self) -> Recurrence:
        """Recurrence of form ``reinsch`` that makes the start values."""
        return replace(self.recurrence, form="reinsch")

    def error(self, length: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Bound of the error of every pixel by setup and recurrence together, for unit vectors.

        The error is measured against the curve above for the same codes, for ``reinsch``.
        docs/theory/bounds.md#recurrence-setup derives it. `Recurrence.error` and `Recurrence.prologue_error`
        are parts of it.

        Parameters
        ----------
        length : int array
            Pixels m.
        angle : array
            psi in radians, up to 90 degrees.
        """
        angle = np.asarray(angle, dtype=np.float64)
        steps = np.maximum(np.asarray(length) - 1, 1)
        word, table = 2.0**-18, self.TABLE_ERROR
        square = 9 * word + table
        coefficient = square + (word + table) / 0.81 + word / 0.40
        slope = 5 * word + 2.6 * (word + table) + np.square(angle / steps) / 4 * square
        q = 1 - np.cos(angle)
        difference = (4 * word * q + 4 * 2.0**-28) / np.sinc(angle / np.pi)
        chord = np.where(q > 0.499, 0.65 * 2.7e-5, 0)
        cuts = 2.0**-32 + 4095 * 4 * 2.0**-44
        own = self.recurrence.error(length, angle) + self.recurrence.prologue_error(length, angle)
        found: np.ndarray = (
            np.square(angle) / 2 * coefficient + angle * slope + difference + chord + cuts + own
        )
        return found

    @cached_property
    def chord_tables(self) -> tuple[tuple[Fixed, Fixed], tuple[Fixed, Fixed]]:
        """Tables of ``psi^2/(2q) - 1`` and ``psi/sin psi - 1`` for q from 0 to 1."""

        def angle(q: np.ndarray) -> np.ndarray:
            return 2 * np.arcsin(np.sqrt(q / 2))

        def square(q: np.ndarray) -> np.ndarray:
            found: np.ndarray = np.square(angle(q)) / (2 * q) - 1
            return found

        def inverse(q: np.ndarray) -> np.ndarray:
            found: np.ndarray = angle(q) / np.sin(angle(q)) - 1
            return found

        start = np.arange(1 << self.ADDRESS_BITS) / (1 << self.ADDRESS_BITS)
        return self._lines(square, start), self._lines(inverse, start)

    @cached_property
    def step_tables(self) -> tuple[tuple[Fixed, Fixed], tuple[Fixed, Fixed]]:
        """Tables of ``1 - 4 sin^2(d/2)/d^2`` and ``1 - sin d/d`` for ``d^2`` from 0 to 4."""

        def one_minus_k(square: np.ndarray) -> np.ndarray:
            found: np.ndarray = 1 - 4 * np.square(np.sin(np.sqrt(square) / 2)) / square
            return found

        def sine(square: np.ndarray) -> np.ndarray:
            found: np.ndarray = 1 - np.sin(np.sqrt(square)) / np.sqrt(square)
            return found

        start = 4 * np.arange(1 << self.ADDRESS_BITS) / (1 << self.ADDRESS_BITS)
        return self._lines(one_minus_k, start), self._lines(sine, start)

    def _lines(self, function: Callable[[np.ndarray], np.ndarray], start: np.ndarray) -> tuple[Fixed, Fixed]:
        """Lines of nearly least maximum error, start and change, for a function that is 0 at 0."""
        width = start[1]
        low, middle, high = (function(np.maximum(start + width * part, 1e-12)) for part in (0, 0.5, 1))
        value = np.maximum(low - ((low + high) / 2 - middle) / 2, 0)
        value[0] = 0
        return Fixed.round(self.TABLE_VALUE_FORMAT, value), Fixed.round(self.TABLE_CHANGE_FORMAT, high - low)

    @cached_property
    def reciprocals(self) -> tuple[Fixed, Fixed, np.ndarray]:
        """Words r and S of ``1/(m-1) = 2 r 2^-s`` and ``1/(m-1)^2 = 4 S 2^-(2s + small)``, and ``small``."""
        size = 1 << (LENGTH_BITS - 1)
        square = 1 / np.square(1 + np.arange(size) / size)
        square[0] = 0.25
        small = square < 0.5
        word = Fixed.round(UQ(1, 17), square * (1 + small)).saturate(self.WORD_FORMAT)
        return reciprocal_table(self.WORD_FORMAT), word, small.astype(np.int64)

    def compute(
        self, normal_left: Fixed, normal_right: Fixed, vector: Fixed, length: np.ndarray
    ) -> tuple[Fixed, Fixed, Fixed, np.ndarray, np.ndarray]:
        """Bit-accurate start values of spans.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (spans, 3), SQ(1, 17)
            Unit vectors.
        vector : Fixed, shape (3,) or (spans, 3), SQ(1, 17)
            Unit vector H, or L.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.

        Returns
        -------
        first, second : Fixed, shape (spans, 4), `Recurrence.state_format`
            Start values, see `Recurrence.start`.
        coefficient : Fixed, shape (spans,), `Recurrence.coefficient_format`
            Coefficient of a step of four pixels.
        shift : int array, shape (spans,)
            Shift of the coefficient.
        out_of_range : bool array, shape (spans,)
            Whether the span is over 90 degrees. Its words are then invalid.

        Raises
        ------
        ValueError
            If an operand has another format or a length is out of range.
        """
        length = checked_lengths(length)
        if {normal_left.format, normal_right.format, vector.format} != {COMPONENT}:
            raise ValueError(f"operands must be {COMPONENT}")
        chord = Chord().compute(normal_right, normal_left)
        chord = chord + chord.scale(-16).truncate(35)
        out_of_range = chord >= self.WIDEST
        chord = chord.saturate(self.CHORD_FORMAT)
        q, q_shift = self._normalised(chord)
        square, inverse = (self._looked_up(t, chord.codes, 35) for t in self.chord_tables)
        address, step_shift = reciprocal_address(length - 1)
        reciprocal, reciprocal_square, small = (word[address] for word in self.reciprocals)

        # psi^2/2 and Q/8.
        psi_square, over = self._under_one(q + q * square)
        q_square, under = self._over_half(psi_square * reciprocal_square)
        exponent = q_shift - over + 2 * step_shift + small + under
        step_bits, phase_bits = (
            (q_square.codes << bits >> exponent) & self.SQUARE_FORMAT.max_code for bits in (7, 11)
        )
        sine = self._looked_up(self.step_tables[1], step_bits, 23)
        step_coefficient, coefficient = (
            (q_square - q_square * self._looked_up(self.step_tables[0], bits, 23))
            .round_half_up(17)
            .saturate(self.WORD_FORMAT)
            for bits in (step_bits, phase_bits)
        )
        excess = ((inverse - sine) - inverse * sine).round_half_up(17).saturate(self.EXCESS_FORMAT)
        rho, over = self._under_one(reciprocal + reciprocal * excess)
        rho_shift = step_shift - over

        left, right = (self._cosine(normal, vector) for normal in (normal_left, normal_right))
        a_q = left.round_half_up(16).saturate(self.OPERAND_FORMAT) * q
        a_q = Fixed(a_q.format, a_q.codes >> q_shift).truncate(28)
        slope = ((right - left).truncate(28) + a_q).wrap(self.SLOPE_FORMAT)
        high = Fixed(self.OPERAND_FORMAT, slope.codes >> self.SLOPE_LOW_FORMAT.width)
        low = Fixed(self.SLOPE_LOW_FORMAT, slope.codes & self.SLOPE_LOW_FORMAT.max_code)
        rho_slope = (high * rho + low * rho).scale(1)
        rho_slope = Fixed(rho_slope.format, rho_slope.codes >> rho_shift)
        state = self.steps.state_format
        first = left.extend(state)
        curvature = self._curvature(first, step_coefficient, exponent - 1)
        second = (rho_slope - Fixed(curvature.format, curvature.codes >> 1)).wrap(state)
        first, second = self.steps.prologue(first, second, step_coefficient, exponent - 1)
        shift = np.maximum(exponent - 5, 0)
        if self.recurrence.form == "direct":
            second = (first + second).wrap(state)
            first, second = (x.round_half_up(16).wrap(self.recurrence.state_format) for x in (first, second))
            codes = -(-(coefficient.codes << 1) >> shift)
            coefficient = Fixed(SQ(4, 16), codes - (2 << 16)).saturate(self.recurrence.coefficient_format)
            shift = np.zeros_like(shift)
        return first, second, coefficient, shift, out_of_range

    def _cosine(self, normal: Fixed, vector: Fixed) -> Fixed:
        """Dot product in units of `ONE_SQUARED`."""
        cosine = DotProduct().compute(normal, vector)
        return (cosine + cosine.scale(-16).truncate(34)).saturate(self.COSINE_FORMAT)

    def _normalised(self, chord: Fixed) -> tuple[Fixed, np.ndarray]:
        """Word of q, and its left shift. The word is in [1/2, 1), unless q is 0."""
        shift = np.full_like(chord.codes, self.CHORD_SHIFT)
        for j in range(self.CHORD_SHIFT - 1, -1, -1):
            shift[chord.codes >> (34 - j) > 0] = j
        word = Fixed(self.CHORD_FORMAT, chord.codes << shift)
        return word.round_half_up(17).saturate(self.WORD_FORMAT), shift

    def _under_one(self, value: Fixed) -> tuple[Fixed, np.ndarray]:
        """Word under 1 for a value under 2, and whether the word is half of the value."""
        over = value >= Fixed(UQ(1, 0), 1)
        halved = Fixed(value.format, np.where(over, value.codes, value.codes << 1)).scale(-1)
        return halved.round_half_up(17).saturate(self.WORD_FORMAT), over.astype(np.int64)

    def _over_half(self, value: Fixed) -> tuple[Fixed, np.ndarray]:
        """Word of 1/2 or more for a value of 1/4 or more, and whether the word is twice the value."""
        under = value < Fixed(UQ(0, 1), 1)
        doubled = Fixed(value.format, value.codes << under)
        return doubled.round_half_up(17).saturate(self.WORD_FORMAT), under.astype(np.int64)

    def _looked_up(self, table: tuple[Fixed, Fixed], bits: np.ndarray, width: int) -> Fixed:
        """Interpolated value of a table at an operand of ``width`` bits."""
        values, changes = table
        below = width - self.ADDRESS_BITS
        address = bits >> below
        fraction = bits >> (below - self.FRACTION_BITS) & ((1 << self.FRACTION_BITS) - 1)
        change = (Fixed(UQ(0, self.FRACTION_BITS), fraction) * changes[address]).round_half_up(22)
        return (values[address] + change).round_half_up(17).saturate(self.WORD_FORMAT)

    def _curvature(self, x: Fixed, coefficient: Fixed, shift: np.ndarray) -> Fixed:
        """Second difference ``K 2^(2-s) x``, as the recurrence computes it."""
        r = self.steps
        half = Fixed(r.state_format, 1 << (r.guard_bits - 1))
        operand = (x + half).wrap(r.state_format).truncate(r.fraction_bits)
        curvature = (operand * coefficient).scale(2).extend(r.curvature_format)
        return Fixed(curvature.format, curvature.codes >> shift).truncate(r.state_format.fraction_bits)
