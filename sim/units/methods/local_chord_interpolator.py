"""Record of the local chord interpolator."""

from functools import partial

import numpy as np

from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.sim.units.cosines.local_chord_setup import (
    LOCAL,
    any_values,
    local_curves,
    parabola,
    three_values,
    value_beats,
    values_of,
)
from blysk.sim.units.cosines.local_chord_setup import RECORD as SETUP
from blysk.sim.units.methods.interpolator import long_lengths, of_setup, operand_beats, options
from blysk.sim.units.operands import short_lengths, span_lengths
from blysk.sim.units.record import Case, Record, Sample, Stimulus, Variant

__all__ = ["RECORD"]

_METHOD = LocalChordInterpolator()


def _measure(rng, count):
    """N·L and 1 - N·H along spans; 1 is the product of two unit vectors."""
    length = span_lengths(rng, count)
    curves = local_curves(rng, len(length))
    values, codes = three_values(curves, len(length))
    operands = _METHOD.compute_values(codes, length)
    span, pixel = pixels_of(length)
    t = pixel / np.maximum(length - 1, 1)[span]
    found = np.stack([operands.cosine.values[:, 0], operands.highlight.values[:, 0]]) / ONE_SQUARED.values
    kept = ~operands.out_of_range[span]
    exact, formula = curves(span, t), parabola(values[:, span], t)
    # Between its three values a parabola may be less than 0, the least value of the word.
    formula[1] = np.maximum(formula[1], 0)
    return Sample(found[:, kept], exact[:, kept], formula[:, kept], pixel[kept])


def _operands(unit, case):
    return unit.parameters.compute_values(values_of(case.beats), case.beats["length"])


def _expect(unit, case):
    return operand_beats(unit, _operands(unit, case))


def _status(unit, case):
    return {"out_of_range": int(np.count_nonzero(_operands(unit, case).out_of_range))}


def _case(unit, rng, length):
    length = np.maximum(length % (1 << unit.length_bits), 1)
    return Case(value_beats(unit, any_values(rng, len(length), unit.lights), length))


def _spans(unit, rng, count):
    """Curves of every size, every eighth span of any words; most spans are short."""
    return _case(unit, rng, short_lengths(rng, count, 1))


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels, where the last bits of the differences count; shorter ones."""
    return _case(unit, rng, long_lengths(rng, count))


def _last_bits(unit, rng, count):
    """Many short spans: a bit that is rounded off decides a result once in thousands."""
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
            note="of N.L and 1 - N.H; exact: normalised interpolation, L and H of the pixel",
        ),
        "2 lights, interval 1": options(_METHOD, 2, setup_interval=1),
        "3 lights, interval 6": options(_METHOD, 3, setup_interval=6),
        "no highlights": options(_METHOD, 2, setup_interval=2, highlights=False, length_bits=5),
    },
    expect=_expect,
    status=_status,
    stimuli={
        "spans": Stimulus(_spans, 2000),
        "long spans": Stimulus(_long_spans, 60_000, stalled=False),
        "last bits": Stimulus(_last_bits, 8000, stalled=False),
        "corners": of_setup(SETUP),
    },
    waivers={
        "reciprocal": "The address stays for four cycles: what is read sooner is the same word.",
        "multiplier_0_b_1": "A reciprocal and its square are normalised: their first bit is 1 already.",
        "values": "It is for values of 2 or more, and N.L, -1 to 1 at the start, leaves that by 5/8 at most.",
    },
    still=SETUP.still
    | {
        "twice a number is even": (
            "*_0_second[0] *_second_difference[0] {top,local_chord_setup}.spare[83] "
            "{top,local_chord_setup}.spare[214] top.payload[83] top.payload[214]"
        ),
        "values have 9 bits less than starts, and those of u are less than 2": (
            "{top,local_chord_setup}.spare[0-8] {top,local_chord_setup}.spare[130-138] "
            "{top,local_chord_setup}.spare[166] top.payload[0-8] top.payload[130-138] top.payload[166]"
        ),
    },
    axis="pixel of the span",
    logarithmic=True,
)
