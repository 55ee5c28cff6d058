"""Recurrence unit against float64 cosines, and the published figures."""

import numpy as np
import pytest

from blysk.golden.cosines.recurrence import RECURRENCE_FORMS, Recurrence, shortcut_cosine
from blysk.golden.number.fixed import SQ, UQ, Fixed

INTERLEAVES = (1, 4)

LARGEST = 1 - 2.0**-16
"""Amplitude of two equal unit vectors."""
PEAKS = np.linspace(-1, 2, 31)
"""Positions of the highlight, in lengths of the span from its left end."""


def run(recurrence, length, angle, phase, amplitude):
    """States and results of spans of one length, and the exact cosines; each of shape (pixels, spans)."""
    angle, phase, amplitude = np.broadcast_arrays(angle, phase, amplitude)
    step = angle / max(length - 1, 1)
    coefficient, shift = recurrence.coefficient(step)
    first, second = recurrence.start(amplitude, phase, step)
    states = recurrence.states(first, second, coefficient, shift, length)
    exact = amplitude * np.cos(phase - step * np.arange(length)[:, np.newaxis])
    return states, recurrence.result(states).values, exact


def worst_state(recurrence, length, degrees, peak):
    """Largest error of the state itself. ``peak`` is the position of the peak in lengths of the span."""
    angle = np.radians(degrees)
    states, _, exact = run(recurrence, length, angle, np.atleast_1d(peak) * angle, 1.0)
    half = 2.0 ** -(recurrence.fraction_bits + 1) if recurrence.form == "reinsch" else 0
    return np.abs(states.values - half - exact).max()


@pytest.mark.parametrize(
    ("length", "degrees", "fraction_bits", "published"),
    [(64, 10, 16, 0.015), (256, 60, 16, 0.40), (4095, 60, 24, 0.40), (4095, 60, 32, 1.5e-3)],
)
def test_published_errors_of_the_direct_form(length, degrees, fraction_bits, published):
    # The position of the peak is not published. This position gives all four published figures.
    error = worst_state(Recurrence("direct", fraction_bits), length, degrees, 0.79)
    half_digit = 0.05 * 10.0 ** np.floor(np.log10(published))
    assert error == pytest.approx(published, abs=half_digit)


@pytest.mark.parametrize(("fraction_bits", "published"), [(16, 6e-5), (24, 3e-7)])
def test_published_errors_of_the_reinsch_form(fraction_bits, published):
    recurrence = Recurrence("reinsch", fraction_bits, guard_bits=20)
    errors = [worst_state(recurrence, *span, PEAKS) for span in ((64, 10), (256, 60), (4095, 60))]
    assert published / 2 < max(errors) < published


def test_shortcut_cosine():
    steps = 256
    for degrees, published in ((10, 0.003), (60, 0.088)):
        angle = np.radians(degrees)
        exact = 2 * np.sin(angle / steps / 2) ** 2
        assert 1 - (1 - shortcut_cosine(angle, steps)) / exact == pytest.approx(published, abs=0.0005)


def assert_keeps_the_bound(recurrence, length, angle, phase, amplitude=LARGEST):
    """Check that every result is within `Recurrence.error`. The result is the largest error."""
    _, results, exact = run(recurrence, length, angle, phase, amplitude)
    worst = np.abs(results - exact).max()
    assert worst <= recurrence.error(length, angle)
    return worst


@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 60, 89.9, 90])
@pytest.mark.parametrize("length", [1, 2, 3, 4, 5, 8, 9, 16, 257, 4095])
def test_stiff_spans_keep_the_bound(length, degrees):
    """Spans of every length and angle keep the bound.

    The peak is on a pixel, between two, inside and outside the span.
    """
    rng = np.random.default_rng(length)
    angle = np.radians(degrees) if length > 1 else 0.0
    peaks = np.r_[0, 0.5, 1, 0.5 + 0.5 / max(length - 1, 1), rng.uniform(-1, 2, 20)]
    phase = np.r_[peaks * angle, rng.uniform(-np.pi, np.pi, 40)]
    amplitude = np.r_[np.full(34, LARGEST), np.full(10, -LARGEST), rng.uniform(-LARGEST, LARGEST, 20)]
    for interleave in INTERLEAVES:
        assert_keeps_the_bound(Recurrence(interleave=interleave), length, angle, phase, amplitude)


