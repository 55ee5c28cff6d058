"""Spans of attributes: words against exact fractions and float64, ends of words, refusals."""

import re
from fractions import Fraction

import numpy as np
import pytest

from blysk.golden.albedo.attribute_spans import WORD_DEPTH_RATIO, AttributeSpans, SpanAttributes
from blysk.golden.number.spans import pixels_of

from .ends import ends_of

BOTH = AttributeSpans(coordinates=True)
LENGTHS = np.array([1, 2, 3, 4, 5, 17, 100, 1000, 4095])


def test_words_are_the_rounded_lines_of_the_codes():
    """Words are compared with exact fractions at the ends of spans and between them.

    Spans have up to 4095 pixels.
    """
    rng = np.random.default_rng(3)
    ends, weights = ends_of(rng, BOTH, LENGTHS, 4)
    spans = SpanAttributes.quantise(BOTH, *ends, LENGTHS, weights, level=np.arange(9))
    words = BOTH.compute(spans, LENGTHS)
    found = np.column_stack([words.numerators.codes, words.weight.codes])
    start = np.column_stack([spans.start, spans.weight_start])
    step = np.column_stack([spans.step, spans.weight_step])
    span, index = pixels_of(LENGTHS)
    for at in np.r_[0, np.cumsum(LENGTHS) - 1, rng.integers(0, len(span), 60)].tolist():
        s, i = int(span[at]), int(index[at])
        for line in range(6):
            exact = int(start[s, line]) + Fraction(i * int(step[s, line]), 2 ** int(spans.exponent[s]))
            rounded = (exact + Fraction(1, 2)).__floor__()
            # In a span of two pixels a step of 1 or more wraps.
            assert (int(found[at, line]) - rounded) % 2**24 == 0
            assert s == 1 or int(found[at, line]) == rounded
    assert (words.level == span).all()


