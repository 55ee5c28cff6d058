"""Quadratic evaluators against the exact polynomial."""

import numpy as np
import pytest

from blysk.bench.units.operands import component_words, curves_of, pairs_at
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.reference.curves import interpolate

STEP = COMPONENT.step
LENGTHS = np.array([1, 2, 3, 16, 4095])
SATURATED = 2.0**-18 * (2 * 2 + 1 + 1 + 2)
"""Bound if words saturate: the slope reaches 2, and a saturated inner sum is a step less than 1."""

forms = pytest.mark.parametrize("form", QUADRATIC_FORMS)


def curves(seed, angles):
    """Unit normals of spans, their words, and G, P, Q. All spans are in range, or none."""
    ends = pairs_at(np.random.default_rng(seed), len(angles), angles)
    words = component_words(*(quantise(end) for end in ends))
    out_of_range = MiddleNormal().compute(*words)[1]
    assert out_of_range.all() == out_of_range.any() == (np.max(angles) > 45)
    return *ends, *words, curves_of(*words)


def exact(coefficients, length, form="direct"):
    """The polynomial at every pixel. For a horner form its inner sum saturates."""
    span, index = pixels_of(length)
    g, p, q = (word.values[span] for word in coefficients)
    t = (index / np.maximum(length[span] - 1, 1))[:, np.newaxis]
    inner = np.clip(g * t + p, -1, 1) if form == "horner" else g * t + p
    return np.clip(inner * t + q, -1, 1 - STEP)


def evaluate(form, coefficients, length):
    return QuadraticEvaluator(form).compute(*coefficients, length, *pixels_of(length))


def error_of(form, coefficients, length):
    normals = evaluate(form, coefficients, length)
    return np.abs(normals.values - exact(coefficients, length)).max()


def test_stiff_parameter_of_every_pixel_of_every_length():
    evaluator = QuadraticEvaluator()
    for lengths in np.array_split(np.arange(2, 4096), 40):
        span, index = pixels_of(lengths)
        t = -evaluator.parameter(evaluator.step(lengths)[span], index).values
        # Table and rounding add 2^-18 each; the error of the table is in proportion to t.
        exact_t = index / (lengths[span] - 1)
        assert np.all(np.abs(t - exact_t) <= 2.0**-18 * (1 + exact_t))
        assert np.all(t[index == 0] == 0)
        assert np.all(t[index == lengths[span] - 1] == 1)


@forms
def test_error_to_45_degrees(form):
    rng = np.random.default_rng(3)
    angles = np.r_[0, 1e-4, 1, rng.uniform(0, 45, 400), np.full(400, 45.0)]
    length = np.r_[16, 16, 16, np.full(10, 4095), rng.integers(1, 800, len(angles) - 13)]
    *_, coefficients = curves(4, angles)
    # A bound of more than twice the worst error would say little.
    bound = QuadraticEvaluator(form).error
    assert bound / 2 < error_of(form, coefficients, length) <= bound


@forms
@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45])
def test_stiff_angles_and_lengths_in_range(form, degrees):
    """The bound holds at every pixel, and the ends are exactly the span's own."""
    length = np.tile(LENGTHS, 20)
    *_, left, right, coefficients = curves(14, np.full(len(length), degrees))
    assert error_of(form, coefficients, length) <= QuadraticEvaluator(form).error
    codes, last = evaluate(form, coefficients, length).codes, np.cumsum(length) - 1
    np.testing.assert_array_equal(codes[last - length + 1], left.codes)
    np.testing.assert_array_equal(codes[last][length > 1], right.codes[length > 1])
    if degrees == 0:
        # The middle normal of equal codes is off by the deviation of their length from 1, half a step.
        assert np.abs(codes - np.repeat(left.codes, length, axis=0)).max() <= 1


@forms
@pytest.mark.parametrize("degrees", [45.01, 60, 89.9, 90, 90.01, 135, 179.9, 180])
def test_stiff_spans_out_of_range_stay_on_their_polynomial(form, degrees):
    """The middle normal flags these spans. The result is the polynomial of the saturated G and P.

    t, t^2 or the inner sum, and the result, are rounded as usual. The slope is under 3, because |P| and 2 |G|
    are at most 1. The inner sum saturates a step short of 1. The curve starts in its left normal.
    """
    length = np.tile(LENGTHS, 20)
    *_, left, _, coefficients = curves(15, np.full(len(length), degrees))
    normals = evaluate(form, coefficients, length)
    np.testing.assert_array_equal(normals.codes[pixels_of(length)[1] == 0], left.codes)
    assert np.abs(normals.values - exact(coefficients, length, form)).max() <= SATURATED


