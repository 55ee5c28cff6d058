"""A coarse ring: the mesh of the project's examples."""

import numpy as np

from blysk.golden.reference.geometry import Mesh, normalise

__all__ = ["ring"]


def ring(around: int = 36, across: int = 18) -> Mesh:
    """The ring of the project's examples with exact normals: radii 1 and 0.42, axis y.

    Parameters
    ----------
    around, across : int
        Points along its large and its small circles.
    """
    a, b = np.meshgrid(
        np.linspace(0, 2 * np.pi, around, endpoint=False),
        np.linspace(0, 2 * np.pi, across, endpoint=False),
        indexing="ij",
    )
    outwards = np.stack([np.cos(a), np.zeros_like(a), np.sin(a)], axis=-1)
    normals = np.cos(b)[..., np.newaxis] * outwards + np.sin(b)[..., np.newaxis] * (0.0, 1.0, 0.0)
    index = np.arange(around * across).reshape(around, across)
    right, up = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    corner = np.roll(right, -1, axis=1)
    faces = np.stack([index, up, corner, index, corner, right], axis=-1).reshape(-1, 3)
    normals = normalise(normals.reshape(-1, 3))
    return Mesh(outwards.reshape(-1, 3) + 0.42 * normals, faces, normals)
