"""Vectors of spans in the frames of further lights, against N/W turned in float64."""

import numpy as np
import pytest

from blysk.bench.units.operands import sphere
from blysk.bench.units.triangles import random_triangles
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.light_adapter import LightAdapter
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.golden.number.fixed import Fixed


@pytest.fixture(scope="module")
def pieces():
    """Pieces of triangles with normals far apart. The longest normal of each triangle has length 1."""
    triangles = random_triangles(np.random.default_rng(3), 600, size=30.0, spread=0.6)
    longest = np.linalg.norm(triangles.normal, axis=2).max(axis=1)[:, np.newaxis, np.newaxis]
    triangles.normal[:] = triangles.normal * ((2.0**23 - 1) / longest)
    return Geometry(vectors=True, rotates=True).pieces(triangles, FrameSettings(-100, -100, 100, 100))[1]


def test_components(pieces):
    """Both ends are N/W of the frame times the same power of two, up to the roundings that the bound
    counts."""
    frames = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3, 3)))[0].reshape(-1, 3)
    adapter = VectorAdapter(rotates=True)
    spans = adapter.compute(pieces)
    made = LightAdapter().compute(spans, LightAdapter.codes_of(frames))
    assert made.start.shape == (len(pieces), 12)
    scale = np.ldexp(2.0**17 * (1 - 2.0**-12), adapter.shift(pieces))[:, np.newaxis]
    scale = scale * np.where(pieces.flip, -1.0, 1.0)[:, np.newaxis]
    left, right = (end.values * scale for end in (pieces.left, pieces.right))
    axes = np.vstack([np.eye(3), frames])
    turned = LightAdapter.AXIS_ERROR * 2**17
    first = 0.5 + np.r_[np.zeros(3), np.full(9, np.sqrt(3) / 2 + turned)] + 2.0**-9
    assert (np.abs(made.start - left @ axes.T) <= first).all()
    long = pieces.length > 1
    last = made.start + made.step * (2.0**-made.exponent * (made.length - 1))[:, np.newaxis]
    change = np.abs(right - left).max(axis=1, keepdims=True)
    # N/W of geometry is cut to 26 fraction bits. After a shift by 6 places this is an eighth of a step.
    of_step = 2 * np.maximum(change * 2.0**-17, 1 / 16) + 1 / 8 + 1 / 4
    error = np.abs(last - right @ axes.T) - np.sqrt(3) * first
    assert (error <= (1 + np.sqrt(3)) * of_step)[long].all()
    # No word wraps on the way, because lengths are under 1.
    for vectors in (made.start, made.step, last):
        assert np.linalg.norm(vectors[long].reshape(-1, 4, 3), axis=2).max() < 2**17 - 4
    assert np.linalg.norm(made.start.reshape(-1, 4, 3), axis=2).max() > 2**17 - 100


def test_short_spans_of_any_ends():
    """In a span of two or three pixels the step is shorter than 1, however far apart the ends are."""
    rng = np.random.default_rng(9)
    for pixels in (2, 3, 4):
        near, far = (sphere(rng, 4000) * rng.uniform(0.3, 1, (4000, 1)) for _ in range(2))
        far = np.where(rng.random((4000, 1)) < 0.7, near + 0.6 * far, far)
        far /= np.maximum(np.linalg.norm(far, axis=1, keepdims=True), 1)
        ends = [Fixed.round(SPAN_NORMAL, np.clip(end, -1, 1 - 2.0**-26)) for end in (near, far)]
        fits = SpanHalver(rotates=True).fits(*ends, np.full(4000, pixels))
        assert 0.1 < fits.mean() < 0.9
        step = np.linalg.norm(far - near, axis=1) / (pixels - 1)
        assert step[fits].max() < 1
        if pixels == 2:
            # Without the further test some steps would be longer.
            assert step[SpanHalver().fits(*ends, np.full(4000, 2))].max() > 1


def test_largest_codes():
    """1 and -1 have the codes 2^17 - 1 and its negative, so that no axis is too long."""
    codes = LightAdapter.codes_of(np.array([1.0, -1.0, 0.5]))
    np.testing.assert_array_equal(codes, [2**17 - 1, 1 - 2**17, 2**16])
