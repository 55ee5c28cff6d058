"""The chord method: operands of pixels from three true normals a span, against float64 mathematics."""

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import largest_span_angle
from blysk.golden.cosines.chord_values import ChordValues
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.sim.units.cosines.chord_setup import parabola
from blysk.sim.units.methods.chord_interpolator import mixed_lengths
from blysk.sim.units.operands import component_words, pairs_at, sphere, turned, unit_codes, word_ends

ONE_VALUE = float(ONE_SQUARED.values)
METHOD = ChordInterpolator()
EXPONENTS = [1, 2, 5, 10, 100, 1000]


def true_spans(rng, left, right, growth):
    """Ends with lengths up to ``growth`` times each other, and the codes of the three normals."""
    ends = left, right * growth ** rng.uniform(-1, 1, (len(left), 1))
    return ends, [quantise(v) for v in (left, normalise(ends[0] + ends[1]), right)]


def exact_values(codes, direction, halfway):
    """N·L and u of the codes' directions in float64, shape (spans, lights) each."""
    normal, direction, halfway = (normalise(v / ONE) for v in (codes, direction, halfway))
    return normal @ direction.T, np.square(normal[:, np.newaxis] - halfway).sum(axis=2) / 2


def three_values(codes, direction, halfway):
    """N·L and u of the three normals of spans, along the last axis."""
    each = (exact_values(normals, direction, halfway) for normals in codes)
    return [np.stack(values, axis=-1) for values in zip(*each, strict=True)]


def compute(codes, length, direction, halfway, method=METHOD):
    left, middle, right, direction, halfway = component_words(*codes, direction, halfway)
    return method.compute(left, right, length, direction, halfway, middle)


