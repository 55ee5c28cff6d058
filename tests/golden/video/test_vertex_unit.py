"""The vertex unit's model against float64, and its bounds."""

import numpy as np
import pytest

from blysk.bench.units.operands import unit_codes
from blysk.bench.units.video.vertex_unit import any_matrix
from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.video.vertex_unit import ENTRY, OFFSET, WEIGHT, VertexTransform


def _exact(position, normal, matrix, unit):
    """Coordinates in steps, depth in codes, N/W, and W in distances of the near plane."""
    p, n = (Fixed(COMPONENT, codes).values for codes in (position, normal))
    space = p @ Fixed(ENTRY, matrix.position).values.T + Fixed(OFFSET, matrix.offset).values
    w = space[:, 2]
    steps = 2.0 ** (unit.scale_bits + unit.grid.subpixel_bits)
    turned = n @ Fixed(ENTRY, matrix.normal).values.T
    return space[:, :2] / w[:, np.newaxis] * steps, (1 - 1 / w) * 2.0**24, turned / w[:, np.newaxis], w


@pytest.mark.parametrize(("distance", "size"), [(1.4, 0.4), (3.0, 1.1), (8.0, 1.1), (14.0, 1.1)])
def test_bounds_hold_and_are_near(distance, size):
    rng = np.random.default_rng(7)
    unit, count = VertexTransform(), 60_000
    for _ in range(2):
        matrix = any_matrix(rng, distance, size)
        position, normal = rng.integers(-ONE, ONE + 1, (count, 3)), unit_codes(rng, count)
        found = unit.compute(position, normal, matrix)
        place, depth, scaled, w = _exact(position, normal, matrix, unit)
        kept = ~found.outside
        assert kept.mean() > 0.5
        for codes, exact in ((found.x, place[:, 0]), (found.y, place[:, 1])):
            error = np.abs(codes - exact)[kept].max()
            assert 0.5 < error <= VertexTransform.ERROR
        assert 0.5 < np.abs(found.depth - depth)[kept].max() <= VertexTransform.DEPTH_ERROR
        # A normal of length 1 may turn to components over 1, which saturate.
        full = np.abs(scaled * w[:, np.newaxis]).max(axis=1) < ONE * 2.0**-17
        error = np.abs(found.normal * 2.0**-23 - scaled)[kept & full].max()
        assert error <= VertexTransform.NORMAL_ERROR


@pytest.mark.parametrize("distance", [0.9, 1.2, 15.8, -1.0])
def test_outside_is_what_is_outside(distance):
    rng = np.random.default_rng(8)
    unit = VertexTransform()
    matrix = any_matrix(rng, distance, 1.1)
    position = rng.integers(-ONE, ONE + 1, (20_000, 3))
    found = unit.compute(position, unit_codes(rng, 20_000), matrix)
    place, _, _, w = _exact(position, position, matrix, unit)
    beside = (np.abs(place + 0.5) > 2048 * 256).any(axis=1)
    clear = (
        (np.abs(w - 1) > 1e-6)
        & (np.abs(w - 16) > 1e-6)
        & (np.abs(np.abs(place) - 2048 * 256).min(axis=1) > 1)
    )
    exact = (w < 1) | (w >= 16) | beside
    np.testing.assert_array_equal(found.outside[clear], exact[clear])
    assert exact.mean() > 0


def test_scale_bits_out_of_range():
    with pytest.raises(ValueError, match="scale_bits must be 4 to 11, not 12"):
        VertexTransform(12)


def test_attributes_are_quotients_within_their_bound():
    """A word over the word of 1/W is the attribute. The bound is for attributes that are rounded once."""
    rng, unit, count = np.random.default_rng(12), VertexTransform(surface=AttributeSpans(True, True)), 20_000
    for distance in (1.4, 9.0, 15.0):
        matrix = any_matrix(rng, distance)
        position = rng.integers(-ONE, ONE + 1, (count, 3))
        exact = np.concatenate([rng.random((count, 3)), rng.uniform(-1, 1, (count, 2))], axis=1)
        exact[0], exact[1] = 0, 1
        codes = np.rint(exact * SurfaceWords.LARGEST * 2**17).astype(np.int64)
        made = unit.compute(position, unit_codes(rng, count), matrix, codes)
        words, weight = made.surface[:, :-1], made.surface[:, -1:]
        _, _, _, w = _exact(position, unit_codes(rng, count), matrix, unit)
        kept = ~made.outside
        error = np.abs(words / weight - exact)[kept]
        bound = unit.surface_error(w[kept])[:, np.newaxis]
        assert (error <= bound).all()
        assert (error / bound).max() > 0.5
        # White stays white, and no word is over the word of 1/W.
        np.testing.assert_array_equal(words[1], np.repeat(weight[1], 5))
        assert codes.max() == WEIGHT
        assert (np.abs(words) <= weight + 1).all()
