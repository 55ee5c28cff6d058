"""Highlight limits: tolerances of u for a scene's highlights, and regions without a highlight."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.lobes import curve_lines
from blysk.golden.reference.reflection import ReflectionModel
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import slope

__all__ = ["HighlightLimits"]


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
        """Largest error of u that keeps the budget, see `HighlightLimits.tolerance`."""
        steepest = np.maximum(self._from(self._points[1], u), 2.0**-self.scale)
        found: np.ndarray = LocalChordInterpolator.HIGHLIGHT_BUDGET / (255 * steepest)
        return found

    @cached_property
    def turn(self) -> float:
        """Angle in radians by which a normal may turn, see `HighlightLimits.turn`."""
        u, _, slopes = curve_lines(self.reflection, self.parameter)
        # A slope belongs to the interval up to the next argument.
        steepest = (np.sqrt(2 * np.append(u[1:], 2.0)) * np.abs(slopes)).max()
        found: float = LocalChordInterpolator.HIGHLIGHT_BUDGET / (255 * max(steepest, 1 / 255))
        return found

    def is_lit(self, u: np.ndarray, least: float) -> np.ndarray:
        """Whether a highlight may be over ``least``, for this u or any larger u."""
        return (self._from(self._points[2], u) > least) & (u < 1)


@dataclass(frozen=True)
class HighlightLimits:
    """Tolerances of u = 1 - N·H for the highlights of materials.

    For a polynomial or a power the tolerance follows from the exponent, as in `LocalChordInterpolator`. For a
    lobe it is `LocalChordInterpolator.HIGHLIGHT_BUDGET`, divided by the curve's steepest slope from u on.

    These budgets are errors of linear light. For codes of sRGB every tolerance is divided by the slope of the
    transfer at the least ambient light of the scene. A scene with albedo may be black, with the slope 12.92.

    Parameters
    ----------
    exponents : float array, shape (materials,)
        Exponent, or `ReflectionModel.steepness`, of each material.
    curves : sequence of _Curve or None
        Curve of each material; ``None`` for a material without a lobe.
    slope : float
        Largest slope of the transfer of the design, by which tolerances are divided.

    Source: docs/theory/chord.md#where-spans-are-cut.
    """

    exponents: np.ndarray
    curves: Sequence[_Curve | None]
    slope: float = 1.0

    STEEPEST: ClassVar[float] = 0.77

    @classmethod
    def of(cls, scene: Scene, design: ShadingPipeline | None = None) -> "HighlightLimits":
        """Limits of a scene's materials with the specular unit and the transfer of a design.

        Without a design the exponents give the limits, for linear light.
        """
        materials = scene.materials
        if design is None or design.specular is None:
            exponents = [float(material.exponent) for material in materials]
        else:
            exponents = [design.steepness(material) for material in materials]
        curves: list[_Curve | None] = [None] * len(materials)
        if design is not None and design.loads_tables:
            lobe = design.lobe
            made: dict[float | None, _Curve] = {}
            for index, material in enumerate(materials):
                parameter = design.highlight_parameter(material)
                if parameter not in made:
                    made[parameter] = _Curve(lobe.reflection, parameter, lobe.scale)
                curves[index] = made[parameter]
        transfer = "linear" if design is None else design.transfer
        steepest = float(slope(0.0 if scene.has_albedo else _least_light(scene), transfer))
        return cls(np.asarray(exponents, dtype=np.float64), tuple(curves), steepest)

    def tolerance(self, material: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Largest error of u that keeps `LocalChordInterpolator.HIGHLIGHT_BUDGET`, where no smaller u occurs.

        Parameters
        ----------
        material : int array, shape (pieces,)
            Material of each piece of a span.
        u : array, shape (pieces, lights)
            Least value of u, at least 0.
        """
        return self._of("tolerance", LocalChordInterpolator().highlight_tolerance, material, u) / self.slope

    def turn(self, material: np.ndarray) -> np.ndarray:
        """Angle in radians by which a normal may turn, for every u.

        It is `LocalChordInterpolator.HIGHLIGHT_BUDGET`, divided by the largest ``|dS/dgamma|``. For a
        polynomial or a power this slope is at most `STEEPEST` times ``sqrt n``. For a lobe it is the largest
        ``sqrt(2u) |dS/du|``.

        Parameters
        ----------
        material : int array, shape (pieces,)
            Material of each piece of a span.
        """
        of_material = LocalChordInterpolator.HIGHLIGHT_BUDGET / (
            255 * self.STEEPEST * np.sqrt(self.exponents)
        )
        for index, curve in enumerate(self.curves):
            if curve is not None:
                of_material[index] = curve.turn
        found: np.ndarray = of_material[material] / self.slope
        return found

    def is_lit(self, material: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Whether a highlight may be over a quarter of an LSB, for this u or any larger u.

        Parameters are those of `tolerance`.
        """
        return self._of("is_lit", LocalChordInterpolator.is_lit, material, u, 1 / (1020 * self.slope))

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
