"""Record of the difference setup."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import LONG, SPANS_45, any_curves, any_lengths, curves, log_lengths, pixel_of
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
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
    """Curves with any coefficients, for spans of given lengths. A straight line has no G."""
    beats = any_curves(rng, len(length)) | {"length": length}
    if unit.order == 1:
        del beats["g"]
    return Case(beats)


def _spans(unit, rng, count):
    """Coefficients of any size. The logarithm of span lengths is uniform."""
    length = any_lengths(rng, count) % (1 << unit.length_bits)
    return _case(unit, rng, np.maximum(length, 1))


def _every_length(unit, rng, count):
    """Every length that the unit takes, and further short lengths."""
    longest = 1 << unit.length_bits
    length = np.r_[np.arange(1, longest), rng.integers(1, min(longest, 40), count)]
    return _case(unit, rng, rng.permutation(length))


def _last_bits(unit, rng, count):
    """Many spans, because the last bits of products and reciprocals are usually shifted out."""
    return _case(unit, rng, np.floor(2 ** rng.uniform(0, LENGTH_BITS, count)).astype(np.int64))


def _variants():
    note = "error of the curve at any pixel, by the differences"
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
        "address": (
            "The register holds its word for seven cycles. Table and shift read it on the first cycle. The "
            "fault changes it later."
        ),
        "places": (
            "The register holds its word for seven cycles. Its upper half is read on the first cycle. The "
            "fault changes it later."
        ),
        "positions": (
            "The register holds its word for seven cycles. Its upper half is read on the first cycle. The "
            "fault changes it later."
        ),
        "reciprocal": (
            "The fault reads the table again while the output is stalled. An address stays for seven cycles, "
            "so the table gives the same word."
        ),
    },
    still={
        "a second difference is twice a number, so its last bit is 0": (
            "top.spare[186] top.spare[230] top.spare[274] second_{0-2}[0]"
        ),
        "a reciprocal and its square are normalised, so their first bits are 1": (
            "reciprocals_word[16] reciprocals.port__data[16] square[16] square_rounded[16]"
        ),
        "the largest square of a reciprocal is 62 steps less than 1": "square_rounded[17]",
        "for a length of 12 bits the shift is at most 12, and the square's shift at most 25": (
            "shift[4] square_shift[5]"
        ),
    },
)