@pytest.mark.parametrize("degrees", [120, 180])
@pytest.mark.parametrize("length", [16, 4095])
@pytest.mark.parametrize("interleave", INTERLEAVES)
def test_stiff_wide_spans_keep_the_bound(length, degrees, interleave):
    """The recurrence also works for angles over 90 degrees."""
    angle = np.radians(degrees)
    assert_keeps_the_bound(Recurrence(interleave=interleave), length, angle, PEAKS * angle)


@pytest.mark.parametrize("interleave", INTERLEAVES)
@pytest.mark.parametrize("degrees", [1, 45, 90])
def test_stiff_peaks(interleave, degrees):
    """A peak on a pixel has the value to which A is rounded.

    A peak half-way between two pixels gives equal neighbours under it.
    """
    recurrence, step = Recurrence(interleave=interleave), np.radians(degrees) / 32
    bound = recurrence.error(33, 32 * step)
    _, found, _ = run(recurrence, 33, 32 * step, np.array([16, 15.5]) * step, LARGEST)
    assert abs(found[16, 0] - LARGEST) <= bound
    assert abs(found[15, 1] - found[16, 1]) <= 2 * bound
    assert abs(found[15, 1] - LARGEST * np.cos(step / 2)) <= bound


def worst_words(recurrence, length, low, high):
    """The span angles in a range whose coefficient is rounded most, up and down."""
    angles = np.radians(np.linspace(low, high, 20001))
    step = angles / (length - 1)
    coefficient, shift = recurrence.coefficient(step)
    miss = coefficient.values * 2.0 ** (2 - shift) / (4 * np.sin(recurrence.interleave * step / 2) ** 2) - 1
    assert np.abs(miss).max() <= 2.0 ** -(recurrence.fraction_bits + 1)
    order = np.argsort(miss)
    return angles[np.r_[order[:20], order[-20:]]]


