"""Record of the quadratic evaluators."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import (
    LONG,
    SPANS_45,
    any_curves,
    code_pairs_at,
    component_words,
    curves,
    curves_of,
    log_lengths,
    pixel_of,
    short_lengths,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit

__all__ = ["RECORD", "spans_of"]

_FORMATS = {"g": GPQ.G_FORMAT, "p": GPQ.P_FORMAT, "q": GPQ.Q_FORMAT}


def _measure(rng, count, form):
    g, p, q = curves(rng, count)
    length = log_lengths(rng, count, 2)
    pixel = pixel_of(rng, length)
    found = QuadraticEvaluator(form).compute(g, p, q, length, np.arange(count), pixel)
    t = (pixel / (length - 1))[:, np.newaxis]
    exact = (g.values * t + p.values) * t + q.values
    return Sample(found.values, exact, exact, pixel[:, np.newaxis])


def _expect(unit, case):
    length = case.beats["length"]
    words = (Fixed(format, case.beats[name]) for name, format in _FORMATS.items())
    return unit.model.compute(*words, np.maximum(length, 1), *pixels_of(length)).codes


def spans_of(rng, length):
    """Input of spans of given lengths, with coefficients of any size."""
    return Case(any_curves(rng, len(length)) | {"length": length})


def _spans(unit, rng, count):
    """Coefficients of any size. Most spans are short, a few are long, and some have no pixel."""
    return spans_of(rng, short_lengths(rng, count))


def _corners(unit, rng, count):
    """Curves of spans between unit normals, with angles of 0 to 180 degrees, and curves of extreme codes."""
    angles = np.repeat([0, 1e-4, 1, 45, 89.9, 90, 90.01, 135, 180], 5)
    length = np.r_[np.tile([1, 2, 3, 16, 4095], 9), np.full(8, 33)]
    real = curves_of(*component_words(*code_pairs_at(rng, len(angles), angles)))
    largest = np.array(np.meshgrid(*[[False, True]] * 3)).reshape(3, -1)
    beats = {}
    for (name, format), word, pick in zip(_FORMATS.items(), real, largest, strict=True):
        ends = np.where(pick, format.max_code, format.min_code)[:, np.newaxis].repeat(3, axis=1)
        beats[name] = np.vstack([word.codes, ends])
    order = np.argsort(length, kind="stable")
    return Case({name: codes[order] for name, codes in (beats | {"length": length}).items()})


def _last_bits(unit, rng, count):
    """Spans of all lengths, and many short spans, because last bits of products rarely change a result."""
    return spans_of(rng, np.r_[rng.permutation(4096)[:60], rng.integers(0, 40, count // 20)])


RECORD = Record(
    name="quadratic_evaluator",
    title="Normals of a span by multiplication",
    source="docs/theory/interpolation.md#quadratic-normals",
    variants={
        form: Variant(
            partial(QuadraticEvaluatorUnit, QuadraticEvaluator(form)),
            partial(_measure, form=form),
            f"{SPANS_45}, {LONG}",
            beat={"length": 64},
            source=f"docs/theory/interpolation.md#quadratic-normals; [T] figure 2.9 {figure}",
        )
        for form, figure in zip(QUADRATIC_FORMS, "ab", strict=True)
    },
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 2000),
        "corners": Stimulus(_corners, stalled=False, variants=QUADRATIC_FORMS),
        "last bits": Stimulus(_last_bits, 60_000, stalled=False),
    },
    axis="pixel of the span",
    logarithmic=True,
    waivers={"reciprocal": "A reciprocal is normalised, so its first bit is 1 already."},
    still={
        "a reciprocal is normalised, so its first bit is 1": (
            "reciprocals_word[17] reciprocals.port__data[17]"
        ),
        "for a length of 12 bits the shift is at most 12": "shift[4]",
        "a square is 0 or 1 modulo 4": "square[1]",
        "the square of t is at most 1, and not negative": "square[35]",
    },
)
