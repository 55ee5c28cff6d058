"""Planes of a mesh's triangles, and which of them turn away from the camera."""

import numpy as np

from blysk.golden.reference.geometry import Mesh, normalise, sum_of_components
from blysk.golden.reference.scene import Scene

__all__ = ["face_normals", "planes_of", "seen_from_behind"]

# A height below this part of the largest coordinate is rounding only.
_FLAT = 2.0**-47


def face_normals(mesh: Mesh) -> np.ndarray:
    """Unit normals of the triangles, by the right-hand rule.

    Parameters
    ----------
    mesh : Mesh
        The surface.

    Returns
    -------
    float64 array, shape (F, 3)
        Instead of a normal, a triangle without area (up to rounding) has the unit vector along the sum of its
        vertex normals, or 0 if the sum is 0.
    """
    return planes_of(mesh)[0]


def planes_of(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """`face_normals`, and the indices of the triangles without area (up to rounding)."""
    first, second, third = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    left, right = second - first, third - first
    cross = np.cross(left, right)
    around = sum_of_components(np.abs(left) + np.abs(right))
    height = _FLAT * np.abs(mesh.vertices).max(initial=0)
    flat = np.flatnonzero(sum_of_components(np.abs(cross)) <= height * around)
    cross[flat] = mesh.normals[mesh.faces[flat]].sum(axis=1)
    return normalise(cross), flat


def seen_from_behind(scene: Scene, plane: np.ndarray) -> np.ndarray:
    """Whether each triangle of a scene, with its vector of `face_normals`, turns away from the camera."""
    if scene.camera.projection == "perspective":
        towards = scene.camera.position - scene.mesh.vertices[scene.mesh.faces[:, 0]]
        return sum_of_components(plane * towards) < 0
    found: np.ndarray = plane @ scene.camera.viewer < 0
    return found
