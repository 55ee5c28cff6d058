"""Fragments: perspective-correct barycentric coordinates and normals at the pixels of spans."""

import numpy as np

from blysk.golden.reference.faces import face_normals
from blysk.golden.reference.geometry import shares_between
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = ["fragment_barycentrics", "fragment_normals"]


def _position(raster: Raster, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Span of chosen fragments, shape (count,), and t in it, shape (count, 1)."""
    span = raster.span[which]
    t = raster.offset[which] / np.maximum(raster.length[span] - 1, 1)
    return span, t[:, np.newaxis]


def fragment_barycentrics(raster: Raster, which: np.ndarray) -> np.ndarray:
    """Perspective-correct barycentric coordinates of fragments in their triangles.

    Parameters
    ----------
    raster : Raster
        From `rasterise`.
    which : int or bool array
        The fragments, as an index into the fragment arrays.

    Returns
    -------
    float64 array, shape (count, 3)
        Shares of the triangle's three vertices; they add up to 1.

    Raises
    ------
    ValueError
        If the raster's weights were left out.
    """
    if len(raster.weights_left) != len(raster.length):
        raise ValueError("point lights, a near viewer and an albedo need the weights of the spans")
    span, t = _position(raster, which)
    return shares_between(raster.weights_left[span], raster.weights_right[span], t)


def fragment_normals(scene: Scene, raster: Raster, which: np.ndarray) -> np.ndarray:
    """Perspective-correct unit normals of fragments, as a GPU interpolates them for Phong shading.

    Parameters
    ----------
    scene : Scene
        The scene that was rasterised.
    raster : Raster
        From `rasterise`.
    which : int or bool array
        The fragments, as an index into the fragment arrays.

    Returns
    -------
    float64 array, shape (count, 3)
        ``normalise((1-t) m_l N_l + t m_r N_r)``. If this is 0, the normal of the face takes its place,
        negated if the scene negates the normals of the face.
    """
    span, t = _position(raster, which)
    left = (1 - t) * raster.magnitude_left[span][:, np.newaxis]
    right = t * raster.magnitude_right[span][:, np.newaxis]
    # `take` and `einsum` take half the time of an index and a sum along a short axis.
    normal = left * raster.normal_left.take(span, axis=0)
    normal += right * raster.normal_right.take(span, axis=0)
    length = np.sqrt(np.einsum("ij,ij->i", normal, normal))[:, np.newaxis]
    weight = (1 - t[:, 0]) * np.einsum("ij->i", raster.weights_left.take(span, axis=0))
    weight += t[:, 0] * np.einsum("ij->i", raster.weights_right.take(span, axis=0))
    lost = np.flatnonzero(length[:, 0] <= 1e-12 * weight)
    if len(lost):
        triangle = raster.triangle[span[lost]]
        face = face_normals(scene.mesh)[triangle]
        flip = raster.back[span[lost]] & scene.flips[triangle]
        normal[lost] = np.where(flip[:, np.newaxis], -face, face)
        length[lost] = 1.0
    found: np.ndarray = normal / length
    return found
