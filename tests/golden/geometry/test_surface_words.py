"""Attributes of a surface from triangles, against planes through the corners in float64."""

import numpy as np
import pytest

from blysk.bench.units.triangles import random_triangles
from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.geometry.triangles import ATTRIBUTE, GRID, FrameSettings
from blysk.golden.number.spans import pixels_of
from blysk.sim.frames.triangles import with_surface

BOTH = AttributeSpans(coordinates=True)


def words_of(triangles, frame):
    """Words of every pixel, the exact planes, and the bound of the planes, for triangles with a width."""
    geometry = Geometry(vectors=True, surface=BOTH)
    drawn, pieces, _ = geometry.pieces(triangles, frame)
    span, index = pixels_of(pieces.length)
    words = BOTH.compute(
        pieces.surface._replace(base=pieces.y, range=pieces.y, level=pieces.y), pieces.length
    )
    found = np.column_stack([words.numerators.values, words.weight.values])
    of = pieces.triangle[span]
    x = (pieces.x[span] + index + frame.left + 0.5) * GRID.steps
    y = (pieces.y[span] + frame.top + 0.5) * GRID.steps
    given = drawn.triangles
    (x0, x1, x2), (y0, y1, y2) = (of_corner[of].T.astype(float) for of_corner in (given.x, given.y))
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    second = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
    third = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
    share = np.stack([1 - second - third, second, third], axis=1)
    exact = np.einsum("pc,pca->pa", share, given.surface[of] * ATTRIBUTE.step)
    rows = np.ptp(given.y, axis=1) / GRID.steps
    width = drawn.area / np.maximum(rows, 1 / GRID.steps) / GRID.steps**2
    bound = GradientSetup.error(rows, np.maximum(width, 1 / 256))[of] + SurfaceWords.ERROR
    wide = (width > 1 / 256)[of]
    return found[wide], exact[wide], bound[wide]


@pytest.mark.parametrize(("size", "frame"), [(6.0, 30), (300.0, 200), (1900.0, 2000)])
def test_words_within_their_bound_of_the_planes(size, frame):
    """No word wraps in triangles of all kinds. Many triangles have colours of 0 or 1 at all corners."""
    rng = np.random.default_rng(int(size))
    triangles = with_surface(random_triangles(rng, 60 if size > 100 else 1000, size=size), BOTH, rng)
    # A few scanlines of the largest triangles are enough.
    found, exact, bound = words_of(triangles, FrameSettings(-frame, -30, frame, 30))
    error = np.abs(found - exact).max(axis=1)
    assert (error <= bound).all()
    assert error.max() > 2.0**-23


def test_a_tall_thin_triangle_does_not_wrap():
    """Errors of its planes add up over 4,000 scanlines. `LARGEST` leaves room for these errors."""
    rng = np.random.default_rng(2)
    triangles = with_surface(random_triangles(rng, 200), BOTH, rng)
    low, high = GRID.coordinate.min_code, GRID.coordinate.max_code
    triangles.x[:] = rng.integers(-200, 200, (200, 3)) + [0, 0, 1] * rng.integers(-3000, 3000, (200, 1))
    triangles.y[:] = np.array([low, 0, high]) + rng.integers(0, 99, (200, 3)) * [1, 1, -1]
    triangles.surface[::2, :, -1] = int(SurfaceWords.LARGEST * 2**23)
    triangles.surface[::2, :, :3] = int(SurfaceWords.LARGEST * 2**23)
    found, exact, bound = words_of(triangles, FrameSettings(-40, -2048, 40, 2047))
    assert (np.abs(found - exact).max(axis=1) <= bound).all()
    assert exact.max() > 0.999
    assert bound.max() < 1.1 * 2.0**-11


def test_steps_are_as_fine_as_they_fit():
    """The exponent is the largest possible, and the words give the step back, for any codes and for powers of
    two."""
    rng = np.random.default_rng(4)
    codes = rng.integers(-(1 << 32), 1 << 32, (4000, 4)) >> rng.integers(0, 33, (4000, 1))
    codes[::5, 1] = rng.choice([-1, 1], 800) * (1 << rng.integers(0, 32, 800))
    words = SurfaceWords().compute(np.zeros_like(codes), codes)
    step = np.column_stack([words.step, words.weight_step])
    exponent = words.exponent[:, np.newaxis]
    lost = codes - (step << (9 - exponent))
    assert ((lost >= 0) & (lost < 1 << (9 - exponent))).all()
    finer = codes << (exponent + 1)
    beyond = ((finer < -(1 << 32)) | (finer >= 1 << 32)).any(axis=1)
    assert (beyond | (words.exponent == 9)).all()
    assert set(words.exponent) == set(range(10))
