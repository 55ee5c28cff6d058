"""Chord setup: differences of N.L and of the squared chord, against float64."""

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import ChordSetup, largest_span_angle
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.reciprocal import step_words
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.sim.units.cosines.chord_setup import value_at
from blysk.sim.units.cosines.local_chord_setup import parabola
from blysk.sim.units.operands import (
    code_pairs_at,
    component_words,
    degrees_between,
    pairs_at,
    pairs_of_length,
    sphere,
    turned,
    unit_codes,
)

ONE_VALUE = float(ONE_SQUARED.values)
ANGLES = [0.0, 1e-4, 1.0, 6.3, 9.0, 15.0, 22.4]
EXPONENTS = [1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000]
MODELS = ["cosquad", "cosquad7", "cosquad_lin", "lyon1_refitted", "lyon2", "lyon3", "exp"]
UP = np.array([0, 0, ONE])
FULL = ChordSetup()


def setup(left, right, direction, halfway, length, parameters=FULL):
    vectors = component_words(*(np.atleast_2d(v) for v in (left, right, direction, halfway)))
    return parameters.compute(*vectors, length)


def half_chord(normal, halfway):
    """``1 - N . H`` of unit vectors, without a difference of nearly equal numbers."""
    return ((normal - halfway) ** 2).sum(axis=-1) / 2


def spans_about(rng, count, angle, halfway, spread):
    """Codes of spans of an angle: every second one holds a normal near a vector, the rest are anywhere."""
    left, right = pairs_at(rng, count, angle)
    near = normalise(halfway + spread * rng.normal(size=(count, 3)))
    side = turned(rng, near, 90.0)
    psi, part = np.radians(np.broadcast_to(angle, count))[:, np.newaxis], rng.random((count, 1))
    for ends, turn in ((left, -psi * part), (right, psi * (1 - part))):
        ends[::2] = (near * np.cos(turn) + side * np.sin(turn))[::2]
    return quantise(left), quantise(right)


def lights(rng):
    """Codes of L and H, and the unit vectors that they stand for."""
    light, viewer = sphere(rng, 2)
    codes = quantise(light), quantise(normalise(light + viewer))
    return codes, [normalise(code / ONE) for code in codes]


def check(p, rng, angle, length, count=20_000):
    """Both bounds at random pixels and at the last, with u anywhere and near the peak; the largest errors."""
    codes, (d, h) = lights(rng)
    left, right = spans_about(rng, count, angle, h, 0.1)
    length = np.broadcast_to(length, count)
    diffuse, highlight, out_of_range = setup(left, right, *codes, length, p)
    assert not out_of_range.any()
    step = np.where(rng.random(count) < 0.5, length - 1, rng.integers(0, length))
    t = step / np.maximum(length - 1, 1)
    ends = [normalise(end / ONE) for end in (left, right)]
    normals = np.stack([ends[0], normalise(ends[0] + ends[1]), ends[1]], axis=1)
    u, f = half_chord(normals, h), normals @ d
    u_error = ONE_VALUE * np.abs(value_at(highlight, step) - parabola(u, t))
    f_error = ONE_VALUE * np.abs(value_at(diffuse, step) - parabola(f, t))
    widest, u = degrees_between(left, right).max(), np.maximum(u[:, 0], u[:, 2])
    assert widest < angle + 2e-3
    assert np.all(u_error <= p.highlight_error(widest, u))
    assert f_error.max() <= p.diffuse_error(widest)
    near = u < 0.05
    assert np.count_nonzero(near) > count // 5
    return u_error.max(), u_error[near].max(), f_error.max(), widest


@pytest.mark.parametrize("angle", ANGLES)
def test_error(angle):
    """Random lengths: within the bounds, which are not far from the largest errors."""
    rng = np.random.default_rng(int(angle * 10))
    anywhere, near, diffuse, widest = check(FULL, rng, angle, rng.integers(2, 4096, 20_000))
    assert anywhere > FULL.highlight_error(widest) / 8
    assert near > FULL.highlight_error(widest, 0.05) / 8
    assert diffuse > FULL.diffuse_error(widest) / 8


