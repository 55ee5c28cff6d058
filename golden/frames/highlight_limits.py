"""Highlight limits: tolerances of u for a scene's highlights, and regions without a highlight."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.lobes import curve_lines
from blysk.golden.reference.reflection import COSQUAD, ReflectionModel
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import slope

__all__ = ["HighlightLimits", "highlight_tolerance"]

_TOLERANCE = 0.4
"""Largest error of a specular term in LSB, at the places where a curve is checked."""


def highlight_tolerance(exponent: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Largest error of u that keeps `HighlightLimits.TOLERANCE`, for this u and every larger u.

    The slope ``|dS/du|`` of a term is about n at the peak, and smaller away from the peak. It is ``n (1 - n
    u/2)`` for the cosine-quadratic term, ``n (1 - u)^(n-1)`` for Blinn's power. With ``x = (n - 1) u`` both
    are at most ``n / (1 + x/2 + x^2/4 + x^3/8)``. Slopes of the pipeline's other models are at most 1.25
    times this bound, and 1.6 times for n = 1.

    Parameters
    ----------
    exponent : int array
        n, 1 to 1000.
    u : array
        Least value of u, at least 0.
    """
    x = (np.asarray(exponent) - 1) * u / 2
    found: np.ndarray = _TOLERANCE / (255 * np.asarray(exponent)) * (1 + x * (1 + x * (1 + x)))
    return found


