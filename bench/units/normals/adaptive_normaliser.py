"""Record of the adaptive normaliser."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import (
    AXIS,
    any_pairs,
    code_pairs_at,
    component_words,
    degrees_between,
    pairs_chosen,
    short_lengths,
    span_ends,
    span_lengths,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED
from blysk.golden.reference.curves import interpolate
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit

__all__ = ["RECORD", "spans_of", "straight_lines"]


def straight_lines(left: np.ndarray, right: np.ndarray, levels: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Straight lines between ``2^levels + 1`` points of a great circle, in float64.

    Parameters
    ----------
    left, right : array, shape (pixels, 3)
        Ends of each pixel's span.
    levels, t : array, shape (pixels,)
        Number of levels of the pixel's span, and position of the pixel in the span, 0 to 1.
    """
    parts = 2.0**levels
    segment = np.minimum(np.floor(t * parts), parts - 1)
    before, after = (interpolate("slerp", left, right, (segment + k) / parts) for k in (0, 1))
    # `interpolate` gives every point the length of the left end. So the last point is set to the right end.
    after = np.where((segment + 1 == parts)[:, np.newaxis], right, after)
    return before + (t * parts - segment)[:, np.newaxis] * (after - before)


def _measure(rng, count, model):
    length = span_lengths(rng, count)
    left, right = span_ends(rng, len(length), model.bisection.max_angle)
    found, out_of_range, levels = model.compute(*component_words(left, right), length)
    span, pixel = pixels_of(length)
    t = pixel / np.maximum(length - 1, 1)[span]
    a, b = left[span] / ONE, right[span] / ONE
    lines = straight_lines(a, b, levels[span], t)
    exact = np.where((t == 1)[:, np.newaxis], b, interpolate("slerp", a, b, t))
    kept = ~out_of_range[span]
    scale = ONE * COMPONENT.step
    angle = degrees_between(left, right)[span[kept]]
    return Sample(found.values[kept], exact[kept] * scale, lines[kept] * scale, angle)


def _expect(unit, case):
    words = component_words(case.beats["normal_left"], case.beats["normal_right"])
    length = case.beats["length"]
    normal, out_of_range, _ = unit.model.compute(*words, length)
    span, pixel = pixels_of(length)
    last = pixel == length[span] - 1
    return {"normal": normal.codes, "out_of_range": out_of_range[span], "last": last}


def spans_of(ends, length):
    """Input of spans. ``ends`` are the arrays of the left and of the right normals."""
    left, right = ends
    return Case({"normal_left": left, "normal_right": right, "length": length})


def _spans(unit, rng, count):
    """Short spans at angles of every size, and between arbitrary codes. Some spans have no pixel."""
    length = short_lengths(rng, count)
    return spans_of(any_pairs(rng, len(length)), length)


def _corners(unit, rng, count):
    """Spans of every number of levels, with angles of 0, 45, 90 and 180 degrees among them.

    Some spans have 0 or 4095 pixels, or a number of pixels next to a power of two.
    """
    length = np.r_[1, 2, 3, 16, 0, 1, 1, 2, 2, 5, 17, 33, 64, 65, 100, 0, 0, 129, rng.integers(0, 80, count)]
    angles = rng.uniform(0, 95, len(length))
    angles[::5] = 10.0 ** rng.uniform(-4, 1, len(angles[::5]))
    angles[20:24] = [0, 45, 90, 180]
    length, angles = np.r_[length, 4095], np.r_[angles, 44]
    return spans_of(code_pairs_at(rng, len(length), angles), length)


def _last_bits(unit, rng, count):
    """Many spans, some of them long.

    Further spans have five pixels. Their u, ``1 - N_l·N_r``, is at the border of its rounding.
    """
    few = count // 100
    length = np.r_[rng.integers(1, 70, count), rng.integers(1000, 4096, few)]
    angles = rng.uniform(0, 95, len(length))
    angles[::2] = 10.0 ** rng.uniform(-4, 1, len(angles[::2]))
    ends = code_pairs_at(rng, len(length), angles)
    # The third of five pixels gets the middle normal, whose factor depends on u.
    border = pairs_chosen(
        *code_pairs_at(rng, 1500, 90),
        lambda u: (u < ONE_SQUARED.codes) & (abs(u % (1 << 17) - (1 << 16)) < 4),
    )
    left, right = (np.vstack(both) for both in zip(ends, border, strict=True))
    return spans_of((left, right), np.r_[length, np.full(len(border[0]), 5)])


def _variants():
    for exponent, published in ((10, False), (6, False), (14, False), (10, True)):
        model = AdaptiveNormaliser(2.0**-exponent, Bisection(as_published=published))
        yield (
            f"threshold 2^-{exponent}" + ", as published" * published,
            Variant(
                partial(AdaptiveNormaliserUnit, model),
                partial(_measure, model=model),
                "spans to 90 degrees, 1 to 4095 pixels",
                beat={"normal_left": AXIS, "normal_right": AXIS, "length": 64},
                note="model error: of straight lines; the bisection's fit counts as arithmetic error; "
                "latency: for equal normals",
                as_published=published,
                long=exponent == 6,
            ),
        )
    for exponent, model in ((14, Bisection(1, 45)), (3, Bisection())):
        unit = partial(AdaptiveNormaliserUnit, AdaptiveNormaliser(2.0**-exponent, model))
        yield f"threshold 2^-{exponent}, {model.degree}, {model.max_angle}", Variant(unit)


_VARIANTS = dict(_variants())

RECORD = Record(
    name="adaptive_normaliser",
    title="Normals of a span by bisection and straight lines",
    source="docs/theory/interpolation.md#adaptive-normaliser; [T] 2.1, figure 2.7",
    variants=_VARIANTS,
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 1000),
        "corners": Stimulus(_corners, 150, variants=tuple(_VARIANTS)),
        "last bits": Stimulus(_last_bits, 2000, stalled=False),
    },
    waivers={
        "fsm_state": (
            "The fault needs a controlling bit of 1. In the first state all bits of the state are 0. In the "
            "next state the controlling bit is 0, too."
        ),
        "write_index": "A middle is at most 16 of 32 segments from its ends, so the bit for 32 is 0 already.",
        "inner_level": (
            "The controlling bit is the borrow when the level of the FIFO falls. The level falls only from 1 "
            "or more, so the borrow is 0."
        ),
        "angle": "The bit is 1 only if u is 1 or more. From 45 degrees on the unit reads the cosine, not u.",
    },
    still={
        "ends that are bisected are at least two of 32 segments apart, so the index is even": "top.index[0]",
        "a middle is at most 16 of 32 segments from its ends, and its index is less than 32": (
            "half[5] write_index[5]"
        ),
        "at most 16 spans are in the unit": "ready_spans[5-6]",
        "a reciprocal is normalised and not negative, so its first bits are 01": (
            "reciprocal[16-17] reciprocals.table_port__data[16]"
        ),
        "the steps of a segment's pixels are at most `available`, which has 14 bits": "advance[14-23]",
        "a segment of 4096 steps is always divided": "top.count[12]",
        "a fraction is not negative": "phi[17]",
    },
)
