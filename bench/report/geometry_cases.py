"""Stiff and extreme cases of geometry: scenes, and the errors of their pixels."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from blysk.golden.frames.triangle_frame import TriangleFrame, triangle_frame
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.fragments import fragment_barycentrics, fragment_normals
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer

__all__ = ["TERMINATOR", "cases_of", "frame_figures", "measure_cases"]

TERMINATOR = 0.002
"""Largest ``|N.L|`` at which lit and dark are both right."""

_COLORS = (0.05,) * 3, (0.4,) * 3, (0.55,) * 3
_LIGHT = normalise((0.3, 0.5, 0.8))
_UP = (0.0, 0.0, 1.0)


def frame_figures(scene: Scene, renderer: Renderer, frame: TriangleFrame) -> dict[str, Any]:
    """Differences of a frame from exact normals at every pixel in float64, with the same reflection model.

    Returns
    -------
    dict
        Numbers of pixels:

        - ``pixels``: a frame shows a triangle there;
        - ``coverage``: only one of the two frames shows a triangle there;
        - ``other``: the frames show different triangles there;
        - ``terminator``: a light has an ``|N.L|`` of at most `TERMINATOR`;
        - ``zero``: opposite normals add up to 0, so every normal is right.

        ``error`` is the largest error of the remaining pixels in LSB. It is ``None`` if no pixels remain.
    """
    raster = rasterise(scene)
    which = np.flatnonzero(raster.visible)
    owner = np.full(scene.height * scene.width, -1, dtype=np.int64)
    owner[raster.pixel[which]] = raster.triangle[raster.span[which]]
    found = frame.owner.reshape(-1)
    normals = fragment_normals(scene, raster, which)
    cosines = normals @ np.array([light.direction for light in scene.lights]).T
    corners = scene.mesh.normals[scene.mesh.faces[raster.triangle[raster.span[which]]]]
    sums = np.einsum("fc,fcn->fn", fragment_barycentrics(raster, which), corners)
    dim, zero = (np.zeros(owner.shape, dtype=bool) for _ in range(2))
    dim[raster.pixel[which]] = (np.abs(cosines) <= TERMINATOR).any(axis=1)
    zero[raster.pixel[which]] = np.linalg.norm(sums, axis=1) < 1e-6
    same = (owner == found) & (owner >= 0)
    model = renderer.design.specular.reflection
    exact = render(scene, "phong", model, raster).image.reshape(-1, 3) * 255
    error = np.abs(frame.image.reshape(-1, 3) - exact).max(axis=1)[same & ~dim & ~zero]
    return {
        "pixels": int(((owner >= 0) | (found >= 0)).sum()),
        "coverage": int(((owner >= 0) != (found >= 0)).sum()),
        "other": int(((owner != found) & (owner >= 0) & (found >= 0)).sum()),
        "terminator": int((same & dim).sum()),
        "zero": int((same & zero).sum()),
        "error": float(error.max()) if len(error) else None,
    }


def measure_cases(method: str, quick: bool) -> list[dict[str, Any]]:
    """Every case by the bit-accurate models of geometry, shading and depth test.

    Parameters
    ----------
    method : str
        Method of shading, with the model `blinn`.
    quick : bool
        Whether the case of a million triangles has only a hundredth of this number.

    Returns
    -------
    list of dict
        For each case its ``name``, the number of ``triangles``, the figures of `frame_figures`, and the
        hardware's counters.
    """
    figures = []
    for name, scene in cases_of(quick):
        design = preset(method, "blinn", x_bits=12, y_bits=12)
        renderer = Renderer(design)
        frame = triangle_frame(scene, renderer)
        figures.append(
            {
                "name": name,
                "triangles": len(scene.mesh.faces),
                **frame_figures(scene, renderer, frame),
                **{counter: int(count) for counter, count in frame.counts.items()},
            }
        )
    return figures


def cases_of(quick: bool) -> Iterator[tuple[str, Scene]]:
    """Names and scenes. A unit of the world is a pixel, and (0, 0) is in the middle of the picture."""
    rng = np.random.default_rng(23)
    for parts in (256, 32, 2):
        yield f"slivers of 1/{parts} pixel", _slivers(rng, 1 / parts)
    yield "triangles between neighbouring points of the grid", _smallest(rng)
    yield "one triangle over the whole guard band", _scene(4095, 9, *_largest(np.full((3, 3), _UP)))
    yield "4095 columns, normals 60 degrees apart, exponent 1000", _scene(4095, 9, *_largest(_fan(60)), 1000)
    yield "crossing surfaces, depths at both ends of the range", _crossing()
    yield "two triangles in the same place", _tied()
    for degrees in (90, 150, 179, 180):
        yield f"normals {degrees} degrees apart", _scene(200, 160, *_corner(_fan(degrees)))
    opposite = np.array([(0.3, 0.2, 1), (0.3, 0.2, 1), (-0.3, -0.2, -1)])
    yield "a normal and its opposite", _scene(200, 160, *_corner(opposite))
    yield "corners with the same normal, W 1 to 1000", _deep()
    side = 100 if quick else 1000
    yield f"{side * side // 2 * 2:,} triangles of half a pixel to a pixel", _grid(side)


def _scene(
    width: int, height: int, vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray, exponent: int = 50
) -> Scene:
    camera = Camera((0, 0, 1000), (0, 0, 0), height=height)
    mesh = Mesh(np.asarray(vertices, dtype=np.float64), np.asarray(faces), normalise(np.asarray(normals)))
    return Scene(mesh, camera, width, height, Material(*_COLORS, exponent), [Light(tuple(_LIGHT))])


def _fan(degrees: float) -> np.ndarray:
    """Normals of three corners.

    Two normals are turned by half of the angle, to the left and to the right. The third normal is upright.
    """
    half = np.radians(degrees) / 2
    return np.array([(-np.sin(half), 0, np.cos(half)), (np.sin(half), 0, np.cos(half)), (0, 0.1, 1)])


def _corner(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.array([(-90, -70, 0), (90, -70, 0), (5, 75, 0)]), normals, np.array([(0, 1, 2)])


def _largest(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.array([(-2047, -4, 0), (2047, -4, 0), (-2047, 2040, 0)]), normals, np.array([(0, 1, 2)])


def _facing(rng: np.random.Generator, count: int) -> np.ndarray:
    """Normals of corners, shape (count, 3), within 30 degrees of the viewer."""
    return normalise(rng.normal(scale=0.2, size=(count, 3)) + _UP)


def _slivers(rng: np.random.Generator, width: float) -> Scene:
    """Long triangles of a given width in all directions. The corners of each are anticlockwise."""
    angle, count = rng.uniform(0, 2 * np.pi, 400), 400
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    start = rng.uniform(-60, 60, (count, 2))
    points = np.stack([start, start + 40 * along, start + 20 * along + width * across], axis=1)
    depth = np.broadcast_to(rng.uniform(0, 9, (count, 1, 1)), (count, 3, 1))
    vertices = np.concatenate([points, depth], axis=2).reshape(-1, 3)
    return _scene(256, 256, vertices, _facing(rng, 3 * count), np.arange(3 * count).reshape(-1, 3))


def _smallest(rng: np.random.Generator) -> Scene:
    """Triangles with corners on neighbouring points of the grid, at the centre of a pixel."""
    count, step = 400, 1 / 256
    centre = rng.permuted(np.stack(np.meshgrid(*2 * [np.arange(-30, 30)]), axis=-1).reshape(-1, 2))[:count]
    # The pixel's centre is the corner between the left and the top edge.
    points = (centre + 0.5)[:, np.newaxis] + np.array([(0, 0), (0, -1), (1, 0)]) * step
    vertices = np.concatenate([points, np.zeros((count, 3, 1))], axis=2).reshape(-1, 3)
    return _scene(64, 64, vertices, _facing(rng, 3 * count), np.arange(3 * count).reshape(-1, 3))


def _crossing() -> Scene:
    """Two planes that cross. A near point and a far point set the range of depths."""
    low, high = -900.0, 900.0
    plate = [(-90, -70, low), (90, -70, high), (90, 70, high), (-90, 70, low)]
    other = [(x, y, low + high - z) for x, y, z in plate]
    normals = np.concatenate([np.tile([(-0.3, 0, 1.0)], (4, 1)), np.tile([(0.3, 0, 1.0)], (4, 1))])
    return _scene(200, 160, plate + other, normals, [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)])


def _tied() -> Scene:
    """The same triangle twice, with normals to the left and to the right. The first stays visible."""
    vertices, _, _ = _corner(_fan(0))
    normals = np.concatenate([np.tile([(-0.5, 0, 1.0)], (3, 1)), np.tile([(0.5, 0, 1.0)], (3, 1))])
    return _scene(200, 160, np.concatenate([vertices, vertices]), normals, [(0, 1, 2), (3, 4, 5)])


def _deep() -> Scene:
    """A triangle in perspective that reaches from near the viewer to far away."""
    vertices = np.array([(-0.5, -0.4, 0), (0.5, -0.4, 0), (0, 600, -999)])
    mesh = Mesh(vertices, np.array([(0, 1, 2)]), normalise(np.tile([(0.1, 0.3, 1.0)], (3, 1))))
    camera = Camera((0, 0, 1), (0, 0, 0), projection="perspective", field_of_view=60)
    return Scene(mesh, camera, 200, 160, Material(*_COLORS, 50), [Light(tuple(_LIGHT))])


def _grid(side: int) -> Scene:
    """A bent sheet of ``side * side`` triangles, each half a pixel to one pixel large."""
    columns, rows = side, side // 2
    x, y = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    points = np.stack([x - columns / 2 + 0.3, y - rows / 2 + 0.2], axis=-1) * 1.2
    swing = 2 * np.pi * np.stack([x / columns, y / rows], axis=-1)
    normals = np.concatenate([0.4 * np.sin(swing), np.ones((*x.shape, 1))], axis=-1)
    vertices = np.concatenate([points, np.zeros((*x.shape, 1))], axis=-1)
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    width, height = int(1.2 * columns) + 4, int(1.2 * rows) + 4
    return _scene(width, height, vertices.reshape(-1, 3), normals.reshape(-1, 3), faces)
