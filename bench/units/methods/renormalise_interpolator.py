"""Record of the renormalising interpolator."""

from functools import partial

import numpy as np

from blysk.bench.units.methods.interpolator import long_lengths, operand_beats, options
from blysk.bench.units.normals.line_setup import any_lines
from blysk.bench.units.operands import (
    component_words,
    light_constants,
    short_lengths,
    span_lengths,
    sphere,
    spread_angles,
    turned,
    unit_codes,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.methods.renormalise_interpolator import RenormaliseInterpolator
from blysk.golden.normals.line_setup import quantise_line
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.reference.geometry import normalise
from blysk.hdl.methods.renormalise_interpolator import RenormaliseInterpolatorUnit

__all__ = ["RECORD"]

_METHOD = RenormaliseInterpolator()
_LARGEST = 120.0


def _measure(rng, count):
    """N·L and 1 - N·H along spans. The vectors at their ends have lengths of 1/4 to 1.

    The dot product of two equal unit vectors counts as 1.
    """
    length = span_lengths(rng, count)
    spans = len(length)
    around = sphere(rng, 1)
    left = turned(rng, np.repeat(around, spans, axis=0), rng.permutation(spread_angles(rng, spans, 60.0)))
    right = turned(rng, left, rng.permutation(spread_angles(rng, spans, _LARGEST)))
    angle = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", left, right), -1, 1)))
    ends = quantise_line(*(end * rng.uniform(0.25, 1, (spans, 1)) for end in (left, right)))
    light, halfway = quantise(sphere(rng, 1)), quantise(around)
    words = [Fixed(_METHOD.END_FORMAT, end) for end in ends]
    operands = _METHOD.compute(*words, length, *component_words(light, halfway))
    found = np.stack([word.values[:, 0] / _METHOD.COSINE_OF_ZERO for word in operands[:2]])
    span, pixel = pixels_of(length)
    t = (pixel / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    normal = normalise((1 - t) * ends[0][span] + t * ends[1][span])
    exact = np.stack([normal @ normalise(light[0] / ONE), 1 - normal @ normalise(halfway[0] / ONE)])
    kept = ~operands.out_of_range[span]
    return Sample(found[:, kept], exact[:, kept], exact[:, kept], angle[span[kept]])


def _operands(unit, case):
    beats = case.beats
    ends = (Fixed(_METHOD.END_FORMAT, beats[f"normal_{side}"]) for side in ("left", "right"))
    vectors = component_words(case.constants["direction"], case.constants["halfway"])
    return unit.model.compute(*ends, beats["length"], *vectors)


def _expect(unit, case):
    return operand_beats(unit, _operands(unit, case))


def _status(unit, case):
    return {"out_of_range": int(np.count_nonzero(_operands(unit, case).out_of_range))}


def _case(unit, rng, length):
    length = np.maximum(length % (1 << unit.length_bits), 1)
    left, right = any_lines(rng, len(length))
    # The vectors at the ends are nearly opposite and nearly equally long. So the line passes near 0.
    left[1::16] = -right[1::16] + rng.integers(-20_000, 20_000, right[1::16].shape)
    limit = _METHOD.END_FORMAT.max_code
    beats = {"normal_left": np.clip(left, -limit, limit), "normal_right": right, "length": length}
    return Case(beats, light_constants(unit, *(unit_codes(rng, unit.lights) for _ in range(2))))


def _spans(unit, rng, count):
    """Vectors of any lengths and angle at the ends, some nearly opposite. Most spans are short."""
    return _case(unit, rng, short_lengths(rng, count, 1))


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels, in which the last bits of the step count; and shorter spans."""
    return _case(unit, rng, long_lengths(rng, count))


def _last_bits(unit, rng, count):
    """Many short spans, because a last bit changes a rounded result only once in thousands."""
    return _case(unit, rng, rng.integers(1, 8, count))


RECORD = Record(
    name="renormalise_interpolator",
    title="Normals of the true line on the screen, each divided by its length",
    source="docs/theory/interpolation.md#renormaliser",
    variants={
        "renormalise": Variant(
            partial(RenormaliseInterpolatorUnit, _METHOD, 1),
            _measure,
            f"spans to {_LARGEST:g} degrees, vectors of length 1/4 to 1, 1 to 4095 pixels",
            beat={"length": 64},
            note="errors of N.L and 1 - N.H; the true line counts as exact",
        ),
        "2 lights, interval 1": options(_METHOD, 2, setup_interval=1, length_bits=9),
        "interval 9, compact": options(_METHOD, setup_interval=9, product_interval=3),
        "N.H, no highlights": options(
            RenormaliseInterpolator("cosine"), 2, setup_interval=5, highlights=False
        ),
    },
    expect=_expect,
    status=_status,
    stimuli={
        "spans": Stimulus(_spans, 2000),
        "long spans": Stimulus(_long_spans, 240_000, stalled=False),
        "last bits": Stimulus(_last_bits, 4000, stalled=False),
    },
    still={"the second difference of a straight line is 0": "vector_{0-2}_second_difference[0-41]"},
)
