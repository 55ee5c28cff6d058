"""Record of the span halver."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes, sphere
from blysk.bench.units.record import Case, Record, Stimulus, Variant, once
from blysk.golden.geometry.span_attributes import SPAN_STEP, WholeSpans
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.triangles import ATTRIBUTES
from blysk.golden.number.fixed import Fixed
from blysk.hdl.geometry.span_halver import SpanHalverUnit

__all__ = ["RECORD"]

_WORDS = "near", "far", "inward"


@once
def _pieces(unit, case):
    words = dict(case.beats)
    words |= {name: Fixed(SPAN_STEP, words[name]) for name in _WORDS}
    words |= {name: words[name].astype(bool) for name in ("right", "flip")}
    return unit.model.compute(WholeSpans(**words, triangle=np.zeros(len(words["x"]), dtype=np.int64)))


def _expect(unit, case):
    pieces, _ = _pieces(unit, case)
    start, shift = pieces.left.codes, SpanHalver().shift(pieces.left, pieces.right)
    beats = {
        name: value for name, value in pieces.beats.items() if name not in ("left", "right", "depth_last")
    }
    return beats | {"start": start, "shift": shift}


def _case(rng, length, **attributes):
    count = len(length)
    beats = attributes | {
        "length": length,
        "x": rng.integers(0, 4096 - length),
        "y": rng.integers(0, 4096, count),
    }
    flags = {name: rng.integers(0, 2, count) for name in ("right", "flip")}
    return Case(beats | flags | {"material": rng.integers(0, 1024, count)})


def _lines(rng, length, near, far):
    """Spans with given N/W and random depths at both ends."""
    ends = [np.c_[end, rng.uniform(-1, 1, len(length))] for end in (near, far)]
    step = (ends[1] - ends[0]) / np.maximum(length - 1, 1)[:, np.newaxis]
    start, inward = (Fixed.round(SPAN_STEP, word).codes for word in (ends[0], step))
    far = SPAN_STEP.wrap(start + (length - 1)[:, np.newaxis] * inward)
    return _case(rng, length, near=start, far=far, inward=inward)


def _spans(unit, rng, count):
    """Spans of 1 to 4095 pixels. N/W has any length and direction at both ends. Most spans are cut."""
    near, far = (sphere(rng, count) * 2.0 ** -rng.uniform(0, 9, (count, 1)) for _ in range(2))
    alike = rng.random((count, 1)) < 0.5
    far = np.where(alike, near * 2.0 ** rng.uniform(-1, 1, (count, 1)) + 0.2 * far, far)
    far /= np.maximum(np.abs(far).max(axis=1, keepdims=True), 1)
    return _lines(rng, 4095 >> rng.integers(0, 12, count), near, far)


def _short(unit, rng, count):
    """Spans of one to six pixels. Most are not cut, so a span comes on nearly every cycle."""
    near = sphere(rng, count) * 2.0 ** -rng.uniform(0, 9, (count, 1))
    return _lines(
        rng, rng.integers(1, 7, count), near, near + near[:, ::-1] * rng.uniform(-0.5, 0.5, (count, 1))
    )


def _any(unit, rng, count):
    """Attributes of any codes. Sums wrap modulo 4, and words saturate."""
    words = {name: any_codes(rng, SPAN_STEP, count, ATTRIBUTES) for name in _WORDS}
    return _case(rng, rng.integers(1, 20, count), **words)


def _sizes(unit, rng, count):
    """Components k 2^j with k from 1/4 to 7/4, or a code next to them. They decide each bit of the test."""
    length = rng.integers(1, 12, count)
    ends = []
    for _ in range(2):
        place = rng.integers(20, 33, (count, 1)) - rng.integers(0, 4, (count, ATTRIBUTES))
        code = (rng.integers(1, 8, place.shape) << place >> 2) - rng.integers(0, 2, place.shape)
        ends.append(np.where(rng.random(place.shape) < 0.3, ~code, code))
    inward = (ends[1] - ends[0]) // np.maximum(length - 1, 1)[:, np.newaxis]
    near, far, inward = (SPAN_STEP.wrap(word) for word in (*ends, inward))
    return _case(rng, length, near=near, far=far, inward=inward)


def _steep(unit, rng, count):
    """Spans of two pixels, at four scales of N/W.

    From one end to the other a component changes by 0.4 to 0.7 of the vector's length.
    """
    near = sphere(rng, count)
    apart = rng.uniform(-0.1, 0.1, (count, 3))
    apart[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-1, 1], count) * rng.uniform(
        0.4, 0.7, count
    )
    far = np.clip(near + apart, -1, 1)
    scale = 2.0 ** -rng.integers(0, 4, (count, 1))
    return _lines(rng, np.full(count, 2), near * scale, far * scale)


RECORD = Record(
    name="span_halver",
    title="Spans cut where N/W grows too short along them",
    source="docs/theory/geometry.md#normals",
    variants={
        "": Variant(SpanHalverUnit, note="means of the ends are exact"),
        "several lights": Variant(
            partial(SpanHalverUnit, SpanHalver(rotates=True)), note="means of the ends are exact", long=True
        ),
    },
    expect=_expect,
    status=lambda unit, case: {"cut": _pieces(unit, case)[1]},
    stimuli={
        "spans": Stimulus(_spans, 200),
        "short": Stimulus(_short, 1000),
        "steep": Stimulus(_steep, 1000, variants=("several lights",)),
        "any": Stimulus(_any, 300),
        "sizes": Stimulus(_sizes, 1500),
    },
    axis="",
    still={
        "a counter has room for more than a run has": "count_cut[10-31]",
    },
)
