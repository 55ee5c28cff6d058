"""Errors of a frame against its method in float64, exact interpolation and exact shading."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from time import perf_counter
from typing import Any

import numpy as np

from blysk.golden.frames.frame import Frame
from blysk.golden.frames.local import line_ends, local_operands
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.pipeline import Design
from blysk.golden.reference.metrics import ErrorFigures, error_figures, mnse_published, nmse
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import BLINN, ReflectionModel
from blysk.golden.reference.renderer import render, shade_operands, shade_spans, visible_mask
from blysk.golden.reference.scene import Scene

__all__ = ["Comparison", "compare", "compare_image", "method_in_float64"]


@dataclass(frozen=True)
class Comparison:
    """Errors of a frame over the pixels that show the surface.

    Errors are in proportion to the brightness c of the light: the sum over the lights of colour times diffuse
    and specular reflection, in the largest channel, where 1 is the full channel. With the methods ``chord``,
    ``chord-local`` and ``renormalise``, and where N·L is not within rounding of 0::

        arithmetic_error <= 1/2 + c/16        method_error <= 1/2 + c/16 + c/4       (LSB)

    The half is the rounding of the pixel, the quarter is the tolerance by which spans are cut, and the
    sixteenth holds the rounding of operands and terms.

    Parameters
    ----------
    golden : float64 array, shape (height, width, 3)
        The exact frame with the frame's model, in [0, 1]: per-pixel normals, perspective-correct and
        normalised, of the triangles as rasterised.
    arithmetic_error : ErrorFigures
        Against the same method and model in float64; NaN where the spans are not known.
    method_error : ErrorFigures
        Against ``golden``.
    total_error : ErrorFigures
        Against the exact frame with Blinn's model, or with the model of a lobe's table.
    visible_pixels : int
        Pixels that show the surface.
    nmse : float
        Normalised mean squared error against the exact frame.
    mnse_published, mnse_published_share : float
        MNSE as published in [T], against the exact frame, and the share of values where it is defined.
    seconds : float
        Time to compute the three golden frames.
    """

    golden: np.ndarray
    arithmetic_error: ErrorFigures
    method_error: ErrorFigures
    total_error: ErrorFigures
    visible_pixels: int
    nmse: float
    mnse_published: float
    mnse_published_share: float
    seconds: float


def method_in_float64(scene: Scene, design: Design, raster: Raster) -> np.ndarray:
    """A frame by the method and the model of a pipeline, in exact arithmetic.

    Parameters
    ----------
    scene, design
        What is drawn, and by which pipeline.
    raster : Raster
        The spans, wide ones cut.

    Returns
    -------
    float64 array, shape (height, width, 3)
        In [0, 1].
    """
    interpolator = design.interpolator
    if isinstance(interpolator, ChordInterpolator):
        fading = [index for index, light in enumerate(scene.lights) if light.fades]
        operands = local_operands(scene, raster, factors=fading, scale=interpolator.scale)
        cosine, one_minus_cosine, *given = interpolator.exact_operands(
            operands[0], raster.length, operands[1]
        )
        factor = None
        if given:
            factor = np.ones(cosine.shape)
            factor[:, fading] = given[0]
        return shade_operands(scene, raster, cosine, 1 - one_minus_cosine, _model_of(design), factor)
    if interpolator.takes_line:
        left, right = line_ends(raster)
        raster = replace(raster, normal_left=left, normal_right=right)
    return shade_spans(scene, raster, interpolator.exact_normals, _model_of(design), interpolator.uses_chord)


def _model_of(design: Design) -> ReflectionModel:
    if design.specular is None:
        raise ValueError("a design without specular light has no reflection model to compare with")
    return design.specular.model


def compare(scene: Scene, design: Design, frame: Frame) -> Comparison:
    """Errors of a frame against three frames of the golden renderer; NaN if the frame shows no surface.

    Parameters
    ----------
    scene, design
        What was drawn, and by which pipeline; after a specialisation the full scene and pipeline.
    frame : Frame
        The frame of that pipeline.
    """
    return _compare(scene, design, frame.image, frame.raster, frame.cut_raster)


def compare_image(scene: Scene, design: Design, image: np.ndarray) -> Comparison:
    """Errors of a picture whose spans are not known, so that there is no arithmetic error.

    Parameters
    ----------
    scene, design
        As for `compare`.
    image : uint8 array, shape (height, width, 3)
        The frame buffer.
    """
    return _compare(scene, design, image, rasterise(scene), None)


def _compare(
    scene: Scene, design: Design, image: np.ndarray, raster: Raster, cut_raster: Raster | None
) -> Comparison:
    """Comparison by float64 frames, one at a time, as a large frame has 400 MB."""
    nothing = ErrorFigures(*[math.nan] * len(fields(ErrorFigures)))
    mask, model = visible_mask(scene, raster), _model_of(design)
    target = model if design.loads_tables else BLINN
    figures: dict[str, Any] = {"visible_pixels": int(mask.sum()), "arithmetic_error": nothing}
    seconds = 0.0
    pixels = np.flatnonzero(mask)
    image = image.reshape(-1, 3)[pixels]

    def timed(made: Callable[..., Any], *settings: Any) -> Any:
        nonlocal seconds
        start = perf_counter()
        result = made(*settings)
        seconds += perf_counter() - start
        return result

    if cut_raster is not None and mask.any():
        same_method = timed(method_in_float64, scene, design, cut_raster)
        figures["arithmetic_error"] = error_figures(image, same_method.reshape(-1, 3)[pixels], scale=255)
        del same_method
    if target != model and mask.any():
        exact = timed(render, scene, "phong", target, raster).image.reshape(-1, 3)[pixels]
        figures["total_error"] = error_figures(image, exact, scale=255)
        figures |= _mean_squares(image, exact)
        del exact
    golden = timed(render, scene, "phong", model, raster).image
    if not mask.any():
        return Comparison(golden, nothing, nothing, nothing, 0, math.nan, math.nan, math.nan, seconds)
    exact = golden.reshape(-1, 3)[pixels]
    figures["method_error"] = error_figures(image, exact, scale=255)
    if target == model:
        figures["total_error"] = figures["method_error"]
        figures |= _mean_squares(image, exact)
    return Comparison(golden=golden, seconds=seconds, **figures)


def _mean_squares(image: np.ndarray, exact: np.ndarray) -> dict[str, float]:
    """Normalised mean squared errors against pixels of the approximated model, which are overwritten."""
    exact *= 255
    published, share = mnse_published(image, exact)
    return {
        "nmse": nmse(image, exact),
        "mnse_published": published,
        "mnse_published_share": share,
    }
