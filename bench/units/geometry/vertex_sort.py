"""Record of the vertex sort."""

from dataclasses import replace
from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.triangles import WHOLE, frame_of, random_triangles, small_frame
from blysk.golden.geometry.triangles import FrameSettings, Grid, Triangles
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.hdl.geometry.vertex_sort import VertexSortUnit

__all__ = ["RECORD"]


def _sorted(unit, case):
    return VertexSort(unit.grid, unit.tested).compute(Triangles(**case.beats), frame_of(case.constants))


def _flipped(unit, rng, count, back_faces="flip"):
    """Triangles of all kinds in a small picture. The normals of back faces are negated."""
    frame = small_frame(rng, back_faces)
    return Case(random_triangles(rng, count, unit.grid).beats, frame.codes)


def _culled(unit, rng, count):
    """Triangles of all kinds in a small picture. Back faces are dropped."""
    return _flipped(unit, rng, count, "cull")


def _shown(unit, rng, count):
    """Triangles of all kinds in a small picture. Back faces are not changed."""
    return _flipped(unit, rng, count, "show")


def _whole(unit, rng, count):
    """Triangles of all sizes in a picture of nearly all the grid."""
    return Case(random_triangles(rng, count, unit.grid, 500.0).beats, WHOLE.codes)


def _near(unit, rng, count):
    """Triangles with two corners at the same height, at most 7 steps of the grid apart.

    The lowest bits decide the order of the two corners.
    """
    triangles = random_triangles(rng, count, unit.grid, 500.0)
    rows, first = np.arange(count), rng.integers(0, 3, count)
    second = (first + rng.integers(1, 3, count)) % 3
    apart = rng.integers(-7, 8, count)
    inside = abs(triangles.x[rows, first]) < unit.grid.coordinate.max_code - 8
    triangles.x[rows, second] = np.where(inside, triangles.x[rows, first] + apart, triangles.x[rows, second])
    triangles.y[rows, second] = triangles.y[rows, first]
    return Case(triangles.beats, WHOLE.codes)


def _borders(unit, rng, count):
    """Pictures at any place. The bounding box of a triangle begins or ends near a border of the picture.

    Or it begins 2^k pixels from a border, or its height is about 2^k pixels.
    """
    grid, first = unit.grid, rng.integers(-2048, 2047, 2)
    end = np.minimum(first + 2 ** rng.integers(0, 11, 2), 2048)
    frame = FrameSettings(*(int(end) for end in (*first, *end)))

    def often(share, values):
        return np.where(rng.random((count, 2)) < share, values, 0)

    powers = 2 ** rng.integers(0, 12, (2, count, 2))
    low = first + often(0.5, end - first) + often(0.4, powers[0] * rng.choice([-1, 1], (count, 2)))
    high = low + often(0.7, powers[1]) + rng.integers(-1, 2, (count, 2))
    pixels = np.stack([low, high, rng.integers(np.minimum(low, high), np.maximum(low, high) + 1)], axis=1)
    pixels = rng.permuted(pixels, axis=1)
    # Any place after the centre of the previous pixel, up to the centre of the pixel itself.
    codes = pixels * grid.steps - grid.half + 1 + rng.integers(0, grid.steps, pixels.shape)
    codes = codes.clip(grid.coordinate.min_code, grid.coordinate.max_code)
    return Case(
        replace(random_triangles(rng, count, grid), x=codes[..., 0], y=codes[..., 1]).beats, frame.codes
    )


def _few(unit, rng, count):
    """Triangles with few pixel centres in their boxes. Many edges go through centres."""
    frame, step = FrameSettings(-12, -12, 12, 12), unit.grid.steps
    middle = rng.integers(-10, 11, (count, 1, 2)) * step
    grain = 2 ** rng.integers(0, unit.grid.subpixel_bits, (count, 1, 1))
    size = rng.integers(1, 5, (count, 1, 2))
    codes = middle + rng.integers(-size, size + 1, (count, 3, 2)) * step // 2
    codes += rng.integers(-step // 2, step // 2 + 1, codes.shape) // grain * grain
    triangles = random_triangles(rng, count, unit.grid)
    return Case(replace(triangles, x=codes[..., 0].copy(), y=codes[..., 1].copy()).beats, frame.codes)


RECORD = Record(
    name="vertex_sort",
    title="Corners of triangles from top to bottom, orientation, and dropped triangles",
    source="[T] figure 4.10",
    variants={
        "": Variant(VertexSortUnit, note="exact"),
        "4 fraction bits": Variant(partial(VertexSortUnit, Grid(4)), note="exact"),
    },
    expect=lambda unit, case: _sorted(unit, case)[0].beats,
    status=lambda unit, case: _sorted(unit, case)[1],
    stimuli={
        "flipped": Stimulus(_flipped, 1000),
        "culled": Stimulus(_culled, 1000),
        "shown": Stimulus(_shown, 1000),
        "whole": Stimulus(_whole, 1000),
        "near": Stimulus(_near, 1000),
        "few": Stimulus(_few, 1000),
        "borders": Stimulus(_borders, 300, repeats=8, stalled=False),
    },
    axis="",
    still={
        "the memory of triangles is never full; tests/hdl/geometry/test_vertex_sort.py fills it": "room[0]",
        "a counter has room for more events than a run has": "count_empty[8-31] "
        "count_culled[7-31] count_zero_area[6-31]",
    },
)
