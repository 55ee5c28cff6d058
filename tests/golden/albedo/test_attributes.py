"""Attributes of pixels: the reciprocal over its whole table, colours and coordinates against float64."""

import numpy as np
import pytest

from blysk.golden.albedo.attribute_spans import AttributeSpans, AttributeWords, SpanAttributes
from blysk.golden.albedo.attributes import Attributes
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.spans import pixels_of

from .ends import ends_of


def test_reciprocal_is_within_its_bound_over_the_whole_table():
    """Every fifth x is tried, and some words of every shift."""
    unit = Attributes()
    for shift in range(16):
        normal = np.arange(1 << 22, 1 << 23, 1009 if shift else 5)
        weight = normal >> shift
        rest, halves, found = unit.reciprocal(Fixed(SQ(1, 23), weight))
        assert (found == shift).all()
        assert np.abs(rest.values).max() < 0.126
        x = np.ldexp(weight.astype(float), shift - 22)
        reciprocal = rest.values + 0.5 + halves / 4
        # So the quotient of a colour is under 2.
        assert reciprocal.max() <= 1
        relative = reciprocal * x - 1
        assert np.abs(relative).max() <= Attributes.RECIPROCAL_ERROR


def test_the_reciprocal_and_the_products_are_within_their_budget():
    assert Attributes.RECIPROCAL_ERROR + Attributes.COLOR_ERROR <= 2.0**-17
    assert Attributes.RECIPROCAL_ERROR + Attributes.COORDINATE_ERROR <= 2.0**-18


@pytest.mark.parametrize("perspective", [True, False])
@pytest.mark.parametrize("ratio", [1, 2, 4, 16, 1e4])
def test_attributes_of_spans_against_float64(ratio, perspective):
    """Spans of 1 to 4095 pixels are quantised at their ends.

    Each pixel is within the bound, and some pixels are near it.
    """
    rng = np.random.default_rng(int(ratio))
    length = np.r_[1, 2, 2, 3, 4095, rng.integers(1, 2000, 60)]
    model = AttributeSpans(coordinates=True, perspective=perspective)
    unit = Attributes(model)
    ends, weights = ends_of(rng, model, length, ratio)
    spans = SpanAttributes.quantise(model, *ends, length, weights)
    words = model.compute(spans, length)
    found = unit.compute(words)
    span, index = pixels_of(length)
    t = (index / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    near, far = (w[span, np.newaxis] for w in weights) if perspective else (1, 1)
    left, right = near * (1 - t), far * t
    exact = (left * ends[0][span] + right * ends[1][span]) / (left + right)
    bounds = unit.errors(words, model.errors(spans, length))
    parts = (found.colors, exact[:, :3]), (found.coordinates, exact[:, 3:])
    for (values, true), bound in zip(parts, bounds, strict=True):
        share = np.abs(values.values - true).max(axis=1) / bound
        assert 0.5 < share.max() <= 1
    if ratio <= 2:
        assert bounds[0].max() < 2 * 2.0**-17
        assert (bounds[1] - 2.0**-15 <= np.ldexp(1.37 * 2.0**-18, words.range)).all()


def _words(unit, numerators, weight):
    """Words of colours."""
    codes = np.asarray(numerators)[:, np.newaxis] * np.ones(3, dtype=int)
    return AttributeWords(Fixed(SQ(1, 23), codes), Fixed(SQ(1, 23), np.asarray(weight)), None, None, None)


def test_colours_saturate_and_reach_1():
    """If rounding makes U larger than w, the colour is 1.

    If U is under 0, the colour is 0. If U = w, it is 1 at each of many w.
    """
    unit = Attributes()
    weight = np.r_[300, 299, 1 << 22, (1 << 23) - 1]
    colors = unit.compute(_words(unit, weight + np.r_[3, 3, 3, 0], weight)).colors
    assert (colors.values == 1).all()
    assert (unit.compute(_words(unit, [-3, -1, 0, 0], weight)).colors.codes == 0).all()
    weight = np.arange(256, 1 << 23, 1237)
    colors = unit.compute(_words(unit, weight, weight)).colors
    assert np.abs(colors.values - 1).max() <= 2.0**-16


def test_coordinates_at_their_ends_do_not_wrap():
    """U exceeds w by six steps, as the errors of both words can make it.

    1/W has every size, and U has both signs.
    """
    unit = Attributes(AttributeSpans(colors=False, coordinates=True))
    weight = np.unique(np.r_[np.arange(252, 600), np.floor(2.0 ** np.linspace(8, 22.999, 3000)).astype(int)])
    numerator = np.minimum(weight + 6, (1 << 23) - 1)
    codes, format, count = np.column_stack([numerator, -numerator]), SQ(1, 23), len(weight)
    base, range_ = np.tile([1984, -1984], (count, 1)), np.full(count, 11)
    words = AttributeWords(Fixed(format, codes), Fixed(format, weight), base, range_, np.zeros(count, int))
    found = unit.compute(words).coordinates.values
    error = np.abs(found - [1984 + 2048, -1984 - 2048]).max(axis=1)
    assert (error <= unit.errors(words, np.full(count, 3 * 2.0**-23))[1]).all()


def test_a_coordinate_outside_its_format_wraps():
    unit = Attributes(AttributeSpans(False, True, False), share_bits=8)
    format = SQ(1, 23)
    codes = np.array([[1 << 22, -(1 << 22)]])
    words = AttributeWords(Fixed(format, codes), None, np.array([[4000, 7]]), np.array([11]), np.array([3]))
    found = unit.compute(words)
    assert found.coordinates.format == SQ(13, 8)
    assert found.coordinates.values.tolist() == [[4000 + 1024 - 8192, 7 - 1024]]
    assert found.level.tolist() == [3]


def test_refused():
    with pytest.raises(ValueError, match=r"^share_bits must be 8 to 14, not 15$"):
        Attributes(share_bits=15)
    words = AttributeWords(Fixed(SQ(1, 23), np.zeros((1, 3), int)), None, None, None, None)
    with pytest.raises(ValueError, match=r"^perspective needs 1/W$"):
        Attributes().compute(words)
    with pytest.raises(ValueError, match=r"^texture coordinates need a base and a range$"):
        Attributes(AttributeSpans(False, True, False)).compute(words)
