"""Recurrence unit against float64 cosines, and the figures of numbers.md."""

import numpy as np
import pytest

from golden.fixed import SQ, Fixed
from golden.recurrence import RECURRENCE_FORMS, Recurrence, shortcut_cosine

LARGEST = 1 - 2.0**-16
"""Amplitude of two equal unit vectors."""


def run(recurrence, length, angle, phase, amplitude):
    """States and results of spans of one length, with the exact cosines; all in shape (pixels, spans)."""
    angle, phase, amplitude = np.broadcast_arrays(angle, phase, amplitude)
    step = angle / max(length - 1, 1)
    coefficient, shift = recurrence.coefficient(step)
    first, second = recurrence.start(amplitude, phase, step)
    states = recurrence.states(first, second, coefficient, shift, length)
    exact = amplitude * np.cos(phase - step * np.arange(length)[:, np.newaxis])
    return states, recurrence.result(states).values, exact


def worst_state(recurrence, length, degrees, peak):
    """Largest error of the state itself, as numbers.md has it, with the peak in this place of the span."""
    angle = np.radians(degrees)
    states, _, exact = run(recurrence, length, angle, np.atleast_1d(peak) * angle, 1.0)
    half = 2.0 ** -(recurrence.fraction_bits + 1) if recurrence.form == "reinsch" else 0
    return np.abs(states.values - half - exact).max()


@pytest.mark.parametrize(
    ("length", "degrees", "fraction_bits", "published"),
    [(64, 10, 16, 0.015), (256, 60, 16, 0.40), (4095, 60, 24, 0.40), (4095, 60, 32, 1.5e-3)],
)
def test_published_errors_of_the_direct_form(length, degrees, fraction_bits, published):
    # The place of the peak is not published; this one gives all four figures.
    error = worst_state(Recurrence("direct", fraction_bits), length, degrees, 0.79)
    half_digit = 0.05 * 10.0 ** np.floor(np.log10(published))
    assert error == pytest.approx(published, abs=half_digit)


@pytest.mark.parametrize(("fraction_bits", "published"), [(16, 6e-5), (24, 3e-7)])
def test_published_errors_of_the_reinsch_form(fraction_bits, published):
    recurrence = Recurrence("reinsch", fraction_bits, guard_bits=20)
    peaks = np.linspace(-1, 2, 31)
    errors = [worst_state(recurrence, *span, peaks) for span in ((64, 10), (256, 60), (4095, 60))]
    assert published / 2 < max(errors) < published


def test_shortcut_cosine():
    steps = 256
    for degrees, published in ((10, 0.003), (60, 0.088)):
        angle = np.radians(degrees)
        exact = 2 * np.sin(angle / steps / 2) ** 2
        assert 1 - (1 - shortcut_cosine(angle, steps)) / exact == pytest.approx(published, abs=0.0005)


@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 60, 89.9, 90])
@pytest.mark.parametrize("length", [1, 2, 3, 16, 257, 4095])
def test_error_is_within_its_bound(length, degrees):
    rng = np.random.default_rng(length)
    recurrence = Recurrence()
    angle = np.radians(degrees) if length > 1 else 0.0
    peaks = np.r_[0, 0.5, 1, 0.5 + 0.5 / max(length - 1, 1), rng.uniform(-1, 2, 20)]
    phase = np.r_[peaks * angle, rng.uniform(-np.pi, np.pi, 40)]
    amplitude = np.r_[np.full(34, LARGEST), np.full(10, -LARGEST), rng.uniform(-LARGEST, LARGEST, 20)]
    _, results, exact = run(recurrence, length, angle, phase, amplitude)
    assert np.abs(results - exact).max() <= recurrence.error(length, angle)


def worst_words(recurrence, length, low, high):
    """Span angles in a range whose coefficient is rounded the most, up and down."""
    angles = np.radians(np.linspace(low, high, 20001))
    step = angles / (length - 1)
    coefficient, shift = recurrence.coefficient(step)
    miss = coefficient.values * 2.0 ** (2 - shift) / (4 * np.sin(step / 2) ** 2) - 1
    assert np.abs(miss).max() <= 2.0 ** -(recurrence.fraction_bits + 1)
    order = np.argsort(miss)
    return angles[np.r_[order[:20], order[-20:]]]


