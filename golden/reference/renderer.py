"""The golden float64 renderer: a scene to a picture."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from blysk.golden.reference.albedo import fragment_albedo
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.faces import face_normals
from blysk.golden.reference.fragments import fragment_barycentrics, fragment_normals
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import (
    Material,
    halfway_vector,
    intensity,
    intensity_of_cosines,
    saturate,
)
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import BLINN, ReflectionModel
from blysk.golden.reference.scene import Scene

__all__ = [
    "DIFFUSE_THRESHOLD",
    "HIGHLIGHT_THRESHOLD",
    "NORMAL_THRESHOLD",
    "SHADINGS",
    "Curve",
    "ExactFrame",
    "Thresholds",
    "fragment_positions",
    "gouraud_triangles",
    "render",
    "shade_operands",
    "shade_spans",
    "visible_mask",
]

SHADINGS = ("flat", "gouraud", "quadratic_gouraud", "adaptive", "phong", "slerp")
"""Names of the shading methods."""

NORMAL_THRESHOLD = 0.9
"""Threshold of ``adaptive`` for the normals of a triangle's vertices ([T] appendix В)."""

HIGHLIGHT_THRESHOLD = 0.004
"""Threshold of ``adaptive`` for N·H at a triangle's vertices."""

DIFFUSE_THRESHOLD = 0.008
"""Threshold of ``adaptive`` for N·L at a triangle's vertices."""

Curve = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""A function of the normals at a span's ends and the place t between them."""

# Fragments shaded at once; bounds the memory, changes no result.
_CHUNK = 1 << 15


@dataclass(frozen=True)
class ExactFrame:
    """A picture in float64.

    Parameters
    ----------
    image : float64 array, shape (height, width, 3)
        Intensities in [0, 1], not rounded.
    mask : bool array, shape (height, width)
        Pixels that show the surface.
    """

    image: np.ndarray
    mask: np.ndarray


@dataclass(frozen=True)
class Thresholds:
    """Limits of ``adaptive``. If all differences are smaller, a triangle is shaded by its vertices alone.

    Parameters
    ----------
    normal : float
        Length of the difference of two vertex normals. 0.9 is an angle of 53.5 degrees. (The 0.9 of the
        document may mean a least cosine, 25.8 degrees. The length is then 0.447.)
    highlight : float
        Difference of N·H of two vertices, for every light.
    diffuse : float
        Difference of N·L of two vertices, for every light. 0.008 is two steps of an 8-bit channel for a white
        surface and one light.

    Raises
    ------
    ValueError
        If a threshold is negative or NaN. Infinite thresholds let every triangle pass.
    """

    normal: float = NORMAL_THRESHOLD
    highlight: float = HIGHLIGHT_THRESHOLD
    diffuse: float = DIFFUSE_THRESHOLD

    def __post_init__(self) -> None:
        for name in ("normal", "highlight", "diffuse"):
            value = float(getattr(self, name))
            if math.isnan(value) or value < 0:
                raise ValueError(f"the {name} threshold must be at least 0, not {value}")
            object.__setattr__(self, name, value)


def gouraud_triangles(scene: Scene, thresholds: Thresholds | None = None) -> np.ndarray:
    """Triangles that ``adaptive`` shades by Gouraud's method; the mean is their share ([T] appendix В).

    Every two vertices of one of these triangles differ by less than the thresholds in N, N·H and N·L. A light
    with ``L = -V`` has no H and no highlight, and only its N·L counts. A change of N·H by e changes
    ``(N·H)^n`` by up to ``n e``: with large exponents the default thresholds allow visible errors.

    The listing of [T] appendix В returns Phong if the normals are close, as docs/theory/errata.md describes.
    Here the test is corrected.

    Parameters
    ----------
    scene : Scene
        Mesh, lights and viewer.
    thresholds : Thresholds, optional
        Thresholds, by default from the document.

    Returns
    -------
    bool array, shape (F,)
        For each face of the mesh, drawn or not.
    """
    thresholds = thresholds or Thresholds()
    normals = scene.mesh.normals
    faces = scene.mesh.faces
    result = np.ones(len(faces), dtype=bool)
    cosines = []
    viewer = scene.view_vectors(scene.mesh.vertices)
    for light in scene.lights:
        direction = light.towards(scene.mesh.vertices)
        halfway = halfway_vector(direction, viewer)
        cosines += [
            ((normals * halfway).sum(axis=1), thresholds.highlight),
            ((normals * direction).sum(axis=1), thresholds.diffuse),
        ]
    for side in ((0, 1), (1, 2), (2, 0)):
        first, second = (faces[:, corner] for corner in side)
        result &= np.linalg.norm(normals[first] - normals[second], axis=1) < thresholds.normal
        for cosine, threshold in cosines:
            result &= np.abs(cosine[first] - cosine[second]) < threshold
    return result


