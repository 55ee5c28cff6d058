"""Record of the edge setup."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant, first
from blysk.bench.units.triangles import WHOLE, Stages, random_triangles, sorted_of
from blysk.golden.geometry.edge_setup import EdgeSetup
from blysk.golden.geometry.triangles import Grid
from blysk.hdl.geometry.edge_setup import EdgeSetupUnit

__all__ = ["RECORD"]

_NAMES = ("x", "y", "area", "right", "flip", "material")


def _expect(unit, case):
    drawn = sorted_of(case.beats)
    edges = EdgeSetup(unit.grid).compute(drawn)
    y = drawn.triangles.y
    tag = {name: case.beats[name] for name in ("area", "right", "flip", "material")}
    return edges.beats | tag | {"knee": y[:, 1] - y[:, 0], "long_height": edges.height[:, 0]}


def _triangles(unit, rng, count, size=12.0):
    """Sorted triangles of all kinds."""
    beats = Stages(random_triangles(rng, 3 * count, unit.grid, size), WHOLE, unit.grid).drawn.beats
    return Case(first({name: beats[name] for name in _NAMES}, count))


def _large(unit, rng, count):
    """Sorted triangles of any size. Some have corners at the ends of the grid."""
    case = _triangles(unit, rng, count, 1500.0)
    low, high = unit.grid.coordinate.min_code, unit.grid.coordinate.max_code
    case.beats["x"][::7] = rng.choice([low, high, 0], case.beats["x"][::7].shape)
    case.beats["y"][::7] = np.sort(rng.choice([low, high, 0, 1], case.beats["y"][::7].shape), axis=1)
    return case


def _variants():
    for name, *options in (
        ("3 dividers of 2 bits", Grid(), 3, 2),
        ("1 divider of 1 bit", Grid(), 1, 1),
        ("1 divider of 2 bits", Grid(), 1, 2),
        ("3 dividers of 1 bit", Grid(), 3, 1),
        ("4 fraction bits", Grid(4), 3, 2),
        ("4 fraction bits, 1 divider", Grid(4), 1, 1),
    ):
        # The compact style has one divider of two bits, without a skid buffer.
        skid = options[1:] != [1, 2]
        unit = partial(EdgeSetupUnit, *options, skid=skid)
        yield name, Variant(unit, note="exact", long=options[1] + options[2] == 3)


RECORD = Record(
    name="edge_setup",
    title="Start and step of each edge of a triangle, as quotient and remainder",
    source="[T] figure 4.10",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={"triangles": Stimulus(_triangles, 800), "large": Stimulus(_large, 800)},
    axis="",
)