@dataclass(frozen=True)
class _Curve:
    """Highlight limits from the curve S(u) of a lobe, for one parameter; u = 1 - N·H."""

    reflection: ReflectionModel
    parameter: float | None
    scale: int = 0

    @cached_property
    def _points(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Arguments u, ascending; for each u the steepest ``|dS/du|`` and the largest S from this u on."""
        u, value, slopes = curve_lines(self.reflection, self.parameter)
        u, slopes = np.ldexp(u, self.scale), np.ldexp(slopes, -self.scale)
        return u, *(np.maximum.accumulate(of[::-1])[::-1] for of in (slopes, value))

    def _from(self, values: np.ndarray, u: np.ndarray) -> np.ndarray:
        return values[np.clip(np.searchsorted(self._points[0], u, "right") - 1, 0, None)]

    def tolerance(self, u: np.ndarray) -> np.ndarray:
        """Largest error of u that keeps the tolerance, see `HighlightLimits.tolerance`."""
        steepest = np.maximum(self._from(self._points[1], u), 2.0**-self.scale)
        found: np.ndarray = _TOLERANCE / (255 * steepest)
        return found

    @cached_property
    def turn(self) -> float:
        """Angle in radians by which a normal may turn, see `HighlightLimits.turn`."""
        u, _, slopes = curve_lines(self.reflection, self.parameter)
        # A slope belongs to the interval up to the next argument.
        steepest = (np.sqrt(2 * np.append(u[1:], 2.0)) * np.abs(slopes)).max()
        found: float = _TOLERANCE / (255 * max(steepest, 1 / 255))
        return found


@dataclass(frozen=True)
class HighlightLimits:
    """Tolerances of u = 1 - N·H for the highlights of materials.

    They are for methods that find normals. Their curves are checked at some places of a span. For the places
    between, `MARGIN` multiplies the errors, or the ratio of the normals' lengths at the two ends, if this
    ratio is larger. These factors were found by search. With equal lengths the largest error at any t was
    1.31 times the error at 1/4 and 3/4. With lengths in the ratio g it was up to ``1.03 max(4/3, g)`` times.
    From end to end N, V and each light's L change by at most `MAX_VECTOR_ANGLE` degrees. ``|dV| + |dL|`` is
    at most `MAX_HALFWAY_CHANGE` of ``|L + V|``, because H changes fast where L is nearly -V.

    For a polynomial or a power the tolerance of u is `highlight_tolerance`. For a lobe it is `TOLERANCE`,
    divided by the curve's steepest slope from u on.

    These tolerances are errors of linear light. For codes of sRGB every tolerance is divided by the slope of
    the transfer at the least ambient light of the scene. A scene with albedo may be black, with the slope
    12.92.

    ``chord-local`` takes the terms of `reflect`, and has budgets of its own, see `LocalChordInterpolator`.

    Parameters
    ----------
    exponents : float array, shape (materials,)
        Exponent, or `ReflectionModel.steepness`, of each material.
    curves : sequence of _Curve or None
        Curve of each material; ``None`` for a material without a lobe.
    model : ReflectionModel or None
        Model of the highlights; ``None`` without highlights.
    parameters : sequence of float or None
        Exponent or roughness of each material.
    slope : float
        Largest slope of the transfer of the design, by which tolerances are divided.

    Source: docs/theory/chord.md#where-spans-are-cut.
    """

    exponents: np.ndarray
    curves: Sequence[_Curve | None]
    model: ReflectionModel | None
    parameters: Sequence[float | None]
    slope: float = 1.0

    TOLERANCE: ClassVar[float] = _TOLERANCE
    DIFFUSE_TOLERANCE: ClassVar[float] = 0.12 / 255
    MARGIN: ClassVar[float] = 4 / 3
    MAX_VECTOR_ANGLE: ClassVar[float] = 30.0
    MAX_HALFWAY_CHANGE: ClassVar[float] = 0.5
    STEEPEST: ClassVar[float] = 0.77

    @classmethod
    def of(cls, scene: Scene, design: ShadingPipeline | None = None) -> "HighlightLimits":
        """Limits of a scene's materials with the specular unit and the transfer of a design.

        Without a design the exponents give the limits of ``cosquad``, for linear light.
        """
        materials, model = scene.materials, None if design is None else design.specular
        reflection = COSQUAD if design is None else None if model is None else model.reflection
        parameters: list[float | None] = [float(of.exponent) for of in materials]
        exponents = parameters
        if design is not None and design.specular is not None:
            exponents = [design.steepness(material) for material in materials]
            parameters = [design.highlight_parameter(material) for material in materials]
        curves: list[_Curve | None] = [None] * len(materials)
        if design is not None and design.loads_tables:
            lobe = design.lobe
            made = {of: _Curve(lobe.reflection, of, lobe.scale) for of in dict.fromkeys(parameters)}
            curves = [made[of] for of in parameters]
        transfer = "linear" if design is None else design.transfer
        steepest = float(slope(0.0 if scene.has_albedo else _least_light(scene), transfer))
        limits = np.asarray(exponents, dtype=np.float64)
        return cls(limits, tuple(curves), reflection, tuple(parameters), steepest)

    def tolerance(self, material: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Largest error of u that keeps `TOLERANCE`, where no smaller u occurs.

        Parameters
        ----------
        material : int array, shape (pieces,)
            Material of each piece of a span.
        u : array, shape (pieces, lights)
            Least value of u, at least 0.
        """
        return self._of("tolerance", highlight_tolerance, material, u) / self.slope

    def turn(self, material: np.ndarray) -> np.ndarray:
        """Angle in radians by which a normal may turn, for every u.

        It is `TOLERANCE`, divided by the largest ``|dS/dgamma|``. For a
        polynomial or a power this slope is at most `STEEPEST` times ``sqrt n``. For a lobe it is the largest
        ``sqrt(2u) |dS/du|``.

        Parameters
        ----------
        material : int array, shape (pieces,)
            Material of each piece of a span.
        """
        of_material = _TOLERANCE / (255 * self.STEEPEST * np.sqrt(self.exponents))
        for index, curve in enumerate(self.curves):
            if curve is not None:
                of_material[index] = curve.turn
        found: np.ndarray = of_material[material] / self.slope
        return found

    def reflect(self, material: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Specular terms in float64; 0 without highlights.

        Parameters
        ----------
        material : int array, shape (places,)
            Material of each place.
        u : array, shape (places, lights)
            Arguments 1 - N·H; from 0 to 2 after they are limited.
        """
        term, cosine = np.zeros_like(u), 1 - np.clip(u, 0, 2)
        if self.model is not None:
            for index in np.unique(material):
                rows = material == index
                term[rows] = self.model.reflect(cosine[rows], self.parameters[index])
        return term

    def _of(
        self,
        name: str,
        by_exponent: Callable[..., np.ndarray],
        material: np.ndarray,
        u: np.ndarray,
        *settings: float,
    ) -> np.ndarray:
        result = by_exponent(self.exponents[material][:, np.newaxis], u, *settings)
        for curve in dict.fromkeys(self.curves):
            if curve is not None:
                rows = np.array([other is curve for other in self.curves])[material]
                result[rows] = getattr(curve, name)(u[rows], *settings)
        return result


def _least_light(scene: Scene) -> float:
    """The least channel of ambient light and emission of a lit material; 1 if all are unlit."""
    found = [
        float((material.ambient_term(scene.ambient_light) + material.emission).min())
        for material in scene.materials
        if not material.unlit
    ]
    return min(found, default=1.0)
