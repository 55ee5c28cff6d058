"""Record of the forward-difference accumulator."""

import numpy as np

from blysk.bench.units.operands import SPANS_45, any_codes, curves, log_lengths, pixel_of, short_lengths
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit

__all__ = ["RECORD", "spans_of"]


def _measure(rng, count):
    g, p, q = curves(rng, count)
    length = log_lengths(rng, count)
    first, second = DifferenceSetup().compute(g, p, length)
    pixel = pixel_of(rng, length)
    found = DifferenceAccumulator().compute(q, first, second, np.arange(count), pixel)
    k = pixel[:, np.newaxis]
    exact = q.values + k * first.values + k * (k - 1) / 2 * second.values
    return Sample(found.values, exact, exact, k)


def _expect(unit, case):
    model, beats = unit.model, case.beats
    formats = model.start_format, model.difference_format, model.difference_format
    names = "start", "first", "second"
    words = (Fixed(format, beats[name]) for name, format in zip(names, formats, strict=True))
    return model.compute(*words, *pixels_of(beats["length"])).codes


def spans_of(unit, rng, length):
    """Spans of given lengths, with values of any size. Some second pixels are at a border of rounding."""
    model = unit.model
    start = any_codes(rng, model.start_format, len(length), 3)
    first, second = (any_codes(rng, model.difference_format, len(length), 3) for _ in range(2))
    half = 1 << (model.format.fraction_bits - COMPONENT.fraction_bits - 1)
    shape = first[1::17].shape
    first[1::17], second[1::17] = half * rng.choice([-1, 1], shape) + rng.integers(-1, 2, shape), 0
    return Case({"start": start, "first": first, "second": second, "length": length})


def _spans(unit, rng, count):
    """Starts and differences of any size. Most spans are short, a few are long, and some have no pixel."""
    return spans_of(unit, rng, short_lengths(rng, count))


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels, where the last bits of the differences change the normals."""
    return spans_of(unit, rng, rng.integers(3000, 4096, count // 3500))


RECORD = Record(
    name="difference_accumulator",
    title="Normals of a span by forward differences",
    source="docs/theory/interpolation.md#forward-differences; [T] figure 2.10",
    variants={
        "": Variant(DifferenceAccumulatorUnit, _measure, f"{SPANS_45}, 1 to 4095 pixels", beat={"length": 64})
    },
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 2000),
        "long spans": Stimulus(_long_spans, 140_000, stalled=False),
    },
    axis="pixel of the span",
    logarithmic=True,
)
