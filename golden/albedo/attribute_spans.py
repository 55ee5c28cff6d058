"""Spans of attributes: vertex colours and texture coordinates divided by W, and 1/W, of every pixel."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.spans import checked_lengths, pixels_of
from blysk.golden.reference.texture import LARGEST_TEXTURE

__all__ = ["MARGIN", "WORD_DEPTH_RATIO", "AttributeSpans", "AttributeWords", "SpanAttributes", "whole_texels"]

MARGIN = 4
"""Least distance of a line's ends from 1, in units of 2^-23. Rounding may add up to 3 units to a word."""

WORD_DEPTH_RATIO = 2.0**15
"""Largest ratio of the depths at the ends of a span."""


def whole_texels(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The whole texel from which a span's texture coordinates are counted, and the range of their distance.

    Parameters
    ----------
    left, right : float64 arrays, shape (spans, 2)
        u and v at the first and the last pixel, in texels of the level.

    Returns
    -------
    base : int64 array, shape (spans, 2)
        The whole texel nearest to the middle between both ends.
    range : int64 array, shape (spans,)
        Least whole number r, 0 or more, with ``|coordinate - base| < 2^r`` at both ends. A source of spans
        cuts a span if its r would make the error too large.
    """
    base = np.floor((left + right) / 2 + 0.5)
    distance = np.maximum(np.abs(left - base), np.abs(right - base)).max(axis=1, initial=0)
    limit = 1 - MARGIN * AttributeSpans.WORD_FORMAT.step
    found = np.ceil(np.log2(np.maximum(distance / limit, 1)))
    return base.astype(np.int64), found.astype(np.int64)


class SpanAttributes(NamedTuple):
    """Attributes of spans: lines at the first pixel, and their steps to the next.

    At pixel i the word of each attribute, and of 1/W, is ``start + i 2^-exponent step``. The word U of an
    attribute A is A/W times a scale of the span. The word of 1/W has the same scale. Without perspective the
    word of an attribute is A itself.

    Parameters
    ----------
    start, step : int64 arrays, shape (spans, attributes)
        Codes of ``SQ(1, 23)``. Colours are first, then texture coordinates.
    exponent : int64 array, shape (spans,)
        0 to 15, the same for all steps of a span.
    weight_start, weight_step : int64 arrays, shape (spans,), or None
        Codes of 1/W; ``None`` without perspective.
    base : int64 array, shape (spans, 2), or None
        Whole texel from which texture coordinates are counted, within `AttributeSpans.LARGEST_BASE` of 0.
    range : int64 array, shape (spans,), or None
        0 to 11: a texture coordinate is ``base + A 2^range`` texels of the span's level.
    level : int64 array, shape (spans,), or None
        Level of the texture, 0 to 15.
    """

    start: np.ndarray
    step: np.ndarray
    exponent: np.ndarray
    weight_start: np.ndarray | None = None
    weight_step: np.ndarray | None = None
    base: np.ndarray | None = None
    range: np.ndarray | None = None
    level: np.ndarray | None = None

    def __getitem__(self, which: Any) -> Any:
        """Some of the spans, by a slice, indices or a mask; or a field, by its number."""
        if isinstance(which, int):
            return tuple.__getitem__(self, which)
        chosen: list[Any] = [None if field is None else field[which] for field in tuple(self)]
        return SpanAttributes(*chosen)

    @property
    def beats(self) -> dict[str, Any]:
        """Members of the beats of the hardware, by name, nested."""
        lines: dict[str, Any] = {}
        for member, codes, weight in (
            ("start", self.start, self.weight_start),
            ("step", self.step, self.weight_step),
        ):
            given = {
                "colors": codes[:, :3] if codes.shape[1] >= 3 else None,
                "coordinates": None if self.base is None else codes[:, -2:],
                "weight": weight,
            }
            lines[member] = {name: value for name, value in given.items() if value is not None}
        others = {name: getattr(self, name) for name in ("exponent", "base", "range", "level")}
        return lines | {name: value for name, value in others.items() if value is not None}

    @classmethod
    def quantise(
        cls,
        model: "AttributeSpans",
        left: np.ndarray,
        right: np.ndarray,
        length: np.ndarray,
        weights: tuple[np.ndarray, np.ndarray] | None = None,
        level: np.ndarray | None = None,
        periodic: np.ndarray | bool = False,
    ) -> "SpanAttributes":
        """Nearest codes of attributes at both ends, scaled to fill the words.

        The larger 1/W of the ends becomes ``1 - 4 2^-23``. Without perspective attributes are limited to this
        number, which is 1 in the format of a colour. The exponent is the largest number with which all steps
        fit, and at most ``ceil(log2(m - 1)) + 3``. In a span of two pixels a step may have to be 1 or more:
        its exponent is 0 then, and its code wraps, as the accumulators do.

        Parameters
        ----------
        model : AttributeSpans
            The attributes.
        left, right : float64 arrays, shape (spans, attributes)
            Attributes A at the first and the last pixel: colours 0 to 1, and texture coordinates in texels of
            the level.
        length : int array, shape (spans,)
            Pixels m, 1 to 4095. In a span of one pixel the right end has no effect.
        weights : pair of float64 arrays, shape (spans,)
            1/W at both ends, over 0, in any unit. Only with perspective.
        level : int array, shape (spans,)
            Level of the texture. By default all levels are 0.
        periodic : bool array, shape (spans, 2), or bool
            Whether u and v may change by multiples of `AttributeSpans.PERIOD` texels: with ``repeat`` and
            ``mirror``. The base is then brought into its range. If not, a span with both ends
            beyond `AttributeSpans.LARGEST_BASE` gets this number at both ends, because all of its pixels have
            the texel of the border.

        Raises
        ------
        ValueError
            If a colour, a weight, a length or a level is out of range, or texture coordinates do not fit. If
            the ratio of a span's weights is over `WORD_DEPTH_RATIO`.
        """
        length = checked_lengths(length)
        steps = np.maximum(length - 1, 1)
        single = (length == 1)[:, np.newaxis]
        left = np.asarray(left, dtype=np.float64)
        right = np.where(single, left, right)
        if left.shape != right.shape or left.shape != (len(length), model.attributes):
            raise ValueError(f"a span needs {model.attributes} attributes at both ends")
        if not (np.isfinite(left) & np.isfinite(right)).all():
            raise ValueError("attributes must be finite")
        ends = np.stack([left, right])
        if model.colors:
            colors = ends[:, :, :3]
            if not ((colors > -1e-6) & (colors < 1 + 1e-6)).all():
                raise ValueError("colours must be 0 to 1")
            ends[:, :, :3] = np.clip(colors, 0, 1)
        base = range_ = None
        if model.coordinates:
            base, range_ = cls._placed(ends[:, :, -2:], periodic)
            level = np.zeros(len(length), dtype=np.int64) if level is None else np.asarray(level, np.int64)
            Fixed(model.LEVEL_FORMAT, level)
        else:
            level = None
        limit = 1 - MARGIN * model.WORD_FORMAT.step
        lines = np.clip(ends, -limit, limit)
        if model.perspective:
            if weights is None:
                raise ValueError("perspective needs 1/W at both ends")
            weight = np.stack([weights[0], np.where(length == 1, weights[0], weights[1])])
            if not (np.isfinite(weight) & (weight > 0)).all():
                raise ValueError("1/W must be finite and over 0")
            if (weight.max(axis=0) > WORD_DEPTH_RATIO * weight.min(axis=0)).any():
                raise ValueError(f"depths of a span must be within a ratio of {WORD_DEPTH_RATIO:.0f}: cut it")
            weight = (weight * (limit / weight.max(axis=0)))[:, :, np.newaxis]
            lines = np.concatenate([ends * weight, weight], axis=2)
        start, step, exponent = cls._coded(model, lines, steps)
        found = cls(start[:, : model.attributes], step[:, : model.attributes], exponent)
        if model.perspective:
            found = found._replace(weight_start=start[:, -1], weight_step=step[:, -1])
        return found._replace(base=base, range=range_, level=level)

    @staticmethod
    def _placed(ends: np.ndarray, periodic: np.ndarray | bool) -> tuple[np.ndarray, np.ndarray]:
        """Base and range. In ``ends``, shape (2, spans, 2), attributes replace the texture coordinates."""
        model = AttributeSpans
        limit, half = model.LARGEST_BASE, model.PERIOD // 2
        for outside, border in ((ends > limit, limit), (ends < -limit, -limit)):
            ends[:, outside.all(axis=0) & ~np.asarray(periodic)] = border
        base, found = whole_texels(*ends)
        if found.size and found.max() > model.LARGEST_RANGE:
            raise ValueError(f"a span may cross at most {2 << model.LARGEST_RANGE} texels: cut it")
        ends -= base
        ends *= np.ldexp(1.0, -found)[:, np.newaxis]
        base = np.where(periodic, (base + half) % model.PERIOD - half, base)
        if base.size and np.abs(base).max() > limit:
            raise ValueError(f"the middle of a span may be {limit} texels from the border of u or v: cut it")
        return base, found

    @staticmethod
    def _coded(
        model: "AttributeSpans", lines: np.ndarray, steps: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Codes of starts, codes of steps, and exponents. ``lines`` has the shape (2, spans, lines)."""
        word = model.WORD_FORMAT
        step = (lines[1] - lines[0]) / steps[:, np.newaxis]
        largest = np.maximum(np.abs(step).max(axis=1), 2.0**-60)
        fits = np.floor(-np.log2(largest * (1 + word.step))).astype(np.int64)
        exponent = np.clip(fits, 0, np.ceil(np.log2(steps)).astype(np.int64) + 3)
        scaled = np.ldexp(step, exponent[:, np.newaxis] + word.fraction_bits)
        codes = word.wrap(np.floor(scaled + 0.5).astype(np.int64))
        return Fixed.round(word, lines[0]).codes, codes, exponent


class AttributeWords(NamedTuple):
    """Words of every pixel.

    Parameters
    ----------
    numerators : Fixed, shape (pixels, attributes)
        U, or A without perspective.
    weight : Fixed, shape (pixels,), or None
        1/W; ``None`` without perspective.
    base, range, level : int64 arrays, or None
        Of the pixel's span, see `SpanAttributes`.
    """

    numerators: Fixed
    weight: Fixed | None
    base: np.ndarray | None
    range: np.ndarray | None
    level: np.ndarray | None


@dataclass(frozen=True)
class AttributeSpans:
    """Words of every pixel from `SpanAttributes`, by an addition for each line.

    A = U/w with ``U = A/W`` and ``w = 1/W``, both linear on the screen. Both have the same scale. So w is
    under 1, and ``|U| <= w`` for attributes from -1 to 1.

    =========== =========== ====================================================================
    word        format      why
    =========== =========== ====================================================================
    start, step SQ(1, 23)   24 bits serve texture coordinates, and colours at any ratio of depths
    accumulator SQ(1, 38)   exact: a step is shifted right by its exponent, 0 to 15
    U, w        SQ(1, 23)   rounded half up; half a step is in the first value
    =========== =========== ====================================================================

    *Error.* Let u be 2^-23. At pixel i a word is off by at most ``(1 + i 2^-e/2) u``, as `errors` has it: u/2
    for the start, ``i 2^-e u/2`` for the step, u/2 for the word. Let D be the largest difference of a line's
    ends. Either e has its limit and ``(m - 1) 2^-e`` is at most 1/8. Or the steps would
    not fit with e + 1, and ``(m - 1) 2^-e`` is at most ``2 D (1 + u)``, under 4. So a word is off by under 3
    u.

    *No word wraps.* A line has its extremes at its ends. Both are within ``1 - 4 u`` of 0, and words within
    3 u of the line. So words stay within ``1 - u``. A step of 1 or more comes only in a span of two pixels,
    where e is 0. Its code wraps, and its second word is the sum of two numbers modulo 2, which is right.

    *w is over 0.* The smaller end of w is at least ``(1 - 4 u)/WORD_DEPTH_RATIO``, 255 u.

    Parameters
    ----------
    colors : bool
        Whether there are vertex colours: attributes red, green, blue.
    coordinates : bool
        Whether there are texture coordinates: attributes u and v, with base, range and level.
    perspective : bool
        Whether the attributes are divided by W.

    Raises
    ------
    ValueError
        If there is no attribute.

    Source: docs/theory/textures.md#attributes.
    """

    colors: bool = True
    coordinates: bool = False
    perspective: bool = True

    WORD_FORMAT = SQ(1, 23)
    SUM_FORMAT = SQ(1, 38)
    EXPONENT_FORMAT = UQ(4, 0)
    BASE_FORMAT = SQ(13, 0)
    RANGE_FORMAT = UQ(4, 0)
    LEVEL_FORMAT = UQ(4, 0)
    LARGEST_RANGE = 11
    PERIOD = 2 * LARGEST_TEXTURE
    """Texels by which the base of a texture that repeats may change, also where tiles are mirrored."""

    LARGEST_BASE = 1984
    """Largest base. With A up to 33/32 a texture coordinate then stays in its word, 4096 texels."""

    def __post_init__(self) -> None:
        if not (self.colors or self.coordinates):
            raise ValueError("spans of attributes need colours or texture coordinates")

    @property
    def attributes(self) -> int:
        """Number of attributes: 3 for colours, 2 for texture coordinates."""
        return 3 * self.colors + 2 * self.coordinates

    def compute(self, spans: SpanAttributes, length: np.ndarray) -> AttributeWords:
        """Bit-accurate words of every pixel, in closed form, in the order of the spans.

        Parameters
        ----------
        spans : SpanAttributes
            The spans.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.

        Raises
        ------
        ValueError
            If a code or a length is out of range, or the number of attributes is wrong.
        """
        start, step = (Fixed(self.WORD_FORMAT, codes).codes for codes in (spans.start, spans.step))
        exponent = Fixed(self.EXPONENT_FORMAT, spans.exponent).codes
        if start.shape != (len(exponent), self.attributes) or step.shape != start.shape:
            raise ValueError(f"spans must have {self.attributes} attributes")
        if self.perspective:
            if spans.weight_start is None or spans.weight_step is None:
                raise ValueError("spans must have 1/W")
            start = np.column_stack([start, Fixed(self.WORD_FORMAT, spans.weight_start).codes])
            step = np.column_stack([step, Fixed(self.WORD_FORMAT, spans.weight_step).codes])
        span, index = pixels_of(checked_lengths(length))
        free = self.SUM_FORMAT.fraction_bits - self.WORD_FORMAT.fraction_bits
        step = step << (free - exponent)[:, np.newaxis]
        total = (start << free)[span] + (1 << (free - 1)) + index[:, np.newaxis] * step[span]
        words = Fixed(self.SUM_FORMAT, self.SUM_FORMAT.wrap(total)).truncate(self.WORD_FORMAT.fraction_bits)
        weight = words[:, -1] if self.perspective else None
        places: list[np.ndarray | None] = [None, None, None]
        if self.coordinates:
            if spans.base is None or spans.range is None or spans.level is None:
                raise ValueError("spans of texture coordinates must have base, range and level")
            places = [np.asarray(codes)[span] for codes in (spans.base, spans.range, spans.level)]
        return AttributeWords(words[:, : self.attributes], weight, *places)

    def errors(self, spans: SpanAttributes, length: np.ndarray) -> np.ndarray:
        """Error bound of every pixel's words: ``(1 + i 2^-e/2) 2^-23``, shape (pixels,)."""
        span, index = pixels_of(checked_lengths(length))
        found: np.ndarray = (1 + np.ldexp(index / 2, -spans.exponent[span])) * self.WORD_FORMAT.step
        return found
