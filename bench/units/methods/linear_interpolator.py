"""Record of the linear interpolator."""

import numpy as np

from blysk.bench.units.methods.interpolator import STIMULI, case_of, expect, measured, options, status
from blysk.bench.units.operands import code_pairs_at, component_words
from blysk.bench.units.record import Record, Stimulus
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.number.unit_vector import ONE

__all__ = ["RECORD"]

_LINE = LinearInterpolator()


def _flags(unit, rng, count):
    """Spans out of range, then spans in range, then both kinds in random order."""
    left, right = code_pairs_at(rng, 8 * count, rng.uniform(0, 180, 8 * count))
    some = rng.random(8 * count) < 0.4
    left[some], right[some] = rng.choice([0, 1, -1, ONE // 2, ONE], (2, np.count_nonzero(some), 3))
    length = rng.integers(1, 12, 8 * count)
    _, flagged = _LINE.normals(*component_words(left, right), length)
    kinds = [np.flatnonzero(kind)[:count] for kind in (flagged, ~flagged)]
    order = np.concatenate([*kinds, rng.permutation(np.concatenate(kinds))])
    return case_of(unit, rng, left[order], right[order], length[order])


RECORD = Record(
    name="linear_interpolator",
    title="Normals on a straight line",
    source="docs/theory/interpolation.md#spans; [T] 2.1",
    variants={
        "linear": measured(_LINE),
        "linear, interval 1, of a chord": options(
            LinearInterpolator("one_minus_cosine"), 2, setup_interval=1, length_bits=9
        ),
        "linear, interval 7, no highlights": options(_LINE, setup_interval=7, highlights=False),
        "linear, interval 7, compact": options(_LINE, 2, setup_interval=7, product_interval=3),
    },
    expect=expect,
    status=status,
    stimuli=STIMULI | {"flags": Stimulus(_flags, 100, variants=("linear",))},
    waivers={
        "values": (
            "The bit decides whether a word saturates at -1. No component of a unit normal is less than -1."
        ),
    }
    | dict.fromkeys(
        ("spare", "payload", "*_second_difference"),
        "The second difference of a straight line is 0, so the bit is 0 already.",
    ),
)
