"""Triangles on the screen: cut at the near plane and far outside the picture, divided by W, and rounded."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.reference.scene import Scene

__all__ = ["SUBPIXELS", "Pieces", "clipped_triangles"]

SUBPIXELS = 256
"""Steps in a pixel; projected vertices are rounded to a step."""

# Pixels beyond which a triangle is cut, so that edge functions stay within int64. Coordinates within 2^28
# steps give products within 2^59.
_GUARD = float(2**20)


@dataclass(frozen=True)
class Pieces:
    """Triangles ready to be filled: the mesh's triangles after clipping, all of one winding.

    ``a``, ``b`` and ``c`` (3, P) are int64. Row i has the edge function ``a x + b y + c`` of the edge that
    lies opposite corner i, with x and y in whole pixels. Inside the triangle each function is positive. The
    sum of the three is ``area`` (P,), twice the triangle's area. ``low`` and ``high`` (P,) are the first and
    the last scanline of the picture that may have pixels. ``weight`` (3, P) is 1 / W, ``nearness`` (3, P) is
    linear on the screen and larger when nearer.

    ``turned`` (P,) tells which triangles have corners 1 and 2 exchanged. ``corner`` (P, 3, 3) holds each
    corner's barycentric coordinates in the mesh's triangle ``triangle`` (P,). It is ``None`` if no triangle
    was clipped.
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    area: np.ndarray
    low: np.ndarray
    high: np.ndarray
    weight: np.ndarray
    nearness: np.ndarray
    turned: np.ndarray
    corner: np.ndarray | None
    triangle: np.ndarray


def _clip(records: np.ndarray, source: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut triangles by one plane: corners with a negative distance are outside."""
    inside = distance >= 0
    count = inside.sum(axis=1)
    kept = [records[count == 3]]
    kept_source = [source[count == 3]]
    for corners_inside in (1, 2):
        chosen = np.flatnonzero(count == corners_inside)
        # The corner that is alone on its side becomes corner 0. The winding stays.
        odd = (inside[chosen] == (corners_inside == 1)).argmax(axis=1)
        order = (odd[:, np.newaxis] + np.arange(3)) % 3
        first, second, third = np.moveaxis(records[chosen[:, np.newaxis], order], 1, 0)
        d_first, d_second, d_third = distance[chosen[:, np.newaxis], order].T

        # Cuts go from the inside to the outside, so that two triangles cut their shared edge in the same
        # bits.
        def cut(near: np.ndarray, far: np.ndarray, d_near: np.ndarray, d_far: np.ndarray) -> np.ndarray:
            place: np.ndarray = near + (d_near / (d_near - d_far))[:, np.newaxis] * (far - near)
            return place

        if corners_inside == 1:
            pieces = [(first, cut(first, second, d_first, d_second), cut(first, third, d_first, d_third))]
        else:
            towards_second = cut(second, first, d_second, d_first)
            towards_third = cut(third, first, d_third, d_first)
            pieces = [(second, third, towards_third), (second, towards_third, towards_second)]
        for piece in pieces:
            kept.append(np.stack(piece, axis=1))
            kept_source.append(source[chosen])
    return np.concatenate(kept), np.concatenate(kept_source)


def clipped_triangles(
    scene: Scene, candidates: np.ndarray, homogeneous: np.ndarray
) -> tuple[Pieces, np.ndarray, np.ndarray]:
    """Clip, divide and round triangles. Drop triangles without area, and back faces if the scene culls.

    The rounded corners decide whether a face is a back face. So a closed surface has a front wherever it has
    a back.

    Parameters
    ----------
    scene : Scene
        Mesh, camera, size of the picture, and what is done with back faces.
    candidates : int array, shape (T,)
        Triangles of the mesh.
    homogeneous : array, shape (V, 4)
        x, y and W of each vertex in pixels before division, and its depth.

    Returns
    -------
    Pieces
        The triangles to fill.
    int array, int array
        Triangles of the mesh with a part left after clipping, and with an area left after rounding.
    """
    near = scene.camera.near
    vertices = scene.mesh.faces[candidates].T
    x, y, w, depth = corners = np.stack([column[vertices] for column in homogeneous.T])
    beyond = (np.maximum(np.abs(x), np.abs(y)) > _GUARD * w) | (depth < near)
    crossing = beyond[0] | beyond[1] | beyond[2]
    corner = None
    triangle = candidates
    if crossing.any():
        unit = np.broadcast_to(np.eye(3), (len(candidates), 3, 3))
        rows = np.concatenate((corners.transpose(2, 1, 0), unit), axis=-1)
        records, source = _clip(rows[crossing], candidates[crossing], rows[crossing, :, 3] - near)
        for axis in (0, 1):
            for sign in (1, -1):
                records, source = _clip(records, source, _GUARD * records[..., 2] - sign * records[..., axis])
        rows = np.concatenate((rows[~crossing], records))
        triangle = np.concatenate((candidates[~crossing], source))
        order = np.argsort(triangle, kind="stable")
        rows, triangle = rows[order], triangle[order]
        corner = rows[..., 4:]
        x, y, w, depth = rows[..., :4].transpose(2, 1, 0)
    left_over = triangle

    x, y = (np.rint(place / w * SUBPIXELS).astype(np.int64) for place in (x, y))
    area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])
    weight = 1 / w
    nearness = weight if scene.camera.projection == "perspective" else -depth
    solid = area != 0
    # y grows downwards, so an area over 0 is clockwise.
    shown = np.flatnonzero(solid & ~((area > 0) & scene.culls[triangle]))
    turned = area[shown] < 0

    def turn(values: np.ndarray) -> np.ndarray:
        first, second, third = values[:, shown]
        return np.stack((first, np.where(turned, third, second), np.where(turned, second, third)))

    if corner is not None:
        corner = corner[shown]
        corner[turned] = corner[turned][:, [0, 2, 1]]
    x, y = turn(x), turn(y)
    half = SUBPIXELS // 2
    start, end = [1, 2, 0], [2, 0, 1]
    a, b = y[start] - y[end], x[end] - x[start]
    # A pixel centre on a flat lower edge is outside.
    flat = ((a == 0) & (b < 0)).any(axis=0)
    pieces = Pieces(
        a=a * SUBPIXELS,
        b=b * SUBPIXELS,
        c=a * (half - x[start]) + b * (half - y[start]),
        area=np.abs(area[shown]),
        low=np.maximum(-((half - y.min(axis=0)) // SUBPIXELS), 0),
        high=np.minimum((y.max(axis=0) - half - flat) // SUBPIXELS, scene.height - 1),
        weight=turn(weight),
        nearness=turn(nearness),
        turned=turned,
        corner=corner,
        triangle=triangle[shown],
    )
    return pieces, left_over, triangle[solid]
