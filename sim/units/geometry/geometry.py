"""Record of geometry, triangles to spans."""

from functools import partial

import numpy as np

from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.triangles import Frame, Grid, Triangles
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.sim.units.record import Case, Record, Stimulus, Variant
from blysk.sim.units.triangles import ended, frame_of, random_triangles, small_frame

__all__ = ["RECORD"]


def _spans(unit, case):
    return Geometry(unit.grid, unit.lines).compute(Triangles(**case.beats), frame_of(case.constants))


def _small(unit, rng, count):
    """Triangles of all kinds in a small picture, that is cut at every side."""
    return Case(
        ended(random_triangles(rng, count, unit.grid, 6.0, 0.3), unit.grid).beats, small_frame(rng).codes
    )


def _tiny(unit, rng, count):
    """Triangles of a pixel or so, back faces left out."""
    frame = Frame(-20, -20, 20, 20, "cull", 200)
    return Case(ended(random_triangles(rng, count, unit.grid, 1.0, 0.1), unit.grid).beats, frame.codes)


def _large(unit, rng, count):
    """Triangles of a picture's size, with spans in pieces."""
    frame = Frame(-100, -80, 100, 80, "flip", 60)
    return Case(ended(random_triangles(rng, count, unit.grid, 80.0, 0.05), unit.grid).beats, frame.codes)


def _largest(unit, rng, count):
    """Triangles larger than a picture can be, flat ones, and ones with two long edges."""
    triangles = random_triangles(rng, count, unit.grid, 1900.0, 0.05)
    triangles.normal[::2] = triangles.normal[::2, :1]
    low, high = unit.grid.coordinate.min_code, unit.grid.coordinate.max_code
    inwards = rng.integers(0, 100, (len(triangles.y[1::4]), 3)) * [1, 1, -1]
    triangles.y[1::4] = np.array([low, low + 99, high]) + inwards
    return Case(ended(triangles, unit.grid).beats, small_frame(rng).codes)


RECORD = Record(
    name="geometry",
    title="Triangles to spans with unit normals and depth",
    source="[T] figure 4.10",
    variants={
        "": Variant(GeometryUnit),
        "compact": Variant(partial(GeometryUnit, compact=True), long=True),
        "compact, two lanes": Variant(partial(GeometryUnit, compact=True, setups=2), long=True),
        "compact, true lines": Variant(partial(GeometryUnit, compact=True, lines=True), long=True),
        "true lines": Variant(partial(GeometryUnit, lines=True), long=True),
        "two lanes": Variant(partial(GeometryUnit, setups=2), long=True),
        "4 fraction bits": Variant(partial(GeometryUnit, Grid(4)), long=True),
    },
    expect=lambda unit, case: _spans(unit, case)[0].beats,
    status=lambda unit, case: _spans(unit, case)[1],
    stimuli={
        "small": Stimulus(_small, 300),
        "tiny": Stimulus(_tiny, 300),
        "large": Stimulus(_large, 40),
        "largest": Stimulus(_largest, 60),
    },
    axis="",
    still={
        "a counter counts more than a run has": "slivers[2-31] taken[8-9] walked[7-9] pieces_inside[5-9]",
        "an upper edge has fewer than 4096 scanlines": "waiting_walks.storage.r_port__data[283]",
    },
)
