"""Loisel: half the square of R - E, which is linear between the corners, for a highlight of R·V."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from blysk.golden.reference.reflection import PHONG
from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.bishop_weimer import six_point_values
from blysk.golden.rivals.rival import SurfaceRival, directions_of
from blysk.golden.rivals.triangles import (
    Plane,
    Polynomial,
    ScreenTriangles,
    at_origin,
    dot,
    gradients,
    six_points,
)

__all__ = ["Loisel"]


@dataclass(frozen=True)
class Loisel(SurfaceRival):
    """``u = |R - E|^2 / 2 = 1 - R·V`` of a vector R - E that is linear on the screen between the corners.

    R is the reflected direction of the light, E the direction to the viewer (V here), both unit vectors at
    the corners. So u is exact at the corners alone. Light and viewer may be near. The text gives the
    highlight only. N·L is the best quadratic over a triangle here, that of `six_points`.

    Source: docs/theory/rivals.md#loisel; [Loisel].
    """

    NAME: ClassVar = "loisel"
    TITLE: ClassVar = "Loisel, |R - E|^2 by forward differences"
    REFLECTION: ClassVar = PHONG

    def host(self, scene: Scene, triangles: ScreenTriangles) -> Polynomial:
        """Coefficients, see `SurfaceRival.host`."""
        planes = gradients(triangles)
        lights = len(scene.lights)
        corners, middles = six_point_values(scene, triangles)
        cosines = six_points([of[:lights] for of in corners], [of[:lights] for of in middles], planes)
        vectors = []
        for normal, point, cosine in zip(triangles.normal, triangles.point, corners, strict=True):
            vectors.append(
                [
                    normal * (2 * cosine[k]) - light.towards - light.viewer
                    for k, light in enumerate(directions_of(scene, point))
                ]
            )
        squares = [
            _half_square(at_origin(np.stack(of_light), planes)) for of_light in zip(*vectors, strict=True)
        ]
        c, x, y, xx, xy, yy = (
            np.concatenate([of_cosine, np.stack(of)])
            for of_cosine, of in zip(cosines, zip(*squares, strict=True), strict=True)
        )
        return c, x, y, xx, xy, yy


def _half_square(vector: Plane) -> Polynomial:
    """Half the square of a vector that is linear on the screen."""
    v, x, y = vector
    return (
        dot(v, v) * 0.5,
        dot(v, x),
        dot(v, y),
        dot(x, x) * 0.5,
        dot(x, y),
        dot(y, y) * 0.5,
    )
