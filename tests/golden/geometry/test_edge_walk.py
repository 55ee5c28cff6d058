"""Coverage by vertex sort, edge setup, edge walk and span clip against edge functions, exactly."""

from itertools import product

import numpy as np
import pytest
from scipy.spatial import Delaunay

from blysk.bench.units.triangles import WHOLE, random_triangles, small_frame
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.triangles import FrameSettings, Grid, Triangles

from .exact import covered


def triangles_of(points):
    """Triangles that have only corners, shape (T, 3, 2)."""
    shape = points.shape[:2]
    zeros = np.zeros(shape, dtype=np.int64)
    return Triangles(
        points[..., 0], points[..., 1], zeros, np.zeros((*shape, 3), dtype=np.int64), zeros[:, 0], zeros[:, 0]
    )


def spans(triangles, frame, grid):
    """Index, scanline, first column and first column after the span, by the models of the units."""
    drawn, rows, triangle, _ = Geometry(grid).rows(triangles, frame)
    kept = np.flatnonzero(rows.length)
    begin = rows.x[kept] + frame.left
    return drawn.source[triangle[kept]], rows.y[kept] + frame.top, begin, begin + rows.length[kept]


def assert_covers(triangles, frame, grid):
    expected = covered(triangles, frame, grid)
    for found, wanted in zip(spans(triangles, frame, grid), expected, strict=True):
        np.testing.assert_array_equal(found, wanted)
    return len(expected.y)


@pytest.mark.parametrize("bits", [4, 8])
def test_random_triangles(bits):
    """Slivers, needles, corners on pixel centres, the ends of the guard band, pictures of all sizes."""
    rng, grid = np.random.default_rng(bits), Grid(bits)
    for frame in (small_frame(rng), small_frame(rng), FrameSettings(-300, -200, 340, 280)):
        assert assert_covers(random_triangles(rng, 20_000, grid), frame, grid) > 5000
    assert assert_covers(random_triangles(rng, 1000, grid), WHOLE, grid) > 30_000


@pytest.mark.long
@pytest.mark.parametrize("size", [1.0, 3.0, 20.0])
def test_many_random_triangles(size):
    """A million triangles in all."""
    rng, grid = np.random.default_rng(7), Grid()
    frame = FrameSettings(-40, -30, 50, 40)
    for _ in range(4):
        assert_covers(random_triangles(rng, 100_000, grid, size), frame, grid)


def test_every_triangle_of_a_small_grid():
    """All of 64^3 triangles with corners on quarters of a pixel, in an area of two pixels."""
    grid = Grid(4)
    place = np.array(list(product(range(-2, 30, 4), repeat=2)))
    index = np.stack(np.meshgrid(*[np.arange(len(place))] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    assert assert_covers(triangles_of(place[index]), FrameSettings(-4, -4, 4, 4), grid) > 60_000


@pytest.mark.parametrize("step", [16, *(pytest.param(k, marks=pytest.mark.long) for k in (1, 128))])
def test_every_sample_of_a_shared_edge_is_drawn_once(step):
    """Triangulations of random points: on the grid, on sixteenths of a pixel, on pixel centres and
    borders."""
    rng, grid, frame = np.random.default_rng(step), Grid(), FrameSettings(-20, -20, 20, 20)
    for _ in range(12):
        points = np.unique(rng.integers(-12 * 256 // step, 12 * 256 // step, (60, 2)), axis=0) * step
        mesh = Delaunay(points)
        _, y, begin, end = spans(triangles_of(points[mesh.simplices]), frame, grid)
        count = np.zeros((40, 41), dtype=np.int64)
        np.add.at(count, (y + 20, begin + 20), 1)
        np.add.at(count, (y + 20, end + 20), -1)
        count = count.cumsum(axis=1)[:, :-1]
        centre = np.stack(np.meshgrid(*[np.arange(-20, 20) * 256 + 128] * 2), axis=-1)
        # The hull may lack slivers. Well inside it every centre is covered once.
        inside = mesh.find_simplex(centre / 1.0) >= 0
        deep = inside & (np.abs(centre) < 8 * 256).all(axis=-1)
        assert count.max() == 1
        assert deep.sum() > 100
        assert (count[deep] == 1).all()
        assert (count[~inside] == 0).mean() > 0.99
