"""Triangles of polygons, concave ones included."""

import mapbox_earcut
import numpy as np

from blysk.sim.meshes.refusal import Refused

__all__ = ["check_corners", "triangulated"]


def check_corners(corners: np.ndarray, vertices: int) -> None:
    """Refuse indices, from 0, of vertices that do not exist."""
    if corners.size and not 0 <= corners.min() <= corners.max() < vertices:
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise Refused(f"a face refers to vertex {wrong} (from 0), there are {vertices}")


def triangulated(vertices: np.ndarray, polygons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut polygons of equally many corners into triangles.

    A fan from the first corner is used if each of its triangles has the polygon's orientation: the fan then
    covers a polygon that does not cross itself. Other polygons are cut by ear clipping, in the plane at right
    angles to their area vector ``sum(p_i x p_(i+1)) / 2``.

    Parameters
    ----------
    vertices : ndarray, shape (V, 3)
        Coordinates.
    polygons : int ndarray, shape (P, n)
        Vertices of their n corners, n at least 3, in range.

    Returns
    -------
    corners : int ndarray, shape (T, 3)
        The corners of its polygon, 0 to n - 1, that each triangle has; polygon after polygon.
    owners : int ndarray, shape (T,)
        The polygon of each triangle.
    """
    count, sides = polygons.shape
    fan = np.array([(0, k, k + 1) for k in range(1, sides - 1)])
    if sides == 3:
        return np.repeat(fan, count, axis=0), np.arange(count)
    # Relative to a corner, so that a polygon far from the origin loses nothing; of a size near 1.
    places = vertices[polygons] - vertices[polygons[:, :1]]
    largest = np.abs(places).max(axis=(1, 2), keepdims=True)
    places = np.divide(places, largest, out=np.zeros_like(places), where=np.isfinite(largest) & (largest > 0))
    crosses = np.cross(places[:, 1:-1], places[:, 2:])
    area = crosses.sum(axis=1)
    turned = np.einsum("pti,pi->pt", crosses, area)
    # A corner on a straight side gives a triangle without area, of either sign by rounding.
    slack = 2.0**-40 * np.einsum("pi,pi->p", area, area)
    is_fan = (turned >= -slack[:, np.newaxis]).all(axis=1)

    pieces = [np.broadcast_to(fan, (int(is_fan.sum()), *fan.shape)).reshape(-1, 3)]
    owners = [np.repeat(np.flatnonzero(is_fan), len(fan))]
    # Few polygons of a mesh are concave, and ears are found one after the other.
    for number in np.flatnonzero(~is_fan).tolist():
        ears = _ears(places[number], area[number])
        pieces.append(ears if len(ears) else fan)
        owners.append(np.full(len(pieces[-1]), number))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(pieces)[order], owner[order]


def _ears(places: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Corners of the triangles of one polygon by ear clipping, in the polygon's orientation."""
    normal = area / np.linalg.norm(area)
    side = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    side /= np.linalg.norm(side)
    flat = np.ascontiguousarray(places @ np.stack([side, np.cross(normal, side)], axis=1))
    ends = np.array([len(flat)], dtype=np.uint32)
    triangles = mapbox_earcut.triangulate_float64(flat, ends).reshape(-1, 3).astype(np.int64)
    first, second, third = np.moveaxis(flat[triangles], 1, 0)
    (ux, uy), (vx, vy) = (second - first).T, (third - first).T
    return np.where((ux * vy < uy * vx)[:, np.newaxis], triangles[:, ::-1], triangles)
