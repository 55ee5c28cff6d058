"""A material, and the intensity that a normal gives under lights, in float64."""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light import Light, Triple, color_triple, triple
from blysk.golden.reference.lobes import (
    LEAST_ROUGHNESS,
    checked_roughness,
    exponent_of_roughness,
    roughness_of_exponent,
)
from blysk.golden.reference.reflection import ReflectionModel
from blysk.golden.reference.texture import Texture

__all__ = [
    "Light",
    "Material",
    "distant_cosine",
    "gram_determinant",
    "halfway_vector",
    "intensity",
    "intensity_of_cosines",
    "saturate",
    "schlick",
]


def schlick(f0: ArrayLike, cosine: ArrayLike) -> np.ndarray:
    """Schlick's form of Fresnel's reflection: ``F = F_0 + (1 - F_0)(1 - V·H)^5``.

    Parameters
    ----------
    f0 : array
        F_0, the reflection along the normal, 0 to 1.
    cosine : array
        V·H, 0 to 1.

    Returns
    -------
    float64 array
        F, in the broadcast shape of both.

    Notes
    -----
    Source: docs/theory/models.md#reflection-models; [Schlick94b] 24.
    """
    f0 = np.asarray(f0, dtype=np.float64)
    return f0 + (1 - f0) * (1 - np.asarray(cosine, dtype=np.float64)) ** 5