@pytest.mark.parametrize("ratio", [1, 2, 4, 16, 1e4, WORD_DEPTH_RATIO])
def test_words_are_within_their_bound_and_do_not_wrap(ratio):
    rng = np.random.default_rng(int(ratio))
    length = np.r_[np.repeat(LENGTHS[:-1], 40), 4095]
    ends, weights = ends_of(rng, BOTH, length, ratio)
    # Texture coordinates cross their whole range between two corners. The steps are largest in spans of two
    # pixels.
    ends[0, ::2, 3:], ends[1, ::2, 3:] = 7 - 512 * 0.999, 7 + 512 * 0.999
    spans = SpanAttributes.quantise(BOTH, *ends, length, weights)
    whole = np.flatnonzero(length[::2] > 1) * 2
    assert (spans.base[whole] == 7).all()
    assert (spans.range[whole] == 9).all()
    words = BOTH.compute(spans, length)
    span, index = pixels_of(length)
    t = (index / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    weight = np.stack([weights[0], np.where(length == 1, weights[0], weights[1])])
    weight *= (1 - 4 * 2.0**-23) / weight.max(axis=0)
    ends[:, :, 3:] = (ends[:, :, 3:] - spans.base) * np.ldexp(1.0, -spans.range)[:, np.newaxis]
    lines = np.concatenate([ends * weight[:, :, np.newaxis], weight[:, :, np.newaxis]], axis=2)
    lines[1] = np.where((length == 1)[:, np.newaxis], lines[0], lines[1])
    exact = lines[0][span] * (1 - t) + lines[1][span] * t
    found = np.column_stack([words.numerators.values, words.weight.values])
    error = np.abs(found - exact).max(axis=1)
    bound = BOTH.errors(spans, length)
    assert (error <= bound).all()
    assert bound.max() < 3 * 2.0**-23
    assert words.weight.codes.min() >= 252
    assert (np.abs(spans.start).max(axis=1) < 1 << 23).all()
    # The words are filled.
    assert (np.maximum(spans.weight_start, words.weight.codes[np.cumsum(length) - 1]) > 2**23 - 8).all()


def test_without_perspective_words_are_the_attributes():
    model = AttributeSpans(coordinates=True, perspective=False)
    ends = np.array([[[0, 0.5, 1, -3.0, 10.25]], [[1, 0.5, 0, 5.0, 10.75]]])
    spans = SpanAttributes.quantise(model, *ends, np.array([3]), level=np.array([2]))
    assert spans.weight_start is None
    assert (spans.base.tolist(), spans.range.tolist(), spans.level.tolist()) == ([[1, 11]], [3], [2])
    words = model.compute(spans, np.array([3]))
    assert words.weight is None
    expected = [[0, 0.5, 1, -0.5, -0.75 / 8], [0.5, 0.5, 0.5, 0, -0.5 / 8], [1, 0.5, 0, 0.5, -0.25 / 8]]
    np.testing.assert_allclose(words.numerators.values, expected, rtol=0, atol=5 * 2.0**-23)
    assert words.numerators.codes.max() == 2**23 - 4


def test_a_base_comes_into_its_range():
    """A base changes by whole periods.

    With clamp it moves to the limit beyond which every texel is the border's.
    """
    model = AttributeSpans(colors=False, coordinates=True, perspective=False)
    ends = np.array([[[5000.25, -2100.5]], [[5001.25, -2099.5]]])
    spans = SpanAttributes.quantise(model, *ends, np.array([2]), periodic=True)
    assert spans.base.tolist() == [[5001 - 2 * 2048, -2100 + 2048]]
    assert (spans.step != 0).all()
    spans = SpanAttributes.quantise(model, *ends, np.array([2]), periodic=np.array([[True, False]]))
    assert spans.base.tolist() == [[5001 - 2 * 2048, -1984]]
    assert spans.step[0, 1] == 0
    ends = np.array([[[100, 0.0]], [[3900, 0.0]]])
    with pytest.raises(
        ValueError, match="the middle of a span may be 1984 texels from the border of u or v: cut"
    ):
        SpanAttributes.quantise(model, *ends, np.array([2]))


def test_some_of_the_spans():
    rng = np.random.default_rng(5)
    model = AttributeSpans()
    ends, weights = ends_of(rng, model, LENGTHS, 2)
    spans = SpanAttributes.quantise(model, *ends, LENGTHS, weights)
    assert spans[2] is spans.exponent
    few = spans[3:5]
    assert few.start.shape == (2, 3)
    assert few.base is None
    assert (few.weight_step == spans.weight_step[3:5]).all()


ONE_SPAN = np.array([9])
HALF = np.full((1, 3), 0.5)
PLACES = AttributeSpans(colors=False, coordinates=True, perspective=False)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: AttributeSpans(colors=False), "spans of attributes need colours or texture coordinates"),
        (
            lambda: SpanAttributes.quantise(AttributeSpans(), HALF, HALF, ONE_SPAN),
            "perspective needs 1/W at both ends",
        ),
        (
            lambda: SpanAttributes.quantise(AttributeSpans(), HALF[:, :2], HALF[:, :2], ONE_SPAN),
            "a span needs 3 attributes at both ends",
        ),
        (
            lambda: SpanAttributes.quantise(
                AttributeSpans(), HALF, HALF * np.nan, ONE_SPAN, (np.ones(1), np.ones(1))
            ),
            "attributes must be finite",
        ),
        (
            lambda: SpanAttributes.quantise(
                AttributeSpans(), HALF, HALF + 1, ONE_SPAN, (np.ones(1), np.ones(1))
            ),
            "colours must be 0 to 1",
        ),
        (
            lambda: SpanAttributes.quantise(
                AttributeSpans(), HALF, HALF, ONE_SPAN, (np.ones(1), -np.ones(1))
            ),
            "1/W must be finite and over 0",
        ),
        (
            lambda: SpanAttributes.quantise(
                AttributeSpans(), HALF, HALF, ONE_SPAN, (np.ones(1), np.full(1, 32769.0))
            ),
            "depths of a span must be within a ratio of 32768: cut it",
        ),
        (
            lambda: SpanAttributes.quantise(PLACES, HALF[:, :2], HALF[:, :2] + 4096, ONE_SPAN),
            "a span may cross at most 4096 texels: cut it",
        ),
        (
            lambda: SpanAttributes.quantise(PLACES, HALF[:, :2], HALF[:, :2], ONE_SPAN, level=np.array([16])),
            "codes from 16 to 16 exceed UQ(4, 0)",
        ),
        (
            lambda: AttributeSpans().compute(
                SpanAttributes(np.zeros((1, 2), int), np.zeros((1, 2), int), np.zeros(1, int)), ONE_SPAN
            ),
            "spans must have 3 attributes",
        ),
        (
            lambda: AttributeSpans().compute(
                SpanAttributes(np.zeros((1, 3), int), np.zeros((1, 3), int), np.zeros(1, int)), ONE_SPAN
            ),
            "spans must have 1/W",
        ),
    ],
)
def test_refused(make, text):
    with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
        make()
