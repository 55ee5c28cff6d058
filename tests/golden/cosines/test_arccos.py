"""arccos: the bit-accurate model against float64, and the published figures."""

import numpy as np
import pytest
from scipy.optimize import linprog

from blysk.golden.cosines.arccos import ARCCOS_TABLES, PUBLISHED_COEFFICIENTS, SEGMENT_BOUNDS, Arccos
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.polynomials import largest_error, minimax

EVERY = np.arange(Arccos.OPERAND_FORMAT.min_code, Arccos.OPERAND_FORMAT.max_code + 1)
X = EVERY / 2.0**16
INSIDE = np.abs(X) <= 1


def segment_errors(error):
    """Largest error in each segment of abs x, over every input from -1 to 1."""
    magnitude = np.abs(X[INSIDE])
    segment = np.minimum(np.searchsorted(SEGMENT_BOUNDS, magnitude, side="right") - 1, 4)
    return np.array([np.abs(error[INSIDE])[segment == s].max() for s in range(5)])


MODEL_ERRORS = {
    "as_published": [0.0012, 0.0011, 0.0019, 0.0012, 0.174],
    "corrected": [0.0012, 0.0011, 0.0019, 0.0012, 0.084],
    "refitted": [0.00092, 0.00054, 0.00082, 0.00052, 0.019],
}
"""The table of the docstring, by segment."""
HALF_DIGITS = 0.51 * np.array([1e-4] * 4 + [1e-3])


def angle_of(table, codes):
    return Arccos(table).compute(Fixed(Arccos.OPERAND_FORMAT, codes))


def percent(value, digits):
    assert 100 * value == pytest.approx(float(digits), abs=0.5001 * 10.0 ** -len(digits.partition(".")[2]))


@pytest.mark.parametrize(
    ("segment", "absolute", "relative"),
    [(0, 0.0012, "0.10"), (1, 0.0011, "0.13"), (2, 0.0019, "0.37"), (3, 0.0012, "0.42")],
)
def test_published_segments(segment, absolute, relative):
    x = np.linspace(*SEGMENT_BOUNDS[segment : segment + 2], 100001)
    error = np.abs(np.polynomial.polynomial.polyval(x, PUBLISHED_COEFFICIENTS[segment]) - np.arccos(x))
    assert round(error.max(), 4) == absolute
    percent((error / np.arccos(x)).max(), relative)


def test_misprint_of_the_last_segment():
    published, corrected = Arccos("as_published").coefficients[4], Arccos("corrected").coefficients[4]
    assert published[1] == 74.547
    assert corrected[1] == 74.457
    at_start = [np.polynomial.polynomial.polyval(0.96, c) - np.arccos(0.96) for c in (published, corrected)]
    assert round(abs(at_start[0]), 3) == 0.086
    assert round(abs(at_start[1]), 5) == 0.00013
    x = np.linspace(0.96, 1, 40001)[:-1]
    error = np.abs(np.polynomial.polynomial.polyval(x, corrected) - np.arccos(x))
    assert round(np.polynomial.polynomial.polyval(1.0, corrected), 3) == 0.084
    assert round(np.degrees(0.084), 1) == 4.8
    relative = error / np.arccos(x)
    # From there to 1 the error stays above.
    for bound, start in ((0.002, 0.984), (0.01, 0.987)):
        assert round(x[np.flatnonzero(relative <= bound)[-1]], 3) == start
    assert relative[-1] > 10


@pytest.mark.parametrize(("degree", "relative"), [(1, "0.41"), (2, "0.041"), (3, "0.0048")])
def test_root_form(degree, relative):
    """The published figures are those of a plain minimax fit of the factor ``arccos x / sqrt(1 - x)``."""

    def factor(x):
        return np.arccos(np.minimum(x, 1 - 1e-12)) / np.sqrt(1 - np.minimum(x, 1 - 1e-12))

    coefficients = minimax(factor, 0.0, 1.0, degree)
    percent(largest_error(factor, coefficients, 0.0, 1.0)[1], relative)
    if degree == 2:
        assert coefficients == pytest.approx([1.5702117, -0.20212057, 0.04670706], abs=1e-5)


def least_relative_error(basis, target):
    """The least largest relative error that a sum of basis functions can have. A row is a basis function."""
    ratio = (basis / target).T
    ones = np.ones((len(target), 1))
    fit = linprog(
        np.r_[np.zeros(len(basis)), 1.0],
        A_ub=np.block([[ratio, -ones], [-ratio, -ones]]),
        b_ub=np.r_[ones[:, 0], -ones[:, 0]],
        bounds=[(None, None)] * (len(basis) + 1),
        method="highs",
    )
    return fit.fun


