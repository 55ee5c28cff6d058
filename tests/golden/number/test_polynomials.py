"""Polynomial fits against the published tables and Chebyshev's theorem."""

import numpy as np
import pytest

from blysk.golden.number.fixed import UQ
from blysk.golden.number.polynomials import (
    half_angle_factor,
    largest_error,
    minimax,
    minimax_quantised,
    reciprocal_root,
)
from blysk.golden.reference.reflection import REFLECTION_MODELS

ROOT = np.sqrt(2)


def factor_of_cosine(r):
    return half_angle_factor(1 - r)


def root_of_gap(v):
    return reciprocal_root(2 - v)


# Function, domain, coefficient that is held, published coefficients by ascending power, their digits, and the
# published largest absolute error. The tables were made on another grid. Where the least error is flat, the
# last digits of the coefficients differ, and the error does not.
PUBLISHED = {
    "root, degree 1": (reciprocal_root, (ROOT, 2), {}, (0.64004095, -0.07032614), 2e-8, "6.1e-04"),
    "root, degree 2": (reciprocal_root, (ROOT, 2), {}, (0.68084977, -0.1189218, 0.0142535), 2e-8, "2.0e-05"),
    "h, degree 2": (factor_of_cosine, (0, 1), {}, (0.70519, -0.310337, 0.107064), 6e-7, "1.92e-03"),
    "h, degree 3": (
        factor_of_cosine,
        (0, 1),
        {},
        (0.70681854, -0.34255322, 0.19682175, -0.06137531),
        5e-8,
        "2.88e-04",
    ),
    "h held, u to 1": (
        half_angle_factor,
        (0, 1),
        {0: 0.5},
        (0.5, 0.13069871, 0.01734779, 0.05873483),
        2e-8,
        "3.3e-04",
    ),
    "h held, u to 1/2, 2 terms": (
        half_angle_factor,
        (0, 0.5),
        {0: 0.5},
        (0.5, 0.12188202, 0.06503349),
        5e-8,
        "1.5e-04",
    ),
    "h held, u to 1/2, 3 terms": (
        half_angle_factor,
        (0, 0.5),
        {0: 0.5},
        (0.5, 0.12534066, 0.04302247, 0.03132254),
        5e-6,
        "9.0e-06",
    ),
    "root held, 2 terms": (
        root_of_gap,
        (0, 2 - ROOT),
        {0: 0.5},
        (0.5, 0.06205092, 0.01405506),
        3e-8,
        "2.5e-05",
    ),
    # Published are 0.0625277, 0.01144775, 0.00317987 and 7.9e-7. Those coefficients give 8.5e-7, and no
    # polynomial of these terms gives less than 8.08e-7 (by the alternation below).
    "root held, 3 terms": (
        root_of_gap,
        (0, 2 - ROOT),
        {0: 0.5},
        (0.5, 0.06252681, 0.01145197, 0.00317517),
        1e-8,
        "8.1e-07",
    ),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_fits(name):
    function, domain, held, coefficients, digits, shown = PUBLISHED[name]
    fit = minimax(function, *domain, len(coefficients) - 1, held)
    np.testing.assert_allclose(fit, coefficients, rtol=0, atol=digits)
    error, _ = largest_error(function, fit, *domain)
    assert f"{error:.{len(shown) - 6}e}" == shown
    # No coefficients do better than the fit, including those in the table. The errors of the grid and of the
    # solver's tolerance are under 1e-4 of the fit's error.
    assert error <= largest_error(function, np.array(coefficients), *domain)[0] * (1 + 1e-4)


@pytest.mark.parametrize("name", PUBLISHED)
def test_error_alternates(name):
    """By Chebyshev's theorem a fit is the best if its error reaches its maximum at one more place than it has
    terms."""
    function, domain, held, coefficients, _, _ = PUBLISHED[name]
    degree = len(coefficients) - 1
    fit = minimax(function, *domain, degree, held)
    x = np.linspace(*domain, 200_001)
    error = np.polynomial.polynomial.polyval(x, fit) - function(x)
    extremes = np.abs(error) > (1 - 1e-3) * np.abs(error).max()
    signs = np.sign(error[extremes])
    terms = degree + 1 - len(held)
    assert np.count_nonzero(np.diff(signs)) + 1 == terms + 1
    for power, value in held.items():
        assert fit[power] == value


@pytest.mark.parametrize("octave", [1, 4, 6])
@pytest.mark.parametrize("degree", [2, 3, 4])
def test_narrow_domains_far_from_zero(octave, degree):
    """Near 1, powers of x are almost parallel.

    The fit of arccos is compared with the same fit in ``1 - x``, scaled.
    """
    low, high = 1 - 2.0**-octave, 1 - 2.0 ** -(octave + 1)
    found = largest_error(np.arccos, minimax(np.arccos, low, high, degree), low, high)[0]

    # x is 2^-k v with v in [1/2, 1].
    def scaled(v):
        return np.arccos(1 - 2.0**-octave * v)

    best = largest_error(scaled, minimax(scaled, 0.5, 1.0, degree), 0.5, 1.0)[0]
    assert found == pytest.approx(best, rel=1e-3)
    # Each degree gains nearly a digit.
    assert (
        degree == 2 or found < largest_error(scaled, minimax(scaled, 0.5, 1.0, degree - 1), 0.5, 1.0)[0] / 7
    )


@pytest.mark.parametrize(
    ("function", "domain", "printed", "absolute", "relative"),
    [
        (reciprocal_root, (ROOT, 2), (0.64, -0.07), "1.1e-03", "0.217 %"),
        (reciprocal_root, (ROOT, 2), (0.681, -0.119, 0.014), "1.00e-03", "0.200 %"),
        (factor_of_cosine, (0, 1), (0.707, -0.341, 0.193, -0.059), "6.1e-04", "0.093 %"),
    ],
)
def test_printed_digits(function, domain, printed, absolute, relative):
    """Errors of the coefficients of [T] as printed."""
    error = largest_error(function, np.array(printed), *domain)
    assert f"{error[0]:.{len(absolute) - 6}e}" == absolute
    assert f"{error[1]:.3%}".replace("%", " %") == relative


@pytest.mark.parametrize(
    ("function", "domain", "degree", "relative"),
    [
        (reciprocal_root, (ROOT, 2), 1, "0.122%"),
        (reciprocal_root, (ROOT, 2), 2, "0.0040%"),
        (factor_of_cosine, (0, 1), 2, "0.383%"),
        (factor_of_cosine, (0, 1), 3, "0.058%"),
    ],
)
def test_relative_errors_of_the_fits(function, domain, degree, relative):
    found = largest_error(function, minimax(function, *domain, degree), *domain)[1]
    assert f"{found:.{len(relative) - 3}%}" == relative


def test_plain_fit_is_worst_where_meshes_live_and_the_printed_one_exact():
    """Flat faces have r = 1 and h = 1/2."""
    plain = minimax(factor_of_cosine, 0, 1, 3)
    assert f"{abs(plain.sum() - 0.5):.1e}" == "2.9e-04"
    assert sum((0.707, -0.341, 0.193, -0.059)) == pytest.approx(0.5, abs=1e-15)
    held = minimax(half_angle_factor, 0, 1, 3, {0: 0.5})
    assert np.polynomial.polynomial.polyval(0.0, held) == 0.5


def test_printed_root_at_its_end():
    """The polynomial of degree 2 of [T] at z = 2, for equal normals."""
    assert f"{np.polynomial.polynomial.polyval(2.0, (0.681, -0.119, 0.014)):.3f}" == "0.499"


def test_plain_fit_dims_flat_faces():
    """A flat face's normal is 0.06 % too short: 14 LSB of cosquad at n = 100, and 126 at 1000.

    125 is published, which is the same figure cut in place of rounded.
    """
    length = 2 * minimax(factor_of_cosine, 0, 1, 3).sum()
    assert f"{1 - length:.2%}" == "0.06%"
    loss = [255 * (1 - float(REFLECTION_MODELS["cosquad"].reflect(length, n))) for n in (100, 1000)]
    assert [f"{value:.1f}" for value in loss] == ["14.5", "125.8"]


def test_functions():
    angle = np.linspace(0, 3, 50)
    np.testing.assert_allclose(half_angle_factor(1 - np.cos(angle)), 0.5 / np.cos(angle / 2), rtol=1e-12)
    np.testing.assert_allclose(reciprocal_root(2 * np.cos(angle)), 0.5 / np.cos(angle / 2), rtol=1e-12)


def test_refitted_coefficients_beat_rounded_ones():
    formats = dict.fromkeys((1, 2, 3), UQ(-2, 13))
    held = {0: 0.5}
    fit = minimax(half_angle_factor, 0, 0.5, 3, held)
    codes = minimax_quantised(half_angle_factor, 0, 0.5, formats, held)
    assert codes.dtype == np.int64
    refitted = np.r_[0.5, codes * 2.0**-13]
    rounded = np.r_[0.5, np.rint(fit[1:] * 2**13) * 2.0**-13]
    best, plain, ours = (
        largest_error(half_angle_factor, coefficients, 0, 0.5)[0] for coefficients in (fit, rounded, refitted)
    )
    assert best < ours < plain
    assert ours < best + 2.0**-14 * 0.5**3  # the last coefficient's rounding has no successor to take it up


def test_largest_error_is_that_of_a_known_polynomial():
    absolute, relative = largest_error(lambda x: x * x + 1, np.array([1.0]), 0, 2)
    assert (absolute, relative) == pytest.approx((4.0, 0.8))
