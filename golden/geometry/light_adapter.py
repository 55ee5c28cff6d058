"""The light adapter: vectors of spans in the frames of further lights."""

from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.geometry.vector_adapter import VectorSpans
from blysk.golden.number.fixed import Fixed

__all__ = ["LightAdapter"]


@dataclass(frozen=True)
class LightAdapter:
    """Components of `SpanVectors` in the frames of further lights, from x, y, z in the first light's frame.

    A component is the dot product of the vector and a row of three codes, an axis of the light's frame. The
    exact sum of three products of 18 bits is rounded half up to 17 fraction bits. Start and step have the
    same rows. In a span of one pixel the step has no meaning, and gets the components of the start.

    ========== ============ =====================================================================
    word       format       why
    ========== ============ =====================================================================
    x, y, z    SQ(1, 17)    of `VectorAdapter` with ``rotates``: the vector and its step are shorter than 1
    axis       SQ(1, 17)    rounded to the nearest code, 1 to ``1 - 2^-17``
    component  SQ(1, 17)    modulo 2; no axis makes it longer than the vector, so it does not wrap
    ========== ============ =====================================================================

    A code of an axis is off by 2^-18. The codes of 1 and -1 are off by 2^-17; then the axis's other codes are
    0. So a vector is turned, or stretched, by ``3 2^-18`` of its length at most. A component is rounded by
    half a step. The rounding of the step's components counts as the step's own rounding, see `VectorAdapter`.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    FORMAT = QuotientSpans.COMPONENT_FORMAT
    AXIS_ERROR = 3 * 2.0**-18
    """Largest change of a vector by the codes of a frame's axes, divided by the vector's length."""

    @classmethod
    def codes_of(cls, axes: np.ndarray) -> np.ndarray:
        """Codes of axes, int64 array of the shape of ``axes``.

        Parameters
        ----------
        axes : float64 array, shape (..., 3)
            Vectors of length 1 at most, in the frame of the first light.
        """
        codes = np.rint(np.ldexp(axes, cls.FORMAT.fraction_bits)).astype(np.int64)
        found: np.ndarray = np.clip(codes, -cls.FORMAT.max_code, cls.FORMAT.max_code)
        return found

    def compute(self, spans: VectorSpans, axes: np.ndarray) -> VectorSpans:
        """Bit-accurate spans: their three components, and a component for each row.

        Parameters
        ----------
        spans : VectorSpans
            From `VectorAdapter` with ``rotates``.
        axes : int64 array, shape (rows, 3)
            Codes of the axes, `FORMAT`.
        """
        rows = Fixed(self.FORMAT, np.asarray(axes, dtype=np.int64)).codes
        single = (np.asarray(spans.length) == 1)[:, np.newaxis]
        step = np.where(single, spans.start, spans.step)
        turned = (self._turned(vector, rows) for vector in (spans.start, step))
        start, step = (
            np.concatenate(pair, axis=1) for pair in zip((spans.start, spans.step), turned, strict=True)
        )
        return replace(spans, start=start, step=step)

    def _turned(self, vector: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Rounded products of vectors and rows, shape (S, rows)."""
        bits = self.FORMAT.fraction_bits
        return self.FORMAT.wrap((vector @ rows.T + (1 << (bits - 1))) >> bits)
