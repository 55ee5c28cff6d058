"""Record of the depth test."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.geometry.depth_tester import DepthTester
from blysk.golden.number.spans import pixels_of
from blysk.hdl.geometry.depth_tester import DepthTesterUnit

__all__ = ["RECORD"]


def _drawn(beats):
    pixel, test = beats["pixel"], DepthTester()
    first = np.r_[True, pixel["last"][:-1]]
    length = np.diff(np.r_[np.flatnonzero(first), len(first)])
    depth = test.depths(length, beats["depth"][first], beats["depth_step"][first])
    drawn = test.drawn(pixel["y"] * 4096 + pixel["x"], depth)
    return {name: pixel[name][drawn] for name in "xyrgb"} | {"depth": depth[drawn]}, len(drawn)


def _status(unit, case):
    drawn, count = _drawn(case.beats)
    return {"pixels": count, "hidden": count - len(drawn["depth"])}


def _case(rng, count, size, longest, most):
    """Spans with depths from 0 to ``most`` at both ends."""
    width, height = size
    length = rng.integers(1, longest + 1, count)
    span, k = pixels_of(length)
    span, k = span[:count], k[:count]
    left, right = (rng.integers(0, most + 1, (2, count)) << 9) + rng.integers(0, 1 << 9, (2, count))
    left[::5], right[::7] = rng.choice([0, (1 << 33) - 1], len(left[::5])), 0
    step = (right - left) // np.maximum(length - 1, 1)
    begin, line = rng.integers(0, width - length + 1), rng.integers(0, height, count)
    pixel = {
        "x": begin[span] + k,
        "y": line[span],
        "last": k == length[span] - 1,
        **{channel: rng.integers(0, 256, count) for channel in "rgb"},
    }
    pixel["last"][-1] = True
    return Case({"pixel": pixel, "depth": left[span], "depth_step": step[span]})


def _few(unit, rng, count):
    """Spans of one to eight pixels, many over the same places of a small picture, some of equal depths."""
    return _case(rng, count, unit.size, min(8, unit.size[0]), 1000)


def _same(unit, rng, count):
    """Spans of one or two pixels in a corner, at places that were written a few cycles before."""
    return _case(rng, count, (2, 1), 2, (1 << 24) - 1)


def _far(unit, rng, count):
    """Depths near `DepthTester.FARTHEST` and near the depth to which a picture is cleared."""
    case = _case(rng, count, unit.size, 3, 3)
    case.beats["depth"] = (1 << 33) - 1 - case.beats["depth"]
    case.beats["depth_step"] = -case.beats["depth_step"]
    return case


def _again(unit, rng, count):
    """Groups of three pixels, in any order, at two places whose coordinates differ in one bit.

    The depths of two of the three pixels differ in one bit.
    """
    count = -(-count // 3)
    bits = (unit.x_bits, unit.y_bits)
    first = rng.integers(0, 1 << sum(bits), count)
    other = first ^ 1 << rng.integers(0, sum(bits), count)
    place = np.stack([first, other, np.where(rng.random(count) < 0.7, first, other)], axis=1).ravel()
    depth = rng.integers(0, 1 << 24, (count, 3))
    depth[:, 2] = depth[:, 0] ^ 1 << rng.integers(0, 24, count)
    order = rng.permuted(np.arange(3 * count).reshape(count, 3), axis=1).ravel()
    place, depth = place[order], depth.ravel()[order]
    nothing = np.zeros(3 * count, dtype=np.int64)
    pixel = {"x": place % (1 << bits[0]), "y": place >> bits[0], "last": nothing == 0}
    pixel |= {channel: rng.integers(0, 256, 3 * count) for channel in "rgb"}
    return Case({"pixel": pixel, "depth": depth << 9, "depth_step": nothing})


def _nearer(unit, rng, count):
    """Each span is in front of the spans before it. Its first depth is within 8/512 of a step of a code."""
    case = _case(rng, count, unit.size, min(8, unit.size[0]), 0)
    last = case.beats["pixel"]["last"]
    span = np.cumsum(last) - last
    whole = np.sort(rng.integers(1, (1 << 24) - 1, span[-1] + 1))[::-1]
    depth = (whole << 9) + rng.integers(-8, 8, len(whole))
    case.beats.update(depth=depth[span], depth_step=rng.integers(-2, 3, len(whole))[span])
    return case


RECORD = Record(
    name="depth_tester",
    title="Depth of each pixel of a span, and whether it is in front",
    source="docs/theory/geometry.md#depth",
    variants={"": Variant(partial(DepthTesterUnit, 4, 3, (16, 8)), note="exact")},
    expect=lambda unit, case: _drawn(case.beats)[0],
    status=_status,
    stimuli={
        "few": Stimulus(_few, 2000),
        "same": Stimulus(_same, 500),
        "far": Stimulus(_far, 300),
        # The number is odd. After an even number, a bit that each event inverts has its first value again.
        "again": Stimulus(_again, 901),
        "nearer": Stimulus(_nearer, 2001),
    },
    axis="",
    still={
        "coordinates of 4 and 3 bits never leave the memory of 16 x 8 pixels": "read_outside[0]",
        "the depth of a pixel is known a stage later, so pixel_0 has none": "pixel_0[31-54]",
        "a counter has room for more events than a run has": "count_{pixels,hidden}[10-31]",
    },
    remembers=True,
)