@pytest.mark.parametrize(("degrees", "off"), [(46, 2.3e-5), (60, 0.1), (90, 0.48), (120, 0.78), (180, 1.05)])
def test_stiff_error_of_a_span_out_of_range(degrees, off):
    """These are the docstring's figures: P saturates from 53 degrees on, G from 57, and the curve misses its
    end."""
    left, right, *_, coefficients = curves(17, np.full(20_000, degrees))
    length = np.full(20_000, 5)
    span, index = pixels_of(length)
    curve = interpolate("quadratic", left[span], right[span], index / 4)
    error = np.linalg.norm(evaluate("direct", coefficients, length).values - curve, axis=1)
    assert 0.8 * off < error.max() <= off


@forms
@pytest.mark.parametrize("size", [1 - 1 / 256, 1 + 1 / 256, 1 / 256, 0])
def test_stiff_normals_that_are_not_of_unit_length(form, size):
    """G, P and Q of a longer curve of 44 degrees are no larger than those of a unit curve of 45 degrees, so
    the bound is the same."""
    ends = pairs_at(np.random.default_rng(16), 50, 44.0)
    # Components longer than a word are cut to it.
    codes = (np.clip(np.rint(size * quantise(n)), -(2**17), 2**17 - 1).astype(int) for n in ends)
    left, right = component_words(*codes)
    middle = (left.values + right.values) / (2 * np.cos(np.radians(22)))
    coefficients = GPQ().compute(left, Fixed(MiddleNormal.FORMAT, np.rint(middle * 2**19).astype(int)), right)
    length = np.tile(LENGTHS, 10)
    assert error_of(form, coefficients, length) <= QuadraticEvaluator(form).error
    assert size > 0 or not evaluate(form, coefficients, length).codes.any()


@forms
def test_spans_start_and_end_in_their_normals(form):
    """Spans of every length start and end in their normals."""
    length, spans = np.arange(1, 4096), np.arange(4095)
    *_, left, right, coefficients = curves(5, np.linspace(0, 45, len(length)))
    first, last = (
        QuadraticEvaluator(form).compute(*coefficients, length, spans, index).codes
        for index in (0 * length, length - 1)
    )
    np.testing.assert_array_equal(first, left.codes)
    np.testing.assert_array_equal(last, np.vstack([left.codes[:1], right.codes[1:]]))


@forms
@pytest.mark.parametrize(("degrees", "published"), [(5, 5.3e-6), (10, 4.3e-5), (20, 3.4e-4), (45, 3.9e-3)])
def test_published_distance_from_the_great_circle(form, degrees, published):
    left, right, *_, coefficients = curves(9, np.full(200, degrees))
    length, angle = np.full(200, 65), np.radians(degrees)
    span, index = pixels_of(length)
    t = (index / 64)[:, np.newaxis]
    circle = (np.sin((1 - t) * angle) * left[span] + np.sin(t * angle) * right[span]) / np.sin(angle)
    normals = evaluate(form, coefficients, length).values / (1 - STEP)
    distance = np.linalg.norm(normals - circle, axis=1).max()
    # On top of the model's error come the evaluator, the middle normal, and the rounding of the end normals,
    # for each of three components. Half of the last digit shown is added.
    arithmetic = np.sqrt(3) * (QuadraticEvaluator(form).error + MiddleNormal.ERROR + 2 * STEP)
    half_digit = 0.05 * 10.0 ** np.floor(np.log10(published))
    assert distance == pytest.approx(published, abs=arithmetic + half_digit)


def test_refuses():
    with pytest.raises(ValueError, match=r"^form must be one of direct, horner, not 'cubic'$"):
        QuadraticEvaluator("cubic")
    evaluator = QuadraticEvaluator()
    for length in (0, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            evaluator.step(np.array([1, length]))
    word = Fixed(COMPONENT, np.zeros((1, 3), int))
    message = r"^operands must be SQ\(0, 17\), SQ\(1, 17\), SQ\(1, 17\), not SQ\(1, 17\), "
    with pytest.raises(ValueError, match=message):
        evaluator.compute(word, word, word, np.array([1]), np.array([0]), np.array([0]))
