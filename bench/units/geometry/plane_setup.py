"""Record of the plane setup."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant, first
from blysk.bench.units.sample import Sample
from blysk.bench.units.triangles import WHOLE, Stages, plane_corners, random_triangles, scales_of_corners
from blysk.golden.geometry.triangles import GRID, Grid
from blysk.hdl.geometry.plane_setup import PlaneSetupUnit

__all__ = ["RECORD"]


def _case(rng, count, grid, size=12.0):
    stages = Stages(random_triangles(rng, 4 * count, grid, size), WHOLE, grid)
    return Case(first(plane_corners(stages), count))


def _triangles(unit, rng, count):
    """Triangles of all kinds, slivers among them."""
    return _case(rng, count, unit.grid)


def _large(unit, rng, count):
    """Triangles of any size. Half of the heights and areas are a power of two, or a power of two less 1."""
    case = _case(rng, count, unit.grid, 1500.0)
    bits = rng.integers(0, 2 * unit.grid.bits, count)
    area, height = 1 << bits, 1 << (bits // 2)
    ends = np.arange(count) % 4 == 0
    case.beats["area"][ends], case.beats["long_height"][ends] = area[ends], height[ends]
    less = np.arange(count) % 4 == 1
    case.beats["area"][less] = np.maximum(2 * area[less] - 1, 1)
    case.beats["long_height"][less] = np.maximum(2 * height[less] - 1, 1)
    case.beats["knee"] = np.minimum(case.beats["knee"], case.beats["long_height"])
    return case


def _measure(rng, count):
    beats = _case(rng, count, GRID).beats
    scales = scales_of_corners(beats, GRID)
    kept = ~scales.sliver
    width = beats["area"] / beats["long_height"] / GRID.steps
    # The word has five bits of the shift. The shift is 8 minus the exponent of 1/W, at least -3.
    shift = (scales.column_shift + 3) % 32 - 3
    found = scales.width_reciprocal.values * 2.0 ** (8.0 - shift) * width
    return Sample(found[kept], np.ones(kept.sum()), None, np.log2(width[kept]))


RECORD = Record(
    name="plane_setup",
    title="Reciprocals of a triangle's height and width",
    source="docs/theory/geometry.md#normals",
    variants={
        "": Variant(
            PlaneSetupUnit,
            _measure,
            "triangles over 1/256 pixel wide",
            note="relative error of 1/W, with the width W",
        ),
        "interval 67": Variant(partial(PlaneSetupUnit, GRID, 67, skid=False)),
        "4 fraction bits": Variant(partial(PlaneSetupUnit, Grid(4)), long=True),
    },
    expect=lambda unit, case: scales_of_corners(case.beats, unit.grid).beats,
    stimuli={"triangles": Stimulus(_triangles, 800), "large": Stimulus(_large, 800)},
    axis="width of the triangle, log2 of pixels",
    still={
        "a word is shifted until its first bit is 1": "{height,area}_moved_kept[39]",
        "a height has 20 bits above 20 zeros, and is shifted by fewer than 32 places": (
            "height_moved_kept[0-19] height_moved_kept[45]"
        ),
        "a reciprocal is at least 1/2, so its first bit in the table is 1": (
            "table_0_row[27] {height,area}_reciprocal_row[27] reciprocals.port__data[27]"
        ),
        "the second factor of a product is never negative": "multiplier_0_{b,1}[17]",
        "a ratio is less than 2, so its first bit is 0": "ratio_cut[29]",
    },
)
