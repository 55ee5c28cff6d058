"""The part of geometry's spans that the shading pipeline reads: unit normals, and rounded true lines."""

import numpy as np
import pytest

from blysk.bench.units.triangles import Stages, random_triangles
from blysk.golden.geometry.edge_normals import EdgeNormals
from blysk.golden.geometry.span_adapter import LineAdapter, shading_spans
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.number.fixed import SQ, Fixed

FRAME = FrameSettings(-200, -200, 200, 200)


@pytest.fixture(scope="module")
def pieces():
    return Stages(random_triangles(np.random.default_rng(3), 3000, size=12.0, spread=0.3), FRAME).pieces


def test_normals_are_passed_on(pieces):
    """Each normal has its own name, with coordinates and material."""
    spans, _ = EdgeNormals().compute(pieces)
    shaded = shading_spans(spans)
    for name in ("x", "y", "length", "material", "normal_left", "normal_right"):
        np.testing.assert_array_equal(getattr(shaded, name), getattr(spans, name))
    assert (shaded.normal_right != shaded.normal_left).any()


def test_lines_are_in_proportion(pieces):
    """Both ends are N/W times the same power of two, to half a step. They are turned if the flag says so."""
    spans = LineAdapter().compute(pieces)
    exact = np.concatenate((pieces.left.values, pieces.right.values), axis=1)
    exact = np.where(pieces.flip[:, np.newaxis], -exact, exact)
    found = np.concatenate((spans.normal_left, spans.normal_right), axis=1) * LineAdapter.FORMAT.step
    largest = np.abs(exact).max(axis=1)
    scale = 2.0 ** np.clip(np.floor(-np.log2(np.maximum(largest, 2.0**-30))), 0, LineAdapter.LARGEST_SHIFT)
    error = np.abs(found - exact * scale[:, np.newaxis])
    # Next to 1 the largest code stands for the value. A power of two may be shifted by one place less.
    usual = (np.abs(found).max(axis=1) < 1 - 2.0**-21) & (np.log2(largest) % 1 > 1e-6)
    assert usual.mean() > 0.98
    assert error[usual].max() <= LineAdapter.ERROR
    assert np.unique(scale[usual]).size > 3
    assert 0.1 < pieces.flip.mean() < 0.9


def test_ends_of_the_range():
    """-1, the largest code and 0 are tried, with and without a turn."""
    codes = np.array([[SPAN_NORMAL.min_code, 0, 1], [SPAN_NORMAL.max_code, -1, 0], [0, 0, 0], [-1, 0, 1]])
    vectors = Fixed(SPAN_NORMAL, codes)
    most = LineAdapter.FORMAT.max_code
    for flip, sign in ((False, 1), (True, -1)):
        left, right = LineAdapter().ends(vectors, vectors, np.full(4, flip))
        np.testing.assert_array_equal(left, right)
        np.testing.assert_array_equal(left[:3], sign * np.array([[-most, 0, 0], [most, 0, 0], [0, 0, 0]]))
        np.testing.assert_array_equal(left[3], sign * np.array([-8, 0, 8]))


def test_another_format_is_refused():
    """Codes of another format would be lines of another length."""
    other = Fixed(SQ(1, 17), np.zeros((1, 3), dtype=np.int64))
    with pytest.raises(ValueError, match="operands must be"):
        LineAdapter().ends(other, other, np.zeros(1, dtype=bool))
