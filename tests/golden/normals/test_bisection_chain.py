"""Chain of bisections: the bit-accurate model against float64."""

import numpy as np
import pytest

from blysk.bench.units.operands import (
    code_pairs_at,
    component_words,
    degrees_between,
    dot,
    pairs_at,
    pairs_of_length,
    unit_codes,
    word_corners,
)
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.reference.curves import interpolate


def weights(psi, level):
    """``L_k`` and ``M_k`` as published."""
    weight_l, weight_m = np.zeros_like(psi), np.ones_like(psi)
    for k in range(1, level + 1):
        weight_l, weight_m = weight_l + weight_m, 2 * weight_m * np.cos(psi / 2**k)
    return weight_l, weight_m


def compute(chain, left, right, level):
    """Normals and flags at one level."""
    return chain.compute(*component_words(left, right), np.full(len(left), level))


def error_of(chain, left, right, level):
    """Normals and their largest error against the closed form. No span is out of range."""
    normal, out_of_range = compute(chain, left, right, level)
    assert not out_of_range.any()
    weight_l, weight_m = weights(np.radians(degrees_between(left, right)), level)
    exact = (weight_l * left + right) / weight_m * COMPONENT.step
    return normal, np.abs(normal.values - exact).max()


@pytest.mark.parametrize("level", [1, 2, 5, 15])
def test_closed_form_is_the_great_circle(level):
    psi = np.random.default_rng(1).uniform(0.01, 90, 500)
    left, right = pairs_at(np.random.default_rng(2), 500, psi)
    weight_l, weight_m = weights(np.radians(psi)[:, np.newaxis], level)
    exact = interpolate("slerp", left, right, np.full(500, 2.0**-level))
    np.testing.assert_allclose((weight_l * left + right) / weight_m, exact, atol=1e-13)


@pytest.mark.parametrize("bisection", [Bisection(), Bisection(1), Bisection(as_published=True)], ids=str)
@pytest.mark.parametrize("first_step", [False, True])
def test_error_under_its_bound(bisection, first_step):
    rng = np.random.default_rng(3)
    low, high = (45.01, 90) if first_step else (0, 44.99)
    angles = np.r_[rng.uniform(low, high, 10_000), np.full(2000, low), np.full(2000, high)]
    ends = code_pairs_at(rng, len(angles), angles)
    chain = BisectionChain(bisection)
    for level in (1, 2, 3, 4, 6, 8, 15):
        _, worst = error_of(chain, *ends, level)
        bound = chain.error(level, first_step)
        assert worst <= bound
        # At higher levels the largest error of the fit and the widest angle of the bound do not belong to the
        # same span.
        assert level > 3 or worst >= bound / 4


@pytest.mark.parametrize(
    ("level", "narrow", "first"),
    [
        (1, "7.2e-05", "2.5e-04"),
        (2, "1.2e-04", "2.9e-04"),
        (4, "1.1e-04", "2.0e-04"),
        (8, "4.5e-05", "5.7e-05"),
        (15, "3.8e-05", "3.9e-05"),
    ],
)
def test_error_as_stated(level, narrow, first):
    chain = BisectionChain()
    assert (f"{chain.error(level, False):.1e}", f"{chain.error(level, True):.1e}") == (narrow, first)


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 45, 89.9, 90, 90.01, 120, 180])
def test_stiff_angles_flag(angle):
    ends = code_pairs_at(np.random.default_rng(5), 1000, angle)
    assert np.all(compute(BisectionChain(), *ends, 3)[1] == (angle > 90))


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 44.9, 45, 45.1, 89.9, 90])
def test_stiff_angles_within_the_bound(angle):
    """No error grows along the chain at any level, because each step halves the error before it."""
    left, right = code_pairs_at(np.random.default_rng(6), 2000, angle)
    chain = BisectionChain()
    for level in range(1, 16):
        normal, worst = error_of(chain, left, right, level)
        # At 45 degrees the rounding of the normals decides which polynomial is taken.
        assert worst <= max(chain.error(level, step) for step in {angle > 45, angle >= 45})
        if angle == 0:
            assert np.abs(normal.codes - left).max() <= 4


@pytest.mark.parametrize("excess", [-1 / 256, 1 / 256])
def test_stiff_lengths_of_the_ends(excess):
    """With ends of length 1 + x, x = +- 1/256, the length of a normal is off by at most |x|.

    The chain takes the angle psi' with ``cos psi' = (1 + x)^2 cos psi``, for which
    ``l^2 + m^2 + 2 l m cos psi'`` is 1. So the squared length is
    ``(1 + x)^2 (1 - 2 l m cos psi (2 x + x^2))``, at first order ``1 + 2 x (1 - 2 l m cos psi)``. Because
    ``l m <= 1 / (2 (1 + cos psi'))``, x/2 to x of the error is left.
    """
    rng, chain = np.random.default_rng(7), BisectionChain()
    ends = pairs_of_length(rng, 4000, rng.uniform(0, 44, 4000), 1 + excess)
    for level in (1, 2, 5, 15):
        slack = np.sqrt(3) * (chain.error(level, False) + COMPONENT.step)
        normal, out_of_range = compute(chain, *ends, level)
        assert not out_of_range.any()
        inside = np.all(np.abs(normal.codes) < ONE, axis=1)
        length = np.linalg.norm(normal.codes[inside], axis=1) / ONE
        assert np.abs(length - 1).max() <= abs(excess) + 2 * excess**2 + slack


def test_stiff_normals_of_length_zero():
    """As in a single bisection, the angle counts as 90 degrees, and a chain for 45 degrees flags it.

    Zeros stay zero.
    """
    left = unit_codes(np.random.default_rng(9), 1000)
    zero, level = np.zeros_like(left), np.arange(1000) % 15 + 1
    for ends in ((left, zero), (zero, left), (zero, zero)):
        operands = *component_words(*ends), level
        assert BisectionChain(Bisection(2, 45)).compute(*operands)[1].all()
        normal, out_of_range = BisectionChain().compute(*operands)
        assert not out_of_range.any()
    assert not normal.codes.any()


@pytest.mark.parametrize("level", [1, 3, 15])
def test_stiff_every_code_is_accepted(level):
    """With any codes, unit vectors or not, each weight saturates and none leaves its word."""
    left, right = word_corners()
    normal, out_of_range = compute(BisectionChain(), left, right, level)
    np.testing.assert_array_equal(out_of_range, dot(left, right) / ONE**2 < -1e-3)
    # If nothing is flagged, a normal is a sum of both ends, with weights of 0 to 1.
    low = np.minimum(left, 0) + np.minimum(right, 0) - 2
    high = np.maximum(left, 0) + np.maximum(right, 0) + 2
    inside = (low <= normal.codes) & (normal.codes <= high)
    assert inside[~out_of_range].all()


@pytest.mark.parametrize("level", [0, 16])
def test_refuses(level):
    normal = Fixed(COMPONENT, np.array([[0, 0, ONE]]))
    with pytest.raises(ValueError, match=r"^levels must be 1 to 15$"):
        BisectionChain().compute(normal, normal, np.array([level]))
