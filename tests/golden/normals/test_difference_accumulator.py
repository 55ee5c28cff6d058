"""Accumulator: its closed form, its drift, and the normals of whole spans against float64."""

import numpy as np
import pytest

from blysk.bench.units.operands import any_codes, component_words, pairs_at, pairs_of_length
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.reference.curves import interpolate

UNIT = DifferenceAccumulator()
FORMAT = UNIT.format
STEP = 2.0**-17
UNITS = 2**25
"""Units of the accumulator, ``2^-42``, in a step of the normal."""


def compute(start, first, second, length):
    words = Fixed(COMPONENT, start), Fixed(FORMAT, first), Fixed(FORMAT, second)
    return UNIT.compute(*words, *pixels_of(np.full(len(start), length)))


def whole_spans(left, right, length):
    """Normals of the pixels from codes of end normals, flags, and G, P and the middle."""
    left, right = component_words(left, right)
    middle, out_of_range = MiddleNormal().compute(left, right)
    g, p, q = GPQ().compute(left, middle, right)
    lengths = np.full(len(left.codes), length)
    normals = UNIT.compute(q, *DifferenceSetup().compute(g, p, lengths), *pixels_of(lengths))
    return normals, out_of_range, (g, p, middle)


def curve_of(left, right, length):
    """Quadratic through unit normals and the middle between them, in float64."""
    span, step = pixels_of(np.full(len(left), length))
    return interpolate("quadratic", left[span], right[span], step / max(length - 1, 1)) * (ONE * STEP)


def test_stiff_closed_form_equals_the_recurrence_and_its_wraps():
    """The closed form also wraps as the additions do: any start, and differences over their whole words,
    added one by one."""
    rng, count, length = np.random.default_rng(1), 200, 500
    start, first, second = (any_codes(rng, format, count, 3) for format in (COMPONENT, FORMAT, FORMAT))
    normals = compute(start, first, second, length).codes.reshape(count, length, 3)

    def wrap(codes):
        return (codes + 2**43) % 2**44 - 2**43

    normal, difference = start * UNITS + UNITS // 2, first
    for k in range(length):
        expected = np.clip(wrap(normal) >> 25, COMPONENT.min_code, COMPONENT.max_code)
        np.testing.assert_array_equal(normals[:, k], expected)
        normal, difference = wrap(normal + difference), wrap(difference + second)


