"""Record of the spans of attributes."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes, log_lengths, short_lengths
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.albedo.attribute_spans import AttributeSpans, AttributeWords, SpanAttributes
from blysk.golden.number.spans import pixels_of
from blysk.hdl.albedo.attribute_spans import AttributeSpansUnit
from blysk.sim.engines.beats import dtype_of

__all__ = ["RECORD", "attribute_word_beats", "quantised_spans"]


def quantised_spans(
    rng: np.random.Generator, model: AttributeSpans, length: np.ndarray
) -> tuple[SpanAttributes, tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Quantised attributes of spans, and the values before they were quantised.

    The logarithm of the ratio of the depths at both ends is uniform, to a ratio of 16. Spans cross up to 512
    texels. In every fourth span the colours at the ends are 0 or 1.

    Parameters
    ----------
    rng : Generator
        Generator of the random numbers.
    model : AttributeSpans
        The attributes that the spans have.
    length : int array, shape (spans,)
        Pixels of each span.

    Returns
    -------
    spans : SpanAttributes
        Quantised attributes.
    ends : pair of float64 arrays, shape (spans, attributes)
        Attributes at both ends: colours, and texture coordinates in texels.
    weights : float64 array, shape (2, spans)
        1/W at both ends; 1 without perspective.
    """
    count, ends = len(length), []
    if model.colors:
        colors = rng.random((2, count, 3))
        colors[:, ::4] = np.rint(colors[:, ::4])
        ends.append(colors)
    if model.coordinates:
        places = rng.uniform(-1024, 1024, (2, count, 2))
        places[1] = places[0] + rng.choice([-512, 512], (count, 2)) * 2.0 ** -rng.uniform(0, 14, (count, 2))
        ends.append(places)
    left, right = np.concatenate(ends, axis=2)
    weights = np.ones((2, count))
    if model.perspective:
        weights[1] = 2.0 ** rng.uniform(-4, 4, count)
    level = rng.integers(0, 1 << model.LEVEL_FORMAT.width, count)
    nearness = tuple(weights) if model.perspective else None
    return SpanAttributes.quantise(model, left, right, length, nearness, level), (left, right), weights


def attribute_word_beats(unit, words: AttributeWords) -> np.ndarray:
    """Words of pixels as output beats of an `AttributeSpansUnit`, or as input beats of another unit."""
    stream = unit.o if isinstance(unit, AttributeSpansUnit) else unit.i
    beats = np.zeros(words.numerators.shape[0], dtype_of(stream.payload.shape()))
    names = beats.dtype.names
    if "colors" in names:
        beats["colors"] = words.numerators.codes[:, :3]
    if "coordinates" in names:
        beats["coordinates"] = words.numerators.codes[:, -2:]
        beats["base"], beats["range"], beats["level"] = words.base, words.range, words.level
    if "weight" in names:
        beats["weight"] = words.weight.codes
    return beats


def _beats(unit, spans: SpanAttributes, length: np.ndarray) -> np.ndarray:
    """Spans as beats."""
    p, beats = unit.model, np.zeros(len(length), dtype_of(unit.i.payload.shape()))
    for member, codes, weight in (
        ("start", spans.start, spans.weight_start),
        ("step", spans.step, spans.weight_step),
    ):
        if p.colors:
            beats[member]["colors"] = codes[:, :3]
        if p.coordinates:
            beats[member]["coordinates"] = codes[:, -2:]
        if p.perspective:
            beats[member]["weight"] = weight
    if p.coordinates:
        beats["base"], beats["range"], beats["level"] = spans.base, spans.range, spans.level
    beats["exponent"], beats["length"] = spans.exponent, length
    return beats


def _expect(unit, case):
    p, beats = unit.model, case.beats[case.beats["length"] > 0]
    lines = []
    for member in ("start", "step"):
        words = beats[member]
        parts = [words[name] for name in ("colors", "coordinates") if name in words.dtype.names]
        lines.append((np.column_stack(parts), words["weight"] if p.perspective else None))
    (start, weight_start), (step, weight_step) = lines
    of_span = [beats[name] for name in ("base", "range", "level")] if p.coordinates else []
    spans = SpanAttributes(start, step, beats["exponent"], weight_start, weight_step, *of_span)
    return attribute_word_beats(unit, p.compute(spans, beats["length"]))


