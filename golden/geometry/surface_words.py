"""Words of the attributes of a surface along spans: vertex colours, texture coordinates and 1/W."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans, SpanAttributes
from blysk.golden.geometry.gradient_setup import GradientSetup

__all__ = ["SurfaceWords"]


@dataclass(frozen=True)
class SurfaceWords:
    """Makes words of `AttributeSpans` from the planes of a triangle, by shifts and cuts.

    The attributes of a surface are further planes of a triangle, besides N/W and the depth. A corner has ``U
    = A s`` of each colour and texture coordinate A, and then s. s is 1/W over the largest 1/W of the
    triangle, times `LARGEST`. Orthographic triangles have ``s = LARGEST``. A texture coordinate A is ``(texel
    - base)/2^range``, from -1 to 1. Software chooses base, range and level of each triangle.

    ========== ============ =====================================================================
    word       format       why
    ========== ============ =====================================================================
    corner     SQ(1, 23)    rounded, `LARGEST` at most
    plane      SQ(2, 32)    of `GradientSetup`
    start      SQ(1, 23)    cut
    step       SQ(1, 23)    in steps of ``2^-e``; cut
    exponent   UQ(4, 0)     e, 0 to 9: the largest with which all steps fit
    ========== ============ =====================================================================

    A step has 32 fraction bits. So with ``e = 9`` a step is exact. Steps are taken modulo 2, as in
    `AttributeSpans`.

    The error of a plane is under ``1.1 2^-11`` in every triangle of the grid (`GradientSetup.error`). So no
    word of a covered pixel reaches 1. The dropped bits of the start and the last rounding add 3/2 steps of
    2^-23. The dropped bits of a step add ``i 2^-e`` steps at pixel i. If one more place did not fit, a step
    is over ``2^-(e + 1)``, and ``i 2^-e`` is under 4. So a word is off by `ERROR` at most, besides the error
    of the planes.

    Source: docs/theory/geometry.md#surface; not in the documents.
    """

    FORMAT = AttributeSpans.WORD_FORMAT
    PLANE_FORMAT = GradientSetup.FORMAT
    LARGEST = 1 - 2.0**-10
    """Largest 1/W of a triangle."""
    LARGEST_EXPONENT = PLANE_FORMAT.fraction_bits - FORMAT.fraction_bits
    ERROR = 5.5 * FORMAT.step
    """Bound of the error of a pixel's word, without the error of the planes."""

    def compute(self, start: np.ndarray, step: np.ndarray) -> SpanAttributes:
        """Bit-accurate words, without base, range and level.

        Parameters
        ----------
        start, step : int64 arrays, shape (S, attributes + 1)
            Codes of `PLANE_FORMAT`, modulo 4: planes at the first pixel, and steps to the right. The last is
            1/W.
        """
        cut, bits = self.LARGEST_EXPONENT, self.PLANE_FORMAT.fraction_bits
        whole = 1 << bits
        turned = ((step + whole) & (2 * whole - 1)) - whole
        used = np.bitwise_or.reduce(np.where(turned < 0, ~turned, turned), axis=1)
        free = bits - np.frexp(used.astype(np.float64))[1].astype(np.int64)
        exponent = np.minimum(free, self.LARGEST_EXPONENT)
        words = (turned << exponent[:, np.newaxis]) >> cut
        first = self.FORMAT.wrap(start >> cut)
        return SpanAttributes(first[:, :-1], words[:, :-1], exponent, first[:, -1], words[:, -1])
