"""Unit normals of spans against perspective-correct normals in float64, and the places of cuts."""

import numpy as np
import pytest

from blysk.bench.units.triangles import Stages, random_triangles
from blysk.golden.geometry.edge_normals import EdgeNormals
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.triangles import GRID, FrameSettings
from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.number.unit_vector import ONE

from .exact import attribute_at

FRAME = FrameSettings(-200, -200, 200, 200)


def test_normals_within_the_bound():
    """The bound of the left and the right normal: the error of N/W divided by its length, and the error of
    the normaliser."""
    stages = Stages(random_triangles(np.random.default_rng(1), 2000, size=20.0, spread=0.3), FRAME)
    pieces, (spans, repaired) = stages.pieces, EdgeNormals().compute(stages.pieces)
    source = stages.drawn.source[pieces.triangle]
    height = stages.edges.height[:, 0]
    width = stages.drawn.area / height / 256
    bound = GradientSetup.error(height / 256, np.maximum(width, 1 / 256)) + 2 * SPAN_NORMAL.step
    bound = np.sqrt(3) * bound[pieces.triangle]
    usual = ~stages.scales.sliver[pieces.triangle]
    for at, name in ((0, "normal_left"), (pieces.length - 1, "normal_right")):
        line = attribute_at(stages.triangles, source, pieces.x + at + FRAME.left, pieces.y + FRAME.top, GRID)
        assert_normals(getattr(spans, name), line[:, :3] * 2.0**-23, bound, pieces.flip, usual)
    assert repaired < 20


def assert_normals(found, line, bound, flip, chosen):
    size = np.linalg.norm(line, axis=1)
    chosen = chosen & (size > 2.0**-12)
    exact = np.where(flip, -1, 1)[:, np.newaxis] * line / size[:, np.newaxis]
    turned = np.linalg.norm(np.cross(found / ONE, exact), axis=1)
    allowed = bound / np.where(size == 0, 1, size) + VectorNormaliser.DIRECTION_ERROR
    assert chosen.sum() > 3_000
    assert (turned < allowed)[chosen].all()
    assert (np.einsum("pk,pk->p", found / ONE, exact) > 0)[chosen].all()
    assert (np.abs(np.linalg.norm(found / ONE, axis=1) - 1) < VectorNormaliser.LENGTH_ERROR)[chosen].all()


@pytest.mark.parametrize("limit", [20, 100, 267])
def test_no_piece_turns_more_than_the_limit(limit):
    """Chords between the unit normals of a piece's ends are within the limit, except for the errors of the
    normals."""
    frame = FrameSettings(-200, -200, 200, 200, limit=limit)
    stages = Stages(random_triangles(np.random.default_rng(limit), 800, size=40.0, spread=0.2), frame)
    spans, _ = EdgeNormals().compute(stages.pieces)
    chord = np.linalg.norm(spans.normal_left - spans.normal_right, axis=1) / ONE
    assert chord.max() < limit / 1024 + 2.0**-10
    whole = np.bincount(stages.clipped.length[stages.clipped.length > 0]).sum()
    # Some spans are cut, and some are not.
    assert 1.1 * whole < len(spans) < stages.clipped.length.sum()


@pytest.mark.ci
@pytest.mark.long
def test_opposite_normals_are_repaired():
    """Where normals cancel, the normal before takes their place, and no pixel is lost."""
    triangles = random_triangles(np.random.default_rng(3), 300, size=30.0)
    triangles.normal[:, 1] = -triangles.normal[:, 0]
    triangles.normal[:, 2] = triangles.normal[:, 0]
    triangles.normal[::20] = 0
    stages = Stages(triangles, FRAME)
    spans, repaired = EdgeNormals().compute(stages.pieces)
    assert repaired > 100
    assert spans.length.sum() == stages.clipped.length.sum()
    length = np.linalg.norm(np.stack([spans.normal_left, spans.normal_right]), axis=-1)
    assert np.abs(length / ONE - 1).max() < VectorNormaliser.LENGTH_ERROR


def test_angle_of_a_limit():
    """No span is wider than the angle of its limit."""
    for angle in (1.0, 6.3, 15.0, 22.5):
        assert 2 * np.degrees(np.arcsin(FrameSettings.limit_of(angle) / 2048)) <= angle
