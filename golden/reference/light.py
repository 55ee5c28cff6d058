"""Directional, point and spot lights, in float64."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.transfer import color_of_text
from blysk.golden.text import numbers_of_text

__all__ = ["Light", "Triple", "color_triple", "triple"]

Triple = tuple[float, float, float]


def triple(
    name: str, value: Sequence[float] | str, least: float = -math.inf, most: float = math.inf
) -> Triple:
    """Three numbers, checked, as finite floats in [least, most].

    A text has commas between the numbers: ``"0,1,0.5"``.

    Parameters
    ----------
    name : str
        Name of the three numbers, for the error's text.
    value : sequence of three numbers, or str
        The numbers.
    least, most : float
        Ends of the range.

    Raises
    ------
    ValueError
        If there are not three numbers, or a number is not finite or out of range. The message has the name.
    """
    return _triple(name, value, numbers_of_text, "three finite numbers", least, most)


def color_triple(
    name: str, value: Sequence[float] | float | str, least: float = 0.0, most: float = math.inf
) -> Triple:
    """A colour as `triple`: three numbers, one number for all channels, or a text of `color_of_text`.

    Parameters
    ----------
    name, least, most
        As for `triple`.
    value : sequence of three numbers, float or str
        The colour.

    Raises
    ------
    ValueError
        If the value is not a colour, or a channel is out of range.
    """
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        value = [value] * 3
    return _triple(name, value, color_of_text, "#rrggbb, one finite number or three", least, most)


def _triple(
    name: str, value: object, read: Callable[[str], list[float]], kind: str, least: float, most: float
) -> Triple:
    try:
        array = np.asarray(read(value) if isinstance(value, str) else value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ValueError(f"{name} must be {kind}, not {value!r}")
    if (array < least).any() or (array > most).any():
        limits = f"at least {least:g}" if math.isinf(most) else f"in {least:g} to {most:g}"
        raise ValueError(f"{name} must be {limits}, not {value!r}")
    return tuple(array.tolist())


@dataclass(frozen=True)
class Light:
    """A directional light, or a point light, which may fade with the distance and outside a cone.

    Parameters
    ----------
    direction : three floats, optional
        Vector *to* the light, of any length but 0, stored as a unit vector. A text may hold the three
        numbers: ``"0,1,0"``.
    color : three floats, float or str
        Intensity I_i, at least 0: three numbers, one number for all channels, or ``"#rrggbb"`` in
        sRGB. Stored as three floats of linear light.
    position : three floats, optional
        Position of a point light, in the mesh's units, in place of ``direction``.
    attenuation : three floats
        ``(k_0, k_1, k_2)`` of a point light, at least 0, see `factor`. ``(1, 0, 0)`` is as bright at every
        distance.
    spot : three floats, optional
        Axis of a spot light's cone, from the light, of any length but 0, stored as a unit vector. ``None``:
        the light shines to all sides.
    cone : two floats, optional
        Inner and outer angle from the axis, in degrees. The light is full up to the inner angle, and 0 from
        the outer angle on. The default for a spot is 20 and 30.

    Raises
    ------
    ValueError
        In one of these cases:

        - a number is not finite;
        - a direction is 0;
        - a channel or a coefficient is negative;
        - direction and position are both given, or both missing;
        - the cone's angles are not ``0 <= inner < outer <= 180``;
        - a directional light has an attenuation or a spot;
        - a cone has no axis.

    Source: docs/theory/models.md#lighting, docs/theory/chord.md#local-lights.
    """

    direction: Triple | None = None
    color: Triple = (1.0, 1.0, 1.0)
    position: Triple | None = None
    attenuation: Triple = (1.0, 0.0, 0.0)
    spot: Triple | None = None
    cone: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if (self.direction is None) == (self.position is None):
            raise ValueError("a light must have either a direction or a position")
        if self.position is not None:
            object.__setattr__(self, "position", triple("a light's position", self.position))
        if self.direction is not None:
            direction = triple("a light's direction", self.direction)
            if not any(direction):
                raise ValueError("a light's direction must not be 0")
            object.__setattr__(self, "direction", tuple(normalise(direction).tolist()))
        object.__setattr__(self, "color", color_triple("a light's color", self.color))
        attenuation = triple("a light's attenuation", self.attenuation, least=0)
        if not any(attenuation):
            raise ValueError("a light's attenuation must not be 0, 0, 0")
        object.__setattr__(self, "attenuation", attenuation)
        self._check_spot()
        if self.position is None and self.fades:
            raise ValueError("a directional light has no distance, attenuation or spot; give it a position")

    def _check_spot(self) -> None:
        """Check and store the axis and angles of a cone."""
        if self.spot is None:
            if self.cone is not None:
                raise ValueError("a light's cone needs the direction of a spot")
            return
        axis = triple("a light's spot", self.spot)
        if not any(axis):
            raise ValueError("a light's spot must not be 0, 0, 0")
        object.__setattr__(self, "spot", tuple(normalise(axis).tolist()))
        inner, outer = (20.0, 30.0) if self.cone is None else map(float, self.cone)
        if not 0 <= inner < outer <= 180:
            raise ValueError(
                f"a light's cone must be inner and outer degrees, 0 <= inner < outer <= 180, not "
                f"{inner:g} and {outer:g}"
            )
        object.__setattr__(self, "cone", (inner, outer))

    @property
    def fades(self) -> bool:
        """Whether the light's factor depends on the place, by an attenuation or a spot."""
        return self.spot is not None or self.attenuation != (1.0, 0.0, 0.0)

    def factor(self, points: np.ndarray | None = None) -> np.ndarray | np.float64:
        """Factor a of the light that reaches points, 0 to 1: factor of the distance times factor of the cone.

        ``a = min(1 / (k_0 + k_1 d + k_2 d^2), 1) s^2 (3 - 2 s)`` with the distance d. s is linear in the
        cosine of the angle from the axis. It is 0 at the outer angle of the cone and 1 at the inner angle,
        and limited to 0 to 1.

        Parameters
        ----------
        points : array, shape (..., 3), optional
            Points. A light that does not fade does not read them.

        Returns
        -------
        float64 array
            Shape () for a light that does not fade, else (...).

        Raises
        ------
        ValueError
            If a light that fades is given no points.
        """
        if not self.fades:
            return np.float64(1)
        towards = self.towards(points)
        # The limit keeps huge distances from overflow.
        distance = np.linalg.norm(np.clip(np.asarray(self.position) - points, -1e100, 1e100), axis=-1)
        k_0, k_1, k_2 = self.attenuation
        with np.errstate(over="ignore"):
            result = 1 / np.maximum(k_0 + distance * (k_1 + distance * k_2), 1.0)
        if self.spot is not None and self.cone is not None:
            inner, outer = np.cos(np.radians(self.cone))
            share = np.clip((-(towards @ np.asarray(self.spot)) - outer) / (inner - outer), 0, 1)
            result = result * share**2 * (3 - 2 * share)
        found: np.ndarray | np.float64 = result
        return found

    @property
    def is_local(self) -> bool:
        """Whether L differs from point to point."""
        return self.position is not None

    def turned(self, turn: Callable[[Triple], np.ndarray]) -> "Light":
        """A directional light with its direction turned. A point light stays unchanged.

        Parameters
        ----------
        turn : callable
            Gives the turned vector of a vector.
        """
        if self.direction is None:
            return self
        return replace(self, direction=tuple(turn(self.direction).tolist()))

    def scaled(self, shift: int) -> "Light":
        """The light for a mesh whose coordinates have been multiplied by ``2**shift``.

        A position is also multiplied by this power of two. ``k_1 d`` and ``k_2 d^2`` stay.

        Raises
        ------
        OverflowError
            If the position is too far away.
        """
        if self.position is None:
            return self
        with np.errstate(over="ignore", under="ignore"):
            attenuation = np.ldexp(self.attenuation, [0, -shift, -2 * shift])
        limited = tuple(np.minimum(attenuation, 1e300).tolist()) if attenuation.any() else (1.0, 0.0, 0.0)
        x, y, z = (math.ldexp(place, shift) for place in self.position)
        return replace(self, position=(x, y, z), attenuation=limited)

    @property
    def is_on(self) -> bool:
        """Whether the light's colour is not 0."""
        return any(self.color)

    def towards(self, points: np.ndarray | None = None) -> np.ndarray:
        """Unit vectors L from points of the surface to the light. L is 0 where a point light is at the point.

        Parameters
        ----------
        points : array, shape (..., 3), optional
            Points; a directional light does not read them.

        Returns
        -------
        float64 array
            Shape (3,) for a directional light, else the shape of the points.

        Raises
        ------
        ValueError
            If a point light is given no points.
        """
        if self.position is None:
            return np.array(self.direction)
        if points is None:
            raise ValueError("a point light needs the points that it lights")
        return normalise(np.asarray(self.position) - points)
