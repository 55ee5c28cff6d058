"""Record of the difference setup."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import LONG, SPANS_45, any_curves, any_lengths, curves, log_lengths, pixel_of
from blysk.bench.units.record import Case, Record, Sample, Stimulus, Variant
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit

__all__ = ["RECORD"]


def _measure(rng, count, model):
    g, p, _ = curves(rng, count)
    length = log_lengths(rng, count, 2)
    first, second = model.compute(g, p, length)
    k = pixel_of(rng, length)[:, np.newaxis]
    t = k / (length - 1)[:, np.newaxis]
    exact = (g.values * t + p.values) * t
    return Sample(k * first.values + k * (k - 1) / 2 * second.values, exact, exact, k)


def _expect(unit, case):
    p, length = Fixed(GPQ.P_FORMAT, case.beats["p"]), case.beats["length"]
    g = Fixed(GPQ.G_FORMAT, case.beats.get("g", np.zeros_like(p.codes)))
    first, second = unit.model.compute(g, p, length)
    return {"start": case.beats["q"], "first": first.codes, "second": second.codes, "length": length}


def _case(unit, rng, length):
    """Curves of any coefficients with lengths. For a straight line there is no G."""
    beats = any_curves(rng, len(length)) | {"length": length}
    if unit.order == 1:
        del beats["g"]
    return Case(beats)


def _spans(unit, rng, count):
    """Coefficients of any size, and lengths with a uniform logarithm."""
    length = any_lengths(rng, count) % (1 << unit.length_bits)
    return _case(unit, rng, np.maximum(length, 1))


def _every_length(unit, rng, count):
    """Every length that fits, and short lengths again."""
    longest = 1 << unit.length_bits
    length = np.r_[np.arange(1, longest), rng.integers(1, min(longest, 40), count)]
    return _case(unit, rng, rng.permutation(length))


def _last_bits(unit, rng, count):
    """Many spans, because the last bits of products and reciprocals are usually shifted out."""
    return _case(unit, rng, np.floor(2 ** rng.uniform(0, LENGTH_BITS, count)).astype(np.int64))


def _variants():
    note = "of the curve at any pixel that the differences lead to"
    for name, model, interval in (
        ("", DifferenceSetup(), 7),
        ("interval 1", DifferenceSetup(), 1),
        ("as published", DifferenceSetup(as_published=True), 9),
    ):
        yield (
            name,
            Variant(
                partial(DifferenceSetupUnit, model, initiation_interval=interval),
                partial(_measure, model=model),
                f"{SPANS_45}, {LONG}",
                note=note,
                as_published=model.as_published,
            ),
        )
    for interval in (2, 3, 4, 5, 6):
        unit = partial(DifferenceSetupUnit, DifferenceSetup(), initiation_interval=interval)
        yield f"interval {interval}", Variant(unit, long=interval != 3)
    for interval in (1, 3):
        unit = partial(DifferenceSetupUnit, DifferenceSetup(as_published=True), initiation_interval=interval)
        yield f"as published, interval {interval}", Variant(unit, as_published=True, long=interval == 3)
    for interval in (1, 3, 4):
        unit = partial(DifferenceSetupUnit, DifferenceSetup(), initiation_interval=interval, order=1)
        yield f"straight line, interval {interval}", Variant(unit, long=interval != 3)
    unit = partial(DifferenceSetupUnit, DifferenceSetup(as_published=True), initiation_interval=2, order=1)
    yield "straight line, as published", Variant(unit, as_published=True, long=True)
    for bits, interval in ((2, 7), (3, 1), (7, 3), (10, 4)):
        options = {"initiation_interval": interval, "length_bits": bits}
        unit = partial(DifferenceSetupUnit, DifferenceSetup(), **options)
        yield f"{bits} bits of length", Variant(unit, long=bits in (2, 10))


_VARIANTS = dict(_variants())

RECORD = Record(
    name="difference_setup",
    title="First and second forward difference of a quadratic normal curve",
    source="docs/theory/interpolation.md#forward-differences; [T] figure 2.11",
    variants=_VARIANTS,
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 500),
        "every length": Stimulus(_every_length, 500, variants=tuple(_VARIANTS)),
        "last bits": Stimulus(_last_bits, 20_000, stalled=False),
    },
    axis="pixel of the span",
    logarithmic=True,
    waivers={
        "address": "The table and the shift read the address on the first of its seven cycles.",
        "places": "The upper half is read for the address, on the first of its seven cycles.",
        "positions": "The upper half is read for the address, on the first of its seven cycles.",
        "reciprocal": (
            "An address stays for seven cycles: what is read again while the output is stalled is the same "
            "word."
        ),
    },
    still={
        "twice a number is even": "top.spare[186] top.spare[230] top.spare[274] second_{0-2}[0]",
        "a reciprocal is normalised, and so is its square, so that the first bit is 1": (
            "reciprocals_word[16] reciprocals.port__data[16] square[16] square_rounded[16]"
        ),
        "the largest square in the table is under 1 by 62 steps": "square_rounded[17]",
        "a length of 12 bits takes shifts up to 12, and its square up to 25": "shift[4] square_shift[5]",
    },
)
