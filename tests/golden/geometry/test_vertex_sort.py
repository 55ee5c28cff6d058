"""Triangles that cover no centre of a small box, against edge functions in another form."""

import numpy as np

from blysk.bench.units.triangles import WHOLE, triangles_with
from blysk.golden.geometry.triangles import Grid
from blysk.golden.geometry.vertex_sort import TESTED, VertexSort

from .exact import covered


def test_misses():
    """Corners on quarters of a pixel in a box of 5 pixels: many edges go through centres."""
    rng, grid = np.random.default_rng(48), Grid(4)
    codes = rng.integers(0, rng.integers(2, 21, (20_000, 1, 2)), (20_000, 3, 2)) * grid.steps // 4
    triangles = triangles_with(x=codes[..., 0], y=codes[..., 1])
    dx, dy = (values[:, 1:] - values[:, :1] for values in (triangles.x, triangles.y))
    triangles = triangles[dx[:, 0] * dy[:, 1] != dx[:, 1] * dy[:, 0]]
    ends = (
        grid.first_centre(f(codes, axis=1)) for codes in (triangles.x, triangles.y) for f in (np.min, np.max)
    )
    left, right, top, bottom = ends
    centres = (right - left) * (bottom - top)
    seen = np.isin(np.arange(len(triangles)), covered(triangles, WHOLE, grid).triangle)
    misses = VertexSort(grid).misses(triangles)
    np.testing.assert_array_equal(misses, (centres > 0) & (centres <= TESTED) & ~seen)
    small = centres[misses]
    assert {1, 2, 3, 4} == set(small)
    assert min(len(small), (seen & (centres <= TESTED)).sum()) > 500
