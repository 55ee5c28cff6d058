"""Record of the depth test of several lanes."""

from functools import partial, wraps

import numpy as np

from blysk.bench.units.geometry import depth_tester
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.cosines.quotient_lanes import pixels_of_beats
from blysk.hdl.geometry.depth_lanes import DepthLanesUnit

__all__ = ["RECORD", "in_lanes"]


def in_lanes(case: Case, lanes: int) -> Case:
    """Beats of several lanes, from pixels of spans as `DepthTesterUnit` takes them."""
    pixel = case.beats["pixel"]
    ends = np.flatnonzero(pixel["last"])
    length = np.diff(np.r_[-1, ends])
    index, present, span = pixels_of_beats(length, lanes)
    colors = np.zeros(present.shape, [(name, np.uint8) for name in "rgb"])
    for name in "rgb":
        colors[name] = np.where(present, pixel[name][index], 0)
    beat = {name: pixel[name][index[:, 0]] for name in "xy"}
    beat |= {
        "present": (present << np.arange(lanes)).sum(axis=1),
        "colors": colors,
        "last": np.r_[span[1:] != span[:-1], True],
    }
    return Case({"pixel": beat} | {name: case.beats[name][index[:, 0]] for name in ("depth", "depth_step")})


def _drawn(unit, beats):
    """Drawn beats, and the numbers of tested pixels and of drawn pixels."""
    model, pixel, lane = unit.model, beats["pixel"], np.arange(unit.lanes)
    present = (pixel["present"][:, np.newaxis] >> lane & 1) == 1
    first = np.r_[True, pixel["last"][:-1]]
    span = np.cumsum(first) - 1
    length = np.bincount(span, present.sum(axis=1)).astype(np.int64)
    depth = model.depths(length, beats["depth"][first], beats["depth_step"][first])
    x = (pixel["x"][:, np.newaxis] + lane)[present]
    y = np.repeat(pixel["y"], present.sum(axis=1))
    drawn = model.drawn(y * 4096 + x, depth)
    mask, depths = present.copy(), np.zeros(present.shape, dtype=np.int64)
    mask[present], depths[present] = drawn, depth * drawn
    kept, colors = mask.any(axis=1), pixel["colors"].copy()
    colors[~mask] = 0
    made = {
        "x": pixel["x"],
        "y": pixel["y"],
        "present": (mask << lane).sum(axis=1),
        "colors": colors,
        "depths": depths,
    }
    return {name: codes[kept] for name, codes in made.items()}, len(drawn), int(drawn.sum())


def _status(unit, case):
    _, pixels, drawn = _drawn(unit, case.beats)
    return {"pixels": pixels, "hidden": pixels - drawn}


def _stimulus(name, count):
    """A stimulus of `DepthTesterUnit`, in beats."""
    single = depth_tester.RECORD.stimuli[name].make

    @wraps(single)
    def make(unit, rng, count):
        return in_lanes(single(unit, rng, count), unit.lanes)

    return Stimulus(make, count)


RECORD = Record(
    name="depth_lanes",
    title="Depth of each pixel of a beat, and whether it is in front",
    source="docs/theory/geometry.md#depth-lanes",
    variants={
        "": Variant(partial(DepthLanesUnit, 4, 3, (16, 8)), note="exact"),
        "odd width": Variant(partial(DepthLanesUnit, 4, 3, (13, 5)), long=True),
        "4 lanes": Variant(partial(DepthLanesUnit, 4, 3, (15, 8), lanes=4), long=True),
    },
    expect=lambda unit, case: _drawn(unit, case.beats)[0],
    status=_status,
    stimuli={
        "few": _stimulus("few", 3000),
        "same": _stimulus("same", 500),
        "far": _stimulus("far", 500),
        "again": _stimulus("again", 901),
        "nearer": _stimulus("nearer", 3001),
    },
    axis="",
    still={
        "coordinates of 3 and 3 bits never leave a bank of 8 x 8 pixels": "read_outside[0]",
        "a counter has room for more events than a run has": "count_{pixels,hidden}[11-31]",
    },
    remembers=True,
)
