"""Record of the quotients of attributes."""

from functools import partial

import numpy as np

from blysk.bench.units.albedo.attribute_spans import attribute_word_beats
from blysk.bench.units.operands import any_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.albedo.attribute_spans import AttributeSpans, AttributeWords
from blysk.golden.albedo.attributes import Attributes
from blysk.golden.number.fixed import Fixed
from blysk.hdl.albedo.attributes import AttributesUnit
from blysk.sim.engines.beats import dtype_of

__all__ = ["RECORD", "any_words"]


def any_words(
    rng: np.random.Generator, model: AttributeSpans, count: int
) -> tuple[AttributeWords, np.ndarray]:
    """Words of pixels, and the attributes that they stand for.

    1/W is 2^-15 to 1, and over 1/2 in half of the pixels. Its logarithm is uniform in both halves. In every
    fourth pixel the attributes are 0 or an end of their range. Their words are then off by up to 3 steps, as
    in spans.

    Returns
    -------
    words : AttributeWords
        The words.
    exact : float64 array, shape (count, attributes)
        Attributes of the words, with coordinates from -1 to 1.
    """
    least = np.r_[np.zeros(3 * model.colors), -np.ones(2 * model.coordinates)]
    exact = rng.uniform(least, 1, (count, model.attributes))
    exact[::4] = np.where(rng.random(exact[::4].shape) < 0.3, 0, rng.choice([least, np.ones_like(least)]))
    weight = np.full(count, 1 - 2.0**-21)
    if model.perspective:
        octave = np.where(rng.random(count) < 0.5, rng.uniform(8, 22, count), rng.uniform(22, 23, count))
        weight = np.maximum(np.floor(2.0**octave), 252) * 2.0**-23
    codes = np.rint(exact * weight[:, np.newaxis] * 2.0**23).astype(np.int64)
    codes[::4] += rng.integers(-3, 4, codes[::4].shape)
    format = model.WORD_FORMAT
    codes = np.clip(codes, format.min_code, format.max_code)
    of_weight = Fixed.round(format, weight)
    base = rng.integers(-model.LARGEST_BASE, model.LARGEST_BASE + 1, (count, 2))
    of_span = base, rng.integers(0, model.LARGEST_RANGE + 1, count), rng.integers(0, 16, count)
    exact = codes / (of_weight.codes[:, np.newaxis] if model.perspective else 1 << 23)
    return AttributeWords(Fixed(format, codes), of_weight, *of_span), exact


def _words_of(model, beats) -> AttributeWords:
    """Words of the pixels that beats describe."""
    parts = [beats[name] for name in ("colors", "coordinates") if name in beats.dtype.names]
    numerators = Fixed(model.WORD_FORMAT, np.column_stack(parts))
    weight = Fixed(model.WORD_FORMAT, beats["weight"]) if model.perspective else None
    of_span = [None] * 3
    if model.coordinates:
        of_span = [beats[name].astype(np.int64) for name in ("base", "range", "level")]
    return AttributeWords(numerators, weight, *of_span)


def _expect(unit, case):
    found = unit.model.compute(_words_of(unit.model.spans, case.beats))
    beats = np.zeros(len(case.beats), dtype_of(unit.o.payload.shape()))
    if found.colors is not None:
        beats["colors"] = found.colors.codes
    if found.coordinates is not None:
        beats["coordinates"], beats["level"] = found.coordinates.codes, found.level
    return beats


def _pixels(unit, rng, count):
    """Pixels with 1/W from 2^-15 to 1 and attributes of every size. In half of the pixels 1/W is over 1/2."""
    return Case(attribute_word_beats(unit, any_words(rng, unit.model.spans, count)[0]))


def _words(unit, rng, count):
    """Any words: 1/W of every size and sign, numerators larger than 1/W, and any base and range."""
    p = unit.model.spans
    numerators, weight = (any_codes(rng, p.WORD_FORMAT, count, k) for k in (p.attributes, 1))
    of_span = any_codes(rng, p.BASE_FORMAT, count, 2), rng.integers(0, 16, count), rng.integers(0, 16, count)
    words = AttributeWords(Fixed(p.WORD_FORMAT, numerators), Fixed(p.WORD_FORMAT, weight[:, 0]), *of_span)
    return Case(attribute_word_beats(unit, words))


def _measure(rng, count, model):
    """Attributes against the quotient of the words. Errors of coordinates are in parts of ``2^range``."""
    words, exact = any_words(rng, model.spans, count)
    found, true = [], []
    if model.spans.colors:
        colors = model.compute(words).colors
        found.append(colors.values)
        true.append(np.clip(exact[:, :3], 0, 1))
    if model.spans.coordinates:
        # In the largest range the rounding of a coordinate counts least.
        words = words._replace(range=np.full(count, model.spans.LARGEST_RANGE))
        coordinates = model.compute(words).coordinates
        found.append(np.ldexp(coordinates.values - words.base, -model.spans.LARGEST_RANGE))
        true.append(exact[:, -2:])
    at = words.weight.values[:, np.newaxis]
    return Sample(np.concatenate(found, axis=1), np.concatenate(true, axis=1), None, at)


_COLORS = Attributes()
_COORDINATES = Attributes(AttributeSpans(colors=False, coordinates=True))
_BOTH = Attributes(AttributeSpans(coordinates=True))
_FLAT = Attributes(AttributeSpans(coordinates=True, perspective=False))

RECORD = Record(
    name="attributes",
    title="Vertex colours and texture coordinates by one reciprocal of 1/W",
    source="docs/theory/textures.md#quotient",
    variants={
        "both": Variant(
            partial(AttributesUnit, _BOTH),
            partial(_measure, model=_BOTH),
            "1/W from 2^-15 to 1, colours and coordinates",
            note="coordinates in parts of 2^range",
        ),
        "colours": Variant(
            partial(AttributesUnit, _COLORS),
            partial(_measure, model=_COLORS),
            "1/W from 2^-15 to 1, colours 0 to 1",
            long=True,
        ),
        "coordinates": Variant(
            partial(AttributesUnit, _COORDINATES),
            partial(_measure, model=_COORDINATES),
            "1/W from 2^-15 to 1, coordinates",
            note="in parts of 2^range",
            long=True,
        ),
        "both, interval 3": Variant(partial(AttributesUnit, _BOTH, 3), long=True),
        "colours, interval 4": Variant(partial(AttributesUnit, _COLORS, 4), long=True),
        "both, orthographic": Variant(partial(AttributesUnit, _FLAT), long=True),
        "8 bits of a share": Variant(
            partial(AttributesUnit, Attributes(AttributeSpans(False, True, False), 8)), long=True
        ),
    },
    expect=_expect,
    stimuli={
        "pixels": Stimulus(_pixels, 2000, pace=lambda unit: unit.initiation_interval),
        "words": Stimulus(_words, 2000, pace=lambda unit: unit.initiation_interval),
    },
    axis="1/W",
    logarithmic=True,
)