@dataclass(frozen=True)
class Material:
    """Reflection coefficients of a surface.

    Parameters
    ----------
    ambient, diffuse, specular : three floats, float or str, each
        k_a, k_d, k_s, at least 0: three numbers, one number for all channels, or ``"#rrggbb"`` in sRGB.
        Stored as three floats of linear light. Their sum may exceed 1: the intensity saturates.
    exponent : int
        Exponent n of the highlight, 1 to 1000.
    roughness : float, optional
        Roughness r of microfacets, greater than 0 and at most 1. By default it follows from the exponent, see
        `lobes.roughness_of_exponent`.
    fresnel : three floats, float or str, optional
        F_0, a colour in the same forms, 0 to 1. `schlick` multiplies k_s, see `reflection`. ``None``: k_s
        stays.
    two_sided : bool
        Whether back faces of this material are drawn, with negated normals, in a scene that leaves out back
        faces.
    texture : Texture, optional
        Image that multiplies ambient and diffuse reflection, by the mesh's texture coordinates.
    emission : three floats, float or str
        Light that the surface adds by itself, at least 0, in the same forms.
    tinted : bool
        Whether texture and vertex colours multiply specular reflection, too, as of metals.
    unlit : bool
        Whether the surface shows ``diffuse``, times texture and vertex colours, whatever the lights. Then
        there is no ambient, diffuse or specular light.
    alpha : float
        Alpha of the surface, 0 to 1. It multiplies alpha of the texture and of the vertices, and counts only
        with a cutoff.
    cutoff : float, optional
        Least alpha that is drawn, at least 0. A pixel with a smaller alpha is dropped before the depth test,
        see `dropped_fragments`. ``None``: all pixels are drawn.

    Raises
    ------
    ValueError
        If a coefficient is negative or not finite, or the exponent, the roughness, the alpha or the cutoff is
        out of range.
    TypeError
        If the exponent is not an integer.
    """

    ambient: Triple
    diffuse: Triple
    specular: Triple
    exponent: int
    roughness: float | None = None
    fresnel: Triple | None = None
    two_sided: bool = False
    texture: Texture | None = None
    emission: Triple = (0.0, 0.0, 0.0)
    tinted: bool = False
    unlit: bool = False
    alpha: float = 1.0
    cutoff: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "alpha", float(self.alpha))
        if not 0 <= self.alpha <= 1:
            raise ValueError(f"a material's alpha must be in 0 to 1, not {self.alpha}")
        if self.cutoff is not None and not 0 <= self.cutoff < math.inf:
            raise ValueError(f"a material's cutoff must be a finite number of at least 0, not {self.cutoff}")
        for name in ("ambient", "diffuse", "specular", "emission"):
            object.__setattr__(self, name, color_triple(f"a material's {name}", getattr(self, name)))
        object.__setattr__(self, "exponent", operator.index(self.exponent))
        if not 1 <= self.exponent <= 1000:
            raise ValueError(f"a material's exponent must be in 1 to 1000, not {self.exponent}")
        if self.roughness is not None:
            object.__setattr__(self, "roughness", checked_roughness(self.roughness))
        if self.fresnel is not None:
            object.__setattr__(self, "fresnel", color_triple("a material's fresnel", self.fresnel, 0, 1))

    @classmethod
    def of_metallic_roughness(
        cls, base: Sequence[float], metallic: float, roughness: float, ambient: float = 0.1
    ) -> "Material":
        """Material of glTF's base colour, metallic and roughness factors.

        ``k_d = (1 - metallic) base``; ``F_0 = 0.04 (1 - metallic) + metallic base`` for `schlick`; the
        exponent follows from the roughness, rounded and limited to 1 to 1000. `LEAST_ROUGHNESS` replaces a
        smaller roughness, so that the error of a lobe's table stays small.

        With ``alpha = roughness^2``, k_s is ``1/(4 alpha^2)``. This is the factor of F in the ratio of glTF's
        specular term at its peak, ``F D / 4`` with ``D = 1/(pi alpha^2)``, and diffuse term, ``k_d / pi``. A
        highlight brighter than the picture's white would only become wider, and its errors larger: k_s is at
        most 1 over the largest channel of F_0, and at most 4.

        Parameters
        ----------
        base : three floats
            Linear base colour, 0 to 1 a channel.
        metallic, roughness : float
            Factors, 0 to 1.
        ambient : float
            k_a, as a share of the base colour.

        Raises
        ------
        ValueError
            If a value is out of range.

        Notes
        -----
        Source: docs/theory/models.md#reflection-models; glTF 2.0, appendix B.
        """
        color = np.array(triple("a base colour", base, 0, 1))
        for name, value in (("metallic", metallic), ("roughness", roughness)):
            if not 0 <= value <= 1:
                raise ValueError(f"{name} must be 0 to 1, not {value}")
        f0 = 0.04 * (1 - metallic) + metallic * color
        return cls._of_roughness(ambient * color, (1 - metallic) * color, f0, roughness)

    @classmethod
    def of_specular_glossiness(
        cls, diffuse: Sequence[float], specular: Sequence[float], glossiness: float, ambient: float = 0.1
    ) -> "Material":
        """Material of the factors of glTF's extension KHR_materials_pbrSpecularGlossiness.

        ``F_0 = specular``, ``k_d = (1 - max(F_0)) diffuse``, and the roughness is ``1 - glossiness``. The
        rest follows as in `of_metallic_roughness`.

        Parameters
        ----------
        diffuse, specular : three floats
            Linear colours, 0 to 1 a channel.
        glossiness : float
            Factor, 0 to 1.
        ambient : float
            k_a, as a share of ``k_d + F_0``, of 1 at most.

        Raises
        ------
        ValueError
            If a value is out of range.

        Notes
        -----
        Source: docs/theory/models.md#reflection-models; KHR_materials_pbrSpecularGlossiness.
        """
        f0 = np.array(triple("a specular colour", specular, 0, 1))
        color = (1 - f0.max()) * np.array(triple("a diffuse colour", diffuse, 0, 1))
        if not 0 <= glossiness <= 1:
            raise ValueError(f"glossiness must be 0 to 1, not {glossiness}")
        return cls._of_roughness(ambient * np.minimum(color + f0, 1), color, f0, 1 - glossiness)

    @classmethod
    def _of_roughness(
        cls, ambient: np.ndarray, diffuse: np.ndarray, f0: np.ndarray, roughness: float
    ) -> "Material":
        """Material of k_a, k_d and F_0; k_s and the exponent follow."""
        roughness = max(float(roughness), LEAST_ROUGHNESS)
        exponent = round(min(max(exponent_of_roughness(roughness), 1), 1000))
        peak = min(1 / (4 * roughness**4), 1 / max(f0.max(), 0.25))
        return cls(tuple(ambient), tuple(diffuse), (peak,) * 3, exponent, roughness, tuple(f0))

    def reflection(self, cosine: float | None = None) -> np.ndarray:
        """k_s with Fresnel's reflection: ``k_s F``, or k_s where there is no ``fresnel``; shape (3,).

        Parameters
        ----------
        cosine : float, optional
            V·H of a light, a constant of the frame if light and viewer are distant. ``None``: V·H changes
            from point to point, and F is F_0, its value at V·H = 1.
        """
        if self.fresnel is None:
            return np.array(self.specular)
        found: np.ndarray = np.array(self.specular) * schlick(self.fresnel, 1.0 if cosine is None else cosine)
        return found

    def ambient_term(self, ambient_light: Sequence[float]) -> np.ndarray:
        """Light without a direction: ``k_a I_a``, or k_d of a surface that is unlit; shape (3,)."""
        if self.unlit:
            return np.array(self.diffuse)
        found: np.ndarray = np.multiply(self.ambient, ambient_light)
        return found

    def parameter(self, model: ReflectionModel) -> float | None:
        """Exponent or roughness, as `ReflectionModel.PARAMETER` of a model says; ``None`` if it has none."""
        if model.PARAMETER == "roughness" and self.roughness is None:
            return roughness_of_exponent(self.exponent)
        return None if model.PARAMETER is None else getattr(self, model.PARAMETER)


