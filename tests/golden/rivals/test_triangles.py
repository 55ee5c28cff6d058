"""Triangles on the screen against the raster's ends, and quadratics against float64."""

import numpy as np

from blysk.golden.number.fixed import SQ
from blysk.golden.reference.raster import rasterise
from blysk.golden.rivals.trace import Trace
from blysk.golden.rivals.triangles import (
    ScreenTriangles,
    Surfaces,
    at_origin,
    gradients,
    screen_triangles,
    six_points,
)

from .scenes import small_scene


def _places(rng, count, most):
    """Triangles at random, with a fragment each."""
    none = np.zeros((3, 3, count))
    i, j = rng.integers(-most, most, count), rng.integers(0, most, count)
    return ScreenTriangles(
        *rng.uniform(-most, most, (2, 3, count)),
        np.ones((3, count)),
        none,
        none,
        i,
        j,
        np.arange(count),
        i,
        j,
    )


def test_vectors_at_fragments_are_those_of_the_raster():
    """N/W by the planes of the triangles, against the ends of spans that the raster made by other means."""
    scene = small_scene()
    raster = rasterise(scene)
    triangles = screen_triangles(scene, raster)
    scaled = np.stack([triangles.normal[k] * triangles.weight[k] for k in range(3)])
    start, across, down = (of[:, triangles.triangle] for of in at_origin(scaled, gradients(triangles)))
    found = (start + across * triangles.i + down * triangles.j).T
    first = raster.offset == 0
    exact = raster.normal_left * raster.magnitude_left[:, np.newaxis]
    np.testing.assert_allclose(found[first], exact, rtol=0, atol=1e-12)


def test_words_are_within_their_drift():
    rng = np.random.default_rng(3)
    count, most, surfaces = 2000, 900, Surfaces(SQ(5, 46))
    triangles = _places(rng, count, most)
    sizes = np.array([1, 1 / most, 1 / most, 0.2 / most**2, 0.2 / most**2, 0.2 / most**2])
    polynomial = rng.uniform(-1, 1, (6, 2, count)) * sizes[:, np.newaxis, np.newaxis]
    words, out_of_range = surfaces.quantise(tuple(polynomial))
    assert not out_of_range.any()
    found = surfaces.compute(words, triangles, Trace()).values
    i, j = triangles.i, triangles.j
    terms = np.stack([np.ones(count), i, j, i * i, i * j, j * j])
    exact = (polynomial * terms[:, np.newaxis]).sum(axis=0).T
    m = np.abs(i) + j
    bound = surfaces.format.step / 2 * (1 + m + m * m / 2)
    assert (np.abs(found - exact).max(axis=1) <= bound + 1e-14).all()
    assert bound.max() <= surfaces.drift(most, most)


def test_words_that_outgrow_their_format_are_flagged():
    polynomial = np.zeros((6, 1, 3))
    polynomial[0, 0] = 15.9, 16.1, np.inf
    words, out_of_range = Surfaces(SQ(5, 46)).quantise(tuple(polynomial))
    assert out_of_range.tolist() == [False, True, True]
    assert words.values[1, 0, 0] > 15.9


def test_six_points_pass_through_the_six_values_and_keep_quadratics():
    rng = np.random.default_rng(4)
    triangles = _places(rng, 50, 20)
    corners, middles = rng.uniform(-1, 1, (2, 3, 2, 50))
    found = six_points(list(corners), list(middles), gradients(triangles))

    def at(x, y):
        return sum(of * power for of, power in zip(found, (1, x, y, x * x, x * y, y * y), strict=True))

    x, y = triangles.x, triangles.y
    area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
    wide = np.abs(area) > 20
    for (one, other), value in zip(((0, 1), (0, 2), (1, 2)), middles, strict=True):
        middle = at((x[one] + x[other]) / 2, (y[one] + y[other]) / 2)
        np.testing.assert_allclose(middle[:, wide], value[:, wide], atol=1e-9)
    for k in range(3):
        np.testing.assert_allclose(at(x[k], y[k])[:, wide], corners[k][:, wide], atol=1e-9)
