"""Neighbouring spans of one pixel as pairs, for a pipeline with several lanes."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.units.pipeline_spans import any_constants, any_spans
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.build import BuildError
from blysk.golden.presets import preset

TWO = preset(materials=2).built(lanes=2)


def shuffled(rng, count):
    """Spans in rows of neighbours, with breaks in x, y, length and material."""
    spans = any_spans(rng, preset(materials=2), rng.choice([1, 1, 1, 1, 0, 3, 5], count))
    x = np.cumsum(np.r_[0, spans.length[:-1]]) + np.cumsum(rng.random(count) < 0.1)
    material = np.sort(spans.material)
    return replace(spans, x=x, y=np.cumsum(rng.random(count) < 0.1), material=material)


@pytest.mark.parametrize("lanes", [2, 4])
def test_pairs_have_the_same_pixels(lanes):
    rng = np.random.default_rng(3)
    spans = shuffled(rng, 400)
    constants = any_constants(rng, TWO, spans)
    sent = TWO.interpolator.sent(spans)
    pairs = int(np.count_nonzero(sent.length == 2))
    assert pairs > 40
    assert len(spans) - len(sent) == pairs
    one, several = (
        TWO.built(lanes=1).compute(spans, constants),
        TWO.built(lanes=lanes).compute(sent, constants),
    )
    for name in ("x", "y", "color"):
        assert np.array_equal(getattr(one, name), getattr(several, name)), name
    assert TWO.built(lanes=1).interpolator.sent(spans) is spans


def test_three_neighbours_are_a_pair_and_a_span():
    spans = any_spans(np.random.default_rng(4), TWO, np.ones(7, dtype=int))
    spans = replace(
        spans, x=np.array([0, 1, 2, 9, 11, 12, 13]), y=np.zeros(7, int), material=np.zeros(7, int)
    )
    sent = TWO.interpolator.sent(spans)
    assert sent.x.tolist() == [0, 2, 9, 11, 13]
    assert sent.length.tolist() == [2, 1, 1, 2, 1]
    assert np.array_equal(sent.vectors.step[0], spans.vectors.start[1])


def test_other_designs_are_refused():
    with pytest.raises(BuildError, match="method linear makes single pixels; take the method quotient"):
        preset("linear").built(lanes=2)
    with pytest.raises(BuildError, match="an albedo comes pixel by pixel; leave out lanes or the albedo"):
        replace(TWO, albedo=Albedo())
