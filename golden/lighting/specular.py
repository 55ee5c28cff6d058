"""Bit-accurate model of the specular unit: the cosine-quadratic model with its cutoff, and related models."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from blysk.golden.lighting.highlight_operand import MAX_EXPONENT, HighlightOperand
from blysk.golden.number.fixed import UQ, Fixed, Format
from blysk.golden.reference.reflection import (
    COSQUAD,
    AngleCosine,
    Exponential,
    PolynomialModel,
    ReflectionModel,
)

__all__ = ["MAX_EXPONENT", "Chords", "Specular"]


@dataclass(frozen=True)
class Chords:
    """A monotone function by chords: a table of starts and steps, with 11 bits to interpolate within a chord.

    Parameters
    ----------
    start, step : Fixed, shape (entries,)
        Value at the start of each interval, and its distance to the next; equal fraction bits.
    rising : bool
        Whether the steps are added; else they are subtracted.
    """

    start: Fixed
    step: Fixed
    rising: bool

    INTERPOLATION_FORMAT = UQ(0, 11)

    @classmethod
    def of(cls, ends: np.ndarray, start_format: Format, step_format: Format) -> "Chords":
        """Chords between the values at the ends of equal intervals."""
        codes = Fixed.round(start_format, ends).codes
        rising = bool(codes[-1] > codes[0])
        return cls(
            Fixed(start_format, codes[:-1]),
            Fixed(step_format, np.diff(codes) if rising else -np.diff(codes)),
            rising,
        )

    def compute(self, code: np.ndarray) -> Fixed:
        """Bit-accurate values: the low 11 bits of the code interpolate, the bits above are the address."""
        format = self.INTERPOLATION_FORMAT
        address = code >> format.width
        product = self.step[address] * Fixed(format, code & format.max_code)
        way = product.truncate(self.start.format.fraction_bits).codes
        start = self.start.codes[address]
        return Fixed(self.start.format, start + way if self.rising else start - way)


def _lowered(function: Callable[[np.ndarray], np.ndarray], entries: int) -> np.ndarray:
    """Values at the ends of chords of a convex function on [0, 1].

    They are lowered by half of the largest error.
    """
    ends = function(np.arange(entries + 1) / entries)
    high = (ends[1:] + ends[:-1]) / 2 - function((np.arange(entries) + 0.5) / entries)
    found: np.ndarray = np.maximum(ends - (np.r_[high[0], high] + np.r_[high, high[-1]]) / 4, 0)
    return found


@dataclass(frozen=True)
class Specular(HighlightOperand):
    """Specular term of a model at exponent n: ``max(1 - k (1 - cos gamma), 0)^p`` and related curves.

    Most models have ``k = a n + b``. ``cosquad_q`` reads k from a table of 1024 words. p is 2, 4 or 8: models
    of [Lyon93] square once, twice or three times. ``exp`` is ``exp(-n (1 - cos gamma)) = 2^(-16 p)`` with ``p
    = k (1 - cos gamma)``, ``k = n log2(e)/16``. The whole part of 16 p is a shift. Its fraction addresses a
    table of 64 values of ``2^-f``, and 11 bits interpolate between them.

    ``coscos2`` and ``coscos4`` are ``cos^k(a gamma)``, powers of a base ``cos(a gamma) = cos(pi/2 sqrt w)``
    with ``w = (2 a gamma / pi)^2``. They need no root and no arccos, because gamma^2 is smooth in cos gamma,
    and the cosine of a root is smooth in w. ``gamma^2 = 2 x (1 + e)`` with ``x = 1 - cos gamma``. e is 0 at
    the peak, and comes from a table of 128 chords over x in [0, 2). So ``w = p + p e`` with ``p = k x``,
    ``k = 8 a^2 / pi^2``. By Taylor's rule k is ``4 n / pi^2`` or ``2 n / pi^2``. By equal integrals k comes
    from a table of 1024 words. The base comes from 64 chords over w in [0, 1). From w = 1 on the term is 0.

    The slope is normalised to ``k = K 2^s`` with K in [1/2, 1), and ``1 - cos gamma`` is shifted by s before
    the multiplier. So both operands keep their 17 bits at every exponent.

    ============= ========== ===================================================================
    word          format     why
    ============= ========== ===================================================================
    1 - cos gamma UQ(1, 25)  at n = 1000 the shift takes up 9 of the fraction bits; saturates
    k             UQ(9, 18)  at most 511.5; ``n/2`` and ``7n/16`` are exact
    K             UQ(0, 17)  multiplier operand; cut
    shifted       UQ(1, 16)  multiplier operand; cut, saturates (from 1/K on the term is 0)
    base          UQ(0, 17)  ``1 - 2^-17 - p`` is the product p, cut, with its bits inverted
    squares       UQ(0, 17)  cut
    16 p          UQ(5, 17)  of ``exp``
    table         UQ(0, 19)  chords of ``2^-f`` or the cosine, lowered by half of their error
    e             UQ(1, 18)  chords; multiplier operand, cut to UQ(1, 16)
    p, w          UQ(0, 17)  of ``coscos``; cut
    result        UQ(0, 17)  operand of the colour multipliers; cut
    ============= ========== ===================================================================

    The PROM holds for each exponent the largest shifted argument whose base reaches the cutoff. The cutoff is
    the base with a term of 2^-14: `CUTOFF` if the base is squared once, another base for other models. A lit
    base has ``p < 1`` and ``w < 1``, so nothing wraps. The comparison is made before the square, so the
    parabola's second lobe cannot come through. The dropped terms are less than ``CUTOFF^2 = 2^-14``: 1/64 LSB
    at intensity 1, 1/8 LSB at the largest, 8.

    The arithmetic error of the result for an exact argument is at most `error`.
    docs/theory/bounds.md#specular-terms derives it.

    - `ERROR` for polynomials that are squared once; 2^-12 and 2^-11 for the further squares;
    - ``2^-12 + 2^-15`` for ``exp``;
    - 2^-13 for ``coscos`` with k = 2, 2^-12 with k = 4.

    Parameters
    ----------
    reflection : ReflectionModel
        A `PolynomialModel`, an `AngleCosine` or an `Exponential`.
    operand : str
        ``"cosine"`` or ``"one_minus_cosine"``; see `HighlightOperand`.
    as_published : bool
        Whether the unit has the comparator of figure 3.6 as published, for polynomials that are squared once.
        It compares the *square*, with 2^-14 at every exponent. Up to the base's zero the terms equal the
        default's terms to the bit. Past the zero the parabola rises again, and its second lobe comes through.
        Squares over 1 saturate. So from ``k (1 - cos gamma) = 2`` on the surface is as bright as at the peak:
        at n = 20 from 37 degrees on. A highlight gate for this unit lets every span through.

    Raises
    ------
    ValueError
        In one of these cases:

        - the model is not one of `SERVED`;
        - a polynomial's a or b outgrows its word;
        - its slope at exponent 1023 outgrows the word of the slope;
        - it has no form as published;
        - the operand is unknown.

    Source: docs/theory/units.md#specular-unit; [T] 3.1 and 3.4, figures 3.6 and 3.7; [C] for ``cosquad_lin``
    and ``cosquad_q``; [Lyon93].
    """

    reflection: ReflectionModel = COSQUAD
    operand: Literal["cosine", "one_minus_cosine"] = "cosine"
    as_published: bool = False

    SERVED: ClassVar = (PolynomialModel, AngleCosine, Exponential)
    """Families of reflection models that the unit serves."""

    A_FORMAT = UQ(0, 19)
    B_FORMAT = UQ(0, 18)
    SLOPE_FORMAT = UQ(9, 18)
    SCALE_FORMAT = UQ(0, 17)
    SHIFTED_FORMAT = UQ(1, 16)
    PUBLISHED_FORMAT = UQ(2, 16)
    BASE_FORMAT = UQ(0, 17)
    CUTOFF = 1 / 128
    ERROR = 2.0**-13

    def __post_init__(self) -> None:
        if not isinstance(self.reflection, self.SERVED):
            raise ValueError(f"the specular unit does not serve {self.reflection.name}")
        line = isinstance(self.reflection, PolynomialModel) and self.reflection.curve is None
        if self.as_published and not (line and self.squarings == 1):
            raise ValueError(
                f"as_published is of polynomials that are squared once, not of {self.reflection.name}"
            )
        if isinstance(self.reflection, PolynomialModel):
            self._check_slope(self.reflection)
        super().__post_init__()

    def _check_slope(self, model: PolynomialModel) -> None:
        last = (1 << self.EXPONENT_BITS) - 1
        for name, value, format in (
            ("a", model.a, self.A_FORMAT),
            ("b", model.b, self.B_FORMAT),
            (f"slope at exponent {last}", model.slope(last), self.SLOPE_FORMAT),
        ):
            most = format.max_code * format.step
            if not 0 <= value <= most:
                raise ValueError(f"{model.name}: {name} must be from 0 to {most:.6f}, not {value}")

    @property
    def name(self) -> str:
        """Name of the reflection model."""
        return self.reflection.name

    @property
    def is_coscos(self) -> bool:
        """Whether the model is a power of ``cos(a gamma)``."""
        return isinstance(self.reflection, AngleCosine)

    @property
    def is_exponential(self) -> bool:
        """Whether the model is an exponential, which shifts in place of squaring."""
        return isinstance(self.reflection, Exponential)

    @property
    def squarings(self) -> int:
        """How often the base is squared: 1 to 3, 0 for ``exp``."""
        if isinstance(self.reflection, AngleCosine):
            return self.reflection.power.bit_length() - 1
        return self.reflection.squarings if isinstance(self.reflection, PolynomialModel) else 0

    @property
    def error(self) -> float:
        """Bound of the arithmetic error for the model."""
        return (2.0**-12 + 2.0**-15, self.ERROR, 2.0**-12, 2.0**-11)[self.squarings]

    @property
    def word_formats(self) -> dict[str, Format]:
        """Formats of argument, slope times argument, base, and powers of the base, see `HighlightOperand`."""
        # A cosine is squared in place of the base.
        names = ("square", "square_2", "square_3")[: 0 if self.is_coscos else self.squarings]
        squares = dict.fromkeys(names, self.BASE_FORMAT * self.BASE_FORMAT)
        product = self.SHIFTED_FORMAT * self.SCALE_FORMAT
        return {"argument": self.ARGUMENT_FORMAT, "product": product, "base": self.BASE_FORMAT, **squares}

    @property
    def cutoff(self) -> Fixed:
        """Smallest base that is not cut off. Its term is at most 2^-14."""
        if self.is_exponential:
            return Fixed(self.BASE_FORMAT, self.BASE_FORMAT.code(1 / 8))
        return Fixed(self.BASE_FORMAT, math.floor(2.0 ** (17 - 14 / 2**self.squarings)))

    @property
    def slope_terms(self) -> tuple[Fixed, Fixed] | None:
        """``a`` and ``b`` of the slope ``k = a n + b``, in words of the hardware; None: a table holds k."""
        if isinstance(self.reflection, AngleCosine):
            if self.reflection.rule != "taylor":
                return None
            a, b = 8 / (self.reflection.power * math.pi**2), 0.0
        elif isinstance(self.reflection, PolynomialModel):
            if self.reflection.curve is not None:
                return None
            a, b = self.reflection.a, self.reflection.b
        else:
            a, b = math.log2(math.e) / 16, 0.0
        return Fixed.round(self.A_FORMAT, a), Fixed.round(self.B_FORMAT, b)

    @cached_property
    def slopes(self) -> Fixed:
        """Slope k for exponents 0 to 1023; if a table holds k, it is 0 at exponent 0."""
        exponents = np.arange(1 << self.EXPONENT_BITS)
        if self.slope_terms is None:
            return Fixed.round(self.SLOPE_FORMAT, [0.0, *map(self._slope, exponents[1:].tolist())])
        a, b = self.slope_terms
        total = (a * Fixed(UQ(self.EXPONENT_BITS, 0), exponents)).truncate(18) + b
        return total.wrap(self.SLOPE_FORMAT)

    def _slope(self, exponent: int) -> float:
        if isinstance(self.reflection, AngleCosine):
            return 8 * (self.reflection.scale(exponent) / math.pi) ** 2
        assert isinstance(self.reflection, PolynomialModel)
        return self.reflection.slope(exponent)

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
    def chords(self) -> Chords:
        """64 chords: for ``exp`` of ``2^-f``, for ``coscos`` of ``cos(pi/2 sqrt w)``."""
        if self.is_exponential:
            return Chords.of(_lowered(lambda f: 2.0**-f, 64), UQ(0, 19), UQ(-6, 19))
        return Chords.of(_lowered(lambda w: np.cos(math.pi / 2 * np.sqrt(w)), 64), UQ(0, 19), UQ(-5, 19))

    @cached_property
    def excess(self) -> Chords:
        """128 chords of ``e = gamma^2 / (2 x) - 1`` over x in [0, 2), for ``coscos``."""
        x = np.arange(1, 129) / 64
        return Chords.of(np.r_[0, np.arccos(1 - x) ** 2 / (2 * x) - 1], UQ(1, 18), UQ(-1, 18))

    @cached_property
    def boundaries(self) -> Fixed:
        """The PROM: largest shifted argument that is not cut off, for exponents 0 to 1023.

        The unit as published has no PROM: every word here is the largest argument.
        """
        format = self.SHIFTED_FORMAT
        exponent = np.arange(1 << self.EXPONENT_BITS)
        scale, shift = self.scale(exponent)
        if self.as_published:
            return Fixed(format, np.full(exponent.shape, format.max_code))
        if not self.is_coscos:
            largest = self.BASE_FORMAT.max_code - self.cutoff.codes
            codes = (((largest + 1) << 16) - 1) // np.maximum(scale.codes, 1)
            return Fixed(format, np.minimum(codes, format.max_code))
        # By bisection, because the base falls with the argument. If several arguments have the same shifted
        # argument, the last of them counts.
        boundary = np.zeros_like(exponent)
        for bit in reversed(range(format.width)):
            shifted = boundary | 1 << bit
            last = np.minimum(((shifted + 1 << 10) - 1) >> (shift + 1), self.ARGUMENT_FORMAT.max_code)
            base = self._cosine(Fixed(self.ARGUMENT_FORMAT, last), Fixed(format, shifted) * scale)
            boundary = np.where(base >= self.cutoff.codes, shifted, boundary)
        return Fixed(format, boundary)

    @property
    def last_lit_arguments(self) -> np.ndarray:
        """Last lit arguments, computed from the PROM in integers."""
        _, shift = self.scale(np.arange(1 << self.EXPONENT_BITS))
        boundary = self.boundaries.codes
        arguments: np.ndarray = (((boundary + 1) << 10) - 1) >> (shift + 1)
        arguments[boundary == self.SHIFTED_FORMAT.max_code] = 1 << 27
        return arguments

    def compute(self, operand: Fixed, dark: np.ndarray, exponent: int) -> Fixed:
        """Bit-accurate specular terms.

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
        argument = self.one_minus(operand, exponent).truncate(25).saturate(self.ARGUMENT_FORMAT)
        scale, shift = self.scale(np.asarray(exponent))
        shifted = Fixed(UQ(10, 26), argument.codes << (shift + 1)).truncate(16)
        lit = ~np.asarray(dark, dtype=bool)
        if self.as_published:
            return self._as_published(shifted.saturate(self.PUBLISHED_FORMAT) * scale, lit)
        shifted = shifted.saturate(self.SHIFTED_FORMAT)
        lit &= shifted <= self.boundaries[exponent]
        product = shifted * scale
        if self.is_exponential:
            return self._exponential(product.truncate(21).scale(4), lit)
        if self.is_coscos:
            codes = self._cosine(argument, product)
        else:
            codes = self.BASE_FORMAT.max_code - product.truncate(17).codes
        base = Fixed(self.BASE_FORMAT, np.where(lit, codes, 0))
        for _ in range(self.squarings):
            base = (base * base).truncate(17)
        return base

    def _as_published(self, product: Fixed, lit: np.ndarray) -> Fixed:
        """Square of a base of either sign; 0 if it is less than the square of `CUTOFF`."""
        p, largest = product.truncate(17).codes, self.BASE_FORMAT.max_code
        codes = np.where(p <= largest, largest - p, np.minimum(p - largest - 1, largest))
        base = Fixed(self.BASE_FORMAT, np.where(lit, codes, 0))
        square = (base * base).truncate(17)
        return Fixed(self.RESULT_FORMAT, np.where(square.values >= self.CUTOFF**2, square.codes, 0))

    def _cosine(self, argument: Fixed, product: Fixed) -> np.ndarray:
        """Codes of ``cos(a gamma)``, from ``w = p + p e``, saturated."""
        p = product.truncate(17).saturate(self.BASE_FORMAT)
        e = self.excess.compute(argument.codes >> 8).truncate(16)
        w = (p + p * e).truncate(17).saturate(self.BASE_FORMAT)
        found: np.ndarray = self.chords.compute(w.codes).truncate(17).codes
        return found

    def _exponential(self, power: Fixed, lit: np.ndarray) -> Fixed:
        """``2^-power`` where lit, else 0."""
        whole, value = power.codes >> 17, self.chords.compute(power.codes & 0x1FFFF)
        return Fixed(self.RESULT_FORMAT, np.where(lit, value.codes >> (whole + 2), 0))