def test_stiff_drift_of_the_worst_case():
    """The differences are rounded up as far as possible, and so is the last rounding.

    ``G dt^2`` and ``P dt`` are each half a unit, 2^-43, under their code. The second difference is then a
    whole unit too large, and so is the first. After k pixels this makes ``k + k (k - 1)/2`` units, of the
    docstring's ``k + k^2/2``. With 2^-18 of the last rounding it is under a step, 2^-17, up to the last
    pixel.
    """
    assert STEP > 2.0**-42 * (4094 + 4094**2 / 2) + 2.0**-18
    k, start, second = np.arange(4095), 1000, 2 * 12345
    # The first difference for which the sum at the last pixel is exactly the half that rounds up: 4094 first
    # + 4094 * 4093 / 2 second = 2^24 modulo 2^25.
    rest = (UNITS // 2 - 2047 * 4093 * second) // 2
    first = rest * pow(2047, -1, UNITS // 2) % (UNITS // 2)
    assert (4094 * first + 2047 * 4093 * second) % UNITS == UNITS // 2
    codes = compute(*(np.full((1, 3), word) for word in (start, first, second)), 4095).codes[:, 0]
    exact = start * UNITS + k * (first - 1) + k * (k - 1) // 2 * (second - 1)
    error = (codes * UNITS - exact) / UNITS
    bound = (k + k**2 / 2) / UNITS + 0.5
    assert (np.abs(error) <= bound).all()
    assert np.abs(error).max() <= 1
    assert error[-1] > 0.999 * bound[-1]


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_drift_against_the_curve_with_exact_differences(length):
    """No pixel is off by more than one step.

    The differences are rounded to 42 bits from float64, where t is exact.
    """
    rng, count = np.random.default_rng(length), 40 if length > 100 else 5000
    start = rng.integers(-60_000, 60_000, (count, 3))
    dt = 1 / max(length - 1, 1)
    p, g = rng.uniform(-0.25, 0.25, (2, count, 3))
    g_term, p_term = (np.floor(np.ldexp(x, 42) + 0.5).astype(np.int64) for x in (g * dt * dt, p * dt))
    normals = compute(start, p_term + g_term, 2 * g_term, length)
    span, k = pixels_of(np.full(count, length))
    k = k[:, np.newaxis]
    error = np.abs(normals.values - (start[span] * STEP + p[span] * k * dt + g[span] * (k * dt) ** 2))
    assert (error <= 2.0**-18 + 2.0**-42 * (k + k**2 / 2) + 2.0**-50).all()
    assert error.max() < STEP
    # A span of one pixel gives its start exactly.
    assert error.max() > 0.9 * 2.0**-18 if length > 2 else length > 1 or error.max() == 0


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
@pytest.mark.parametrize("angle", [0, 1e-4, 1, 20, 45])
def test_stiff_whole_spans(angle, length):
    """Against curves of the unquantised ends, every component is within the sum of the units' bounds.

    An end is off by less than a step a component, and the middle by ``1 / (2 cos(psi/2))`` of both ends. With
    the change of h this is under 1.09 steps. The three weights of a quadratic through t = 0, 1/2, 1 add up to
    at most 1.25 in magnitude. The middle adds `MiddleNormal.ERROR`, with a weight of at most 1, the setup the
    bound in its docstring, the accumulator 2^-18.
    """
    count = max(20, 30_000 // length)
    ends = pairs_at(np.random.default_rng(length), count, angle)
    left, right = (quantise(end) for end in ends)
    normals, out_of_range, _ = whole_spans(left, right, length)
    assert not out_of_range.any()
    half = np.radians(angle) / 2
    largest_g, largest_p = 4 * (1 - np.cos(half)), 2 * half * 1.06
    # 1/(2 cos) of both ends, and the change of h with r: sqrt(3) steps of each end along the other.
    middle_of_ends = 1 / np.cos(half) + np.sqrt(3) / 4
    bound = 1.25 * middle_of_ends * STEP + MiddleNormal.ERROR
    bound += STEP * (largest_p + 3 * STEP) + 3 * STEP * (largest_g + 9 * STEP)
    bound += 2.0**-42 * (length + length**2 / 2) + 2.0**-18
    error = np.abs(normals.values - curve_of(*ends, length))
    assert bound / 20 < error.max() <= bound
    # The first end is exact. The last end is off by the error of dt, which a flat span does not have.
    codes = normals.codes.reshape(count, length, 3)
    np.testing.assert_array_equal(codes[:, 0], left)
    if length > 1:
        assert np.abs(codes[:, -1] - right).max() <= (0 if angle == 0 else 2 + 5 * (angle > 1))
    if angle == 0:
        np.testing.assert_array_equal(codes, np.repeat(left[:, np.newaxis], length, axis=1))


def test_lengths_of_the_normals():
    """At 20 degrees the curve is at most 2.9e-5 too short, as published. Quantisation adds less than 1e-5."""
    ends = pairs_at(np.random.default_rng(9), 5000, 20.0)
    normals, *_ = whole_spans(*(quantise(end) for end in ends), 33)
    curve, ours = (
        np.abs(np.linalg.norm(vectors, axis=1) * 2**17 / ONE - 1).max()
        for vectors in (curve_of(*ends, 33), normals.values)
    )
    assert curve == pytest.approx(2.9e-5, abs=0.05e-5)
    assert ours < curve + 1.5e-5


@pytest.mark.parametrize("angle", [45.01, 60, 89.9, 90, 135, 180])
def test_stiff_spans_out_of_range_are_flagged_and_stay_in_their_words(angle):
    ends = pairs_at(np.random.default_rng(10), 200, angle)
    normals, out_of_range, _ = whole_spans(*(quantise(end) for end in ends), 50)
    assert out_of_range.all()
    assert COMPONENT.min_code <= normals.codes.min() <= normals.codes.max() <= COMPONENT.max_code


@pytest.mark.parametrize("scale", [0, 1 - 1 / 256, 1 + 1 / 256])
@pytest.mark.parametrize("length", [2, 3, 16, 4095])
def test_stiff_lengths_of_the_ends(length, scale):
    """With ends of another length, or of none, every pixel is within the bounds of the quadratic through the
    three points.

    The setup adds the bound in its docstring, the accumulator 2^-18. A curve longer than 1 saturates.
    """
    rng, count = np.random.default_rng(11), max(20, 20_000 // length)
    left, right = pairs_of_length(rng, count, rng.uniform(0, 44, count), scale)
    normals, _, (g, p, middle) = whole_spans(left, right, length)
    span, step = pixels_of(np.full(len(left), length))
    t = (step / (length - 1))[:, np.newaxis]
    ends = ((1 - t) * (1 - 2 * t) * left[span] + t * (2 * t - 1) * right[span]) * STEP
    exact = np.clip(ends + 4 * t * (1 - t) * middle.values[span], -1, ONE * STEP)
    largest_g, largest_p = (np.abs(word.values).max() for word in (g, p))
    bound = STEP * largest_p + (3 * STEP + 2.0**-34) * largest_g + 2.0**-42 * (length + length**2 / 2)
    assert np.abs(normals.values - exact).max() <= bound + 2.0**-18
    assert scale > 0 or not normals.codes.any()


def test_refuses():
    start, difference, other = (
        Fixed(format, np.zeros((1, 3), int)) for format in (COMPONENT, FORMAT, SQ(3, 41))
    )
    message = r"^operands must be SQ\(1, 17\), SQ\(2, 42\), SQ\(2, 42\)$"
    for words in ((difference,) * 3, (start, other, difference), (start, difference, other)):
        with pytest.raises(ValueError, match=message):
            UNIT.compute(*words, np.zeros(1, int), np.zeros(1, int))
