"""The mirror adapter: y cos a and y sin a of the vectors of spans, for highlights of R·V."""

from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.geometry.vector_adapter import VectorSpans
from blysk.golden.number.fixed import Fixed

__all__ = ["MirrorAdapter"]


@dataclass(frozen=True)
class MirrorAdapter:
    """Components x, ``y cos a``, z and ``y sin a`` of `SpanVectors`, from x, y and z.

    Components of further lights stay as they are, before ``y sin a``.

    The pipeline has the codes of sin a and cos a as direction to the light. Start and step are multiplied by
    these codes, in products of 18 bits. The products are rounded half up to 17 fraction bits. In a span of
    one pixel the step has no meaning, and gets the products of the start.

    The codes are off by 2^-18, and both have the scale `QuotientSpans.ONE`. So y and a are off by less than
    2^-16 of themselves, and gamma by less than 2^-15. A product is rounded by half a step, besides the error
    of y.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    FORMAT = QuotientSpans.COMPONENT_FORMAT

    def compute(self, spans: VectorSpans, sine: int, cosine: int) -> VectorSpans:
        """Bit-accurate spans.

        Parameters
        ----------
        spans : VectorSpans
            From `VectorAdapter` or `LightAdapter`.
        sine, cosine : int
            Codes of sin a and cos a, `FORMAT`.
        """
        factors = Fixed(self.FORMAT, np.array([cosine, sine], dtype=np.int64)).codes
        start = self._components(spans.start, spans.start[:, 1:2] * factors)
        single = (np.asarray(spans.length) == 1)[:, np.newaxis]
        y = np.where(single, spans.start[:, 1:2], spans.step[:, 1:2])
        return replace(spans, start=start, step=self._components(spans.step, y * factors))

    def _components(self, vector: np.ndarray, products: np.ndarray) -> np.ndarray:
        """x, rounded ``y cos a``, z, the components of further lights, rounded ``y sin a``."""
        bits = self.FORMAT.fraction_bits
        along, across = ((products + (1 << (bits - 1))) >> bits).T
        return np.column_stack([vector[:, 0], along, vector[:, 2:], across])
