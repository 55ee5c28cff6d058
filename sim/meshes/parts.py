"""Parts of mesh files: triangles of one material."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import trimesh

__all__ = ["Part", "distinct", "scene_of"]


class Part(NamedTuple):
    """Triangles of one material. ``None``: the file has no values, or they are not used."""

    number: int
    """Number of the material."""
    vertices: np.ndarray
    """Shape (V, 3)."""
    faces: np.ndarray
    """Shape (T, 3)."""
    normals: np.ndarray | None = None
    """Shape (V, 3)."""
    colors: np.ndarray | None = None
    """Linear light, shape (V, 3)."""
    coordinates: np.ndarray | None = None
    """Texture coordinates u and v of `Texture`, shape (V, 2)."""


def scene_of(parts: Iterable[Part]) -> "trimesh.Scene":
    """A scene with a geometry for each part. Number, colours and coordinates are its metadata."""
    import trimesh

    scene = trimesh.Scene()
    for part in parts:
        mesh = trimesh.Trimesh(part.vertices, part.faces, vertex_normals=part.normals, process=False)
        mesh.metadata.update(material=part.number, colors=part.colors, coordinates=part.coordinates)
        scene.add_geometry(mesh)
    return scene


def distinct(keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of each distinct combination of indices.

    Parameters
    ----------
    keys : int ndarray, shape (n, columns)
        Indices, 0 or more.

    Returns
    -------
    first : int ndarray
        A row of each combination.
    inverse : int ndarray, shape (n,)
        The combination of each row.
    """
    # A sort of one column after the other takes less time than a sort of rows.
    flat = keys[:, 0]
    for column in keys.T[1:]:
        _, flat = np.unique(flat, return_inverse=True)
        flat = flat.ravel() * (column.max(initial=0) + 1) + column
    _, first, inverse = np.unique(flat, return_index=True, return_inverse=True)
    return first, inverse.ravel()
