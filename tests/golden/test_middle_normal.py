"""Middle normal twin against the exact function of the same codes."""

import numpy as np
import pytest

from golden.fixed import Fixed
from golden.geometry import normalise
from golden.middle_normal import MAX_SPAN_ANGLE, MiddleNormal
from golden.polynomials import half_angle_factor
from golden.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise

UNIT = MiddleNormal()


def compute(left, right):
    return UNIT.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))


def exact(left, right):
    """``(N_l + N_r) / sqrt(2 (1 + r))`` of unit vectors of length ``ONE / 2^17``, in float64."""
    r = np.einsum("ij,ij->i", left, right) / ONE**2
    return (left + right) / np.sqrt(2 * (1 + r))[:, np.newaxis] / 2**17


def largest(left, right):
    middle, wide = compute(left, right)
    assert not wide.any()
    return np.abs(middle.values - exact(left, right)).max()


def test_error_at_every_angle():
    """Exhaustive in the cosine: one end on an axis, its component of the other at every code."""
    cosine = np.arange(int(ONE * np.cos(np.radians(MAX_SPAN_ANGLE))) + 1, ONE + 1)
    sine = np.sqrt(1 - (cosine / ONE) ** 2)
    worst = 0
    for turn in np.radians([0, 20, 45, 90, 160, 250]):
        right = np.column_stack([cosine, np.rint(ONE * sine[:, np.newaxis] * [np.cos(turn), np.sin(turn)])])
        right = right.astype(np.int64)
        left = np.broadcast_to([ONE, 0, 0], right.shape)
        for sign in (1, -1):
            worst = max(worst, largest(sign * left, sign * right), largest(sign * right, sign * left))
    assert MiddleNormal.ERROR / 4 < worst <= MiddleNormal.ERROR


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 20, 45, None])
def test_error_of_spans(angle, normal_pairs):
    """Measured: 0.35 of the bound up to 20 degrees, 0.80 at 45."""
    rng = np.random.default_rng(1)
    angles = rng.uniform(0, 45, 200_000) if angle is None else angle
    left, right = (quantise(normals) for normals in normal_pairs(rng, 200_000, angles))
    worst = largest(left, right)
    assert MiddleNormal.ERROR / 20 < worst <= MiddleNormal.ERROR
    # Half of the span's angle, to the direction that the error of a vector can turn.
    middle = compute(left, right)[0].values
    sine = np.linalg.norm(np.cross(normalise(middle), normalise(left.astype(float))), axis=1)
    half = np.radians(angles) / 2
    # Each end's code is off by a step a component, sqrt(3) steps, and half of it reaches the middle.
    turn = np.sqrt(3) * (MiddleNormal.ERROR + 3 * 2.0**-17)
    np.testing.assert_allclose(np.arcsin(sine), half * np.ones_like(sine), rtol=0, atol=turn)


def test_equal_ends_give_that_normal_exactly():
    """A flat face keeps its normal, also near the axes, where codes are up to half a step short."""
    rng = np.random.default_rng(2)
    everywhere = quantise(normalise(rng.normal(size=(300_000, 3))))
    side = np.arange(-300, 301) / ONE
    near = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    near = quantise(np.column_stack([near, np.sqrt(1 - (near**2).sum(axis=1))]))
    assert np.abs(np.linalg.norm(near, axis=1) - ONE).max() > 0.45
    for normals in (everywhere, near, -near, near[:, ::-1], np.eye(3, dtype=int) * ONE):
        middle, wide = compute(normals, normals)
        np.testing.assert_array_equal(middle.codes, 4 * normals)
        assert not wide.any()


def test_order_of_the_ends_does_not_matter(normal_pairs):
    rng = np.random.default_rng(3)
    left, right = (quantise(n) for n in normal_pairs(rng, 50_000, rng.uniform(0, 180, 50_000)))
    (a, wide_a), (b, wide_b) = compute(left, right), compute(right, left)
    np.testing.assert_array_equal(a.codes, b.codes)
    np.testing.assert_array_equal(wide_a, wide_b)


def test_wide_spans_are_flagged(normal_pairs):
    """Every span over 45.01 degrees, to opposite normals; none up to 45, quantisation or not."""
    rng = np.random.default_rng(4)
    for angle, flag in ((45.0, False), (45.01, True), (60, True), (89.9, True), (90, True), (180, True)):
        left, right = (quantise(normals) for normals in normal_pairs(rng, 50_000, angle))
        middle, wide = compute(left, right)
        assert (wide == flag).all()
        assert UNIT.FORMAT.min_code <= middle.codes.min() <= middle.codes.max() <= UNIT.FORMAT.max_code
    angles = rng.uniform(45.01, 180, 100_000)
    assert compute(*(quantise(normals) for normals in normal_pairs(rng, 100_000, angles)))[1].all()


def test_coefficients():
    """The fit's share of the error is 8.3e-7, and each word keeps its place: no sum wraps to 60 degrees."""
    one = float(ONE_SQUARED.values)
    c1, c2, c3 = UNIT.coefficients.values
    u = np.linspace(0, one * (1 - np.cos(np.radians(45))), 100_001)
    error = np.abs(0.5 + u * (c1 + u * (c2 + u * c3)) - half_angle_factor(u / one))
    assert 8.3e-7 / 2 < error.max() < 8.3e-7
    assert error[0] == 0
    assert 0.25 > c1 + 0.5 * (c2 + 0.5 * c3) > c1 > c2 > c3 > 0
    assert u[-1] * (c1 + u[-1] * (c2 + u[-1] * c3)) < 0.0412


def test_every_code_is_accepted():
    """Vectors that are no unit vectors give some number of the format, and a flag when far apart."""
    ends = [COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1]
    corners = np.stack(np.meshgrid(*[ends] * 6), axis=-1).reshape(-1, 6)
    middle, wide = compute(corners[:, :3], corners[:, 3:])
    assert UNIT.FORMAT.min_code <= middle.codes.min() <= middle.codes.max() <= UNIT.FORMAT.max_code
    dot = (corners[:, :3] * corners[:, 3:]).sum(axis=1) / ONE**2
    np.testing.assert_array_equal(wide, dot < np.cos(np.radians(45)) - 1e-3)


def test_coefficients_are_the_known_words():
    """The fit comes from a solver of another library: a release that finds other words must be noticed."""
    assert MiddleNormal().coefficients.codes.tolist() == [65565, 24018, 13317]
