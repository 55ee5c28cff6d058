"""Chord setup: differences of N.L and of the squared chord, against float64 and exact integers."""

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import ChordSetup, largest_span_angle
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.reciprocal import step_words
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import REFLECTION_MODELS

ONE_VALUE = float(ONE_SQUARED.values)
ANGLES = [0.0, 1e-4, 1.0, 6.3, 9.0, 15.0, 22.4]
EXPONENTS = [1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000]
MODELS = ["cosquad", "cosquad7", "cosquad_lin", "lyon1_refitted", "lyon2", "lyon3", "exp"]


def setup(left, right, direction, halfway, length):
    vectors = (Fixed(COMPONENT, np.atleast_2d(v)) for v in (left, right, direction, halfway))
    return ChordSetup().compute(*vectors, length)


def at(differences, step, light=0):
    """Values of the quadratic at a pixel of each span, by exact integers."""
    start, first, second = (d.codes[:, light].astype(object) for d in differences)
    shift = ChordSetup().format.fraction_bits - differences.start.format.fraction_bits
    step = step.astype(object)
    total = (start << shift) + step * first + step * (step - 1) // 2 * second
    return total.astype(float) * ChordSetup().format.step


def unit(codes):
    return normalise(codes.astype(float))


def middle(left, right):
    return normalise(left + right)


def quadratic(values, t):
    left, centre, right = values
    return (2 * right - 4 * centre + 2 * left) * t**2 + (4 * centre - right - 3 * left) * t + left


def half_chord(normal, halfway):
    """``1 - N . H`` of unit vectors, without a difference of nearly equal numbers."""
    return ((normal - halfway) ** 2).sum(axis=-1) / 2


def turned(left, right):
    """Degrees, precise for small angles."""
    return np.degrees(2 * np.arcsin(np.minimum(np.linalg.norm(left - right, axis=-1) / 2, 1)))


def spans_about(rng, count, angle, halfway, spread, normal_pairs):
    """Spans of an angle whose left ends lie about a vector, half of them; the rest lie anywhere."""
    left, right = normal_pairs(rng, count, angle)
    near = normalise(halfway + spread * rng.normal(size=(count, 3)))
    across = rng.normal(size=(count, 3))
    across = normalise(across - (across * near).sum(axis=1, keepdims=True) * near)
    turn, part = np.radians(np.broadcast_to(angle, count))[:, np.newaxis], rng.random((count, 1))
    ends = [near * np.cos(turn * s) + across * np.sin(turn * s) for s in (-part, 1 - part)]
    half = np.arange(count)[:, np.newaxis] % 2 == 0
    return np.where(half, ends[0], left), np.where(half, ends[1], right)


def errors(rng, count, angle, length, normal_pairs, spread=0.1):
    """Errors of u and f at random pixels and at the last, the ends' largest u, and the widest angle."""
    light, viewer = normalise(rng.normal(size=(2, 3)))
    halfway, direction = quantise(normalise(light + viewer)), quantise(light)
    h, d = unit(halfway), unit(direction)
    left, right = spans_about(rng, count, angle, h, spread, normal_pairs)
    left, right = quantise(left), quantise(right)
    length = np.broadcast_to(length, count)
    diffuse, highlight, out_of_range = setup(left, right, direction, halfway, length)
    assert not out_of_range.any()
    step = np.where(rng.random(count) < 0.5, length - 1, rng.integers(0, length))
    t = step / np.maximum(length - 1, 1)
    ends = unit(left), middle(unit(left), unit(right)), unit(right)
    u = [half_chord(n, h) for n in ends]
    f = [n @ d for n in ends]
    return (
        np.abs(at(highlight, step) - ONE_VALUE * quadratic(u, t)),
        np.abs(at(diffuse, step) - ONE_VALUE * quadratic(f, t)),
        np.maximum(u[0], u[2]),
        turned(ends[0], ends[2]).max(),
    )


def check(rng, angle, length, normal_pairs, count=20_000):
    """Both bounds, with u anywhere and near the peak; the largest errors."""
    u_error, f_error, u, widest = errors(rng, count, angle, length, normal_pairs)
    p = ChordSetup()
    assert widest < angle + 2e-3
    assert np.all(u_error <= p.highlight_error(widest, u))
    assert f_error.max() <= p.diffuse_error(widest)
    near = u < 0.05
    assert np.count_nonzero(near) > count // 5
    return u_error.max(), u_error[near].max(), f_error.max(), widest


