"""Span attributes: N/W and depth at both ends of every span, and of every piece of a wide span."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from blysk.golden.albedo.attribute_spans import SpanAttributes as SpanWords
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.plane_assembler import Planes
from blysk.golden.geometry.span_clip import ClippedRows
from blysk.golden.number.fixed import SQ, UQ, Fixed

__all__ = ["DEPTH_STEP", "SPAN_DEPTH", "SPAN_NORMAL", "SPAN_STEP", "Pieces", "SpanAttributes", "WholeSpans"]

SPAN_NORMAL = SQ(1, 26)
"""Number format of a component of N/W at a pixel."""

SPAN_STEP = GradientSetup.FORMAT
"""Number format of an N/W component's step, from a pixel to the next."""

SPAN_DEPTH = UQ(24, 9)
"""Number format of the depth at a pixel."""

DEPTH_STEP = SQ(25, 9)
"""Number format of the step of the depth from a pixel to the next."""


@dataclass(frozen=True)
class Pieces:
    """Spans, or pieces of them, before their normals have unit length.

    Parameters
    ----------
    x, y, length : int64 arrays, shape (S,)
        Column and scanline of the first pixel, and number of pixels, 1 or more.
    left, right : Fixed, shape (S, 3), SQ(1, 26)
        N/W at the first and at the last pixel's centre.
    depth, depth_last : Fixed, shape (S,), UQ(24, 9)
        Depth at the first and at the last pixel.
    depth_step : Fixed, shape (S,), SQ(25, 9)
        Step of the depth from a pixel to the next, without meaning in a span of one pixel.
    flip : bool array, shape (S,)
        Whether the normals have to be negated.
    material : int64 array, shape (S,)
        Index of the material.
    triangle : int64 array, shape (S,)
        Index of the triangle.
    step : Fixed, shape (S, 3), SQ(2, 32), optional
        Step of N/W to the next pixel away from the long edge; without meaning in a span of one pixel.
    turned : bool array, shape (S,), optional
        Whether the span goes to the left from the long edge.
    surface : SpanAttributes, optional
        Words of the surface's attributes, of `SurfaceWords`.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    left: Fixed
    right: Fixed
    depth: Fixed
    depth_last: Fixed
    depth_step: Fixed
    flip: np.ndarray
    material: np.ndarray
    triangle: np.ndarray
    step: Fixed | None = None
    turned: np.ndarray | None = None
    surface: SpanWords | None = None

    def __len__(self) -> int:
        return len(self.x)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        return _beats(self)

    @staticmethod
    def ends(left: np.ndarray, right: np.ndarray) -> dict[str, Any]:
        """Fields ``left``, ``right``, ``depth`` and ``depth_last`` of attributes at both ends.

        Parameters
        ----------
        left, right : int64 arrays, shape (S, 4 or more)
            Codes of the attributes, `SPAN_STEP`. They are cut to the formats, and saturate.
        """
        return {
            "left": _normal(left),
            "right": _normal(right),
            "depth": _depth(left),
            "depth_last": _depth(right),
        }


@dataclass(frozen=True)
class WholeSpans:
    """Spans that are not cut, with the attributes of `Planes` along them.

    Parameters
    ----------
    x, y, length : int64 arrays, shape (S,)
        As in `Pieces`.
    near, far : Fixed, shape (S, 4 or more), SQ(2, 32)
        Attributes at the first and the last pixel's centre, modulo 4. The first pixel is at the long edge.
    inward : Fixed, shape (S, 4 or more), SQ(2, 32)
        Step of the attributes from the first to the next pixel.
    right : bool array, shape (S,)
        Whether the long edge is on the right.
    flip, material, triangle
        As in `Pieces`.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    near: Fixed
    far: Fixed
    inward: Fixed
    right: np.ndarray
    flip: np.ndarray
    material: np.ndarray
    triangle: np.ndarray

    def __len__(self) -> int:
        return len(self.x)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        return _beats(self)


