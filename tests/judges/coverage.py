"""Coverage of triangles by models and RTL, and triangles of all kinds."""

from functools import lru_cache

import numpy as np

from blysk.golden.build import Build
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.triangles import ATTRIBUTE, FrameSettings, Grid, Triangles
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.scene import Scene
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.sim.engines.simulate import simulate

SIDE = 16
"""Pixels of a cell. A cell holds one random triangle."""


def as_triangles(corners, size):
    """Triangles of the geometry with level normals, and the frame of a picture."""
    shape, frame = corners.shape[:2], FrameSettings.centred(*size)
    x, y = (corners[..., axis] + 256 * low for axis, low in enumerate((frame.left, frame.top)))
    zeros, words = np.zeros(shape, dtype=np.int64), np.zeros((*shape, 3), dtype=np.int64)
    words[..., 2] = ATTRIBUTE.max_code
    return Triangles(x, y, zeros, words, zeros[:, 0], zeros[:, 0]), frame


def painted(x, y, length, weights, size):
    """Sums of the weights of the spans at each pixel, for each of some weights."""
    found = np.zeros((len(weights), size[1], size[0] + 1), dtype=np.int64)
    for of, weight in zip(found, weights, strict=True):
        np.add.at(of, (y, x), weight)
        np.add.at(of, (y, x + length), -weight)
    return found.cumsum(axis=2)[..., :-1]


def by_geometry(corners, tags, size):
    """Number of triangles at each pixel, and the sum of their tags, by the models of the geometry RTL."""
    triangles, frame = as_triangles(corners, size)
    drawn, rows, triangle, _ = Geometry(Grid()).rows(triangles, frame)
    kept = np.flatnonzero(rows.length)
    own = drawn.source[triangle[kept]]
    weights = np.ones_like(own), tags[own]
    return painted(rows.x[kept], rows.y[kept], rows.length[kept], weights, size)


@lru_cache(maxsize=1)
def _geometry():
    return GeometryUnit(None, Build(top="geometry"))


def by_rtl(corners, tags, size):
    """Number of triangles at each pixel, by the simulated RTL of the geometry."""
    triangles, frame = as_triangles(corners, size)
    run = simulate(_geometry(), triangles.beats, count=None, constants=frame.codes, engine="auto")
    x, y, length = (run.beats[name].astype(np.int64) for name in ("x", "y", "length"))
    return painted(x, y, length, [1], size)


def by_rasteriser(corners, tags, size):
    """The same by the golden rasteriser, for triangles that do not overlap."""
    width, height = size
    points = np.zeros((3 * len(corners), 3))
    points[:, :2] = corners.reshape(-1, 2) / 256 * (1, -1) + (-width / 2, height / 2)
    mesh = Mesh(points, np.arange(len(points)).reshape(-1, 3), np.tile([0.0, 0, 1], (len(points), 1)))
    grey = (0.5,) * 3
    camera = Camera((0, 0, 4096), (0, 0, 0), height=height)
    scene = Scene(mesh, camera, width, height, Material(grey, grey, grey, 1), (Light((0, 0, 1)),))
    raster = rasterise(scene)
    found = np.zeros((2, height * width), dtype=np.int64)
    np.add.at(found[0], raster.pixel, 1)
    np.add.at(found[1], raster.pixel, tags[raster.triangle[raster.span]])
    return found.reshape(2, height, width)


def in_cells(rng, across):
    """Triangles of all kinds, one in each of ``across``^2 cells, in steps from the upper left."""
    count, most = across**2, 256 * SIDE
    points = rng.integers(0, most + 1, (count, 3, 2))
    kind = rng.integers(0, 10, count)
    # Corners on centres and borders of pixels, level edges, upright edges, slivers, tiny triangles.
    points[kind == 1] = points[kind == 1] // 128 * 128
    points[kind == 2, 1, 1] = points[kind == 2, 0, 1]
    points[kind == 3, 1, 0] = points[kind == 3, 0, 0]
    share = rng.integers(0, 9, (count, 1))
    near = points[:, 0] + (points[:, 1] - points[:, 0]) * share // 8 + rng.integers(-2, 3, (count, 2))
    points[kind == 4, 2] = near[kind == 4]
    tiny = points[:, :1] + rng.integers(-300, 301, (count, 3, 2))
    points[kind == 5] = tiny[kind == 5]
    points = np.clip(points, 0, most)
    cell = np.stack(np.meshgrid(*[np.arange(across)] * 2), axis=-1).reshape(-1, 1, 2)
    return points + most * cell, np.arange(1, count + 1)


def tags_of(rng, count):
    """Random tags. Their sums tell which triangles cover a pixel, unless two errors cancel."""
    return rng.integers(1, 2**12, count)