def halfway_vector(light_direction: ArrayLike, viewer: ArrayLike) -> np.ndarray:
    """Unit half-way vectors ``H = (L + V) / |L + V|``, or zeros when ``L = -V`` ([B] 3).

    Parameters
    ----------
    light_direction, viewer : arrays, shape (..., 3)
        Unit vectors L and V, broadcast.

    Returns
    -------
    float64 array, shape (..., 3)
        H. Where ``|L + V|`` is at most 1e-9 the sum is rounding noise and H is zeros.
    """
    total = np.asarray(light_direction, dtype=np.float64) + np.asarray(viewer, dtype=np.float64)
    return np.where(np.linalg.norm(total, axis=-1, keepdims=True) > 1e-9, normalise(total), 0.0)


def distant_cosine(light: Light, viewer: ArrayLike | None) -> float | None:
    """V·H of a distant light and viewer, 0 where ``L = -V``; ``None`` if the light or the viewer is near.

    Parameters
    ----------
    light : Light
        Directional, or a point light.
    viewer : array, shape (3,), or None
        Unit vector V to a distant viewer.
    """
    if light.is_local or viewer is None:
        return None
    return float(np.clip(halfway_vector(np.asarray(light.direction), viewer) @ np.asarray(viewer), 0, 1))


def gram_determinant(normal: np.ndarray, light_direction: np.ndarray, viewer: np.ndarray) -> np.ndarray:
    """Gram determinant of three unit vectors from their cosines alone ([P]).

    ``1 - (N·V)^2 - (L·N)^2 - (L·V)^2 + 2 (L·N)(N·V)(L·V)``, which equals ``((L x N)·V)^2``: 0 exactly
    when the vectors are coplanar.

    Parameters
    ----------
    normal, light_direction, viewer : arrays, shape (..., 3)
        Unit vectors.

    Returns
    -------
    float64 array, shape (...)
    """
    nv = (np.asarray(normal) * viewer).sum(axis=-1)
    ln = (np.asarray(light_direction) * normal).sum(axis=-1)
    lv = (np.asarray(light_direction) * viewer).sum(axis=-1)
    found: np.ndarray = 1 - nv**2 - ln**2 - lv**2 + 2 * ln * nv * lv
    return found


def intensity(
    normals: np.ndarray,
    material: Material,
    lights: Sequence[Light],
    ambient_light: Sequence[float],
    viewer: ArrayLike,
    model: ReflectionModel,
    chord: bool = False,
    points: np.ndarray | None = None,
    albedo: ArrayLike | None = None,
) -> np.ndarray:
    """Intensity of every normal, not saturated.

    ``I = k_a I_a + sum_i a_i I_i (k_d max(N·L_i, 0) + k_s S(gamma_i))`` ([B] 4 and 5, [T] 6), where a_i is
    `Light.factor`. The cosine of a mirror model, such as Phong's, is R·V with ``R = 2 (N·L) N - L``. The
    cosine of the other models is N·H. k_s is `Material.reflection` at the V·H of a distant light and viewer.

    - The albedo multiplies ambient and diffuse light. It multiplies specular light of a tinted material, too.
    - The emission is added.
    - The light of an unlit material is k_d.
    - A light with ``N·L <= 0`` has neither diffuse nor specular term.
    - A light with ``L = -V`` has no half-way vector. It has a specular term only by a mirror model.
    - A point light has no terms at the point where it is.

    Parameters
    ----------
    normals : array, shape (..., 3)
        Normals, used as given: they are not normalised.
    material : Material
        The coefficients.
    lights : sequence of Light
        Any number of lights.
    ambient_light : three floats
        I_a of each channel.
    viewer : array, shape (3,) or (..., 3)
        Unit vector V to the viewer, constant over the frame or for each normal.
    model : ReflectionModel
        Reflection model.
    chord : bool
        Whether ``1 - |N - H|^2 / 2`` takes the place of N·H, which it equals for unit normals
        (docs/theory/chord.md#the-chord).
    points : array, shape (..., 3), optional
        Position of each normal; needed for point lights only.
    albedo : array, shape (..., 3), optional
        Albedo of each normal; ``None``: white.

    Returns
    -------
    float64 array, shape (..., 3)

    Raises
    ------
    ValueError
        If a point light has no points.

    Source: docs/theory/textures.md.
    """
    normals = np.asarray(normals, dtype=np.float64)
    viewer = np.asarray(viewer, dtype=np.float64)
    sums = _Sums(material, ambient_light, normals.shape, albedo)
    for light in () if material.unlit else lights:
        direction = light.towards(points)
        cosine = _dot(normals, direction)
        halfway = halfway_vector(direction, viewer)
        has_highlight = np.True_ if model.MIRROR else halfway.any(axis=-1)
        if not (has_highlight.any() and any(material.specular)):
            highlight_cosine = None
        elif model.MIRROR:
            highlight_cosine = 2 * cosine * _dot(normals, viewer) - _dot(direction, viewer)
        elif chord:
            highlight_cosine = 1 - np.square(normals - halfway).sum(axis=-1) / 2
        else:
            highlight_cosine = _dot(normals, halfway)
        constant = distant_cosine(light, viewer if viewer.ndim == 1 else None)
        specular = light.color * material.reflection(constant)
        factor = light.factor(points)
        given = cosine * factor, highlight_cosine, factor
        sums.add(light, np.asarray(specular), *given, has_highlight, model)
    return sums.intensity


