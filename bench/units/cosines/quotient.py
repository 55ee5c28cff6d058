"""Record of the quotient unit."""

from functools import partial

import numpy as np

from blysk.bench.units.cosines.quotient_spans import pixel_word_beats
from blysk.bench.units.operands import any_codes, word_ends
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.quotient import OCTAVES, STEPS, Quotient
from blysk.golden.cosines.quotient_spans import PixelWords, QuotientSpans
from blysk.golden.number.fixed import Fixed
from blysk.hdl.cosines.quotient import QuotientUnit
from blysk.sim.engines.beats import dtype_of

__all__ = ["RECORD"]


def _words_of(model, beats) -> PixelWords:
    """Words of the pixels that beats describe."""
    format, count = model.square_format, len(beats["rest"])
    none = np.zeros((count, 0), dtype=np.int64)
    numerator = Fixed(format, beats["numerator"] if model.highlights else none)
    away = np.zeros((count, model.lights), dtype=bool)
    if model.takes_heights:
        away = (beats["away"][:, np.newaxis] >> np.arange(model.lights) & 1).astype(bool)
    line = Fixed(model.LINE_FORMAT, beats["line"])
    return PixelWords(numerator, Fixed(format, beats["rest"]), line, away)


def _expect(unit, case):
    p = unit.model
    cosine, place, too_small = p.compute(_words_of(p.spans, case.beats))
    beats = np.zeros(len(too_small), dtype_of(unit.o.payload.shape()))
    beats["lights"]["cosine"] = cosine.codes
    if p.spans.highlights:
        beats["lights"]["highlight"] = place.codes
    beats["out_of_range"], beats["span"] = too_small, case.beats["span"]
    return beats


def _squares(model, rng, count):
    """``m = x^2 + y^2`` and ``w = z^2`` of vectors of lengths 1/8 to 1, and the squared sine ``m/(m + w)``.

    In half of the vectors the logarithm of the squared sine is uniform. In some vectors it is replaced by 1
    minus the squared sine.
    """
    length = 2.0 ** rng.uniform(-3, 0, count)
    sine = np.where(rng.random(count) < 0.5, 2.0 ** -rng.uniform(0, 20, count), rng.uniform(0, 1, count))
    sine = np.where(rng.random(count) < 0.3, 1 - sine, sine)
    return length**2 * sine, length**2 * (1 - sine), sine


def _pixels(model, rng, squares, cosine) -> PixelWords:
    """Words of pixels from m and w of the first light and N·L of all lights."""
    m, w = squares
    numerator = Fixed.round(model.square_format, np.tile(m[:, np.newaxis], model.lights))
    if not model.highlights:
        m, w = np.zeros_like(m), m + w
        numerator = numerator[:, :0]
    for light in range(1, numerator.shape[1]):
        numerator.codes[:, light] = np.floor(np.ldexp((m + w) * rng.random(len(m)), 47))
    line = Fixed.round(model.LINE_FORMAT, cosine * np.sqrt(m + w)[:, np.newaxis] * (1 - 2.0**-16))
    away = (rng.random(line.shape) < 0.2) & model.takes_heights
    return PixelWords(numerator, Fixed.round(model.square_format, w), line, away)


def _vectors(unit, rng, count):
    """Vectors of every direction. Some are at a highlight's peak, some orthogonal to H, some face away."""
    p = unit.model.spans
    *squares, _ = _squares(p, rng, count)
    pixels = _pixels(p, rng, squares, rng.uniform(-1, 1, (count, p.lights)))
    return Case(_beats(unit, pixels, count))


def _beats(unit, pixels, count):
    return pixel_word_beats(unit, pixels, np.arange(count))


def _words(unit, rng, count):
    """Words of every size and sign, with extreme codes and powers of two. q is often too small, or wraps."""
    p = unit.model.spans
    squares = any_codes(rng, p.square_format, count, p.lights * p.highlights + 1)
    squares = np.where(rng.random(squares.shape) < 0.7, np.abs(squares), squares)
    squares[::5] = 1 << rng.integers(0, 48, squares[::5].shape)
    squares[1::7] = word_ends(rng, *squares[1::7].shape) << 30
    squares = np.clip(squares, p.square_format.min_code, p.square_format.max_code)
    line = Fixed(p.LINE_FORMAT, any_codes(rng, p.LINE_FORMAT, count, p.lights))
    away = (rng.random((count, p.lights)) < 0.2) & p.takes_heights
    numerator = Fixed(p.square_format, squares[:, :-1])
    rest = Fixed(p.square_format, squares[:, -1])
    return Case(_beats(unit, PixelWords(numerator, rest, line, away), count))


def _measure(rng, count, model):
    """N·L, and sin^2 from its place. The error of sin^2 is relative to the smaller of sin^2 and cos^2."""
    m, w, sine = _squares(model.spans, rng, count)
    exact = rng.uniform(-1, 1, (count, 1))
    pixels = _pixels(model.spans, rng, (m, w), exact)
    pixels = pixels._replace(away=np.zeros_like(pixels.away))
    cosine, place, _ = model.compute(pixels)
    row, step = np.divmod(place.values[:, 0], STEPS)
    second, row = np.divmod(row, OCTAVES + 1)
    found = np.ldexp(np.where(row > 0, 1, 0) + step / STEPS, (np.maximum(row, 1) - 1 - OCTAVES).astype(int))
    true = np.where(second == 1, 1 - sine, sine)
    known = (true > 2.0**-OCTAVES) & (place.codes[:, 0] < 512 << 12)
    sines = found[known] / true[known], np.ones(int(known.sum()))
    return Sample(
        np.r_[cosine.values[:, 0], sines[0]],
        np.r_[exact[:, 0], sines[1]],
        None,
        np.r_[np.sqrt(m + w), np.sqrt(m + w)[known]],
    )


_DEFAULT = Quotient()

RECORD = Record(
    name="quotient",
    title="N·L and the place of the squared sine in a lobe's table, by one reciprocal root",
    source="docs/theory/quotient.md#pixel",
    variants={
        "N.H": Variant(
            partial(QuotientUnit, _DEFAULT),
            partial(_measure, model=_DEFAULT),
            "vectors of lengths 1/8 to 1 in every direction",
            note="errors of N.L, and of sin^2 relative to the smaller of sin^2 and cos^2",
        ),
        "R.V": Variant(partial(QuotientUnit, Quotient(QuotientSpans(mirror=True)))),
        "2 lights": Variant(partial(QuotientUnit, Quotient(QuotientSpans(2))), long=True),
        "2 lights, no highlights": Variant(
            partial(QuotientUnit, Quotient(QuotientSpans(2, highlights=False))), long=True
        ),
        "interval 3": Variant(partial(QuotientUnit, _DEFAULT, 3), long=True),
        "without memories": Variant(partial(QuotientUnit, _DEFAULT, memories=False), long=True),
        "2 lights of R.V, interval 2": Variant(
            partial(QuotientUnit, Quotient(QuotientSpans(2, mirror=True)), 2), long=True
        ),
    },
    expect=_expect,
    stimuli={"vectors": Stimulus(_vectors, 3000), "words": Stimulus(_words, 3000)},
    axis="length of the vector",
    logarithmic=True,
    still={
        "the reciprocal root r is at least 1/2, so its first bit is 1": (
            "{roots_word,roots,port__data}[18] {root,cosine_0_b,square_root_a,square_root_b}[16]"
        ),
        "a square is 0 or 1 modulo 4": "square_root[1]",
        "the shifts of q and m are even": "octave_0[0]",
        "the smaller of m and w is less than q": "octaves_0[5]",
    },
)
