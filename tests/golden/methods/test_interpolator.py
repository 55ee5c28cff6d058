"""Interpolators: the operands of every pixel of each method, against float64 mathematics."""

import numpy as np
import pytest

from blysk.bench.units.operands import pairs_at
from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.interpolator import Interpolator
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.methods.normal_interpolator import EndNormalInterpolator, NormalInterpolator
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.line_setup import quantise_line
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.presets import METHODS
from blysk.golden.reference.curves import CURVES, interpolate

STEP = 2.0**-17
ONE_VALUE = float(ONE_SQUARED.values)
FROM_NORMALS = [name for name, of in METHODS.items() if of.brings_ends]
NORMAL_METHODS = [name for name, method in METHODS.items() if isinstance(method, NormalInterpolator)]

# `quantise` moves a vector by half a step along itself and by sqrt(3) steps across.
MOVED = (0.5 + np.sqrt(3)) * STEP

# Largest error of a component of a normal that the devices promise, in steps of 2^-17, for spans of up to 40
# degrees and 64 pixels. It is a sum: the last rounding, 1/2; ends, which are off by at most a step and count
# 1.25 times, 1.06 times in the middle; the middle normal, half a step; dt, 2^-17 of |P| + 4 |G|. For
# `renormalise` it is the rounding of w, half a step, divided by the line's length; the rounding of the
# result; and the factor, as `LENGTH_ERROR` says.
NORMAL_STEPS = {
    "linear": 0.5 + 1 + 0.7,
    "renormalise": 0.5 / np.cos(np.radians(20)) + Renormaliser.LENGTH_ERROR / np.sqrt(3) / STEP,
    "quadratic": 0.5 + 2.4 + 1.5,
    "quadratic-eval": 0.5 + 2.4 + 2.5,
    "quadratic-horner": 0.5 + 2.4 + 2.5,
}


def spans(rng, count=2000, angle=40.0, longest=64):
    left, right = pairs_at(rng, count, rng.uniform(0, angle, count))
    return left, right, rng.integers(1, longest, count, endpoint=True)


def vectors(rng, lights):
    return tuple(pairs_at(rng, lights, 0.0)[0] for _ in range(2))


def compute(interpolator, left, right, length, direction, halfway):
    others = (Fixed(COMPONENT, quantise(v)) for v in (direction, halfway))
    return interpolator.compute(*end_words(interpolator, left, right), length, *others)


def end_words(interpolator, left, right):
    """Ends of spans in the format that the method takes: unit normals, or a line between two normals of
    length 1."""
    codes = quantise_line(left, right) if interpolator.curve_is_exact else (quantise(left), quantise(right))
    return [Fixed(interpolator.END_FORMAT, end) for end in codes]


def places(length):
    span, step = pixels_of(length)
    return span, step / np.maximum(length - 1, 1)[span]


@pytest.mark.parametrize("method", FROM_NORMALS)
def test_formats(method):
    rng = np.random.default_rng(1)
    interpolator = METHODS[method]
    assert interpolator.CURVE in CURVES
    left, right, length = spans(rng, 50, 10.0)
    operands = compute(interpolator, left, right, length, *vectors(rng, 3))
    assert operands.cosine.format == interpolator.COSINE_FORMAT
    assert operands.highlight.format == Specular(operand=interpolator.operand).operand_format
    shape = (length.sum(), 3)
    assert (operands.cosine.codes.shape, operands.highlight.codes.shape) == (shape, shape)
    assert operands.out_of_range.shape == (50,)
    assert not operands.out_of_range.any()


@pytest.mark.parametrize("method", NORMAL_STEPS)
def test_normals(method):
    """Each component is compared with the method's curve in float64, `exact_normals`."""
    rng = np.random.default_rng(2)
    interpolator = METHODS[method]
    left, right, length = spans(rng)
    normals, out_of_range = interpolator.normals(*end_words(interpolator, left, right), length)
    assert not out_of_range.any()
    span, t = places(length)
    exact = interpolator.exact_normals(left[span], right[span], t)
    error = np.abs(normals.codes / ONE - exact).max() / STEP
    print(f"{method}: {error:.2f} steps")
    assert error <= NORMAL_STEPS[method]
    assert error > 0.8


@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
@pytest.mark.parametrize("method", NORMAL_METHODS)
def test_products_are_those_of_the_normals(method, operand):
    """N.L and N.H are compared as exact integers, and the chord as an integer cut to 25 fraction bits."""
    rng = np.random.default_rng(3)
    interpolator = type(METHODS[method])(**{**METHODS[method].__dict__, "operand": operand})
    assert interpolator.uses_chord == (operand == "one_minus_cosine")
    left, right, length = spans(rng, 300, 20.0)
    direction, halfway = vectors(rng, 2)
    # This light is near the spans, so u is under 1/2, where the chord is exact.
    halfway = left[:2]
    operands = compute(interpolator, left, right, length, direction, halfway)
    normals, _ = interpolator.normals(*end_words(interpolator, left, right), length)
    lights, h = quantise(direction), quantise(halfway)
    np.testing.assert_array_equal(operands.cosine.codes, normals.codes @ lights.T)
    if operand == "cosine":
        np.testing.assert_array_equal(operands.highlight.codes, normals.codes @ h.T)
        return
    square = ((normals.codes[:, np.newaxis] - h) ** 2).sum(axis=-1)
    near = square < 1 << 34
    assert np.count_nonzero(near) > 1000
    np.testing.assert_array_equal(operands.highlight.codes[near], square[near] >> 10)


