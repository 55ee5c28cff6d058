"""arccos and half chord against float64 mathematics, and the figures of the literature."""

import numpy as np
import pytest
from scipy.optimize import linprog

from blysk.golden.cosines.arccos import ARCCOS_TABLES, PRINTED_COEFFICIENTS, SEGMENT_BOUNDS, Arccos, HalfChord
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.polynomials import largest_error, minimax
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED, quantise

EVERY = np.arange(Arccos.OPERAND_FORMAT.min_code, Arccos.OPERAND_FORMAT.max_code + 1)
X = EVERY / 2.0**16
INSIDE = np.abs(X) <= 1


def segment_errors(error):
    """Largest of an error by segment of abs x, over every input from -1 to 1."""
    magnitude = np.abs(X[INSIDE])
    segment = np.minimum(np.searchsorted(SEGMENT_BOUNDS, magnitude, side="right") - 1, 4)
    return np.array([np.abs(error[INSIDE])[segment == s].max() for s in range(5)])


def percent(value, digits):
    assert 100 * value == pytest.approx(float(digits), abs=0.5001 * 10.0 ** -len(digits.partition(".")[2]))


# numbers.md, "arccos, table 3.1".
@pytest.mark.parametrize(
    ("segment", "absolute", "relative"),
    [(0, 0.0012, "0.10"), (1, 0.0011, "0.13"), (2, 0.0019, "0.37"), (3, 0.0012, "0.42")],
)
def test_printed_segments(segment, absolute, relative):
    x = np.linspace(*SEGMENT_BOUNDS[segment : segment + 2], 100001)
    error = np.abs(np.polynomial.polynomial.polyval(x, PRINTED_COEFFICIENTS[segment]) - np.arccos(x))
    assert round(error.max(), 4) == absolute
    percent((error / np.arccos(x)).max(), relative)


def test_misprint_of_the_last_segment():
    printed, corrected = Arccos("as_published").coefficients[4], Arccos("corrected").coefficients[4]
    assert printed[1] == 74.547
    assert corrected[1] == 74.457
    at_start = [np.polynomial.polynomial.polyval(0.96, c) - np.arccos(0.96) for c in (printed, corrected)]
    assert round(abs(at_start[0]), 3) == 0.086
    assert round(abs(at_start[1]), 5) == 0.00013
    x = np.linspace(0.96, 1, 40001)[:-1]
    error = np.abs(np.polynomial.polynomial.polyval(x, corrected) - np.arccos(x))
    assert round(np.polynomial.polynomial.polyval(1.0, corrected), 3) == 0.084
    assert round(np.degrees(0.084), 1) == 4.8
    relative = error / np.arccos(x)
    # From there on to 1 it stays above.
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
    """Of the sums of the basis functions, by rows: the least largest relative error."""
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
    """A fit of least relative error is a little better than the published figures."""
    x = np.cos(np.linspace(1e-4, np.pi / 2, 2001))
    basis = np.vander(x, degree + 1, increasing=True).T * np.sqrt(1 - x)
    percent(least_relative_error(basis, np.arccos(x)), relative)


def test_square_of_the_angle_by_the_squared_chord():
    q = np.linspace(1e-6, 1, 2001)
    basis = np.stack([q, q**2, q**3])
    percent(least_relative_error(basis, (2 * np.arcsin(np.sqrt(q) / 2)) ** 2), "0.0079")


def test_short_cosine_costs_angle():
    angle = np.radians(1.0)
    worst = np.arccos(np.cos(angle) - 2.0**-17) - angle
    percent(worst / angle, "2.5")


@pytest.mark.parametrize("table", ARCCOS_TABLES)
def test_arithmetic_error_over_every_input(table):
    unit = Arccos(table)
    angle, outside = unit.compute(Fixed(unit.OPERAND_FORMAT, EVERY))
    np.testing.assert_array_equal(outside, ~INSIDE)
    clamped = np.clip(X, -1, 1)
    error = segment_errors(angle.values - unit.polynomial(clamped))
    assert np.all(error <= unit.arithmetic_error)
    # The bound is one that a word comes near to.
    assert np.all(error >= 0.75 * unit.arithmetic_error)


