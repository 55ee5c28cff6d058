"""Chord unit: half the squared distance of two vectors, against exact integers and float64."""

import numpy as np
import pytest

from blysk.bench.units.operands import code_pairs_at, component_words, pairs_at, word_ends
from blysk.golden.cosines.chord import Chord
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED


def compute(a, b):
    return Chord().compute(*component_words(a, b))


def exact(a, b):
    """``|a - b|^2 / 2`` in codes of 35 fraction bits, as the exact sum of squared differences."""
    return ((a - b) ** 2).sum(axis=-1)


@pytest.fixture(scope="module")
def pairs():
    """Pairs of unit vectors at every angle, of any vectors, and of vectors at the ends of the word."""
    rng = np.random.default_rng(1)
    angles = np.r_[np.zeros(100), 10.0 ** rng.uniform(-5, 0, 20_000), rng.uniform(0, 180, 60_000), 180.0]
    anything = rng.integers(COMPONENT.min_code, COMPONENT.max_code, (2, 20_000, 3), endpoint=True)
    units = np.stack(code_pairs_at(rng, len(angles), angles))
    return np.concatenate([units, anything, word_ends(rng, 2, 5_000, 3)], axis=1)


def is_near(a, b):
    """Whether every component of the difference fits 18 bits."""
    return np.all((a - b >= COMPONENT.min_code) & (a - b <= COMPONENT.max_code), axis=-1)


def test_exact_where_no_component_reaches_one(pairs):
    near = is_near(*pairs)
    assert 40_000 < np.count_nonzero(near) < 90_000
    assert np.array_equal(compute(*pairs).codes[near], exact(*pairs)[near])
    # ``u < 1/2`` is a distance under 1.
    assert near[exact(*pairs) < 1 << 34].all()


def test_error_of_halving(pairs):
    """The bound is ``sqrt(3) 2^-17 |a - b| + 3 * 2^-35``.

    Cut bits make u smaller, or larger if a difference is negative.
    """
    far = ~is_near(*pairs)
    squares = exact(*pairs)[far]
    whole = np.minimum(squares, Chord.FORMAT.max_code).astype(float)
    error = np.abs(compute(*pairs).codes[far] - whole) * Chord.FORMAT.step
    distance = np.sqrt(squares * 2.0**-34)
    assert np.all(error <= np.sqrt(3) * 2.0**-17 * distance + 3 * 2.0**-35)
    assert 1e-5 < error[distance <= 2].max() <= 2.7e-5


@pytest.mark.parametrize("difference", [2**17 - 1, 2**17, 2**17 + 1, 2**18 - 2])
def test_border_of_halving(difference):
    """The border is the largest difference that fits 18 bits.

    It is tried with its neighbours and both signs.
    """
    a, b = np.array([[ONE, 0, 0]]), np.array([[ONE - difference, 0, 0]])
    assert compute(a, b).codes[0] == (difference & ~1 if difference > ONE else difference) ** 2
    low = difference if difference <= 2**17 else difference + 1 & ~1
    assert compute(b, a).codes[0] == low**2


def test_extremes_saturate():
    """Opposite corners of the cube have a squared distance of 12, so u is 6. The word ends at 4."""
    corner = np.full((1, 3), COMPONENT.min_code)
    assert compute(corner, -corner - 1).codes[0] == Chord.FORMAT.max_code


@pytest.mark.parametrize("stretch", [-1 / 256, -1e-4, 0.0, 1e-4, 1 / 256])
def test_length_is_felt_at_second_order(stretch):
    """A length error e gives ``e^2/2 + e u``, while the dot product is off by e.

    Rounding moves each vector by up to half a diagonal of its grid.
    """
    rng = np.random.default_rng(4)
    angles = rng.uniform(0, 60, 20_000)
    left, right = pairs_at(rng, len(angles), angles)
    shorter = 0.99
    codes = [np.rint(v * shorter * ONE).astype(np.int64) for v in (left * (1 + stretch), right)]
    one = float(ONE_SQUARED.values) * shorter**2
    u = 1 - np.cos(np.radians(angles))
    error = np.abs(compute(*codes).values / one - u)
    distance = np.sqrt(2 * (u + stretch**2 / 2 + abs(stretch) * u))
    moved = np.sqrt(3) * 2.0**-17
    rounding = (distance * moved + moved**2 / 2) / one
    halving = np.where(u > 0.48, 2.7e-5, 0)
    assert np.all(error <= stretch**2 / 2 + abs(stretch) * u + rounding + halving + 1e-12)
    assert error[u < 1e-3].max() <= stretch**2 / 2 + 1e-3 * abs(stretch) + 1e-6


def test_operand_is_cut(pairs):
    operand = Chord().operand(*component_words(*pairs))
    assert operand.format == Chord.ARGUMENT_FORMAT
    expected = np.minimum(compute(*pairs).codes >> 10, Chord.ARGUMENT_FORMAT.max_code)
    assert expected.max() == Chord.ARGUMENT_FORMAT.max_code
    np.testing.assert_array_equal(operand.codes, expected)


def test_refuses_another_format():
    right, wrong = Fixed(COMPONENT, np.zeros((1, 3), int)), Fixed(SQ(2, 16), np.zeros((1, 3), int))
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 17\), not SQ\(1, 17\), SQ\(2, 16\)$"):
        Chord().compute(right, wrong)
