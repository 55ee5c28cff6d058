"""G/P/Q unit: the bit-accurate model is exact, and its words have the stated ranges."""

import numpy as np
import pytest

from blysk.bench.units.operands import code_pairs_at, component_words, pairs_of_length
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE


def middle_of(left, right):
    return MiddleNormal().compute(*component_words(left, right))[0].codes


def compute(left, middle, right):
    left, right = component_words(left, right)
    return GPQ().compute(left, Fixed(MiddleNormal.FORMAT, middle), right)


def assert_through_three_points(ends):
    """Check in integers: N(0) = Q, 4 N(1/2) = G + 2 P + 4 Q, N(1) = G + P + Q."""
    left, right = ends
    middle = middle_of(*ends)
    g, p, q = (coefficient.codes for coefficient in compute(left, middle, right))
    np.testing.assert_array_equal(q, left)
    np.testing.assert_array_equal(g + p + q, right)
    np.testing.assert_array_equal(g + 2 * p + 4 * q, middle)  # 19 fraction bits: a quarter of a step each


def test_curve_passes_through_the_three_normals_exactly():
    rng = np.random.default_rng(1)
    assert_through_three_points(code_pairs_at(rng, 100_000, rng.uniform(0, 45, 100_000)))


@pytest.mark.parametrize("length", [0, 1 - 1 / 256, 1 + 1 / 256])
def test_stiff_lengths_of_the_ends(length):
    """The curve passes through its three points whatever their lengths, because it is linear in them."""
    rng = np.random.default_rng(5)
    assert_through_three_points(pairs_of_length(rng, 20_000, rng.uniform(0, 44, 20_000), length))


def test_ranges_up_to_45_degrees():
    """|G| = 4 (1 - cos(psi/2)) and |P| are at their largest, each along a component. Neither saturates."""
    psi = np.radians(45)
    half = np.array([np.cos(psi / 2), np.sin(psi / 2)])
    largest_g = 4 * (1 - np.cos(psi / 2))
    largest_p = np.linalg.norm(4 * half - [np.cos(psi), np.sin(psi)] - [3, 0])
    assert largest_g == pytest.approx(0.305, abs=1e-3)
    assert largest_p == pytest.approx(0.83, abs=1e-2)
    left, right = code_pairs_at(np.random.default_rng(2), 100_000, 45.0)
    g, p, _ = compute(left, middle_of(left, right), right)
    # The error of 4 N_c is added, and half a step for the length of each end.
    slack = 4 * MiddleNormal.ERROR + 5 * 2.0**-17
    assert 0.99 * largest_g < np.abs(g.values).max() < largest_g + slack
    assert 0.99 * largest_p < np.abs(p.values).max() < largest_p + slack


def whole(left, middle, right):
    """G and P in steps of 2^-17, in which 4 N_c is the code of N_c."""
    return 2 * left + 2 * right - middle, middle - right - 3 * left


def test_stiff_every_code_saturates_and_never_wraps():
    """Every combination of ends of the words is compared with integers that are clipped to the format."""
    ends = [COMPONENT.min_code, -ONE, 0, ONE]
    middles = [MiddleNormal.FORMAT.min_code, 0, MiddleNormal.FORMAT.max_code]
    grid = np.stack(np.meshgrid(ends, middles, ends), axis=-1).reshape(-1, 3)
    operands = [np.repeat(grid[:, [k]], 3, axis=1) for k in range(3)]
    for result, exact in zip(compute(*operands), whole(*operands), strict=False):
        low, high = result.format.min_code, result.format.max_code
        assert exact.min() < low
        assert exact.max() > high
        np.testing.assert_array_equal(result.codes, np.clip(exact, low, high))


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 45, 89.9, 90, 90.01, 120, 180])
def test_stiff_angles(angle):
    """Up to 45 degrees the unit is exact.

    A wider span, whose middle is flagged and saturated, gives clipped integers.
    """
    left, right = code_pairs_at(np.random.default_rng(4), 20_000, angle)
    middle = middle_of(left, right)
    g, p, q = (coefficient.codes for coefficient in compute(left, middle, right))
    whole_g, whole_p = whole(left, middle, right)
    if angle > 45:
        # Up to 45 degrees no span saturates; at 180 degrees most do.
        assert angle < 180 or (p != whole_p).any(axis=1).mean() > 0.5
        whole_g, whole_p = np.clip(whole_g, -(2**16), 2**16 - 1), np.clip(whole_p, -(2**17), 2**17 - 1)
    np.testing.assert_array_equal(g, whole_g)
    np.testing.assert_array_equal(p, whole_p)
    np.testing.assert_array_equal(q, left)
    assert angle > 0 or not (g.any() or p.any())


def test_other_operands_are_refused():
    end, middle = Fixed(COMPONENT, [0, 0, ONE]), Fixed(MiddleNormal.FORMAT, [0, 0, ONE])
    message = r"^operands must be SQ\(1, 17\), SQ\(1, 19\), SQ\(1, 17\), not "
    for operands in ((middle, middle, end), (end, end, end), (end, middle, middle)):
        with pytest.raises(ValueError, match=message):
            GPQ().compute(*operands)
