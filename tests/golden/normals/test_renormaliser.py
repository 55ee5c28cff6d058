"""Renormaliser against float64."""

import numpy as np
import pytest

from blysk.bench.units.operands import sphere
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE

UNIT = Renormaliser()
FORMAT = UNIT.VECTOR_FORMAT
SHORTEST_CODE = 1 << 14


def checked(vectors):
    """Codes and flags, and the largest angle and length error of the vectors that are not flagged."""
    normals, too_short = UNIT.compute(Fixed(FORMAT, vectors))
    assert normals.format == COMPONENT
    found, exact = normals.codes[~too_short] / ONE, vectors[~too_short] * FORMAT.step
    length = np.linalg.norm(found, axis=-1)
    turn = np.arctan2(np.linalg.norm(np.cross(found, exact), axis=-1), (found * exact).sum(axis=-1))
    angle, off = turn.max(initial=0), np.abs(length - 1).max(initial=0)
    assert angle <= UNIT.DIRECTION_ERROR
    assert off <= UNIT.LENGTH_ERROR
    return normals.codes, too_short, angle, off


def vectors_of(rng, count, shortest):
    """Codes of vectors of all directions.

    The logarithm of their lengths is uniform, from the shortest to 1.
    """
    vectors = sphere(rng, count) * shortest ** rng.random((count, 1))
    return np.rint(vectors * FORMAT.max_code).astype(np.int64)


@pytest.mark.parametrize("octave", range(4))
def test_factor_of_every_squared_length(octave):
    """Every word of a segment and x is tried, with the lowest and the highest of the bits that are cut."""
    bits = np.arange(1 << 21, 1 << 22)
    codes = bits[bits < 3 << 20] << (11 + octave) if octave == 3 else bits << (11 + octave)
    bound = UNIT.FIT + 2.0**-21 + 2.0**-17 / 16 + 2.0**-17
    worst = 0
    for low in (0, (1 << (11 + octave)) - 1):
        r = UNIT.factor(Fixed(SQ(4, 34), codes + low))
        square = np.ldexp((codes + low).astype(float), -34)
        worst = max(worst, np.abs(r.values - ONE * COMPONENT.step / np.sqrt(square)).max())
    assert bound / 2 < worst <= bound


def test_fit_alone():
    """In float64 each segment is near the best quadratic."""
    c0, c1, c2 = (c.values[:, np.newaxis] for c in UNIT.coefficients)
    u = np.linspace(0, 1 / 16, 2001)
    octave, segment = np.divmod(np.arange(64), 16)
    scale = 2.0 ** (octave - 2)[:, np.newaxis]
    square = (1 + segment[:, np.newaxis] / 16 + u) * scale
    error = np.abs(c0 - u * (c1 - u * c2) - ONE * COMPONENT.step / np.sqrt(square))
    # A quadratic over a width w is off by at least w^3/192 |f'''|. Rounding c0 adds up to half its step.
    third = 15 / 8 * ((1 + (segment + 0.5) / 16) ** -3.5) / np.sqrt(scale[:, 0])
    best = (1 / 16) ** 3 / 192 * third
    assert best.max() < error.max() <= UNIT.FIT
    assert np.all(error.max(axis=1) <= 1.2 * best + 2.0**-19)


@pytest.mark.parametrize("rounds", [1, pytest.param(100, marks=pytest.mark.long)])
def test_random_vectors(rounds):
    """Lengths are 2^-8 to 1. Only vectors at the very end of the range have no component of 2^-8."""
    rng = np.random.default_rng(rounds)
    for _ in range(rounds):
        vectors = vectors_of(rng, 200_000, UNIT.SHORTEST)
        _, too_short, angle, off = checked(vectors)
        assert angle > UNIT.DIRECTION_ERROR / 2
        assert off > UNIT.LENGTH_ERROR / 4
        np.testing.assert_array_equal(too_short, flagged(vectors))
        length = np.linalg.norm(vectors, axis=1) * FORMAT.step
        assert not too_short[length >= np.sqrt(3) * UNIT.SHORTEST].any()
        assert 1000 < np.count_nonzero(too_short) < 40_000


def flagged(vectors):
    """Whether all three components are from -2^-8 to under 2^-8."""
    return ((vectors >= -SHORTEST_CODE) & (vectors < SHORTEST_CODE)).all(axis=1)


@pytest.mark.parametrize("power", range(14, 23))
def test_stiff_largest_component_about_a_power_of_two(power):
    """Where the shift and the flag change, a code before, at and after the change is tried, with both
    signs."""
    rng = np.random.default_rng(power)
    largest = (1 << power) + np.array([-2, -1, 0, 1, 2])
    largest = np.r_[largest, -largest]
    others = np.rint(rng.uniform(-1, 1, (200, len(largest), 2)) * np.abs(largest)[:, np.newaxis])
    vectors = np.concatenate([np.broadcast_to(largest[:, np.newaxis], (200, 10, 1)), others], axis=2)
    vectors = rng.permuted(vectors.reshape(-1, 3), axis=1).astype(np.int64)
    vectors = np.clip(vectors, FORMAT.min_code, FORMAT.max_code)
    _, too_short, _, _ = checked(vectors)
    np.testing.assert_array_equal(too_short, flagged(vectors))
    assert too_short.any() == (power == 14)


def test_stiff_lengths_do_not_matter():
    """A vector and its doubles, up to the end of the word, have the same unit vector, bit by bit."""
    rng = np.random.default_rng(5)
    vectors = np.rint(sphere(rng, 5000) * rng.uniform(2.0**15, 2.0**16, (5000, 1))).astype(np.int64)
    expected, too_short, _, _ = checked(vectors)
    kept = ~too_short
    assert np.count_nonzero(kept) > 4000
    for shift in range(1, 7):
        codes, _, _, _ = checked(vectors << shift)
        np.testing.assert_array_equal(codes[kept], expected[kept])


def test_stiff_unit_vectors_stay():
    """Unit vectors of full length, and the axes, stay within a step of their own components."""
    axes = np.vstack([np.eye(3), -np.eye(3)])
    vectors = np.vstack([sphere(np.random.default_rng(4), 10_000), axes])
    codes, too_short, _, _ = checked(np.rint(vectors * FORMAT.max_code).astype(np.int64))
    assert not too_short.any()
    assert np.abs(codes - vectors * ONE).max() <= 2
    assert np.abs(codes[-6:] - axes * ONE).max() <= 1


def test_stiff_words_at_their_ends():
    """All vectors of the ends of the word, 0 and its neighbours are tried. Only those near 0 are flagged."""
    words = [FORMAT.min_code, FORMAT.min_code + 1, -1, 0, 1, FORMAT.max_code]
    vectors = np.stack(np.meshgrid(*[words] * 3), axis=-1).reshape(-1, 3)
    codes, too_short, _, _ = checked(vectors)
    np.testing.assert_array_equal(too_short, np.abs(vectors).max(axis=1) <= 1)
    # At the end of a word no component of a unit vector has changed its sign.
    large = (np.abs(vectors) > 1) & ~too_short[:, np.newaxis]
    np.testing.assert_array_equal(np.sign(codes[large]), np.sign(vectors[large]))


def test_refuses():
    with pytest.raises(ValueError, match=r"^operand must be SQ\(1, 22\), not SQ\(1, 17\)$"):
        UNIT.compute(Fixed(COMPONENT, np.zeros((1, 3), int)))
