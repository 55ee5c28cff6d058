"""Attributes of spans against exact planes, within the derived bounds."""

import numpy as np
import pytest

from blysk.bench.units.triangles import Stages, random_triangles
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.triangles import GRID, FrameSettings, Grid

from .exact import attribute_at


def errors(stages):
    """Errors of N/W and of the depth at both ends of pieces, divided by their bound, and the triangles of the
    pieces."""
    pieces, frame, grid = stages.pieces, stages.frame, stages.grid
    source = stages.drawn.source[pieces.triangle]
    y = pieces.y + frame.top
    found = []
    for x, normal, depth in (
        (pieces.x, pieces.left, pieces.depth),
        (pieces.x + pieces.length - 1, pieces.right, pieces.depth_last),
    ):
        exact = attribute_at(stages.triangles, source, x + frame.left, y, grid) * 2.0**-23
        normal = np.abs(normal.values - exact[:, :3]).max(axis=1)
        found.append(np.maximum(normal, np.abs(depth.values * 2.0**-23 - 1 - exact[:, 3])))
    height = stages.edges.height[:, 0] / grid.steps
    width = stages.drawn.area / stages.edges.height[:, 0] / grid.steps
    bound = GradientSetup.error(height, np.maximum(width, 1 / 256)) + SPAN_NORMAL.step
    return np.maximum(*found) / bound[pieces.triangle], pieces.triangle


@pytest.mark.parametrize("bits", [4, pytest.param(8, marks=pytest.mark.long)])
@pytest.mark.parametrize(("size", "count"), [(1.5, 9000), (12, 4000), (200, 150)])
def test_bound(bits, size, count):
    """Every covered triangle of every size is tried, without slivers."""
    rng = np.random.default_rng(bits)
    triangles = random_triangles(rng, count, Grid(bits), size, spread=0.3)
    stages = Stages(triangles, FrameSettings(-200, -200, 200, 200), Grid(bits))
    error, triangle = errors(stages)
    error = error[~stages.scales.sliver[triangle]]
    assert len(error) > 2000
    assert error.max() < 1
    assert error.max() > 0.05


def test_slivers_are_off_by_no_more_than_their_width():
    """A triangle at most 1/256 pixel wide gives the value of a point of the triangle within 1/256 pixel of
    the pixel."""
    rng = np.random.default_rng(5)
    points = rng.integers(-8 * 256, 8 * 256, (200_000, 3, 2))
    points[:, 2] = points[:, 0] + (points[:, 1] - points[:, 0]) * rng.integers(0, 9, (200_000, 1)) // 8
    triangles = random_triangles(rng, len(points))
    object.__setattr__(triangles, "x", points[..., 0])
    object.__setattr__(triangles, "y", points[..., 1])
    stages = Stages(triangles, FrameSettings(-20, -20, 20, 20))
    pieces = stages.pieces
    chosen = np.flatnonzero(stages.scales.sliver[pieces.triangle])
    assert len(chosen) > 100
    # A span of a sliver has one pixel. Its value is that of the long edge, a mean of two corners.
    assert (pieces.length[chosen] == 1).all()
    index = pieces.triangle[chosen]
    corners = stages.drawn.triangles
    x, y = corners.x[index], corners.y[index]
    share = ((pieces.y[chosen] + stages.frame.top) * 256 + 128 - y[:, 0]) / (y[:, 2] - y[:, 0])
    values = corners.normal[index] * 2.0**-23
    exact = values[:, 0] + share[:, np.newaxis] * (values[:, 2] - values[:, 0])
    bound = GradientSetup.error(stages.edges.height[index, 0] / 256, 1.0) + SPAN_NORMAL.step
    assert (np.abs(pieces.left.values[chosen] - exact).max(axis=1) < bound).all()
    assert (
        np.abs(x[:, 0] + share * (x[:, 2] - x[:, 0]) - (pieces.x[chosen] - 20) * 256 - 128).max()
        < 256 / 256 + 1
    )


def test_refusal():
    """Operands of another format are refused."""
    stages = Stages(random_triangles(np.random.default_rng(1), 20), FrameSettings(-20, -20, 20, 20), GRID)
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 23\)$"):
        GradientSetup().compute(*[stages.scales.knee] * 3, stages.scales)