@pytest.mark.parametrize("degrees", [45, 60, 90])
def test_drift_over_4095_pixels(degrees):
    recurrence = Recurrence()
    # The worst rounding of K, with every x of one sign, so that all errors add up; and the peak elsewhere.
    angles = np.repeat(worst_words(recurrence, 4095, 0.7 * degrees, degrees), 3)
    phase = angles * np.tile([0.5, 0, 1], len(angles) // 3)
    states, results, exact = run(recurrence, 4095, angles, phase, LARGEST)
    bound = recurrence.error(4095, np.radians(degrees))
    assert np.abs(results - exact).max() <= bound
    # The state has no last rounding. The operand's roundings do not all have one sign, and sin(j d)/sin d is
    # under j, the more so the wider the span; a bound over four times the worst constructed would say little.
    drift = np.abs(states.values - 2.0**-17 - exact).max()
    assert (bound - 2.0**-18) / 4 < drift <= bound - 2.0**-18
    if degrees == 45:
        # One unit of the output word.
        assert drift < 2.0**-17


def test_cut_alone_drifts_as_stated():
    recurrence = Recurrence()
    format = recurrence.state_format
    first, second = Fixed.round(format, [LARGEST]), Fixed(format, np.array([0]))
    # K 2^(2-s) x is just under one step of the state: all of it is cut, on every pixel.
    largest, shift = recurrence.coefficient_format.max_code, np.array([46])
    coefficient = Fixed(recurrence.coefficient_format, np.array([largest]))
    states = recurrence.states(first, second, coefficient, shift, 4095)
    np.testing.assert_array_equal(states.codes, states.codes[0, 0])
    bend = coefficient.values[0] * 2.0**-44 * LARGEST * 4094 * 4093 / 2
    assert bend == pytest.approx(4.8e-7, abs=0.05e-7)
    assert 0.99 < bend / (format.step * 4094 * 4093 / 2) < 1


def test_direct_form_is_unstable():
    recurrence = Recurrence("direct")
    for length in (16, 64, 200):
        for degrees in (1, 10, 45):
            angle = np.radians(degrees)
            _, results, exact = run(recurrence, length, angle, np.linspace(0, 1, 21) * angle, LARGEST)
            bound = recurrence.error(length, angle)
            assert np.abs(results - exact).max() <= bound < 1.5
    # Beyond, no bound but that of its words, and the error says why.
    angle = np.radians(45)
    assert recurrence.error(4095, angle) == 3
    _, results, exact = run(recurrence, 4095, angle, np.linspace(0, 1, 21) * angle, LARGEST)
    assert np.abs(results - exact).max() > 0.25


@pytest.mark.parametrize("form", RECURRENCE_FORMS)
def test_equal_normals_stay(form):
    amplitude = np.array([LARGEST, 0.5, -0.75, 0.0])
    _, results, _ = run(Recurrence(form), 4095, 0.0, 0.0, amplitude)
    np.testing.assert_array_equal(results, np.tile(results[0], (4095, 1)))
    assert np.abs(results[0] - amplitude).max() <= 2.0**-17


def test_smallest_and_largest_steps():
    recurrence = Recurrence()
    steps = np.r_[0, 2.0 ** -np.arange(1, 60), np.pi / 2]
    coefficient, shift = recurrence.coefficient(steps)
    exact = 4 * np.sin(steps / 2) ** 2
    assert shift.min() == 0
    assert shift.max() == 47
    error = np.abs(coefficient.values * 2.0 ** (2 - shift) - exact)
    assert np.all(error <= np.maximum(exact * 2.0**-17, 2.0**-63))


def test_words_at_their_ends():
    direct = Recurrence("direct")
    ends = np.array([direct.state_format.min_code, direct.state_format.max_code])
    first, second, factor = (word.ravel() for word in np.meshgrid(ends, ends, ends))
    found = direct.states(
        *(Fixed(direct.state_format, word) for word in (first, second, factor)), np.zeros(8, int), 20
    )
    # Exact integers, one span after the other.
    for span in range(8):
        x = [int(first[span]), int(second[span])]
        while len(x) < 20:
            following = (2**15 - (x[-2] << 16) - x[-1] * int(factor[span])) >> 16
            x.append(min(max(following, -(2**17)), 2**17 - 1))
        assert found.codes[:, span].tolist() == x


def test_refusals():
    with pytest.raises(ValueError, match=r"^form must be one of reinsch, direct, not 'sine'$"):
        Recurrence("sine")
    for bits in (7, 33):
        with pytest.raises(ValueError, match=rf"^fraction_bits must be 8 to 32, not {bits}$"):
            Recurrence("direct", bits)
    for bits in (9, 29):
        with pytest.raises(ValueError, match=rf"^guard_bits must be 10 to 28, not {bits}$"):
            Recurrence(guard_bits=bits)
    recurrence = Recurrence()
    for step in (-1e-9, 1.58, np.nan):
        with pytest.raises(ValueError, match=r"^steps must be 0 to 90 degrees$"):
            recurrence.coefficient(step)
    coefficient, shift = recurrence.coefficient(np.array([0.1]))
    start = recurrence.start(0.5, np.array([0.0]), 0.1)
    with pytest.raises(ValueError, match=r"^shifts must be 0 to 63$"):
        recurrence.states(*start, coefficient, shift + 64, 3)
    wrong = Fixed(SQ(2, 16), np.array([0]))
    with pytest.raises(ValueError, match=r"^operands must be SQ\(2, 44\), .*, not SQ\(2, 16\), "):
        recurrence.states(wrong, start[1], coefficient, shift, 3)