@pytest.mark.parametrize("table", ARCCOS_TABLES)
def test_stiff_past_one_is_one(table):
    unit = Arccos(table)
    for sign in (1, -1):
        x = sign * np.array([1 << 16, (1 << 16) + 1, (1 << 17) - 1])
        angle, outside = unit.compute(Fixed(unit.OPERAND_FORMAT, x))
        assert set(angle.codes) == {angle.codes[0]}
        assert outside.tolist() == [False, True, True]


# The table of the docstring, with the arithmetic error on top.
@pytest.mark.parametrize(
    ("table", "model"),
    [
        ("as_published", [0.0012, 0.0011, 0.0019, 0.0012, 0.174]),
        ("corrected", [0.0012, 0.0011, 0.0019, 0.0012, 0.084]),
        ("refitted", [0.00092, 0.00054, 0.00082, 0.00052, 0.019]),
    ],
)
def test_model_error_by_segment(table, model):
    unit = Arccos(table)
    found = segment_errors(unit.polynomial(np.clip(X, -1, 1)) - np.arccos(np.clip(X, -1, 1)))
    np.testing.assert_array_less(np.abs(found - model), 0.51 * np.array([1e-4] * 4 + [1e-3]))
    angle, _ = unit.compute(Fixed(unit.OPERAND_FORMAT, EVERY))
    total = segment_errors(angle.values - np.arccos(np.clip(X, -1, 1)))
    assert np.all(total <= found + unit.arithmetic_error)


def test_refitted_is_better_everywhere():
    total = {}
    for table in ("corrected", "refitted"):
        angle, _ = Arccos(table).compute(Fixed(Arccos.OPERAND_FORMAT, EVERY))
        total[table] = segment_errors(angle.values - np.arccos(np.clip(X, -1, 1)))
    assert np.all(total["refitted"] < 0.82 * total["corrected"])


def test_negative_is_the_supplement():
    for table in ARCCOS_TABLES:
        positive, negative = (
            Arccos(table).compute(Fixed(SQ(2, 16), sign * EVERY[EVERY > 0]))[0].values for sign in (1, -1)
        )
        # Two roundings of 2^-17.
        assert np.abs(positive + negative - np.pi).max() <= 2.0**-16


@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 89.9, 90, 120, 180])
@pytest.mark.parametrize("table", ARCCOS_TABLES)
def test_stiff_angles(degrees, table):
    """The cosine's rounding by arccos itself, the segment's model error, and the arithmetic."""
    unit, psi = Arccos(table), np.radians(degrees)
    x = Fixed.round(SQ(2, 16), np.cos([psi]))
    found = unit.compute(x)[0].values
    around = np.clip(np.cos(psi) + np.array([-1, 1]) * 2.0**-17, -1, 1)
    model = np.array(
        {
            "as_published": [0.0012, 0.0011, 0.0019, 0.0012, 0.1745],
            "corrected": [0.0012, 0.0011, 0.0019, 0.0012, 0.0845],
            "refitted": [0.00093, 0.00055, 0.00083, 0.00053, 0.0195],
        }[table]
    ) + np.array([5e-5] * 4 + [0])
    segments = np.minimum(np.searchsorted(SEGMENT_BOUNDS, np.abs(around), side="right") - 1, 4)
    bound = np.abs(np.arccos(around) - psi).max() + (model + unit.arithmetic_error)[segments].max()
    assert np.abs(found - psi).max() <= bound
    # At 1 and -1, where a mesh lives, nothing of the angle is left: 1 degree is 0.0175.
    if degrees in (0, 180):
        assert np.abs(found - psi).max() > 0.015


