"""Beats of several lanes: the same pixels as with one lane."""

import numpy as np
import pytest

from blysk.bench.units.cosines.quotient_lanes import vectors_with_pairs
from blysk.bench.units.cosines.quotient_spans import line_directions
from blysk.golden.cosines.quotient_lanes import QuotientLanes, pixels_of_beats, separate_pairs
from blysk.golden.cosines.quotient_spans import QuotientSpans


@pytest.mark.parametrize("lanes", [2, 4])
def test_beats_have_the_pixels_of_one_lane(lanes):
    rng, model = np.random.default_rng(1), QuotientLanes(lanes=lanes)
    length = rng.permutation(np.r_[rng.integers(1, 9, 300), 1:71])
    vectors, direction = vectors_with_pairs(rng, model, length), line_directions(rng, 1)
    apart, each, span = separate_pairs(vectors, length)
    single = QuotientSpans().compute(apart, each, direction)
    words, present, of_beat = model.beats(model.compute(vectors, length, direction), length)
    assert present.sum() == length.sum() == each.sum()
    assert np.array_equal(words.rest.codes[present], single.rest.codes)
    assert np.array_equal(words.numerator.codes[present], single.numerator.codes)
    assert not words.line.codes[~present].any()
    assert np.array_equal(np.bincount(of_beat), -(-length // lanes))
    assert np.array_equal(np.bincount(span, each), length)


def test_each_pixel_of_a_pair_is_a_span():
    rng, model = np.random.default_rng(2), QuotientLanes()
    length = np.full(20, 2)
    vectors, direction = vectors_with_pairs(rng, model, length), line_directions(rng, 1)
    pixels = model.compute(vectors, length, direction)
    for place, start in enumerate((vectors.start, vectors.step)):
        alone = QuotientSpans().compute(vectors._replace(start=start), length // 2, direction)
        assert np.array_equal(pixels.rest.codes[place::2], alone.rest.codes)


def test_without_pairs_words_are_those_of_one_lane():
    """Spans of geometry bring no lines, and a span of two pixels has a step."""
    rng, model = np.random.default_rng(3), QuotientLanes(pairs=False)
    length = rng.integers(1, 6, 300)
    vectors, direction = vectors_with_pairs(rng, model, length), line_directions(rng, 1)
    assert vectors.step[length == 2].any(axis=1).all()
    assert model.with_lines(vectors, direction) is vectors
    found, single = (each.compute(vectors, length, direction) for each in (model, QuotientSpans()))
    for name in ("numerator", "rest", "line"):
        assert np.array_equal(getattr(found, name).codes, getattr(single, name).codes)


def test_pixels_of_beats():
    index, present, span = pixels_of_beats(np.array([3, 0, 2, 1]), 2)
    assert index.tolist() == [[0, 1], [2, 2], [3, 4], [5, 5]]
    assert present.tolist() == [[True, True], [True, False], [True, True], [True, False]]
    assert span.tolist() == [0, 0, 2, 3]
    index, present, span = pixels_of_beats(np.array([5, 0, 2, 4]), 4)
    assert index.tolist() == [[0, 1, 2, 3], [4, 4, 4, 4], [5, 6, 5, 5], [7, 8, 9, 10]]
    assert present.sum(axis=1).tolist() == [4, 1, 2, 4]
    assert span.tolist() == [0, 0, 2, 3]
    assert len(pixels_of_beats(np.zeros(0, dtype=int), 2)[0]) == 0


def test_number_of_lanes_is_checked():
    with pytest.raises(ValueError, match="lanes must be 2 or 4, not 3"):
        QuotientLanes(lanes=3)
