"""Vertex normals of meshes: computed, cut at creases, mended, transformed."""

import numpy as np

from blysk.golden.reference.geometry import normalise

__all__ = [
    "DEFAULT_CREASE",
    "crease_normals",
    "face_directions",
    "repaired_normals",
    "transformed",
    "weighted_normals",
]

DEFAULT_CREASE = 40.0
"""Angle between faces, in degrees, over which an edge is sharp, for meshes without normals."""

# The largest error of a stored normal's length that counts as rounding; 1e-6 is for float32.
_LENGTH_TOLERANCE = 1 / 256 + 1e-6
# A triangle whose height is below this part of the largest coordinate is rounding only: 32 units of 2**-53.
_FLAT = 2.0**-48
# Slack of the crease test in the cosine: the rounding of vertices stored as float32.
_COSINE_SLACK = 1e-6


def face_directions(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit face normals, with flags. A face without area takes the normal of a neighbour.

    The neighbour across its longest side is tried first. So a face between corners of a straight side takes
    the normal of the polygon at this side. A face with two corners at the same position, or without a
    neighbour, has no normal.

    Parameters
    ----------
    vertices : float64 array, shape (V, 3)
        Positions, the largest coordinate about 1.
    faces : int array, shape (F, 3)
        Their corners.

    Returns
    -------
    directions : float64 array, shape (F, 3)
        0 for a face without a normal.
    found : bool array, shape (F,)
        Whether the face has a normal.
    solid : bool array, shape (F,)
        Whether the face has an area.
    """
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    sides = np.stack([b - a, c - b, a - c], axis=1)
    lengths = np.linalg.norm(sides, axis=-1)
    cross = np.cross(sides[:, 0], sides[:, 1])
    solid = np.linalg.norm(cross, axis=-1) > _FLAT * lengths.max(axis=1)
    directions = np.where(solid[:, np.newaxis], normalise(cross), 0)
    found = solid.copy()
    flat = ~solid & (lengths > 0).all(axis=1)
    if not flat.any():
        return directions, found, solid
    first, second = _shared_sides(_places(vertices, faces))
    first, second = np.concatenate([first, second]), np.concatenate([second, first])
    known = flat[first // 3] & (found | flat)[second // 3]
    first, second = first[known], second[known]
    longest = lengths.ravel()[first] == lengths.max(axis=1)[first // 3]
    for chosen in (longest, np.ones_like(longest)):
        taker, giver = first[chosen] // 3, second[chosen] // 3
        while True:
            ready = ~found[taker] & found[giver]
            if not ready.any():
                break
            directions[taker[ready]] = directions[giver[ready]]
            found[taker[ready]] = True
    return directions, found, solid


def _places(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Corners of faces by position: the same number for equal positions."""
    _, welded = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    return welded.ravel()[faces]


def _shared_sides(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of sides between the same two places; side 3 f + k starts at corner k of face f."""
    start, end = places.ravel(), np.roll(places, -1, axis=1).ravel()
    edge = np.minimum(start, end) * (places.max() + 1) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    first, second = order[:-1], order[1:]
    shared = edge[first] == edge[second]
    return first[shared], second[shared]


def weighted_normals(
    vertices: np.ndarray, faces: np.ndarray, face_normals: np.ndarray, owner: np.ndarray, owners: int
) -> np.ndarray:
    """Unit sums of face normals, weighted by the angles of corners, for each owner.

    ``owner``, shape (F, 3), has the owner of each corner, 0 to ``owners - 1``. Face normals have length 1.
    """
    corners = vertices[faces]
    sides = np.roll(corners, -1, axis=1) - corners
    back = -np.roll(sides, 1, axis=1)
    angles = np.arctan2(np.linalg.norm(np.cross(sides, back), axis=-1), np.einsum("fki,fki->fk", sides, back))
    weighted = (face_normals[:, np.newaxis] * angles[..., np.newaxis]).reshape(-1, 3)
    flat = owner.ravel()
    total = np.stack([np.bincount(flat, weights=weighted[:, i], minlength=owners) for i in range(3)], axis=-1)
    # Normals of faces back to back cancel, except for rounding up to 1e-12. Then either normal serves.
    cancelled = np.linalg.norm(total, axis=1) < 1e-12
    if cancelled.any():
        one = np.zeros(owners, dtype=np.int64)
        one[flat] = np.repeat(np.arange(len(faces)), 3)
        total[cancelled] = face_normals[one[cancelled]]
    return normalise(total)


def repaired_normals(
    vertices: np.ndarray, faces: np.ndarray, directions: np.ndarray, normals: np.ndarray, own: np.ndarray
) -> tuple[np.ndarray, int]:
    """Stored normals of the vertices ``own``, normalised, and the number of mended normals.

    ``directions`` are the unit normals of the faces.
    """
    stored = normals[own]
    usable = np.isfinite(stored).all(axis=1) & stored.any(axis=1)
    # The largest component bounds the length without overflow.
    rough = np.abs(np.where(usable[:, np.newaxis], stored, 0)).max(axis=1)
    sane = usable & (rough < 2)
    length = np.linalg.norm(np.where(sane[:, np.newaxis], stored, 0), axis=1)
    bad = np.abs(length - 1) > _LENGTH_TOLERANCE
    result = normalise(np.where(usable[:, np.newaxis], stored, 0))
    if not usable.all():
        owner = np.searchsorted(own, faces)
        computed = weighted_normals(vertices, faces, directions, owner, len(own))
        result[~usable] = computed[~usable]
    return result, int(bad.sum())


def crease_normals(
    vertices: np.ndarray,
    faces: np.ndarray,
    directions: np.ndarray,
    crease_angle: float,
    looks: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut a mesh at its creases: the old vertex of each new vertex, the new faces, and the new normals.

    ``directions`` are the unit normals of the faces. Two corners at one position share a new vertex if a
    chain of faces around the position joins them. The faces of the chain meet at edges that are no creases.

    ``looks`` are colours and texture coordinates, a row for each old vertex, or no rows. Corners that share a
    normal and differ in their looks have vertices of their own.
    """
    if not len(faces):
        return np.zeros(0, dtype=np.int64), faces, np.zeros((0, 3))
    places = _places(vertices, faces)
    corner = np.arange(faces.size).reshape(faces.shape)
    start, end = places.ravel(), np.roll(places, -1, axis=1).ravel()
    start_corner, end_corner = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    low_corner = np.where(start < end, start_corner, end_corner)
    high_corner = np.where(start < end, end_corner, start_corner)
    first, second = _shared_sides(places)
    cosine = np.einsum("ei,ei->e", directions[first // 3], directions[second // 3])
    smooth = cosine >= np.cos(np.radians(crease_angle)) - _COSINE_SLACK
    first, second = first[smooth], second[smooth]

    # The imports take longer than drawing a small picture.
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    rows = np.concatenate([low_corner[first], high_corner[first]])
    columns = np.concatenate([low_corner[second], high_corner[second]])
    graph = coo_array((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(faces.size, faces.size))
    count, group = connected_components(graph, directed=False)
    new_faces = group.reshape(faces.shape).astype(np.int64)
    normals = weighted_normals(vertices, faces, directions, new_faces, count)
    if len(looks):
        _, look = np.unique(looks + 0.0, axis=0, return_inverse=True)
        pairs = group.astype(np.int64) * len(looks) + look.ravel()[faces.ravel()]
        pairs, group = np.unique(pairs, return_inverse=True)
        normals, count = normals[pairs // len(looks)], len(pairs)
        new_faces = group.reshape(faces.shape).astype(np.int64)
    old_vertex = np.zeros(count, dtype=np.int64)
    old_vertex[group] = faces.ravel()
    return old_vertex, new_faces, normals


def transformed(normals: np.ndarray, cofactors: np.ndarray) -> np.ndarray:
    """Normals multiplied by the cofactors, and scaled back to their stored lengths."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    finite = np.isfinite(normals).all(axis=1)
    turned = np.full(normals.shape, np.nan)
    turned[finite] = normalise(normals[finite] @ cofactors.T) * length[finite]
    return turned
