"""The vector adapter: N/W at the first pixel of a span and its step, for methods that take vectors."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from blysk.golden.albedo.attribute_spans import SpanAttributes
from blysk.golden.cosines.quotient_spans import QuotientSpans, SpanVectors
from blysk.golden.geometry.edge_normals import PlacedSpans
from blysk.golden.geometry.span_attributes import SPAN_NORMAL, SPAN_STEP, Pieces
from blysk.golden.geometry.span_halver import SpanHalver

__all__ = ["VectorAdapter", "VectorSpans"]


@dataclass(frozen=True)
class VectorSpans(PlacedSpans):
    """Spans with vectors ``N/W`` at their first pixels, and steps, in place of unit normals.

    Parameters
    ----------
    x, y, length, depth, depth_step, material, triangle
        As in `PlacedSpans`.
    start, step : int64 arrays, shape (S, 3)
        As in `SpanVectors`. The step of a span of one pixel has no meaning.
    exponent : int64 array, shape (S,)
        As in `SpanVectors`.
    attributes : SpanAttributes, optional
        Vertex colours and texture coordinates, for a design with an albedo.
    """

    start: np.ndarray
    step: np.ndarray
    exponent: np.ndarray
    attributes: SpanAttributes | None = None

    @property
    def beats(self) -> dict[str, Any]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        beats: dict[str, Any] = super().beats
        del beats["attributes"]
        return beats if self.attributes is None else beats | {"attributes": self.attributes.beats}

    @property
    def vectors(self) -> SpanVectors:
        """Vectors of the spans."""
        return SpanVectors(self.start, self.step, self.exponent)


@dataclass(frozen=True)
class VectorAdapter:
    """Makes words of `SpanVectors` from N/W at both ends of a span and from its step, by shifts and rounding.

    The components of both ends and of the step are shifted left by the same number of places, s. This is
    `SpanHalver.shift`, the number of bits that repeat the sign in all components of the ends. Then each word
    loses the 2^-14th part of its value, cut: x becomes ``x - 2^-14 x``. This leaves a margin of 8 steps of
    2^-17 to 1. No pixel may reach 1, and nothing saturates. The step is shifted left by e more places. e is
    the largest number up to 15 that leaves the step under 1. If ``flip`` is set, the start is negated. If
    exactly one of ``flip`` and ``turned`` is set, the step is negated. Both are rounded half up to 17
    fraction bits.

    ========== ============ =====================================================================
    word       format       why
    ========== ============ =====================================================================
    N/W        SQ(1, 26)    of `SpanAttributes`
    its step   SQ(2, 32)    of `SpanAttributes`; under 1 after the shift, see below
    start      SQ(1, 17)    of `QuotientSpans`; the largest component of both ends is ``1/2 - 2^-15`` or
                            more if the shift is not limited
    step       SQ(1, 17)    in steps of ``2^-e``
    exponent   UQ(4, 0)     e
    ========== ============ =====================================================================

    `SpanHalver` cuts spans. A step of a piece of three pixels or more is at most half of the difference of
    its ends, and fits. In a piece of two pixels no component of 1/2 or more changes its sign, so its step
    fits, too. Along a piece ``|N/W|`` is at least 5/16 in the scale of the words, if an end reaches
    `SHORTEST`. The method needs at least 0.2236, so no other cuts are needed.

    Rounding moves a component of the start by half a step of its word. If the longer end is at least
    `SHORTEST`, this is at most `ERROR` times its length. At the right end rounding of the step adds `ERROR`
    times the distance of the ends, or a sixteenth of a step. The dropped bits of the step add up to an
    eighth. The errors of N/W and of the triangle's gradient are added. All together are under 4 steps.

    Parameters
    ----------
    rotates : bool
        Whether vectors will be turned into other frames. Then the lengths of the vectors and of their steps
        have to be under 1, not only their components. A shift s over 0 is one less than for vectors that
        are not turned. An e over 0 is one less, too. N/W may be at most 1 long, as `scene_triangles` makes
        it, and `SpanHalver` with ``rotates`` cuts spans. A start keeps its rounding if the shift is 0. Else
        its rounding is twice as large, relative to its length. The rounding of the step is an eighth of a
        step, or `ERROR` times twice the distance of the ends. The errors of both add up, so the margin is
        2^-12, 32 steps of 2^-17.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    rotates: bool = False

    MARGIN_SHIFT = 14
    ROTATED_MARGIN_SHIFT = 12
    ERROR = 2.0**-17
    SHORTEST = 2.0**-8
    FORMAT = QuotientSpans.COMPONENT_FORMAT
    LARGEST_EXPONENT = QuotientSpans.EXPONENT_FORMAT.max_code
    STEP_BITS = SPAN_STEP.fraction_bits
    """Bits of a shifted step below 1."""

    def compute(self, pieces: Pieces) -> VectorSpans:
        """Bit-accurate spans.

        Parameters
        ----------
        pieces : Pieces
            From `SpanHalver`.

        Raises
        ------
        ValueError
            If the pieces have no steps, or an operand has another format.
        """
        step = pieces.step
        if step is None or {pieces.left.format, pieces.right.format, step.format} != {SPAN_NORMAL, SPAN_STEP}:
            raise ValueError(f"pieces must have ends of {SPAN_NORMAL} and steps of {SPAN_STEP}")
        flip, turned = (np.asarray(flag, dtype=bool)[:, np.newaxis] for flag in (pieces.flip, pieces.turned))
        shift = self.shift(pieces)[:, np.newaxis]
        start = self._rounded(self._smaller(pieces.left.codes << shift), flip, SPAN_NORMAL.fraction_bits)
        # Steps are taken modulo 2. Only pieces of one pixel have larger steps.
        whole = 1 << self.STEP_BITS
        shifted = (((step.codes << shift) + whole) & (2 * whole - 1)) - whole
        exponent = np.minimum(self.STEP_BITS - _used(shifted), self.LARGEST_EXPONENT)
        if self.rotates:
            exponent = np.maximum(exponent - 1, 0)
        word = self._rounded(
            self._smaller(shifted) << exponent[:, np.newaxis], flip != turned, self.STEP_BITS
        )
        return VectorSpans.of(pieces, start=start, step=word, exponent=exponent, attributes=pieces.surface)

    @property
    def margin_shift(self) -> int:
        """A word x becomes ``x - 2^-margin_shift x``."""
        return self.ROTATED_MARGIN_SHIFT if self.rotates else self.MARGIN_SHIFT

    def shift(self, pieces: Pieces) -> np.ndarray:
        """Places by which N/W of pieces is shifted: int64 array, shape (S,)."""
        shift = SpanHalver().shift(pieces.left, pieces.right)
        return np.maximum(shift - 1, 0) if self.rotates else shift

    def _rounded(self, codes: np.ndarray, flip: np.ndarray, point: int) -> np.ndarray:
        """Codes with ``point`` fraction bits, negated where ``flip`` is set, in `FORMAT`."""
        cut = point - self.FORMAT.fraction_bits
        return (np.where(flip, -codes, codes) + (1 << (cut - 1))) >> cut

    def _smaller(self, codes: np.ndarray) -> np.ndarray:
        """Codes with a margin to 1."""
        found: np.ndarray = codes - (codes >> self.margin_shift)
        return found


def _used(codes: np.ndarray) -> np.ndarray:
    """Bits that the components of each vector need together, without bits that repeat the sign."""
    used = np.bitwise_or.reduce(np.where(codes < 0, ~codes, codes), axis=-1)
    found: np.ndarray = np.frexp(used.astype(np.float64))[1].astype(np.int64)
    return found
