"""Spans of the quotient method: squared lengths and lines of every pixel, by forward differences."""

from dataclasses import dataclass
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.spans import checked_lengths, pixels_of

__all__ = ["MARGIN", "PixelWords", "QuotientSpans", "QuotientWords", "SpanVectors"]


MARGIN = 4
"""Least distance of a component from 1, in units of 2^-17.

A component of 1 would wrap, and rounding may add up to 2.5 units at the last pixel.
"""


class SpanVectors(NamedTuple):
    """Vectors ``v = N/W`` of spans: at the first pixel, and the step to the next.

    Pixel i of a span has the vector ``start + i 2^-exponent step``, times any scale.
    `QuotientSpans.components` names the components.

    Parameters
    ----------
    start, step : int64 arrays, shape (spans, components)
        Codes of ``SQ(1, 17)``, from ``-(2^17 - 1)`` to ``2^17 - 1``.
    exponent : int64 array, shape (spans,)
        0 to 15.
    line, line_step : int64 arrays, shape (spans, lights), optional
        Exact l of ``start`` and of ``step``, see `QuotientSpans.line`. Only if the span brings its lines.
    """

    start: np.ndarray
    step: np.ndarray
    exponent: np.ndarray
    line: np.ndarray | None = None
    line_step: np.ndarray | None = None

    def __getitem__(self, which: Any) -> Any:
        """Some of the spans, by a slice, indices or a mask; or a field, by its number."""
        if isinstance(which, int):
            return tuple.__getitem__(self, which)
        fields: Any = (None if field is None else field[which] for field in tuple(self))
        return SpanVectors(*fields)

    @classmethod
    def quantise(cls, left: np.ndarray, right: np.ndarray, length: np.ndarray) -> "SpanVectors":
        """Nearest codes of vectors at both ends, scaled to fill the words.

        The largest component of both ends is 1 less `MARGIN` steps of 2^-17. The exponent is the largest
        number with which the step fits, and at most ``ceil(log2(m - 1)) + 3``.

        Parameters
        ----------
        left, right : float64 arrays, shape (spans, components)
            Vectors at the first and the last pixel; not both 0.
        length : int array, shape (spans,)
            Pixels m, 1 to 4095. In a span of one pixel the right end has no effect. If the step of a span of
            two pixels does not fit, give two spans of one pixel.

        Raises
        ------
        ValueError
            If both vectors of a span are 0 or not finite, a length is out of range, or a step does not fit.
        """
        format = QuotientSpans.COMPONENT_FORMAT
        length = checked_lengths(length)
        steps = np.maximum(length - 1, 1)
        right = np.where((length == 1)[:, np.newaxis], left, right)
        bits = format.fraction_bits
        # A maximum of columns takes a fraction of the time of a maximum along a short axis.
        largest = reduce(np.maximum, np.maximum(np.abs(left), np.abs(right)).T)
        if not (np.isfinite(largest) & (largest > 0)).all():
            raise ValueError("a span needs a vector at one of its ends that is finite and not 0")
        scale = ((1 - MARGIN * 2.0**-bits) / largest)[:, np.newaxis]
        step = (right - left) * scale / steps[:, np.newaxis]
        largest = np.maximum(reduce(np.maximum, np.abs(step).T), 2.0**-60)
        fits = np.floor(-np.log2(largest * (1 + 2.0**-bits))).astype(np.int64)
        if (fits < 0).any():
            raise ValueError("the step of a span of two pixels does not fit: give two spans of one pixel")
        exponent = np.minimum(fits, np.ceil(np.log2(steps)).astype(np.int64) + 3)
        return cls(
            Fixed.round(format, left * scale).codes,
            Fixed.round(format, step * np.ldexp(1.0, exponent)[:, np.newaxis]).codes,
            exponent,
        )


class PixelWords(NamedTuple):
    """Words of every pixel.

    Parameters
    ----------
    numerator : Fixed, shape (pixels, lights)
        m of each light; empty without highlights.
    rest : Fixed, shape (pixels,)
        w, so that ``q = m + w`` with m of the first light.
    line : Fixed, shape (pixels, lights)
        l of each light.
    away : bool array, shape (pixels, lights)
        Whether ``z < 0``. It is ``False`` if z is not used.
    """

    numerator: Fixed
    rest: Fixed
    line: Fixed
    away: np.ndarray


