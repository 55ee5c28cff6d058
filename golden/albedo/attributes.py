"""Attributes of a pixel: vertex colours and texture coordinates, by one reciprocal of 1/W."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from blysk.golden.albedo.attribute_spans import MARGIN, AttributeSpans, AttributeWords
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format

__all__ = ["Attributes", "PixelAttributes"]


class PixelAttributes(NamedTuple):
    """Attributes of every pixel.

    Parameters
    ----------
    colors : Fixed, shape (pixels, 3), UQ(1, 16), or None
        Vertex colour, 0 to 1.
    coordinates : Fixed, shape (pixels, 2), `Attributes.coordinate_format`, or None
        Texture coordinates in texels of the level.
    level : int64 array, shape (pixels,), or None
        Level of the texture.
    """

    colors: Fixed | None
    coordinates: Fixed | None
    level: np.ndarray | None


@dataclass(frozen=True)
class Attributes:
    """Attributes of a pixel: ``A = U/w``, by one reciprocal of w.

    w is shifted by k bits into [1/2, 1), and each U by the same k bits. Let x be ``2 w 2^k``, from 1 to 2.
    Then ``A = 2 U 2^k r`` with ``r = 1/x``. A table of 512 entries and one product make r. It comes in two
    parts, ``r = c + d``: c is 1/2, 3/4 or 1, and ``|d| < 0.126``. So the product of an attribute needs no
    more than 18 bits of U: ``2 c U`` is an addition of whole words, and an error of U in ``2 d U`` counts for
    a quarter.

    ============== ============ ==================================================================
    word           format       why
    ============== ============ ==================================================================
    U, w           SQ(1, 23)    of `AttributeSpans`
    x              UQ(1, 22)    9 bits address the table, 13 interpolate
    d              SQ(-1, 19)   18 bits for the multipliers; rounded
    U of a colour  UQ(0, 23)    shifted; saturates at 0 and 1; in the product cut to UQ(0, 17)
    U of u, v      SQ(2, 23)    shifted; in the product rounded to SQ(1, 17), saturates
    A              SQ(2, 23)    UQ(1, 23) of a colour; ``2 d U`` and ``U/2`` are cut
    colour         UQ(1, 16)    rounded; saturates at 1
    coordinate     SQ(13, F)    ``base + A 2^range``; rounded to F = ``share_bits``
    ============== ============ ==================================================================

    Without perspective A is the word of `AttributeSpans`.

    *Error.* The relative error of r is at most `RECIPROCAL_ERROR`. The products and their dropped bits add
    `COLOR_ERROR` or `COORDINATE_ERROR`. Both sums are within 2^-17 for colours and 2^-18 for coordinates.
    `errors` adds the errors of the words and of the last rounding.

    There is a multiplier for r and one for each attribute: 4 for colours, 3 for coordinates, 6 for both.

    Parameters
    ----------
    spans : AttributeSpans
        The attributes.
    share_bits : int
        Fraction bits of texture coordinates, 8 to 14.

    Raises
    ------
    ValueError
        If the share's bits are out of range.

    Source: docs/theory/textures.md#attributes.
    """

    spans: AttributeSpans = field(default_factory=AttributeSpans)
    share_bits: int = 14

    SHIFTS = 15
    TABLE_BITS = 9
    BASE_FORMAT = SQ(-1, 22)
    SLOPE_FORMAT = UQ(-9, 24)
    RECIPROCAL_FORMAT = SQ(-1, 19)
    COLOR_FORMAT = UQ(1, 16)
    QUOTIENT_FORMAT = SQ(2, 23)
    WHOLE, HALF = 73, 307
    """c is 1 in the entries before `WHOLE`, 1/2 from the entry `HALF` on, and 3/4 between them."""

    RECIPROCAL_ERROR = 2.44 * 2.0**-20
    COLOR_ERROR = 0.252 * 2.0**-17 + 2.0**-22
    COORDINATE_ERROR = 0.252 * 2.0**-18 + 2.0**-22

    def __post_init__(self) -> None:
        if not 8 <= self.share_bits <= 14:
            raise ValueError(f"share_bits must be 8 to 14, not {self.share_bits}")

    @property
    def coordinate_format(self) -> Format:
        """Format of a texture coordinate, in texels of its level."""
        return SQ(AttributeSpans.BASE_FORMAT.width, self.share_bits)

    @cached_property
    def halves(self) -> np.ndarray:
        """``2 (2 c - 1)`` of every entry of the table: the number of halves of U added to U. Shape (512,)."""
        entry = np.arange(1 << self.TABLE_BITS)
        return np.where(entry < self.WHOLE, 2, np.where(entry < self.HALF, 1, 0))

    @cached_property
    def table(self) -> tuple[Fixed, Fixed]:
        """Entries ``base`` and ``slope`` of d, shape (512,) each, by the 9 bits behind the first bit of x.

        ``d = base - slope f`` with f from 0 to 1 in a step. A base is moved by half of the chord's error in
        the middle. The base contains half a step of d for the rounding of d, minus the mean error of the
        product's cut.
        """
        step = 2.0**-self.TABLE_BITS
        x = 1 + np.arange(1 << self.TABLE_BITS) * step
        left, middle, right = 1 / x, 1 / (x + step / 2), 1 / (x + step)
        format = self.BASE_FORMAT
        half = self.RECIPROCAL_FORMAT.step / 2 - format.step
        base = left - (0.5 + self.halves / 4) - ((left + right) / 2 - middle) / 2 + half
        return Fixed.round(format, base), Fixed.round(self.SLOPE_FORMAT, left - right)

    def reciprocal(self, weight: Fixed) -> tuple[Fixed, np.ndarray, np.ndarray]:
        """Bit-accurate reciprocal.

        Parameters
        ----------
        weight : Fixed, shape (pixels,), SQ(1, 23)
            w, at least 2^-16.

        Returns
        -------
        rest : Fixed, shape (pixels,), SQ(-1, 19)
            d.
        halves : int64 array, shape (pixels,)
            ``2 (2 c - 1)``.
        shift : int64 array, shape (pixels,)
            k, 0 to 15.
        """
        bits = weight.format.fraction_bits
        code = weight.codes & ((1 << bits) - 1)
        shift = np.minimum(bits - np.frexp(code.astype(np.float64))[1].astype(np.int64), self.SHIFTS)
        normal = (code << shift) & ((1 << (bits - 1)) - 1)
        fraction_bits = bits - 1 - self.TABLE_BITS
        entry = normal >> fraction_bits
        base, slope = (word[entry] for word in self.table)
        fraction = Fixed(UQ(0, fraction_bits), normal & ((1 << fraction_bits) - 1))
        bend = (slope * fraction).truncate(self.BASE_FORMAT.fraction_bits)
        rest = (base - bend).truncate(self.RECIPROCAL_FORMAT.fraction_bits).wrap(self.RECIPROCAL_FORMAT)
        return rest, self.halves[entry], shift

    def compute(self, words: AttributeWords) -> PixelAttributes:
        """Bit-accurate attributes of every pixel.

        Parameters
        ----------
        words : AttributeWords
            Words of the pixels.

        Raises
        ------
        ValueError
            If 1/W is missing.
        """
        colors = coordinates = None
        numerators = words.numerators
        inverse = None
        if self.spans.perspective:
            if words.weight is None:
                raise ValueError("perspective needs 1/W")
            rest, halves, shift = self.reciprocal(words.weight)
            inverse = Fixed(rest.format, rest.codes[:, np.newaxis]), halves[:, np.newaxis]
            format = SQ(2, 23)
            numerators = Fixed(format, format.wrap(numerators.codes << shift[:, np.newaxis]))
        if self.spans.colors:
            inside = numerators[:, :3].saturate(UQ(0, 23))
            if inverse:
                inside = self._quotient(inside, inside.truncate(17), *inverse).wrap(UQ(1, 23))
            one = 1 << self.COLOR_FORMAT.fraction_bits
            rounded = inside.round_half_up(self.COLOR_FORMAT.fraction_bits)
            colors = Fixed(self.COLOR_FORMAT, np.minimum(rounded.codes, one))
        if self.spans.coordinates:
            if words.base is None or words.range is None:
                raise ValueError("texture coordinates need a base and a range")
            offset = numerators[:, -2:]
            if inverse:
                operand = offset.round_half_up(17).saturate(SQ(1, 17))
                offset = self._quotient(offset, operand, *inverse).wrap(self.QUOTIENT_FORMAT)
            spread = offset.codes << words.range[:, np.newaxis]
            dropped = self.QUOTIENT_FORMAT.fraction_bits - self.share_bits
            found = ((spread >> (dropped - 1)) + 1 >> 1) + (words.base << self.share_bits)
            coordinates = Fixed(self.coordinate_format, self.coordinate_format.wrap(found))
        return PixelAttributes(colors, coordinates, words.level)

    @staticmethod
    def _quotient(numerator: Fixed, operand: Fixed, rest: Fixed, halves: np.ndarray) -> Fixed:
        """``2 c U + 2 d U``, with 23 fraction bits."""
        whole = numerator.codes + np.where(halves == 1, numerator.codes >> 1, numerator.codes * (halves == 2))
        product = (operand * rest).scale(1).truncate(23)
        return Fixed(SQ(4, 23), whole) + product

    def errors(self, words: AttributeWords, of_words: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the errors of colours and texture coordinates, for attributes from -1 to 1.

        Errors e of the words move ``U/w`` by at most ``2 e/w``. The bound counts 33/32 of this, because the
        product of a U that saturates is too small.

        Parameters
        ----------
        words : AttributeWords
            Words of the pixels.
        of_words : float64 array, shape (pixels,)
            Bounds of the errors of the words, from `AttributeSpans.errors`.

        Returns
        -------
        colors, coordinates : float64 arrays, shape (pixels,)
            Coordinates in texels.
        """
        color, coordinate = of_words + MARGIN * AttributeSpans.WORD_FORMAT.step, of_words
        if words.weight is not None:
            of_words = of_words * 2 / words.weight.values * 33 / 32
            common = of_words + (1 + of_words) * self.RECIPROCAL_ERROR
            color, coordinate = common + self.COLOR_ERROR, common + self.COORDINATE_ERROR
        if words.range is not None:
            coordinate = np.ldexp(coordinate, words.range) + self.coordinate_format.step / 2
        return color + self.COLOR_FORMAT.step / 2, coordinate
