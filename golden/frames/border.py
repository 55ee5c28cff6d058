"""Borders: the pixels where a light, a highlight with a step, or another texel begins."""

import numpy as np

from blysk.golden.reference.albedo import fragment_samples
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.reflection import ReflectionModel
from blysk.golden.reference.renderer import fragment_positions
from blysk.golden.reference.scene import Scene

__all__ = ["BORDER", "border_mask", "border_name", "highlight_step"]

BORDER = 0.002
"""Largest ``|N·L|`` of a pixel at the border of a light, where rounding may switch the light on or off.

A pixel at the border of a texel is at most this distance, in texels, from another texel.
"""

# Number of fragments processed together; it limits the memory.
_CHUNK = 1 << 15


def highlight_step(scene: Scene, model: ReflectionModel) -> float:
    """Largest step of a light's highlight at N·H = 0 in LSB of linear light; 0 if it is a quarter or less.

    ``ggx`` at a large roughness does not end in 0 there, and a curve from a file may not. Polynomials with a
    small exponent go on beyond N·H = 0, so they have no step.
    """
    brightest = max((max(light.color) for light in scene.lights), default=0.0)
    steps = [0.0]
    for material in scene.materials:
        if material.unlit:
            continue
        before, behind = model.reflect(np.array([1e-6, -1e-6]), material.parameter(model))
        steps.append(float(255 * (before - behind) * max(material.specular) * brightest))
    return max(steps) if max(steps) > 0.25 else 0.0


def border_name(scene: Scene, model: ReflectionModel) -> str:
    """The quantities that are at most `BORDER` at a border, in words, see `border_mask`."""
    parts = ["|N.L|"]
    if highlight_step(scene, model):
        parts.append("|N.H|")
    if any(texture.filter == "nearest" for texture in scene.textures.values()):
        parts.append("way to another texel")
    return " or ".join(parts)


def border_mask(scene: Scene, raster: Raster, model: ReflectionModel) -> np.ndarray:
    """Shown pixels at the border of a light, where its term switches between on and off, or of a texel.

    At the border of a light ``|N·L|`` is at most `BORDER`, or ``|N·H|`` if there is a `highlight_step`. An
    error there may be as large as the term. An unlit surface has no such border.

    At the border of a texel, of a texture that takes the nearest, the next column or row is at most `BORDER`
    texels away. An error there may be as large as the difference of the texels.

    Parameters
    ----------
    scene : Scene
        Lights, viewer and materials.
    raster : Raster
        The spans of `rasterise`.
    model : ReflectionModel
        The reflection model.

    Returns
    -------
    bool array, shape (height, width)
    """
    mask = np.zeros(scene.height * scene.width, dtype=bool)
    steps = highlight_step(scene, model) > 0
    is_lit = np.array([not material.unlit for material in scene.materials])
    shown = np.flatnonzero(raster.visible)
    for start in range(0, len(shown), _CHUNK):
        which = shown[start : start + _CHUNK]
        normals = fragment_normals(scene, raster, which)
        points = fragment_positions(scene, raster, which) if scene.local else None
        near = np.zeros(len(which), dtype=bool)
        for light in (light for light in scene.lights if light.is_on):
            direction = np.broadcast_to(light.towards(points), normals.shape)
            near |= np.abs(np.einsum("ij,ij->i", normals, direction)) <= BORDER
            if steps:
                halfway = halfway_vector(direction, scene.view_vectors(points))
                near |= np.abs(np.einsum("ij,ij->i", normals, halfway)) <= BORDER
        near &= is_lit[scene.mesh.material[raster.triangle[raster.span[which]]]]
        for samples in fragment_samples(scene, raster, which):
            if samples.texture.filter == "nearest":
                places = samples.coordinates * samples.sizes
                beside = np.abs(places - np.rint(places)) <= BORDER
                near[samples.which] |= (beside & (samples.sizes > 1)).any(axis=1)
        mask[raster.pixel[which]] = near
    return mask.reshape(scene.height, scene.width)
