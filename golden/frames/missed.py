"""Missed spans: the spans of a frame that a method's curve, or its words, miss."""

from typing import Any

import numpy as np

from blysk.golden.frames.highlight_limits import HighlightLimits
from blysk.golden.frames.local import chunks
from blysk.golden.frames.pieces import Pieces
from blysk.golden.frames.vector_axes import triangle_axes
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.scene_triangles import SceneTriangles
from blysk.golden.geometry.span_adapter import LineAdapter
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.span_attributes import Pieces as HardwarePieces
from blysk.golden.geometry.triangles import ATTRIBUTE
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.golden.geometry.vertex_sort import SortedTriangles
from blysk.golden.methods.interpolator import Interpolator
from blysk.golden.normals.line_setup import LineSetup
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer

__all__ = ["component_error", "missed_pieces", "missed_spans", "nearest", "plane_error"]


def missed_spans(
    scene: Scene, raster: Raster, interpolator: Interpolator, limits: HighlightLimits | None = None
) -> int:
    """Number of spans of a raster in which the method's curve is off by more than the tolerances.

    Parameters
    ----------
    scene, raster, interpolator, limits
        As for `cut_by_error`.
    """
    turn = np.zeros(len(raster.length))
    return int(np.count_nonzero(_missed(scene, raster, interpolator, limits, turn)[0]))


