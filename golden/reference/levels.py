"""Levels of detail: the level of a texture that each span takes."""

from collections.abc import Sequence

import numpy as np

from blysk.golden.reference.geometry import sum_of_components
from blysk.golden.reference.scene import Scene

__all__ = ["span_levels"]


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
    # A whole number of tiles away, coordinates have the same derivative with a larger rounding.
    corners = corners - corners[:, :1]
    step = np.zeros((len(triangle), 2))
    for weights in ends:
        w = sum_of_components(weights)[:, np.newaxis]
        place = np.einsum("sn,snk->sk", weights, corners) / w
        for slope in slopes:
            change = np.einsum("sn,snk->sk", slope, corners)
            change -= place * sum_of_components(slope)[:, np.newaxis]
            np.maximum(step, np.abs(change / w), out=step)
    level = np.zeros(len(triangle), dtype=np.int64)
    material = scene.mesh.material[triangle]
    for index, texture in scene.textures.items():
        chosen = material == index
        level[chosen] = texture.level_of((step[chosen] * texture.size).max(axis=1))
    return level
