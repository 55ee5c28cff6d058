"""Bisection: the bit-accurate model against float64, and the published polynomials."""

import re

import numpy as np
import pytest

from blysk.bench.units.normals.bisection import factor_of
from blysk.bench.units.operands import (
    code_pairs_at,
    component_words,
    dot,
    exact_middle,
    pairs_of_length,
    unit_codes,
    word_corners,
)
from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE

VARIANTS = [
    Bisection(degree, max_angle, as_published)
    for degree in (1, 2)
    for max_angle in (45, 90)
    for as_published in (False, True)
]


def bisect(parameters, left, right):
    """Result of the model, and the exact middle of the same two code vectors."""
    return *parameters.compute(*component_words(left, right)), *exact_middle(left, right)


def codes(seed, angles):
    return code_pairs_at(np.random.default_rng(seed), len(angles), angles)


@pytest.mark.parametrize(
    ("parameters", "first_step"),
    [
        (p, first_step)
        for p in VARIANTS
        for first_step in (False, True)
        if p.max_angle == 90 or not first_step
    ],
    ids=str,
)
def test_error_under_its_bound(parameters, first_step):
    low, high = (45.01, 90) if first_step else (0, 44.99)
    rng = np.random.default_rng(3)
    angles = np.r_[rng.uniform(low, high, 40_000), np.full(1000, low), np.full(1000, high)]
    left, right = codes(4, angles)
    # Along an axis both components of a sum are as large as possible.
    left[:20] = [0, 0, ONE]
    right[:20] = left[:20] if not first_step else [0, ONE, 0]
    middle, _, out_of_range, exact, _ = bisect(parameters, left, right)
    assert not out_of_range.any()
    worst = np.abs(middle.values - exact).max()
    bound = parameters.error(first_step)
    assert worst <= bound
    # The bound is not much too large. It takes a component of the sum as 2, and all roundings at their worst.
    assert worst >= bound / 2.5


@pytest.mark.parametrize("parameters", [Bisection(), Bisection(as_published=True)], ids=str)
@pytest.mark.parametrize("first_step", [False, True])
def test_arithmetic_error_under_its_bound(parameters, first_step):
    low, high = (45.01, 90) if first_step else (0, 44.99)
    left, right = codes(5, np.random.default_rng(6).uniform(low, high, 50_000))
    middle, _, _, _, r = bisect(parameters, left, right)
    factor = 0.5 + factor_of(parameters, r, np.full(len(r), first_step))
    same = (left + right) * COMPONENT.step * factor[:, np.newaxis]
    # A factor that is too large makes a component near 1 leave its word.
    same = np.clip(same, -1, ONE * COMPONENT.step)
    worst = np.abs(middle.values - same).max()
    assert parameters.arithmetic_error(first_step) / 3 <= worst <= parameters.arithmetic_error(first_step)


def test_direction_is_exact():
    # Only rounding turns the middle: by at most two roundings of 2^-18 a component.
    left, right = codes(7, np.random.default_rng(8).uniform(0, 90, 50_000))
    for parameters in VARIANTS:
        if parameters.max_angle == 90:
            middle, _, _, exact, _ = bisect(parameters, left, right)
            kept = np.all(np.abs(middle.codes) < ONE, axis=1)
            assert kept.mean() > 0.99
            across = np.linalg.norm(np.cross(middle.values, exact), axis=1)[kept]
            assert across.max() <= np.sqrt(3) * (2.0**-18 + 2.0**-18 * 0.4144 + 2.0**-21)


@pytest.mark.parametrize("degree", [1, 2])
def test_equal_normals_stay(degree):
    axes = np.vstack([np.eye(3), -np.eye(3)]).astype(np.int64) * ONE
    normals = np.vstack([axes, unit_codes(np.random.default_rng(9), 20_000)])
    middle, u, out_of_range = Bisection(degree).compute(*component_words(normals, normals))
    assert not out_of_range.any()
    # The length of a code vector is off by rounding, and the unit corrects it if it can.
    assert np.abs(u.codes).max() <= 2
    assert np.abs(middle.codes - normals).max() <= 1
    np.testing.assert_array_equal(middle.codes[:6], axes)
    assert not u.codes[:6].any()


@pytest.mark.parametrize("parameters", [Bisection(), Bisection(1), Bisection(as_published=True)], ids=str)
@pytest.mark.parametrize("angle", [0, 1e-4, 1, 44.9, 45, 45.1, 89.9, 90])
def test_stiff_angles_within_the_bound(parameters, angle):
    left, right = codes(11, np.full(4000, angle))
    middle, _, out_of_range, exact, _ = bisect(parameters, left, right)
    assert not out_of_range.any()
    # At 45 degrees the rounding of the normals decides which polynomial is taken.
    steps = {angle > 45, angle >= 45}
    assert np.abs(middle.values - exact).max() <= max(parameters.error(step) for step in steps)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("excess", [-1 / 256, 1 / 256])
