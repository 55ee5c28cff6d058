"""Bit-accurate model of the exact power unit: Blinn's highlight, the baseline of the approximations."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.reference.reflection import BLINN

__all__ = ["Power"]


@dataclass(frozen=True)
class Power(HighlightOperand):
    """Specular term ``max(cos gamma, 0)^n`` for n of 10 bits, by squares and products over the bits of n.

    The unit computes with complements, ``x = 1 - c``. Near the peak c^n multiplies a relative error of c by
    n, and x keeps its digits there. Square and product are one operation, ``1 - (1-p)(1-q) = p + q - p q``.
    For every bit of n, from the lowest, ``s <- s + x - s x`` if the bit is set, then ``x <- 2 x - x^2``. The
    term is ``1 - s``.

    ======= ========= ====================================================================
    word    format    why
    ======= ========= ====================================================================
    x, s    UQ(0, 34) exact sums; saturate: x = 1 for c <= 0 and for a light that is behind
    factors UQ(0, 17) multiplier operands; cut from x and s
    result  UQ(0, 17) operand of the colour multipliers; cut
    ======= ========= ====================================================================

    The arithmetic error of the result for an exact argument is at most `ERROR`, and only makes the result
    smaller (docs/theory/bounds.md#power). Where the cosine falls, the term may rise, but by at most 5 steps
    of 2^-17, 0.01 LSB at intensity 1. With the operand ``cosine``, 1 is 2^-16 more than the square of a
    code's length. So with n = 1 the term is one step instead of 0, from the right angle to 2^-17 past it.

    Parameters
    ----------
    operand : str
        ``"cosine"`` or ``"one_minus_cosine"``; see `HighlightOperand`.

    Raises
    ------
    ValueError
        If the operand is unknown.

    Source: docs/theory/units.md#exact-power; [B] 3.
    """

    operand: Literal["cosine", "one_minus_cosine"] = "cosine"

    reflection: ClassVar = BLINN

    COMPLEMENT_FORMAT = UQ(0, 34)
    FACTOR_FORMAT = UQ(0, 17)
    ERROR = 6 * 2.0**-17

    @property
    def name(self) -> str:
        """Name of the unit. The name of the reflection model stands for its unit with a table."""
        return f"{self.reflection.name}_product"

    @property
    def last_lit_arguments(self) -> np.ndarray:
        """Largest lit argument for each exponent: ``c^n = 2^-17``, because the result is never too large.

        A further step allows for the rounding of float64.
        """
        exponent = np.arange(1 << self.EXPONENT_BITS)
        argument = -np.expm1(-17 * np.log(2) / np.maximum(exponent, 1)) / self.ARGUMENT_FORMAT.step
        return np.where(exponent > 0, np.ceil(argument).astype(np.int64) + 1, 1 << 27)

    def compute(self, operand: Fixed, dark: np.ndarray, exponent: int) -> Fixed:
        """Bit-accurate specular terms.

        Parameters
        ----------
        operand : Fixed, any shape
            ``cos gamma`` or ``1 - cos gamma`` in `operand_format`.
        dark : bool array, same shape
            Whether the light is behind the surface: the result is 0.
        exponent : int
            1 to 1000.

        Returns
        -------
        Fixed, same shape, UQ(0, 17)

        Raises
        ------
        ValueError
            If the operand has another format or the exponent is out of range.
        """
        s = self.complement(operand, dark, exponent)
        one = Fixed(s.format, np.full_like(s.codes, s.format.max_code))
        return (one - s).truncate(17).saturate(self.RESULT_FORMAT)

    def complement(self, operand: Fixed, dark: np.ndarray, exponent: int) -> Fixed:
        """One minus the term, in UQ(0, 34), before its last bits are cut. Parameters as for `compute`."""
        x = self.one_minus(operand, exponent).extend(SQ(5, 34))
        format = self.COMPLEMENT_FORMAT
        x = Fixed(format, np.where(dark, format.max_code, x.saturate(format).codes))
        s = Fixed(format, np.zeros_like(x.codes))
        for bit in range(self.EXPONENT_BITS):
            if exponent >> bit & 1:
                s = self._combine(s, x)
            x = self._combine(x, x)
        return s

    def _combine(self, p: Fixed, q: Fixed) -> Fixed:
        """Complement of the product of two complemented factors: ``p + q - p q``."""
        return (p + q - p.truncate(17) * q.truncate(17)).saturate(self.COMPLEMENT_FORMAT)
