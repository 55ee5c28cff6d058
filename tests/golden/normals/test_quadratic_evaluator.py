"""Quadratic evaluators against the exact polynomial and against the forward differences."""

import numpy as np
import pytest

from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.reference.curves import interpolate

STEP = COMPONENT.step


def curves(normal_pairs, seed, angles):
    """Ends and G, P, Q of spans, by the documented chain."""
    left, right = normal_pairs(np.random.default_rng(seed), len(angles), angles)
    left, right = (Fixed(COMPONENT, quantise(normals)) for normals in (left, right))
    middle, out_of_range = MiddleNormal().compute(left, right)
    assert not out_of_range.any()
    return left, right, GPQ().compute(left, middle, right)


def pixels(length):
    span = np.repeat(np.arange(len(length)), length)
    return span, np.arange(len(span)) - np.repeat(np.cumsum(length) - length, length)


def exact(coefficients, length, span, index):
    g, p, q = (word.values[span] for word in coefficients)
    t = (index / np.maximum(length[span] - 1, 1))[:, np.newaxis]
    return (g * t + p) * t + q


def test_stiff_parameter_of_every_pixel_of_every_length():
    evaluator = QuadraticEvaluator()
    for lengths in np.array_split(np.arange(2, 4096), 40):
        span, index = pixels(lengths)
        t = -evaluator.parameter(evaluator.step(lengths)[span], index).values
        # Table and rounding, 2^-18 each; the first is in proportion to t.
        exact_t = index / (lengths[span] - 1)
        assert np.all(np.abs(t - exact_t) <= 2.0**-18 * (1 + exact_t))
        assert np.all(t[index == 0] == 0)
        assert np.all(t[index == lengths[span] - 1] == 1)


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_error_to_45_degrees(normal_pairs, form):
    rng = np.random.default_rng(3)
    angles = np.r_[0, 1e-4, 1, rng.uniform(0, 45, 400), np.full(400, 45.0)]
    length = np.r_[16, 16, 16, np.full(10, 4095), rng.integers(1, 800, len(angles) - 13)]
    _, _, coefficients = curves(normal_pairs, 4, angles)
    span, index = pixels(length)
    evaluator = QuadraticEvaluator(form)
    normals = evaluator.compute(*coefficients, length, span, index)
    error = np.abs(normals.values - exact(coefficients, length, span, index)).max()
    # A bound more than twice the worst seen would say little.
    assert evaluator.error / 2 < error <= evaluator.error


STIFF_LENGTHS = np.array([1, 2, 3, 16, 4095])


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45])
def test_stiff_angles_and_lengths_that_are_served(normal_pairs, form, degrees):
    """The bound holds at every one, and the ends are the span's own, to the code."""
    length = np.tile(STIFF_LENGTHS, 20)
    left, right, coefficients = curves(normal_pairs, 14, np.full(len(length), degrees))
    span, index = pixels(length)
    evaluator = QuadraticEvaluator(form)
    normals = evaluator.compute(*coefficients, length, span, index)
    error = np.abs(normals.values - exact(coefficients, length, span, index))
    assert error.max() <= evaluator.error
    np.testing.assert_array_equal(normals.codes[index == 0], left.codes)
    ends = (index == length[span] - 1) & (length[span] > 1)
    np.testing.assert_array_equal(normals.codes[ends], right.codes[length > 1])


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
@pytest.mark.parametrize("degrees", [45.01, 60, 89.9, 90, 90.01, 135, 179.9, 180])
def test_stiff_wide_spans_stay_on_their_polynomial(normal_pairs, form, degrees):
    """Flagged by the middle normal; what comes out is the polynomial of G and P as they saturated.

    Each of t, t^2 or the inner sum, and the result, is rounded as ever; the slope is under 3 (|P| is at most
    1 and 2 |G| too) and the inner sum saturates, a step short of 1. The curve starts in its left normal.
    """
    length = np.tile(STIFF_LENGTHS, 20)
    left, right = normal_pairs(np.random.default_rng(15), len(length), degrees)
    left, right = (Fixed(COMPONENT, quantise(normals)) for normals in (left, right))
    middle, out_of_range = MiddleNormal().compute(left, right)
    assert out_of_range.all()
    coefficients = GPQ().compute(left, middle, right)
    span, index = pixels(length)
    normals = QuadraticEvaluator(form).compute(*coefficients, length, span, index)
    np.testing.assert_array_equal(normals.codes[index == 0], left.codes)
    t = (index / np.maximum(length[span] - 1, 1))[:, np.newaxis]
    g, p, q = (word.values[span] for word in coefficients)
    inner = np.clip(g * t + p, -1, 1) if form == "horner" else g * t + p
    polynomial = np.clip(inner * t + q, -1, 1 - STEP)
    assert np.abs(normals.values - polynomial).max() <= 2.0**-18 * (2 * 2 + 1 + 1 + 2)


