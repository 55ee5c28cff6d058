"""Record of the local chord interpolator."""

from functools import partial

import numpy as np

from blysk.bench.units.cosines.chord_setup import (
    FORMATS,
    LOCAL,
    any_values,
    factors_of,
    local_curves,
    parabola,
    three_values,
    value_beats,
    values_of,
)
from blysk.bench.units.cosines.chord_setup import RECORD as SETUP
from blysk.bench.units.methods.interpolator import long_lengths, of_setup, operand_beats, options
from blysk.bench.units.operands import any_codes, short_lengths, span_lengths
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit

__all__ = ["RECORD", "mixed_lengths"]

_STILL = {
    "a second difference is twice a number, so its last bit is 0": (
        "{diffuse,highlight}_0_second_difference[0]"
    ),
    "a span enters if the counts are under 28 spans and under 12 long spans; at most 3 are not counted yet": (
        "spans_inside[5] lengths.inner_level[5] long_inside[4] behind[4]"
    ),
}
"""Register bits that cannot toggle."""

_METHOD = LocalChordInterpolator()


def _measure(rng, count):
    """N·L and 1 - N·H along spans. The dot product of two equal unit vectors counts as 1."""
    length = span_lengths(rng, count)
    curves = local_curves(rng, len(length))
    values, codes = three_values(curves, len(length))
    operands = _METHOD.compute_values(codes, length)
    span, pixel = pixels_of(length)
    t = pixel / np.maximum(length - 1, 1)[span]
    found = np.stack([operands.cosine.values[:, 0], operands.highlight.values[:, 0]]) / ONE_SQUARED.values
    kept = ~operands.out_of_range[span]
    exact, formula = curves(span, t), parabola(values[:, span], t)
    # Between its three values a parabola may be less than 0. The least value of the word is 0.
    formula[1] = np.maximum(formula[1], 0)
    return Sample(found[:, kept], exact[:, kept], formula[:, kept], pixel[kept])


def _expect(unit, case):
    values, length = values_of(case.beats), case.beats["length"]
    return operand_beats(unit, unit.model.compute_values(values, length, factors_of(case.beats)))


def _status(unit, case):
    values, length = values_of(case.beats), case.beats["length"]
    operands = unit.model.compute_values(values, length, factors_of(case.beats))
    return {"out_of_range": int(np.count_nonzero(operands.out_of_range))}


def _case(unit, rng, length, values=None):
    length = np.maximum(length % (1 << unit.length_bits), 1)
    values = values or any_values(rng, len(length), unit.lights)
    return Case(value_beats(unit, values, length))


def mixed_lengths(rng: np.random.Generator, count: int) -> np.ndarray:
    """Lengths of 1 to 4 pixels, in runs and mixed. Every tenth length is up to 40."""
    length = rng.integers(1, 5, count)
    runs = rng.integers(1, 5, count // 12 + 1).repeat(12)[:count]
    length[: count // 2] = runs[: count // 2]
    length[::10] = rng.integers(1, 41, len(length[::10]))
    return length


def _spans(unit, rng, count):
    """Curves of every size. Every eighth span has any codes. Most spans are short."""
    return _case(unit, rng, short_lengths(rng, count, 1))


def _short_spans(unit, rng, count):
    """Spans of 1 to 4 pixels, in runs and mixed. In every second span the values of u are any codes."""
    values = any_values(rng, count, unit.lights)
    values.highlight[::2] = any_codes(rng, FORMATS["highlight"], *values.highlight[::2].shape)
    return _case(unit, rng, mixed_lengths(rng, count), values)


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels, in which the last bits of differences count; and shorter spans."""
    return _case(unit, rng, long_lengths(rng, count))


def _last_bits(unit, rng, count):
    """Many short spans, because a last bit changes a rounded result only once in thousands."""
    return _case(unit, rng, rng.integers(1, 8, count))


RECORD = Record(
    name="local_chord_interpolator",
    title="N·L and half the squared chord from N to H, from three values of each",
    source="docs/theory/chord.md#local-lights",
    variants={
        "chord-local": Variant(
            partial(LocalChordInterpolatorUnit, _METHOD, 1),
            _measure,
            f"{LOCAL}, 1 to 4095 pixels",
            beat={"length": 64},
            note="errors of N.L and 1 - N.H; normalised interpolation, with L and H of the pixel, counts as "
            "exact",
        ),
        "2 lights, interval 1": options(_METHOD, 2, setup_interval=1),
        "3 lights, interval 6": options(_METHOD, 3, setup_interval=6),
        "no highlights": options(_METHOD, 2, setup_interval=2, highlights=False, length_bits=5),
        "2 lights, the second fades": options(_METHOD, 2, setup_interval=3, factors=(1,)),
    },
    expect=_expect,
    status=_status,
    stimuli={
        "spans": Stimulus(_spans, 2000),
        "short spans": Stimulus(_short_spans, 800),
        "long spans": Stimulus(_long_spans, 60_000, stalled=False),
        "last bits": Stimulus(_last_bits, 8000, stalled=False),
        "corners": of_setup(SETUP),
    },
    axis="pixel of the span",
    logarithmic=True,
    still=_STILL,
)
