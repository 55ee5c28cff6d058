"""Direct renormaliser against float64."""

import numpy as np
import pytest

from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.sim.units.operands import code_pairs_at, component_words, sphere, unit_codes

UNIT = Renormaliser()
TURN = np.sqrt(3) * 2.0**-18
"""Largest sine of the angle by which rounding turns a unit vector."""


def renormalise(vectors):
    """Codes, flags, and the largest error of the length of those that are not flagged."""
    normals, outside = UNIT.compute(*component_words(vectors))
    error = np.abs(np.linalg.norm(normals.codes, axis=-1) / ONE - 1)[~outside].max()
    assert error <= UNIT.ERROR
    np.testing.assert_array_equal(normals.codes[outside], vectors[outside])
    return normals.codes, outside, error


def vectors_of(rng, count, low, high):
    """Codes of vectors of lengths in a range."""
    vectors = sphere(rng, count) * rng.uniform(low, high, (count, 1))
    return np.clip(np.floor(vectors * ONE + 0.5), COMPONENT.min_code, COMPONENT.max_code).astype(np.int64)


def turned(codes, vectors):
    """Length of the cross product with the vectors' directions: the sine of the angle between."""
    vectors = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.linalg.norm(np.cross(codes * COMPONENT.step, vectors), axis=-1)


@pytest.mark.parametrize("low", [0, 2**12 - 1])
def test_correction_of_every_squared_length(low):
    """Each with the lowest and the highest of the bits that are cut."""
    first, last = int(UNIT.LOW * 2**22), int(UNIT.HIGH * 2**22)
    codes = (np.arange(first, last) << 12) + low
    e, outside = UNIT.correction(Fixed(SQ(4, 34), codes))
    assert not outside.any()
    square = np.ldexp(codes.astype(float), -34)
    error = np.sqrt(square) * np.abs(e.values - UNIT.factor(square))
    bound = UNIT.ERROR - TURN
    assert bound / 2 < error.max() <= bound
    beyond = np.array([first - 1, last, 0, -1, -first, 3 << 22, 1 << 23])
    e, outside = UNIT.correction(Fixed(SQ(4, 34), beyond << 12))
    assert outside.all()
    assert not e.codes.any()


def test_fit_alone():
    c0, c1, c2 = (c.values[:, np.newaxis] for c in UNIT.coefficients)
    u = np.linspace(0, 1 / 32, 2001)
    square = UNIT.LOW + np.arange(UNIT.SEGMENTS)[:, np.newaxis] / 32 + u
    error = np.abs(c0 - u * (c1 - u * c2) - UNIT.factor(square)) * np.sqrt(square)
    # A quadratic over a width w is off by w^3/192 |f'''| at best; rounding c0 adds up to half its step.
    best = (1 / 32) ** 3 / 192 * 15 / 8 * square.mean(axis=1) ** -3.5 * np.sqrt(square.mean(axis=1))
    assert best.max() < error.max() <= UNIT.FIT
    assert np.all(error.max(axis=1) <= 1.2 * best + 2.0**-20)


@pytest.mark.parametrize("rounds", [1, pytest.param(100, marks=pytest.mark.long)])
def test_length_of_random_vectors(rounds):
    rng = np.random.default_rng(rounds)
    for _ in range(rounds):
        vectors = vectors_of(rng, 100_000, 0.6849, 1.0154)
        codes, outside, error = renormalise(vectors)
        assert not outside.any()
        assert UNIT.ERROR / 2 < error <= UNIT.ERROR < 2.0**-15.5
        assert turned(codes, vectors).max() <= TURN * 1.0001


@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 89.9, 90])
@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_angles_and_lengths_of_spans(degrees, length):
    left, right = code_pairs_at(np.random.default_rng(2), 3 if length == 4095 else 200, degrees)
    t = (np.arange(length) / max(length - 1, 1))[:, np.newaxis, np.newaxis]
    exact = (1 - t) * left + t * right
    codes, outside, _ = renormalise(np.floor(exact + 0.5).astype(np.int64))
    assert not outside.any()
    # The interpolated vector's own rounding turns it, too, the more the shorter it is.
    assert turned(codes, exact).max() <= TURN * (1.0001 + 1 / 0.7)


@pytest.mark.parametrize("degrees", [100, 179.9, 180])
def test_stiff_wide_spans_are_flagged_in_the_middle(degrees):
    t = np.linspace(0, 1, 33)[:, np.newaxis, np.newaxis]
    left, right = code_pairs_at(np.random.default_rng(3), 50, degrees)
    _, outside, _ = renormalise(np.floor((1 - t) * left + t * right + 0.5).astype(np.int64))
    assert outside[16].all()
    assert not outside[[0, -1]].any()


def test_stiff_unit_vectors_stay():
    axes = ONE * np.vstack([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    vectors = np.vstack([unit_codes(np.random.default_rng(4), 10_000), axes])
    codes, outside, _ = renormalise(vectors)
    assert not outside.any()
    assert np.abs(codes - vectors).max() <= 1


@pytest.mark.parametrize("length", [1 - 1 / 256, 1 + 1 / 256])
def test_stiff_lengths_off_by_a_256th(length):
    vectors = vectors_of(np.random.default_rng(5), 10_000, length, length)
    # Components over 1 have no code.
    assert not renormalise(vectors[np.abs(vectors).max(axis=1) < 0.99 * ONE])[1].any()


def test_stiff_words_at_their_ends():
    low, high = COMPONENT.min_code, COMPONENT.max_code
    corners = [[0, 0, 0], [low, 0, 0], [low, low, low], [high, high, high], [1, -1, 0], [high, 1, 1]]
    _, outside, _ = renormalise(np.array(corners))
    assert outside.tolist() == [True, False, True, True, True, False]


def test_refuses():
    message = r"^operands must be SQ\(1, 17\) and SQ\(1, 17\), not SQ\(2, 16\) and"
    with pytest.raises(ValueError, match=message):
        UNIT.compute(Fixed(SQ(2, 16), np.zeros((1, 3), int)))
