"""Measured lobes: published fits of measured materials, in float64."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from types import MappingProxyType

import numpy as np

from blysk.golden.reference.lobes import TabulatedModel

__all__ = ["MEASURED", "AbcFit"]

_SOURCE = "Low 2012, MERL"


def _abc(cosine: np.ndarray, b: float, c: float) -> np.ndarray:
    found: np.ndarray = (1 + b * (1 - cosine)) ** -c
    return found


@dataclass(frozen=True)
class AbcFit:
    """The microfacet ABC model with the parameters of a measured material.

    With ``u = 1 - N·H`` the fit, times pi, is

    ``k_D + F A (1 + B u)^-C G / (N·L N·V)``

    F is Fresnel's reflectance of a dielectric for unpolarised light, at the angle between L and H. G is the
    masking of Cook and Torrance, ``min(1, 2 N·H N·V / V·H, 2 N·H N·L / V·H)``. The colours are linear light.

    Parameters
    ----------
    diffuse : tuple of float
        k_D, red, green and blue.
    peak : tuple of float
        A, red, green and blue.
    b, c : float
        B and C.
    index : float
        Refractive index of F.

    Source: docs/theory/measured.md; J. Löw, J. Kronander, A. Ynnerman, J. Unger, *BRDF models for accurate
    and efficient rendering of glossy surfaces*, 2012; W. Matusik and others, *A data-driven reflectance
    model*, 2003.
    """

    diffuse: tuple[float, float, float]
    peak: tuple[float, float, float]
    b: float
    c: float
    index: float

    def lobe(self, name: str) -> TabulatedModel:
        """The part that depends on N·H alone, ``(1 + B u)^-C``, as a reflection model.

        Parameters
        ----------
        name : str
            Name of the model.
        """
        return TabulatedModel(name, _SOURCE, function=partial(_abc, b=self.b, c=self.c))

    @cached_property
    def facing(self) -> float:
        """F of light along H, ``((index - 1) / (index + 1))^2``."""
        return ((self.index - 1) / (self.index + 1)) ** 2

    def fresnel(self, cosine: np.ndarray) -> np.ndarray:
        """F at the cosine between L and H, 0 to 1; float64 array of the same shape."""
        g = np.sqrt(self.index**2 - 1 + cosine**2)
        ratio = (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
        found: np.ndarray = ((g - cosine) / (g + cosine)) ** 2 * (1 + ratio**2) / 2
        return found

    @property
    def exposure(self) -> float:
        """Brightness of a light for which the largest channel of `coefficients` sums to 1."""
        return 1 / max(d + self.facing * a for d, a in zip(self.diffuse, self.peak, strict=True))

    @property
    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """k_d and k_s of the material under a white light of brightness 1: k_D and ``F A``, times `exposure`.

        F is for light along H.
        """
        diffuse, peak = np.array(self.diffuse), np.array(self.peak)
        return self.exposure * diffuse, self.exposure * self.facing * peak

    def light(self, normal: np.ndarray, direction: np.ndarray, viewer: np.ndarray) -> np.ndarray:
        """Light of the whole fit, with F and G; times `exposure`.

        Parameters
        ----------
        normal, direction, viewer : float64 arrays, shape (count, 3)
            N, L and V, of unit length.

        Returns
        -------
        float64 array, shape (count, 3)
            0 where N·L or N·V is not positive.
        """
        halfway = direction + viewer
        halfway = halfway / np.linalg.norm(halfway, axis=1, keepdims=True)
        pairs = ((normal, direction), (normal, viewer), (normal, halfway), (viewer, halfway))
        lit, seen, facing, half = (np.einsum("ij,ij->i", *pair) for pair in pairs)
        front = (lit > 0) & (seen > 0)
        seen, half = np.where(front, seen, 1.0), np.maximum(half, 1e-300)
        masking = np.minimum(1, 2 * facing * np.minimum(seen, lit) / half)
        term = self.fresnel(half) * _abc(np.clip(facing, 0, 1), self.b, self.c) * masking / seen
        total = np.multiply.outer(lit, self.diffuse) + np.multiply.outer(term, self.peak)
        return np.where(front[:, np.newaxis], self.exposure * total, 0.0)


MEASURED: Mapping[str, AbcFit] = MappingProxyType(
    {
        "alum-bronze": AbcFit(
            (0.024514, 0.022346, 0.016220),
            (51.714554, 37.932693, 27.373095),
            10482.133789,
            0.816737,
            2.236525,
        ),
        "blue-metallic-paint": AbcFit(
            (0.003770, 0.001030, 0.009177), (0.495104, 0.469843, 1.097868), 48.572060, 1.702520, 9.024582
        ),
        "gold-paint": AbcFit(
            (0.150463, 0.080224, 0.022239), (1.010258, 0.811582, 0.504538), 46.942558, 1.756670, 7.936110
        ),
        "nickel": AbcFit(
            (0.006227, 0.006663, 0.007587), (36.614742, 32.745403, 28.906111), 705.733887, 1.945258, 5.441883
        ),
        "pvc": AbcFit(
            (0.030285, 0.033992, 0.038152), (40.608692, 39.046635, 37.916531), 2901.928223, 1.203405, 1.407985
        ),
        "red-plastic": AbcFit(
            (0.268000, 0.044432, 0.010675), (1.081538, 1.045352, 1.037089), 34.117554, 1.529797, 1.666450
        ),
    }
)
"""Fits of materials of the MERL database, by the database's names.

Source: docs/theory/measured.md#materials.
"""