@pytest.mark.parametrize("terms", [1, 2, 3])
@pytest.mark.parametrize("fraction_bits", [36, 40, 46])
def test_fewer_terms_and_bits_keep_the_bounds(terms, fraction_bits):
    """Those of a span as wide and as long as they allow; the bounds are hardly larger than in full."""
    rng, p = np.random.default_rng(terms), ChordSetup(terms, fraction_bits)
    assert p.longest == {36: 127, 40: 511, 46: 4095}[fraction_bits]
    angle = p.max_angle - 0.01
    for length in (2, 3, p.longest):
        check(p, rng, angle, length, 5_000)
    for function in ("highlight_error", "diffuse_error"):
        full = getattr(FULL, function)(angle)
        assert full / 2 < getattr(p, function)(angle) < 1.1 * full


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
@pytest.mark.parametrize("angle", ANGLES)
def test_stiff_angles_and_lengths(angle, length):
    check(FULL, np.random.default_rng(length), angle, length, 5_000)


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_equal_normals_stay_constant(length):
    """No difference at all, whatever the length of the vectors."""
    rng = np.random.default_rng(length)
    normals, vectors = unit_codes(rng, 2000), unit_codes(rng, 3)
    normals[:200] = rng.integers(-ONE // 2, ONE // 2, (200, 3))
    *functions, out_of_range = setup(normals, normals, vectors, vectors, np.full(2000, length))
    assert not out_of_range.any()
    for differences in functions:
        assert differences.start.codes.any()
        assert not differences.first.codes.any()
        assert not differences.second.codes.any()


@pytest.mark.parametrize("angle", [1e-3, 1.0, 15.0])
def test_stiff_peak_on_an_end_and_in_the_middle(angle):
    """An end that is H has u = 0, exactly; a middle that is H has it within the bound."""
    half = np.radians(angle) / 2
    left, right = (quantise(np.array([s * np.sin(half), 0, np.cos(half)])) for s in (-1, 1))
    _, highlight, _ = setup(UP, right, UP, UP, np.array([17]))
    assert highlight.start.codes[0, 0] == 0
    _, highlight, _ = setup(left, right, UP, UP, np.array([17]))
    end = half_chord(normalise(right / ONE), UP / ONE)
    middle, last = (ONE_VALUE * value_at(highlight, np.array([pixel]))[0] for pixel in (8, 16))
    assert abs(middle) <= FULL.highlight_error(angle + 2e-3, end)
    assert abs(last - ONE_VALUE * end) <= FULL.highlight_error(angle, end)


@pytest.mark.parametrize("excess", [-1 / 256, 0])
def test_stiff_lengths_of_vectors(excess):
    """u feels a length of 1 + e at second order and times u, f at first."""
    ends = pairs_of_length(np.random.default_rng(5), 2000, 5.0, 1 + excess)
    diffuse, highlight, out_of_range = setup(*ends, UP, UP, np.full(len(ends[0]), 2))
    assert not out_of_range.any()
    e = -excess
    for step, normals in enumerate(ends):
        n, step = normalise(normals / ONE), np.full(len(normals), step)
        u = half_chord(n, UP / ONE)
        assert np.all(np.abs(value_at(highlight, step) - u) <= e**2 / 2 + e * u + 5e-5)
        assert np.all(np.abs(value_at(diffuse, step) - n[:, 2]) <= e + 2e-5)


@pytest.mark.parametrize("curved", [False, True])
def test_stiff_drift_over_4095_pixels(curved):
    """The rounding of the differences, ``2^-46 (k + k^2/2)`` at pixel k: the worst of many."""
    rng, p = np.random.default_rng(46 + curved), FULL
    count, length = 200_000, np.full(200_000, 4095)
    slopes = rng.integers(-(2**33), 2**33, (count, 1))
    curvatures = rng.integers(-(2**17), 2**17, (count, 1)) * curved
    words = Fixed(p.SLOPE_FORMAT, slopes), Fixed(p.CURVATURE_FORMAT, curvatures)
    differences = p.differences(Fixed(p.CHORD_FORMAT, 0 * slopes), *words, *p.steps(length))
    reciprocal, shift, square, square_shift = step_words(np.array([4095]))
    k = 4094
    # In codes of 80 fraction bits, exact with the words of dt and dt^2.
    slope_term = slopes[:, 0].astype(object) * int(reciprocal.codes[0]) << 29 - int(shift[0])
    curvature_term = curvatures[:, 0].astype(object) * int(square.codes[0]) << 45 - int(square_shift[0])
    exact = k * slope_term + k**2 * curvature_term
    first, second = (d.codes[:, 0].astype(object) << 34 for d in differences[1:])
    drift = np.abs((k * first + k * (k - 1) // 2 * second - exact).astype(float)) * 2.0**-80
    bound = 2.0**-46 * (k + k**2 / 2) if curved else 2.0**-46 * k
    assert drift.max() <= bound
    assert drift.max() > 0.9 * (bound if curved else bound / 2)


def test_flag():
    """At 22.5 degrees, within the rounding of a normal."""
    angle = np.radians(np.r_[np.linspace(0, 22.49, 50), np.linspace(22.52, 180, 50)])
    rng = np.random.default_rng(6)
    for axis, side in (np.eye(3)[:2], np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]):
        right = quantise(np.cos(angle)[:, np.newaxis] * axis + np.sin(angle)[:, np.newaxis] * side)
        vector = quantise(axis)
        _, _, out_of_range = setup(np.tile(vector, (100, 1)), right, vector, vector, np.full(100, 9))
        np.testing.assert_array_equal(out_of_range, angle > np.radians(22.5))


def test_lights_are_independent():
    rng = np.random.default_rng(7)
    ends = code_pairs_at(rng, 500, 10.0)
    direction, halfway = unit_codes(rng, 3), unit_codes(rng, 3)
    length = rng.integers(1, 4096, 500)
    together = setup(*ends, direction, halfway, length)
    for light in range(3):
        alone = setup(*ends, direction[light], halfway[light], length)
        for both, one in zip(together[:2], alone[:2], strict=True):
            for a, b in zip(both, one, strict=True):
                np.testing.assert_array_equal(a.codes[:, light], b.codes[:, 0])


def test_refuses():
    vector = Fixed(COMPONENT, UP[np.newaxis])
    other = Fixed(SQ(2, 16), np.array([[0, 0, 1]]))
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 17\)$"):
        FULL.compute(vector, other, vector, vector, np.array([1]))
    for length in (0, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            FULL.compute(vector, vector, vector, vector, np.array([length]))


# The fit itself, in float64.


def azimuth_at(t, psi):
    """Angle from the left normal of ``normalise((1-t) N_l + t N_r)``."""
    return np.arctan2(t * np.sin(psi), (1 - t) + t * np.cos(psi))


def three_points(function, psi, t):
    return parabola(np.stack([function(0.0), function(psi / 2), function(psi)], axis=-1), t)


def fit_error(model, exponent, psi):
    """Largest error of the specular term of the fit in LSB, over all directions of H: beta and lambda."""
    t = np.linspace(0, 1, 101)
    # From the middle outwards, one side: the other is its mirror. Beyond, all of the span is dark.
    reach = min(np.pi / 2, 3 / np.sqrt(exponent) + psi)
    azimuth = np.linspace(psi / 2, psi / 2 + reach, 300)[:, np.newaxis]
    worst = 0.0
    for beta in np.linspace(0, min(np.pi / 2, 3 / np.sqrt(exponent)), 40):

        def u(a, beta=beta):
            return 1 - np.cos(beta) * np.cos(azimuth - a)

        exact, fit = u(azimuth_at(t, psi)), three_points(u, psi, t)
        terms = [REFLECTION_MODELS[model].reflect(1 - value, exponent) for value in (fit, exact)]
        worst = max(worst, 255 * np.abs(terms[0] - terms[1]).max())
    return worst


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_fit_of_the_highlight(exponent):
    """At `largest_span_angle`, every model at full reflection: at most a quarter of an LSB."""
    psi = np.radians(largest_span_angle(exponent))
    errors = {model: fit_error(model, exponent, psi) for model in MODELS}
    assert max(errors.values()) <= 0.25
    if exponent >= 10:
        assert max(errors.values()) > 0.15


def test_fit_of_the_diffuse_term():
    t = np.linspace(0, 1, 401)
    azimuth = np.linspace(0, 2 * np.pi, 1441)[:, np.newaxis]
    psi = np.radians(largest_span_angle(1))

    def f(a):
        return np.cos(azimuth - a)

    worst = 255 * np.abs(three_points(f, psi, t) - f(azimuth_at(t, psi))).max()
    assert 0.1 < worst <= 0.12


def steepest(model, exponent):
    """Largest slope of the term over u; a chord over small steps of a float64 curve."""
    u = np.linspace(0, 4 / exponent, 4001)
    return np.abs(np.diff(REFLECTION_MODELS[model].reflect(1 - u, exponent)) / np.diff(u)).max() * (1 + 1e-3)


def total_error(rng, count, model, exponent):
    """Fit and arithmetic together in LSB, of highlight and diffuse term; how many are lit."""
    codes, (d, h) = lights(rng)
    angle = rng.uniform(0, largest_span_angle(exponent) - 2e-3, count)
    angle[::4] = largest_span_angle(exponent) - 2e-3
    left, right = spans_about(rng, count, angle, h, 1.5 / np.sqrt(exponent))
    length = rng.integers(2, 4095, count, endpoint=True)
    diffuse, highlight, out_of_range = setup(left, right, *codes, length)
    assert not out_of_range.any()
    step = rng.integers(0, length)
    t = (step / (length - 1))[:, np.newaxis]
    normals = normalise((1 - t) * normalise(left / ONE) + t * normalise(right / ONE))
    values = value_at(highlight, step), half_chord(normals, h)
    found, exact = (REFLECTION_MODELS[model].reflect(1 - u, exponent) for u in values)
    diffuse_error = np.abs(value_at(diffuse, step) - normals @ d).max()
    return 255 * np.abs(found - exact).max(), 255 * diffuse_error, np.count_nonzero(exact > 0.1)


def check_total(rng, rounds, count, model, exponent):
    """A quarter of an LSB for the fit and the share of `highlight_error`; together under a half."""
    angle = largest_span_angle(exponent)
    # u of an end of a span that is lit somewhere: from its zero on the curve is flat.
    lit = np.arccos(max(1 - 2 / exponent, -1)) + np.radians(angle)
    largest = 1 - np.cos(min(lit, np.pi))
    arithmetic = 255 * steepest(model, exponent) * float(FULL.highlight_error(angle, largest))
    assert 0.25 + arithmetic < 0.5
    worst = 0.0
    for _ in range(rounds):
        highlight, diffuse, lit = total_error(rng, count, model, exponent)
        assert lit > count // 50
        assert highlight <= 0.25 + arithmetic
        assert diffuse <= 0.12 + 255 * FULL.diffuse_error(angle)
        worst = max(worst, highlight)
    assert worst > 0.05


@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100, 500, 1000])
def test_total_error(exponent):
    """20000 spans an exponent, each at a random pixel."""
    check_total(np.random.default_rng(exponent), 1, 20_000, "cosquad", exponent)


@pytest.mark.long
@pytest.mark.parametrize("model", ["cosquad", "lyon3"])
@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100, 500, 1000])
def test_total_error_of_ten_million_spans(model, exponent):
    check_total(np.random.default_rng(exponent + 1), 10, 75_000, model, exponent)
