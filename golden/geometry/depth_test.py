"""Depth test: the depth of every pixel of spans, and which of them are in front of what came before."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.span_attributes import SPAN_DEPTH
from blysk.golden.geometry.triangles import DEPTH
from blysk.golden.number.spans import pixels_of

__all__ = ["DepthTest"]


@dataclass(frozen=True)
class DepthTest:
    """``floor(z + k step)`` at pixel k of a span; a pixel is drawn where that is less than what is there.

    The sum is exact; it saturates to 0 and `FARTHEST`, one less than what a picture is cleared to, so that no
    pixel is lost where nothing was drawn. Of equal depths the first stays.

    Along a span the rounding of the step, 2^-10 of a depth's step, adds up; with it a pixel's depth is off by
    at most ``2^23`` times `GradientSetup.error` and 1 for the cut.

    Source: docs/theory/geometry.md#depth; not in the documents.
    """

    CLEARED = DEPTH.max_code
    FARTHEST = DEPTH.max_code - 1

    def depths(self, length: np.ndarray, depth: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Bit-accurate depths of the pixels of spans, 0 to `FARTHEST`.

        Parameters
        ----------
        length : int64 array, shape (S,)
            Pixels of each span, 1 or more.
        depth : int64 array, shape (S,)
            At the first pixel, UQ(24, 9).
        step : int64 array, shape (S,)
            From a pixel to the next, SQ(25, 9).
        """
        span, k = pixels_of(length)
        code = (depth[span] + k * step[span]) >> SPAN_DEPTH.fraction_bits
        return np.clip(code, 0, self.FARTHEST)

    def drawn(self, pixel: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Which of the pixels, in the order in which they come, are less deep than all before them there.

        Parameters
        ----------
        pixel : int64 array, shape (P,)
            Places in the picture, below 2^38.
        depth : int64 array, shape (P,)
            From `depths`.
        """
        order = np.argsort(pixel, kind="stable")
        place, code = pixel[order], depth[order]
        # Places get lower and lower numbers, so that the least so far starts anew at each.
        group = np.cumsum(np.r_[False, place[1:] != place[:-1]]) if len(place) else place
        value = code - (group << (DEPTH.width + 1))
        least = np.minimum.accumulate(np.r_[np.int64(1) << 62, value])[:-1]
        cleared = self.CLEARED - (group << (DEPTH.width + 1))
        result = np.empty(len(pixel), dtype=bool)
        result[order] = value < np.minimum(least, cleared)
        return result
