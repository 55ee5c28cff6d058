"""The frame of a light: H along z, L and V in the xz plane, where highlights are quotients of quadratics."""

from typing import NamedTuple

import numpy as np

from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.scene import Scene

__all__ = ["LightFrame", "light_frame", "light_frames", "squared_sine"]


class LightFrame(NamedTuple):
    """Axes of a frame in which ``L = (sin a, 0, cos a)`` and ``V = (-sin a, 0, cos a)``.

    Parameters
    ----------
    axes : float64 array, shape (3, 3)
        Rows x, y, z: unit vectors in the scene's frame, right-handed. ``vector @ axes.T`` turns vectors.
    sine, cosine : float
        sin a and cos a, both at least 0; ``2 a`` is the angle between L and V.
    """

    axes: np.ndarray
    sine: float
    cosine: float

    @property
    def direction(self) -> np.ndarray:
        """L in this frame, shape (3,)."""
        return np.array([self.sine, 0.0, self.cosine])

    def axes_for(self, highlights: bool) -> np.ndarray:
        """`axes`; without highlights x and y across L, z along L."""
        if highlights:
            return self.axes
        x, y, z = self.axes
        return np.stack([self.cosine * x - self.sine * z, y, self.sine * x + self.cosine * z])


def light_frame(direction: np.ndarray, viewer: np.ndarray) -> LightFrame:
    """Frame of a light and a viewer, both at infinity.

    z is ``H = (L + V)/|L + V|``, x is ``(L - V)/|L - V|``, y completes the frame. They are the axes of the
    quadratic form ``R·V`` of the normal. If ``L = V``, any x across z serves. If ``L = -V``, there is no H.
    Then x is L, ``cos a`` is 0, and any z across x serves.

    Parameters
    ----------
    direction, viewer : float64 arrays, shape (3,)
        Unit vectors L and V.

    Source: docs/theory/quotient.md#frame.
    """
    direction, viewer = (np.asarray(vector, dtype=np.float64) for vector in (direction, viewer))
    total, difference = direction + viewer, direction - viewer
    cosine, sine = (float(np.linalg.norm(vector)) / 2 for vector in (total, difference))
    # The longer of sum and difference is exact up to rounding. The shorter is made perpendicular to the
    # longer.
    if cosine >= sine:
        z = normalise(total)
        x = _across(difference, z)
    else:
        x = normalise(difference)
        z = _across(total, x)
    return LightFrame(np.stack([x, np.cross(z, x), z]), sine, cosine)


def _across(vector: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Unit vector perpendicular to a unit vector. It is along ``vector`` as far as rounding allows."""
    across = vector - (vector @ axis) * axis
    if np.linalg.norm(across) < 1e-12:
        other = np.eye(3)[np.abs(axis).argmin()]
        across = other - (other @ axis) * axis
    return normalise(across)


def squared_sine(vector: np.ndarray, frame: LightFrame, mirror: bool = False) -> np.ndarray:
    """Squared sine of the highlight angle from vectors of any length, as an exact quotient.

    ``sin^2 gamma = (x^2 + y^2)/q`` with ``cos gamma = N·H``. With ``mirror`` it is the squared sine of half
    the angle: ``sin^2 (gamma/2) = (x^2 + cos^2 a y^2)/q`` with ``cos gamma = R·V``. In both
    ``q = x^2 + y^2 + z^2``.

    Parameters
    ----------
    vector : float64 array, shape (..., 3)
        Vectors along the normal in the frame of the light, not 0.
    frame : LightFrame
        The frame.
    mirror : bool
        Whether gamma is the angle between R and V, in place of the angle between N and H.

    Source: docs/theory/quotient.md#identities.
    """
    x, y, z = (np.square(component) for component in np.moveaxis(np.asarray(vector, np.float64), -1, 0))
    found: np.ndarray = (x + (frame.cosine**2 * y if mirror else y)) / (x + y + z)
    return found


def light_frames(scene: Scene, lights: int) -> list[LightFrame]:
    """Frames of a pipeline's lights. A light that the scene lacks has the frame of the viewer."""
    viewer = scene.camera.viewer
    directions = [np.asarray(light.direction) for light in scene.lights] + [viewer] * lights
    return [light_frame(direction, viewer) for direction in directions[:lights]]
