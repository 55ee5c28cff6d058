"""The span adapter: the part of geometry's spans that the shading pipeline reads."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.geometry.edge_normals import PlacedSpans, TrueSpans
from blysk.golden.geometry.span_attributes import SPAN_NORMAL, Pieces
from blysk.golden.geometry.vector_adapter import VectorSpans
from blysk.golden.normals.line_setup import LineSetup
from blysk.golden.number.fixed import SQ, Fixed

__all__ = ["LineAdapter", "LineSpans", "shading_spans"]


@dataclass(frozen=True)
class LineSpans(PlacedSpans):
    """Spans with the ends of their true lines in place of unit normals.

    Parameters
    ----------
    x, y, length, depth, depth_step, material, triangle
        As in `PlacedSpans`.
    depth_last : int64 array, shape (S,)
        Depth at the last pixel, UQ(24, 9).
    normal_left, normal_right : int64 arrays, shape (S, 3)
        Ends of the line at the first and at the last pixel's centre, SQ(1, 22).
    """

    depth_last: np.ndarray
    normal_left: np.ndarray
    normal_right: np.ndarray


@dataclass(frozen=True)
class LineAdapter:
    """Ends of a span's true line for `LineSetup`: N/W at both, shifted together and rounded.

    The six components are shifted left by the same number of places: the number of bits that repeat the sign
    in all of them, at most `LARGEST_SHIFT`. If ``flip`` is set, they are negated. They are rounded half up to
    22 fraction bits, and saturate to ``+-(1 - 2^-22)``. A factor that all six share does not change a
    direction. So the line has the same unit normals as N/W:

    ========== ============ =====================================================================
    word       format       why
    ========== ============ =====================================================================
    N/W        SQ(1, 26)    of `SpanAttributes`
    ends       SQ(1, 22)    of `LineSetup`; the largest component is 1/2 or more if the shift is not limited
    ========== ============ =====================================================================

    Rounding moves a component of an end by at most `ERROR`, 2^-23. Saturation moves components within 2^-23
    of -1 or 1 by at most 2^-22. The error of N/W is added.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    LARGEST_SHIFT = 7
    FORMAT = LineSetup.VECTOR_FORMAT
    ERROR = 2.0**-23

    def compute(self, pieces: Pieces) -> LineSpans:
        """Bit-accurate spans.

        Parameters
        ----------
        pieces : Pieces
            From `SpanAttributes`.
        """
        left, right = self.ends(pieces.left, pieces.right, pieces.flip)
        depth_last = pieces.depth_last.codes
        return LineSpans.of(pieces, depth_last=depth_last, normal_left=left, normal_right=right)

    def ends(self, left: Fixed, right: Fixed, flip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bit-accurate codes of both ends, SQ(1, 22).

        Parameters
        ----------
        left, right : Fixed, shape (S, 3), SQ(1, 26)
            N/W at the first and at the last pixel.
        flip : bool array, shape (S,)
            Whether the normals are negated.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        if {left.format, right.format} != {SPAN_NORMAL}:
            raise ValueError(f"operands must be {SPAN_NORMAL}")
        codes = np.concatenate((left.codes, right.codes), axis=-1)
        used = np.bitwise_or.reduce(np.where(codes < 0, ~codes, codes), axis=-1)
        free = SPAN_NORMAL.fraction_bits - np.frexp(used.astype(np.float64))[1].astype(np.int64)
        shift = np.minimum(free, self.LARGEST_SHIFT)[:, np.newaxis]
        turned = np.where(np.asarray(flip, dtype=bool)[:, np.newaxis], -codes, codes) << shift
        rounded = Fixed(SQ(2, SPAN_NORMAL.fraction_bits), turned).round_half_up(self.FORMAT.fraction_bits)
        ends = np.clip(rounded.codes, -self.FORMAT.max_code, self.FORMAT.max_code)
        return ends[:, :3], ends[:, 3:]


def shading_spans(spans: TrueSpans | LineSpans | VectorSpans) -> Spans:
    """Spans of the shading pipeline: first pixel, length and material, with normals, true line or vectors.

    Parameters
    ----------
    spans : TrueSpans, LineSpans or VectorSpans
        From `EdgeNormals` (with unit normals at both ends), from `LineAdapter`, or from `VectorAdapter` (all
        normals are then 0).
    """
    if isinstance(spans, VectorSpans):
        none = np.zeros_like(spans.start[:, :3])
        placed = spans.x, spans.y, spans.length, none, none, spans.material
        return Spans(*placed, vectors=spans.vectors, attributes=spans.attributes)
    return Spans(
        x=spans.x,
        y=spans.y,
        length=spans.length,
        normal_left=spans.normal_left,
        normal_right=spans.normal_right,
        material=spans.material,
    )
