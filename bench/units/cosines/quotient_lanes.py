"""Record of the spans of the quotient method with several lanes."""

from functools import partial

import numpy as np

from blysk.bench.units.cosines.quotient_spans import (
    any_vectors,
    extreme_words,
    line_directions,
    vector_case,
)
from blysk.bench.units.operands import short_lengths
from blysk.bench.units.record import Record, Stimulus, Variant
from blysk.golden.cosines.quotient_lanes import QuotientLanes
from blysk.golden.cosines.quotient_spans import QuotientSpans, SpanVectors
from blysk.hdl.cosines.quotient_lanes import QuotientLanesUnit
from blysk.sim.engines.beats import dtype_of

__all__ = ["RECORD", "vectors_with_pairs"]


def vectors_with_pairs(rng: np.random.Generator, model: QuotientSpans, length: np.ndarray) -> SpanVectors:
    """Vectors as of `any_vectors`, in which a span of two pixels is a pair with an exponent of any value.

    Without pairs a span of two pixels is a part of a span of three pixels.
    """
    if isinstance(model, QuotientLanes) and not model.pairs:
        return any_vectors(rng, model, np.where(length == 2, 3, length))
    vectors, pair = any_vectors(rng, model, length), length == 2
    second = any_vectors(rng, model, np.ones(np.count_nonzero(pair), dtype=np.int64))
    vectors.step[pair] = second.start
    vectors.exponent[pair] = rng.integers(0, 16, len(second.start))
    return vectors


def _expect(unit, case):
    beats = case.beats
    vectors = SpanVectors(*(beats.get(name) for name in SpanVectors._fields))
    pixels = unit.model.compute(vectors, beats["length"], case.constants)
    words, present, span = unit.model.beats(pixels, beats["length"])
    found = np.zeros(len(span), dtype_of(unit.o.payload.shape()))
    found["rest"], found["line"] = words.rest.codes, words.line.codes
    found["span"] = np.where(np.arange(present.shape[1]), present, 1 - span[:, np.newaxis] % 2)
    if "numerator" in found.dtype.names:
        found["numerator"] = words.numerator.codes
    if "away" in found.dtype.names:
        found["away"] = (words.away << np.arange(words.away.shape[2])).sum(axis=2)
    return found


def _spans(unit, rng, count):
    """Spans, most of them short, and many of them pairs. Then 60 spans of one pixel fill the memory."""
    length = np.maximum(short_lengths(rng, count, 1) % (1 << unit.length_bits), 1)
    length = np.r_[np.where(rng.random(len(length)) < 0.2, 2, length), np.ones(60, dtype=np.int64)]
    vectors = vectors_with_pairs(rng, unit.model, length)
    return vector_case(unit, vectors, length, line_directions(rng, unit.model.lights))


def _lengths(unit, rng, count):
    """Spans of every length from 1 to 70 pixels."""
    length = rng.permutation(np.arange(1, min(71, 1 << unit.length_bits)))
    vectors = vectors_with_pairs(rng, unit.model, length)
    return vector_case(unit, vectors, length, line_directions(rng, unit.model.lights))


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels, where the last bits of differences change the words."""
    length = np.maximum(rng.integers(3000, 4096, 8) % (1 << unit.length_bits), 1)
    vectors = vectors_with_pairs(rng, unit.model, length)
    return vector_case(unit, vectors, length, line_directions(rng, unit.model.lights))


def _any_steps(unit, rng, count):
    """Steps of any size, not shifted. Sums wrap."""
    length = rng.integers(3, 4 * unit.model.lanes, count)
    start, step = rng.integers(1 - (1 << 17), 1 << 17, (2, count, len(unit.model.components)))
    vectors = SpanVectors(start, step, np.zeros(count, dtype=np.int64))
    return vector_case(unit, vectors, length, line_directions(rng, unit.model.lights))


_BOTH = "N.H", "N.H, 4 lanes"
"""Variants that get every stimulus."""

RECORD = Record(
    name="quotient_lanes",
    title="Squares and linear functions of N/W along spans, several pixels a cycle",
    source="docs/theory/quotient.md#lanes",
    variants={
        "N.H": Variant(partial(QuotientLanesUnit, QuotientLanes())),
        "N.H, 4 lanes": Variant(partial(QuotientLanesUnit, QuotientLanes(lanes=4)), long=True),
        "R.V": Variant(partial(QuotientLanesUnit, QuotientLanes(mirror=True)), long=True),
        "2 lights": Variant(partial(QuotientLanesUnit, QuotientLanes(2), 9), long=True),
        "2 lights, no highlights": Variant(
            partial(QuotientLanesUnit, QuotientLanes(2, highlights=False)), long=True
        ),
        "N.H, no pairs": Variant(partial(QuotientLanesUnit, QuotientLanes(pairs=False))),
        "R.V, no pairs": Variant(
            partial(QuotientLanesUnit, QuotientLanes(mirror=True, pairs=False)), long=True
        ),
        "2 lights, no pairs": Variant(
            partial(QuotientLanesUnit, QuotientLanes(2, pairs=False), 9), long=True
        ),
        "2 lights, no highlights, no pairs": Variant(
            partial(QuotientLanesUnit, QuotientLanes(2, highlights=False, pairs=False)), long=True
        ),
        "R.V, 2 lights, 4 lanes": Variant(
            partial(QuotientLanesUnit, QuotientLanes(2, mirror=True, lanes=4), 9), long=True
        ),
    },
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 3000),
        "words": Stimulus(extreme_words, 500, repeats=4, variants=_BOTH),
        "steps": Stimulus(_any_steps, 100, variants=_BOTH),
        "lengths": Stimulus(_lengths, 70, variants=_BOTH),
        "long spans": Stimulus(_long_spans, stalled=False, variants=_BOTH),
    },
    axis="",
    still={
        "a square is no odd multiple of 2": "start_x0[1] start_y0[1] start_z0[1] start_sum_1[1]",
        "squares of components are less than 2^34": "start_x0[34-35] start_y0[34-35] start_z0[34-35] "
        "start_sum_1[34-35] start_sum_0[35-36]",
        "the second difference of w is positive and less than 2": "second[97] whole_1[48] change_1[48]",
        "the second difference of z is a multiple of 8": "second[98-100]",
        "words of the first lane change by twice a step": "line_0[0] line_0_base[0] line_0_of_0[0] "
        "height_0[0]",
    },
)
