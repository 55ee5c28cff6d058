"""The golden float64 renderer: a scene to a picture."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from golden.interpolation import interpolate
from golden.lighting import intensity, saturate
from golden.raster import Raster, face_normals, fragment_barycentrics, fragment_normals, rasterise
from golden.scene import Scene

__all__ = ["SHADINGS", "Frame", "render", "shade_spans"]

SHADINGS = ("flat", "gouraud", "phong", "slerp")
"""Names of the shading methods."""

# Fragments shaded at once; bounds the memory, changes no result.
_CHUNK = 1 << 18


@dataclass(frozen=True)
class Frame:
    """A picture.

    Parameters
    ----------
    image : float64 array, shape (height, width, 3)
        Intensities in [0, 1], not rounded.
    mask : bool array, shape (height, width)
        Pixels that show the surface.
    """

    image: np.ndarray
    mask: np.ndarray


def render(scene: Scene, shading: str = "phong", model: str = "blinn", raster: Raster | None = None) -> Frame:
    """Picture of a scene in float64.

    - ``flat``: the intensity of each triangle's own normal;
    - ``gouraud``: the intensity at the three vertices, saturated there, interpolated perspective-correctly;
    - ``phong``: the vertex normals interpolated perspective-correctly and normalised at every pixel, as a
      GPU does: the reference image;
    - ``slerp``: normals on the great circle between the ends of each span, linear in screen space ([T] 2.1).

    Parameters
    ----------
    scene : Scene
        What to draw.
    shading : str
        One of `SHADINGS`.
    model : str
        One of `golden.reflection.REFLECTION_MODELS`.
    raster : Raster, optional
        The scene's own raster, when it is at hand already.

    Raises
    ------
    ValueError
        If the shading or the model is unknown.
    """
    if shading not in SHADINGS:
        raise ValueError(f"shading must be one of {', '.join(SHADINGS)}, not {shading!r}")
    if raster is None:
        raster = rasterise(scene)
    if shading == "slerp":
        image = shade_spans(scene, raster, "slerp", model)
    else:
        image = _background(scene)
        colors = image.reshape(-1, 3)
        shown, place = np.unique(raster.triangle, return_inverse=True)
        normals = scene.mesh.normals[scene.mesh.faces[shown]] if shading == "gouraud" else None
        if shading == "flat":
            normals = face_normals(scene.mesh)[shown][:, np.newaxis]
        if normals is not None:
            if scene.back_faces == "flip":
                back = np.zeros(len(shown), dtype=bool)
                back[place] = raster.back
                normals = np.where(back[:, np.newaxis, np.newaxis], -normals, normals)
            corners = saturate(_shade(scene, normals, model))
        for which in _visible(raster):
            if shading == "phong":
                value = saturate(_shade(scene, fragment_normals(scene, raster, which), model))
            elif shading == "flat":
                value = corners[place[raster.span[which]], 0]
            else:
                share = fragment_barycentrics(raster, which)
                value = np.einsum("fc,fck->fk", share, corners[place[raster.span[which]]])
            colors[raster.pixel[which]] = value
    mask = np.zeros((scene.height, scene.width), dtype=bool)
    mask.reshape(-1)[raster.pixel[raster.visible]] = True
    return Frame(image=image, mask=mask)


def shade_spans(scene: Scene, raster: Raster, curve: str, model: str) -> np.ndarray:
    """Picture from spans alone, as the hardware sees them.

    The normal of a fragment is the curve between its span's ends at ``t = offset / (length - 1)`` (0 for a
    span of one pixel), with the length that the curve gives it. With ``normalised`` this is the reference
    of the method error.

    Parameters
    ----------
    scene : Scene
        Size, background, material, lights and viewer; the mesh is not used.
    raster : Raster
        The spans. Only normal_left, normal_right, length, span, offset, pixel and visible are used, so that
        they may be replaced, with `dataclasses.replace`, by quantised ones.
    curve : str
        One of `golden.interpolation.CURVES`.
    model : str
        One of `golden.reflection.REFLECTION_MODELS`.

    Returns
    -------
    float64 array, shape (height, width, 3)
        Intensities in [0, 1], not rounded.

    Raises
    ------
    ValueError
        If the curve or the model is unknown.
    """
    image = _background(scene)
    colors = image.reshape(-1, 3)
    for which in _visible(raster):
        span = raster.span[which]
        t = raster.offset[which] / np.maximum(raster.length[span] - 1, 1)
        normals = interpolate(curve, raster.normal_left[span], raster.normal_right[span], t)
        colors[raster.pixel[which]] = saturate(_shade(scene, normals, model))
    return image


def _background(scene: Scene) -> np.ndarray:
    image = np.empty((scene.height, scene.width, 3))
    image[...] = scene.background
    return image


def _visible(raster: Raster) -> Iterator[np.ndarray]:
    visible = np.flatnonzero(raster.visible)
    # At least one part, so that a wrong name is an error in an empty picture too.
    for start in range(0, max(len(visible), 1), _CHUNK):
        yield visible[start : start + _CHUNK]


def _shade(scene: Scene, normals: np.ndarray, model: str) -> np.ndarray:
    return intensity(normals, scene.material, scene.lights, scene.ambient_light, scene.camera.viewer, model)
