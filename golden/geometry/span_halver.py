"""The span halver, which cuts spans where N/W grows too short for a method that takes vectors."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.albedo.attribute_spans import SpanAttributes
from blysk.golden.geometry.span_attributes import (
    DEPTH_STEP,
    SPAN_NORMAL,
    SPAN_STEP,
    Pieces,
    WholeSpans,
)
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.geometry.triangles import ATTRIBUTES
from blysk.golden.number.fixed import Fixed

__all__ = ["SpanHalver"]


@dataclass(frozen=True)
class SpanHalver:
    """Pieces of spans along which N/W stays long. Spans are halved as long as a simple test asks for it.

    The components of N/W at both ends of a span are shifted left by the number of places that no component
    needs, at most `LARGEST_SHIFT`. The test reads the first `BITS` bits ``m`` of each magnitude, which is at
    least ``m 2^-BITS``. A span *fits* if at both ends

    - a component that keeps its sign has a magnitude of `AXIS` or more;
    - or the magnitudes of two components that keep their signs have the sum `PAIR` or more;
    - or no component has 1/2: both ends are under 2^-8, too short for any words.

    A span of one pixel fits. A span of two pixels fits only if no component of 1/2 or more at an end changes
    its sign. Else its step might outgrow its word.

    Along a span the component, or the sum of the two components with their signs, is linear. At both ends it
    is on the same side of 0. So ``|N/W|`` is at least ``AXIS``, or ``PAIR/sqrt(2)``, at every pixel:
    `SHORTEST`, 5/16, where the largest component of both ends is 1/2 to 1.

    A span that does not fit is tried again as a shorter piece. With an even number of pixels the piece is one
    pixel shorter. Else it ends at the pixel in the middle, whose N/W is the mean of both ends. The remaining
    pixels are tried together.

    Parameters
    ----------
    rotates : bool
        Whether vectors will be turned into other frames, see `VectorAdapter`. The step of a span of two
        pixels then has to be shorter than 1. So the span fits only if no component of its ends differs by
        9/16 or more: the first `BITS` bits of the components, with their signs, are at most `STEEP` apart.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    rotates: bool = False

    BITS = 4
    LARGEST_SHIFT = 7
    AXIS = 5 / 16
    PAIR = 1 / 2
    SHORTEST = 5 / 16
    STEEP = 1 / 2

    def compute(self, spans: WholeSpans) -> tuple[Pieces, int]:
        """Bit-accurate pieces with steps, and the number of spans that were cut.

        Parameters
        ----------
        spans : WholeSpans
            From `SpanAttributes`.

        Raises
        ------
        ValueError
            If an attribute has another format.
        """
        if {spans.near.format, spans.far.format, spans.inward.format} != {SPAN_STEP}:
            raise ValueError(f"attributes must be {SPAN_STEP}")
        span = np.arange(len(spans))
        first, left = np.zeros(len(spans), dtype=np.int64), spans.length.astype(np.int64)
        near, far, tried = spans.near.codes, spans.far.codes, left
        found: list[list[np.ndarray]] = []
        while len(span) or not found:
            fits = self.fits(*self.ends(near, far), tried)
            found.append([word[fits] for word in (span, first, tried, near, far)])
            step = spans.inward.codes[span]
            even = (tried % 2 == 0)[:, np.newaxis]
            shorter = np.where(even, far - step, (near + far) >> 1)
            rest = left - tried
            goes_on = ~fits | (rest > 0)
            # After a piece that fits, all remaining pixels are tried together.
            first = np.where(fits, first + tried, first)
            near = np.where(fits[:, np.newaxis], far + step, near)
            far = np.where(fits[:, np.newaxis], spans.far.codes[span], shorter)
            left = np.where(fits, rest, left)
            tried = np.where(fits, rest, np.where(tried % 2 == 0, tried - 1, (tried + 1) // 2))
            near, far = SPAN_STEP.wrap(near), SPAN_STEP.wrap(far)
            span, first, left, tried, near, far = (
                word[goes_on] for word in (span, first, left, tried, near, far)
            )
        fields = zip(*found, strict=True)
        span, first, pixels, near, far = map(np.concatenate, fields)
        order = np.lexsort((first, span))
        span, first, pixels, near, far = (word[order] for word in (span, first, pixels, near, far))
        right = spans.right[span]
        turned = right[:, np.newaxis]
        step = spans.inward.codes[span]
        pieces = Pieces(
            x=spans.x[span] + np.where(right, spans.length[span] - first - pixels, first),
            y=spans.y[span],
            length=pixels,
            **Pieces.ends(np.where(turned, far, near), np.where(turned, near, far)),
            depth_step=Fixed(DEPTH_STEP, SPAN_STEP.wrap(np.where(right, -step[:, 3], step[:, 3]))),
            flip=spans.flip[span],
            material=spans.material[span],
            triangle=spans.triangle[span],
            step=Fixed(SPAN_STEP, step[:, :3]),
            turned=right,
            surface=self._surface(np.where(turned, far, near), np.where(turned, -step, step)),
        )
        return pieces, int((np.bincount(span, minlength=1) > 1).sum())

    @staticmethod
    def _surface(start: np.ndarray, step: np.ndarray) -> SpanAttributes | None:
        """Words of the attributes behind the depth, from codes at the first pixel and of the step."""
        if start.shape[1] == ATTRIBUTES:
            return None
        return SurfaceWords().compute(start[:, ATTRIBUTES:], step[:, ATTRIBUTES:])

    @staticmethod
    def ends(near: np.ndarray, far: np.ndarray) -> tuple[Fixed, Fixed]:
        """N/W at both ends, `SPAN_NORMAL`, from codes of attributes."""
        words = Pieces.ends(near, far)
        return words["left"], words["right"]

    def shift(self, first: Fixed, last: Fixed) -> np.ndarray:
        """Places that no component of both ends needs, `LARGEST_SHIFT` at most: int64 array, shape (S,).

        Parameters
        ----------
        first, last : Fixed, shape (S, 3), SQ(1, 26)
            N/W at both ends.
        """
        codes = np.concatenate((first.codes, last.codes), axis=-1)
        used = np.bitwise_or.reduce(np.where(codes < 0, ~codes, codes), axis=-1)
        bits = np.frexp(used.astype(np.float64))[1].astype(np.int64)
        found: np.ndarray = np.minimum(SPAN_NORMAL.fraction_bits - bits, self.LARGEST_SHIFT)
        return found

    def fits(self, first: Fixed, last: Fixed, pixels: np.ndarray) -> np.ndarray:
        """Whether spans need no cut: bool array, shape (S,).

        Parameters
        ----------
        first, last : Fixed, shape (S, 3), SQ(1, 26)
            N/W at both ends.
        pixels : int64 array, shape (S,)
            Their pixels, 1 or more.
        """
        shift = self.shift(first, last)[:, np.newaxis]
        cut = SPAN_NORMAL.fraction_bits - self.BITS
        size = np.stack(
            [np.where(end.codes < 0, ~end.codes, end.codes) << shift >> cut for end in (first, last)]
        )
        same = (first.codes < 0) == (last.codes < 0)
        axis, pair, half = (int(bound * 2**self.BITS) for bound in (self.AXIS, self.PAIR, 0.5))
        long = (same & (size >= axis).all(axis=0)).any(axis=1)
        for j, k in ((0, 1), (0, 2), (1, 2)):
            sums = size[..., j] + size[..., k]
            long |= same[:, j] & same[:, k] & (sums >= pair).all(axis=0)
        large = np.logical_or.reduce(size >= half, axis=0)
        steep = (~same & large).any(axis=1)
        if self.rotates:
            left, right = (end.codes << shift >> cut for end in (first, last))
            change: np.ndarray = np.abs(left - right)
            steep = (change > int(self.STEEP * 2**self.BITS)).any(axis=1)
        found: np.ndarray = (pixels == 1) | ((long | ~large.any(axis=1)) & ~(steep & (pixels == 2)))
        return found
