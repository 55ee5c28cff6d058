"""Record of the coarse depth test."""

from functools import partial

import numpy as np

from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.hdl.geometry.coarse_depth import CoarseDepthUnit
from blysk.sim.units.record import Case, Record, Stimulus, Variant

__all__ = ["RECORD"]


def _spans(unit, rng, count, longest=37, most=1 << 24, lines=None):
    """Spans of a small picture, one over the other, with depths from 0 to ``most`` at both ends."""
    given = unit.parameters
    longest = min(longest, given.width)
    length = rng.integers(1, longest + 1, count)
    # Every fourth span goes on where the one before ended, as triangles side by side do.
    x = rng.integers(0, given.width - length + 1)
    y = rng.integers(0, lines or given.height, count)
    x[1::4] = np.minimum(x[0::4] + length[0::4], given.width - length[1::4])[: len(x[1::4])]
    y[1::4] = y[0::4][: len(y[1::4])]
    # The later ones are farther, more often than not.
    base = np.sort(rng.integers(0, most, count)) // 2
    left, right = (base[:, np.newaxis] + rng.integers(0, most // 3, (count, 2))).T.clip(0, most - 1) << 9
    left[::5], right[::7] = rng.choice([0, (1 << 33) - 1], len(left[::5])), 0
    step = (right - left) // np.maximum(length - 1, 1)
    step[length == 1] = rng.integers(-(1 << 33), 1 << 33, (length == 1).sum())
    picture = np.cumsum(rng.random(count) < 0.015) % 2
    return Case({"x": x, "y": y, "length": length, "depth": left, "depth_step": step, "picture": picture})


def _short(unit, rng, count):
    """Spans of one to six pixels in few blocks: words that are on their way to the memory."""
    return _spans(unit, rng, count, 6, lines=1)


def _near(unit, rng, count):
    """Depths of which the upper bits are few."""
    return _spans(unit, rng, count, 12, 1 << 15, lines=1)


RECORD = Record(
    name="coarse_depth",
    title="Spans that are hidden for their whole length",
    source="docs/theory/geometry.md#depth",
    variants={
        "": Variant(partial(CoarseDepthUnit, CoarseDepth(37, 5, tag_bits=2), 6, 3), note="exact"),
        "16 pixels": Variant(
            partial(CoarseDepthUnit, CoarseDepth(40, 3, 16, 24), 6, 2), note="exact", long=True
        ),
    },
    expect=lambda unit, case: unit.parameters.compute(**case.beats).astype(np.int64),
    stimuli={
        "spans": Stimulus(_spans, 600),
        "short": Stimulus(_short, 900),
        "near": Stimulus(_near, 600),
    },
    axis="",
    still={
        "what a reset finds is swept": "fresh[0] used[0]",
        "only after a reset all words are swept": "left[4]",
    },
    remembers=True,
)