@pytest.mark.parametrize("degrees", [45, 60, 90])
@pytest.mark.parametrize("interleave", INTERLEAVES)
def test_stiff_drift_over_4095_pixels(degrees, interleave):
    recurrence = Recurrence(interleave=interleave)
    # The worst rounding of K, with all x of one sign, so that all errors add up; and other positions of the
    # peak.
    angles = np.repeat(worst_words(recurrence, 4095, 0.7 * degrees, degrees), 3)
    phase = angles * np.tile([0.5, 0, 1], len(angles) // 3)
    states, results, exact = run(recurrence, 4095, angles, phase, LARGEST)
    bound = recurrence.error(4095, np.radians(degrees))
    assert np.abs(results - exact).max() <= bound
    # The state has no last rounding. The operand's roundings do not all have the same sign, and sin(j d)/sin
    # d is under j, most of all in wide spans. A bound of more than four times the worst constructed error
    # would say little.
    drift = np.abs(states.values - 2.0**-17 - exact).max()
    assert (bound - 2.0**-18) / 4 < drift <= bound - 2.0**-18
    if degrees == 45:
        # One unit of the output word.
        assert drift < 2.0**-17


@pytest.mark.parametrize(("interleave", "stated"), [(1, 4.8e-7), (4, 3.0e-8)])
def test_cut_alone_drifts_as_stated(interleave, stated):
    recurrence = Recurrence(interleave=interleave)
    format, shape = recurrence.state_format, (1, 4)[: 1 + interleave // 4]
    first, second = Fixed.round(format, np.full(shape, LARGEST)), Fixed(format, np.zeros(shape, int))
    # K 2^(2-s) x is just under one step of the state, so all of it is cut at every pixel.
    largest, shift = recurrence.coefficient_format.max_code, np.array([46])
    coefficient = Fixed(recurrence.coefficient_format, np.array([largest]))
    states = recurrence.states(first, second, coefficient, shift, 4095)
    np.testing.assert_array_equal(states.codes, states.codes[0, 0])
    steps = 4096 // interleave - 1 - (interleave == 1)
    drift = coefficient.values[0] * 2.0**-44 * LARGEST * steps * (steps - 1) / 2
    assert drift == pytest.approx(stated, rel=0.02)
    assert 0.99 < drift / (format.step * steps * (steps - 1) / 2) < 1


@pytest.mark.parametrize(
    ("interleave", "spans", "largest", "drift"),
    [
        (1, [(length, degrees) for length in (16, 64, 200) for degrees in (1, 10, 45)], 1.5, 0.25),
        (4, [(64, 10), (256, 10), (800, 45)], 2, 0.02),
    ],
)
def test_direct_form_is_unstable(interleave, spans, largest, drift):
    """Interleaved, the error is that of a quarter of the steps.

    In long spans neither form has a useful bound.
    """
    recurrence, plain = Recurrence("direct", interleave=interleave), Recurrence("direct")
    peaks = np.linspace(0, 1, 21)
    for length, degrees in spans:
        angle = np.radians(degrees)
        bound = recurrence.error(length, angle)
        assert_keeps_the_bound(recurrence, length, angle, peaks * angle)
        assert bound < largest
        limit = plain.error(length, angle)
        assert interleave == 1 or bound < limit / 4 or limit == 3
    # Beyond, only the range of the words bounds the error.
    angle = np.radians(45)
    assert recurrence.error(4095, angle) == 3
    assert assert_keeps_the_bound(recurrence, 4095, angle, peaks * angle) > drift


@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 89.9, 90])
@pytest.mark.parametrize("length", [1, 2, 3, 5, 8, 9, 16, 257, 4095])
def test_prologue_keeps_its_bound(length, degrees):
    """Seven steps of the recurrence give the start values of the phases.

    The span that follows keeps its bound.
    """
    rng = np.random.default_rng(length)
    single, interleaved = Recurrence(), Recurrence(interleave=4)
    angle = np.radians(degrees) if length > 1 else 0.0
    step = np.full(200, angle / max(length - 1, 1))
    phase = np.r_[rng.uniform(-1, 2, 100) * angle, rng.uniform(-np.pi, np.pi, 100)]
    phase[:3] = [0, angle / 2, angle]
    start = interleaved.prologue(*single.start(LARGEST, phase, step), *single.coefficient(step))
    states = interleaved.states(*start, *interleaved.coefficient(step), length)
    exact = LARGEST * np.cos(phase - step * np.arange(length)[:, np.newaxis])
    added = interleaved.prologue_error(length, angle)
    assert np.abs(interleaved.result(states).values - exact).max() <= interleaved.error(length, angle) + added
    # The error grows only with the angle, as 4.5 psi^2/m 2^-F, and stays below the recurrence's psi^2/2 2^-F.
    if length >= 16:
        assert added < 0.9 * interleaved.error(length, angle)
    if length == 4095:
        assert added < 2.0**-17 / 100


def test_prologue_gives_what_start_gives():
    single, interleaved = Recurrence(), Recurrence(interleave=4)
    step, phase = np.radians(np.geomspace(1e-5, 11, 500)), np.linspace(-3, 3, 500)
    found = interleaved.prologue(*single.start(LARGEST, phase, step), *single.coefficient(step))
    error = (1.01 * step**2 + 2.0**-47) * 2.0**-16 + 2.0**-44
    for word, exact, factor in zip(found, interleaved.start(LARGEST, phase, step), (3, 18), strict=True):
        assert np.all(np.abs(word.values - exact.values).max(axis=1) <= factor * error + 2.0**-42)