@pytest.mark.parametrize(("degrees", "off"), [(46, 2.3e-5), (60, 0.1), (90, 0.48), (120, 0.78), (180, 1.05)])
def test_stiff_error_that_a_wide_span_gets(normal_pairs, degrees, off):
    """The docstring's figures: P saturates from 53 degrees on, G from 57, and the curve misses its end."""
    left, right = normal_pairs(np.random.default_rng(17), 20_000, degrees)
    codes = [Fixed(COMPONENT, quantise(normals)) for normals in (left, right)]
    middle, out_of_range = MiddleNormal().compute(*codes)
    assert out_of_range.all()
    coefficients = GPQ().compute(codes[0], middle, codes[1])
    span, index = pixels(np.full(20_000, 5))
    normals = QuadraticEvaluator().compute(*coefficients, np.full(20_000, 5), span, index)
    error = np.linalg.norm(
        normals.values - interpolate("quadratic", left[span], right[span], index / 4), axis=1
    )
    assert 0.8 * off < error.max() <= off


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
@pytest.mark.parametrize("size", [1 - 1 / 256, 1 + 1 / 256, 1 / 256, 0])
def test_stiff_normals_that_are_not_of_unit_length(normal_pairs, form, size):
    """G, P and Q of a longer curve of 44 degrees are no larger than those of a unit one of 45: same bound."""
    left, right = normal_pairs(np.random.default_rng(16), 50, 44.0)
    # Longer components than a word's are cut to it.
    codes = [np.clip(np.rint(size * quantise(n)), -(2**17), 2**17 - 1).astype(int) for n in (left, right)]
    left, right = (Fixed(COMPONENT, word) for word in codes)
    middle = (left.values + right.values) / (2 * np.cos(np.radians(22)))
    middle = Fixed(MiddleNormal.FORMAT, np.rint(middle * 2**19).astype(int))
    coefficients = GPQ().compute(left, middle, right)
    length = np.tile(STIFF_LENGTHS, 10)
    span, index = pixels(length)
    evaluator = QuadraticEvaluator(form)
    normals = evaluator.compute(*coefficients, length, span, index)
    # Components past the ends of the word saturate.
    polynomial = np.clip(exact(coefficients, length, span, index), -1, 1 - STEP)
    assert np.abs(normals.values - polynomial).max() <= evaluator.error
    if size == 0:
        assert not normals.codes.any()


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_spans_start_and_end_in_their_normals(normal_pairs, form):
    length = np.arange(1, 4096)
    left, right, coefficients = curves(normal_pairs, 5, np.linspace(0, 45, len(length)))
    evaluator = QuadraticEvaluator(form)
    spans = np.arange(len(length))
    first = evaluator.compute(*coefficients, length, spans, np.zeros_like(length))
    last = evaluator.compute(*coefficients, length, spans, length - 1)
    np.testing.assert_array_equal(first.codes, left.codes)
    np.testing.assert_array_equal(last.codes[1:], right.codes[1:])
    np.testing.assert_array_equal(last.codes[0], left.codes[0])


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_stiff_equal_normals_stay(normal_pairs, form):
    length = np.array([1, 2, 3, 16, 4095])
    left, _, coefficients = curves(normal_pairs, 6, np.zeros(5))
    span, index = pixels(length)
    normals = QuadraticEvaluator(form).compute(*coefficients, length, span, index)
    # The middle normal of equal codes is off by the deviation of their length from 1, half a step at most.
    assert np.abs(normals.codes - left.codes[span]).max() <= 1


