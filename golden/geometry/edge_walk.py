"""Edge walk ([T] figure 4.10, rasteriser): the first and the last covered pixel of each scanline, exactly."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.edge_setup import X_BITS, Edges, wrap
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.geometry.vertex_sort import SortedTriangles

__all__ = ["EdgeWalk", "Rows"]


@dataclass(frozen=True)
class Rows:
    """Scanlines of triangles: each triangle's first down to its last, or to the picture's last.

    Parameters
    ----------
    triangle : int64 array, shape (R,)
        Index of the triangle.
    y : int64 array, shape (R,)
        Scanline.
    begin, end : int64 arrays, shape (R,)
        First covered column, and first column after the last covered column. If ``end <= begin``, no column
        is covered.
    carry : bool array, shape (R,)
        Whether the long edge moves by one column more than its whole step from this scanline to the next.
    last : bool array, shape (R,)
        The triangle has no further scanline.
    right, flip : bool arrays, shape (R,)
        Of the triangle, as in `SortedTriangles`.
    material : int64 array, shape (R,)
        Index of the triangle's material.
    """

    triangle: np.ndarray
    y: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    carry: np.ndarray
    last: np.ndarray
    right: np.ndarray
    flip: np.ndarray
    material: np.ndarray

    def __len__(self) -> int:
        return len(self.y)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        return {name: value for name, value in vars(self).items() if name != "triangle"}


@dataclass(frozen=True)
class EdgeWalk:
    """Walks the long edge of a triangle, and at the same time first the upper, then the lower edge.

    A triangle is convex. On a scanline between its first and its last corner it reaches from the long edge to
    the short edge that crosses the scanline. The third edge lies above or below the scanline. So these two
    edges give the larger of all left bounds and the smaller of all right bounds. An edge from y0 to y1 has
    the scanlines whose centres are at y0 or below it, and above y1. This is the top-left rule for corners and
    for horizontal edges.

    Columns follow ``x += step; error += error_step; if error >= height: x += 1; error -= height``. This model
    has the closed form.

    Source: docs/theory/geometry.md#coverage; [T] figure 4.10.
    """

    def compute(self, edges: Edges, triangles: SortedTriangles, frame: FrameSettings) -> Rows:
        """Bit-accurate scanlines.

        Parameters
        ----------
        edges : Edges
            From `EdgeSetup`.
        triangles : SortedTriangles
            The triangles of the edges.
        frame : FrameSettings
            The picture. Scanlines below it are left out.

        Returns
        -------
        Rows
            In the order of the triangles, then of y. Every triangle has at least one scanline.
        """
        total = np.minimum(edges.upper + edges.lower, frame.bottom - edges.first)
        total = np.maximum(total, 1)
        triangle = np.repeat(np.arange(len(edges)), total)
        row = np.arange(len(triangle)) - np.repeat(np.cumsum(total) - total, total)
        upper = edges.upper[triangle]
        below = row >= upper
        long, carry = _walk(edges, triangle, 0, row)
        short, _ = _walk(edges, triangle, 1 + below, np.where(below, row - upper, row))
        right = triangles.right[triangle]
        return Rows(
            triangle=triangle,
            y=edges.first[triangle] + row,
            begin=np.where(right, short, long),
            end=np.where(right, long, short),
            carry=carry,
            last=row == total[triangle] - 1,
            right=right,
            flip=triangles.flip[triangle],
            material=triangles.triangles.material[triangle],
        )


def _walk(
    edges: Edges, triangle: np.ndarray, edge: int | np.ndarray, row: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Column of an edge ``row`` scanlines below the edge's first scanline, and the next step's carry."""
    x, error, step, error_step, height = (
        getattr(edges, name)[triangle, edge] for name in ("x", "error", "step", "error_step", "height")
    )
    error = error + row * error_step
    carries = error // height
    column = x + row * step + carries
    return wrap(column, X_BITS), error - carries * height + error_step >= height
