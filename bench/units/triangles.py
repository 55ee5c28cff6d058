"""Operands for units of geometry: triangles of all kinds, and the results of each unit."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from blysk.bench.units.record import PAUSED
from blysk.golden.geometry.attribute_serialiser import AttributeSerialiser
from blysk.golden.geometry.edge_setup import Edges, EdgeSetup
from blysk.golden.geometry.edge_walk import EdgeWalk, Rows
from blysk.golden.geometry.gradient_setup import Gradients, GradientSetup
from blysk.golden.geometry.plane_assembler import PlaneAssembler, Planes
from blysk.golden.geometry.plane_setup import PlaneScales, PlaneSetup
from blysk.golden.geometry.reciprocal import Reciprocal
from blysk.golden.geometry.span_attributes import Pieces, SpanAttributes
from blysk.golden.geometry.span_clip import ClippedRows, SpanClip
from blysk.golden.geometry.triangles import ATTRIBUTE, GRID, FrameSettings, Grid, Triangles
from blysk.golden.geometry.vertex_sort import SortedTriangles, VertexSort
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.scene import BACK_FACES

__all__ = [
    "WHOLE",
    "Stages",
    "corners",
    "edges_of",
    "ended",
    "frame_of",
    "plane_corners",
    "random_triangles",
    "scales_of",
    "scales_of_corners",
    "small_frame",
    "sorted_of",
    "triangles_with",
]

WHOLE = FrameSettings(-2048, -2048, 2047, 2047)
"""A picture of nearly all the grid."""


def frame_of(constants: Mapping) -> FrameSettings:
    """Frame settings from the constants of a run."""
    return FrameSettings(**dict(constants) | {"back_faces": BACK_FACES[constants["back_faces"]]})


def triangles_with(**members: np.ndarray) -> Triangles:
    """Triangles with the given members. The other members are 0."""
    count = len(next(iter(members.values())))
    shapes = {"x": (3,), "y": (3,), "depth": (3,), "normal": (3, 3), "material": (), "two_sided": ()}
    zeros = {name: np.zeros((count, *shape), dtype=np.int64) for name, shape in shapes.items()}
    return Triangles(**zeros | members)


def sorted_of(beats: Mapping) -> SortedTriangles:
    """Sorted triangles from beats. Members that the beats do not have are 0."""
    members = {name: beats[name] for name in ("x", "y", "material") if name in beats}
    # Beats with heights are beats of edges. Their x is not a corner's column.
    members = {name: value for name, value in members.items() if name != "x" or "height" not in beats}
    triangles = triangles_with(**members)
    words = {
        name: beats.get(name, np.zeros(len(triangles), dtype=np.int64)) for name in ("area", "right", "flip")
    }
    right, flip = (words[name].astype(bool) for name in ("right", "flip"))
    source, order = np.arange(len(triangles)), np.tile(np.arange(3), (len(triangles), 1))
    return SortedTriangles(triangles, words["area"], right, flip, source, order)


def edges_of(beats: Mapping) -> Edges:
    """Edges from beats. Members that the beats do not have are 0."""
    zeros = np.zeros(len(beats["first"]), dtype=np.int64)
    return Edges(**{field.name: beats.get(field.name, zeros) for field in fields(Edges)})


def plane_corners(stages: "Stages") -> dict[str, np.ndarray]:
    """Input beats of the plane setup, from the results of the units before it."""
    edges, y = stages.edges, stages.drawn.triangles.y
    heights = {"long_height": edges.height[:, 0], "knee": y[:, 1] - y[:, 0]}
    walk = {name: getattr(edges, name) for name in ("fraction", "down", "along")}
    return heights | walk | {"area": stages.drawn.area, "right": stages.drawn.right}


def scales_of_corners(beats: Mapping, grid: Grid) -> PlaneScales:
    """Scales from the beats of `plane_corners`."""
    knee, height = beats["knee"], beats["long_height"]
    y = np.stack([np.zeros_like(knee), knee, height], axis=1)
    drawn = sorted_of({"y": y, "area": beats["area"], "right": beats["right"]})
    edges = edges_of(
        {name: beats[name] for name in ("fraction", "down", "along")}
        | {"height": height[:, np.newaxis], "first": np.zeros_like(knee)}
    )
    return PlaneSetup(grid).compute(drawn, edges)


def scales_of(beats: Mapping) -> PlaneScales:
    """Scales from the beats of an attribute."""
    formats = {
        "height_reciprocal": Reciprocal.FORMAT,
        "knee": PlaneSetup.HEIGHT_FORMAT,
        "width_reciprocal": PlaneSetup.WIDTH_FORMAT,
    }
    words = {name: Fixed(format, beats[name]) for name, format in formats.items()}
    rest = {name: beats[name] for name in ("row_shift", "column_shift", "fraction", "down", "along")}
    right = beats["right"].astype(bool)
    return PlaneScales(**words, **rest, right=right, sliver=np.zeros(len(right), dtype=bool))


@dataclass(frozen=True)
class Stages:
    """Results of the models of all geometry units for some triangles. Each is computed when it is needed.

    Parameters
    ----------
    triangles : Triangles
        Input.
    frame : FrameSettings
        The picture.
    grid : Grid
        Fraction bits of the coordinates.
    """

    triangles: Triangles
    frame: FrameSettings
    grid: Grid = GRID

    @cached_property
    def drawn(self) -> SortedTriangles:
        """Result of `VertexSort`, with triangles that its test of centres would drop."""
        return VertexSort(self.grid, 0).compute(self.triangles, self.frame)[0]

    @cached_property
    def edges(self) -> Edges:
        """Result of `EdgeSetup`."""
        return EdgeSetup(self.grid).compute(self.drawn)

    @cached_property
    def rows(self) -> Rows:
        """Result of `EdgeWalk`."""
        return EdgeWalk().compute(self.edges, self.drawn, self.frame)

    @cached_property
    def clipped(self) -> ClippedRows:
        """Result of `SpanClip`."""
        return SpanClip().compute(self.rows, self.frame)

    @cached_property
    def scales(self) -> PlaneScales:
        """Result of `PlaneSetup`."""
        return PlaneSetup(self.grid).compute(self.drawn, self.edges)

    @cached_property
    def least(self) -> np.ndarray:
        """Result of `AttributeSerialiser`."""
        return AttributeSerialiser().least(self.drawn.triangles)

    @cached_property
    def gradients(self) -> Gradients:
        """Result of `GradientSetup`, for all attributes."""
        values = self.drawn.triangles.attributes
        return GradientSetup().compute(*(Fixed(ATTRIBUTE, values[:, k]) for k in range(3)), self.scales)

    @cached_property
    def planes(self) -> Planes:
        """Result of `PlaneAssembler`."""
        return PlaneAssembler().compute(self.gradients, self.least, self.frame)

    @cached_property
    def pieces(self) -> Pieces:
        """Result of `SpanAttributes`."""
        return SpanAttributes().compute(self.clipped, self.planes)[0]


def corners(rng: np.random.Generator, count: int, grid: Grid = GRID, size: float = 12.0) -> np.ndarray:
    """Corners of all kinds, shape (count, 3, 2), around the middle of the grid.

    Parameters
    ----------
    rng : Generator
        Generator of the random numbers.
    count : int
        Number of triangles.
    grid : Grid
        Fraction bits of the coordinates.
    size : float
        Largest distance of most corners from the triangle's middle, along x and y, in pixels.
    """
    step, reach = grid.steps, int(size * grid.steps)
    middle = rng.integers(-20 * step, 20 * step, (count, 1, 2))
    points = middle + rng.integers(-reach, reach + 1, (count, 3, 2))
    kind = rng.integers(0, 12, count)
    # Corners on pixel centres and on borders of pixels.
    half = kind == 1
    points[half] = points[half] // grid.half * grid.half
    # Needles: the third corner is next to the line through the other two.
    thin = kind == 2
    share = rng.integers(0, 9, (count, 1))
    points[thin, 2] = (
        points[:, 0] + (points[:, 1] - points[:, 0]) * share // 8 + rng.integers(-1, 2, (count, 2))
    )[thin]
    # Triangles with a horizontal edge, with a vertical edge, and with two corners at the same point.
    points[kind == 3, 1, 1] = points[kind == 3, 0, 1]
    points[kind == 4, 2, 0] = points[kind == 4, 0, 0]
    points[kind == 5, 2] = points[kind == 5, 1]
    # Tiny triangles, triangles as large as the guard band, and triangles with corners at its ends.
    tiny = kind == 6
    points[tiny] = (middle + rng.integers(-step, step + 1, (count, 3, 2)))[tiny]
    low, high = grid.coordinate.min_code, grid.coordinate.max_code
    huge = (kind == 7) & (rng.random(count) < 0.2)
    points[huge] = rng.integers(low, high + 1, (int(huge.sum()), 3, 2))
    ends = (kind == 8) & (rng.random(count) < 0.2)
    points[ends] = rng.choice([low, high, 0, grid.half], (int(ends.sum()), 3, 2))
    return points


def random_triangles(
    rng: np.random.Generator, count: int, grid: Grid = GRID, size: float = 12.0, spread: float = 1.0
) -> Triangles:
    """Triangles of all kinds with normals and depths.

    Parameters
    ----------
    rng, count, grid, size
        As in `corners`.
    spread : float
        Standard deviation of the normals' components about a common normal.
    """
    points = corners(rng, count, grid, size)
    common = rng.normal(size=(count, 1, 3))
    normal = common / np.linalg.norm(common, axis=2, keepdims=True) + spread * rng.normal(size=(count, 3, 3))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    normal *= 2.0 ** -np.abs(rng.normal(size=(count, 3, 1)))
    ends = rng.random(count) < 0.05
    normal[ends] = rng.choice([-1.0, 0.0, 1.0], (int(ends.sum()), 3, 3))
    most = 2**23 - 1
    depth = rng.integers(0, 1 << 24, (count, 3))
    depth[::7] = rng.choice([0, (1 << 24) - 1], depth[::7].shape)
    return Triangles(
        x=points[..., 0],
        y=points[..., 1],
        depth=depth,
        normal=np.clip(np.rint(normal * 2**23), -most, most).astype(np.int64),
        material=rng.integers(0, 1024, count),
        two_sided=rng.random(count) < 0.5,
    )


def ended(triangles: Triangles, grid: Grid = GRID) -> Triangles:
    """Change two triangles to cover a small picture, so that a run ends with their pixels.

    The first is the last triangle of the run with pauses. It is in front of most triangles. The second is
    the last triangle. It is in front of all triangles. Returns the triangles.
    """
    far = 100 * grid.steps
    for index, depth in ((PAUSED - 1, 1 << 21), (-1, 0)):
        triangles.x[index], triangles.y[index] = (-far, -far, 3 * far), (-far, 3 * far, -far)
        triangles.depth[index], triangles.normal[index] = depth, 1 << 22
    return triangles


def small_frame(rng: np.random.Generator, back_faces: str = "flip", limit: int = 267) -> FrameSettings:
    """A picture of 1 to 47 columns and scanlines around pixel (0, 0)."""
    left, top = rng.integers(-24, 0, 2)
    right, bottom = rng.integers(1, 24, 2)
    return FrameSettings(int(left), int(top), int(right), int(bottom), back_faces, limit)