def test_angular_operands():
    """``1 - cos`` along the great circle is within the devices' bounds and the effect of rounding,
    `MOVED`."""
    rng = np.random.default_rng(5)
    left, right, length = spans(rng)
    direction, halfway = vectors(rng, 2)
    operands = compute(METHODS["angular"], left, right, length, direction, halfway)
    span, t = places(length)
    normals = interpolate("slerp", left[span], right[span], t)
    # The weights of the two ends add up to at most 1/cos(psi/2).
    bound = MOVED * (1 / np.cos(np.radians(20)) + 1)
    bound += np.max(AngularSetup.error(np.linspace(0.01, 40, 4000))) + HighlightCosine.ERROR + 2.0**-16
    assert np.abs(operands.cosine.values - normals @ direction.T).max() <= bound
    assert np.abs(operands.highlight.values - (1 - normals @ halfway.T)).max() <= bound
    assert np.abs(operands.cosine.values - normals @ direction.T).max() > bound / 8


@pytest.mark.parametrize("method", FROM_NORMALS)
@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_equal_normals(method, length):
    """With equal normals every pixel of a span equals its first."""
    rng = np.random.default_rng(length)
    left, _ = pairs_at(rng, 3, 0.0)
    lengths = np.full(3, length)
    operands = compute(METHODS[method], left, left, lengths, *vectors(rng, 1))
    assert not operands.out_of_range.any()
    for values in (operands.cosine, operands.highlight):
        values = values.codes.reshape(3, length)
        np.testing.assert_array_equal(values, values[:, :1].repeat(length, axis=1))


# The recurrence as drawn drifts away from its end. Its own tests say how far.
@pytest.mark.parametrize("method", FROM_NORMALS)
@pytest.mark.parametrize("angle", [1e-4, 1.0, 14.0])
def test_stiff_ends(method, angle):
    """The first and the last pixel have the normals of the ends, whatever the length."""
    rng = np.random.default_rng(7)
    left, right = pairs_at(rng, 200, angle)
    direction, halfway = vectors(rng, 1)
    ends = np.stack([left @ direction[0], right @ direction[0]], axis=1)
    for length in (2, 3, 16, 1000):
        operands = compute(METHODS[method], left, right, np.full(200, length), direction, halfway)
        cosine = operands.cosine.values.reshape(200, length)[:, [0, -1]]
        # Both vectors are off, `ONE_SQUARED` stands for 1, and the normal is off by a step across.
        assert np.abs(cosine - ends).max() <= 2 * MOVED + 2.0**-16 + np.sqrt(3) * STEP


def test_widest_span():
    for name, method in METHODS.items():
        for exponent in (1, 10, 1000):
            widest = method.widest_span(exponent)
            assert widest == (30 if name == "chord-local" else method.MAX_ANGLE)
    assert METHODS["renormalise"].widest_span(1000) == 180


@pytest.mark.parametrize(
    ("method", "narrow", "out_of_range"),
    [
        ("bisection", 89.99, 90.1),
        ("quadratic", 44.99, 45.1),
        ("angular", 149.99, 150.1),
        ("angular", 149.99, 180.0),
        ("recurrence", 89.99, 90.02),
        ("recurrence", 45.0, 180.0),
    ],
)
def test_flag(method, narrow, out_of_range):
    rng = np.random.default_rng(8)
    for angle, flagged in ((narrow, False), (out_of_range, True)):
        left, right = pairs_at(rng, 200, angle)
        operands = compute(METHODS[method], left, right, np.full(200, 2), *vectors(rng, 1))
        assert (operands.out_of_range == flagged).all()


def test_flag_of_linear_normals():
    """A component of the difference of 1 or more sets the flag."""
    rng = np.random.default_rng(9)
    left, right = pairs_at(rng, 2000, rng.uniform(0, 180, 2000))
    operands = compute(METHODS["linear"], left, right, np.full(2000, 2), *vectors(rng, 1))
    difference = quantise(right) - quantise(left)
    far = np.any((difference < COMPONENT.min_code) | (difference > COMPONENT.max_code), axis=1)
    np.testing.assert_array_equal(operands.out_of_range, far)
    assert 300 < np.count_nonzero(far) < 1700


def test_refuses():
    for make in (LinearInterpolator, QuadraticInterpolator):
        with pytest.raises(ValueError, match=r"^operand must be 'cosine' or 'one_minus_cosine', not 'sine'$"):
            make(operand="sine")
    with pytest.raises(ValueError, match=r"'spline'"):
        QuadraticInterpolator(form="spline")
    # A method that does not state its facts is refused when it is made.
    with pytest.raises(TypeError, match=r"abstract methods? .*\bcut\b.*\bfilled\b"):
        Interpolator()
    with pytest.raises(TypeError, match=r"abstract methods? .*\bcompute\b"):
        EndNormalInterpolator()
    wrong = Fixed(SQ(2, 16), np.zeros((1, 3), int))
    with pytest.raises(ValueError, match=r"^operands? must be "):
        METHODS["quadratic"].compute(wrong, wrong, np.array([2]), wrong, wrong)
