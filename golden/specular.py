"""Specular unit: the cosine-quadratic model with its cutoff ([T] figures 3.6 and 3.7)."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from .dot_product import DotProduct
from .fixed import UQ, Fixed, Format
from .unit_vector import ONE_SQUARED

__all__ = ["MAX_EXPONENT", "SPECULAR_MODELS", "Specular"]

MAX_EXPONENT = 1000
"""Largest specular exponent."""

SPECULAR_MODELS = ("cosquad", "cosquad7", "cosquad_lin")
"""Reflection models that the unit serves."""

_SLOPES = {"cosquad": (1 / 2, 0.0), "cosquad7": (7 / 16, 0.0), "cosquad_lin": (0.448, 0.099)}


@dataclass(frozen=True)
class Specular:
    """``max(1 - k (1 - cos gamma), 0)^2`` with ``k = a n + b``, by model and exponent n.

    The slope is normalised to ``k = K 2^s`` with K in [1/2, 1), and ``1 - cos gamma`` shifted by s before
    the multiplier, so that both its operands keep their 17 bits at every exponent.

    ============= ========== ===================================================================
    word          format     why
    ============= ========== ===================================================================
    1 - cos gamma UQ(1, 25)  at n = 1000 the shift takes up 9 of the fraction bits; saturates
    k             UQ(9, 18)  at most 511.5; ``n/2`` and ``7n/16`` are exact
    K             UQ(0, 17)  multiplier operand; cut
    shifted       UQ(1, 16)  multiplier operand; cut, saturates (anything from 1/K on is dark)
    base          UQ(0, 17)  ``1 - 2^-17 - p`` is the product p, cut, with its bits inverted
    result        UQ(0, 17)  operand of the colour multipliers; cut
    ============= ========== ===================================================================

    The PROM holds for each exponent the largest shifted argument whose base reaches `CUTOFF`. It is
    compared with the argument of the square, never with the square, so the parabola's second lobe cannot
    come through. What it drops is under ``CUTOFF^2 = 2^-14``: 1/64 LSB at intensity 1, 1/8 LSB at the
    largest, 8.

    Arithmetic error of the result for an exact argument, at most `ERROR`: base is off by 2^-16 each from
    the argument, its shift and K, and by 2^-17 from the product; the square doubles it; the result adds
    2^-17.

    Parameters
    ----------
    model : str
        One of `SPECULAR_MODELS`.
    operand : str
        ``"cosine"``: the unit takes ``N . H`` of two unit vectors in ``SQ(4, 34)`` and subtracts it from 1.
        ``"one_minus_cosine"``: it takes ``1 - cos gamma`` in ``UQ(1, 25)``.

    Raises
    ------
    ValueError
        If the model is not one of those, or the operand is unknown.

    Source: [T] 3.4, figures 3.6 and 3.7; [C] for ``cosquad_lin``; numbers.md, "Traps in the documents".
    """

    model: str = "cosquad"
    operand: Literal["cosine", "one_minus_cosine"] = "cosine"

    ARGUMENT_FORMAT = UQ(1, 25)
    SLOPE_FORMAT = UQ(9, 18)
    SCALE_FORMAT = UQ(0, 17)
    SHIFTED_FORMAT = UQ(1, 16)
    BASE_FORMAT = UQ(0, 17)
    RESULT_FORMAT = UQ(0, 17)
    EXPONENT_BITS = 10
    CUTOFF = 1 / 128
    ERROR = 2.0**-13

    def __post_init__(self):
        if self.model not in SPECULAR_MODELS:
            raise ValueError(f"the specular unit serves {', '.join(SPECULAR_MODELS)}, not {self.model!r}")
        if self.operand not in ("cosine", "one_minus_cosine"):
            raise ValueError(f"operand must be 'cosine' or 'one_minus_cosine', not {self.operand!r}")

    @property
    def operand_format(self) -> Format:
        """Format of the input."""
        return DotProduct().result_format if self.operand == "cosine" else self.ARGUMENT_FORMAT

    @property
    def slope_terms(self) -> tuple[Fixed, Fixed]:
        """``a`` and ``b`` of the slope ``k = a n + b``, in words of the hardware."""
        a, b = _SLOPES[self.model]
        return Fixed.round(UQ(0, 19), a), Fixed.round(UQ(0, 18), b)

    def scale(self, exponent: np.ndarray) -> tuple[Fixed, np.ndarray]:
        """``K`` and ``s`` of the slope ``k = K 2^s``, for exponents 0 to 1023.

        Returns
        -------
        scale : Fixed, UQ(0, 17)
            ``K``, at least 1/2 from exponent 1 on.
        shift : int array
            ``s``, -1 to 9.
        """
        a, b = self.slope_terms
        slope = (a * Fixed(UQ(self.EXPONENT_BITS, 0), exponent)).truncate(18) + b
        code = slope.wrap(self.SLOPE_FORMAT).codes
        shift = np.full_like(code, -1)
        for s in range(10):
            shift[code >> (s + 17) > 0] = s
        return Fixed(self.SCALE_FORMAT, (code << (9 - shift) >> 10) & self.SCALE_FORMAT.max_code), shift

    @cached_property
    def boundaries(self) -> Fixed:
        """The PROM: largest shifted argument that is not cut off, for exponents 0 to 1023."""
        scale, _ = self.scale(np.arange(1 << self.EXPONENT_BITS))
        largest = self.BASE_FORMAT.max_code - self.BASE_FORMAT.code(self.CUTOFF)
        codes = (((largest + 1) << 16) - 1) // np.maximum(scale.codes, 1)
        return Fixed(self.SHIFTED_FORMAT, np.minimum(codes, self.SHIFTED_FORMAT.max_code))

    def compute(self, operand: Fixed, dark: np.ndarray, exponent: int) -> Fixed:
        """Bit-true specular terms.

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
        if operand.format != self.operand_format:
            raise ValueError(f"operand must be {self.operand_format}, not {operand.format}")
        if not 1 <= exponent <= MAX_EXPONENT:
            raise ValueError(f"exponent must be 1 to {MAX_EXPONENT}, not {exponent}")
        if self.operand == "cosine":
            operand = (ONE_SQUARED - operand).truncate(25).saturate(self.ARGUMENT_FORMAT)
        scale, shift = self.scale(np.int64(exponent))
        shifted = Fixed(UQ(10, 26), operand.codes << (shift + 1)).truncate(16).saturate(self.SHIFTED_FORMAT)
        lit = (shifted <= self.boundaries[exponent]) & ~np.asarray(dark, dtype=bool)
        product = (shifted * scale).truncate(17)
        base = np.where(lit, self.BASE_FORMAT.max_code - product.codes, 0)
        base = Fixed(self.BASE_FORMAT, base)
        return (base * base).truncate(17)
