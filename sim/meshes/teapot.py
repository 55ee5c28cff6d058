"""The Utah teapot at any triangle count, with exact normals."""

import json
from functools import cache
from importlib.resources import files

import numpy as np

from blysk.golden.reference.geometry import Mesh, normalise
from blysk.sim.errors import InputError

__all__ = ["DEFAULT_TRIANGLES", "MAX_TRIANGLES", "MIN_TRIANGLES", "control_points", "teapot"]

DEFAULT_TRIANGLES = 10_000
"""Approximate number of triangles of the teapot."""

MIN_TRIANGLES = 64
MAX_TRIANGLES = 4_000_000


@cache
def control_points() -> np.ndarray:
    """Control points of the 32 bicubic Bezier patches, y up.

    ``[p, i, j]`` is the point with weight ``B_i(u) B_j(v)`` in patch ``p``; ``dS/dv x dS/du`` points out
    of the pot. Patches 0 to 3 are the rim, 4 to 11 the body, 12 to 15 the handle, 16 to 19 the spout,
    20 to 27 the lid, 28 to 31 the bottom. Row ``i = 0`` of patches 20 to 23 (the knob) and of 28 to 31
    (the middle of the bottom) is one point.

    Returns
    -------
    float64 array, shape (32, 4, 4, 3)
        Read only. The pot stands on y = 0, the knob's top is at y = 3.15, the spout points along +x.

    Notes
    -----
    Source: M. Newell, 1975, with J. Blinn's proportions and F. Crow's bottom; public domain. The stored
    points are z up and are turned by -90 degrees about x.
    """
    data = json.loads(files(__package__).joinpath("data/teapot_patches.json").read_text(encoding="utf-8"))
    x, y, z = np.array(data["points"], dtype=np.float64).T
    # Adding 0 turns -0 into 0, so that equal points are equal to the bit.
    points = np.stack([x, z, -y], axis=-1) + 0.0
    points = points[np.array(data["patches"])].reshape(32, 4, 4, 3)
    points.setflags(write=False)
    return points


def _contract(weights: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Sum of ``weights[k, n] * points[k, ...]`` over the four k: shape (n, ...).

    The outer two and the inner two are added first. So reversing both arrays gives the same bits. Two
    patches that share an edge, in either direction, get the same points there.
    """
    w = weights.reshape(*weights.shape, *([1] * (points.ndim - 1)))
    p = points[:, np.newaxis]
    return (w[0] * p[0] + w[3] * p[3]) + (w[1] * p[1] + w[2] * p[2])


def _surface(segments: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and outward unit normals of all patches on a grid of u and v: two arrays (32, n, n, 3)."""
    t = np.arange(segments + 1) / segments
    s = t[::-1]
    basis = np.stack([s**3, 3 * (s * s) * t, 3 * (t * t) * s, t**3])
    slope = np.stack([-3 * s**2, 3 * s**2 - 6 * s * t, 6 * s * t - 3 * t**2, 3 * t**2])

    def evaluate(along_u, along_v):
        rows = _contract(along_u, control_points().transpose(1, 0, 2, 3))
        return _contract(along_v, rows.transpose(2, 1, 0, 3)).transpose(1, 2, 0, 3)

    points, du, dv = evaluate(basis, basis), evaluate(slope, basis), evaluate(basis, slope)
    # On a row that is one point, dS/dv is 0. As u goes to 0, its direction goes to the direction of d2S/dudv.
    collapsed = (np.ptp(control_points()[:, 0], axis=1) == 0).all(axis=-1)
    points[collapsed, 0] = control_points()[collapsed, 0, :1]
    dv[collapsed, 0] = evaluate(slope[:, :1], slope)[collapsed, 0]
    return points + 0.0, normalise(np.cross(dv, du)) + 0.0


def teapot(triangles: int = 10_000) -> Mesh:
    """The Utah teapot in about ``triangles`` triangles, with exact normals.

    Each of the 32 bicubic patches ``S(u, v) = sum_ij B_i(u) B_j(v) P_ij`` becomes a grid of n x n
    quadrilaterals of two triangles. The patches of the knob and of the bottom meet in a point each. The 8 n
    triangles without area there are left out, and for n = 1 four more at the spout's lip. A normal is the
    vector ``dS/dv x dS/du``, normalised. At the two points it is the limit of this vector. Patches that join
    smoothly share the vertices of their seam.

    Parameters
    ----------
    triangles : int
        Wanted number of triangles, 64 to 4,000,000. The mesh has the nearest number of the form
        ``64 n^2 - 8 n``, at most ``8 sqrt(triangles) + 32`` away.

    Returns
    -------
    Mesh
        y up, standing on y = 0, the spout along +x, about 6.4 wide and 3.15 high. The lid, handle and
        spout are surfaces of their own that pass into the body, as in the original.

    Raises
    ------
    InputError
        If ``triangles`` is out of range.

    Notes
    -----
    Source: M. Newell, 1975; triangle counts of 1 thousand to 1 million as in [P].
    """
    if not MIN_TRIANGLES <= triangles <= MAX_TRIANGLES:
        raise InputError(
            f"teapot of {triangles} triangles",
            f"the count must be {MIN_TRIANGLES} to {MAX_TRIANGLES}",
            "choose one in that range",
        )
    segments = int((1 + np.sqrt(1 + 4 * triangles)) / 16)
    segments += abs(_count(segments + 1) - triangles) < abs(_count(segments) - triangles)

    points, normals = _surface(segments)
    index = np.arange(points[..., 0].size).reshape(points.shape[:3])
    a, b, c, d = index[:, :-1, :-1], index[:, :-1, 1:], index[:, 1:, 1:], index[:, 1:, :-1]
    # Both ways of cutting a quadrilateral go round (v, u), the direction of dS/dv x dS/du.
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    vertices, normals = points.reshape(-1, 3), normals.reshape(-1, 3)

    border = np.ones(points.shape[1:3], dtype=bool)
    border[1:-1, 1:-1] = False
    border = index[:, border].ravel()
    # Handle and body touch in a vertex with two normals. So the normal is part of the key.
    key = np.hstack([vertices[border], np.round(normals[border], 6) + 0.0])
    _, first, group = np.unique(key, axis=0, return_index=True, return_inverse=True)
    target = index.ravel().copy()
    target[border] = border[first][group.ravel()]
    faces = target[faces]
    # Drop triangles without area. At the knob and the bottom a corner occurs twice. At the spout's lip three
    # corners are in a line if n = 1.
    corner = vertices[faces[:, 0]]
    faces = faces[np.cross(vertices[faces[:, 1]] - corner, vertices[faces[:, 2]] - corner).any(axis=1)]

    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    return Mesh(vertices[used], (np.cumsum(used) - 1)[faces], normals[used])


def _count(segments: int) -> int:
    """Triangles of a teapot of ``segments`` x ``segments`` quadrilaterals a patch."""
    return 64 * segments**2 - 8 * segments