def test_start_values_from_short_sines():
    """If a difference is a small number times a sine of 17 bits, it costs psi times the error of the sine."""
    recurrence, length, angle = Recurrence(interleave=4), 4095, np.radians(60)
    step = np.full(100, angle / 4094)
    phase = np.linspace(-1, 2, 100) * angle
    phases = np.arange(4)
    sine = np.floor(np.sin(phase[:, np.newaxis] - (phases + 2) * step[:, np.newaxis]) * 2.0**17) * 2.0**-17
    first = np.floor(np.cos(phase[:, np.newaxis] - phases * step[:, np.newaxis]) * 2.0**17) * 2.0**-17
    first, second = (
        Fixed.round(recurrence.state_format, LARGEST * word)
        for word in (first, 2 * np.sin(2 * step)[:, np.newaxis] * sine)
    )
    states = recurrence.states(first, second, *recurrence.coefficient(step), length)
    exact = LARGEST * np.cos(phase - step * np.arange(length)[:, np.newaxis])
    error = np.abs(recurrence.result(states).values - exact).max()
    own = recurrence.error(length, angle)
    assert error <= own + 2.0**-17 * (1 + angle)
    assert error > own / 2


@pytest.mark.parametrize("interleave", INTERLEAVES)
@pytest.mark.parametrize("form", RECURRENCE_FORMS)
def test_stiff_equal_normals_stay(form, interleave):
    amplitude = np.array([LARGEST, 0.5, -0.75, 0.0])
    _, results, _ = run(Recurrence(form, interleave=interleave), 4095, 0.0, 0.0, amplitude)
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


def test_stiff_words_at_their_ends():
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


def test_stiff_steps_past_those_of_an_interleaved_span():
    """In spans of up to 4 pixels of up to 90 degrees the coefficient is that of 90 degrees, and nothing reads
    it."""
    recurrence = Recurrence(interleave=4)
    for length in (2, 3, 4):
        angle = np.radians(90)
        _, results, exact = run(recurrence, length, angle, np.linspace(-1, 2, 31) * angle, LARGEST)
        assert np.abs(results - exact).max() <= 2.0**-18 + 2.0**-44
    steps = np.radians([22.5, 30, 45, 90])
    coefficient, shift = recurrence.coefficient(steps)
    assert set(zip(coefficient.values, shift, strict=True)) == {(0.5, 0)}
    first, second = recurrence.start(1.0, np.zeros((3, 4)), steps)
    assert first.shape == second.shape == (3, 4, 4)


@pytest.mark.parametrize("form", RECURRENCE_FORMS)
@pytest.mark.parametrize(("length", "degrees"), [(1, 0), (3, 1), (64, 1), (64, 10), (1000, 1)])
def test_result_of_more_bits(form, length, degrees):
    """Without the last rounding the bound still holds.

    In the stable form it is then smaller than that of 17 bits.
    """
    short, long = (Recurrence(form, result_format=format) for format in (SQ(1, 17), SQ(2, 25)))
    angle = np.radians(degrees)
    assert_keeps_the_bound(long, length, angle, PEAKS * angle)
    if form == "reinsch" and degrees <= 1:
        assert long.error(length, angle) < short.error(length, angle) / 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("reinsch", 16, 28, 1, UQ(1, 25)), "result_format must be signed, of at most 44 fraction bits, "),
        (("reinsch", 16, 28, 1, SQ(2, 45)), "result_format must be signed, of at most 44 fraction bits, "),
        (("reinsch", 16, 28, 2), "interleave must be 1 or 4, not 2$"),
        (("sine",), "form must be one of reinsch, direct, not 'sine'$"),
        (("direct", 7), "fraction_bits must be 8 to 32, not 7$"),
        (("direct", 33), "fraction_bits must be 8 to 32, not 33$"),
        (("reinsch", 16, 9), "guard_bits must be 10 to 28, not 9$"),
        (("reinsch", 16, 29), "guard_bits must be 10 to 28, not 29$"),
    ],
)
def test_refuses(arguments, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        Recurrence(*arguments)


def test_refuses_operands():
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
