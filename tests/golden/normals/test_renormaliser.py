"""Direct renormaliser against float64."""

import numpy as np
import pytest

from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise

STEP = COMPONENT.step


def lengths(codes):
    return np.sqrt(np.einsum("...i,...i->...", codes, codes)) / ONE


def rounded(vectors):
    codes = np.floor(vectors * ONE + 0.5).astype(np.int64)
    return Fixed(COMPONENT, np.clip(codes, COMPONENT.min_code, COMPONENT.max_code))


def directions(rng, count):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def turned(normals, vectors):
    """Length of the cross product with the vectors' directions: the sine of the angle between."""
    vectors = vectors.astype(float) / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.linalg.norm(np.cross(normals * STEP, vectors), axis=-1)


def test_correction_of_every_squared_length():
    renormaliser = Renormaliser()
    first, last = int(renormaliser.LOW * 2**22), int(renormaliser.HIGH * 2**22)
    cut = np.arange(first, last)
    # Each with the lowest and the highest of the bits that are cut.
    for low in (0, 2**12 - 1):
        codes = (cut << 12) + low
        e, outside = renormaliser.correction(Fixed(SQ(4, 34), codes))
        assert not outside.any()
        square = np.ldexp(codes.astype(float), -34)
        error = np.sqrt(square) * np.abs(e.values - renormaliser.factor(square))
        bound = renormaliser.ERROR - np.sqrt(3) * 2.0**-18
        assert bound / 2 < error.max() <= bound
    beyond = np.array([first - 1, last, 0, -1, -first, 3 << 22, 1 << 23])
    e, outside = renormaliser.correction(Fixed(SQ(4, 34), beyond << 12))
    assert outside.all()
    assert not e.codes.any()


def test_fit_alone():
    renormaliser = Renormaliser()
    c0, c1, c2 = (c.values[:, np.newaxis] for c in renormaliser.coefficients)
    u = np.linspace(0, 1 / 32, 2001)
    square = renormaliser.LOW + np.arange(renormaliser.SEGMENTS)[:, np.newaxis] / 32 + u
    error = np.abs(c0 - u * (c1 - u * c2) - renormaliser.factor(square)) * np.sqrt(square)
    # A quadratic over a width w is off by w^3/192 |f'''| at best; rounding c0 adds up to half its step.
    best = (1 / 32) ** 3 / 192 * 15 / 8 * square.mean(axis=1) ** -3.5 * np.sqrt(square.mean(axis=1))
    assert best.max() < error.max() <= renormaliser.FIT
    assert np.all(error.max(axis=1) <= 1.2 * best + 2.0**-20)


def test_length_of_random_vectors():
    rng = np.random.default_rng(1)
    renormaliser = Renormaliser()
    count = 300_000
    vectors = rounded(directions(rng, count) * rng.uniform(0.6849, 1.0154, (count, 1)))
    normals, outside = renormaliser.compute(vectors)
    assert not outside.any()
    error = np.abs(lengths(normals.codes) - 1)
    assert renormaliser.ERROR / 2 < error.max() <= renormaliser.ERROR < 2.0**-15.5
    assert turned(normals.codes, vectors.codes).max() <= np.sqrt(3) * 2.0**-18 * 1.0001


@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 89.9, 90])
@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_angles_and_lengths_of_spans(normal_pairs, degrees, length):
    rng = np.random.default_rng(2)
    spans = 3 if length == 4095 else 200
    left, right = (quantise(normals) for normals in normal_pairs(rng, spans, degrees))
    t = (np.arange(length) / max(length - 1, 1))[:, np.newaxis, np.newaxis]
    raw = Fixed(COMPONENT, np.floor((1 - t) * left + t * right + 0.5).astype(np.int64))
    normals, outside = Renormaliser().compute(raw)
    assert not outside.any()
    assert np.abs(lengths(normals.codes) - 1).max() <= Renormaliser.ERROR
    exact = (1 - t) * left + t * right
    # The interpolated vector's own rounding turns it, too, the more the shorter it is.
    assert turned(normals.codes, exact).max() <= np.sqrt(3) * 2.0**-18 * (1.0001 + 1 / 0.7)


def test_stiff_wide_spans_are_flagged_in_the_middle(normal_pairs):
    rng = np.random.default_rng(3)
    t = np.linspace(0, 1, 33)[:, np.newaxis, np.newaxis]
    for degrees in (100, 179.9, 180):
        left, right = (quantise(normals) for normals in normal_pairs(rng, 50, degrees))
        raw = Fixed(COMPONENT, np.floor((1 - t) * left + t * right + 0.5).astype(np.int64))
        normals, outside = Renormaliser().compute(raw)
        assert outside[16].all()
        assert not outside[[0, -1]].any()
        np.testing.assert_array_equal(normals.codes[outside], raw.codes[outside])
        assert np.abs(lengths(normals.codes[~outside]) - 1).max() <= Renormaliser.ERROR


def test_stiff_unit_vectors_stay():
    rng = np.random.default_rng(4)
    codes = np.vstack(
        [quantise(directions(rng, 10_000)), ONE * np.eye(3, dtype=int), -ONE * np.eye(3, dtype=int)]
    )
    normals, outside = Renormaliser().compute(Fixed(COMPONENT, codes))
    assert not outside.any()
    assert np.abs(normals.codes - codes).max() <= 1
    # A component at the end of the word.
    assert np.abs(normals.codes[-6:] - codes[-6:]).max() <= 1


def test_stiff_lengths_off_by_a_256th_and_words_at_their_ends():
    rng = np.random.default_rng(5)
    for scale in (1 - 1 / 256, 1 + 1 / 256):
        unit = directions(rng, 10_000)
        # Components over 1 have no code.
        unit = unit[np.abs(unit).max(axis=1) < 0.99]
        normals, outside = Renormaliser().compute(rounded(unit * scale))
        assert not outside.any()
        assert np.abs(lengths(normals.codes) - 1).max() <= Renormaliser.ERROR
    low, high = COMPONENT.min_code, COMPONENT.max_code
    corners = np.array(
        [[0, 0, 0], [low, 0, 0], [low, low, low], [high, high, high], [1, -1, 0], [high, 1, 1]]
    )
    normals, outside = Renormaliser().compute(Fixed(COMPONENT, corners))
    assert outside.tolist() == [True, False, True, True, True, False]
    np.testing.assert_array_equal(normals.codes[outside], corners[outside])
    assert np.abs(lengths(normals.codes[~outside]) - 1).max() <= Renormaliser.ERROR


@pytest.mark.long
def test_length_of_ten_million_random_vectors():
    rng = np.random.default_rng(6)
    for _ in range(20):
        vectors = rounded(directions(rng, 500_000) * rng.uniform(0.6849, 1.0154, (500_000, 1)))
        normals, outside = Renormaliser().compute(vectors)
        assert not outside.any()
        assert np.abs(lengths(normals.codes) - 1).max() <= Renormaliser.ERROR


def test_refusal():
    with pytest.raises(
        ValueError, match=r"^operands must be SQ\(1, 17\) and SQ\(1, 17\), not SQ\(2, 16\) and"
    ):
        Renormaliser().compute(Fixed(SQ(2, 16), np.zeros((1, 3), int)))