def _missed(
    scene: Scene,
    raster: Raster,
    interpolator: Interpolator,
    limits: HighlightLimits | None,
    turn: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Spans that are off by more than the tolerances, through the method's curve or their normals' words.

    A normal that is turned by e has errors of at most e for N·L and ``sqrt(2u) e + e^2/2`` for u, as
    ``|N - H| = sqrt(2u)``. The signs of N·L are ignored.

    Parameters
    ----------
    scene, raster, interpolator, limits
        As for `cut_by_error`.
    turn : float array, shape (spans,)
        Angle in radians by which the words of a span's normals may be off.

    Returns
    -------
    by_curve, by_words : bool arrays, shape (spans,)
        A span that is ``by_words`` is not also ``by_curve``.
    """
    limits, scene = limits or HighlightLimits.of(scene), scene.lit
    by_curve, by_words = np.zeros((2, len(raster.length)), dtype=bool)
    for origin in chunks(len(raster.length)):
        span = np.arange(len(raster.length))[origin]
        pieces = Pieces.of(scene, raster, span, np.zeros_like(span), raster.length[origin] - 1)
        material = scene.mesh.material[raster.triangle[origin]]
        by_curve[origin], by_words[origin] = pieces.off(interpolator, limits, material, turn[origin])
    return by_curve & ~by_words, by_words


def missed_pieces(scene: Scene, renderer: Renderer, sent: SceneTriangles) -> dict[str, int]:
    """Numbers of pieces whose errors are over the tolerances of `HighlightLimits`, by cause.

    Geometry cuts a span by an angle. The angle bounds the error of a method's curve only if N/W has the same
    length at both ends of a piece. So N·L and u of the curve are compared with their values on the piece's
    own line, at its quarters. `cut_by_error` does the same before it cuts. The quarters give the error in
    between up to a factor, which was found by search, see `HighlightLimits`.

    The words of N/W are off by up to `GradientSetup.error` of the longest normal of the triangle. Divided by
    m, this error is the angle by which a normal of length m turns. If the angle alone is over a tolerance,
    the normals are short.

    Parameters
    ----------
    scene : Scene
        The drawn scene, without point lights and with a distant viewer.
    renderer : Renderer
        Geometry and shading.
    sent : SceneTriangles
        The scene's triangles.

    Returns
    -------
    dict of str to int
        ``missed_pieces``: off by the curve. ``short_normals``: off by the words alone.

    Source: docs/theory/geometry.md#normals.
    """
    drawn, pieces, _ = renderer.geometry.pieces(sent.triangles, sent.frame)
    design = renderer.design
    limits = HighlightLimits.of(scene, design)
    turn = _turn(drawn, pieces, renderer)
    axes = triangle_axes(scene, design)
    raster = _raster(pieces, sent.source[drawn.source], np.eye(3) if axes is None else axes)
    curve, words = _missed(scene, raster, design.interpolator, limits, turn)
    return {"missed_pieces": int(curve.sum()), "short_normals": int(words.sum())}


def component_error(drawn: SortedTriangles, pieces: HardwarePieces, renderer: Renderer) -> np.ndarray:
    """Error bound of the components of N/W at all pixels of each piece: float64 array, shape (S,).

    The corners are rounded, the sums of `GradientSetup` have their error, and the pixel's value is cut.

    Parameters
    ----------
    drawn, pieces : SortedTriangles, Pieces
        From `Geometry.pieces`.
    renderer : Renderer
        Geometry and shading.
    """
    found: np.ndarray = plane_error(drawn, renderer)[pieces.triangle] + SPAN_NORMAL.step
    return found


def plane_error(drawn: SortedTriangles, renderer: Renderer) -> np.ndarray:
    """Bound of the error of an attribute at any pixel of each triangle, before it is cut, shape (T,).

    The corners are rounded, and the sums of `GradientSetup` have their error.

    Parameters
    ----------
    drawn : SortedTriangles
        From `Geometry.pieces`.
    renderer : Renderer
        Geometry and shading.
    """
    steps = renderer.geometry.grid.steps
    rows = np.ptp(drawn.triangles.y, axis=1) / steps
    width = np.maximum(drawn.area / np.maximum(rows, 1 / steps) / steps**2, 1 / steps)
    found: np.ndarray = GradientSetup.error(rows, width) + ATTRIBUTE.step / 2
    return found


def _turn(drawn: SortedTriangles, pieces: HardwarePieces, renderer: Renderer) -> np.ndarray:
    """Angle in radians by which the words may turn a normal of each piece."""
    left, right = pieces.left.values, pieces.right.values
    longest = np.maximum(*(np.linalg.norm(end, axis=1) for end in (left, right)))
    error = np.sqrt(3) * component_error(drawn, pieces, renderer)
    if renderer.geometry.lines:
        error += longest * (2 * np.sqrt(3) * LineAdapter.ERROR + LineSetup.ERROR)
    elif renderer.geometry.vectors:
        change = np.linalg.norm(right - left, axis=1)
        # If vectors are turned, their words may be half as long, and are rounded again.
        factor = 4 if renderer.geometry.rotates else 1
        shortest = np.maximum(longest, VectorAdapter.SHORTEST)
        error += factor * np.sqrt(3) * (shortest + change) * VectorAdapter.ERROR
    found: np.ndarray = np.minimum(error / np.maximum(nearest(left, right), SPAN_NORMAL.step), np.pi)
    return found


def nearest(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Least distance from 0 of straight lines between two points, each of shape (S, 3)."""
    step = right - left
    square = np.einsum("sk,sk->s", step, step)
    t = -np.einsum("sk,sk->s", left, step) / np.where(square, square, 1.0)
    found: np.ndarray = np.linalg.norm(left + np.clip(t, 0, 1)[:, np.newaxis] * step, axis=1)
    return found


def _raster(pieces: HardwarePieces, source: np.ndarray, axes: np.ndarray) -> Raster:
    """Spans of the pieces, without fragments; ``source`` is the mesh's face of each triangle.

    ``axes``, by rows, is the frame of the pieces' normals.
    """
    fields: dict[str, Any] = {}
    sign = np.where(pieces.flip, -1.0, 1.0)[:, np.newaxis]
    for side, end in (("left", pieces.left.values @ axes), ("right", pieces.right.values @ axes)):
        magnitude = np.linalg.norm(end, axis=1)
        fields[f"normal_{side}"] = sign * end / np.where(magnitude, magnitude, 1.0)[:, np.newaxis]
        fields[f"magnitude_{side}"] = magnitude
        # Without point lights the positions of pixels on the surface are not used.
        fields[f"weights_{side}"] = np.full((len(pieces), 3), 1 / 3)
    none = np.zeros(0, dtype=np.int64)
    counts = ("triangles", "degenerate", "culled", "outside", "uncovered", "hidden_spans", "repaired_normals")
    fields |= dict.fromkeys(("span", "offset", "pixel", "visible"), none) | dict.fromkeys(counts, 0)
    return Raster(
        x=pieces.x,
        y=pieces.y,
        length=pieces.length,
        triangle=source[pieces.triangle],
        back=pieces.flip,
        **fields,
    )
