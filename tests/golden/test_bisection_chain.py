"""Chain of bisections: the twin against float64."""

import numpy as np
import pytest

from golden.bisection import Bisection
from golden.bisection_chain import BisectionChain
from golden.fixed import Fixed
from golden.interpolation import interpolate
from golden.unit_vector import COMPONENT, ONE, quantise


def weights(psi, level):
    """``L_k`` and ``M_k`` as the document has them."""
    weight_l, weight_m = np.zeros_like(psi), np.ones_like(psi)
    for k in range(1, level + 1):
        weight_l, weight_m = weight_l + weight_m, 2 * weight_m * np.cos(psi / 2**k)
    return weight_l, weight_m


@pytest.mark.parametrize("level", [1, 2, 5, 15])
def test_closed_form_is_the_great_circle(normal_pairs, level):
    psi = np.random.default_rng(1).uniform(0.01, 90, 500)
    left, right = normal_pairs(np.random.default_rng(2), 500, psi)
    weight_l, weight_m = weights(np.radians(psi), level)
    chain = (weight_l[:, np.newaxis] * left + right) / weight_m[:, np.newaxis]
    np.testing.assert_allclose(
        chain, interpolate("slerp", left, right, np.full(500, 2.0**-level)), atol=1e-13
    )


@pytest.mark.parametrize("bisection", [Bisection(), Bisection(1), Bisection(as_documented=True)], ids=str)
@pytest.mark.parametrize("first_step", [False, True])
def test_error_under_its_bound(normal_pairs, bisection, first_step):
    rng = np.random.default_rng(3)
    low, high = (45.01, 90) if first_step else (0, 44.99)
    angles = np.r_[rng.uniform(low, high, 10_000), np.full(2000, low), np.full(2000, high)]
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(angles), angles))
    a, b = left / ONE, right / ONE
    psi = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
    parameters = BisectionChain(bisection)
    for level in (1, 2, 3, 4, 6, 8, 15):
        normal, wide = parameters.compute(
            Fixed(COMPONENT, left), Fixed(COMPONENT, right), np.full(len(left), level)
        )
        assert not wide.any()
        weight_l, weight_m = weights(psi, level)
        exact = (weight_l[:, np.newaxis] * a + b) / weight_m[:, np.newaxis] * (ONE * COMPONENT.step)
        worst = np.abs(normal.values - exact).max()
        bound = parameters.error(level, first_step)
        assert worst <= bound
        # Further on, the bound's largest error of the fit and its widest angle drift apart.
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
def test_error_statement(level, narrow, first):
    chain = BisectionChain()
    assert (f"{chain.error(level, False):.1e}", f"{chain.error(level, True):.1e}") == (narrow, first)


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 45, 89.9, 90, 90.01, 120, 180])
def test_flag(normal_pairs, angle):
    left, right = (quantise(normals) for normals in normal_pairs(np.random.default_rng(5), 1000, angle))
    _, wide = BisectionChain().compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right), np.full(1000, 3))
    assert np.all(wide == (angle > 90))


def test_refuses():
    normal = Fixed(COMPONENT, np.array([[0, 0, ONE]]))
    for level in (0, 16):
        with pytest.raises(ValueError, match=r"^levels must be 1 to 15$"):
            BisectionChain().compute(normal, normal, np.array([level]))