@dataclass(frozen=True)
class SpanAttributes:
    """Accumulators along the long edge. From the long edge, shifts and additions go along each span.

    From a scanline to the next `Gradients.short` is added to the value at the long edge's pixel. With the
    walk's carry `Gradients.long` is added. This takes no product. The value n pixels from the long edge is
    ``n inward`` more. This is a sum of shifts of ``inward``, one for each 1 of n. Pixels that the picture's
    border cuts off at the long edge are skipped in the same way.

    A span of more than ``2^piece`` pixels is cut into pieces of ``2^piece`` pixels, from the long edge on.
    The remaining pixels are the last piece. Each piece is a span of its own, with the true N/W at both its
    ends.

    Values are exact sums of the gradients' codes, modulo 4. They are cut to the pieces' formats. If errors
    carry a value out of range, the value saturates.

    Parameters
    ----------
    whole : bool
        Whether the unit gives whole spans, as `WholeSpans`, for `SpanHalver`, in place of pieces.

    Source: docs/theory/geometry.md#normals; [T] figure 4.10 (normals along the edges).
    """

    whole: bool = False

    def compute(self, rows: ClippedRows, planes: Planes) -> tuple[Pieces | WholeSpans, dict[str, int]]:
        """Bit-accurate pieces, and the counts of triangles without a span and of spans that were cut.

        Parameters
        ----------
        rows : ClippedRows
            From `SpanClip`.
        planes : Planes
            Planes of the triangles of the scanlines, from `PlaneAssembler`.

        Returns
        -------
        pieces : Pieces, or with ``whole`` WholeSpans
            In the order of the scanlines, within a scanline from the long edge on.
        counts : dict of str to int
            ``empty`` and ``cut``.
        """
        format = GradientSetup.FORMAT
        gradients = planes.gradients
        first = np.r_[True, rows.last[:-1]] if len(rows) else np.zeros(0, dtype=bool)
        triangle = np.cumsum(first) - 1
        row = np.arange(len(rows)) - np.flatnonzero(first)[triangle]
        carries = np.cumsum(rows.carry) - rows.carry
        carries = carries - carries[first][triangle]

        spans = np.flatnonzero(rows.length)
        triangle, row, carries = triangle[spans], row[spans], carries[spans]
        short, long, inward = (
            value.codes[triangle] for value in (gradients.short, gradients.long, gradients.inward)
        )
        start = gradients.start.extend(format).codes[triangle]
        skip = rows.skip[spans]
        edge = format.wrap(start + row[:, np.newaxis] * short + carries[:, np.newaxis] * (long - short))
        edge = edge + skip[:, np.newaxis] * inward

        drawn = np.zeros(len(planes), dtype=bool)
        drawn[triangle] = True
        counts = {"empty": int((~drawn).sum()), "cut": 0}
        length, most = rows.length[spans], 1 << planes.piece[triangle]
        if self.whole:
            edge = format.wrap(edge)
            far = format.wrap(edge + (length - 1)[:, np.newaxis] * inward)
            places = {name: getattr(rows, name)[spans] for name in ("x", "y", "right", "flip", "material")}
            close, beyond, change = (Fixed(format, codes) for codes in (edge, far, inward))
            whole = WholeSpans(
                length=length, triangle=triangle, near=close, far=beyond, inward=change, **places
            )
            return whole, counts
        count = -(-length // most)
        span = np.repeat(np.arange(len(spans)), count)
        number = np.arange(len(span)) - np.repeat(np.cumsum(count) - count, count)
        before = number * most[span]
        pixels = np.minimum(length[span] - before, most[span])
        near = format.wrap(edge[span] + before[:, np.newaxis] * inward[span])
        far = format.wrap(near + (pixels - 1)[:, np.newaxis] * inward[span])
        source = triangle[span]
        right = rows.right[spans][span]
        x = rows.x[spans][span]
        turned = right[:, np.newaxis]
        step = format.wrap(np.where(right, -inward[span, 3], inward[span, 3]))
        pieces = Pieces(
            x=np.where(right, x + length[span] - before - pixels, x + before),
            y=rows.y[spans][span],
            length=pixels,
            **Pieces.ends(np.where(turned, far, near), np.where(turned, near, far)),
            depth_step=Fixed(DEPTH_STEP, step),
            flip=rows.flip[spans][span],
            material=rows.material[spans][span],
            triangle=source,
        )
        return pieces, counts | {"cut": int((count > 1).sum())}


def _beats(spans: Pieces | WholeSpans) -> dict[str, np.ndarray]:
    return {
        name: value.codes if isinstance(value, Fixed) else value
        for name, value in vars(spans).items()
        if name != "triangle" and value is not None
    }


def _normal(codes: np.ndarray) -> Fixed:
    value = Fixed(GradientSetup.FORMAT, codes[:, :3])
    return value.truncate(SPAN_NORMAL.fraction_bits).saturate(SPAN_NORMAL)


def _depth(codes: np.ndarray) -> Fixed:
    value = Fixed(GradientSetup.FORMAT, codes[:, 3]).saturate(SQ(1, GradientSetup.FORMAT.fraction_bits))
    return Fixed(SPAN_DEPTH, value.codes - value.format.min_code)
