"""Coverage and attributes of triangles, found in another way than in the units: three edge functions,
rational planes."""

from typing import NamedTuple

import numpy as np

__all__ = ["Covered", "attribute_at", "covered"]


class Covered(NamedTuple):
    """Spans of triangles: index, scanline, first column, first column after the last."""

    triangle: np.ndarray
    y: np.ndarray
    begin: np.ndarray
    end: np.ndarray


def covered(triangles, frame, grid) -> Covered:
    """Spans of all triangles, seen from either side, by the three edge functions of each.

    ``e(x, y) = a x + b y + c`` of an edge is positive inside. A centre on an edge is covered if the inside is
    to the right of the edge, or if the edge is horizontal and the inside is below. On a scanline each edge
    bounds x from one side. The largest lower bound and the smallest upper bound are the span.
    """
    x, y = triangles.x, triangles.y
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    # Corners in the order in which the edge functions are positive inside.
    x, y = (np.where(area[:, np.newaxis] < 0, v[:, ::-1], v) for v in (x, y))
    solid = area != 0
    first = np.maximum(grid.first_centre(y.min(axis=1)), frame.top)
    last = np.minimum(grid.first_centre(y.max(axis=1)), frame.bottom)
    rows = np.where(solid, np.maximum(last - first, 0), 0)
    triangle = np.repeat(np.arange(len(x)), rows)
    line = np.arange(len(triangle)) - np.repeat(np.cumsum(rows) - rows, rows) + first[triangle]
    centre = line * grid.steps + grid.half
    begin = np.full(len(triangle), frame.left)
    end = np.full(len(triangle), frame.right)
    for k in range(3):
        x0, y0, x1, y1 = (v[triangle, corner] for corner in (k, (k + 1) % 3) for v in (x, y))
        a, b = y0 - y1, x1 - x0
        # e at the centre of column i is rest + slope i.
        rest = a * (grid.half - x0) + b * (centre - y0)
        slope = a * grid.steps
        # e is positive, or 0 on a left or a top edge. e is an integer, so a bound lower by 1 serves for the
        # edge.
        rest = np.where((a > 0) | ((a == 0) & (b > 0)), rest, rest - 1)
        up = np.where(slope > 0, -(rest // np.where(slope > 0, slope, 1)), begin)
        down = np.where(slope < 0, rest // np.where(slope < 0, -slope, 1) + 1, end)
        begin, end = np.maximum(begin, up), np.minimum(end, down)
        end = np.where((slope == 0) & (rest < 0), begin, end)
    kept = end > begin
    return Covered(triangle[kept], line[kept], begin[kept], end[kept])


def attribute_at(triangles, triangle, x, y, grid) -> np.ndarray:
    """Attributes at pixel centres in float64, shape (P, 4).

    They come from areas, so no sum exceeds the values at the corners.
    """
    px, py = x * grid.steps + grid.half, y * grid.steps + grid.half
    cx, cy = triangles.x[triangle], triangles.y[triangle]
    weights = []
    for k in range(3):
        (x1, y1), (x2, y2) = ((cx[:, j % 3], cy[:, j % 3]) for j in (k + 1, k + 2))
        weights.append((x1 - px) * (y2 - py) - (x2 - px) * (y1 - py))
    weights = np.stack(weights, axis=1)
    weights = weights / weights.sum(axis=1, keepdims=True)
    return np.einsum("pk,pka->pa", weights, triangles.attributes[triangle].astype(np.float64))
