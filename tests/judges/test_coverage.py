"""Coverage by the models, compared pixel by pixel with a conformant renderer's (Mesa's llvmpipe)."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from .coverage import by_geometry, by_rasteriser, in_cells, tags_of


def needles(rng, count, size):
    """Slivers across the picture, 1 to 4 steps wide, with tags."""
    ends = rng.integers(0, 256 * np.array(size), (count, 2, 2))
    third = ends[:, :1] + rng.integers(-4, 5, (count, 1, 2))
    return np.clip(np.concatenate([ends, third], axis=1), 0, 256 * np.array(size)), tags_of(rng, count)


def same(judge, corners, tags, size, *others):
    """Assert that the judge and the models cover the same pixels. Returns the numbers of triangles."""
    expected = judge.coverage(corners, tags, size)
    for found in (by_geometry, *others):
        np.testing.assert_array_equal(found(corners, tags, size), expected, err_msg=found.__name__)
    return expected[0]


def test_the_judge_is_the_processor_with_eight_bits_below_the_pixel(judge):
    info = judge.context.info
    assert info["GL_RENDERER"].startswith("llvmpipe")
    assert info["GL_SUBPIXEL_BITS"] == 8


def test_random_triangles(judge):
    corners, tags = in_cells(np.random.default_rng(1), 32)
    assert same(judge, corners, tags, (512, 512), by_rasteriser).sum() > 10_000


def test_a_moved_corner_is_found(judge):
    """A corner that moves by a step changes the coverage of some triangle."""
    corners, tags = in_cells(np.random.default_rng(1), 32)
    moved = corners.copy()
    moved[:, 0] += 1
    changed = judge.coverage(moved, tags, (512, 512)) != judge.coverage(corners, tags, (512, 512))
    assert changed.any()


@pytest.mark.long
def test_a_million_random_triangles(judge):
    """62 pictures with a triangle in each of 128^2 cells."""
    rng, covered = np.random.default_rng(2), 0
    for _ in range(62):
        corners, tags = in_cells(rng, 128)
        covered += same(judge, corners, tags, (2048, 2048), by_rasteriser).sum()
    assert covered > 10_000_000


@pytest.mark.parametrize(
    "step", [1, *(pytest.param(k, marks=[pytest.mark.long, pytest.mark.ci]) for k in (16, 128, 256))]
)
def test_shared_edges(judge, step):
    """Triangulations of random points on the grid, on sixteenths, on centres and borders of pixels."""
    rng, size = np.random.default_rng(step), (128, 128)
    points = np.unique(rng.integers(0, 128 * 256 // step + 1, (300, 2)), axis=0) * step
    corners = points[Delaunay(points).simplices]
    count = same(judge, corners, tags_of(rng, len(corners)), size, by_rasteriser)
    assert count.max() == 1
    assert count.mean() > 0.9


@pytest.mark.long
@pytest.mark.ci
def test_slivers(judge):
    rng, size = np.random.default_rng(3), (1024, 512)
    for _ in range(4):
        corners, tags = needles(rng, 2000, size)
        assert same(judge, corners, tags, size).sum() > 1000


@pytest.mark.long
@pytest.mark.ci
def test_triangles_that_overlap(judge):
    """Large triangles, whose tags add up."""
    rng, size = np.random.default_rng(4), (512, 256)
    for _ in range(8):
        corners = rng.integers(0, 256 * np.array(size) + 1, (300, 3, 2))
        assert same(judge, corners, tags_of(rng, 300), size).max() > 30
