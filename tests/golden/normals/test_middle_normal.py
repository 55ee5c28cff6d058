"""Middle normal: the bit-accurate model against the exact function of the same codes."""

import re

import numpy as np
import pytest

from blysk.bench.units.operands import (
    code_pairs_at,
    component_words,
    dot,
    exact_middle,
    pairs_of_length,
    unit_codes,
    word_corners,
)
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MIDDLE_NORMAL_FITS, MiddleNormal
from blysk.golden.number.polynomials import half_angle_factor, minimax
from blysk.golden.number.unit_vector import ONE, ONE_SQUARED, quantise
from blysk.golden.reference.geometry import normalise

UNIT = MiddleNormal()
ONE_VALUE = float(ONE_SQUARED.values)


def compute(left, right, unit=UNIT):
    return unit.compute(*component_words(left, right))


def largest(left, right, unit=UNIT):
    """Largest error of spans, none of which is out of range."""
    middle, out_of_range = compute(left, right, unit)
    assert not out_of_range.any()
    return np.abs(middle.values - exact_middle(left, right)[0]).max()


def test_error_at_every_angle():
    """Exhaustion of the cosine: one end is on an axis, and the other end has every code along this axis."""
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
def test_stiff_angles_within_the_bound(angle):
    """Measured: 0.35 of the bound up to 20 degrees, 0.80 at 45 degrees."""
    rng = np.random.default_rng(1)
    angles = rng.uniform(0, 45, 50_000) if angle is None else angle
    left, right = code_pairs_at(rng, 50_000, angles)
    worst = largest(left, right)
    assert MiddleNormal.ERROR / 20 < worst <= MiddleNormal.ERROR
    # Half of the span's angle, relative to the direction in which the error of a vector turns it.
    middle = compute(left, right)[0].values
    sine = np.linalg.norm(np.cross(normalise(middle), normalise(left.astype(float))), axis=1)
    half = np.radians(angles) / 2
    # Each end's code is off by a step a component, sqrt(3) steps, and half of this reaches the middle.
    turn = np.sqrt(3) * (MiddleNormal.ERROR + 3 * 2.0**-17)
    np.testing.assert_allclose(np.arcsin(sine), half * np.ones_like(sine), rtol=0, atol=turn)


def test_equal_ends_give_that_normal_exactly():
    """A flat face keeps its normal, also near the axes, where codes are up to half a step too short."""
    everywhere = unit_codes(np.random.default_rng(2), 100_000)
    side = np.arange(-300, 301) / ONE
    near = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    near = quantise(np.column_stack([near, np.sqrt(1 - (near**2).sum(axis=1))]))
    assert np.abs(np.linalg.norm(near, axis=1) - ONE).max() > 0.45
    for normals in (everywhere, near, -near, near[:, ::-1], np.eye(3, dtype=int) * ONE):
        middle, out_of_range = compute(normals, normals)
        np.testing.assert_array_equal(middle.codes, 4 * normals)
        assert not out_of_range.any()


def test_order_of_the_ends_does_not_matter():
    rng = np.random.default_rng(3)
    left, right = code_pairs_at(rng, 50_000, rng.uniform(0, 180, 50_000))
    (a, flags_a), (b, flags_b) = compute(left, right), compute(right, left)
    np.testing.assert_array_equal(a.codes, b.codes)
    np.testing.assert_array_equal(flags_a, flags_b)


@pytest.mark.parametrize("angle", [45.0, 45.01, 60, 89.9, 90, 180, None])
def test_stiff_angles_beyond_are_flagged(angle):
    """Every span over 45.01 degrees is flagged, up to opposite normals.

    No span up to 45 degrees is flagged, with or without quantisation.
    """
    rng = np.random.default_rng(4)
    angles = rng.uniform(45.01, 180, 50_000) if angle is None else angle
    middle, out_of_range = compute(*code_pairs_at(rng, 50_000, angles))
    assert (out_of_range == (angle != 45.0)).all()
    assert UNIT.FORMAT.min_code <= middle.codes.min() <= middle.codes.max() <= UNIT.FORMAT.max_code


def test_coefficients():
    """The fit's share of the error is 8.3e-7. The words are wide enough: no sum wraps up to 60 degrees."""
    c1, c2, c3 = UNIT.coefficients.values
    u = np.linspace(0, ONE_VALUE * (1 - np.cos(np.radians(45))), 100_001)
    error = np.abs(0.5 + u * (c1 + u * (c2 + u * c3)) - half_angle_factor(u / ONE_VALUE))
    assert 8.3e-7 / 2 < error.max() < 8.3e-7
    assert error[0] == 0
    assert 0.25 > c1 + 0.5 * (c2 + 0.5 * c3) > c1 > c2 > c3 > 0
    assert u[-1] * (c1 + u[-1] * (c2 + u[-1] * c3)) < 0.0412
    # The fit comes from a solver of another library. This notices a release that finds other words.
    assert UNIT.coefficients.codes.tolist() == [65565, 24018, 13317]


def test_stiff_every_code_is_accepted():
    """Vectors that are no unit vectors give some number of the format, and a flag if they are far apart."""
    left, right = word_corners()
    middle, out_of_range = compute(left, right)
    assert UNIT.FORMAT.min_code <= middle.codes.min() <= middle.codes.max() <= UNIT.FORMAT.max_code
    np.testing.assert_array_equal(out_of_range, dot(left, right) / ONE**2 < np.cos(np.radians(45)) - 1e-3)


