"""Errors of a frame against its method in float64, exact interpolation and exact shading.

Frames are compared as they are encoded: in the space of the codes of the design's transfer.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields, replace
from time import perf_counter
from typing import Any

import numpy as np

from blysk.golden.frames.border import border_mask, border_name, highlight_step
from blysk.golden.frames.error_bound import encoded_bound, error_bound, pixel_bound, triangle_bound
from blysk.golden.frames.frame import Picture
from blysk.golden.frames.local import line_ends, local_operands
from blysk.golden.geometry.scene_triangles import SceneTriangles
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.metrics import ErrorFigures, error_figures, error_map, mnse_published, nmse
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.reflection import BLINN, ReflectionModel
from blysk.golden.reference.renderer import (
    render,
    shade_operands,
    shade_spans,
    visible_mask,
)
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import encode_frame
from blysk.golden.render import Renderer

__all__ = [
    "Comparison",
    "FrameErrors",
    "compare",
    "compare_image",
    "compare_triangles",
    "method_in_float64",
    "target_of",
]

_PIXELS_AT_ONCE = 1 << 20
"""Pixels of a part of a frame."""


@dataclass(frozen=True)
class FrameErrors(ErrorFigures):
    """Errors of a frame: `ErrorFigures` of all shown pixels, and the largest error off and at the border.

    An LSB is a step of the codes of the frame, which are encoded by the transfer of its design.

    Parameters
    ----------
    max_lsb, p999_lsb, rmse_lsb, psnr_db : float
        See `ErrorFigures`.
    steady_lsb : float
        Largest error of the pixels off every border, see `border_mask`; 0 without these pixels.
    border_lsb : float
        Largest error of the pixels at a border; 0 without these pixels.
    """

    steady_lsb: float
    border_lsb: float


@dataclass(frozen=True)
class Comparison:
    """Errors of a frame over the pixels that show the surface, in the space of the frame's codes.

    Off the border of every light the method error has a bound, see `error_bound` and `encoded_bound`.

    Parameters
    ----------
    golden : float64 array, shape (height, width, 3)
        The exact frame with the frame's model, in [0, 1], encoded by the transfer. Every pixel has a
        perspective-correct, normalised normal of the rasterised triangles.
    arithmetic_error : FrameErrors
        Against the same method and model in float64; NaN if the spans are unknown.
    method_error : FrameErrors
        Against ``golden``.
    total_error : FrameErrors
        Against the exact frame with the model ``target``.
    target : str
        Name of this model, see `target_of`.
    transfer : str
        Transfer of the frame's design; `SPACES` names the space of its codes.
    bound_lsb : float or None
        Bound of ``method_error.steady_lsb``, see `encoded_bound`; ``None`` if the spans are unknown.
    visible_pixels : int
        Pixels that show the surface.
    border : str
        Quantities that are near 0 at a border, such as ``"|N.L|"`` or ``"|N.L| or |N.H|"``, see
        `border_name`.
    step_lsb : float
        See `highlight_step`; in LSB of linear light.
    border_pixels : int
        Visible pixels at a border.
    nmse : float
        Normalised mean squared error against the exact frame.
    mnse_published, mnse_published_share : float
        MNSE as published in [T], against the exact frame, and the share of values where it is defined.
    seconds : float
        Time to compute the three golden frames.
    """

    golden: np.ndarray
    arithmetic_error: FrameErrors
    method_error: FrameErrors
    total_error: FrameErrors
    target: str
    transfer: str
    bound_lsb: float | None
    visible_pixels: int
    border: str
    step_lsb: float
    border_pixels: int
    nmse: float
    mnse_published: float
    mnse_published_share: float
    seconds: float


def method_in_float64(scene: Scene, design: ShadingPipeline, raster: Raster) -> np.ndarray:
    """A frame by the method, the model and the transfer of a pipeline, in exact arithmetic.

    Parameters
    ----------
    scene, design
        The scene, and the pipeline that draws it.
    raster : Raster
        The spans. Wide spans are cut.

    Returns
    -------
    float64 array, shape (height, width, 3)
        In [0, 1].
    """
    return encode_frame(design.interpolator.exact_frame(_Shading(scene, design, raster)), design.transfer)


@dataclass(frozen=True)
class _Shading:
    """Shades a frame in exact arithmetic, see `ExactShading`."""

    scene: Scene
    design: ShadingPipeline
    raster: Raster

    def by_normals(self) -> np.ndarray:
        method, model = self.design.interpolator, _model_of(self.design)
        return shade_spans(self.scene, self.raster, method.exact_normals, model, method.uses_chord)

    def by_lines(self) -> np.ndarray:
        left, right = line_ends(self.raster)
        line = replace(self.raster, normal_left=left, normal_right=right)
        return replace(self, raster=line).by_normals()

    def by_values(self, exact_operands: Callable[..., tuple[np.ndarray, ...]]) -> np.ndarray:
        scene, raster, scale = self.scene, self.raster, self.design.interpolator.scale
        fading = [index for index, light in enumerate(scene.lights) if light.fades]
        values, factors = local_operands(scene, raster, factors=fading, scale=scale)
        cosine, one_minus_cosine, *given = exact_operands(values, raster.length, factors)
        factor = None
        if given:
            factor = np.ones(cosine.shape)
            factor[:, fading] = given[0]
        return shade_operands(scene, raster, cosine, 1 - one_minus_cosine, _model_of(self.design), factor)


def _model_of(design: ShadingPipeline) -> ReflectionModel:
    if design.specular is None:
        raise ValueError("a design without specular light has no reflection model to compare with")
    return design.specular.reflection


def target_of(design: ShadingPipeline) -> ReflectionModel:
    """Model of the exact frame of the total error: Blinn's power, or a lobe's own model.

    The other models approximate Blinn's power. A lobe is a table of its own model.
    """
    return _model_of(design) if design.loads_tables else BLINN


def compare(scene: Scene, design: ShadingPipeline, frame: Picture) -> Comparison:
    """Errors of a frame against three frames of the golden renderer. NaN if the frame shows no surface.

    Parameters
    ----------
    scene, design
        The scene, and the pipeline that drew it. After a specialisation, the full scene and pipeline.
    frame : Picture
        The frame of the pipeline.
    """
    if scene.has_albedo:
        pixels = pixel_bound(scene, design, frame.cut_raster)
        return _compare(scene, design, frame.image, frame.raster, frame.cut_raster, pixels)
    bound = error_bound(scene, design, frame.cut_raster)
    return _compare(scene, design, frame.image, frame.raster, frame.cut_raster, bound)


def compare_triangles(
    scene: Scene, renderer: Renderer, sent: SceneTriangles, image: np.ndarray
) -> Comparison:
    """Errors of a picture by triangles, with the bound of the method ``quotient``.

    The bound holds where the picture shows the triangle that the exact picture shows, see
    `quotient_triangle_bound`. Other methods have no known bound.

    Parameters
    ----------
    scene : Scene
        The drawn scene.
    renderer : Renderer
        Geometry and shading.
    sent : SceneTriangles
        The scene's triangles.
    image : uint8 array, shape (height, width, 3)
        The frame buffer.
    """
    raster = rasterise(scene)
    if len(raster.level):
        # The exact picture has the level of each triangle, too.
        raster = replace(raster, level=sent.levels[raster.triangle].astype(raster.level.dtype))
    bound = triangle_bound(scene, renderer, sent, raster)
    return _compare(scene, renderer.design, image, raster, None, bound)


def compare_image(scene: Scene, design: ShadingPipeline, image: np.ndarray) -> Comparison:
    """Errors of a picture with unknown spans, without an arithmetic error.

    Parameters
    ----------
    scene, design
        As for `compare`.
    image : uint8 array, shape (height, width, 3)
        The frame buffer.
    """
    return _compare(scene, design, image, rasterise(scene), None, None)


def _compare(
    scene: Scene,
    design: ShadingPipeline,
    image: np.ndarray,
    raster: Raster,
    cut_raster: Raster | None,
    bound: float | np.ndarray | None,
) -> Comparison:
    """Comparison by float64 frames, one at a time, as a large frame has 400 MB."""
    nothing = FrameErrors(*[math.nan] * len(fields(FrameErrors)))
    mask, model = visible_mask(scene, raster), _model_of(design)
    target = target_of(design)
    transfer = design.transfer
    figures: dict[str, Any] = {"target": target.name, "transfer": transfer, "arithmetic_error": nothing}
    figures["step_lsb"] = highlight_step(scene, model)
    figures["border"] = border_name(scene, model)
    seconds = 0.0
    pixels = np.flatnonzero(mask)
    image = image.reshape(-1, 3)[pixels]

    def timed(made: Callable[..., Any], *settings: Any) -> Any:
        nonlocal seconds
        start = perf_counter()
        result = made(*settings)
        seconds += perf_counter() - start
        return result

    border = timed(border_mask, scene, raster, model).reshape(-1)[pixels]
    figures |= {"visible_pixels": len(pixels), "border_pixels": int(np.count_nonzero(border))}

    if cut_raster is not None and mask.any():
        same_method = timed(method_in_float64, scene, design, cut_raster).reshape(-1, 3)[pixels]
        figures["arithmetic_error"] = _errors(image, same_method, border)
        del same_method
    if target != model and mask.any():
        exact = encode_frame(timed(render, scene, "phong", target, raster).image, transfer)
        exact = exact.reshape(-1, 3)[pixels]
        figures["total_error"] = _errors(image, exact, border)
        figures |= _mean_squares(image, exact)
        del exact
    golden = timed(render, scene, "phong", model, raster).image
    exact = golden.reshape(-1, 3)
    if isinstance(bound, np.ndarray):
        bound = bound.reshape(-1, 3)
        parts = _parts(pixels[~border])
        figures["bound_lsb"] = max(
            (encoded_bound(bound[part], exact[part], transfer) for part in parts), default=None
        )
    elif bound is None:
        figures["bound_lsb"] = None
    else:
        least = min((float(exact[part].min()) for part in _parts(pixels)), default=1.0)
        figures["bound_lsb"] = encoded_bound(bound, least, transfer)
    golden = encode_frame(golden, transfer)
    if not mask.any():
        figures |= dict.fromkeys(("method_error", "total_error"), nothing)
        figures |= dict.fromkeys(("nmse", "mnse_published", "mnse_published_share"), math.nan)
        return Comparison(golden=golden, seconds=seconds, **figures)
    exact = golden.reshape(-1, 3)[pixels]
    figures["method_error"] = _errors(image, exact, border)
    if target == model:
        figures["total_error"] = figures["method_error"]
        figures |= _mean_squares(image, exact)
    return Comparison(golden=golden, seconds=seconds, **figures)


def _parts(pixels: np.ndarray) -> Iterator[np.ndarray]:
    """Indices of pixels part by part, as a large frame has 400 MB."""
    for start in range(0, len(pixels), _PIXELS_AT_ONCE):
        yield pixels[start : start + _PIXELS_AT_ONCE]


def _errors(image: np.ndarray, exact: np.ndarray, border: np.ndarray) -> FrameErrors:
    """Errors of an image against a frame in [0, 1]; ``border`` marks the pixels at the border of a light."""
    figures = error_figures(image, exact, scale=255)
    worst = error_map(image[np.newaxis], exact[np.newaxis])[0]
    parts = (float(worst[of].max(initial=0)) for of in (~border, border))
    return FrameErrors(*asdict(figures).values(), *parts)


def _mean_squares(image: np.ndarray, exact: np.ndarray) -> dict[str, float]:
    """Normalised mean squared errors of pixels. The pixels of the approximated model are overwritten."""
    exact *= 255
    published, share = mnse_published(image, exact)
    return {
        "nmse": nmse(image, exact),
        "mnse_published": published,
        "mnse_published_share": share,
    }
