"""Record of the spans of the quotient method."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import short_lengths, span_lengths, word_ends
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.quotient_spans import QuotientSpans, SpanVectors
from blysk.golden.number.spans import pixels_of
from blysk.hdl.cosines.quotient_spans import QuotientSpansUnit
from blysk.sim.engines.beats import dtype_of

__all__ = ["RECORD", "any_vectors", "extreme_words", "line_directions", "pixel_word_beats", "vector_case"]


def any_vectors(
    rng: np.random.Generator, model: QuotientSpans, length: np.ndarray, near: bool = False
) -> SpanVectors:
    """Vectors that spans bring, for spans with given numbers of pixels.

    As from a source, the vectors at both ends of a span have a ratio of lengths up to 2 and an angle up to 90
    degrees.

    Parameters
    ----------
    rng : Generator
        Generator of the random numbers.
    model : QuotientSpans
        The components that a span has.
    length : int array, shape (spans,)
        Pixels of each span. The step of a span of two pixels is 0.
    near : bool
        Whether all vectors are near the z axis of the first light.
    """
    count, components = len(length), len(model.components)
    spread = 10.0 ** rng.uniform(-3, 0 if near else 1, (count, 1))
    left = np.eye(components)[2] + spread * rng.normal(size=(count, components))
    right = left + np.linalg.norm(left, axis=1, keepdims=True) * rng.normal(
        size=(count, components)
    ) * 10.0 ** rng.uniform(-4, 0, (count, 1))
    dark = np.einsum("ij,ij->i", left, right) < 0
    right[dark] = left[dark]
    sizes = np.linalg.norm(left, axis=1) / np.linalg.norm(right, axis=1)
    right *= np.clip(1, sizes / 2, sizes * 2)[:, np.newaxis]
    return SpanVectors.quantise(left, right, np.where(length > 2, length, 1))


def line_directions(rng: np.random.Generator, lights: int) -> np.ndarray:
    """Codes of ``sin a`` and ``cos a`` of lights, shape (lights, 2). Some angles a are 0 or 90 degrees."""
    angle = rng.choice([0, np.pi / 2, np.nan], lights)
    angle = np.where(np.isnan(angle), rng.uniform(0, np.pi / 2, lights), angle)
    return QuotientSpans().codes_of(np.sin(angle), np.cos(angle))


def pixel_word_beats(unit, pixels, span: np.ndarray) -> np.ndarray:
    """Words of pixels as output beats of a `QuotientSpansUnit`, or as input beats of another unit.

    ``span`` is the index of each pixel's span.
    """
    stream = unit.o if isinstance(unit, QuotientSpansUnit) else unit.i
    beats = np.zeros(len(span), dtype_of(stream.payload.shape()))
    beats["rest"], beats["line"], beats["span"] = pixels.rest.codes, pixels.line.codes, 1 - span % 2
    lights = pixels.line.shape[1]
    if "numerator" in beats.dtype.names:
        beats["numerator"] = pixels.numerator.codes
    if "away" in beats.dtype.names:
        beats["away"] = (pixels.away << np.arange(lights)).sum(axis=1)
    return beats


def _expect(unit, case):
    beats = case.beats
    vectors = SpanVectors(beats["start"], beats["step"], beats["exponent"])
    pixels = unit.model.compute(vectors, beats["length"], case.constants)
    return pixel_word_beats(unit, pixels, pixels_of(beats["length"])[0])


def vector_case(unit, vectors, length, constants):
    """Spans of vectors for a unit, and the directions of its lights if it has highlights.

    If spans bring their lines, these are computed from the directions, and the unit has no constants.
    """
    if unit.model.brings_lines:
        vectors, constants = unit.model.with_lines(vectors, constants), None
    beats = {name: codes for name, codes in vectors._asdict().items() if codes is not None}
    return Case({**beats, "length": length}, constants if unit.model.highlights else None)


def _spans(unit, rng, count):
    """Spans, most of them short. Vectors at the ends have length ratios to 2 and angles to 90 degrees."""
    length = np.maximum(short_lengths(rng, count, 1) % (1 << unit.length_bits), 1)
    vectors = any_vectors(rng, unit.model, length)
    return vector_case(unit, vectors, length, line_directions(rng, unit.model.lights))


def extreme_words(unit, rng, count):
    """Extreme codes in every component and light, with any steps and exponents. Sums wrap."""
    length = np.maximum(rng.choice([1, 1, 1, 2, 3, 4, 5, 6, 7, 9, 40], count) % (1 << unit.length_bits), 1)
    shape = count, len(unit.model.components)
    start, step = (np.maximum(word_ends(rng, *shape), 1 - (1 << 17)) for _ in range(2))
    vectors = SpanVectors(start, step, rng.integers(0, 16, count))
    return vector_case(unit, vectors, length, word_ends(rng, unit.model.lights, 2))


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels, where the last bits of differences change the words."""
    length = np.maximum(rng.integers(3000, 4096, 8) % (1 << unit.length_bits), 1)
    vectors = any_vectors(rng, unit.model, length)
    return vector_case(unit, vectors, length, line_directions(rng, unit.model.lights))


def _measure(rng, count, model):
    """``q = m + w`` along spans, relative to the exact square of the interpolated vector."""
    length = span_lengths(rng, count)
    length = np.where(length == 2, 3, length)
    vectors = any_vectors(rng, model, length)
    pixels = model.compute(vectors, length, line_directions(rng, model.lights))
    span, index = pixels_of(length)
    step = np.ldexp(vectors.step, -vectors.exponent[:, np.newaxis])
    exact = np.square((vectors.start[span] + index[:, np.newaxis] * step[span]) * 2.0**-17).sum(axis=1)
    found = pixels.numerator.values[:, 0] + pixels.rest.values
    return Sample(found / exact, np.ones(len(exact)), np.ones(len(exact)), length[span])


_DEFAULT = QuotientSpans()

RECORD = Record(
    name="quotient_spans",
    title="Squares and linear functions of N/W along spans, by forward differences",
    source="docs/theory/quotient.md#span",
    variants={
        "N.H": Variant(
            partial(QuotientSpansUnit, _DEFAULT),
            partial(_measure, model=_DEFAULT),
            "vectors at the ends to 1:2 and 90 degrees, 1 to 4095 pixels",
            beat={"length": 64},
            note="relative error of q, for the codes of the vectors",
        ),
        "R.V": Variant(partial(QuotientSpansUnit, QuotientSpans(mirror=True)), long=True),
        "2 lights": Variant(partial(QuotientSpansUnit, QuotientSpans(2), 9), long=True),
        "2 lights, no highlights": Variant(
            partial(QuotientSpansUnit, QuotientSpans(2, highlights=False)), long=True
        ),
        "N.H, serial": Variant(partial(QuotientSpansUnit, _DEFAULT, serial=True)),
        "2 lights of R.V, serial": Variant(
            partial(QuotientSpansUnit, QuotientSpans(2, mirror=True), 9, serial=True), long=True
        ),
        "no highlights, serial": Variant(
            partial(QuotientSpansUnit, QuotientSpans(highlights=False), serial=True), long=True
        ),
    },
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 3000),
        "words": Stimulus(extreme_words, 500, repeats=4),
        "long spans": Stimulus(_long_spans, stalled=False),
    },
    axis="pixels of the span",
    logarithmic=True,
    still={
        "the second difference of w is positive and less than 2": "second[97] change_1[48]",
        "the second difference of z is a multiple of 8": "second[98-100]",
        "cos a is not negative": "line_z0_b[17]",
    },
)
