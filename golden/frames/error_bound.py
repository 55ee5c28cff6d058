"""Bounds of the errors of a frame and its pixels, from the method and the transfer of the design."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.frames.albedo_bound import AttributeErrors, albedo_bound
from blysk.golden.frames.highlight_limits import HighlightLimits
from blysk.golden.frames.quotient_bound import (
    LightErrors,
    bound_of,
    light_errors,
    quotient_bound,
    quotient_triangle_bound,
    triangle_light_errors,
)
from blysk.golden.geometry.scene_triangles import SceneTriangles
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.transfer import Transfer
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.lighting import distant_cosine
from blysk.golden.reference.lobes import LEAST_ROUGHNESS, TABLE_MODELS, curve_lines
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import slope
from blysk.golden.render import Renderer

__all__ = ["budget_errors", "encoded_bound", "error_bound", "pixel_bound", "triangle_bound"]


def error_bound(scene: Scene, design: ShadingPipeline, cut: Raster | None = None) -> float | None:
    """Bound of the error against exact normals of every pixel with the same model, in LSB of linear light.

    Three methods have a bound, each of its own kind.

    - ``quotient``: from the vectors of its spans, see `quotient_bound`.
    - ``chord-local``: from the budgets that every pixel keeps, see `budget_errors`. It is proved, except for
      the error of the lobe's table, which is measured.
    - ``renormalise``: tested by search, and not proved. For each material that is not unlit, multiply each
      light's colour by the sum of diffuse and specular reflection, and add these products of all lights. Let
      c be the largest channel of these sums; 1 is the full channel. Then::

        arithmetic error <= 1/2 + c/16        method error <= 1/2 + c/16 + c/4        (LSB)

      The half is the rounding of the pixel. The sixteenth holds the rounding of operands and terms. It is at
      least 1/128, for the ambient operand.

    The bound holds for spans from software, and off the border of every light, see `border_mask`.

    Parameters
    ----------
    scene, design
        As for `compare`.
    cut : Raster, optional
        The shaded spans. With them ``quotient`` has a bound, see `quotient_bound`.

    Returns
    -------
    float or None
        The bound of the method error. ``None``: no bound is known, in one of these cases:

        - another method than ``chord-local``, ``renormalise`` and ``quotient``;
        - vertex colours or textures, see `pixel_bound`;
        - a pipeline that was made for materials other than the scene's;
        - a measured curve;
        - a roughness under `LEAST_ROUGHNESS`;
        - ``renormalise`` with a lobe for which `Lobe.scale_of` gives a scale. Its words of 1 - N·H are too
          coarse for this sharp lobe.
    """
    if design.specular is None or scene.has_albedo:
        return None
    return design.interpolator.bound(_Bounds(scene, design, cut))


def pixel_bound(scene: Scene, design: ShadingPipeline, cut: Raster) -> np.ndarray | None:
    """Bound as in `error_bound` for each pixel of a scene with vertex colours or textures.

    Parameters
    ----------
    scene, design, cut
        As for `error_bound`. The design has an albedo.

    Returns
    -------
    float64 array, shape (height, width, 3), or None
        In LSB of linear light, see `albedo_bound`. ``None``: no bound is known, as in `error_bound`. For
        `albedo_bound` the whole error by tolerances is an error of the specular sum.
    """
    return None if design.specular is None else design.interpolator.bound(_PixelBounds(scene, design, cut))


def triangle_bound(
    scene: Scene, renderer: Renderer, sent: SceneTriangles, raster: Raster
) -> float | np.ndarray | None:
    """Bound as in `error_bound` of a picture by triangles, see `quotient_triangle_bound`.

    With vertex colours or textures it is a bound of each pixel, as of `pixel_bound`.

    Parameters
    ----------
    scene : Scene
        The drawn scene.
    renderer : Renderer
        Geometry and shading.
    sent : SceneTriangles
        The scene's triangles.
    raster : Raster
        Spans of the exact picture.

    Returns
    -------
    float, or float64 array of shape (height, width, 3), or None
        In LSB of linear light. ``None``: no bound is known, as for methods other than ``quotient``.
    """
    design = renderer.design
    if design.specular is None:
        return None
    if design.albedo is not None:
        return design.interpolator.bound(_TrianglePixelBounds(scene, renderer, sent, raster))
    return design.interpolator.bound(_TriangleBounds(scene, renderer, sent))


def encoded_bound(bound: ArrayLike, least: ArrayLike, transfer: str) -> float:
    """Bound in LSB of a transfer's codes, from a bound in LSB of linear light.

    Before the transfer a colour is off by at most e. This is the bound, without the half LSB for the rounding
    of the pixel, but with 1/128 LSB for the rounding of the transfer's input. The slope of the transfer never
    rises. So the bound is the slope at the least colour that may occur, times e, plus the half LSB of the
    code.

    Parameters
    ----------
    bound : float, or float64 array
        Bound of `error_bound`, or bounds of pixels. At least a pixel is needed.
    least : float, or float64 array of the same shape
        The least exact channel of the frame, or the exact channels of pixels: linear light in [0, 1].
    transfer : str
        One of `TRANSFERS`.

    Source: docs/theory/textures.md#transfer.
    """
    bound, least = np.asarray(bound), np.asarray(least)
    if transfer == "linear":
        return float(bound.max())
    error = bound - 0.5 + Transfer.OPERAND_FORMAT.step / 2
    return float((slope(np.maximum(least - error / 255, 0), transfer) * error + 0.5).max())


@dataclass(frozen=True)
class _Bounds:
    """Bounds the error of a frame with specular light, see `ErrorBounds`."""

    scene: Scene
    design: ShadingPipeline
    cut: Raster | None

    def by_vectors(self) -> float | None:
        if self.cut is None or not self.design.lights:
            return None
        return quotient_bound(self.scene, self.design, self.cut)

    def by_tolerance(self) -> float | None:
        return _tolerance_bound(self.scene, self.design)

    def by_budget(self) -> float | None:
        errors = budget_errors(self.scene, self.design)
        return None if errors is None else bound_of(self.scene, errors)


@dataclass(frozen=True)
class _PixelBounds:
    """Bounds the error of each pixel of a frame with albedo, see `ErrorBounds`."""

    scene: Scene
    design: ShadingPipeline
    cut: Raster

    def by_vectors(self) -> np.ndarray | None:
        return self._by(light_errors(self.scene, self.design, self.cut))

    def by_tolerance(self) -> np.ndarray | None:
        brightness = _brightness(self.scene, self.design)
        if brightness is None:
            return None
        # The tolerance holds for the whole light, diffuse and specular together.
        return self._by([LightErrors(np.zeros(3), 5 / 16 / 255 * of) for of in brightness])

    def by_budget(self) -> np.ndarray | None:
        errors = budget_errors(self.scene, self.design)
        return None if errors is None else self._by(errors)

    def _by(self, errors: Sequence[LightErrors]) -> np.ndarray | None:
        albedo = self.design.albedo
        return None if albedo is None else albedo_bound(self.scene, albedo, self.cut, errors)


@dataclass(frozen=True)
class _TriangleBounds:
    """Bounds the error of a picture by triangles, see `ErrorBounds`. No tolerance bounds its spans."""

    scene: Scene
    renderer: Renderer
    sent: SceneTriangles

    def by_vectors(self) -> float | None:
        if not self.renderer.design.lights:
            return None
        return quotient_triangle_bound(self.scene, self.renderer, self.sent)

    def by_tolerance(self) -> float | None:
        return None

    def by_budget(self) -> float | None:
        return None


@dataclass(frozen=True)
class _TrianglePixelBounds:
    """Bounds the error of each pixel of a picture by triangles with albedo, see `ErrorBounds`."""

    scene: Scene
    renderer: Renderer
    sent: SceneTriangles
    raster: Raster

    def by_vectors(self) -> np.ndarray | None:
        scene, albedo = self.scene, self.renderer.design.albedo
        errors = triangle_light_errors(scene, self.renderer, self.sent)
        if errors is None or albedo is None:
            return None
        size = scene.width, scene.height
        attributes = AttributeErrors.of_triangles(self.renderer, self.sent, size)
        return albedo_bound(scene, albedo, self.raster, errors, attributes)

    def by_tolerance(self) -> None:
        return None

    def by_budget(self) -> None:
        return None


def _tolerance_bound(scene: Scene, design: ShadingPipeline) -> float | None:
    """Bound from the tolerances of cut spans, as `error_bound` states it."""
    brightness = _brightness(scene, design)
    if brightness is None:
        return None
    largest = float(np.max(brightness))
    return 0.5 + max(largest / 16, 1 / 128) + largest / 4


def budget_errors(scene: Scene, design: ShadingPipeline) -> list[LightErrors] | None:
    """Bounds of the light on each material by ``chord-local``, without the rounding of colour operands.

    Spans are cut so that every pixel keeps the budgets of `LocalChordInterpolator`, divided by the slope of
    the transfer (`HighlightLimits`). To the budgets a term adds

    - the rounding of the diffuse term, 2^-18;
    - the error of the specular unit against its model (`HighlightOperand.error`), and the error of the lines
      of its table, which is measured;
    - the product with the factor of a light that fades, ``3 2^-18``;
    - with a scale of u, the part of a lobe that is left out, a quarter of the table's step.

    Spans of one or two pixels are not checked. The word of u is off by half a step and a cut there, and by
    the relative error 2^-16 of the unit of the words. If the slope of the lobe times this error is over the
    budget, it takes the place of the budget.

    Parameters
    ----------
    scene, design
        As for `error_bound`.

    Returns
    -------
    list of LightErrors, or None
        ``None``: no bound is known, as in `error_bound`.

    Source: docs/theory/chord.md#bound-of-a-frame.
    """
    unit = design.specular
    if unit is None or _brightness(scene, design) is None:
        return None
    method, limits = design.interpolator, HighlightLimits.of(scene, design)
    step = ChordSetup.HIGHLIGHT_FORMAT.step / 2 + LocalChordInterpolator.COSINE_FORMAT.step
    left_out = Lobe.VALUE_FORMAT.step / 4 if method.scale else 0
    found = []
    for material in scene.materials:
        parameter = design.highlight_parameter(material)
        u, _, slopes = curve_lines(unit.reflection, parameter)
        # A slope belongs to the interval up to the next argument.
        words = float((slopes * (np.ldexp(step, -method.scale) + np.append(u[1:], 1) * 2.0**-16)).max())
        span = max(LocalChordInterpolator.HIGHLIGHT_BUDGET / 255 / limits.slope, words)
        unit_error = unit.error + unit.line_error(parameter) + left_out
        diffuse = LocalChordInterpolator.DIFFUSE_BUDGET / 255 / limits.slope
        sums = LightErrors(*np.zeros((2, 3)))
        for light in () if material.unlit else scene.lights:
            reflection = material.reflection(distant_cosine(light, scene.distant_viewer))
            color = np.array(light.color)
            # The budgets of a light that fades hold for its own brightness.
            inner = color / max(1.0, *light.color) if light.fades else color
            product = 3 * 2.0**-18 * light.fades
            sums.diffuse[:] += np.multiply(material.diffuse, diffuse * inner + 2.0**-18 * color)
            sums.highlight[:] += np.multiply(reflection, span * inner + (unit_error + product) * color)
        found.append(sums)
    return found


def _brightness(scene: Scene, design: ShadingPipeline) -> list[np.ndarray] | None:
    """Largest light of all lights on each material, shape (3,); ``None`` where spans have no tolerance."""
    assert design.specular is not None
    model = design.specular.reflection
    made = design.for_materials(scene.materials)
    if made.interpolator != design.interpolator:
        return None
    if design.loads_tables:
        own = made.lobe
        if model.name not in TABLE_MODELS or replace(own, banks=design.banks) != design.lobe:
            return None
        parameters = [design.highlight_parameter(material) for material in scene.materials]
        if model.PARAMETER == "roughness" and min(of or 0 for of in parameters) < LEAST_ROUGHNESS:
            return None
        if design.interpolator.value_setup is None and own.scale_of(parameters):
            return None
    viewer, brightness = scene.distant_viewer, []
    for material in scene.materials:
        total = np.zeros(3)
        for light in () if material.unlit else scene.lights:
            reflected = material.diffuse + material.reflection(distant_cosine(light, viewer))
            total += light.color * reflected
        brightness.append(total)
    return brightness
