"""Albedo: the colour of a pixel that multiplies ambient and diffuse light, in float64."""

import numpy as np

from blysk.golden.reference.fragments import fragment_barycentrics
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = ["fragment_albedo"]


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

    Source: docs/theory/textures.md#samples.
    """
    if not scene.has_albedo:
        return None
    share = fragment_barycentrics(raster, which)
    span = raster.span[which]
    triangle = raster.triangle[span]
    corners = scene.mesh.faces[triangle]
    albedo = np.ones((len(span), 3))
    if scene.mesh.colors.size:
        albedo = np.einsum("fn,fnk->fk", share, scene.mesh.colors[corners])
    material = scene.mesh.material[triangle]
    for index, texture in scene.textures.items():
        if texture.mipmapped and len(raster.level) != len(raster.length):
            raise ValueError("textures with several levels need the levels of the spans")
        chosen = np.flatnonzero(material == index)
        places = np.einsum("fn,fnk->fk", share[chosen], scene.mesh.coordinates[corners[chosen]])
        level = raster.level[span[chosen]] if texture.mipmapped else np.zeros(len(chosen), dtype=np.int64)
        albedo[chosen] *= texture.sample(places, level)
    return albedo
