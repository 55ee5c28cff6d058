"""Highlight-cosine unit: the cosine of the angle to a fixed vector along a great circle ([T] 3.2)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from blysk.golden.number.fixed import SQ, UQ, Fixed, Format

__all__ = ["HighlightCosine"]


@dataclass(frozen=True)
class HighlightCosine:
    """Operand ``1 - cos gamma`` of every pixel, with ``cos gamma(t) = cos beta cos(lambda - t psi)``.

    N(t) moves along a great circle. beta is the angle between the plane of this circle and H. lambda is the
    angle from N_l to the projection of H onto the plane. One signed accumulator counts
    ``theta = lambda - t psi`` down in turns. If the highlight is inside the span, theta passes through zero.
    So one pass is enough. [T] has two passes. With the light vector L in place of H the result is ``1 -
    N·L``.

    The table holds ``v = 1 - cos`` for a quarter of the wave. theta is folded into the quarter. Then
    ``1 - cos gamma`` is ``(1 - cos beta) + cos beta v`` in the half turn about the highlight, and
    ``(1 + cos beta) - cos beta v`` in the other half turn. So the result is most accurate where it is small,
    which high exponents need. Below ``v = 1/32`` (14 degrees) the multiplier gets all bits of v.

    ============== ============= ====================================================================
    word           format        why
    ============== ============= ====================================================================
    lambda, theta  SQ(0, 40)     turns; wraps as an angle
    step           UQ(0, 40)     ``psi/(m-1)``; its rounding adds up to 2^-29 turns in 4095 pixels
    cos beta       UQ(1, 25)     up to sqrt 2, for spans whose normals only differ by their rounding
    table          36 bits       v in UQ(0, 22), rise over a segment in UQ(-8, 22): 512 words are
                                 one block RAM
    v              UQ(0, 22)     for the multiplier in UQ(-5, 22) below 1/32, in UQ(0, 17) above
    cos beta       UQ(1, 16)     for the multiplier
    result         UQ(1, 25)     ``1 - cos gamma`` for the specular unit; saturates
    ============== ============= ====================================================================

    The arithmetic error of the result, for exact operands and cos beta up to 1, is at most `NEAR_ERROR` if v
    is under 1/32, else `ERROR`. docs/theory/bounds.md#highlight-cosine derives both.

    Parameters
    ----------
    address_bits : int
        Address bits of the table, 4 to 12: it has ``2**address_bits`` words.
    interpolated : bool
        Whether there is linear interpolation between the words. Without interpolation, as published, the
        error of the table is ``h/2`` with ``h = pi/1024``, 0.0015 with 512 words. The bounds above hold for
        512 words with interpolation.

    Raises
    ------
    ValueError
        If ``address_bits`` is out of range.

    Source: docs/theory/interpolation.md#angular-method; [T] 3.2.
    """

    address_bits: int = 9
    interpolated: bool = True

    PHASE_FORMAT = SQ(0, 40)
    STEP_FORMAT = UQ(0, 40)
    COS_BETA_FORMAT = UQ(1, 25)
    TABLE_VALUE_FORMAT = UQ(0, 22)
    FRACTION_BITS = 14
    FAR_FORMAT = UQ(0, 17)
    FACTOR_FORMAT = UQ(1, 16)
    RESULT_FORMAT = UQ(1, 25)
    LENGTH_BITS = 12
    _COMMON = 3 * 2.0**-23 + 2.0**-26
    NEAR_ERROR = (np.pi / 1024) ** 2 * 0.0858 + _COMMON + 2.0**-25 * 2 * np.pi * 0.25 + 2.0**-17 / 32
    ERROR = (np.pi / 1024) ** 2 / 16 + _COMMON + 2.0**-25 * 2 * np.pi + 2.0**-17 + 2.0**-17

    def __post_init__(self) -> None:
        if not 4 <= self.address_bits <= 12:
            raise ValueError(f"address_bits must be 4 to 12, not {self.address_bits}")

    @property
    def rise_format(self) -> Format:
        """Format of the rise of v over a segment of the table; a rise is at most ``pi/2`` of the width."""
        return UQ(1 - self.address_bits, self.TABLE_VALUE_FORMAT.fraction_bits)

    @cached_property
    def table(self) -> tuple[Fixed, Fixed]:
        """Table of v: value at the start of each segment of the quarter wave, and rise to its end.

        Each line has the least maximum error. The first goes through 0, so the peak is exact. Without
        interpolation the value is the mean of both ends, and the rise is 0.
        """
        size = 1 << self.address_bits
        width = np.pi / 2 / size
        start = width * np.arange(size)
        low, high = 1 - np.cos(start), 1 - np.cos(start + width)
        rise = high - low
        if not self.interpolated:
            return Fixed.round(self.TABLE_VALUE_FORMAT, (low + high) / 2), Fixed.round(
                self.rise_format, 0 * rise
            )
        # The wave is farthest below its chord where its slope, the sine, equals the slope of the chord.
        steepest = np.arcsin(rise / width)
        sagitta = low + (steepest - start) * rise / width - (1 - np.cos(steepest))
        value = low - sagitta / 2
        # The line through 0 of least maximum error has 2 (sqrt 2 - 1) times the rise of the chord.
        value[0], rise[0] = 0, rise[0] * 2 * (np.sqrt(2) - 1)
        return Fixed.round(self.TABLE_VALUE_FORMAT, value), Fixed.round(self.rise_format, rise)

    def compute(
        self, phase: Fixed, step: Fixed, cos_beta: Fixed, span: np.ndarray, index: np.ndarray
    ) -> Fixed:
        """Bit-accurate values, in closed form.

        Parameters
        ----------
        phase : Fixed, shape (spans,), SQ(0, 40)
            ``lambda`` in turns.
        step : Fixed, shape (spans,), UQ(0, 40)
            ``psi/(m-1)`` in turns.
        cos_beta : Fixed, shape (spans,), UQ(1, 25)
        span : int array, shape (pixels,)
            Span of each pixel.
        index : int array, shape (pixels,)
            Index of each pixel in its span, 0 to 4094.

        Returns
        -------
        Fixed, shape (pixels,), UQ(1, 25)
            ``1 - cos gamma``.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        formats = (self.PHASE_FORMAT, self.STEP_FORMAT, self.COS_BETA_FORMAT)
        if (phase.format, step.format, cos_beta.format) != formats:
            raise ValueError(
                f"operands must be {', '.join(map(str, formats))}, "
                f"not {phase.format}, {step.format}, {cos_beta.format}"
            )
        theta = phase.codes[span] - np.asarray(index, dtype=np.int64) * step.codes[span]
        # Inverted bits replace the negative, which would need a carry. This is an error of 2^-40 turns.
        bits = theta & ((1 << 40) - 1)
        magnitude = np.where(bits >> 39 > 0, ~bits, bits) & ((1 << 39) - 1)
        back = magnitude >> 38 > 0
        angle = np.where(back, ~magnitude, magnitude) & ((1 << 38) - 1)
        address = angle >> (38 - self.address_bits)
        values, rises = self.table
        v = values[address]
        if self.interpolated:
            fraction = angle >> (38 - self.address_bits - self.FRACTION_BITS) & (
                (1 << self.FRACTION_BITS) - 1
            )
            rise = Fixed(UQ(0, self.FRACTION_BITS), fraction) * rises[address]
            v = (v + rise.round_half_up(22)).saturate(self.TABLE_VALUE_FORMAT)
        near = v.codes >> 17 == 0
        far = v.round_half_up(17).saturate(self.FAR_FORMAT)
        beta = cos_beta[span]
        factor = beta.round_half_up(16).saturate(self.FACTOR_FORMAT)
        operand = Fixed(self.FAR_FORMAT, np.where(near, v.codes, far.codes))
        product = operand * factor
        # Below 1/32 the operand has five more fraction bits.
        aligned = Fixed(UQ(1, 26), np.where(near, product.codes >> 12, product.codes >> 7)).round_half_up(25)
        one = Fixed(UQ(1, 25), 1 << 25)
        total = np.where(back, (one + beta).codes - aligned.codes, (one - beta).codes + aligned.codes)
        return Fixed(SQ(4, 25), total).saturate(self.RESULT_FORMAT)
