"""A frame by triangles: a scene drawn by the bit-accurate models of geometry, shading and depth test."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.frame import background_code
from blysk.golden.frames.prepare import constants_of
from blysk.golden.frames.vector_axes import further_axes, triangle_axes
from blysk.golden.geometry.light_adapter import LightAdapter
from blysk.golden.geometry.scene_triangles import SceneTriangles, scene_triangles
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.reference.light_frame import light_frames
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer

__all__ = [
    "SPAN_ANGLE",
    "TriangleFrame",
    "frame_of_pixels",
    "sent_triangles",
    "triangle_constants",
    "triangle_frame",
]

SPAN_ANGLE = 5.0
"""Widest piece of a span in degrees, for methods of unit normals."""


@dataclass(frozen=True)
class TriangleFrame:
    """A scene's picture, drawn from triangles.

    Parameters
    ----------
    image : uint8 array, shape (height, width, 3)
        The frame buffer.
    sent : SceneTriangles
        The drawn triangles.
    owner : int64 array, shape (height, width)
        Face of the mesh that each pixel shows, -1 for the background.
    counts : mapping of str to int
        Counters of `RendererUnit`.
    """

    image: np.ndarray
    sent: SceneTriangles
    owner: np.ndarray
    counts: Mapping[str, int]


def sent_triangles(scene: Scene, renderer: Renderer, angle: float | None = None) -> SceneTriangles:
    """The triangles of a scene for a renderer, sorted by material, with spans cut at an angle.

    Parameters
    ----------
    scene : Scene
        Scene to be drawn.
    renderer : Renderer
        Geometry and shading.
    angle : float, optional
        In degrees, 0 to 60, by default `SPAN_ANGLE`. Spans of true lines and vectors have no cuts at an
        angle.

    Raises
    ------
    ValueError
        If the scene has point lights, a near viewer or a material with a cutoff of alpha.
    """
    if scene.local:
        raise ValueError("point lights and a near viewer need spans with values, which triangles do not give")
    if scene.cutoffs:
        raise ValueError("hardware geometry drops no pixels by alpha; leave out the cutoff")
    angle = SPAN_ANGLE if angle is None else angle
    design = renderer.design
    axes = triangle_axes(scene, design)
    geometry, limit = renderer.geometry, FrameSettings.limit_of(angle)
    return scene_triangles(scene, geometry.grid, limit, axes, geometry.surface).by_material()


def triangle_constants(scene: Scene, renderer: Renderer) -> list[FrameConstants]:
    """Frame constants of each material of a scene, with the axes of further lights, for a renderer.

    Parameters
    ----------
    scene, renderer
        As for `triangle_frame`.

    Raises
    ------
    ValueError
        As `constants_of` does.
    """
    constants = constants_of(scene, renderer.design)
    if not renderer.rows:
        return constants
    if renderer.mirrors:
        # A first light that is off still contributes y cos a and y sin a to q.
        direction = constants[0].direction.copy()
        first = light_frames(scene, 1)[0]
        direction[0] = np.rint(first.direction * QuotientSpans.ONE)
        constants = [replace(of, direction=direction) for of in constants]
    axes = LightAdapter.codes_of(further_axes(scene, renderer.design))
    return [replace(constants[0], axes=axes), *constants[1:]]


def frame_of_pixels(
    scene: Scene, x: np.ndarray, y: np.ndarray, color: np.ndarray, transfer: str
) -> np.ndarray:
    """Frame buffer after pixels are written in their order over the background.

    Parameters
    ----------
    scene : Scene
        Size and background.
    x, y : int arrays, shape (P,)
        Column and row of each pixel.
    color : uint8 array, shape (P, 3)
        Red, green, blue.
    transfer : str
        Transfer of the colours, by which the background is encoded, see `background_code`.

    Returns
    -------
    uint8 array, shape (height, width, 3)
    """
    image = np.empty((scene.height, scene.width, 3), dtype=np.uint8)
    image[...] = background_code(scene, transfer)
    # If several pixels are written to the same place, the last pixel counts, as in hardware.
    image[y, x] = color
    return image


def triangle_frame(scene: Scene, renderer: Renderer, angle: float | None = None) -> TriangleFrame:
    """Frame by the bit-accurate models, equal to the simulated hardware's image bit for bit.

    Parameters
    ----------
    scene : Scene
        The scene, with at most as many lights as the design has, and as many materials.
    renderer : Renderer
        Geometry and shading.
    angle : float, optional
        As for `sent_triangles`.

    Raises
    ------
    ValueError
        If the scene has point lights or a near viewer, or does not fit the design.
    """
    sent = sent_triangles(scene, renderer, angle)
    drawn = renderer.compute(sent.triangles, sent.frame, triangle_constants(scene, renderer))
    owner = np.full((scene.height, scene.width), -1, dtype=np.int64)
    owner[drawn.y, drawn.x] = sent.source[drawn.triangle]
    image = frame_of_pixels(scene, drawn.x, drawn.y, drawn.color, renderer.design.transfer)
    return TriangleFrame(image, sent, owner, drawn.counts)
