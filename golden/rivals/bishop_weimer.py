"""Bishop and Weimer 1986: quadratics of both cosines over a triangle, with the operand 1 - N·H."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.rival import SurfaceRival, directions_of, middles_of, unit
from blysk.golden.rivals.triangles import (
    Plane,
    Polynomial,
    ScreenTriangles,
    at_origin,
    dot,
    gradients,
    six_points,
)

__all__ = ["BishopWeimer", "six_point_values"]


def six_point_values(scene: Scene, triangles: ScreenTriangles) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Exact N·L, then ``u = |N - H|^2 / 2``, at the corners, and at the middles of the edges on the screen.

    The normals of middles are those of the perspective-correct interpolation.

    Parameters
    ----------
    scene, triangles
        Lights and viewer, and triangles.

    Returns
    -------
    corners, middles : lists of three arrays, shape (2 lights, triangles)
    """
    scaled = [triangles.normal[k] * triangles.weight[k] for k in range(3)]
    normals = [*triangles.normal, *(unit(of) for of in middles_of(scaled))]
    points = list(triangles.point)
    if scene.local:
        at = [triangles.point[k] * triangles.weight[k] for k in range(3)]
        weights = middles_of(list(triangles.weight))
        points += [of / weight for of, weight in zip(middles_of(at), weights, strict=True)]
    else:
        points += points
    found = []
    for normal, point in zip(normals, points, strict=True):
        lights = directions_of(scene, point)
        away = [normal - light.halfway for light in lights]
        values = [dot(normal, light.towards) for light in lights] + [dot(of, of) * 0.5 for of in away]
        found.append(np.stack(values))
    return found[:3], found[3:]


@dataclass(frozen=True)
class BishopWeimer(SurfaceRival):
    """One quadratic of N·L and one of ``u = 1 - N·H`` for a triangle, two additions a pixel each.

    With ``taylor`` they are Taylor's series of the quotients ``v·L/|v|`` and ``v·H/|v|`` at the middle of the
    triangle on the screen, as published. With ``six`` they pass through the exact values at three corners and
    three middles of edges, which is the best form found. Distant lights and a distant viewer only with
    ``taylor``.

    Parameters
    ----------
    form : str
        ``"taylor"`` or ``"six"``.

    Source: docs/theory/rivals.md#bishop-and-weimer; [Bishop86].
    """

    form: Literal["taylor", "six"] = "taylor"

    NAME: ClassVar = "bishop-weimer"
    TITLE: ClassVar = "Bishop and Weimer 1986, with the operand 1 - N·H"

    def host(self, scene: Scene, triangles: ScreenTriangles) -> Polynomial:
        """Coefficients, see `SurfaceRival.host`.

        Raises
        ------
        ValueError
            If the form is ``taylor`` and a light or the viewer is near.
        """
        planes = gradients(triangles)
        if self.form == "six":
            return six_points(*six_point_values(scene, triangles), planes)
        if scene.local:
            raise ValueError("Taylor's series needs distant lights and a distant viewer")
        scaled = np.stack([triangles.normal[k] * triangles.weight[k] for k in range(3)])
        vector = at_origin(scaled, planes)
        i, j = (of[0] + of[1] + of[2] for of in (triangles.x, triangles.y))
        middle = i * (1 / 3), j * (1 / 3)
        lights = directions_of(scene, triangles.point[0])
        series = [_series(vector, light.towards, middle) for light in lights]
        for light in lights:
            c, x, y, xx, xy, yy = _series(vector, light.halfway, middle)
            series.append((1 - c, -x, -y, -xx, -xy, -yy))
        c, x, y, xx, xy, yy = (np.stack(of) for of in zip(*series, strict=True))
        return c, x, y, xx, xy, yy


def _series(vector: Plane, other: np.ndarray, middle: tuple[np.ndarray, np.ndarray]) -> Polynomial:
    """Taylor's series of ``v·o/|v|`` at a place, as a polynomial of i and j from the origin.

    With ``a = v·o`` and ``b = v·v`` there, and ``r = 1/sqrt(b)``.
    """
    i, j = middle
    origin, v_x, v_y = vector
    v = origin + v_x * i + v_y * j
    a, a_x, a_y = dot(v, other), dot(v_x, other), dot(v_y, other)
    # Halves of the derivatives of b.
    b, b_x, b_y = dot(v, v), dot(v, v_x), dot(v, v_y)
    square = 1 / b
    r = np.sqrt(square)
    f, f_x, f_y = a * r, (a_x - a * (b_x * square)) * r, (a_y - a * (b_y * square)) * r
    s_x, s_y = b_x * square, b_y * square
    s_xx, s_xy, s_yy = dot(v_x, v_x) * square, dot(v_x, v_y) * square, dot(v_y, v_y) * square
    xx = (a * (3 * (s_x * s_x) - s_xx) - 2 * (a_x * s_x)) * r * 0.5
    xy = (a * (3 * (s_x * s_y) - s_xy) - a_x * s_y - a_y * s_x) * r
    yy = (a * (3 * (s_y * s_y) - s_yy) - 2 * (a_y * s_y)) * r * 0.5
    return (
        f - f_x * i - f_y * j + xx * (i * i) + xy * (i * j) + yy * (j * j),
        f_x - 2 * (xx * i) - xy * j,
        f_y - 2 * (yy * j) - xy * i,
        xx,
        xy,
        yy,
    )
