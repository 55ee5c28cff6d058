"""Specular unit: the cosine-quadratic model with its cutoff ([T] figures 3.6 and 3.7), and its kin."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from .dot_product import DotProduct
from .fixed import UQ, Fixed, Format
from .reflection import slope
from .unit_vector import ONE_SQUARED

__all__ = ["FURTHER_MODELS", "MAX_EXPONENT", "SPECULAR_MODELS", "Specular"]

MAX_EXPONENT = 1000
"""Largest specular exponent."""

SPECULAR_MODELS = ("cosquad", "cosquad7", "cosquad_lin")
"""Reflection models of the documents that the unit serves, all of one latency."""

# a and b of the slope k = a n + b, and how often the base is squared; exp takes a table for the squarers.
_LINES = {
    "cosquad": (1 / 2, 0.0, 1),
    "cosquad7": (7 / 16, 0.0, 1),
    "cosquad_lin": (0.448, 0.099, 1),
    "lyon1_refitted": (0.3557, 0.2457, 1),
    "lyon2": (1 / 4, 0.0, 2),
    "lyon2_refitted": (0.2113, 0.1468, 2),
    "lyon3": (1 / 8, 0.0, 3),
    "lyon3_refitted": (0.1150, 0.0799, 3),
    "exp": (math.log2(math.e) / 16, 0.0, 0),
}

FURTHER_MODELS = ("cosquad_q", *(model for model in _LINES if model not in SPECULAR_MODELS))
"""Reflection models that the unit serves beside those: a table of slopes, more squarers, a table for exp."""


@dataclass(frozen=True)
class Specular:
    """``max(1 - k (1 - cos gamma), 0)^p`` with ``k = a n + b`` and p = 2, 4 or 8, by model and exponent n.

    ``cosquad_q`` reads k from a table of 1024 words; the models of Lyon square once, twice or three times.
    ``exp`` is ``exp(-n (1 - cos gamma)) = 2^(-16 p)`` with ``p = k (1 - cos gamma)``, ``k = n log2(e)/16``:
    the whole part of 16 p is a shift, its fraction addresses a table of 64 values of ``2^-f`` between
    which 11 bits interpolate.

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
    squares       UQ(0, 17)  cut
    16 p          UQ(5, 17)  of ``exp``
    table         UQ(0, 19)  of ``exp``: chords of ``2^-f``, lowered by half of what they are too high
    result        UQ(0, 17)  operand of the colour multipliers; cut
    ============= ========== ===================================================================

    The PROM holds for each exponent the largest shifted argument whose base reaches the cutoff: `CUTOFF`
    where the base is squared once, for the others what gives a term of 2^-14 too. It is
    compared with the argument of the square, never with the square, so the parabola's second lobe cannot
    come through. What it drops is under ``CUTOFF^2 = 2^-14``: 1/64 LSB at intensity 1, 1/8 LSB at the
    largest, 8.

    Arithmetic error of the result for an exact argument, at most `ERROR`: base is off by 2^-16 each from
    the argument, its shift and K, and by 2^-17 from the product; the square doubles it; the result adds
    2^-17. Each further square doubles what it gets and adds 2^-17: at most `error`, 2^-12 and 2^-11.

    Error of ``exp``: what is off by a share of p (K, the slope) is multiplied by ``p 2^(-16 p) <= 0.034``;
    the cuts of the argument and its shift, under ``2^-16 + 2^-18``, times ``16 ln 2``, are 2.2e-4; the chords
    add 7.3e-6, roundings and the rest under 2e-5: at most ``2^-12 + 2^-15``.

    Parameters
    ----------
    model : str
        One of `SPECULAR_MODELS` or `FURTHER_MODELS`.
    operand : str
        ``"cosine"``: the unit takes ``N . H`` of two unit vectors in ``SQ(4, 34)`` and subtracts it from 1.
        ``"one_minus_cosine"``: it takes ``1 - cos gamma`` in ``UQ(1, 25)``.

    Raises
    ------
    ValueError
        If the model is not one of those, or the operand is unknown.

    Source: [T] 3.4, figures 3.6 and 3.7; [C] for ``cosquad_lin`` and ``cosquad_q``; Lyon 1993; numbers.md,
    "Traps in the documents".
    """

    model: str = "cosquad"
    operand: Literal["cosine", "one_minus_cosine"] = "cosine"

    ARGUMENT_FORMAT = UQ(1, 25)
    SLOPE_FORMAT = UQ(9, 18)
    SCALE_FORMAT = UQ(0, 17)
    SHIFTED_FORMAT = UQ(1, 16)
    BASE_FORMAT = UQ(0, 17)
    RESULT_FORMAT = UQ(0, 17)
    VALUE_FORMAT = UQ(0, 19)
    DROP_FORMAT = UQ(-6, 19)
    INTERPOLATION_FORMAT = UQ(0, 11)
    EXPONENT_BITS = 10
    CUTOFF = 1 / 128
    ERROR = 2.0**-13

    def __post_init__(self):
        served = SPECULAR_MODELS + FURTHER_MODELS
        if self.model not in served:
            raise ValueError(f"the specular unit serves {', '.join(served)}, not {self.model!r}")
        if self.operand not in ("cosine", "one_minus_cosine"):
            raise ValueError(f"operand must be 'cosine' or 'one_minus_cosine', not {self.operand!r}")

    @property
    def operand_format(self) -> Format:
        """Format of the input."""
        return DotProduct().result_format if self.operand == "cosine" else self.ARGUMENT_FORMAT

    @property
    def squarings(self) -> int:
        """How often the base is squared: 1 to 3, 0 for ``exp``."""
        return 1 if self.model == "cosquad_q" else _LINES[self.model][2]

    @property
    def error(self) -> float:
        """Largest arithmetic error of the model."""
        return (2.0**-12 + 2.0**-15, self.ERROR, 2.0**-12, 2.0**-11)[self.squarings]

    @property
    def cutoff(self) -> Fixed:
        """Smallest base that is not cut off: what it leads to is 2^-14 at most."""
        if self.model == "exp":
            return Fixed(self.BASE_FORMAT, self.BASE_FORMAT.code(1 / 8))
        return Fixed(self.BASE_FORMAT, math.floor(2.0 ** (17 - 14 / 2**self.squarings)))

    @property
    def slope_terms(self) -> tuple[Fixed, Fixed] | None:
        """``a`` and ``b`` of the slope ``k = a n + b``, in words of the hardware; None for ``cosquad_q``."""
        if self.model == "cosquad_q":
            return None
        a, b, _ = _LINES[self.model]
        return Fixed.round(UQ(0, 19), a), Fixed.round(UQ(0, 18), b)

    @cached_property
    def slopes(self) -> Fixed:
        """Slope k for exponents 0 to 1023; 0 at 0 where a table holds it."""
        exponents = np.arange(1 << self.EXPONENT_BITS)
        if self.slope_terms is None:
            values = [0.0] + [slope(self.model, exponent) for exponent in exponents[1:].tolist()]
            return Fixed.round(self.SLOPE_FORMAT, values)
        a, b = self.slope_terms
        total = (a * Fixed(UQ(self.EXPONENT_BITS, 0), exponents)).truncate(18) + b
        return total.wrap(self.SLOPE_FORMAT)

    def scale(self, exponent: np.ndarray) -> tuple[Fixed, np.ndarray]:
        """``K`` and ``s`` of the slope ``k = K 2^s``, for exponents 0 to 1023.

        Returns
        -------
        scale : Fixed, UQ(0, 17)
            ``K``, at least 1/2 where k is at least 1/4.
        shift : int array
            ``s``, -1 to 9.
        """
        code = self.slopes.codes[exponent]
        shift = np.full_like(code, -1)
        for s in range(10):
            shift[code >> (s + 17) > 0] = s
        return Fixed(self.SCALE_FORMAT, (code << (9 - shift) >> 10) & self.SCALE_FORMAT.max_code), shift

    @cached_property
    def chords(self) -> tuple[Fixed, Fixed]:
        """Table of ``exp``: value at the start of each 64th of ``2^-f``, and how far it drops to the next."""
        ends = 2.0 ** -(np.arange(65) / 64)
        # A chord is too high by at most (ln 2 / 64)^2 / 8 of its value.
        values = Fixed.round(self.VALUE_FORMAT, ends * (1 - (math.log(2) / 64) ** 2 / 16))
        return values[:-1], Fixed(self.DROP_FORMAT, -np.diff(values.codes))

    @cached_property
    def boundaries(self) -> Fixed:
        """The PROM: largest shifted argument that is not cut off, for exponents 0 to 1023."""
        scale, _ = self.scale(np.arange(1 << self.EXPONENT_BITS))
        largest = self.BASE_FORMAT.max_code - self.cutoff.codes
        codes = (((largest + 1) << 16) - 1) // np.maximum(scale.codes, 1)
        return Fixed(self.SHIFTED_FORMAT, np.minimum(codes, self.SHIFTED_FORMAT.max_code))

    def compute(self, operand: Fixed, dark: np.ndarray, exponent: int) -> Fixed:
        """Bit-true specular terms.

        Parameters
        ----------
        operand : Fixed, any shape
            ``cos gamma`` or ``1 - cos gamma`` in `operand_format`; a cosine in units of `ONE_SQUARED`.
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
        product = shifted * scale
        if self.model == "exp":
            return self._exponential(product.truncate(21).scale(4), lit)
        base = np.where(lit, self.BASE_FORMAT.max_code - product.truncate(17).codes, 0)
        base = Fixed(self.BASE_FORMAT, base)
        for _ in range(self.squarings):
            base = (base * base).truncate(17)
        return base

    def _exponential(self, power: Fixed, lit: np.ndarray) -> Fixed:
        """``2^-power`` where lit, else 0."""
        start, drop = self.chords
        whole, address = power.codes >> 17, power.codes >> 11 & 63
        within = Fixed(self.INTERPOLATION_FORMAT, power.codes & self.INTERPOLATION_FORMAT.max_code)
        value = start[address].codes - (drop[address] * within).truncate(19).codes
        return Fixed(self.RESULT_FORMAT, np.where(lit, value >> (whole + 2), 0))
