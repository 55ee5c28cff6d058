"""G/P/Q twin: exact, and the ranges that its words were made for."""

import numpy as np
import pytest

from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise

MIDDLE = MiddleNormal()


def compute(left, middle, right):
    return GPQ().compute(Fixed(COMPONENT, left), Fixed(MiddleNormal.FORMAT, middle), Fixed(COMPONENT, right))


def spans(rng, count, angle, normal_pairs):
    left, right = (quantise(normals) for normals in normal_pairs(rng, count, angle))
    return left, MIDDLE.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))[0].codes, right


def test_curve_passes_through_the_three_normals_exactly(normal_pairs):
    """In integers: N(0) = Q, 4 N(1/2) = G + 2 P + 4 Q, N(1) = G + P + Q."""
    rng = np.random.default_rng(1)
    left, middle, right = spans(rng, 300_000, rng.uniform(0, 45, 300_000), normal_pairs)
    g, p, q = (coefficient.codes for coefficient in compute(left, middle, right))
    np.testing.assert_array_equal(q, left)
    np.testing.assert_array_equal(g + p + q, right)
    np.testing.assert_array_equal(g + 2 * p + 4 * q, middle)  # 19 fraction bits: a quarter of a step each


def test_ranges_up_to_45_degrees(normal_pairs):
    """|G| = 4 (1 - cos(psi/2)) and |P| at its largest, each along a component; never saturated."""
    rng = np.random.default_rng(2)
    psi = np.radians(45)
    half = np.array([np.cos(psi / 2), np.sin(psi / 2)])
    along = 4 * half - [np.cos(psi), np.sin(psi)] - [3, 0]
    largest_g, largest_p = 4 * (1 - np.cos(psi / 2)), np.linalg.norm(along)
    assert largest_g == pytest.approx(0.305, abs=1e-3)
    assert largest_p == pytest.approx(0.83, abs=1e-2)
    left, middle, right = spans(rng, 300_000, 45.0, normal_pairs)
    g, p, _ = compute(left, middle, right)
    # 4 N_c with its error, and half a step more for the length of each end.
    slack = 4 * MiddleNormal.ERROR + 5 * 2.0**-17
    assert 0.99 * largest_g < np.abs(g.values).max() < largest_g + slack
    assert 0.99 * largest_p < np.abs(p.values).max() < largest_p + slack


def test_flat_spans_give_zero(normal_pairs):
    rng = np.random.default_rng(3)
    left, middle, right = spans(rng, 100_000, 0.0, normal_pairs)
    g, p, q = compute(left, middle, right)
    np.testing.assert_array_equal(left, right)
    assert not g.codes.any()
    assert not p.codes.any()
    np.testing.assert_array_equal(q.codes, left)


def test_stiff_every_code_saturates_and_never_wraps():
    """Every end of every word, against integers clipped to the format."""
    ends = [COMPONENT.min_code, -ONE, 0, ONE]
    middles = [MiddleNormal.FORMAT.min_code, 0, MiddleNormal.FORMAT.max_code]
    grid = np.stack(np.meshgrid(ends, middles, ends), axis=-1).reshape(-1, 3)
    left, middle, right = (np.repeat(grid[:, [k]], 3, axis=1) for k in range(3))
    g, p, _ = compute(left, middle, right)
    # In steps of 2^-17, 4 N_c is the code of N_c.
    for result, whole in ((g, 2 * left + 2 * right - middle), (p, middle - right - 3 * left)):
        low, high = result.format.min_code, result.format.max_code
        assert whole.min() < low
        assert whole.max() > high
        np.testing.assert_array_equal(result.codes, np.clip(whole, low, high))


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 45, 89.9, 90, 90.01, 120, 180])
def test_stiff_angles(normal_pairs, angle):
    """Exact up to 45 degrees; a wider span, whose middle is flagged and saturated, gives clipped integers."""
    left, middle, right = spans(np.random.default_rng(4), 20_000, angle, normal_pairs)
    g, p, q = (coefficient.codes for coefficient in compute(left, middle, right))
    whole_g, whole_p = 2 * left + 2 * right - middle, middle - right - 3 * left
    if angle > 45:
        np.testing.assert_array_equal(g, np.clip(whole_g, -(2**16), 2**16 - 1))
        np.testing.assert_array_equal(p, np.clip(whole_p, -(2**17), 2**17 - 1))
        # No span gets that far up to 45 degrees; at 180 most do.
        assert angle < 180 or (p != whole_p).any(axis=1).mean() > 0.5
    else:
        np.testing.assert_array_equal(g, whole_g)
        np.testing.assert_array_equal(p, whole_p)
    np.testing.assert_array_equal(q, left)


@pytest.mark.parametrize("length", [0, 1 - 1 / 256, 1 + 1 / 256])
def test_stiff_lengths_of_the_ends(normal_pairs, length):
    """The curve passes through its three points whatever their lengths: it is linear in them."""
    rng = np.random.default_rng(5)
    left, right = (n * length * ONE for n in normal_pairs(rng, 20_000, rng.uniform(0, 44, 20_000)))
    left, right = (np.clip(np.rint(n), -ONE, ONE).astype(np.int64) for n in (left, right))
    middle = MIDDLE.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))[0].codes
    g, p, q = (coefficient.codes for coefficient in compute(left, middle, right))
    np.testing.assert_array_equal(g + p + q, right)
    np.testing.assert_array_equal(g + 2 * p + 4 * q, middle)


def test_other_operands_are_refused():
    end, middle = Fixed(COMPONENT, [0, 0, ONE]), Fixed(MiddleNormal.FORMAT, [0, 0, ONE])
    for operands in ((middle, middle, end), (end, end, end), (end, middle, middle)):
        with pytest.raises(
            ValueError, match=r"^operands must be SQ\(1, 17\), SQ\(1, 19\), SQ\(1, 17\), not "
        ):
            GPQ().compute(*operands)