def test_agrees_with_the_forward_differences(normal_pairs):
    rng = np.random.default_rng(7)
    angles = np.r_[0, 1e-4, 1, np.full(10, 45.0), rng.uniform(0, 45, 300)]
    length = np.r_[4095, 4095, 4095, np.full(10, 4095), 1, 2, 3, 16, rng.integers(1, 500, 296)]
    _, _, coefficients = curves(normal_pairs, 8, angles)
    g, p, q = coefficients
    span, index = pixels(length)
    first, second = DifferenceSetup().compute(g, p, length)
    reference = DifferenceAccumulator().compute(q, first, second, span, index)
    # The bound of `DifferenceSetup` at the angles and lengths above, and the accumulator's rounding.
    drift = 2.0**-17 * 0.83 + (2.0**-16 + 2.0**-17) * 0.305 + 2.0**-42 * (4094 + 4094**2 / 2)
    results = {}
    for form in QUADRATIC_FORMS:
        evaluator = QuadraticEvaluator(form)
        results[form] = evaluator.compute(*coefficients, length, span, index)
        apart = np.abs(results[form].values - reference.values).max()
        assert apart <= evaluator.error + drift + 2.0**-18
        assert apart <= 3 * STEP
    # Between the two forms only t^2, the inner sum and the last cut differ.
    apart = np.abs(results["direct"].codes - results["horner"].codes).max()
    assert apart * STEP <= 2.0**-18 * (0.305 + 1 + 2)


@pytest.mark.parametrize(("degrees", "published"), [(5, 5.3e-6), (10, 4.3e-5), (20, 3.4e-4), (45, 3.9e-3)])
def test_published_distance_from_the_great_circle(normal_pairs, degrees, published):
    left, right = normal_pairs(np.random.default_rng(9), 200, degrees)
    angle = np.radians(degrees)
    codes = [Fixed(COMPONENT, quantise(normals)) for normals in (left, right)]
    middle, _ = MiddleNormal().compute(*codes)
    length = np.full(200, 65)
    span, index = pixels(length)
    t = (index / 64)[:, np.newaxis]
    circle = (np.sin((1 - t) * angle) * left[span] + np.sin(t * angle) * right[span]) / np.sin(angle)
    coefficients = GPQ().compute(codes[0], middle, codes[1])
    for form in QUADRATIC_FORMS:
        evaluator = QuadraticEvaluator(form)
        normals = evaluator.compute(*coefficients, length, span, index).values / (1 - STEP)
        distance = np.linalg.norm(normals - circle, axis=1).max()
        # On top of the model: the evaluator, the middle normal, and the rounding of the end normals, each of
        # three components; and half of the last digit shown.
        arithmetic = np.sqrt(3) * (evaluator.error + MiddleNormal.ERROR + 2 * STEP)
        assert distance == pytest.approx(
            published, abs=arithmetic + 0.05 * 10.0 ** np.floor(np.log10(published))
        )


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_stiff_words_at_their_ends(form):
    corners = np.array(np.meshgrid(*[[0, 1]] * 3, indexing="ij")).reshape(3, -1)
    formats = (GPQ.G_FORMAT, GPQ.P_FORMAT, GPQ.Q_FORMAT)
    coefficients = [
        Fixed(f, np.where(c, f.max_code, f.min_code)[:, np.newaxis].repeat(3, 1))
        for f, c in zip(formats, corners, strict=True)
    ]
    length = np.full(8, 33)
    span, index = pixels(length)
    normals = QuadraticEvaluator(form).compute(*coefficients, length, span, index)
    polynomial = exact(coefficients, length, span, index)
    if form == "horner":
        # Its inner sum saturates first.
        t = (index / 32)[:, np.newaxis]
        g, p, q = (word.values[span] for word in coefficients)
        polynomial = np.clip(g * t + p, -1, 1) * t + q
    clipped = np.clip(polynomial, -1, 1 - STEP)
    # The slope reaches 2 here; a saturated inner sum is a step short of 1.
    assert np.abs(normals.values - clipped).max() <= 2.0**-18 * (2 * 2 + 1 + 1 + 2)


def test_refusals():
    with pytest.raises(ValueError, match=r"^form must be one of direct, horner, not 'cubic'$"):
        QuadraticEvaluator("cubic")
    evaluator = QuadraticEvaluator()
    for length in (0, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            evaluator.step(np.array([1, length]))
    word = Fixed(COMPONENT, np.zeros((1, 3), int))
    with pytest.raises(
        ValueError, match=r"^operands must be SQ\(0, 17\), SQ\(1, 17\), SQ\(1, 17\), not SQ\(1, 17\), "
    ):
        evaluator.compute(word, word, word, np.array([1]), np.array([0]), np.array([0]))
