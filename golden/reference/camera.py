"""The camera: orthographic or perspective projection from world to pixels, in float64."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light import Triple, triple

__all__ = ["PROJECTIONS", "Camera"]

PROJECTIONS = ("orthographic", "perspective")
"""Names of the projections."""


@dataclass(frozen=True)
class Camera:
    """A camera: position, direction of view, and projection of the world.

    Parameters
    ----------
    position, target : three floats
        Positions of the camera, and of the point in the middle of its picture; they must differ.
    up : three floats
        Direction that is upright in the picture, not 0. If it is parallel to the line of sight, the axis with
        the largest angle to that line is used.
    projection : {"orthographic", "perspective"}
        Kind of projection.
    height : float
        World height of the picture, orthographic only.
    field_of_view : float
        Vertical angle of the picture in degrees, greater than 0 and less than 180, perspective only.
    near : float
        Depth of the near plane, greater than 0. In both projections nearer points are not drawn.

    Raises
    ------
    ValueError
        If a value is out of range.
    """

    position: Triple
    target: Triple
    up: Triple = (0.0, 1.0, 0.0)
    projection: str = "orthographic"
    height: float = 2.0
    field_of_view: float = 30.0
    near: float = 1e-3

    def __post_init__(self) -> None:
        for name in ("position", "target", "up"):
            object.__setattr__(self, name, triple(f"a camera's {name}", getattr(self, name)))
        if self.position == self.target:
            raise ValueError(f"a camera's position and target must differ, not both be {self.position}")
        if not any(self.up):
            raise ValueError("a camera's up must not be 0")
        if self.projection not in PROJECTIONS:
            raise ValueError(f"projection must be one of {', '.join(PROJECTIONS)}, not {self.projection!r}")
        for name in ("height", "near"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"a camera's {name} must be finite and greater than 0, not {value}")
        if not 0 < self.field_of_view < 180:
            raise ValueError(
                f"field_of_view must be greater than 0 and less than 180 degrees, not {self.field_of_view}"
            )

    def scaled(self, shift: int) -> "Camera":
        """The camera for a mesh whose coordinates have been multiplied by ``2**shift``.

        Raises
        ------
        OverflowError
            If the camera is too far away.
        """
        position, target = (
            (math.ldexp(x, shift), math.ldexp(y, shift), math.ldexp(z, shift))
            for x, y, z in (self.position, self.target)
        )
        height, near = (math.ldexp(length, shift) for length in (self.height, self.near))
        return replace(self, position=position, target=target, height=height, near=near)

    @property
    def viewer(self) -> np.ndarray:
        """Unit vector from the target to the camera: the V of the whole frame, in both projections."""
        return normalise(np.subtract(self.position, self.target))

    @property
    def axes(self) -> np.ndarray:
        """Rows right, up and forward of the picture: orthonormal, shape (3, 3)."""
        return _axes(self.viewer, self.up)

    def view(self, points: np.ndarray) -> np.ndarray:
        """Points in the camera's own axes.

        Parameters
        ----------
        points : array, shape (..., 3)
            World coordinates.

        Returns
        -------
        float64 array, shape (..., 3)
            Distances to the right, up, and forward (the depth) of the camera.
        """
        return _rotate(np.asarray(points, dtype=np.float64) - self.position, self.axes)

    def homogeneous(self, points: np.ndarray, width: int, height: int) -> np.ndarray:
        """Homogeneous pixel coordinates, defined for points in front of the camera and behind it.

        Parameters
        ----------
        points : array, shape (..., 3)
            World coordinates.
        width, height : int
            Size of the picture in pixels; pixels are square.

        Returns
        -------
        float64 array, shape (..., 4)
            ``X, Y, W, depth``: the pixel is ``X / W`` to the right of the picture's left edge and ``Y / W``
            below its top edge. So pixel (i, j) has its centre at (i + 1/2, j + 1/2). ``W`` is 1
            (orthographic) or the depth (perspective).
        """
        right, up, depth = np.moveaxis(self.view(points), -1, 0)
        if self.projection == "perspective":
            scale = height / 2 / math.tan(math.radians(self.field_of_view) / 2)
            weight = depth
        else:
            scale = height / self.height
            weight = np.ones_like(depth)
        return np.stack(
            (scale * right + width / 2 * weight, height / 2 * weight - scale * up, weight, depth), axis=-1
        )

    def project(self, points: np.ndarray, width: int, height: int) -> np.ndarray:
        """Pixel coordinates and depth.

        Parameters
        ----------
        points : array, shape (..., 3)
            World coordinates.
        width, height : int
            Size of the picture in pixels.

        Returns
        -------
        float64 array, shape (..., 3)
            ``x`` to the right and ``y`` down from the picture's top left corner, in pixels; depth in world
            units.

        Raises
        ------
        ValueError
            If the camera is a perspective camera and a point is not in front of the camera.
        """
        result = self.homogeneous(points, width, height)
        if not (result[..., 2] > 0).all():
            raise ValueError("points must be in front of a perspective camera")
        return np.concatenate((result[..., :2] / result[..., 2:3], result[..., 3:]), axis=-1)

    @classmethod
    def framing(
        cls,
        vertices: np.ndarray,
        direction: Sequence[float],
        projection: str = "orthographic",
        aspect: float = 4 / 3,
        field_of_view: float = 30.0,
        margin: float = 0.05,
        up: Sequence[float] = (0.0, 1.0, 0.0),
    ) -> "Camera":
        """A camera that looks along ``-direction`` at the middle of the vertices' box and shows all vertices.

        Parameters
        ----------
        vertices : array, shape (V, 3)
            Points that must be in the picture, not all in one place.
        direction : three floats
            Direction from the target to the camera, of any length but 0.
        projection : {"orthographic", "perspective"}
            Kind of projection.
        aspect : float
            Width over height of the picture.
        field_of_view : float
            Vertical angle in degrees, perspective only.
        margin : float
            Share of the picture's width and height that stays free on each side, at least 0, less than 0.5.
        up : three floats
            The direction that is upright in the picture.

        Raises
        ------
        ValueError
            If a value is out of range or the vertices have no extent.
        """
        vertices = np.asarray(vertices, dtype=np.float64)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices):
            raise ValueError(f"vertices must have shape (count, 3) with at least one, not {vertices.shape}")
        if not np.isfinite(vertices).all():
            raise ValueError("vertices must be finite")
        direction = triple("direction", direction)
        up = triple("a camera's up", up)
        if not any(direction):
            raise ValueError("direction must not be 0")
        if not (math.isfinite(aspect) and aspect > 0):
            raise ValueError(f"aspect must be finite and greater than 0, not {aspect}")
        if not 0 <= margin < 0.5:
            raise ValueError(f"margin must be at least 0 and less than 0.5, not {margin}")
        if not 0 < field_of_view < 180:
            raise ValueError(
                f"field_of_view must be greater than 0 and less than 180 degrees, not {field_of_view}"
            )
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        centre = low + (high - low) / 2
        viewer = normalise(direction)
        right, above, depth = np.moveaxis(_rotate(vertices - centre, _axes(viewer, up)), -1, 0)
        towards = -depth
        radius = float(np.linalg.norm(high - low)) / 2
        if radius == 0:
            raise ValueError("vertices must not all be in one place")
        # Half heights of a picture of this aspect that just hold each vertex.
        needed = np.maximum(np.abs(above), np.abs(right) / aspect) / (1 - 2 * margin)
        nearest = float(towards.max())
        if projection == "perspective":
            distance = float((towards + needed / math.tan(math.radians(field_of_view) / 2)).max())
            distance = max(distance, nearest + 0.1 * radius)
        else:
            distance = nearest + radius
        # A flat sheet seen edge-on needs no height at all; the picture then has the sheet's extent.
        height = 2 * float(needed.max()) or 2 * radius
        return cls(
            position=tuple(centre + distance * viewer),
            target=tuple(centre),
            up=up,
            projection=projection,
            height=height,
            field_of_view=field_of_view,
            near=(distance - nearest) / 2,
        )


def _axes(viewer: np.ndarray, up: Sequence[float]) -> np.ndarray:
    forward = -viewer
    upright = normalise(up)
    right = np.cross(forward, upright)
    if np.linalg.norm(right) < 1e-6:
        upright = np.eye(3)[np.abs(forward).argmin()]
        right = np.cross(forward, upright)
    right = normalise(right)
    return np.stack((right, np.cross(right, forward), forward))


def _rotate(vectors: np.ndarray, axes: np.ndarray) -> np.ndarray:
    # The sum is made term by term, not by a matrix product. Equal points must give equal bits at any place in
    # the array. Else two vertices at the same place could open a crack.
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.stack([x * axis[0] + y * axis[1] + z * axis[2] for axis in axes], axis=-1)