@pytest.mark.parametrize("angle", [0, 1e-4, 1, 20, 44])
def test_stiff_lengths_of_the_ends(degree, angle, excess):
    """With ends of length 1 +- 1/256 the bound holds, and the middle has half of the length's error.

    u may then be negative, down to -2/256, where the fit is as smooth as the function.
    """
    parameters = Bisection(degree)
    left, right = pairs_of_length(np.random.default_rng(12), 4000, angle, 1 + excess)
    middle, _, out_of_range, exact, _ = bisect(parameters, left, right)
    assert not out_of_range.any()
    assert np.abs(middle.values - np.clip(exact, -1, ONE * COMPONENT.step)).max() <= parameters.error(False)
    # The root has (1 + x)^2 cos(psi/2)^2 in place of cos(psi/2)^2: x / (1 + r) at first order.
    inside = np.all(np.abs(middle.codes) < ONE, axis=1)
    length = np.linalg.norm(middle.codes, axis=1)[inside] / ONE
    expected = 1 + excess / (1 + np.cos(np.radians(angle)))
    slack = excess**2 + np.sqrt(3) * (parameters.error(False) + 2 * COMPONENT.step)
    assert np.abs(length - expected).max() <= slack


def test_stiff_normals_of_length_zero():
    """A normal of length zero counts as one at 90 degrees.

    A unit for 45 degrees flags it, and a unit for 90 degrees scales it by h(0).
    """
    left, zero = unit_codes(np.random.default_rng(13), 2000), np.zeros((2000, 3), dtype=np.int64)
    for a, b in ((left, zero), (zero, left), (zero, zero)):
        assert bisect(Bisection(2, 45), a, b)[2].all()
        middle, u, out_of_range, exact, _ = bisect(Bisection(), a, b)
        assert not out_of_range.any()
        assert np.all(u.codes == Bisection.ONE.codes)
        assert np.abs(middle.values - exact).max() <= Bisection().error(True)


@pytest.mark.parametrize("parameters", VARIANTS, ids=str)
def test_stiff_every_code_without_silent_wrap(parameters):
    """Vectors at the ends of the words are flagged, or have a middle on the side of their sum, of 0.25 to
    0.75 of the sum."""
    left, right = word_corners()
    middle, _, out_of_range = parameters.compute(*component_words(left, right))
    cosine = dot(left, right) / ONE**2
    np.testing.assert_array_equal(out_of_range, cosine < np.cos(np.radians(parameters.max_angle)) - 1e-3)
    total, found = (left + right)[~out_of_range], middle.codes[~out_of_range]
    low, high = np.minimum(0.25 * total, 0.75 * total) - 1, np.maximum(0.25 * total, 0.75 * total) + 1
    low, high = np.minimum(low, COMPONENT.max_code), np.maximum(high, COMPONENT.min_code)
    assert np.all((low <= found) & (found <= high))


def test_published_degree_two_shortens_a_flat_face():
    axis = Fixed(COMPONENT, np.array([[0, 0, ONE]]))
    middle, _, _ = Bisection(as_published=True).compute(axis, axis)
    # 0.499 is in place of 0.5.
    assert middle.codes[0, 2] / ONE == pytest.approx(0.998, abs=2e-5)


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 45, 89.9, 90, 90.01, 120, 180])
@pytest.mark.parametrize("max_angle", [45, 90])
def test_stiff_angles_flag(angle, max_angle):
    left, right = codes(10, np.full(3000, angle))
    *_, out_of_range = Bisection(2, max_angle).compute(*component_words(left, right))
    assert np.all(out_of_range == (angle > max_angle))


@pytest.mark.parametrize(
    ("parameters", "first_step", "error"),
    [
        (Bisection(2), False, "2.5e-05"),
        (Bisection(1), False, "8.3e-04"),
        (Bisection(2), True, "1.1e-04"),
        (Bisection(1, as_published=True), False, "1.1e-03"),
        (Bisection(2, as_published=True), False, "1.0e-03"),
        (Bisection(2, as_published=True), True, "6.2e-04"),
    ],
    ids=str,
)
def test_model_error(parameters, first_step, error):
    assert f"{parameters.model_error(first_step):.1e}" == error


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((3,), "degree must be 1 or 2, not 3"),
        ((2, 60), "max_angle must be 45 or 90, not 60"),
    ],
)
def test_refuses(arguments, text):
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
        Bisection(*arguments)
