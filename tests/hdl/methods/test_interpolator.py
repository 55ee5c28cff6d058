# amaranth: UnusedElaboratable=no
"""Products of a normal with the vectors of every light: RTL against exact integers, clock by clock."""

import numpy as np
import pytest

from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.methods.light_products import LightProductsUnit
from blysk.sim.engines.beats import dtype_of


def normals_and_vectors(rng, normal_pairs, lights):
    """Unit normals, some at a light's vectors or opposite; words at their ends; and vectors L and H."""
    vectors = np.stack([quantise(normal_pairs(rng, lights, 0.0)[0]) for _ in range(2)], axis=1)
    # L = V, so that H = L; L = -V, so that there is no H; an axis.
    vectors[0, 1] = vectors[0, 0]
    if lights > 1:
        vectors[1, 1] = 0
    if lights > 2:
        vectors[2] = [[0, 0, ONE], [0, -ONE, 0]]
    normals = quantise(normal_pairs(rng, 2000, 0.0)[0])
    normals[:200] = vectors[rng.integers(0, lights, 200), rng.integers(0, 2, 200)]
    normals[200:300] = -normals[100:200]
    ends = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (400, 3))
    return rng.permutation(np.vstack([normals, ends])), vectors


def expected_of(unit, operand, normals, vectors):
    """Every product by exact integers, shape (beats, lights): the chord cut to 25 bits, and saturated."""
    expected = np.zeros((len(normals), len(vectors)), dtype_of(unit.o.payload.shape().elem_shape))
    expected["cosine"] = normals @ vectors[:, 0].T
    if operand == "cosine":
        expected["highlight"] = normals @ vectors[:, 1].T
        return expected
    format = Specular.ARGUMENT_FORMAT
    difference = normals[:, np.newaxis] - vectors[:, 1]
    # From a difference of 1 on, the chord takes half of each, cut.
    far = ((difference < COMPONENT.min_code) | (difference > COMPONENT.max_code)).any(axis=-1)
    halved = np.square(difference >> 1).sum(axis=-1) << 2
    square = np.where(far, halved, np.square(difference).sum(axis=-1))
    expected["highlight"] = np.minimum(square >> 10, format.max_code)
    return expected


@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
@pytest.mark.parametrize(
    ("lights", "interval"),
    [(1, 1), (2, 3), *(pytest.param(*p, marks=pytest.mark.long) for p in ((2, 1), (5, 1), (1, 3), (2, 12)))],
)
def test_equals_exact_integers(verify, normal_pairs, lights, interval, operand):
    rng = np.random.default_rng(lights)
    normals, vectors = normals_and_vectors(rng, normal_pairs, lights)
    unit = LightProductsUnit(LinearInterpolator(operand=operand), lights, initiation_interval=interval)
    assert cost_of(unit).multiplier_count == 6 * lights // interval
    constants = np.zeros(lights, dtype_of(unit.constants.shape().elem_shape))
    constants["direction"], constants["halfway"] = vectors[:, 0], vectors[:, 1]
    expected = expected_of(unit, operand, normals, vectors)
    # Lights do not stand in for each other.
    assert lights == 1 or (expected["cosine"][:, 0] != expected["cosine"][:, 1]).mean() > 0.9
    verify(unit, normals, expected, constants=constants)


@pytest.mark.parametrize(("operand", "latency"), [("cosine", 7), ("one_minus_cosine", 11)])
def test_timing_and_multipliers(operand, latency):
    for lights in (1, 3):
        unit = LightProductsUnit(LinearInterpolator(operand=operand), lights)
        assert (unit.latency, unit.initiation_interval) == (latency, 1)
        assert cost_of(unit).multipliers == {(18, 18): 6 * lights}


def test_without_highlights(verify, normal_pairs):
    rng = np.random.default_rng(6)
    normals, vectors = normals_and_vectors(rng, normal_pairs, 2)
    unit = LightProductsUnit(LinearInterpolator(), 2, highlights=False)
    constants = np.zeros(2, dtype_of(unit.constants.shape().elem_shape))
    constants["direction"] = vectors[:, 0]
    expected = np.zeros((len(normals), 2), dtype_of(unit.o.payload.shape().elem_shape))
    expected["cosine"] = normals @ vectors[:, 0].T
    verify(unit, normals, expected, constants=constants)
    assert cost_of(unit).multiplier_count == 6


def test_products_are_those_of_vectors():
    """Against float64: cosines are exact, and half a squared chord is 1 - N.H within its bound."""
    rng = np.random.default_rng(5)
    normals = rng.normal(size=(3000, 3))
    normals = quantise(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    vectors = normals[:6].reshape(3, 2, 3)
    for operand in ("cosine", "one_minus_cosine"):
        unit = LightProductsUnit(LinearInterpolator(operand=operand), 3)
        found = expected_of(unit, operand, normals, vectors)
        cosine, highlight = (
            Fixed(format, found[name]).values
            for name, format in (
                ("cosine", LinearInterpolator.COSINE_FORMAT),
                ("highlight", Specular(operand=operand).operand_format),
            )
        )
        # In units of the code of length 1.
        exact = [ONE_SQUARED.values * (normals / ONE @ vectors[:, k].T / ONE) for k in range(2)]
        assert np.abs(cosine - exact[0]).max() < 1e-15
        if operand == "cosine":
            assert np.abs(highlight - exact[1]).max() < 1e-15
            continue
        # Halving cuts half a step of each difference, counted |N - H| times; the codes' lengths are within
        # half a step of 1; the last cut.
        bound = 2 * np.sqrt(3) * COMPONENT.step + COMPONENT.step + 2.0**-25
        assert bound / 8 < np.abs(highlight - (ONE_SQUARED.values - exact[1])).max() <= bound
