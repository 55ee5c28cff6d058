"""Record of the coarse depth test."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.golden.geometry.span_attributes import SPAN_DEPTH
from blysk.hdl.geometry.coarse_depth import CoarseDepthUnit

__all__ = ["RECORD"]


def _spans(unit, rng, count, longest=37, most=1 << 24, lines=None):
    """Overlapping spans of a small picture. A depth is less than ``most``, or is the largest depth."""
    model = unit.model
    longest = min(longest, model.width)
    length = rng.integers(1, longest + 1, count)
    # Every fourth span begins where the span before it ended, as with triangles side by side.
    x = rng.integers(0, model.width - length + 1)
    y = rng.integers(0, lines or model.height, count)
    x[1::4] = np.minimum(x[0::4] + length[0::4], model.width - length[1::4])[: len(x[1::4])]
    y[1::4] = y[0::4][: len(y[1::4])]
    # Later spans are farther in most cases.
    base = np.sort(rng.integers(0, most, count)) // 2
    left, right = (base[:, np.newaxis] + rng.integers(0, most // 3, (count, 2))).T.clip(0, most - 1) << 9
    left[::5], right[::7] = rng.choice([0, (1 << 33) - 1], len(left[::5])), 0
    step = (right - left) // np.maximum(length - 1, 1)
    step[length == 1] = rng.integers(-(1 << 33), 1 << 33, (length == 1).sum())
    picture = np.cumsum(rng.random(count) < 0.015) % 2
    return Case({"x": x, "y": y, "length": length, "depth": left, "depth_step": step, "picture": picture})


def _short(unit, rng, count):
    """Spans of one to six pixels in few blocks. Some words are read before their last write has happened."""
    return _spans(unit, rng, count, 6, lines=1)


def _outside(unit, rng, count):
    """Spans of a small picture. About every fourth span leaves the picture on the right or below."""
    case = _spans(unit, rng, count, 20, lines=2)
    beats, model = case.beats, unit.model
    far, low = rng.random((2, count)) < 0.15
    most = 1 << unit.x_bits
    beats["x"] = np.where(far, rng.integers(model.width - 3, most, count), beats["x"])
    beats["length"] = np.where(far, rng.integers(4, most, count), beats["length"])
    below = 1 << unit.y_bits
    if model.height < below:
        beats["y"] = np.where(low, rng.integers(model.height, below, count), beats["y"])
    return case


def _near(unit, rng, count):
    """Depths of 15 bits that differ in few of the compared upper bits."""
    return _spans(unit, rng, count, 12, 1 << 15, lines=1)


def _edges(unit, rng, count):
    """Three spans a picture. The last bit of a depth decides whether the third span is hidden.

    A bound has only the upper bits of a depth. So a step of the bound is many codes. The first span marks
    pixels of a block. The second span fills the block. It may go on to blocks where it is nearer. In the
    first block the deepest depths of both spans are near each other. Each is the first code of a step of the
    bound, or the code before it. The nearest depth of the third span is in the same block. It is the first
    code of the next step behind both spans, or the code before it.
    """
    model, groups = unit.model, -(-count // 3)
    shift, size, columns = SPAN_DEPTH.width - model.depth_bits, model.block, model.blocks_per_line
    block, falls = rng.integers(0, columns, groups), rng.random(groups) < 0.5
    first, end = block * size, np.minimum(block * size + size, model.width) - 1

    def line(edge, at, other, falls):
        """Any step of a depth that is ``edge`` at pixel ``at`` and in range at pixel ``other``."""
        room = np.where(falls == (at < other), edge, (1 << SPAN_DEPTH.width) - 1 - edge)
        step = (
            room // np.maximum(abs(at - other), 1) * rng.random(groups) * 2.0 ** rng.integers(-30, 1, groups)
        )
        return np.where(falls, -1, 1) * step.astype(np.int64)

    def span(begin, last, edge, falls, deepest):
        """The span from pixel ``begin`` to ``last``. Its deepest or nearest depth is ``edge``."""
        at, other = np.where(falls == deepest, (begin, last), (last, begin))
        step = line(edge, at, other, falls)
        return begin, last - begin + 1, edge - step * (at - begin), step

    def code(upper):
        """The first code of a step of the bound, or the code before it."""
        return (upper << shift) - rng.integers(0, 2, groups)

    # Some groups fill the block twice. The second time the depths are smaller.
    twice = rng.random(groups) < 0.125
    upper = np.where(twice, 1, rng.integers(2, (1 << model.depth_bits) - 3, groups))
    marked, filled = code(upper + np.where(twice, 2, rng.integers(-1, 2, groups))), code(upper)
    # Some groups leave out one pixel of the block. The block then gets no bound.
    gap, hole = ~twice & (rng.random(groups) < 0.25), rng.integers(first + 1, end)
    begin = np.where(twice | gap, first, rng.integers(first, end + 1))
    last = np.where(gap, hole - 1, np.where(twice, end, rng.integers(begin, end + 1)))
    marks = span(begin, last, marked, rng.random(groups) < 0.5, True)
    # A falling line may go on to the right, where it is nearer. A rising line may come from the left.
    limits = (
        np.where(gap, hole + 1, np.where(falls, first, size * rng.integers(0, block + 1))),
        np.where(falls & ~gap, np.minimum(size * rng.integers(block + 1, columns + 1), model.width) - 1, end),
    )
    fills = span(*limits, filled, falls, True)
    nearest = code((np.where(twice, filled, np.maximum(marked, filled)) >> shift) + 1)
    begin = rng.integers(np.where(falls, first, limits[0]), end + 1)
    last = rng.integers(np.maximum(begin, first), np.where(falls, limits[1], end) + 1)
    inside = (begin >= first) & (last <= end)
    covered = span(begin, last, nearest, np.where(inside, rng.random(groups) < 0.5, ~falls), False)
    names = ("x", "length", "depth", "depth_step")
    beats = {
        name: np.stack(values, axis=1).ravel()[:count]
        for name, *values in zip(names, marks, fills, covered, strict=True)
    }
    places = {"y": rng.integers(0, model.height, groups), "picture": np.arange(groups) % 2}
    return Case(beats | {name: np.repeat(values, 3)[:count] for name, values in places.items()})


RECORD = Record(
    name="coarse_depth",
    title="Spans that are hidden for their whole length",
    source="docs/theory/geometry.md#depth",
    variants={
        "": Variant(partial(CoarseDepthUnit, CoarseDepth(46, 5, tag_bits=3), 6, 3), note="exact"),
        "16 pixels": Variant(
            partial(CoarseDepthUnit, CoarseDepth(40, 3, 16, 24), 6, 2), note="exact", long=True
        ),
    },
    expect=lambda unit, case: unit.model.compute(**case.beats).astype(np.int64),
    stimuli={
        "spans": Stimulus(_spans, 600),
        "short": Stimulus(_short, 900),
        "near": Stimulus(_near, 600),
        "outside": Stimulus(_outside, 600),
        "edges": Stimulus(_edges, 2000),
    },
    axis="",
    waivers={"place": "The fault changes the order in which words are swept. Every word is still swept."},
    still={
        "`fresh` falls once after a reset, and `used` rises once": "fresh[0] used[0]",
        "only after a reset are all 30 words swept, else 5 words": "left[3-4]",
        "a scanline has six words, so the place of its first word is even": "span[12]",
    },
    remembers=True,
)
