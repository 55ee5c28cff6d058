"""Record of the interpolator of the quotient method."""

from functools import partial

import numpy as np

from blysk.bench.units.cosines.quotient_spans import any_vectors, line_directions
from blysk.bench.units.methods.interpolator import operand_beats, options
from blysk.bench.units.operands import light_constants, short_lengths
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.cosines.quotient_spans import SpanVectors
from blysk.golden.methods.quotient_interpolator import QuotientInterpolator
from blysk.hdl.methods.quotient_interpolator import QuotientInterpolatorUnit

__all__ = ["RECORD", "any_span_vectors"]

_METHOD = QuotientInterpolator()


def any_span_vectors(
    rng: np.random.Generator, method: QuotientInterpolator, lights: int, highlights: bool, length: np.ndarray
) -> SpanVectors:
    """Vectors that spans bring, for spans with given numbers of pixels.

    A twentieth of the vectors are too short. Their spans are out of range.
    """
    vectors = any_vectors(rng, method.spans(lights, highlights), length)
    lost = rng.random(len(length)) < 0.05
    vectors.start[lost] >>= 12
    vectors.step[lost] >>= 12
    return vectors


def _operands(unit, case):
    beats, p = case.beats, unit.model
    vectors = SpanVectors(beats["start"], beats["step"], beats["exponent"])
    spans = p.spans(unit.lights, unit.highlights)
    return p.compute_vectors(spans, vectors, beats["length"], case.constants["direction"])


def _expect(unit, case):
    return operand_beats(unit, _operands(unit, case))


def _status(unit, case):
    return {"out_of_range": int(np.count_nonzero(_operands(unit, case).out_of_range))}


def _spans(unit, rng, count):
    """Spans of every length, with ends up to the limits of the method, and lights on all sides.

    A twentieth of the vectors are too short.
    """
    length = np.maximum(short_lengths(rng, count, 1) % (1 << unit.length_bits), 1)
    vectors = any_span_vectors(rng, unit.model, unit.lights, unit.highlights, length)
    directions = np.insert(line_directions(rng, unit.lights), 1, 0, axis=1)
    constants = light_constants(unit, directions, np.zeros_like(directions))
    beats = {name: getattr(vectors, name) for name in ("start", "step", "exponent")}
    return Case({**beats, "length": length}, constants)


RECORD = Record(
    name="quotient_interpolator",
    title="Operands of pixels as quotients of quadratics in N/W",
    source="docs/theory/quotient.md",
    variants={
        "quotient": Variant(partial(QuotientInterpolatorUnit, _METHOD, 1), beat={"length": 64}),
        "R.V": options(QuotientInterpolator(mirror=True)),
        "2 lights": options(_METHOD, 2, length_bits=9),
        "2 lights, no highlights": options(_METHOD, 2, highlights=False),
        "compact": options(_METHOD, product_interval=3),
    },
    expect=_expect,
    status=_status,
    stimuli={"spans": Stimulus(_spans, 3000)},
)
