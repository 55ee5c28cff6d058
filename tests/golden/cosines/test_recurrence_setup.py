"""Recurrence setup against the curve in float64, for spans of every length and angle."""

import numpy as np
import pytest

from blysk.bench.units.operands import component_words, dot, pairs_at, sphere, word_ends
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.reciprocal import reciprocal_address
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise, values
from blysk.golden.reference.curves import interpolate

SETUP = RecurrenceSetup()
LENGTHS = [1, 2, 3, 4, 5, 8, 9, 16, 257, 4095]
ANGLES = [0, 1e-4, 0.01, 0.1, 1, 5, 20, 45, 59, 61, 89.9, 90]


def curve(left, right, vector, length):
    """``(a sin(psi - k d) + b sin(k d))/sin psi`` of codes, shape (pixels, spans)."""
    left, right, vector = (values(v) for v in (left, right, vector))
    a, b = dot(left, vector), dot(right, vector)
    q = np.minimum(dot(right - left, right - left) / 2, 1)
    psi = 2 * np.arcsin(np.sqrt(q / 2))
    t = np.arange(length)[:, np.newaxis] / max(length - 1, 1)

    def weight(t):
        return t * np.sinc(t * psi / np.pi) / np.sinc(psi / np.pi)

    return a * weight(1 - t) + b * weight(t)


def states_of(setup, left, right, vector, length):
    *start, out_of_range = setup.compute(*component_words(left, right, vector), np.full(len(left), length))
    return setup.recurrence.states(*start, length), out_of_range


def error_of(setup, spans, length):
    """Largest error of the results along spans of one length, none of which is out of range."""
    states, out_of_range = states_of(setup, *spans, length)
    assert not out_of_range.any()
    return np.abs(setup.recurrence.result(states).values - curve(*spans, length)).max()


