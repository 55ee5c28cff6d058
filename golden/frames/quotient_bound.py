"""Bound of a frame's error by the quotient method, from the vectors of its own spans."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from blysk.golden.frames.missed import component_error, nearest
from blysk.golden.frames.prepare import span_vectors
from blysk.golden.geometry.light_adapter import LightAdapter
from blysk.golden.geometry.plane_setup import PlaneSetup
from blysk.golden.geometry.scene_triangles import SceneTriangles
from blysk.golden.geometry.triangles import ATTRIBUTE
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.golden.geometry.vertex_sort import SortedTriangles
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.methods.quotient_interpolator import QuotientErrors
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.lighting import distant_cosine
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer

__all__ = [
    "LightErrors",
    "across_slivers",
    "bound_of",
    "light_errors",
    "quotient_bound",
    "quotient_triangle_bound",
    "triangle_light_errors",
]


class LightErrors(NamedTuple):
    """Bounds of the light on a material, in each channel; 1 is the full channel.

    Parameters
    ----------
    diffuse, highlight : float64 arrays, shape (3,)
        Largest error of the sum of the diffuse terms, and of the sum of the specular terms.
    """

    diffuse: np.ndarray
    highlight: np.ndarray


def quotient_bound(scene: Scene, design: ShadingPipeline, cut: Raster) -> float:
    """Bound of the error against exact normals of every pixel with the same model, in LSB.

    It is the sum of

    - the rounding of a pixel, 1/2, and of its colour operands, 1/128 each;
    - for the brightest material, the bounds of N·L and of the highlight, times reflection and light.

    `QuotientErrors` has these bounds for every span, and docs/theory/quotient.md#bound proves them. The error
    of a lobe's table is measured at seven places of every step.

    Parameters
    ----------
    scene, design
        As for `compare`. The method is ``quotient``, with specular light.
    cut : Raster
        The shaded spans.
    """
    if not len(cut.length):
        return 0.5
    return bound_of(scene, light_errors(scene, design, cut))


def light_errors(scene: Scene, design: ShadingPipeline, cut: Raster) -> list[LightErrors]:
    """Bounds of the light on each material, without the rounding of colour operands.

    Parameters
    ----------
    scene, design, cut
        As for `quotient_bound`. A design without lights has no errors.
    """
    if not (design.lights and len(cut.length)):
        return [LightErrors(*np.zeros((2, 3)))] * len(scene.materials)
    vectors = span_vectors(scene, cut, design)
    errors = (QuotientErrors.of(vectors, cut.length, design.mirror, further) for further in (False, True))
    return _light_errors(scene, design, *errors)


def quotient_triangle_bound(scene: Scene, renderer: Renderer, sent: SceneTriangles) -> float | None:
    """Bound of a frame by triangles, in LSB, for pixels where exact shading shows the same triangle.

    Parameters
    ----------
    scene, renderer, sent
        As for `triangle_light_errors`.

    Returns
    -------
    float or None
        The bound; ``None`` as of `triangle_light_errors`.
    """
    errors = triangle_light_errors(scene, renderer, sent)
    return None if errors is None else bound_of(scene, errors)


def triangle_light_errors(scene: Scene, renderer: Renderer, sent: SceneTriangles) -> list[LightErrors] | None:
    """Bounds of the light on each material in a frame by triangles, without the rounding of colour operands.

    - A component of N/W is off by `component_error`, times the shift.
    - The words of `VectorAdapter` add half a step for the start, the rounding of the step, and an eighth of a
      step for cuts.
    - Slivers have the attributes of their longest edge. So they are also off by the distance of their middle
      corner's attributes from this edge.
    - `MirrorAdapter` turns gamma by 2^-15 at most.
    - Components of further lights have the error of the vector that `LightAdapter` turns, the error of its
      axes, and a rounding of their own.

    Parameters
    ----------
    scene : Scene
        The drawn scene.
    renderer : Renderer
        Geometry and shading, of the method ``quotient``, with specular light.
    sent : SceneTriangles
        The scene's triangles.

    Returns
    -------
    list of LightErrors, or None
        ``None`` if the words of a span are too short for a direction.
    """
    drawn, pieces, _ = renderer.geometry.pieces(sent.triangles, sent.frame)
    if not (renderer.design.lights and len(pieces)):
        return [LightErrors(*np.zeros((2, 3)))] * len(scene.materials)
    left, right = pieces.left.values, pieces.right.values
    adapter = VectorAdapter(renderer.geometry.rotates)
    steps = np.ldexp(2.0**17 * (1 - 2.0**-adapter.margin_shift), adapter.shift(pieces))
    last = pieces.length - 1.0
    difference = np.abs(right - left).max(axis=1) * steps
    # Error of the step and of its dropped bits. A step that is turned is shifted by one place less.
    of_step = np.maximum(difference * 2.0**-17, 1 / 16) * (1 + adapter.rotates)
    rounding = np.where(last > 0, of_step + 1 / 8, 0)
    across = across_slivers(drawn, drawn.triangles.normal, renderer)
    error = component_error(drawn, pieces, renderer) + across[pieces.triangle]
    component = 0.5 + rounding + error * steps
    shortest = nearest(left, right) * steps - 2 * component
    if (shortest <= 2 * component).any():
        return None
    errors = QuotientErrors.of_words(component, shortest, last, renderer.mirrors)
    mirrored = 2.0**-15 * renderer.mirrors
    errors = replace(errors, turn=errors.turn + mirrored)
    if not renderer.rows:
        return _light_errors(scene, renderer.design, errors)
    longest = np.maximum(*(np.linalg.norm(end, axis=1) for end in (left, right))) * steps
    own = component + 0.5 + np.where(last > 0, of_step, 0) + LightAdapter.AXIS_ERROR * longest / np.sqrt(3)
    if (shortest <= 4 * own).any():
        return None
    further = QuotientErrors.of_words(own, shortest, last, renderer.mirrors, component)
    # The codes of sin a and cos a of the first light change q, too.
    further = replace(further, mismatch=further.mismatch + mirrored)
    return _light_errors(scene, renderer.design, errors, further)


def across_slivers(drawn: SortedTriangles, codes: np.ndarray, renderer: Renderer) -> np.ndarray:
    """Largest difference of an attribute across each sliver, and 0 for other triangles.

    Parameters
    ----------
    drawn : SortedTriangles
        From `Geometry.pieces`.
    codes : int64 array, shape (T, 3, n)
        Codes of attributes at the corners, such as N/W.
    renderer : Renderer
        Geometry and shading.
    """
    y, value = drawn.triangles.y, codes * ATTRIBUTE.step
    height = y[:, 2] - y[:, 0]
    share = ((y[:, 1] - y[:, 0]) / height)[:, np.newaxis]
    across = value[:, 1] - (1 - share) * value[:, 0] - share * value[:, 2]
    sliver = PlaneSetup(renderer.geometry.grid).is_sliver(drawn.area, height)
    return np.where(sliver, np.abs(across).max(axis=1), 0)


def bound_of(scene: Scene, errors: list[LightErrors]) -> float:
    """Bound of a pixel in LSB, from the bounds of the light on each material.

    The rounding of the pixel adds 1/2, and each of its colour operands 1/128.

    Parameters
    ----------
    scene : Scene
        The scene.
    errors : list of LightErrors
        Bounds of the light on each material.
    """
    largest = max(float((of.diffuse + of.highlight).max()) for of in errors)
    return 0.5 + 255 * largest + (1 + 2 * len(scene.lights)) / 128


def _light_errors(
    scene: Scene, design: ShadingPipeline, errors: QuotientErrors, further: QuotientErrors | None = None
) -> list[LightErrors]:
    """Bounds of the light on each material, from bounds for the first light and for further lights."""
    lobe = design.lobe
    kinds = [errors] if further is None or len(scene.lights) < 2 else [errors, further]
    found = []
    for material in scene.materials:
        parameter = design.highlight_parameter(material)
        table = lobe.line_error(parameter) + Lobe.ERROR
        highlights = [bounds.highlight(lobe.reflection, parameter) + table for bounds in kinds]
        sums = LightErrors(*np.zeros((2, 3)))
        for index, light in enumerate(() if material.unlit else scene.lights):
            kind = min(index, len(kinds) - 1)
            bounds, highlight = kinds[kind], highlights[kind]
            reflection = material.reflection(distant_cosine(light, scene.distant_viewer))
            sums.diffuse[:] += np.multiply(material.diffuse, bounds.cosine + 2.0**-18) * light.color
            sums.highlight[:] += np.multiply(reflection, highlight) * light.color
        found.append(sums)
    return found
