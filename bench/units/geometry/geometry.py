"""Record of geometry, triangles to spans."""

from dataclasses import replace
from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant, once
from blysk.bench.units.triangles import ended, frame_of, random_triangles, small_frame
from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.build import Build
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.triangles import FrameSettings, Grid, Triangles
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.sim.frames.triangles import with_surface

__all__ = ["RECORD"]


@once
def _spans(unit, case):
    return unit.model.compute(Triangles(**case.beats), frame_of(case.constants))


def _ended(unit, rng, triangles):
    return with_surface(ended(triangles, unit.grid), unit.model.surface, rng)


def _random(unit, rng, count, size, spread):
    return _ended(unit, rng, random_triangles(rng, count, unit.grid, size, spread))


def _small(unit, rng, count):
    """Triangles of all kinds in a small picture. Some cross the borders of the picture, on every side."""
    return Case(_random(unit, rng, count, 6.0, 0.3).beats, small_frame(rng).codes)


def _tiny(unit, rng, count):
    """Triangles of about one pixel. Back faces are dropped."""
    frame = FrameSettings(-20, -20, 20, 20, "cull", 200)
    return Case(_random(unit, rng, count, 1.0, 0.1).beats, frame.codes)


def _mesh(unit, rng, count):
    """Fine meshes with shared corners and edges, slivers and folds. Some corners are on pixel centres."""
    side, step = 8, unit.grid.steps
    layers = -(-count // (2 * side * side))
    pitch = rng.integers(step // 8, 2 * step, (layers, 1, 1, 1))
    nodes = np.stack(np.meshgrid(*2 * [np.arange(side + 1)]), axis=-1) * pitch
    nodes = nodes + rng.integers(-20 * step, 20 * step, (layers, 1, 1, 2))
    # The nodes of a mesh move by up to half a cell, by up to a cell, or not at all. In a third of the meshes
    # all nodes are on centres and borders of pixels.
    jitter = rng.integers(-step, step + 1, nodes.shape) * rng.integers(0, 3, (layers, 1, 1, 1))
    nodes += jitter * pitch // (2 * step)
    nodes[::3] = nodes[::3] // unit.grid.half * unit.grid.half
    a, b, c, d = nodes[:, :-1, :-1], nodes[:, :-1, 1:], nodes[:, 1:, :-1], nodes[:, 1:, 1:]
    points = np.stack([np.stack([a, b, c], axis=3), np.stack([d, c, b], axis=3)], axis=3)
    points = points.reshape(-1, 3, 2)[:count]
    triangles = replace(
        random_triangles(rng, count, unit.grid, 1.0, 0.1), x=points[..., 0].copy(), y=points[..., 1].copy()
    )
    return Case(_ended(unit, rng, triangles).beats, FrameSettings(-24, -24, 24, 24, "flip", 200).codes)


def _drawn(unit, rng, count):
    """Small triangles. Few are dropped, so triangles come faster than the setup takes them."""
    frame = FrameSettings(-60, -60, 60, 60, "flip", 200)
    return Case(_random(unit, rng, count, 3.0, 0.1).beats, frame.codes)


def _dense(unit, rng, count):
    """Triangles of one pixel. None is dropped, so the setup alone decides the rate."""
    frame = FrameSettings(-60, -60, 60, 60, "flip", 200)
    triangles = random_triangles(rng, count, unit.grid, 1.0, 0.1)
    # Each triangle is half of a square with sides of 5/4 pixels. It has the square's only pixel centre.
    step = unit.grid.steps
    for place, far in ((triangles.x, [0, 1, 0]), (triangles.y, [0, 0, 1])):
        place[:] = rng.integers(-40, 40, (count, 1)) * step + np.array(far) * 5 * step // 4
    return Case(with_surface(triangles, unit.model.surface, rng).beats, frame.codes)


def _large(unit, rng, count):
    """Triangles as large as the picture, with spans in several pieces."""
    frame = FrameSettings(-100, -80, 100, 80, "flip", 60)
    return Case(_random(unit, rng, count, 80.0, 0.05).beats, frame.codes)


def _largest(unit, rng, count):
    """Triangles larger than the largest picture, flat triangles, and triangles with two long edges."""
    triangles = random_triangles(rng, count, unit.grid, 1900.0, 0.05)
    triangles.normal[::2] = triangles.normal[::2, :1]
    low, high = unit.grid.coordinate.min_code, unit.grid.coordinate.max_code
    inwards = rng.integers(0, 100, (len(triangles.y[1::4]), 3)) * [1, 1, -1]
    triangles.y[1::4] = np.array([low, low + 99, high]) + inwards
    return Case(_ended(unit, rng, triangles).beats, small_frame(rng).codes)


def _unit(model=None, **build):
    return partial(GeometryUnit, model, Build(top="geometry", **build))


_BOTH = AttributeSpans(coordinates=True)

RECORD = Record(
    name="geometry",
    title="Triangles to spans with unit normals and depth",
    source="[T] figure 4.10",
    variants={
        "": Variant(GeometryUnit),
        "compact": Variant(_unit(style="compact"), long=True),
        "compact, two lanes": Variant(_unit(style="compact", setups=2), long=True),
        "compact, true lines": Variant(_unit(Geometry(lines=True), style="compact"), long=True),
        "compact, vectors": Variant(_unit(Geometry(vectors=True), style="compact"), long=True),
        "true lines": Variant(_unit(Geometry(lines=True)), long=True),
        "vectors": Variant(_unit(Geometry(vectors=True)), long=True),
        "two lanes": Variant(_unit(setups=2), long=True),
        "vectors, four lanes": Variant(_unit(Geometry(vectors=True), setups=4), long=True),
        "vectors, colours, textures": Variant(_unit(Geometry(vectors=True, surface=_BOTH)), long=True),
        "compact, vectors, colours, textures": Variant(
            _unit(Geometry(vectors=True, surface=_BOTH), style="compact"), long=True
        ),
        "4 fraction bits": Variant(_unit(Geometry(Grid(4))), long=True),
    },
    expect=lambda unit, case: _spans(unit, case)[0].beats,
    status=lambda unit, case: _spans(unit, case)[1],
    stimuli={
        "small": Stimulus(_small, 300),
        "tiny": Stimulus(_tiny, 300),
        "mesh": Stimulus(_mesh, 300),
        "drawn": Stimulus(_drawn, 2000, stalled=False),
        "dense": Stimulus(_dense, 1600, pace=lambda unit: unit.interval),
        "large": Stimulus(_large, 40),
        "largest": Stimulus(_largest, 60),
    },
    axis="",
    still={
        "fewer triangles wait than a block RAM has words": (
            "waiting_walks_level[3-6] waiting_attributes_level[5-6] "
            "waiting_walks_room[0] waiting_attributes_room[0]"
        ),
        "a counter has room for more than a run has": "slivers[4-31] emptys[9-31] pieces_inside[5-9]",
    },
)
