"""Triangles of polygons, also of concave polygons."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import mapbox_earcut
import numpy as np

from blysk.sim.meshes.refusal import Refused

__all__ = ["check_corners", "cut_polygons", "triangulated"]

# A triangle counts as without area up to this share of its polygon's area: rounding only.
_FLAT = 2.0**-40
# Largest number of corners that are tried as the centre of a fan.
_FANS = 16


def check_corners(corners: np.ndarray, vertices: int) -> None:
    """Refuse indices of vertices that do not exist. The first vertex has index 0."""
    if corners.size and not 0 <= corners.min() <= corners.max() < vertices:
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise Refused(
            f"a face refers to vertex {wrong}, counted from 0, but the number of vertices is {vertices}"
        )


def cut_polygons(
    vertices: np.ndarray, corners: np.ndarray, counts: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cut polygons with any numbers of corners into triangles, see `triangulated`.

    Parameters
    ----------
    vertices : ndarray, shape (V, 3)
        Coordinates.
    corners : int ndarray, shape (n,)
        Vertices of the polygons' corners, polygon after polygon, in range.
    counts : int ndarray, shape (P,)
        Corners of each polygon, at least 3.

    Returns
    -------
    places : int ndarray, shape (T, 3)
        The corners of each triangle, by their places in ``corners``, polygon after polygon.
    owners : int ndarray, shape (T,)
        The polygon of each triangle.
    """
    starts = np.cumsum(counts) - counts
    pieces, polygons = [np.zeros((0, 3), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for sides in np.unique(counts).tolist():
        chosen = np.flatnonzero(counts == sides)
        places = starts[chosen][:, np.newaxis] + np.arange(sides)
        triangles, owners = triangulated(vertices, corners[places])
        pieces.append(places[owners[:, np.newaxis], triangles])
        polygons.append(chosen[owners])
    owner = np.concatenate(polygons)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(pieces)[order], owner[order]


def triangulated(vertices: np.ndarray, polygons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut polygons of equally many corners into triangles that keep all corners and sides.

    Each side of a polygon of n corners is a side of exactly one of its n - 2 triangles. All other
    sides belong to two triangles, in opposite directions. So polygons that share sides stay joined. A fan
    from a corner is used if each of its triangles has an area and the polygon's orientation. The fan then
    covers a polygon that does not cross itself. Other polygons are cut by ear clipping, in the plane at right
    angles to their area vector ``sum(p_i x p_(i+1)) / 2``. A triangle without area is left only where nothing
    else keeps a corner, as at the end of a spike.

    Parameters
    ----------
    vertices : ndarray, shape (V, 3)
        Coordinates.
    polygons : int ndarray, shape (P, n)
        Vertices of the polygons' n corners, n at least 3, in range.

    Returns
    -------
    corners : int ndarray, shape (T, 3)
        The corners of each triangle, by their numbers in its polygon, 0 to n - 1, polygon after polygon.
    owners : int ndarray, shape (T,)
        The polygon of each triangle.
    """
    count, sides = polygons.shape
    fan = np.array([(0, k, k + 1) for k in range(1, sides - 1)])
    if sides == 3:
        return np.repeat(fan, count, axis=0), np.arange(count)
    # Places count from a corner, so that a polygon far from the origin loses no bits. Their size is near 1.
    places = vertices[polygons] - vertices[polygons[:, :1]]
    largest = np.abs(places).max(axis=(1, 2), keepdims=True)
    places = np.divide(places, largest, out=np.zeros_like(places), where=np.isfinite(largest) & (largest > 0))
    area = np.cross(places[:, 1:-1], places[:, 2:]).sum(axis=1)
    squared = np.einsum("pi,pi->p", area, area)

    pieces, owners = [], []
    rest = np.flatnonzero(squared > 0)
    for first in range(min(sides, _FANS)):
        arms = np.roll(places[rest], -first, axis=1)
        arms = arms[:, 1:] - arms[:, :1]
        turned = np.einsum("pti,pi->pt", np.cross(arms[:, :-1], arms[:, 1:]), area[rest])
        seen = (turned > _FLAT * squared[rest, np.newaxis]).all(axis=1)
        pieces.append(np.broadcast_to((fan + first) % sides, (int(seen.sum()), *fan.shape)).reshape(-1, 3))
        owners.append(np.repeat(rest[seen], len(fan)))
        rest = rest[~seen]
        if not len(rest):
            break
    # Few polygons of a mesh are concave, and ears are found one after the other.
    for number in rest.tolist():
        pieces.append(_ears(places[number], area[number]))
        owners.append(np.full(len(fan), number))
    without = np.flatnonzero(squared == 0)
    pieces.append(np.tile(fan, (len(without), 1)))
    owners.append(np.repeat(without, len(fan)))
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
    if len(triangles) and _doubled_areas(flat, triangles).sum() < 0:
        triangles = triangles[:, ::-1]
    whole = _completed(triangles.tolist(), len(flat))
    if not _keeps_sides(whole, len(flat)):
        # The polygon crosses itself.
        whole = [[0, k, k + 1] for k in range(1, len(flat) - 1)]
    return _improved(flat, whole, _FLAT * np.linalg.norm(area))


def _doubled_areas(flat: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    first, second, third = np.moveaxis(flat[triangles], 1, 0)
    (ux, uy), (vx, vy) = (second - first).T, (third - first).T
    return ux * vy - uy * vx


def _sides(triangle: Sequence[int]) -> Iterator[tuple[int, int]]:
    """The three directed sides. Side k lies opposite corner k."""
    a, b, c = triangle
    return iter(((b, c), (c, a), (a, b)))


def _completed(triangles: list[list[int]], count: int) -> list[list[int]]:
    """Triangles of earcut, and triangles of the corners and parts that earcut left out.

    earcut leaves out corners on straight sides, spikes, and parts that it cannot cut. The missing parts are
    loops. The sides of a loop belong to the polygon or to triangles. Each loop is cut as a fan.
    """
    taken = {side for triangle in triangles for side in _sides(triangle)}
    outline = {(k, (k + 1) % count) for k in range(count)}
    follow: dict[int, list[int]] = {}
    for a, b in outline - taken:
        follow.setdefault(a, []).append(b)
    for a, b in taken - outline:
        if (b, a) not in taken:
            follow.setdefault(b, []).append(a)
    result = list(triangles)
    while follow:
        path = [next(iter(follow))]
        while path[-1] not in path[:-1]:
            steps = follow[path[-1]]
            path.append(steps.pop())
            if not steps:
                del follow[path[-2]]
        loop = path[path.index(path[-1]) : -1]
        result += [[loop[0], b, c] for b, c in pairwise(loop[1:])]
        for a, b in pairwise(path[: path.index(path[-1]) + 1]):
            follow.setdefault(a, []).append(b)
    return result


def _keeps_sides(triangles: list[list[int]], count: int) -> bool:
    """Whether the sides that no other triangle shares are the sides of the polygon, each once."""
    taken = {side for triangle in triangles for side in _sides(triangle)}
    alone = {(a, b) for a, b in taken if (b, a) not in taken}
    once = len(taken) == 3 * len(triangles) == 3 * (count - 2)
    return once and alone == {(k, (k + 1) % count) for k in range(count)}


def _improved(flat: np.ndarray, triangles: list[list[int]], least: float) -> np.ndarray:
    """Triangles of a polygon. Triangles without area exchange a side with a neighbour if both get an area."""
    result = np.array(triangles)
    across = {side: (k, c) for k, t in enumerate(triangles) for side, c in zip(_sides(t), t, strict=True)}
    waiting = np.flatnonzero(_doubled_areas(flat, result) <= least).tolist()
    progress = True
    while waiting and progress:
        progress = False
        for thin in waiting[::-1]:
            lengths = [np.linalg.norm(flat[a] - flat[b]) for a, b in _sides(result[thin].tolist())]
            a, b = list(_sides(result[thin].tolist()))[int(np.argmax(lengths))]
            if (b, a) not in across:
                continue
            _, tip = across[a, b]
            other, apex = across[b, a]
            new = np.array([[a, apex, tip], [apex, b, tip]])
            if (_doubled_areas(flat, new) <= least).any():
                continue
            del across[a, b], across[b, a]
            for place, triangle in zip((thin, other), new.tolist(), strict=True):
                result[place] = triangle
                across |= {side: (place, c) for side, c in zip(_sides(triangle), triangle, strict=True)}
            waiting.remove(thin)
            progress = True
    return result