def _spans(unit, rng, count):
    """Spans of every length, most of them short. A span crosses up to 512 texels, and depths up to 1:16."""
    length = np.maximum(short_lengths(rng, count, 1) % (1 << unit.length_bits), 1)
    return Case(_beats(unit, quantised_spans(rng, unit.model, length)[0], length))


def _words(unit, rng, count):
    """Any words, steps and exponents, so that sums wrap. Pixels are 0 to 40, or a power of two."""
    length = rng.choice([0, 0, 1, 1, 1, 2, 2, 3, 4, 5, 9, 40], count)
    length[:12] = rng.permutation(1 << np.arange(12)) % (1 << unit.length_bits)
    p = unit.model
    start, step = (any_codes(rng, p.WORD_FORMAT, count, p.attributes + 1) for _ in range(2))
    exponent = rng.integers(0, 16, count)
    of_span = any_codes(rng, p.BASE_FORMAT, count, 2), rng.integers(0, 16, count), rng.integers(0, 16, count)
    lines = start[:, 1:], step[:, 1:], exponent, start[:, 0], step[:, 0]
    return Case(_beats(unit, SpanAttributes(*lines, *of_span), length))


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels, where the last bits of steps count. Half of the spans have any steps."""
    length = np.maximum(rng.integers(3000, 4096, 8) % (1 << unit.length_bits), 1)
    beats = _beats(unit, quantised_spans(rng, unit.model, length)[0], length)
    # Lines with a small step have the largest exponent. Odd steps use all bits of an accumulator.
    lines = beats[::2]
    lines["exponent"] = [15, 15, 14, 0]
    for name in lines["step"].dtype.names:
        lines["step"][name] = any_codes(rng, unit.model.WORD_FORMAT, *lines["step"][name].shape) | 1
    return Case(beats)


def _pace(unit):
    """A pixel a cycle. In spaced spans a pixel may wait for the shift of its step."""
    return None if unit.spaced else 1


def _measure(rng, count, model):
    """Words of pixels in steps of 2^-23, against straight lines between exact scaled values at the ends."""
    length = log_lengths(rng, max(count // 450, 16))
    spans, (left, right), (near, far) = quantised_spans(rng, model, length)
    words = model.compute(spans, length)
    span, index = pixels_of(length)
    t = (index / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    offset, size = np.zeros((2, len(length), model.attributes))
    size += 1
    if model.coordinates:
        offset[:, -2:], size[:, -2:] = spans.base, np.ldexp(1.0, spans.range)[:, np.newaxis]
    limit = 1 - 2.0**-21
    far = np.where(length == 1, near, far)
    near, far = (w * limit / np.maximum(near, far) for w in (near, far))
    ends = []
    for attribute, weight in ((left, near), (right, far)):
        scaled = (attribute - offset) / size * (weight[:, np.newaxis] if model.perspective else 1)
        ends.append(np.clip(scaled, -limit, limit))
    exact = ends[0][span] * (1 - t) + ends[1][span] * t
    return Sample(words.numerators.values * 2.0**23, exact * 2.0**23, None, length[span][:, np.newaxis])


_BOTH = AttributeSpans(coordinates=True)

RECORD = Record(
    name="attribute_spans",
    title="Vertex colours and texture coordinates over W, and 1/W, along spans",
    source="docs/theory/textures.md#lines",
    variants={
        "both": Variant(
            partial(AttributeSpansUnit, _BOTH),
            partial(_measure, model=_BOTH),
            "depths to 1:16, 1 to 4095 pixels",
            beat={"length": 64},
            note="words of the attributes, in steps of 2^-23",
        ),
        "colours": Variant(partial(AttributeSpansUnit, AttributeSpans()), long=True),
        "coordinates": Variant(
            partial(AttributeSpansUnit, AttributeSpans(colors=False, coordinates=True), 9), long=True
        ),
        "both, orthographic": Variant(
            partial(AttributeSpansUnit, AttributeSpans(coordinates=True, perspective=False)), long=True
        ),
        "colours, spaced": Variant(partial(AttributeSpansUnit, AttributeSpans(), spaced=True), long=True),
    },
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 2000, pace=_pace),
        "words": Stimulus(_words, 400),
        "long spans": Stimulus(_long_spans, stalled=False, pace=_pace),
    },
    axis="pixels of the span",
    logarithmic=True,
)