@pytest.mark.parametrize(("degree", "relative"), [(1, "0.390"), (2, "0.0391"), (3, "0.0045")])
def test_root_form_at_its_best(degree, relative):
    """A fit with the least relative error is a little better than the published figures."""
    x = np.cos(np.linspace(1e-4, np.pi / 2, 2001))
    basis = np.vander(x, degree + 1, increasing=True).T * np.sqrt(1 - x)
    percent(least_relative_error(basis, np.arccos(x)), relative)


def test_square_of_the_angle_by_the_squared_chord():
    q = np.linspace(1e-6, 1, 2001)
    basis = np.stack([q, q**2, q**3])
    percent(least_relative_error(basis, (2 * np.arcsin(np.sqrt(q) / 2)) ** 2), "0.0079")


def test_short_cosine_costs_angle():
    """Half a step of the operand makes 2.5 % of an angle of 1 degree, whatever the unit does."""
    angle = np.radians(1.0)
    worst = np.arccos(np.cos(angle) - Arccos.OPERAND_FORMAT.step / 2) - angle
    percent(worst / angle, "2.5")


@pytest.mark.parametrize("table", ARCCOS_TABLES)
def test_every_operand(table):
    """The arithmetic error is within its bound, the model error is as stated, and their sum bounds the total
    error."""
    unit = Arccos(table)
    angle, outside = angle_of(table, EVERY)
    np.testing.assert_array_equal(outside, ~INSIDE)
    clamped = np.clip(X, -1, 1)
    arithmetic = segment_errors(angle.values - unit.polynomial(clamped))
    assert np.all(arithmetic <= unit.arithmetic_error)
    # A word comes near to the bound.
    assert np.all(arithmetic >= 0.75 * unit.arithmetic_error)
    model = segment_errors(unit.polynomial(clamped) - np.arccos(clamped))
    np.testing.assert_array_less(np.abs(model - MODEL_ERRORS[table]), HALF_DIGITS)
    total = segment_errors(angle.values - np.arccos(clamped))
    assert np.all(total <= model + unit.arithmetic_error)
    if table == "refitted":
        corrected = segment_errors(angle_of("corrected", EVERY)[0].values - np.arccos(clamped))
        assert np.all(total < 0.82 * corrected)
    # Below 0 the unit takes the supplement, with two roundings of 2^-17.
    sums = angle.values[EVERY > 0] + angle.values[EVERY < 0][:0:-1]
    assert np.abs(sums - np.pi).max() <= 2.0**-16
    # Past 1 the result is as at 1, and is flagged.
    for sign in (1, -1):
        past, outside = angle_of(table, sign * np.array([1 << 16, (1 << 16) + 1, (1 << 17) - 1]))
        assert set(past.codes) == {past.codes[0]}
        assert outside.tolist() == [False, True, True]


@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 89.9, 90, 120, 180])
@pytest.mark.parametrize("table", ARCCOS_TABLES)
def test_stiff_angles(degrees, table):
    """The error has three parts: the cosine's rounding through arccos, the segment's model error, and the
    arithmetic."""
    unit, psi = Arccos(table), np.radians(degrees)
    x = Fixed.round(SQ(2, 16), np.cos([psi]))
    found = unit.compute(x)[0].values
    around = np.clip(np.cos(psi) + np.array([-1, 1]) * 2.0**-17, -1, 1)
    model = np.add(MODEL_ERRORS[table], HALF_DIGITS)
    segments = np.minimum(np.searchsorted(SEGMENT_BOUNDS, np.abs(around), side="right") - 1, 4)
    bound = np.abs(np.arccos(around) - psi).max() + (model + unit.arithmetic_error)[segments].max()
    assert np.abs(found - psi).max() <= bound
    # At 1 and -1, the angles of a smooth mesh, nothing is left of the angle; 1 degree is 0.0175.
    if degrees in (0, 180):
        assert np.abs(found - psi).max() > 0.015


def test_refuses():
    with pytest.raises(
        ValueError, match="the arccos table must be as_published, corrected, refitted, not 'best'"
    ):
        Arccos("best")
    with pytest.raises(ValueError, match=r"operand must be SQ\(2, 16\), not SQ\(1, 17\)"):
        Arccos().compute(Fixed(SQ(1, 17), [0]))