def render(
    scene: Scene,
    shading: str = "phong",
    model: ReflectionModel = BLINN,
    raster: Raster | None = None,
    thresholds: Thresholds | None = None,
) -> ExactFrame:
    """Picture of a scene in float64.

    - ``flat``: the intensity of each triangle's own normal, in its middle;
    - ``gouraud``: the intensity at the three vertices, saturated there, interpolated perspective-correctly;
    - ``quadratic_gouraud``: the second-degree polynomial through the intensities, saturated, at the three
      vertices and at the middles of the three edges ([T] appendix Д). The normal of a middle is
      ``(N_a + N_b)/|N_a + N_b|``, as for ``phong``. In the perspective-correct barycentric coordinates l the
      polynomial is ``sum_i l_i (2 l_i - 1) I_i + sum_{i<j} 4 l_i l_j I_ij``. Two triangles that share an edge
      and its normals have equal intensities along it. Between the six points the polynomial may leave the
      range of their intensities by up to a third of this range, in the middle of the triangle. It is
      saturated again;
    - ``adaptive``: ``gouraud`` in the triangles of `gouraud_triangles`, ``phong`` in the others ([T]
      appendix В);
    - ``phong``: the vertex normals interpolated perspective-correctly and normalised at every pixel, as a
      GPU does: the reference image;
    - ``slerp``: normals on the great circle between the ends of each span, linear in screen space ([T] 2.1).

    Every pixel has its own albedo, of vertex colours and textures. Where a method shades vertices or middles,
    these have the pixel's albedo.

    With point lights or a near viewer L and V belong to the shaded point. This is a fragment's point of the
    surface, a vertex, or the middle of an edge.

    Parameters
    ----------
    scene : Scene
        Scene to be drawn.
    shading : str
        One of `SHADINGS`.
    model : ReflectionModel
        Reflection model.
    raster : Raster, optional
        Raster of the scene, if it exists already.
    thresholds : Thresholds, optional
        Thresholds of ``adaptive``; other methods ignore them.

    Raises
    ------
    ValueError
        If the shading is unknown.
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
        nodes = None if shading == "phong" else _NodeColors(scene, raster, shading, model)
        linear = gouraud_triangles(scene, thresholds) if shading == "adaptive" else None
        for which in _visible(raster):
            by_nodes = by_normals = which
            if linear is not None:
                chosen = linear[raster.triangle[raster.span[which]]]
                by_nodes, by_normals = which[chosen], which[~chosen]
            if nodes is not None:
                albedo = fragment_albedo(scene, raster, by_nodes)
                colors[raster.pixel[by_nodes]] = nodes.interpolate(by_nodes, albedo)
            if shading in ("phong", "adaptive"):
                normals = fragment_normals(scene, raster, by_normals)
                span = raster.span[by_normals]
                colors[raster.pixel[by_normals]] = saturate(
                    _shade(
                        scene,
                        normals,
                        model,
                        raster.triangle,
                        span,
                        points=_points(scene, raster, by_normals),
                        albedo=fragment_albedo(scene, raster, by_normals),
                    )
                )
    return ExactFrame(image=image, mask=visible_mask(scene, raster))


def visible_mask(scene: Scene, raster: Raster) -> np.ndarray:
    """Which pixels show a surface: bool array, shape (height, width)."""
    mask = np.zeros((scene.height, scene.width), dtype=bool)
    mask.reshape(-1)[raster.pixel[raster.visible]] = True
    return mask


class _NodeColors:
    """Colours at a few points of every triangle that shows, and their interpolation."""

    def __init__(self, scene: Scene, raster: Raster, shading: str, model: ReflectionModel):
        self.raster, self.shading = raster, shading
        shown, self.place = np.unique(raster.triangle, return_inverse=True)
        face = face_normals(scene.mesh)[shown][:, np.newaxis]
        points = scene.mesh.vertices[scene.mesh.faces[shown]]
        if shading == "flat":
            normals = face
            points = points.mean(axis=1, keepdims=True)
        else:
            normals = scene.mesh.normals[scene.mesh.faces[shown]]
            if shading == "quadratic_gouraud":
                # The middle of the edge that lies opposite each corner.
                total = normals[:, [1, 2, 0]] + normals[:, [2, 0, 1]]
                # As in `rasterise`: opposite normals leave a remainder where they should cancel.
                lost = np.linalg.norm(total, axis=-1, keepdims=True) <= 1e-12
                middles = np.where(lost, face, normalise(total))
                normals = np.concatenate((normals, middles), axis=1)
                points = np.concatenate((points, (points[:, [1, 2, 0]] + points[:, [2, 0, 1]]) / 2), axis=1)
        back = np.zeros(len(shown), dtype=bool)
        back[self.place] = raster.back
        back &= scene.flips[shown]
        normals = np.where(back[:, np.newaxis, np.newaxis], -normals, normals)
        # The intensity is linear in the albedo. So its values at black and at white give all values.
        self.white = _shade(scene, normals, model, shown, slice(None), points=points)
        if scene.has_albedo:
            black = np.zeros_like(normals)
            self.black = _shade(scene, normals, model, shown, slice(None), points=points, albedo=black)

    def interpolate(self, which: np.ndarray, albedo: np.ndarray | None) -> np.ndarray:
        """Colours of fragments with their albedo, each of shape (count, 3)."""
        place = self.place[self.raster.span[which]]
        colors = self.white[place]
        if albedo is not None:
            black = self.black[place]
            colors = black + albedo[:, np.newaxis] * (colors - black)
        colors = saturate(colors)
        if self.shading == "flat":
            found: np.ndarray = colors[:, 0]
            return found
        share = fragment_barycentrics(self.raster, which)
        if self.shading == "quadratic_gouraud":
            across = 4 * share[:, [1, 2, 0]] * share[:, [2, 0, 1]]
            share = np.concatenate((share * (2 * share - 1), across), axis=1)
        return saturate(np.einsum("fn,fnk->fk", share, colors))


def shade_spans(
    scene: Scene, raster: Raster, curve: str | Curve, model: ReflectionModel, chord: bool = False
) -> np.ndarray:
    """Picture from spans alone, as in hardware.

    The normal of a fragment is the curve between its span's ends at ``t = offset / (length - 1)``. In a span
    of one pixel t is 0. The normal keeps the length that the curve gives. In an exact frame the ends of the
    line have lengths, so ``normalised`` between unit ends differs from that line
    (docs/theory/interpolation.md#true-spans).

    Parameters
    ----------
    scene : Scene
        Size, background, materials, lights and viewer; the mesh is read for the materials of its faces.
    raster : Raster
        The spans. normal_left, normal_right, length, span, offset, pixel and visible are used. Several
        materials need triangle, too. Point lights, a near viewer or an albedo need triangle, weights_left and
        weights_right. Textures need level. So `dataclasses.replace` may put quantised normals in.
    curve : str or callable
        One of `CURVES`, or a function of the normals at both ends and t.
    model : ReflectionModel
        Reflection model.
    chord : bool
        See `intensity`.

    Returns
    -------
    float64 array, shape (height, width, 3)
        Intensities in [0, 1], not rounded.

    Raises
    ------
    ValueError
        If the curve is unknown, or the spans lack weights that point lights, a near viewer or an albedo need.
    """
    image = _background(scene)
    colors = image.reshape(-1, 3)
    for which in _visible(raster):
        span = raster.span[which]
        t = raster.offset[which] / np.maximum(raster.length[span] - 1, 1)
        ends = raster.normal_left[span], raster.normal_right[span]
        normals = interpolate(curve, *ends, t) if isinstance(curve, str) else curve(*ends, t)
        points = _points(scene, raster, which)
        albedo = fragment_albedo(scene, raster, which)
        shaded = _shade(scene, normals, model, raster.triangle, span, chord, points, albedo)
        colors[raster.pixel[which]] = saturate(shaded)
    return image


def shade_operands(
    scene: Scene,
    raster: Raster,
    cosine: np.ndarray,
    highlight_cosine: np.ndarray,
    model: ReflectionModel,
    factor: np.ndarray | None = None,
) -> np.ndarray:
    """Picture from the operands of every fragment, for a method without normals.

    Parameters
    ----------
    scene : Scene
        Size, background, materials and the lights' colours; the mesh is read for the materials of its faces.
    raster : Raster
        The fragments; span, pixel, visible and triangle are used. An albedo needs all that `fragment_albedo`
        reads.
    cosine, highlight_cosine : arrays, shape (fragments, lights)
        N·L, which contains the factor of a light that fades, and N·H.
    model : ReflectionModel
        Reflection model.
    factor : array, shape (fragments, lights), optional
        Factor of each light; ``None``: 1.

    Returns
    -------
    float64 array, shape (height, width, 3)
        Intensities in [0, 1], not rounded.
    """
    image = _background(scene)
    colors = image.reshape(-1, 3)
    for which in _visible(raster):
        material = scene.mesh.material[raster.triangle[raster.span[which]]]
        albedo = fragment_albedo(scene, raster, which)
        for index, coefficients in enumerate(scene.materials):
            own = material == index
            chosen = which[own]
            shaded = intensity_of_cosines(
                coefficients,
                scene.lights,
                scene.ambient_light,
                cosine[chosen],
                highlight_cosine[chosen],
                model,
                scene.distant_viewer,
                None if factor is None else factor[chosen],
                None if albedo is None else albedo[own],
            )
            colors[raster.pixel[chosen]] = saturate(shaded)
    return image


def fragment_positions(scene: Scene, raster: Raster, which: np.ndarray) -> np.ndarray:
    """Perspective-correct positions of fragments on the surface, in the mesh's units.

    Parameters
    ----------
    scene : Scene
        The scene that was rasterised.
    raster : Raster
        From `rasterise`.
    which : int or bool array
        The fragments, as an index into the fragment arrays.

    Returns
    -------
    float64 array, shape (count, 3)

    Raises
    ------
    ValueError
        If the raster's weights were left out.
    """
    corners = scene.mesh.vertices[scene.mesh.faces[raster.triangle[raster.span[which]]]]
    found: np.ndarray = np.einsum("fn,fnk->fk", fragment_barycentrics(raster, which), corners)
    return found


def _points(scene: Scene, raster: Raster, which: np.ndarray) -> np.ndarray | None:
    return fragment_positions(scene, raster, which) if scene.local else None


def _background(scene: Scene) -> np.ndarray:
    image = np.empty((scene.height, scene.width, 3))
    # One row at a time: with three values at a time the loop takes four times as long.
    image[0] = scene.background
    image[1:] = image[0]
    return image


def _visible(raster: Raster) -> Iterator[np.ndarray]:
    visible = np.flatnonzero(raster.visible)
    # At least one part, so that a wrong name is an error in an empty picture too.
    for start in range(0, max(len(visible), 1), _CHUNK):
        yield visible[start : start + _CHUNK]


def _shade(
    scene: Scene,
    normals: np.ndarray,
    model: ReflectionModel,
    triangles: np.ndarray,
    which: np.ndarray | slice,
    chord: bool = False,
    points: np.ndarray | None = None,
    albedo: np.ndarray | None = None,
) -> np.ndarray:
    """Intensities of normals. The first axis of the normals belongs to the triangles ``triangles[which]``."""

    def shade(normals: np.ndarray, material: Material, *given: np.ndarray | None) -> np.ndarray:
        viewer = scene.view_vectors(given[0])
        return intensity(normals, material, scene.lights, scene.ambient_light, viewer, model, chord, *given)

    if len(scene.materials) == 1:
        return shade(normals, scene.materials[0], points, albedo)
    result = np.empty(normals.shape)
    material = scene.mesh.material[triangles[which]]
    for index in np.unique(material):
        chosen = material == index
        given = (None if of is None else of[chosen] for of in (points, albedo))
        result[chosen] = shade(normals[chosen], scene.materials[index], *given)
    return result
