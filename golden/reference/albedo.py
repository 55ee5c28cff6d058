"""Albedo: the colour of a pixel that multiplies ambient and diffuse light, in float64."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from blysk.golden.reference.fragments import fragment_barycentrics
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture

__all__ = ["Samples", "fragment_albedo", "fragment_colors", "fragment_samples"]


class Samples(NamedTuple):
    """Samples that some fragments take of a texture.

    Parameters
    ----------
    texture : Texture
        The texture.
    which : int64 array, shape (samples,)
        Index of each sample's fragment among the chosen fragments.
    coordinates : float64 array, shape (samples, 2)
        u and v.
    level : int64 array, shape (samples,)
        Level of each sample.
    """

    texture: Texture
    which: np.ndarray
    coordinates: np.ndarray
    level: np.ndarray

    @property
    def sizes(self) -> np.ndarray:
        """Columns and rows of the level of each sample, shape (samples, 2)."""
        found: np.ndarray = np.array([image.shape[1::-1] for image in self.texture.levels])[self.level]
        return found

    @property
    def colors(self) -> np.ndarray:
        """Colours of the texture, shape (samples, 3)."""
        return self.texture.sample(self.coordinates, self.level)


def fragment_colors(scene: Scene, raster: Raster, which: np.ndarray) -> np.ndarray:
    """Perspective-correct vertex colours of fragments; 1 in a scene without vertex colours.

    Parameters
    ----------
    scene, raster, which
        As for `fragment_albedo`.

    Returns
    -------
    float64 array, shape (count, 3)
        Linear light, 0 to 1.
    """
    triangle = raster.triangle[raster.span[which]]
    if not scene.mesh.colors.size:
        return np.ones((len(triangle), 3))
    share = fragment_barycentrics(raster, which)
    found: np.ndarray = np.einsum("fn,fnk->fk", share, scene.mesh.colors[scene.mesh.faces[triangle]])
    return found


def fragment_samples(scene: Scene, raster: Raster, which: np.ndarray) -> Iterator[Samples]:
    """Samples of each texture that fragments take, at perspective-correct texture coordinates.

    Parameters
    ----------
    scene, raster, which
        As for `fragment_albedo`.

    Raises
    ------
    ValueError
        As `fragment_albedo` does.
    """
    if not scene.textures:
        return
    span = raster.span[which]
    triangle = raster.triangle[span]
    share = fragment_barycentrics(raster, which)
    material = scene.mesh.material[triangle]
    for index, texture in scene.textures.items():
        if texture.mipmapped and len(raster.level) != len(raster.length):
            raise ValueError("textures with several levels need the levels of the spans")
        chosen = np.flatnonzero(material == index)
        corners = scene.mesh.coordinates[scene.mesh.faces[triangle[chosen]]]
        level = np.zeros(len(chosen), dtype=np.int64)
        if texture.mipmapped:
            level += raster.level[span[chosen]]
        yield Samples(texture, chosen, np.einsum("fn,fnk->fk", share[chosen], corners), level)


def fragment_albedo(scene: Scene, raster: Raster, which: np.ndarray) -> np.ndarray | None:
    """Albedo of fragments: perspective-correct vertex colour times colour of the material's texture.

    Parameters
    ----------
    scene : Scene
        The scene that was rasterised.
    raster : Raster
        From `rasterise`. Parts of spans have the levels of the whole spans.
    which : int or bool array
        The fragments, as an index into the fragment arrays.

    Returns
    -------
    float64 array, shape (count, 3), or None
        Linear light, 0 to 1; ``None`` if the scene has neither vertex colours nor textures.

    Raises
    ------
    ValueError
        If the raster lacks the weights of its spans, or the levels of a texture that has several.

    Source: docs/theory/textures.md#albedo.
    """
    if not scene.has_albedo:
        return None
    albedo = fragment_colors(scene, raster, which)
    for samples in fragment_samples(scene, raster, which):
        albedo[samples.which] *= samples.colors
    return albedo
