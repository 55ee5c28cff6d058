"""Spans of the quotient method with several lanes: pairs of pixels, and the words of each beat."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.cosines.quotient_spans import PixelWords, QuotientSpans, SpanVectors
from blysk.golden.number.fixed import Fixed

__all__ = ["QuotientLanes", "pixels_of_beats", "separate_pairs"]


def separate_pairs(vectors: SpanVectors, length: np.ndarray) -> tuple[SpanVectors, np.ndarray, np.ndarray]:
    """Spans in which two spans of one pixel stand for each pair.

    Parameters
    ----------
    vectors : SpanVectors
        Vectors of spans. In a span of two pixels the step is the vector at the second pixel.
    length : int array, shape (spans,)
        Pixels.

    Returns
    -------
    vectors, length
        Vectors and lengths. All spans of one pixel have the step 0.
    span : int array
        Index of the given span, for each span of the result.
    """
    length = np.asarray(length, dtype=np.int64)
    pair = length == 2
    span = np.repeat(np.arange(len(length)), 1 + pair)
    second = np.r_[False, span[1:] == span[:-1]][: len(span)]
    single = (length[span] <= 2)[:, np.newaxis]
    start = np.where(second[:, np.newaxis], vectors.step[span], vectors.start[span])
    step = np.where(single, 0, vectors.step[span])
    exponent = np.where(single[:, 0], 0, vectors.exponent[span])
    apart = SpanVectors(start, step, exponent)
    if vectors.line is not None and vectors.line_step is not None:
        line = np.where(second[:, np.newaxis], vectors.line_step[span], vectors.line[span])
        apart = apart._replace(line=line, line_step=np.where(single, 0, vectors.line_step[span]))
    return apart, np.where(pair, 1, length)[span], span


@dataclass(frozen=True)
class QuotientLanes(QuotientSpans):
    """`QuotientSpans` with several lanes: words of neighbouring pixels of a span in a beat.

    The pixels have the same words as with one lane. With N lanes beat j has the pixels N j to N j + N - 1 of
    a span. A span of two pixels is a *pair*: its step is the vector at the second pixel, and its exponent has
    no effect. Both vectors of a pair may have scales of their own, so each pixel of a pair has the words of a
    span of one pixel.

    With highlights a span brings its lines, exact l of ``start`` and of ``step``. So the hardware has no
    multiplier for them. The line of a pixel is the same to the bit.

    Spans of hardware geometry have no pairs and no lines. They are the spans of `QuotientSpans`.

    Parameters
    ----------
    lights, highlights, mirror
        Those of `QuotientSpans`.
    lanes : int
        Number of lanes, 2 or 4.
    pairs : bool
        Whether spans of two pixels are pairs, and spans bring lines.

    Raises
    ------
    ValueError
        As `QuotientSpans` does, or if the number of lanes is not 2 or 4.

    Source: docs/theory/quotient.md#lanes.
    """

    lanes: int = 2
    pairs: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lanes not in (2, 4):
            raise ValueError(f"lanes must be 2 or 4, not {self.lanes}")

    @property
    def brings_lines(self) -> bool:
        """``True`` for pairs with highlights. Without highlights l is z, times a constant."""
        return self.highlights and self.pairs

    def with_lines(self, vectors: SpanVectors, direction: np.ndarray) -> SpanVectors:
        """Vectors with their lines; see `QuotientSpans.line` for the direction."""
        if not self.brings_lines:
            return vectors
        lines = (self.line(vector, direction) for vector in (vectors.start, vectors.step))
        return vectors._replace(**dict(zip(("line", "line_step"), lines, strict=True)))

    def compute(
        self, vectors: SpanVectors, length: np.ndarray, direction: np.ndarray | None = None
    ) -> PixelWords:
        """Bit-accurate words of every pixel, in the order of the spans; see `QuotientSpans.compute`.

        Raises
        ------
        ValueError
            As `QuotientSpans.compute` does.
        """
        if self.pairs:
            vectors, length, _ = separate_pairs(vectors, length)
        return super().compute(vectors, length, direction)

    def beats(self, pixels: PixelWords, length: np.ndarray) -> tuple[PixelWords, np.ndarray, np.ndarray]:
        """Words of each beat, from the words of the pixels.

        Parameters
        ----------
        pixels : PixelWords
            From `compute`.
        length : int array, shape (spans,)
            Pixels of each span.

        Returns
        -------
        words : PixelWords
            Arrays with the shape (beats, lanes, ...). A lane without a pixel has words of 0.
        present : bool array, shape (beats, lanes)
            Whether a lane has a pixel.
        span : int array, shape (beats,)
            Index of the span.
        """
        index, present, span = pixels_of_beats(length, self.lanes)

        def arranged(codes: np.ndarray) -> np.ndarray:
            mask = present.reshape(present.shape + (1,) * (codes.ndim - 1))
            return np.where(mask, codes[index], 0)

        numerator, rest, line = (Fixed(word.format, arranged(word.codes)) for word in pixels[:3])
        words = PixelWords(numerator, rest, line, arranged(pixels.away) != 0)
        return words, present, span


def pixels_of_beats(length: np.ndarray, lanes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels of each beat, for beats that begin at the first pixel of a span.

    Parameters
    ----------
    length : int array, shape (spans,)
        Pixels of each span, 0 or more.
    lanes : int
        Pixels of a beat.

    Returns
    -------
    index : int array, shape (beats, lanes)
        Number of each pixel, in the order of the spans. Lanes without a pixel have the number of the first
        lane.
    present : bool array, shape (beats, lanes)
        Whether a lane has a pixel.
    span : int array, shape (beats,)
        Index of the span.
    """
    length = np.asarray(length, dtype=np.int64)
    beats = -(-length // lanes)
    span = np.repeat(np.arange(len(length)), beats)
    within = np.arange(len(span)) - np.repeat(np.cumsum(beats) - beats, beats)
    first = np.repeat(np.cumsum(length) - length, beats) + lanes * within
    lane = np.arange(lanes)
    present = lanes * within[:, np.newaxis] + lane < length[span][:, np.newaxis]
    return first[:, np.newaxis] + np.where(present, lane, 0), present, span