@pytest.mark.parametrize("fraction_bits", [36, 46])
def test_operands(fraction_bits):
    """Of every pixel, against the quadratics through the exact values; middles far off the bisectors."""
    rng, method = np.random.default_rng(fraction_bits), ChordInterpolator(fraction_bits)
    longest = min(method.setup.longest, 500)
    count = 3000
    _, codes = true_spans(rng, *pairs_at(rng, count, rng.uniform(0, 12, count)), 1.3)
    length = rng.integers(1, longest, count, endpoint=True)
    direction, halfway = unit_codes(rng, 2), np.stack([codes[0][0], unit_codes(rng, 1)[0]])
    operands = compute(codes, length, direction, halfway, method)
    assert not operands.out_of_range.any()
    span, pixel = pixels_of(length)
    t = (pixel / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    values = three_values(codes, direction, halfway)
    setup = method.setup
    bounds = (
        (setup.diffuse_error, 1.25 * ChordValues.diffuse_error(), -np.inf),
        (setup.highlight_error, 1.25 * ChordValues.highlight_error(2.0), 0),
    )
    found = operands.cosine.values, operands.highlight.values
    for value, three, (bound, own, least) in zip(found, values, bounds, strict=True):
        left, middle, right = np.moveaxis(three, -1, 0)
        curvature = 2 * (left + right - 2 * middle)
        sizes = (np.abs(v)[span] for v in (right - left - curvature, curvature))
        error = np.abs(value - ONE_VALUE * np.maximum(parabola(three[span], t), least))
        limit = bound(*sizes) + own + 2.0**-26
        assert (error <= limit).all()
        assert error.max() > limit.min() / 20
        # The bound that all interpolators state.
        assert error.max() <= method.operand_error(longest, 20) + 2.0**-26
    assert operands.cosine.format == METHOD.COSINE_FORMAT == SQ(2, 25)
    assert operands.highlight.format == Specular(operand=METHOD.operand).operand_format


def test_near_the_peak_errors_are_small():
    """Where u is under 0.01, as in a highlight, to 2 2^-23: no error of a vector's length counts."""
    rng, count = np.random.default_rng(2), 4000
    halfway = unit_codes(rng, 1)
    left = turned(rng, np.repeat(normalise(halfway / ONE), count, axis=0), rng.uniform(0, 4, count))
    _, codes = true_spans(rng, left, turned(rng, left, rng.uniform(0, 3, count)), 1.1)
    length = rng.integers(3, 100, count)
    operands = compute(codes, length, halfway, halfway)
    span, pixel = pixels_of(length)
    t = (pixel / (length - 1)[span])[:, np.newaxis]
    three = np.stack([exact_values(c, halfway, halfway)[1] for c in codes], axis=-1)
    error = np.abs(operands.highlight.values - ONE_VALUE * np.maximum(parabola(three[span], t), 0))
    assert error.max() < 1.1e-6
    assert error.max() > 2e-8


@pytest.mark.parametrize("length", [1, 2])
def test_short_spans_have_the_values_of_their_normals(length):
    """Whatever the middle normal: the pixels' own values, rounded to 25 bits, and no flag."""
    rng, count = np.random.default_rng(length), 2000
    codes = [np.vstack([unit_codes(rng, count - 200), word_ends(rng, 200, 3)]) for _ in range(3)]
    direction, halfway = unit_codes(rng, 2), unit_codes(rng, 2)
    operands = compute(codes, np.full(count, length), direction, halfway)
    assert not operands.out_of_range.any()
    normals = np.stack([codes[0], codes[2]][:length], axis=1).reshape(-1, 3)
    f, u = ChordValues().compute(*component_words(normals, direction, halfway))
    np.testing.assert_array_equal(operands.cosine.codes, f.codes)
    np.testing.assert_array_equal(
        operands.highlight.codes, np.minimum((u.codes + 1) >> 1, operands.highlight.format.max_code)
    )


def test_mixed_lengths_do_not_touch_each_other():
    """The pixels of each span are those of the span alone, in the order of the spans."""
    rng, count = np.random.default_rng(4), 120
    _, codes = true_spans(rng, *pairs_at(rng, count, rng.uniform(0, 20, count)), 1.5)
    length = mixed_lengths(rng, count)
    vectors = unit_codes(rng, 1), unit_codes(rng, 1)
    together = compute(codes, length, *vectors)
    alone = [compute([c[k : k + 1] for c in codes], length[k : k + 1], *vectors) for k in range(count)]
    for name in ("cosine", "highlight"):
        expected = np.concatenate([getattr(one, name).codes for one in alone])
        np.testing.assert_array_equal(getattr(together, name).codes, expected)
    np.testing.assert_array_equal(together.out_of_range, [one.out_of_range[0] for one in alone])


def test_flag():
    """Spans with a P of u of 1/2 or more, or a G of 1/8; those of one or two pixels never."""
    rng = np.random.default_rng(5)
    left, right = pairs_at(rng, 4000, rng.uniform(0, 90, 4000))
    codes = [quantise(v) for v in (left, normalise(left + right), right)]
    direction, halfway = unit_codes(rng, 1), unit_codes(rng, 1)
    for length in (2, 3):
        flags = compute(codes, np.full(4000, length), direction, halfway).out_of_range
        values = [three[:, 0] for three in three_values(codes, direction, halfway)]
        exceeds = np.zeros(4000, dtype=bool)
        near = exceeds.copy()
        for three in values:
            a, b, c = np.moveaxis(ONE_VALUE * three, -1, 0)
            curvature = 2 * (a + c - 2 * b)
            for size, limit in ((curvature, 1 / 8), (c - a - curvature, 1 / 2)):
                exceeds |= np.abs(size) > limit
                near |= np.abs(np.abs(size) - limit) < 5e-4
        if length == 2:
            assert not flags.any()
        else:
            np.testing.assert_array_equal(flags[~near], exceeds[~near])
            assert 0.2 < flags.mean() < 0.9


def total_errors(rng, count, exponent, growth):
    """Errors of terms in LSB at full reflection, specular and diffuse, up to `largest_span_angle`."""
    light, viewer = sphere(rng, 2)
    halfway, direction = quantise(normalise(light + viewer)[np.newaxis]), quantise(light[np.newaxis])
    h, d = (normalise(v[0] / ONE) for v in (halfway, direction))
    angle = largest_span_angle(exponent) * rng.uniform(0, 1, count) ** 0.5
    left = turned(rng, np.tile(h, (count, 1)), np.degrees(1.5 / np.sqrt(exponent)) * rng.uniform(0, 2, count))
    ends, codes = true_spans(rng, left, turned(rng, left, angle), growth)
    length = rng.integers(3, 60, count)
    operands = compute(codes, length, direction, halfway)
    assert not operands.out_of_range.any()
    span, pixel = pixels_of(length)
    t = (pixel / (length - 1)[span])[:, np.newaxis]
    normals = normalise((1 - t) * ends[0][span] + t * ends[1][span])
    u = operands.highlight.values[:, 0] / ONE_VALUE, np.square(normals - h).sum(axis=1) / 2
    terms = [REFLECTION_MODELS["cosquad"].reflect(1 - value, exponent) for value in u]
    assert np.count_nonzero(terms[1] > 0.1) > count
    diffuse = np.abs(operands.cosine.values[:, 0] / ONE_VALUE - normals @ d)
    return 255 * np.abs(terms[0] - terms[1]).max(), 255 * diffuse.max()


def moved(exponent):
    """LSB by which the rounding of a span's normals moves a term; the quadratic's weights sum to 1.25."""
    return 1.25 * 255 * 0.77 * np.sqrt(exponent) * np.sqrt(3) * COMPONENT.step / 2


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_total_error_of_equal_lengths(exponent):
    """At `largest_span_angle` and equal ends: fit and arithmetic within the budgets."""
    rng = np.random.default_rng(exponent)
    for _ in range(3):
        specular, diffuse = total_errors(rng, 4000, exponent, 1.0)
        assert 0.02 < specular <= METHOD.HIGHLIGHT_BUDGET + moved(exponent)
        assert diffuse <= METHOD.DIFFUSE_BUDGET + moved(1)


def test_true_middles_matter():
    """With lengths of 1.1 to 1 at the ends u by the true middle errs by under 0.6 of that by the bisector."""
    count, errors = 4000, []
    for bisector in (False, True):
        rng = np.random.default_rng(6)
        light = sphere(rng, 1)
        h = quantise(light)
        left = turned(rng, np.repeat(light, count, axis=0), rng.uniform(0, 12, count))
        ends, codes = true_spans(rng, left, turned(rng, left, 9.0), 1.1)
        if bisector:
            codes[1] = quantise(normalise(ends[0] + ends[1] / np.linalg.norm(ends[1], axis=1, keepdims=True)))
        length = np.full(count, 17)
        operands = compute(codes, length, h, h)
        span, pixel = pixels_of(length)
        t = (pixel / 16)[:, np.newaxis]
        normals = normalise((1 - t) * ends[0][span] + t * ends[1][span])
        u = np.square(normals - normalise(h / ONE)).sum(axis=1) / 2
        errors.append(np.abs(operands.highlight.values[:, 0] / ONE_VALUE - u).max())
    assert errors[0] < 0.6 * errors[1]


def test_refuses():
    words = component_words(*np.tile([0, 0, ONE], (4, 1, 1)))
    with pytest.raises(ValueError, match=r"^the chord method takes spans with a middle normal$"):
        METHOD.compute(*words[:2], np.array([2]), *words[2:])
    wrong = Fixed(SQ(2, 16), np.zeros((1, 3), int))
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 17\)$"):
        METHOD.compute(wrong, words[0], np.array([2]), *words[2:], words[0])
    for length in (0, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            METHOD.compute(*words[:2], np.array([length]), *words[2:], words[0])
    with pytest.raises(ValueError, match=r"^fraction_bits must be even and 36 to 46, not 35$"):
        ChordInterpolator(35)
