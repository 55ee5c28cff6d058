"""Spans of the quotient method: drift against exact integers and float64, and refusals."""

from fractions import Fraction

import numpy as np
import pytest

from blysk.golden.cosines.quotient_spans import MARGIN, QuotientSpans, SpanVectors
from blysk.golden.number.spans import pixels_of

LENGTHS = np.array([1, 3, 4, 5, 17, 100, 1000, 4095])


def _vectors(rng, components, length):
    left = rng.normal(size=(len(length), components))
    right = left + rng.normal(size=left.shape) * 10.0 ** rng.uniform(-4, 0, (len(length), 1))
    return left, right


@pytest.mark.parametrize("lights", [1, 2])
@pytest.mark.parametrize(("highlights", "mirror"), [(True, False), (True, True), (False, False)])
def test_words_against_exact_fractions(lights, highlights, mirror):
    """m, w, l and the sign of z follow the line of the codes within the stated drift, in exact arithmetic."""
    rng = np.random.default_rng(3)
    model = QuotientSpans(lights, highlights, mirror)
    names = {name: place for place, name in enumerate(model.components)}
    vectors = SpanVectors.quantise(*_vectors(rng, len(names), LENGTHS), LENGTHS)
    codes = model.codes_of(np.array([0.6, 0.0])[:lights], np.array([0.8, 1.0])[:lights])
    pixels = model.compute(vectors, LENGTHS, codes)
    span, index = pixels_of(LENGTHS)
    for at in np.r_[0, np.cumsum(LENGTHS) - 1, rng.integers(0, len(span), 60)].tolist():
        s, i = int(span[at]), int(index[at])
        v = [
            Fraction(int(a), 2**17) + i * Fraction(int(b), 2 ** (17 + int(vectors.exponent[s])))
            for a, b in zip(vectors.start[s], vectors.step[s], strict=True)
        ]
        drift = Fraction(2 * i + i * i, 2) / 2**47
        for number, squared in enumerate(model.squares):
            word = pixels.rest[at] if number == len(model.squares) - 1 else pixels.numerator[at, number]
            exact = sum(v[names[name]] ** 2 for name in squared)
            assert -drift <= Fraction(int(word.codes), 2**47) - exact <= drift
        for light in range(lights):
            line = [(1 - Fraction(1, 2**16), f"z{light}")]
            if highlights:
                line = zip(
                    (Fraction(int(c), 2**17) for c in codes[light]), (f"x{light}", f"z{light}"), strict=True
                )
            exact = sum(factor * v[names[name]] for factor, name in line)
            assert -Fraction(i, 2**36) <= Fraction(int(pixels.line.codes[at, light]), 2**36) - exact <= 0
            if model.takes_heights and abs(v[names[f"z{light}"]]) > Fraction(i, 2**29):
                assert pixels.away[at, light] == (v[names[f"z{light}"]] < 0)


def test_vectors_against_float64():
    """Components along a span are within the bound of `QuotientErrors`. Their words are filled."""
    rng = np.random.default_rng(4)
    length = np.repeat(LENGTHS, 300)
    left, right = _vectors(rng, 3, length)
    vectors = SpanVectors.quantise(left, right, length)
    ends = np.maximum(
        np.abs(vectors.start),
        np.abs(vectors.start + vectors.step * np.ldexp(length - 1.0, -vectors.exponent)[:, np.newaxis]),
    )
    assert (ends.max(axis=1) >= 2**17 - 2 * MARGIN).all()
    assert np.abs(vectors.start).max() < 2**17
    assert np.abs(vectors.step).max() < 2**17
    longer = np.where((length > 1)[:, np.newaxis], np.maximum(np.abs(left), np.abs(right)), np.abs(left))
    scale = (2**17 - MARGIN) / longer.max(axis=1)
    difference = np.abs(right - left).max(axis=1) * scale * (length > 1)
    for i in (0, 1, 2):
        place = np.minimum(i * (length - 1) // 2, length - 1)
        exact = left + (right - left) * (place / np.maximum(length - 1, 1))[:, np.newaxis]
        found = vectors.start + vectors.step * np.ldexp(place.astype(float), -vectors.exponent)[:, np.newaxis]
        bound = 0.5 + np.maximum(1 / 16, difference * 2.0**-17)
        assert (np.abs(found - exact * scale[:, np.newaxis]).max(axis=1) <= bound).all()


@pytest.mark.parametrize("mirror", [False, True])
def test_no_word_wraps_at_the_last_pixel(mirror):
    """The ends have components near 1, and the step is rounded up. z stays over 0, and no square wraps."""
    rng = np.random.default_rng(6)
    length = rng.integers(3, 40, 20_000)
    model = QuotientSpans(mirror=mirror)
    near, wide = (len(model.components), 1 - 10.0 ** rng.uniform(-6, -4, (len(length), 1)))
    right = np.where(rng.random((len(length), near)) < 0.5, wide, wide**2)
    left = right - rng.uniform(0, 2, right.shape)
    # One of the spans was found by search: unit normals, the last of them 0.3 degrees from H.
    left[0, :3], right[0, :3] = (-0.3084362, 0.869724, 0.38528857), (-0.00258714, -0.00318275, 0.99999159)
    left[0, 3:] = right[0, 3:] = 0
    length[0] = 4
    vectors = SpanVectors.quantise(left, right, length)
    pixels = model.compute(vectors, length, np.array([[0, QuotientSpans.ONE]]))
    last = np.cumsum(length) - 1
    assert not pixels.away[last].any()
    for word in (pixels.numerator.codes[:, 0], pixels.rest.codes):
        assert (word[last] > 0).all()
    end = vectors.start + vectors.step * np.ldexp(length - 1.0, -vectors.exponent)[:, np.newaxis]
    assert end.max() < 2**17


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: QuotientSpans(0), "lights must be at least 1, not 0"),
        (
            lambda: QuotientSpans(highlights=False, mirror=True),
            "without highlights there is no mirror direction",
        ),
        (
            lambda: SpanVectors.quantise(np.zeros((1, 3)), np.zeros((1, 3)), np.array([3])),
            "a span needs a vector at one of its ends that is finite and not 0",
        ),
        (
            lambda: SpanVectors.quantise(np.ones((1, 3)), np.full((1, 3), np.nan), np.array([3])),
            "a span needs a vector at one of its ends that is finite and not 0",
        ),
        (
            lambda: SpanVectors.quantise(np.ones((1, 3)), -np.ones((1, 3)), np.array([2])),
            "the step of a span of two pixels does not fit: give two spans of one pixel",
        ),
        (
            lambda: QuotientSpans().differences(
                SpanVectors(np.full((1, 3), -(1 << 17)), np.zeros((1, 3), int), np.array([0])),
                np.zeros((1, 2), int),
            ),
            "start must be greater than -1",
        ),
        (
            lambda: QuotientSpans().differences(
                SpanVectors(np.zeros((1, 4), int), np.zeros((1, 4), int), np.array([0])),
                np.zeros((1, 2), int),
            ),
            "start must have the components x0, y0, z0",
        ),
    ],
)
def test_refused(make, text):
    with pytest.raises(ValueError, match=f"^{text}$"):
        make()