@pytest.mark.parametrize("angle", ANGLES)
def test_error(angle, normal_pairs):
    """Random lengths: within the bounds, which are not far from what happens."""
    rng = np.random.default_rng(int(angle * 10))
    length = rng.integers(2, 4095, 20_000, endpoint=True)
    anywhere, near, diffuse, widest = check(rng, angle, length, normal_pairs)
    p = ChordSetup()
    assert anywhere > p.highlight_error(widest) / 8
    assert near > p.highlight_error(widest, 0.05) / 8
    assert diffuse > p.diffuse_error(widest) / 8


@pytest.mark.parametrize("terms", [1, 2, 3])
@pytest.mark.parametrize("fraction_bits", [36, 40, 46])
def test_fewer_terms_and_bits_keep_the_bounds(terms, fraction_bits, normal_pairs, monkeypatch):
    """Those of a span as wide and as long as they allow; the bounds are hardly larger than in full."""
    rng = np.random.default_rng(terms)
    p = ChordSetup(terms, fraction_bits)
    assert p.longest == {36: 127, 40: 511, 46: 4095}[fraction_bits]
    angle = p.max_angle - 0.01
    monkeypatch.setitem(globals(), "ChordSetup", lambda: p)
    for length in (2, 3, p.longest):
        check(rng, angle, length, normal_pairs)
    for function in ("highlight_error", "diffuse_error"):
        full = getattr(type(p)(), function)(angle)
        assert full / 2 < getattr(p, function)(angle) < 1.1 * full


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
@pytest.mark.parametrize("angle", ANGLES)
def test_stiff_angles_and_lengths(angle, length, normal_pairs):
    check(np.random.default_rng(length), angle, length, normal_pairs, count=5_000)


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_equal_normals_stay_constant(length, normal_pairs):
    """No difference at all, whatever the length of the vectors."""
    rng = np.random.default_rng(length)
    normals = quantise(normal_pairs(rng, 2000, 0.0)[0])
    normals[:200] = rng.integers(-ONE // 2, ONE // 2, (200, 3))
    vectors = quantise(normal_pairs(rng, 3, 0.0)[0])
    diffuse, highlight, out_of_range = setup(normals, normals, vectors, vectors, np.full(2000, length))
    assert not out_of_range.any()
    for differences in (diffuse, highlight):
        assert differences.start.codes.any()
        assert not differences.first.codes.any()
        assert not differences.second.codes.any()


@pytest.mark.parametrize("angle", [1e-3, 1.0, 15.0])
def test_stiff_peak_on_an_end_and_in_the_middle(angle):
    """An end that is H has u = 0, exactly; a middle that is H has it within the bound."""
    up = np.array([0, 0, ONE])
    half = np.radians(angle) / 2
    left, right = (quantise(np.array([s * np.sin(half), 0, np.cos(half)])) for s in (-1, 1))
    length = np.array([17])
    _, highlight, _ = setup(up, right, up, up, length)
    assert highlight.start.codes[0, 0] == 0
    _, highlight, _ = setup(left, right, up, up, length)
    end = half_chord(unit(right), up / ONE)
    assert abs(at(highlight, np.array([8]))[0]) <= ChordSetup().highlight_error(angle + 2e-3, end)
    assert abs(at(highlight, np.array([16]))[0] - ONE_VALUE * end) <= ChordSetup().highlight_error(angle, end)


def test_stiff_lengths_of_vectors(normal_pairs):
    """Lengths of 1 +- 1/256: u feels them at second order and times u, f at first."""
    rng = np.random.default_rng(5)
    up = np.array([0, 0, ONE])
    for stretch in (1 - 1 / 256, 1.0):
        left, right = normal_pairs(rng, 2000, 5.0)
        near = np.abs(left[:, 2]) < 0.9
        left, right = (np.rint(v[near] * ONE * stretch).astype(int) for v in (left, right))
        diffuse, highlight, out_of_range = setup(left, right, up, up, np.full(len(left), 2))
        assert not out_of_range.any()
        e = 1 - stretch
        for step, normals in ((0, left), (1, right)):
            n = unit(normals)
            u = ONE_VALUE * half_chord(n, up / ONE)
            size = np.abs(at(highlight, np.full(len(left), step)) - u)
            assert np.all(size <= e**2 / 2 + e * u + 5e-5)
            f = ONE_VALUE * n[:, 2]
            assert np.all(np.abs(at(diffuse, np.full(len(left), step)) - f) <= e + 2e-5)


@pytest.mark.parametrize("bend", [False, True])
def test_stiff_drift_over_4095_pixels(bend):
    """The rounding of the differences, ``2^-46 (k + k^2/2)`` at pixel k: the worst of many."""
    rng = np.random.default_rng(46 + bend)
    count, length = 200_000, np.full(200_000, 4095)
    p = ChordSetup()
    slopes = rng.integers(-(2**33), 2**33, (count, 1))
    bends = rng.integers(-(2**17), 2**17, (count, 1)) * bend
    start = Fixed(p.CHORD_FORMAT, np.zeros((count, 1), dtype=np.int64))
    differences = p.differences(
        start, Fixed(p.SLOPE_FORMAT, slopes), Fixed(p.BEND_FORMAT, bends), *p.steps(length)
    )
    reciprocal, shift, square, square_shift = step_words(np.array([4095]))
    k = 4094
    # In codes of 80 fraction bits, exact with the words of dt and dt^2.
    along = slopes[:, 0].astype(object) * int(reciprocal.codes[0]) << 29 - int(shift[0])
    across = bends[:, 0].astype(object) * int(square.codes[0]) << 45 - int(square_shift[0])
    exact = k * along + k**2 * across
    first, second = (d.codes[:, 0].astype(object) << 34 for d in differences[1:])
    drift = np.abs((k * first + k * (k - 1) // 2 * second - exact).astype(float)) * 2.0**-80
    bound = 2.0**-46 * (k + k**2 / 2) if bend else 2.0**-46 * k
    assert drift.max() <= bound
    assert drift.max() > 0.9 * (bound if bend else bound / 2)


def test_flag():
    """At 22.5 degrees, within what rounding moves a normal."""
    angle = np.radians(np.r_[np.linspace(0, 22.49, 50), np.linspace(22.52, 180, 50)])
    rng = np.random.default_rng(6)
    for axis, side in (np.eye(3)[:2], np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]):
        right = np.cos(angle)[:, np.newaxis] * axis + np.sin(angle)[:, np.newaxis] * side
        left = np.broadcast_to(quantise(axis), (100, 3))
        vector = quantise(axis)
        _, _, out_of_range = setup(left, quantise(right), vector, vector, np.full(100, 9))
        np.testing.assert_array_equal(out_of_range, angle > np.radians(22.5))


def test_lights_are_independent(normal_pairs):
    rng = np.random.default_rng(7)
    left, right = (quantise(v) for v in normal_pairs(rng, 500, 10.0))
    direction, halfway = (quantise(normal_pairs(rng, 3, 0.0)[0]) for _ in range(2))
    length = rng.integers(1, 4096, 500)
    together = setup(left, right, direction, halfway, length)
    for light in range(3):
        alone = setup(left, right, direction[light], halfway[light], length)
        for both, one in zip(together[:2], alone[:2], strict=True):
            for a, b in zip(both, one, strict=True):
                np.testing.assert_array_equal(a.codes[:, light], b.codes[:, 0])


def test_refuses():
    vector = Fixed(COMPONENT, np.array([[0, 0, ONE]]))
    other = Fixed(SQ(2, 16), np.array([[0, 0, 1]]))
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 17\)$"):
        ChordSetup().compute(vector, other, vector, vector, np.array([1]))
    for length in (0, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            ChordSetup().compute(vector, vector, vector, vector, np.array([length]))


# The fit itself, in float64.


def along(t, psi):
    """Angle from the left normal of ``normalise((1-t) N_l + t N_r)``."""
    return np.arctan2(t * np.sin(psi), (1 - t) + t * np.cos(psi))


def three_points(function, psi, t):
    return quadratic([function(0.0), function(psi / 2), function(psi)], t)


def fit_error(model, exponent, psi):
    """Largest error of the specular term of the fit in LSB, over where H stands: beta and lambda."""
    t = np.linspace(0, 1, 101)
    # From the middle outwards, one side: the other is its mirror. Beyond, all of the span is dark.
    reach = min(np.pi / 2, 3 / np.sqrt(exponent) + psi)
    azimuth = np.linspace(psi / 2, psi / 2 + reach, 300)[:, np.newaxis]
    worst = 0.0
    for beta in np.linspace(0, min(np.pi / 2, 3 / np.sqrt(exponent)), 40):

        def u(a, beta=beta):
            return 1 - np.cos(beta) * np.cos(azimuth - a)

        exact, fit = u(along(t, psi)), three_points(u, psi, t)
        terms = [REFLECTION_MODELS[model].reflect(1 - value, exponent) for value in (fit, exact)]
        worst = max(worst, 255 * np.abs(terms[0] - terms[1]).max())
    return worst


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_fit_of_the_highlight(exponent):
    """At `largest_span_angle`, every model at full reflection: at most a quarter of an LSB."""
    psi = np.radians(largest_span_angle(exponent))
    errors = {model: fit_error(model, exponent, psi) for model in MODELS}
    print(exponent, errors)
    assert max(errors.values()) <= 0.25
    if exponent >= 10:
        assert max(errors.values()) > 0.15


def test_fit_of_the_diffuse_term():
    t = np.linspace(0, 1, 401)
    azimuth = np.linspace(0, 2 * np.pi, 1441)[:, np.newaxis]
    psi = np.radians(largest_span_angle(1))

    def f(a):
        return np.cos(azimuth - a)

    worst = 255 * np.abs(three_points(f, psi, t) - f(along(t, psi))).max()
    assert 0.1 < worst <= 0.12


def steepest(model, exponent):
    """Largest slope of the term over u; a chord over small steps of a float64 curve."""
    u = np.linspace(0, 4 / exponent, 4001)
    return np.abs(np.diff(REFLECTION_MODELS[model].reflect(1 - u, exponent)) / np.diff(u)).max() * (1 + 1e-3)


def total_error(rng, count, model, exponent, normal_pairs):
    """Fit and arithmetic together in LSB of a full channel, highlight and diffuse."""
    light, viewer = normalise(rng.normal(size=(2, 3)))
    halfway, direction = quantise(normalise(light + viewer)), quantise(light)
    h, d = unit(halfway), unit(direction)
    angle = rng.uniform(0, largest_span_angle(exponent) - 2e-3, count)
    angle[::4] = largest_span_angle(exponent) - 2e-3
    left, right = spans_about(rng, count, angle, h, 1.5 / np.sqrt(exponent), normal_pairs)
    left, right = quantise(left), quantise(right)
    length = rng.integers(2, 4095, count, endpoint=True)
    diffuse, highlight, out_of_range = setup(left, right, direction, halfway, length)
    assert not out_of_range.any()
    step = rng.integers(0, length)
    t = (step / (length - 1))[:, np.newaxis]
    normals = normalise((1 - t) * unit(left) + t * unit(right))
    u, exact = at(highlight, step) / ONE_VALUE, half_chord(normals, h)
    terms = [REFLECTION_MODELS[model].reflect(1 - value, exponent) for value in (u, exact)]
    lit = np.count_nonzero(terms[1] > 0.1)
    return (
        255 * np.abs(terms[0] - terms[1]).max(),
        255 * np.abs(at(diffuse, step) / ONE_VALUE - normals @ d).max(),
        lit,
    )


def check_total(rng, rounds, count, model, exponent, normal_pairs):
    """A quarter of an LSB for the fit and what `highlight_error` allows; together under a half."""
    angle = largest_span_angle(exponent)
    # u of an end of a span that is lit somewhere, the curve from its zero on being flat.
    lit = np.arccos(max(1 - 2 / exponent, -1)) + np.radians(angle)
    largest = 1 - np.cos(min(lit, np.pi))
    arithmetic = 255 * steepest(model, exponent) * float(ChordSetup().highlight_error(angle, largest))
    assert 0.25 + arithmetic < 0.5
    worst = 0.0
    for _ in range(rounds):
        highlight, diffuse, lit = total_error(rng, count, model, exponent, normal_pairs)
        assert lit > count // 50
        assert highlight <= 0.25 + arithmetic
        assert diffuse <= 0.12 + 255 * ChordSetup().diffuse_error(angle)
        worst = max(worst, highlight)
    print(f"{model} n = {exponent}: {worst:.3f} LSB, {0.25 + arithmetic:.3f} allowed")
    assert worst > 0.05


@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100, 500, 1000])
def test_total_error(exponent, normal_pairs):
    """A seventh of 10^6 spans an exponent, each at a random pixel."""
    check_total(np.random.default_rng(exponent), 3, 48_000, "cosquad", exponent, normal_pairs)


@pytest.mark.long
@pytest.mark.parametrize("model", ["cosquad", "lyon3"])
@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100, 500, 1000])
def test_total_error_of_ten_million_spans(model, exponent, normal_pairs):
    check_total(np.random.default_rng(exponent + 1), 10, 75_000, model, exponent, normal_pairs)