def make_spans(rng, count, degrees):
    """Spans and vectors. Half of the vectors are near the spans, so that the peak is inside."""
    left, right = pairs_at(rng, count, degrees)
    vector = sphere(rng, count)
    near = slice(0, count // 2)
    t = rng.uniform(0, 1, count // 2)
    vector[near] = interpolate("normalised", left[near], right[near], t)
    return quantise(left), quantise(right), quantise(vector)


@pytest.mark.parametrize("degrees", ANGLES)
@pytest.mark.parametrize("length", LENGTHS)
def test_stiff_spans_keep_the_bound(length, degrees):
    spans = make_spans(np.random.default_rng(length), 200 if length < 4095 else 60, degrees)
    assert error_of(SETUP, spans, length) <= SETUP.error(length, np.radians(degrees))


@pytest.mark.parametrize(("degrees", "stated"), [(0, 0.016), (1, 0.3), (10, 2.7), (45, 12), (90, 25)])
def test_largest_errors_are_as_stated(degrees, stated):
    """Errors are as stated, in units of 1e-6.

    The bound is at most 7.5 times the largest error of many spans.
    """
    rng, lengths = np.random.default_rng(1), (2, 3, 4, 5, 9, 16, 17, 33, 100, 1000)
    worst = max(error_of(SETUP, make_spans(rng, 2000, degrees), length) for length in lengths)
    assert stated * 0.75e-6 <= worst <= stated * 1e-6
    assert SETUP.error(4095, np.radians(degrees)) < 7.5 * worst


def test_curve_is_slerp():
    """The curve of the setup is the great circle."""
    rng = np.random.default_rng(2)
    left, right, vector = make_spans(rng, 200, rng.uniform(1, 90, 200))
    t = np.linspace(0, 1, 50)[:, np.newaxis]
    normals = interpolate("slerp", values(left), values(right), t)
    exact = dot(normals, values(vector))
    # The codes do not have exactly unit length, and at each end the curve follows the length of the end.
    assert np.abs(curve(left, right, vector, 50) - exact).max() < 2e-5


@pytest.mark.parametrize("length", [1, 2, 5, 16, 4095])
def test_stiff_equal_normals_stay_to_the_bit(length):
    rng = np.random.default_rng(3)
    left, _, vector = make_spans(rng, 300, 0)
    states, _ = states_of(SETUP, left, left, vector, length)
    np.testing.assert_array_equal(states.codes, np.broadcast_to(states.codes[0], states.shape))


@pytest.mark.parametrize("length", [2, 16, 4095])
def test_stiff_normals_a_step_apart(length):
    """The chord is a few codes long, so its direction is arbitrary, and its length along H is far from a
    sine."""
    rng = np.random.default_rng(4)
    left, _, vector = make_spans(rng, 400, 0)
    right = np.clip(left + rng.integers(-1, 2, left.shape), -ONE, ONE)
    assert error_of(SETUP, (left, right, vector), length) <= SETUP.error(length, 2e-5)


@pytest.mark.parametrize("degrees", [1, 20, 90])
@pytest.mark.parametrize(("length", "at"), [(17, 0), (17, 0.5), (17, 1), (16, 0.5)])
def test_stiff_peaks(degrees, length, at):
    """The peak is on the first, the middle or the last pixel, or between two pixels."""
    left, right = pairs_at(np.random.default_rng(5), 200, degrees)
    codes = [quantise(v) for v in (left, right, interpolate("slerp", left, right, np.full(200, at)))]
    bound = SETUP.error(length, np.radians(degrees))
    found = SETUP.recurrence.result(states_of(SETUP, *codes, length)[0]).values
    assert np.abs(found - curve(*codes, length)).max() <= bound
    peak = np.cos(np.radians(degrees) / (length - 1) / 2) if length == 16 else 1
    # The codes lie within 2^-17 of the great circle, which changes the cosine at second order. They have unit
    # length to about 2^-18.
    assert np.abs(found.max(axis=0) - peak).max() <= bound + 2.0**-17


@pytest.mark.parametrize(
    ("degrees", "flagged"), [(89.99, False), (90, False), (90.02, True), (120, True), (180, True)]
)
def test_spans_out_of_range_are_flagged(degrees, flagged):
    _, out_of_range = states_of(SETUP, *make_spans(np.random.default_rng(6), 500, degrees), 2)
    assert np.all(out_of_range == flagged)


@pytest.mark.parametrize("length", [2, 3, 5, 16, 2049, 4095])
def test_stiff_words_at_their_ends(length):
    """With codes of any size, lengths 0 to sqrt 3, the flag and x(0) are exact, and the angle follows the
    chord.

    x(0) is N_l.H, saturated at -2 and 2. Whatever the lengths, K belongs to an isosceles triangle with the
    chord of the span, within the relative error that `RecurrenceSetup.error` counts.
    """
    rng = np.random.default_rng(7)
    left, right, vector = word_ends(rng, 3, 3000, 3)
    setup, step = SETUP, 2.0**-34
    words = component_words(left, right, vector)
    first, _, coefficient, shift, out_of_range = setup.compute(*words, np.full(3000, length))
    unit = 1 + 2.0**-16
    chord = dot(right - left, right - left) / 2 * step * unit
    np.testing.assert_array_equal(out_of_range, chord >= 1 + 2.0**-13)
    assert 900 < np.count_nonzero(out_of_range) < 2100
    cosine = dot(left, vector) * step * unit
    assert np.count_nonzero(np.abs(cosine) >= 2) > 20
    assert np.abs(first.values[:, 0] - np.clip(cosine, -2, 2 - step)).max() < step
    angle = 4 * 2 * np.arcsin(np.sqrt(np.minimum(chord, 1) / 2)) / (length - 1)
    used = ~out_of_range & (angle <= np.pi / 2)
    exact = 4 * np.square(np.sin(angle[used] / 2))
    found = coefficient.values[used] * 2.0 ** (2 - shift[used])
    word, table = 2.0**-18, setup.TABLE_ERROR
    relative = 9 * word + table + (word + table) / 0.81 + word / 0.40
    assert np.count_nonzero(used) > 200
    assert np.all(np.abs(found - exact) <= relative * exact)


def test_tables():
    """The values between the words of each table are within their bound.

    It counts the rounding of the words and the fit.
    """

    def assert_lines(tables, x, words, functions):
        for (table, changes), exact in zip(tables, functions, strict=True):
            address, rest = (x * words).astype(int), x * words % 1
            line = table.values[address] + changes.values[address] * rest
            assert np.abs(line - exact).max() <= SETUP.TABLE_ERROR - 2.0**-22

    x = np.linspace(0, 1, 200_001)[1:-1]
    psi = 2 * np.arcsin(np.sqrt(x / 2))
    assert_lines(SETUP.chord_tables, x, 512, (psi**2 / (2 * x) - 1, psi / np.sin(psi) - 1))
    x = np.linspace(0, np.square(np.pi / 2), 200_001)[1:]
    d = np.sqrt(x)
    assert_lines(SETUP.step_tables, x, 128, (1 - (2 * np.sin(d / 2) / d) ** 2, 1 - np.sin(d) / d))


def test_reciprocals():
    """Reciprocals of every length are within a relative 2^-17, and squares are as exact."""
    steps = np.arange(1, 4095)
    address, shift = reciprocal_address(steps)
    reciprocal, square, small = (word[address] for word in SETUP.reciprocals)
    assert np.abs(reciprocal.values * 2.0 ** (1 - shift) * steps - 1).max() <= 2.0**-17
    assert np.abs(square.values * 2.0 ** (2 - 2 * shift - small) * steps**2 - 1).max() <= 2.0**-17
    assert min(reciprocal.values.min(), square.values.min()) >= 0.5


@pytest.mark.parametrize("degrees", [1, 20, 90])
@pytest.mark.parametrize("length", [1, 3, 5, 16, 64])
def test_direct_form(length, degrees):
    """Start values and coefficient are as exact as those of `Recurrence.start`, so the error bound of the
    recurrence holds."""
    setup, angle = RecurrenceSetup(Recurrence("direct", interleave=4)), np.radians(degrees)
    error = error_of(setup, make_spans(np.random.default_rng(8), 300, degrees), length)
    own = SETUP.error(length, angle)
    # An error of a start value counts once for each step. The error of the coefficient is 2^-16.
    steps = np.ceil(length / 4)
    assert error <= setup.recurrence.error(length, angle) + own * (1 + 2 * steps)


def test_refuses():
    for recurrence in (Recurrence(), Recurrence("direct"), Recurrence(interleave=4, fraction_bits=20)):
        with pytest.raises(ValueError, match=r"^the recurrence must be "):
            RecurrenceSetup(recurrence)
    normals = Fixed(COMPONENT, np.array([[ONE, 0, 0]]))
    for length in (0, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            SETUP.compute(normals, normals, normals, np.array([length]))
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 17\)$"):
        SETUP.compute(normals, normals, Fixed(SQ(2, 16), np.zeros((1, 3), int)), np.array([1]))
