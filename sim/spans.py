"""From the rasteriser's spans to the pipeline's: cut where too wide, and quantised."""

import math
from dataclasses import replace

import numpy as np

from golden.geometry import normalise
from golden.interpolation import interpolate
from golden.pipeline import Spans
from golden.raster import Raster
from golden.unit_vector import quantise

__all__ = ["cut_wide_spans", "quantise_spans", "sort_by_material"]


def cut_wide_spans(
    raster: Raster, largest_angle: float, largest_bend: float = math.inf
) -> tuple[Raster, int]:
    """Halve spans until the normals at the ends of each are at most an angle apart.

    A part of a span has a curve of its own: along ``normalise((1-t) N_l + t N_r)`` the angle does not grow
    evenly, so that in the middle of the part the span's normal is not quite the middle normal of the part's
    ends. Parts in which the two are further apart than ``largest_bend`` are halved, too.

    The normals at a cut are those of the span's own curve, ``normalise((1-t) N_l + t N_r)``, at the pixel
    centres on both sides of it. A pixel more or less than half goes to the right. The fragments stay as they
    are, in their order.

    Parameters
    ----------
    raster : Raster
        Spans; replaced are ``x, y, length, triangle, normal_left, normal_right, back, span, offset``.
    largest_angle : float
        Degrees, over 0.
    largest_bend : float
        Radians, over 0.

    Returns
    -------
    raster : Raster
        The same fragments in narrower spans; the rasteriser's own weights and magnitudes are empty.
    cut : int
        How many of the given spans were cut.
    """
    origin = np.arange(len(raster.length))
    first = np.zeros(len(origin), dtype=np.int64)
    last = raster.length.astype(np.int64) - 1

    def normals(span, offset):
        t = offset / np.maximum(raster.length[span] - 1, 1)
        curve = interpolate("normalised", raster.normal_left[span], raster.normal_right[span], t)
        # Between opposite normals the curve passes through 0, where any normal is as good.
        return np.where(np.any(curve, axis=-1, keepdims=True), curve, raster.normal_left[span])

    left, right = raster.normal_left, raster.normal_right
    cosine = np.cos(np.radians(largest_angle))
    while True:
        wide = (np.einsum("ij,ij->i", left, right) < cosine) & (last > first)
        # A whole span bends evenly; a part of two pixels has nothing between them.
        part = np.flatnonzero((last - first > 1) & (last - first < raster.length[origin] - 1) & ~wide)
        if len(part) and largest_bend < math.inf:
            own = normals(origin[part], (first[part] + last[part]) / 2)
            bend = np.linalg.norm(own - normalise(left[part] + right[part]), axis=-1)
            wide[part[bend > largest_bend]] = True
        if not wide.any():
            break
        middle = (first[wide] + last[wide] + 1) // 2
        parts = [
            (origin[~wide], first[~wide], last[~wide], left[~wide], right[~wide]),
            (origin[wide], first[wide], middle - 1, left[wide], normals(origin[wide], middle - 1)),
            (origin[wide], middle, last[wide], normals(origin[wide], middle), right[wide]),
        ]
        origin, first, last, left, right = (np.concatenate(field) for field in zip(*parts, strict=True))
    order = np.lexsort((first, origin))
    origin, first, last, left, right = (field[order] for field in (origin, first, last, left, right))
    length = (last - first + 1).astype(np.int32)
    start = np.cumsum(length) - length
    span = np.repeat(np.arange(len(length), dtype=np.int32), length)
    nothing = np.empty((0, 3))
    result = replace(
        raster,
        x=(raster.x[origin] + first).astype(np.int32),
        y=raster.y[origin],
        length=length,
        triangle=raster.triangle[origin],
        normal_left=left,
        normal_right=right,
        magnitude_left=nothing[:, 0],
        magnitude_right=nothing[:, 0],
        weights_left=nothing,
        weights_right=nothing,
        back=raster.back[origin],
        span=span,
        offset=(np.arange(len(span)) - start[span]).astype(np.int16),
    )
    return result, int(np.count_nonzero(np.bincount(origin, minlength=1) > 1))


def sort_by_material(raster: Raster, material: np.ndarray) -> Raster:
    """The same spans and fragments, spans of one material after the other.

    Parameters
    ----------
    raster : Raster
        Spans.
    material : int array
        Material of each triangle.
    """
    of_span = material[raster.triangle]
    if not np.any(of_span[1:] < of_span[:-1]):
        return raster
    spans = np.argsort(of_span, kind="stable")
    place = np.empty_like(spans)
    place[spans] = np.arange(len(spans))
    fragments = np.argsort(place[raster.span], kind="stable")
    by_span = ("x", "y", "length", "triangle", "normal_left", "normal_right", "back")
    by_span += ("magnitude_left", "magnitude_right", "weights_left", "weights_right")
    kept = {name: getattr(raster, name) for name in by_span}
    moved = {name: values[spans] if len(values) else values for name, values in kept.items()}
    moved |= {name: getattr(raster, name)[fragments] for name in ("offset", "pixel", "visible")}
    return replace(raster, **moved, span=place[raster.span][fragments].astype(raster.span.dtype))


def quantise_spans(raster: Raster, material: np.ndarray) -> Spans:
    """The pipeline's input beats for a raster, normals in codes of ``SQ(1, 17)``.

    Parameters
    ----------
    raster : Raster
        Spans.
    material : int array
        Material of each triangle.
    """
    return Spans(
        x=raster.x,
        y=raster.y,
        length=raster.length,
        normal_left=quantise(raster.normal_left),
        normal_right=quantise(raster.normal_right),
        material=material[raster.triangle],
    )
