"""Edge setup ([T] figure 4.10, increments): steps and start of an edge's walk, in integers."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.triangles import GRID, PIXEL_BITS, Grid
from blysk.golden.geometry.vertex_sort import SortedTriangles

__all__ = ["EDGES", "FRACTION_BITS", "X_BITS", "EdgeSetup", "Edges"]

EDGES = ((0, 2), (0, 1), (1, 2))
"""First and last corner of each edge: the long edge, the upper edge, the lower edge."""

X_BITS = PIXEL_BITS + 1
"""Bits of a column or a scanline: -4096 to 4095."""

FRACTION_BITS = 32
"""Bits of the fraction of the long edge's step."""


@dataclass(frozen=True)
class Edges:
    """The three edges of triangles; arrays of shape (T, 3) are in the order of `EDGES`.

    Parameters
    ----------
    x : int64 array, shape (T, 3)
        First column whose centre is not left of the edge, on the edge's first scanline.
    error : int64 array, shape (T, 3)
        Remainder that the walk starts with, 0 to ``height - 1``.
    step : int64 array, shape (T, 3)
        Whole columns from one scanline to the next, modulo 2^13 like ``x``.
    error_step : int64 array, shape (T, 3)
        Remainder of the step, added to ``error`` at each scanline, 0 to ``height - 1``.
    height : int64 array, shape (T, 3)
        Height of the edge in steps of the grid; 1 for a horizontal edge.
    first : int64 array, shape (T,)
        First scanline.
    upper, lower : int64 arrays, shape (T,)
        Scanlines of the upper and of the lower edge, 0 or more.
    fraction : int64 array, shape (T,)
        Fraction of the long edge's step, ``floor(2^32 error_step / height)``.
    down : int64 array, shape (T,)
        Distance from the first corner down to the centre of the first scanline, modulo a pixel. It is in
        1/256 pixel on any grid, 0 to 255.
    along : int64 array, shape (T,)
        ``256 (x - x0 + 1/2) - down step`` of the long edge, x and x0 in pixels: see `GradientSetup`.
    """

    x: np.ndarray
    error: np.ndarray
    step: np.ndarray
    error_step: np.ndarray
    height: np.ndarray
    first: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    fraction: np.ndarray
    down: np.ndarray
    along: np.ndarray

    def __len__(self) -> int:
        return len(self.first)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        return vars(self) | {"flat": self.upper == 0}


def wrap(codes: np.ndarray, bits: int) -> np.ndarray:
    """Codes wrapped to a signed word of ``bits`` bits: two's complement, modulo ``2^bits``."""
    half = 1 << (bits - 1)
    return ((codes + half) & ((1 << bits) - 1)) - half


@dataclass(frozen=True)
class EdgeSetup:
    """Quotients and remainders of an edge's step per scanline and of its start.

    An edge from (x0, y0) to (x1, y1) with ``d = y1 - y0 > 0`` meets the centre of scanline j, which is k
    steps below (x0, y0), at ``X = x0 + (x1 - x0) k / d``. With ``h`` half a pixel and ``P = 2^s`` a pixel,
    the first centre that is not left of the edge belongs to column

        x = ceil((X - h) / P) = ceil(((x0 - h) d + (x1 - x0) k) / (P d))

    From a scanline to the next k grows by P, and the numerator by ``P (x1 - x0)``. ``x`` is also
    ``ceil(ceil(numerator / P) / d)``. So the factor P cancels, and the walk is ``x += step; error +=
    error_step; if error >= d: x += 1; error -= d`` with ``step, error_step = divmod(x1 - x0, d)``, exactly.

    The start needs no second division: with ``x0 - h = P c + g`` and ``down = k`` of the first scanline,

        g + k step = P a + b,    u = floor((b d + k error_step - 1) / P),    -1 <= u < 2 d - 1
        x = c + a + n,    error = u + d (1 - n),    n = 0 if u < 0, 1 if u < d, else 2

    Both bounds of a span come from the same x. At a left edge x is the first column, at a right edge the
    first column after the span. So a sample on an edge that two triangles share belongs to the right triangle
    only, and no sample between them is missed.

    The words of an edge without scanlines have no meaning. They equal the words of the hardware, where x
    wraps.

    Parameters
    ----------
    grid : Grid
        Fraction bits of the coordinates.

    Source: docs/theory/geometry.md#coverage; [T] figure 4.10.
    """

    grid: Grid = GRID

    def compute(self, triangles: SortedTriangles) -> Edges:
        """Bit-accurate edges.

        Parameters
        ----------
        triangles : SortedTriangles
            From `VertexSort`.
        """
        grid, s = self.grid, self.grid.subpixel_bits
        x, y = triangles.triangles.x, triangles.triangles.y
        top, bottom = (np.array(column) for column in zip(*EDGES, strict=True))
        width = x[:, bottom] - x[:, top]
        height = np.maximum(y[:, bottom] - y[:, top], 1)
        step, error_step = np.divmod(width, height)
        low = grid.steps - 1
        down = (grid.half - y[:, top]) & low
        begin = x[:, top] - grid.half
        total = (begin & low) + down * step
        rest = total & low
        u = (rest * height + down * error_step - 1) >> s
        n = (u >= 0).astype(np.int64) + (u >= height)
        rows = grid.first_centre(y)
        long = slice(None), 0
        return Edges(
            x=wrap((begin >> s) + (total >> s) + n, X_BITS),
            error=u + height * (1 - n),
            step=wrap(step, X_BITS),
            error_step=error_step,
            height=height,
            first=rows[:, 0],
            upper=rows[:, 1] - rows[:, 0],
            lower=rows[:, 2] - rows[:, 1],
            fraction=(error_step[long] << FRACTION_BITS) // height[long],
            down=down[long] << (8 - s),
            along=((n[long] << s) - rest[long]) << (8 - s),
        )
