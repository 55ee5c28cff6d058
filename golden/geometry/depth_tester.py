"""Depth test: the depth of every pixel of spans, and whether it is in front of the pixels before it."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.span_attributes import SPAN_DEPTH
from blysk.golden.geometry.triangles import DEPTH
from blysk.golden.number.spans import pixels_of

__all__ = ["DepthTester"]


@dataclass(frozen=True)
class DepthTester:
    """Depth test. A pixel is drawn if its depth is less than the stored depth.

    The depth of pixel k of a span is ``floor(z + k step)``. The sum is exact. It saturates to 0 and to
    `FARTHEST`. A picture is cleared to the depth `CLEARED`, `FARTHEST` + 1. So the first pixel at a place is
    always drawn. If depths are equal, the first pixel stays.

    The step is rounded to nine fraction bits; this error, at most 2^-10, adds up along a span. With this
    error the depth of a pixel is off by at most ``2^23`` times `GradientSetup.error`, plus 1 for the dropped
    fraction.

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
            Depth at the first pixel, UQ(24, 9).
        step : int64 array, shape (S,)
            Step of the depth from a pixel to the next, SQ(25, 9).

        Returns
        -------
        int64 array, shape (P,)
            Depths of all pixels. The pixels of a span follow each other.
        """
        span, k = pixels_of(length)
        code = (depth[span] + k * step[span]) >> SPAN_DEPTH.fraction_bits
        found: np.ndarray = np.clip(code, 0, self.FARTHEST)
        return found

    def drawn(self, pixel: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Whether each pixel is drawn, because its depth is less than all earlier depths at its place.

        Parameters
        ----------
        pixel : int64 array, shape (P,)
            Index of each pixel's place in the picture, in the order of drawing; below 2^38.
        depth : int64 array, shape (P,)
            From `depths`.

        Returns
        -------
        bool array, shape (P,)
        """
        order = np.argsort(pixel, kind="stable")
        place, code = pixel[order], depth[order]
        # Each place has lower values than the place before it. So the running minimum starts anew at each
        # place.
        group = np.cumsum(np.r_[False, place[1:] != place[:-1]]) if len(place) else place
        value = code - (group << (DEPTH.width + 1))
        least = np.minimum.accumulate(np.r_[np.int64(1) << 62, value])[:-1]
        cleared = self.CLEARED - (group << (DEPTH.width + 1))
        result = np.empty(len(pixel), dtype=bool)
        result[order] = value < np.minimum(least, cleared)
        return result
