"""Record of the edge walk."""

from functools import partial

from blysk.bench.units.record import Case, Record, Stimulus, Variant, first
from blysk.bench.units.triangles import Stages, edges_of, frame_of, random_triangles, small_frame, sorted_of
from blysk.golden.geometry.edge_walk import EdgeWalk
from blysk.golden.geometry.triangles import FrameSettings, Grid
from blysk.hdl.geometry.edge_walk import EdgeWalkUnit, walk_shape

__all__ = ["RECORD"]


def _expect(unit, case):
    beats = case.beats
    return EdgeWalk().compute(edges_of(beats), sorted_of(beats), frame_of(case.constants)).beats


def _walked(unit, rng, count, frame, size=12.0):
    stages = Stages(random_triangles(rng, 4 * count, unit.grid, size), frame, unit.grid)
    beats = stages.drawn.beats | stages.edges.beats
    return Case(first({name: beats[name] for name in walk_shape(unit.grid).members}, count), frame.codes)


def _small(unit, rng, count):
    """Triangles of all kinds in a small picture. Some have scanlines above it, or go on below it."""
    return _walked(unit, rng, count, small_frame(rng))


def _tall(unit, rng, count):
    """A picture as high as the grid, and triangles of all sizes."""
    return _walked(unit, rng, count, FrameSettings(-2048, -2048, 2047, 2047), 60.0)


def _below(unit, rng, count):
    """A picture that begins below most triangles' first corners."""
    return _walked(unit, rng, count, FrameSettings(-2048, 8, 2047, 2047))


def _flat(unit, rng, count):
    """Triangles up to the height of the grid. They are flat on top, or nearly flat.

    So the upper short edge has few scanlines or none.
    """
    triangles, grid = random_triangles(rng, count, unit.grid, 500.0), unit.grid
    ends = grid.coordinate.min_code, grid.coordinate.max_code
    triangles.x[:] = rng.integers(ends[0], ends[1], triangles.x.shape)
    triangles.y[:, :2] = ends[0] + rng.integers(0, 4 * grid.steps, (count, 1))
    triangles.y[::2, 1] += rng.integers(0, 4 * grid.steps, len(triangles.y[::2]))
    triangles.y[:, 2] = ends[1] - rng.integers(0, 1 << rng.integers(1, grid.bits - 1), count)
    stages = Stages(triangles, FrameSettings(-2048, -2048, 2047, -2036), grid)
    beats = stages.drawn.beats | stages.edges.beats
    beats = {name: beats[name] for name in walk_shape(grid).members}
    return Case(beats, FrameSettings(-2048, -2048, 2047, -2036).codes)


RECORD = Record(
    name="edge_walk",
    title="First and last covered pixel of each scanline of a triangle",
    source="[T] figure 4.10",
    variants={
        "": Variant(EdgeWalkUnit, note="exact"),
        "4 fraction bits": Variant(partial(EdgeWalkUnit, Grid(4)), note="exact"),
    },
    expect=_expect,
    stimuli={
        "small": Stimulus(_small, 300),
        "tall": Stimulus(_tall, 300, pace=lambda unit: 1),
        "below": Stimulus(_below, 300),
        "flat": Stimulus(_flat, 120),
    },
    axis="",
)