def intensity_of_cosines(
    material: Material,
    lights: Sequence[Light],
    ambient_light: Sequence[float],
    cosine: np.ndarray,
    highlight_cosine: np.ndarray,
    model: ReflectionModel,
    viewer: ArrayLike | None = None,
    factor: np.ndarray | None = None,
    albedo: ArrayLike | None = None,
) -> np.ndarray:
    """Intensity as by `intensity`, from the cosines of a method without normals.

    Parameters
    ----------
    material, lights, ambient_light, model
        As for `intensity`. Only colours of lights are read, and their directions for Fresnel's reflection.
    cosine, highlight_cosine : arrays, shape (..., lights)
        N·L, which contains the factor of a light that fades, and N·H.
    viewer : array, shape (3,), optional
        Unit vector V to a distant viewer, for Fresnel's reflection.
    factor : array, shape (..., lights), optional
        Factor of each light; ``None``: 1.
    albedo : array, shape (..., 3), optional
        As for `intensity`.

    Returns
    -------
    float64 array, shape (..., 3)
    """
    sums = _Sums(material, ambient_light, (*np.shape(cosine)[:-1], 3), albedo)
    for index, light in enumerate(() if material.unlit else lights):
        given = cosine[..., index], highlight_cosine[..., index]
        specular = light.color * material.reflection(distant_cosine(light, viewer))
        own = np.float64(1) if factor is None else factor[..., index]
        sums.add(light, np.asarray(specular), *given, own, np.True_, model)
    return sums.intensity


def _dot(vectors: np.ndarray, others: np.ndarray) -> np.ndarray:
    found: np.ndarray = vectors @ others if others.ndim == 1 else np.einsum("...i,...i->...", vectors, others)
    return found


class _Sums:
    """Sum of the light that an albedo multiplies, and sum of the other light."""

    def __init__(
        self,
        material: Material,
        ambient_light: Sequence[float],
        shape: Sequence[int],
        albedo: ArrayLike | None,
    ):
        self.material = material
        self.albedo = None if albedo is None else np.asarray(albedo, dtype=np.float64)
        self.total = np.empty(shape)
        self.total[...] = material.ambient_term(ambient_light)
        self.gloss = self.total if albedo is None or material.tinted else np.zeros(shape)

    def add(
        self,
        light: Light,
        specular: np.ndarray,
        cosine: np.ndarray,
        highlight_cosine: np.ndarray | None,
        factor: np.ndarray | np.float64,
        has_highlight: np.ndarray | np.bool_,
        model: ReflectionModel,
    ) -> None:
        """Add both terms of a light; without a cosine of the highlight, the diffuse term alone.

        The factor multiplies the specular term here. N·L contains the factor already.
        """
        color = np.asarray(light.color)
        self.total += np.maximum(cosine, 0.0)[..., np.newaxis] * (color * self.material.diffuse)
        if highlight_cosine is not None:
            highlight = model.reflect(highlight_cosine, self.material.parameter(model))
            highlight = np.where((cosine > 0) & has_highlight, highlight, 0.0)
            self.gloss += (factor * highlight)[..., np.newaxis] * specular

    @property
    def intensity(self) -> np.ndarray:
        """Both sums together, with albedo and emission."""
        found: np.ndarray = self.total if self.albedo is None else self.total * self.albedo
        if self.gloss is not self.total:
            found += self.gloss
        found = found + np.array(self.material.emission)
        return found


def saturate(values: np.ndarray) -> np.ndarray:
    """Intensities limited to [0, 1], as a screen limits them.

    Parameters
    ----------
    values : array
        Intensities.

    Returns
    -------
    float64 array, same shape
    """
    return np.clip(np.asarray(values, dtype=np.float64), 0.0, 1.0)
