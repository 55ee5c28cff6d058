"""Vertex normals of meshes: computed, cut at creases, mended, transformed."""

import numpy as np

from blysk.golden.reference.geometry import normalise

__all__ = ["crease_normals", "face_cross", "repaired_normals", "transformed", "weighted_normals"]

# The largest error of a stored normal's length that counts as rounding, itself stored in float32.
_LENGTH_TOLERANCE = 1 / 256 + 1e-6
# Slack of the crease test in the cosine: the rounding of vertices stored as float32.
_COSINE_SLACK = 1e-6


def face_cross(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twice the area, and the longest side, of each face."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    sides = np.stack([b - a, c - b, a - c])
    return np.linalg.norm(np.cross(sides[0], sides[1]), axis=-1), np.linalg.norm(sides, axis=-1).max(axis=0)


def weighted_normals(
    vertices: np.ndarray, faces: np.ndarray, owner: np.ndarray, owners: int
) -> tuple[np.ndarray, np.ndarray]:
    """Unit face normals, and their angle-weighted unit sums over the corners of each ``owner`` (F, 3)."""
    corners = vertices[faces]
    face_normals = normalise(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    sides = np.roll(corners, -1, axis=1) - corners
    back = -np.roll(sides, 1, axis=1)
    angles = np.arctan2(np.linalg.norm(np.cross(sides, back), axis=-1), np.einsum("fki,fki->fk", sides, back))
    weighted = (face_normals[:, np.newaxis] * angles[..., np.newaxis]).reshape(-1, 3)
    flat = owner.ravel()
    total = np.stack([np.bincount(flat, weights=weighted[:, i], minlength=owners) for i in range(3)], axis=-1)
    # Faces back to back cancel but for rounding, 1e-12 at most; one is as good as the other.
    cancelled = np.linalg.norm(total, axis=1) < 1e-12
    if cancelled.any():
        one = np.zeros(owners, dtype=np.int64)
        one[flat] = np.repeat(np.arange(len(faces)), 3)
        total[cancelled] = face_normals[one[cancelled]]
    return face_normals, normalise(total)


def repaired_normals(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray, own: np.ndarray
) -> tuple[np.ndarray, int]:
    """Unit stored normals of the vertices ``own``, and how many had to be mended."""
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
        _, computed = weighted_normals(vertices, faces, owner, len(own))
        result[~usable] = computed[~usable]
    return result, int(bad.sum())


def crease_normals(
    vertices: np.ndarray, faces: np.ndarray, crease_angle: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut a mesh at its creases: the old vertex of each new one, the new faces, and the new normals.

    Two corners at one position share a new vertex if a chain of faces around the position leads from one to
    the other over edges that are no creases.
    """
    if not len(faces):
        return np.zeros(0, dtype=np.int64), faces, np.zeros((0, 3))
    _, welded = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    places = welded.ravel()[faces]
    face_normals, _ = weighted_normals(vertices, faces, np.zeros_like(faces), 1)

    corner = np.arange(faces.size).reshape(faces.shape)
    start, end = places.ravel(), np.roll(places, -1, axis=1).ravel()
    start_corner, end_corner = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    low_corner = np.where(start < end, start_corner, end_corner)
    high_corner = np.where(start < end, end_corner, start_corner)
    edge = np.minimum(start, end) * (places.max() + 1) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    first, second = order[:-1], order[1:]
    shared = edge[first] == edge[second]
    first, second = first[shared], second[shared]
    cosine = np.einsum("ei,ei->e", face_normals[first // 3], face_normals[second // 3])
    smooth = cosine >= np.cos(np.radians(crease_angle)) - _COSINE_SLACK
    first, second = first[smooth], second[smooth]

    # Their import takes longer than to draw a small picture.
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    rows = np.concatenate([low_corner[first], high_corner[first]])
    columns = np.concatenate([low_corner[second], high_corner[second]])
    graph = coo_array((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(faces.size, faces.size))
    count, group = connected_components(graph, directed=False)
    new_faces = group.reshape(faces.shape).astype(np.int64)
    old_vertex = np.zeros(count, dtype=np.int64)
    old_vertex[group] = faces.ravel()
    _, normals = weighted_normals(vertices, faces, new_faces, count)
    return old_vertex, new_faces, normals


def transformed(normals: np.ndarray, cofactors: np.ndarray) -> np.ndarray:
    """Normals multiplied by the cofactors, and scaled back to their stored lengths."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    finite = np.isfinite(normals).all(axis=1)
    turned = np.full(normals.shape, np.nan)
    turned[finite] = normalise(normals[finite] @ cofactors.T) * length[finite]
    return turned