def chords(left, right):
    """Squared chord of codes, the smaller of the two, exact; and whether it is the supplement's."""
    a, b = Fixed(COMPONENT, left), Fixed(COMPONENT, right)
    dot = DotProduct()
    own = dot.compute(a, a).codes + dot.compute(b, b).codes
    cross = dot.compute(a, b).codes
    return Fixed(UQ(2, 34), own - 2 * np.abs(cross)), cross < 0


def half_chord_exact(chord, supplement):
    half = np.sqrt(chord.values / ONE_SQUARED.values) / 2
    angle = 2 * np.arcsin(half) / (2 * np.pi)
    return angle, np.where(supplement, 0.5 - angle, angle)


def test_half_chord_relative_error():
    rng = np.random.default_rng(7)
    largest = ONE_SQUARED.codes * 2
    codes = np.r_[np.arange(1, 5000), largest - np.arange(5000)]
    codes = np.r_[codes, np.trunc(2.0 ** rng.uniform(0, np.log2(largest), 4 * 10**5)).astype(np.int64)]
    chord = Fixed(UQ(2, 34), codes)
    unit = HalfChord()
    for flag in (False, True):
        supplement = np.full(len(codes), flag)
        angle, exact = half_chord_exact(chord, supplement)
        error = np.abs(unit.compute(chord, supplement).values - exact) - 2.0**-36
        assert np.all(error <= unit.RELATIVE_ERROR * angle)
        assert (error / angle).max() > 0.6 * unit.RELATIVE_ERROR
    assert unit.compute(Fixed(UQ(2, 34), [0, 0]), np.array([False, True])).values.tolist() == [0, 0.5]


@pytest.mark.parametrize("degrees", [0, 1e-4, 1e-2, 1, 45, 89.9, 90, 120, 179, 179.99, 180])
def test_stiff_half_chord_of_normals(degrees, normal_pairs):
    rng = np.random.default_rng(8)
    left, right = (quantise(n) for n in normal_pairs(rng, 1500, degrees))
    chord, supplement = chords(left, right)
    angle = 360 * HalfChord().compute(chord, supplement).values
    cross = np.linalg.norm(np.cross(left, right), axis=1)
    exact = np.degrees(np.arctan2(cross, np.einsum("ij,ij->i", left, right)))
    # A length is off by 2^-18 at most, a chord of normals of unequal length by their difference.
    lengths = np.abs(np.linalg.norm(left, axis=1) - np.linalg.norm(right, axis=1)) / 2.0**17
    bound = HalfChord.RELATIVE_ERROR * np.minimum(exact, 180 - exact) + np.degrees(2 * lengths + 2.0**-17)
    assert np.all(np.abs(angle - exact) <= bound)
    # What the quantised normals themselves allow: each is off by under sqrt 3 steps.
    assert np.abs(angle - degrees).max() <= np.degrees(2 * np.sqrt(3) * 2.0**-17) + bound.max()


def test_half_chord_keeps_what_arccos_loses(normal_pairs):
    rng = np.random.default_rng(9)
    left, right = (quantise(n) for n in normal_pairs(rng, 1500, 1.0))
    a, b = Fixed(COMPONENT, left), Fixed(COMPONENT, right)
    cosine = DotProduct().compute(a, b).round_half_up(16)
    by_arccos, _ = Arccos().compute(cosine.wrap(SQ(2, 16)))
    by_chord = HalfChord().compute(*chords(left, right))
    off = [np.abs(angle - 1).max() for angle in (np.degrees(by_arccos.values), 360 * by_chord.values)]
    assert off[0] > 0.2
    assert off[1] < 0.003


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Arccos("best"), "the arccos table must be as_published, corrected, refitted, not 'best'"),
        (
            lambda: Arccos().compute(Fixed(SQ(1, 17), [0])),
            r"operand must be SQ\(2, 16\), not SQ\(1, 17\)",
        ),
        (
            lambda: HalfChord().compute(Fixed(UQ(3, 34), [0]), np.array([False])),
            r"operand must be UQ\(2, 34\), not UQ\(3, 34\)",
        ),
    ],
)
def test_refusals(make, message):
    with pytest.raises(ValueError, match=message):
        make()
