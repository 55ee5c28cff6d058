"""Smooth surfaces as meshes with exact normals."""

import numpy as np

from blysk.golden.reference.geometry import Mesh, normalise

__all__ = ["grid", "sphere"]


def grid(points: np.ndarray, normals: np.ndarray) -> Mesh:
    """A mesh of two triangles for each cell of a grid of points.

    Parameters
    ----------
    points, normals : float64 arrays, shape (rows, columns, 3)
        Points, and unit normals at these points. A normal is on the side of the cross product of the step to
        the next row and the step to the next column.
    """
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    return Mesh(points.reshape(-1, 3), faces, normals.reshape(-1, 3))


def sphere(segments: int) -> Mesh:
    """A sphere of radius 1, of ``2 segments`` by ``segments`` quadrilaterals."""
    height, around = np.meshgrid(
        np.linspace(0, np.pi, segments + 1), np.linspace(0, 2 * np.pi, 2 * segments + 1), indexing="ij"
    )
    points = np.stack([np.sin(height) * np.sin(around), np.cos(height), np.sin(height) * np.cos(around)], -1)
    return grid(points, normalise(points))
