"""Codes of unit vectors against float64."""

import numpy as np
import pytest

from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise, values
from blysk.golden.reference.geometry import normalise

# Go from the nearest corner of the cell to the farthest corner, one component at a time. The length passes 1
# in moves of at most one step. So the nearest corner on the way is off by at most half a step. The length of
# a move is convex, which adds less than 1/ONE of it.
LENGTH_BOUND = 0.5 * (1 + 1 / ONE)


def random_vectors(count, seed):
    return normalise(np.random.default_rng(seed).normal(size=(count, 3)))


def near_axes(count, seed):
    """Vectors near the axes.

    If one component makes nearly all of the length, the grid of lengths is coarsest.
    """
    rng = np.random.default_rng(seed)
    vectors = np.column_stack([np.ones(count), rng.uniform(-0.004, 0.004, (count, 2))])
    return normalise(rng.permuted(vectors, axis=1) * rng.choice([-1, 1], (count, 1)))


def length_error(codes):
    """Error of the length, in steps."""
    return np.abs(np.sqrt(np.einsum("ij,ij->i", codes, codes).astype(float)) - ONE)


@pytest.mark.parametrize("vectors", [random_vectors(500_000, 1), near_axes(200_000, 2)], ids=["all", "axes"])
def test_component_is_off_by_less_than_a_step_and_length_by_half(vectors):
    codes = quantise(vectors)
    assert codes.dtype == np.int64
    off = np.abs(codes - vectors * ONE)
    assert 0.99 < off.max() < 1
    assert 0.4 < length_error(codes).max() <= LENGTH_BOUND
    assert np.abs(codes).max() <= ONE


def test_length_is_held_closer_than_by_rounding():
    vectors = random_vectors(200_000, 3)
    rounded = np.floor(vectors * ONE + 0.5).astype(np.int64)
    by_length, by_rounding = (np.sqrt(np.mean(length_error(c) ** 2)) for c in (quantise(vectors), rounded))
    assert by_length < by_rounding / 2


def test_axes_are_exact():
    axes = np.vstack([np.eye(3), -np.eye(3)])
    np.testing.assert_array_equal(quantise(axes), np.rint(axes).astype(int) * ONE)


def test_shape_is_kept():
    assert quantise(np.zeros((0, 3))).shape == (0, 3)
    assert quantise(np.array([0.0, 0.6, 0.8])).shape == (3,)
    assert quantise(random_vectors(24, 4).reshape(2, 3, 4, 3)).shape == (2, 3, 4, 3)


@pytest.mark.parametrize(
    "vector", [[0, 0, 0], [0, 0, 1.00001], [0, 0, 0.99999], [0, np.nan, 1], [0, 0, np.inf], [1, 1, 1]]
)
def test_other_lengths_are_refused(vector):
    with pytest.raises(ValueError, match=r"^vectors must have unit length$"):
        quantise(np.array([[1.0, 0, 0], vector], dtype=float))


def test_constants_and_values():
    assert ONE == 2**17 - 1
    assert COMPONENT.code(-1.0) == -(2**17)
    assert ONE_SQUARED.codes == ONE**2
    np.testing.assert_array_equal(values(np.array([-ONE, 0, ONE])), [-1, 0, 1])
    codes = quantise(random_vectors(1000, 5))
    np.testing.assert_array_equal(values(codes) * ONE, codes)