@pytest.mark.parametrize("excess", [-1 / 256, 1 / 256])
@pytest.mark.parametrize("angle", [0, 1e-4, 1, 20, 44])
def test_stiff_lengths_of_the_ends(angle, excess):
    """Ends of length 1 +- 1/256 are not flagged, and the middle is not further off than the ends.

    The exact function halves an error of the length. If both ends are so long that u would be negative, u is
    0. The middle is then the half sum: as long as the ends at angle 0, and shorter at any other angle.
    """
    left, right = pairs_of_length(np.random.default_rng(5), 20_000, angle, 1 + excess)
    middle, out_of_range = compute(left, right)
    assert not out_of_range.any()
    r = dot(left, right) / ONE**2
    exact = (left + right) / np.sqrt(2 * (1 + np.minimum(r, 1)))[:, np.newaxis] / 2**17
    # A middle longer than 1 saturates along an axis.
    assert np.abs(middle.values - np.clip(exact, -1, 1)).max() <= MiddleNormal.ERROR
    length = np.linalg.norm(middle.values, axis=1) * 2**17 / ONE
    low, high = sorted((1.0, 1 + excess))
    slack = 3 * 2.0**-17 + np.sqrt(3) * MiddleNormal.ERROR
    assert low - slack <= length.min() <= length.max() <= high + slack


def test_stiff_normals_of_length_zero():
    """An end of length zero has no angle: its dot product is 0, as at 90 degrees, and the span is flagged."""
    left = unit_codes(np.random.default_rng(6), 1000)
    zero = np.zeros_like(left)
    for ends in ((left, zero), (zero, left), (zero, zero)):
        assert compute(*ends)[1].all()
    assert not compute(zero, zero)[0].codes.any()


@pytest.mark.parametrize(
    ("fit", "error", "relative"),
    [
        ("exact", "8.2e-07", "0.0002"),
        ("as_published", "4.9e-04", "0.0931"),
        ("minimax_2", "1.9e-03", "0.3834"),
        ("minimax_3", "2.9e-04", "0.0576"),
    ],
)
def test_model_error_of_every_fit(fit, error, relative):
    unit = MiddleNormal(fit)
    assert f"{unit.model_error:.1e}" == error
    u = np.linspace(0, 1 - np.cos(np.radians(MAX_SPAN_ANGLE)), 20_001)
    coefficients = np.r_[unit.constant.values, unit.coefficients.values]
    e = np.polynomial.polynomial.polyval(u * ONE_VALUE, coefficients)
    assert f"{100 * np.abs((0.5 + e) / half_angle_factor(u) - 1).max():.4f}" == relative
    # The range of the words.
    assert unit.factor_format.min_code <= e.min() * 2**21
    assert e.max() < 0.0432


def test_published_polynomials():
    """The unit's words are the polynomials that `tests/golden/number/test_polynomials.py` checks, in u."""

    def h(r):
        return half_angle_factor(1 - r)

    r = np.linspace(0, 1, 1001)
    for fit, coefficients in (
        ("as_published", [0.707, -0.341, 0.193, -0.059]),
        ("minimax_2", minimax(h, 0, 1, 2)),
        ("minimax_3", minimax(h, 0, 1, 3)),
    ):
        unit = MiddleNormal(fit)
        words = np.r_[0.5 + unit.constant.values, unit.coefficients.values] * ONE_VALUE ** np.arange(4)
        ours = np.polynomial.polynomial.polyval(1 - r, words)
        # Each coefficient is rounded to half a step. The linear programme finds each to 2e-7.
        assert np.abs(ours - np.polynomial.polynomial.polyval(r, coefficients)).max() < 4 * 2.0**-20 + 1e-6


@pytest.mark.parametrize("fit", MIDDLE_NORMAL_FITS)
def test_error_of_every_fit(fit):
    unit, rng = MiddleNormal(fit), np.random.default_rng(7)
    angles = np.r_[rng.uniform(0, 45, 50_000), np.zeros(5_000), np.full(5_000, 45)]
    left, right = code_pairs_at(rng, len(angles), angles)
    # Along an axis a component of the sum is as large as possible.
    left[:100, :] = right[:100, :] = [0, -ONE, 0]
    assert unit.error / 3 < largest(left, right, unit) <= unit.error
    assert fit != "exact" or unit.error <= MiddleNormal.ERROR


@pytest.mark.parametrize(
    ("fit", "change"), [("exact", 0), ("as_published", 0), ("minimax_2", 3.83e-3), ("minimax_3", -5.76e-4)]
)
def test_flat_faces_feel_the_plain_fit(fit, change):
    """The default and the published polynomial keep a normal. The plain cubic makes it 0.06 % too short."""
    normals = unit_codes(np.random.default_rng(8), 20_000)
    middle, _ = compute(normals, normals, MiddleNormal(fit))
    if not change:
        np.testing.assert_array_equal(middle.codes, 4 * normals)
    # A component that a fit makes longer than 1 saturates there.
    inside = np.abs(middle.codes).max(axis=1) < MiddleNormal.FORMAT.max_code
    ratio = (np.linalg.norm(middle.codes, axis=1) / np.linalg.norm(4 * normals, axis=1))[inside]
    np.testing.assert_allclose(ratio - 1, change, rtol=0, atol=1.1e-5)


def test_refuses_another_fit():
    text = "fit must be one of exact, as_published, minimax_2, minimax_3, not 'printed'"
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
        MiddleNormal("printed")
