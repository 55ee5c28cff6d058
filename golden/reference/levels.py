"""Levels of detail: the level of a texture that each span takes."""

from collections.abc import Sequence

import numpy as np

from blysk.golden.reference.geometry import sum_of_components
from blysk.golden.reference.scene import Scene

__all__ = ["span_levels", "texel_places", "triangle_levels"]


def span_levels(
    scene: Scene, triangle: np.ndarray, ends: Sequence[np.ndarray], slopes: Sequence[np.ndarray]
) -> np.ndarray:
    """Level of each span, by its largest texel step.

    With the weights q of the corners, texture coordinates are ``u = q·u_corners / w`` with ``w = sum q``.
    Their exact derivative along x is ``(q_x·u_corners - u w_x) / w``, and in the same way along y. The
    largest magnitude of the four derivatives of u and v at both ends, times the texture's columns or rows, is
    the step that `Texture.level_of` takes.

    Parameters
    ----------
    scene : Scene
        Mesh with texture coordinates, and materials.
    triangle : int array, shape (spans,)
        Index into the mesh's faces.
    ends : two float64 arrays, shape (spans, 3)
        Weights q at the first and at the last pixel centre, see `Raster`.
    slopes : two float64 arrays, shape (spans, 3)
        Derivatives of q, in pixels: q_x to the right, q_y down.

    Returns
    -------
    int64 array, shape (spans,)
        0 for a span whose material has no texture.

    Source: docs/theory/textures.md#levels.
    """
    corners = scene.mesh.coordinates[scene.mesh.faces[triangle]]
    return _levels(scene, triangle, _steps(corners, ends, slopes))


def triangle_levels(
    scene: Scene, source: np.ndarray, corners: np.ndarray, coordinates: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Level of each face, for hardware that takes the level of a texture with a triangle.

    It is the level of the largest texel step at the mean of the corners in space, see `span_levels`. A face
    in several pieces has the level of the mean of the pieces' steps.

    Parameters
    ----------
    scene : Scene
        Mesh with texture coordinates, and materials.
    source : int array, shape (T,)
        Face of each triangle, or of each piece of a clipped triangle.
    corners : float64 array, shape (T, 3, 3)
        Homogeneous coordinates of the corners: ``x w`` and ``y w`` in pixels, and w, which is over 0.
    coordinates : float64 array, shape (T, 3, 2)
        Texture coordinates of the corners.

    Returns
    -------
    level : int64 array, shape (faces,)
        0 for a face without a texture, or without area.
    spread : int64 array, shape (T,)
        Largest difference of the levels at the corners of each triangle.

    Source: docs/theory/textures.md#levels.
    """
    normals = np.cross(np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1))
    volume = np.einsum("tk,tk->t", corners[:, 0], normals[:, 0])[:, np.newaxis]
    slopes = [np.where(volume, normals[..., axis] / np.where(volume, volume, 1), 0) for axis in (0, 1)]

    def steps(share: np.ndarray) -> np.ndarray:
        w = corners[..., 2] @ share
        return _steps(coordinates, [share / w[:, np.newaxis]], slopes)

    middle, faces = steps(np.full(3, 1 / 3)), len(scene.mesh.faces)
    pieces = np.maximum(np.bincount(source, minlength=faces), 1)
    mean = np.stack([np.bincount(source, of, faces) / pieces for of in middle.T], axis=1)
    of_corners = np.array([_levels(scene, source, steps(share)) for share in np.eye(3)])
    return _levels(scene, np.arange(faces), mean), np.ptp(of_corners, axis=0)


def texel_places(
    scene: Scene, triangle: np.ndarray, levels: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Level of each span; whether u and v repeat; columns and rows of the level.

    The second and the third result have the shape (spans, 2).

    Parameters
    ----------
    scene : Scene
        Mesh and materials.
    triangle : int array, shape (spans,)
        Face of each span.
    levels : int array, shape (spans,)
        Level of each span; only read if a texture has several levels.
    """
    material = scene.mesh.material[triangle]
    level = np.zeros(len(material), dtype=np.int64)
    periodic = np.ones((len(material), 2), dtype=bool)
    size = np.zeros((len(material), 2))
    for index, texture in scene.textures.items():
        chosen = material == index
        if texture.mipmapped:
            level[chosen] = levels[chosen]
        periodic[chosen] = [wrap != "clamp" for wrap in texture.wrap]
        sides = np.array([image.shape[1::-1] for image in texture.levels])
        size[chosen] = sides[level[chosen]]
    return level, periodic, size


def _steps(corners: np.ndarray, ends: Sequence[np.ndarray], slopes: Sequence[np.ndarray]) -> np.ndarray:
    """Largest derivatives of u and v over places and directions, shape (spans, 2)."""
    # Coordinates count from the first corner. Far from 0 the derivative is equal, with a larger rounding.
    corners = corners - corners[:, :1]
    step = np.zeros((len(corners), 2))
    for weights in ends:
        w = sum_of_components(weights)[:, np.newaxis]
        place = np.einsum("sn,snk->sk", weights, corners) / w
        for slope in slopes:
            change = np.einsum("sn,snk->sk", slope, corners)
            change -= place * sum_of_components(slope)[:, np.newaxis]
            np.maximum(step, np.abs(change / w), out=step)
    return step


def _levels(scene: Scene, triangle: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Level of each step, by the texture of its face."""
    level = np.zeros(len(triangle), dtype=np.int64)
    material = scene.mesh.material[triangle]
    for index, texture in scene.textures.items():
        chosen = material == index
        level[chosen] = texture.level_of((step[chosen] * texture.size).max(axis=1))
    return level
