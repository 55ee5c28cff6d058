"""Quotients: N·L, and the place of the squared sine in a lobe's table, by one reciprocal root a pixel."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from blysk.golden.cosines.quotient_spans import PixelWords, QuotientSpans
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format

__all__ = ["OCTAVES", "STEPS", "Quotient", "place_format"]

OCTAVES, STEPS = 15, 16
"""Octaves of a part of a lobe's table, and steps of a row. One more row has the numbers below all octaves."""

FRACTION_BITS = 12
"""Bits of a place within a step."""


def place_format(parts: int) -> Format:
    """Format of a place in a table of one or two parts; a place past the end stands for no highlight."""
    return UQ((parts * (OCTAVES + 1) * STEPS).bit_length(), FRACTION_BITS)


@dataclass(frozen=True)
class Quotient:
    """Operands of a pixel: ``N·L = l/sqrt(q)``, and the place of ``s = m/q`` in a table by octaves.

    ``q = m + w`` is shifted by an even number of bits, 2k, into [1, 4). Then ``r = 1/sqrt(q)`` comes from a
    table of 384 entries with one product. N·L is ``l 2^k r``. m is shifted into a word of 17 bits, by
    multiples of four. ``s = m r^2`` then has a leading one within the upper seven bits. Its octave and the 16
    bits behind the leading one are its place in the table (`QuotientLobe`).

    *Two parts.* If ``m > w``, the place is the place of ``1 - s = w/q`` in a second part of the table. So
    both ends of the range have octaves. With ``mirror`` there is one part, because a highlight of R·V ends at
    ``s = 1/2``. From there on the place is past the end. Without ``mirror`` it is past the end where ``z <
    0``.

    *Row.* Octave ``[2^-(j+1), 2^-j)`` with j = 0 to 14 is row 15 - j. The numbers below all octaves are row
    0, with equal steps.

    ============ =========== =====================================================================
    word         format      why
    ============ =========== =====================================================================
    m, w         SQ(2, 40)   cut; 6 bits of the accumulators below the bits of ``v·v``
    q            UQ(2, 34)   sum of m and w, each cut to 34
    q shifted    UQ(2, 19)   cut; 9 bits address the table, 12 interpolate
    r            UQ(0, 17)   1/2 to 1; rounded; saturates
    r^2          UQ(0, 17)   1/4 to 1; cut
    line         SQ(2, 16)   l 2^k, cut
    N·L          SQ(2, 18)   cut; the last bit is for the rounding in `Diffuse`
    numerator    17 bits     14 to 17 of these bits are used; cut
    place        UQ(i, 12)   cut
    ============ =========== =====================================================================

    A pixel with ``q < 2^-14`` of the largest scale is flagged. Its results are invalid. In spans that are cut
    for the method (`QuotientInterpolator.cut`) q is at least 0.05, and no pixel is flagged.

    The relative error of r is at most `ROOT_ERROR`, the relative error of s at most `SINE_ERROR`. N·L is off
    by `ROOT_ERROR` and 2^-16. docs/theory/bounds.md#quotient derives them.

    Parameters
    ----------
    spans : QuotientSpans
        The words of a span: lights, highlights, mirror.

    Source: docs/theory/quotient.md#pixel.
    """

    spans: QuotientSpans = field(default_factory=QuotientSpans)

    ROOT_FORMAT = UQ(0, 17)
    SQUARE_ROOT_FORMAT = UQ(0, 17)
    LINE_FORMAT = SQ(2, 16)
    COSINE_FORMAT = SQ(2, 18)
    PIXEL_FRACTION = 40
    SHIFTS = 7
    GROUPS = 6
    COMPARED = 20
    TABLE_BITS = 9
    BASE_FORMAT = UQ(0, 19)
    SLOPE_FORMAT = UQ(-8, 19)
    ROOT_ERROR = 10 * 2.0**-19
    SINE_ERROR = 2 * ROOT_ERROR + 2.0**-15 + 2.0**-13 + 2.0**-16
    COSINE_ERROR = ROOT_ERROR + 2.0**-16

    @property
    def parts(self) -> int:
        """Parts of a lobe's table: 2, or 1 with ``mirror``."""
        return 1 if self.spans.mirror else 2

    @property
    def place_format(self) -> Format:
        """Format of a place."""
        return place_format(self.parts)

    @cached_property
    def table(self) -> tuple[Fixed, Fixed]:
        """Entries ``base`` and ``slope`` of the reciprocal root, shape (512,) each, by q's upper 9 bits.

        ``r = base - slope f`` with f from 0 to 1 in a step. The first 128 entries are unused. A base is moved
        by half of the chord's error in the middle, and contains half a step for the rounding of r.
        """
        step = 2.0 ** -(self.TABLE_BITS - 2)
        q = np.maximum(np.arange(1 << self.TABLE_BITS) * step, 1.0)
        left, middle, right = ((q + step * t) ** -0.5 for t in (0, 0.5, 1))
        format = self.BASE_FORMAT
        # The product of the slope is cut, so r would be half a step too large on average.
        half = 2.0 ** -(self.ROOT_FORMAT.fraction_bits + 1) - format.step / 2
        base = np.minimum(left + (middle - (left + right) / 2) / 2 + half, 1 - format.step)
        return Fixed.round(format, base), Fixed.round(self.SLOPE_FORMAT, left - right)

    def word(self, name: str, codes: np.ndarray) -> np.ndarray:
        """Codes of a word of the datapath. A subclass may record the word, or cut it short.

        Parameters
        ----------
        name : str
            ``m``, ``w``, ``q``, ``q shifted``, ``slope`` (the product with the table's slope), ``r``,
            ``r^2``, ``line``, ``N·L``, ``numerator``, ``s`` or ``place``.
        codes : int64 array
            The codes. ``m``, ``line``, ``N·L``, ``numerator``, ``s`` and ``place`` have an axis of lights.
        """
        return codes

    def root(self, square: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bit-accurate reciprocal root.

        Parameters
        ----------
        square : int64 array
            Codes of q, 36 bits.

        Returns
        -------
        root, shift : int64 arrays
            Codes of r, and k: q is shifted by 2 k bits.
        too_small : bool array
            Whether q is too small.
        """
        shift = np.full(square.shape, self.SHIFTS)
        for k in reversed(range(self.SHIFTS)):
            shift[square >> (34 - 2 * k) > 0] = k
        normal = self.word("q shifted", (square << (2 * shift)) >> 15)
        fraction_bits = 21 - self.TABLE_BITS
        entry, fraction = normal >> fraction_bits, normal & ((1 << fraction_bits) - 1)
        base, slope = (word.codes for word in self.table)
        way = self.word("slope", (slope[entry] * fraction) >> fraction_bits)
        root = np.minimum((base[entry] - way) >> 2, self.ROOT_FORMAT.max_code)
        return self.word("r", root), shift, square >> 20 == 0

    def compute(self, pixels: PixelWords) -> tuple[Fixed, Fixed, np.ndarray]:
        """Bit-accurate N·L and places of s of every pixel.

        Parameters
        ----------
        pixels : PixelWords
            Words of the pixels.

        Returns
        -------
        cosine : Fixed, shape (pixels, lights), SQ(2, 18)
            N·L.
        place : Fixed, shape (pixels, lights), `place_format`
            Place of s, or of 1 - s, in a lobe's table. Without highlights all places are past the end.
        too_small : bool array, shape (pixels,)
            Whether q is too small.
        """
        cut = self.PIXEL_FRACTION
        numerator = self.word("m", pixels.numerator.truncate(cut).codes)
        rest = self.word("w", pixels.rest.truncate(cut).codes)
        whole = cut - 34
        square = (rest >> whole) + (numerator[:, 0] >> whole if self.spans.highlights else 0)
        square = self.word("q", square & (1 << 36) - 1)
        root, shift, too_small = self.root(square)
        root, shift = root[:, np.newaxis], shift[:, np.newaxis]
        line = (pixels.line.codes << shift) >> (self.spans.LINE_FORMAT.width - self.LINE_FORMAT.width)
        line = self.word("line", self.LINE_FORMAT.wrap(line))
        cosine = Fixed(self.LINE_FORMAT, line) * Fixed(self.ROOT_FORMAT, root)
        cosine = cosine.truncate(self.COSINE_FORMAT.fraction_bits)
        cosine = Fixed(cosine.format, self.word("N·L", cosine.codes))
        past = (self.parts * (OCTAVES + 1) * STEPS) << FRACTION_BITS
        if not self.spans.highlights:
            return cosine, Fixed(self.place_format, np.full(line.shape, past)), too_small
        # At most z^2 of each light, except for the drift.
        exact = SQ(2, cut).wrap((rest + numerator[:, 0])[:, np.newaxis] - numerator)
        second = self._second(numerator, exact)
        chosen = np.maximum(np.where(second, exact, numerator), 0)
        place = self._place(chosen, self.word("r^2", (root * root) >> 17), shift)
        dark = pixels.away | (place >= (OCTAVES << 16 if self.spans.mirror else 16 << 16))
        place = np.where(dark, past, place + (second << 20))
        return cosine, Fixed(self.place_format, place), too_small

    def _second(self, numerator: np.ndarray, rest: np.ndarray) -> np.ndarray:
        """Whether a place is in the second part: ``m > w``, compared in their upper bits."""
        if self.spans.mirror:
            return np.zeros(numerator.shape, dtype=bool)
        dropped = self.PIXEL_FRACTION + 2 - self.COMPARED
        return numerator >> dropped > rest >> dropped

    def _place(self, chosen: np.ndarray, square_root: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """Place of ``chosen / q`` in a part of the table: 20 bits, or 2^20 or more if it is 1 or more."""
        group = np.full(chosen.shape, self.GROUPS)
        for k in reversed(range(self.GROUPS)):
            group[chosen >> (38 - 4 * k) > 0] = k
        product = self.word("s", self.word("numerator", (chosen << (4 * group)) >> 25) * square_root)
        # The product has 34 bits; s is product 2^-34 2^(2 + 2 shift - 4 group).
        zeros = np.full(chosen.shape, 7)
        for k in reversed(range(7)):
            zeros[product >> (33 - k) > 0] = k
        octave = 4 * group - 2 * shift - 2 + zeros
        mantissa = (product << zeros) >> 17
        row = OCTAVES - octave
        # Below the octaves the leading 1 is a part of the position, too.
        low = np.minimum(np.maximum(octave - OCTAVES + 1, 0), 17)
        place = np.where(octave < OCTAVES, (row << 16) + (mantissa & 0xFFFF), mantissa >> low)
        return self.word("place", np.where(octave < 0, 1 << 20, place))