class QuotientWords(NamedTuple):
    """Start, first and second difference of every accumulator, each an int64 array, shape (spans, ...).

    Parameters
    ----------
    squares : tuple of three arrays, shape (spans, lights + 1)
        ``m`` of each light, and ``w`` last. If there are no highlights, only ``w``.
    lines : tuple of two arrays, shape (spans, lights)
        l of each light. l has no second difference.
    heights : tuple of two arrays, shape (spans, lights)
        z of each light. z has no second difference. Empty without ``QuotientSpans.takes_heights``.
    """

    squares: tuple[np.ndarray, np.ndarray, np.ndarray]
    lines: tuple[np.ndarray, np.ndarray]
    heights: tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class QuotientSpans:
    """Words of every pixel from `SpanVectors`: squared lengths and lines, by forward differences.

    In the frame of a light (`light_frame`) the components of v are x, y, z. With ``highlights``:

    - ``m = x^2 + y^2``, the numerator of ``sin^2 gamma``; with ``mirror`` ``x^2 + (y cos a)^2``;
    - ``w = q - m`` of the first light: ``z^2``; with ``mirror`` ``z^2 + (y sin a)^2``;
    - ``l = x sin a + z cos a``, the numerator of N·L;
    - z, whose sign tells whether there is a highlight; ``mirror`` does not use z.

    Without highlights ``w = x^2 + y^2 + z^2`` in the frame with z along the first light, and l is z. A
    further light brings its l alone.

    A square has the start ``v·v``, the first difference ``2 v·d 2^-e + b`` and the second
    ``2 d·d 2^-2e``; b is half of the second difference, cut. Lines have the start ``v·L`` and the
    difference ``d·L 2^-e``. d is the step and e its exponent; all products are of 18 bits. Pixel i has
    ``f + i D1 + i (i - 1)/2 D2``, exact in the words.

    ========= ============ =================================================================
    word      format       why
    ========= ============ =================================================================
    v, d      SQ(1, 17)    multiplier operands; -1 does not occur
    sin, cos  SQ(1, 17)    L scaled to `ONE`, so that no ``N·L`` reaches 1
    m, w      SQ(2, 47)    ``v·v`` is exact with 34 fraction bits; differences are cut to F = 13 more;
                           SQ(3, 47) without highlights
    l         SQ(2, 36)    ``v·L`` is exact with 34 fraction bits; 2 more for the difference, cut
    z         SQ(1, 29)    12 more, cut; only its sign is used
    ========= ============ =================================================================

    At pixel i the words are off by at most ``(i + i^2/2) 2^-47`` (m, w), ``i 2^-36`` (l), ``i 2^-29`` (z).
    ``|v| < 2``, and m and w are convex along a span. So no word wraps if both ends of the span are in the
    range of the components. The last pixel, ``start + (K - 1) 2^-exponent step``, has to be in the range with
    its rounded step. A source of spans has to ensure this, as `SpanVectors.quantise` does by its margin.

    Parameters
    ----------
    lights : int
        Number of lights, at least 1.
    highlights : bool
        Whether there is specular light.
    mirror : bool
        Whether the highlight is of R·V; only with ``highlights``.

    Raises
    ------
    ValueError
        If there is no light, or ``mirror`` is given without highlights.

    Source: docs/theory/quotient.md#span.
    """

    lights: int = 1
    highlights: bool = True
    mirror: bool = False

    COMPONENT_FORMAT = SQ(1, 17)
    EXPONENT_FORMAT = UQ(4, 0)
    LINE_FORMAT = SQ(2, 36)
    EXACT_LINE_FORMAT = SQ(2, 34)
    HEIGHT_FORMAT = SQ(1, 29)
    ONE = 2**17 - 2
    """Code of length 1 of L. After rounding the code's length is under 1, so the line never outgrows v."""

    def __post_init__(self) -> None:
        if self.lights < 1:
            raise ValueError(f"lights must be at least 1, not {self.lights}")
        if self.mirror and not self.highlights:
            raise ValueError("without highlights there is no mirror direction")

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components of a vector, in order.

        ``x0, y0, z0, x1, y1, z1, ...`` by light; with ``mirror`` y is ``y cos a``, and ``y sin a`` of the
        first light comes last, as ``s0``. If there are no highlights, the names are ``x0, y0, z0, z1, z2,
        ...``: z along each light.
        """
        if not self.highlights:
            return ("x0", "y0", *(f"z{light}" for light in range(self.lights)))
        names = tuple(f"{axis}{light}" for light in range(self.lights) for axis in "xyz")
        return (*names, "s0") if self.mirror else names

    @property
    def brings_lines(self) -> bool:
        """Whether spans bring l of start and step, so that the hardware does not multiply for them."""
        return False

    @property
    def takes_heights(self) -> bool:
        """Whether the sign of z counts: with highlights of N·H."""
        return self.highlights and not self.mirror

    @property
    def squares(self) -> tuple[tuple[str, ...], ...]:
        """Components whose squares make m of each light, and w last."""
        if not self.highlights:
            return (("x0", "y0", "z0"),)
        lights = tuple((f"x{light}", f"y{light}") for light in range(self.lights))
        return (*lights, ("z0", "s0") if self.mirror else ("z0",))

    @property
    def square_format(self) -> Format:
        """Format of m and w."""
        return SQ(2 if self.highlights else 3, 47)

    def codes_of(self, sine: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Codes of L in the frames of lights: int64 array, shape (lights, 2), for sin a and cos a."""
        found: np.ndarray = np.rint(np.stack([sine, cosine], axis=-1) * self.ONE).astype(np.int64)
        return found

    def line(self, vector: np.ndarray, direction: np.ndarray | None = None) -> np.ndarray:
        """Exact l of vectors: int64 codes of `EXACT_LINE_FORMAT`, shape (spans, lights).

        Parameters
        ----------
        vector : int64 array, shape (spans, components)
            Codes of the vectors.
        direction : int64 array, shape (lights, 2) or (spans, lights, 2)
            Codes of sin a and cos a, see `codes_of`; not used without highlights.

        Raises
        ------
        ValueError
            If there are highlights and no direction, or a code of the direction is out of range.
        """
        place = {name: index for index, name in enumerate(self.components)}
        height = np.asarray(vector, np.int64)[:, [place[f"z{k}"] for k in range(self.lights)]]
        if not self.highlights:
            scaled: np.ndarray = height * self.ONE
            return scaled
        if direction is None:
            raise ValueError("highlights need sin a and cos a of each light")
        codes = Fixed(self.COMPONENT_FORMAT, direction).codes
        across = np.asarray(vector, np.int64)[:, [place[f"x{k}"] for k in range(self.lights)]]
        turned: np.ndarray = across * codes[..., 0] + height * codes[..., 1]
        return turned

    def differences(self, vectors: SpanVectors, direction: np.ndarray | None = None) -> QuotientWords:
        """Bit-accurate starts and differences.

        Parameters
        ----------
        vectors : SpanVectors
            The spans. Lines that they bring are taken.
        direction : int64 array, shape (lights, 2)
            Codes of sin a and cos a, see `codes_of`; not used without highlights, or if spans bring lines.

        Raises
        ------
        ValueError
            If a code is out of range, or the number of components is wrong.
        """
        start, step, exponent = self._checked(vectors)
        place = {name: index for index, name in enumerate(self.components)}
        shift = exponent[:, np.newaxis]

        def products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            pairs = a * b
            return np.stack([pairs[:, [place[c] for c in names]].sum(axis=1) for names in self.squares], -1)

        fraction = self.square_format.fraction_bits - 34
        second = (products(step, step) << (fraction + 1)) >> (2 * shift)
        first = ((products(start, step) << (fraction + 1)) >> shift) + (second >> 1)
        squares = products(start, start) << fraction, first, second

        given = (vectors.line, vectors.line_step)
        line, line_step = (
            self.line(vector, direction) if codes is None else Fixed(self.EXACT_LINE_FORMAT, codes).codes
            for codes, vector in zip(given, (start, step), strict=True)
        )
        fraction = self.LINE_FORMAT.fraction_bits - 34
        lines = line << fraction, (line_step << fraction) >> shift
        heights = (np.empty((len(exponent), 0), dtype=np.int64),) * 2
        if self.takes_heights:
            chosen = [place[f"z{k}"] for k in range(self.lights)]
            fraction = self.HEIGHT_FORMAT.fraction_bits - 17
            heights = start[:, chosen] << fraction, (step[:, chosen] << fraction) >> shift
        return QuotientWords(squares, lines, heights)

    def compute(
        self, vectors: SpanVectors, length: np.ndarray, direction: np.ndarray | None = None
    ) -> PixelWords:
        """Bit-accurate words of every pixel, in closed form, in the order of the spans.

        Parameters
        ----------
        vectors : SpanVectors
            The spans.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.
        direction
            As for `differences`.

        Raises
        ------
        ValueError
            As `differences` does.
        """
        words = self.differences(vectors, direction)
        span, index = pixels_of(checked_lengths(length))
        index = index[:, np.newaxis]
        first, second = words.squares[1][span], words.squares[2][span]
        # An int64 wraps modulo 2^64, and the hardware modulo 2^width. Their low bits agree.
        squares = words.squares[0][span] + index * first + index * (index - 1) // 2 * second
        squares = Fixed(self.square_format, self.square_format.wrap(squares))
        line, height = (start[span] + index * step[span] for start, step in (words.lines, words.heights))
        away = self.HEIGHT_FORMAT.wrap(height) < 0
        if not self.takes_heights:
            away = np.zeros(line.shape, dtype=bool)
        line = Fixed(self.LINE_FORMAT, self.LINE_FORMAT.wrap(line))
        return PixelWords(squares[:, :-1], squares[:, -1], line, away)

    def _checked(self, vectors: SpanVectors) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Codes of vectors, or `ValueError`."""
        for name in ("start", "step"):
            codes = Fixed(self.COMPONENT_FORMAT, getattr(vectors, name)).codes
            if codes.shape != (len(vectors.exponent), len(self.components)):
                raise ValueError(f"{name} must have the components {', '.join(self.components)}")
            if codes.size and codes.min() == self.COMPONENT_FORMAT.min_code:
                raise ValueError(f"{name} must be greater than -1")
        exponent = Fixed(self.EXPONENT_FORMAT, vectors.exponent).codes
        return np.asarray(vectors.start, np.int64), np.asarray(vectors.step, np.int64), exponent
