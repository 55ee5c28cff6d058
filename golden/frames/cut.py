"""Cutting of spans that are too wide for an interpolation method."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.frames.local import CHUNK, SurfacePoints, along_spans, chunks
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import pixels_of, runs_of
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.pipeline import Design
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = ["cut_local_spans", "cut_spans", "cut_wide_spans"]


def cut_spans(scene: Scene, raster: Raster, design: Design) -> tuple[Raster, int]:
    """Spans cut as the method of a pipeline needs them, and how many of the given ones were cut.

    Parameters
    ----------
    scene : Scene
        Materials and, for methods that take values, lights and viewer.
    raster : Raster
        Spans from `rasterise`.
    design : Design
        The pipeline.
    """
    interpolator = design.interpolator
    if design.takes_values:
        steepness = [design.steepness(material) for material in scene.materials]
        return cut_local_spans(scene, raster, interpolator, steepness)
    exponents = [design.steepness(material) for material in scene.materials]
    widest = min(map(interpolator.widest_span, exponents))
    return cut_wide_spans(raster, widest, min(map(interpolator.largest_deviation, exponents)))


def cut_wide_spans(
    raster: Raster, largest_angle: float, largest_deviation: float = math.inf
) -> tuple[Raster, int]:
    """Halve spans until the normals at the ends of each are at most an angle apart.

    A part of a span has a curve of its own: along ``normalise((1-t) N_l + t N_r)`` the angle does not grow
    evenly, so that in the middle of the part the span's normal is not quite the middle normal of the part's
    ends. Parts in which the two are further apart than ``largest_deviation`` are halved, too.

    The normals at a cut are those of the span's own curve, ``normalise((1-t) N_l + t N_r)``, at the pixel
    centres on both sides of it. A pixel more or less than half goes to the right. The fragments stay as they
    are, in their order.

    Parameters
    ----------
    raster : Raster
        Spans; replaced are ``x, y, length, triangle, normal_left, normal_right, back, span, offset``.
    largest_angle : float
        Degrees, over 0.
    largest_deviation : float
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
        out_of_range = (np.einsum("ij,ij->i", left, right) < cosine) & (last > first)
        # A whole span bends evenly; a part of two pixels has nothing between them.
        part = np.flatnonzero((last - first > 1) & (last - first < raster.length[origin] - 1) & ~out_of_range)
        if len(part) and largest_deviation < math.inf:
            own = normals(origin[part], (first[part] + last[part]) / 2)
            bend = np.linalg.norm(own - normalise(left[part] + right[part]), axis=-1)
            out_of_range[part[bend > largest_deviation]] = True
        if not out_of_range.any():
            break
        middle = (first[out_of_range] + last[out_of_range] + 1) // 2
        parts = [
            (
                origin[~out_of_range],
                first[~out_of_range],
                last[~out_of_range],
                left[~out_of_range],
                right[~out_of_range],
            ),
            (
                origin[out_of_range],
                first[out_of_range],
                middle - 1,
                left[out_of_range],
                normals(origin[out_of_range], middle - 1),
            ),
            (
                origin[out_of_range],
                middle,
                last[out_of_range],
                normals(origin[out_of_range], middle),
                right[out_of_range],
            ),
        ]
        origin, first, last, left, right = (np.concatenate(field) for field in zip(*parts, strict=True))
    result = _parts(raster, origin, first, last, left, right)
    return result, int(np.count_nonzero(np.bincount(origin, minlength=1) > 1))


def _parts(raster, origin, first, last, left, right, has_weights=False) -> Raster:
    """Parts of spans, each of pixels first to last of its origin, in place of the spans."""
    order = np.lexsort((first, origin))
    origin, first, last, left, right = (field[order] for field in (origin, first, last, left, right))
    length = (last - first + 1).astype(np.int32)
    start = np.cumsum(length) - length
    span = np.repeat(np.arange(len(length), dtype=np.int32), length)
    nothing = np.empty((0, 3))
    ends = dict.fromkeys(("weights_left", "weights_right"), nothing)
    ends |= dict.fromkeys(("magnitude_left", "magnitude_right"), nothing[:, 0])
    if has_weights:
        steps = np.maximum(raster.length[origin] - 1, 1)
        for side, place in (("left", first), ("right", last)):
            weights, line = along_spans(raster, origin, place / steps)
            ends |= {f"weights_{side}": weights, f"magnitude_{side}": np.linalg.norm(line, axis=1)}
    return replace(
        raster,
        x=(raster.x[origin] + first).astype(np.int32),
        y=raster.y[origin],
        length=length,
        triangle=raster.triangle[origin],
        normal_left=left,
        normal_right=right,
        **ends,
        back=raster.back[origin],
        span=span,
        offset=(np.arange(len(span)) - start[span]).astype(np.int16),
    )


def cut_local_spans(
    scene: Scene,
    raster: Raster,
    interpolator: LocalChordInterpolator | None = None,
    exponents: Sequence[float] | None = None,
) -> tuple[Raster, int]:
    """Halve spans until quadratics through three values serve every light, with L and H of each pixel's own.

    N·L and u along a span are those of its own normals, ``normalise((1-t) N_l + t N_r)``, and of the places
    on the surface, perspective-correct. A span is halved where

    - a word of `LocalChordSetup` would not hold its value;
    - it has more than three pixels, so that some lie between those that the quadratics go through, and does
      not keep what `LocalChordInterpolator` asks for: how far vectors may turn; the tolerances, that of the
      highlight by the exponent of the span's material and the least u on the span, as it may be coarse where
      it is dark;
    - a light's N·L changes its sign, or nearly, where its highlight shows, and the pixels might not have the
      sign of the exact value at every one of them, unless that is within 2^-25 of 0.

    Of lights that are behind the surface along all of a span only the turn counts.

    A pixel more or less than half goes to the right. The fragments stay as they are, in their order.

    Parameters
    ----------
    scene : Scene
        Mesh, lights, viewer and materials.
    raster : Raster
        Spans from `rasterise`.
    interpolator : LocalChordInterpolator, optional
        The method.
    exponents : sequence of float, optional
        Exponent, or steepness, of each material's highlight. By default the material's exponent.

    Returns
    -------
    raster : Raster
        The same fragments in narrower spans. Their weights are those of their ends; the magnitudes are such
        that ``normalise((1-t) m_l N_l + t m_r N_r)`` is the normal of the span that was cut.
    cut : int
        How many of the given spans were cut.
    """
    interpolator = interpolator or LocalChordInterpolator()
    # The curve of the method's reference, whatever the perspective.
    ones = np.ones(len(raster.length))
    whole = replace(raster, magnitude_left=ones, magnitude_right=ones)
    exponents = np.array(exponents or [material.exponent for material in scene.materials])
    origin = np.arange(len(raster.length))
    first = np.zeros(len(origin), dtype=np.int64)
    last = raster.length.astype(np.int64) - 1
    settled = []
    while len(origin):
        out_of_range = np.zeros(len(origin), dtype=bool)
        for part in chunks(len(origin)):
            exponent = exponents[scene.mesh.material[raster.triangle[origin[part]]]]
            out_of_range[part] = _is_wide(
                scene, whole, interpolator, exponent, origin[part], first[part], last[part]
            )
        settled.append((origin[~out_of_range], first[~out_of_range], last[~out_of_range]))
        origin, first, last = origin[out_of_range], first[out_of_range], last[out_of_range]
        middle = (first + last + 1) // 2
        origin = np.concatenate((origin, origin))
        first, last = np.concatenate((first, middle)), np.concatenate((middle - 1, last))
    origin, first, last = (
        (np.concatenate(field) for field in zip(*settled, strict=True)) if settled else (origin, first, last)
    )
    steps = np.maximum(raster.length[origin] - 1, 1)

    def normals(place):
        _, line = along_spans(whole, origin, place / steps)
        return np.where(line.any(axis=1, keepdims=True), normalise(line), raster.normal_left[origin])

    result = _parts(whole, origin, first, last, normals(first), normals(last), has_weights=True)
    return result, int(np.count_nonzero(np.bincount(origin, minlength=1) > 1))


def _is_wide(scene, raster, interpolator, exponent, origin, first, last) -> np.ndarray:
    """Whether pixels first to last of spans are too many for one quadratic."""
    out_of_range = np.zeros(len(origin), dtype=bool)
    # One pixel never is.
    several = np.flatnonzero(last > first)
    origin, first, last, exponent = origin[several], first[several], last[several], exponent[several]
    steps = raster.length[origin] - 1
    pixels = last - first + 1
    ends = [SurfacePoints.at(scene, raster, origin, place / steps) for place in (first, last)]
    turned = (pixels > 3) & ends[0].turned(ends[1], interpolator)
    out_of_range[several[turned]] = True
    # Of the rest, what lies between tells.
    part = np.flatnonzero(~turned)
    origin, first, last, steps = origin[part], first[part], last[part], steps[part]
    between = [
        SurfacePoints.at(scene, raster, origin, (first + (last - first) * k / 4) / steps) for k in (1, 2, 3)
    ]
    bad = np.zeros(len(part), dtype=bool)
    checked = (pixels[part] > 3)[:, np.newaxis]
    one = float(ONE_SQUARED.values)
    p = LocalChordSetup
    for name, bound, slope_format in (
        ("diffuse", p.diffuse_error, p.DIFFUSE_SLOPE_FORMAT),
        ("highlight", p.highlight_error, p.SLOPE_FORMAT),
    ):
        left, right = (getattr(end, name)[part] for end in ends)
        quarter, middle, other = (getattr(place, name) for place in between)
        # As in `local_values`.
        middle = np.where(pixels[part][:, np.newaxis] == 2, (left + right) / 2, middle)
        bend = 2 * (left + right - 2 * middle)
        slope = right - left - bend
        # A step of the rounding words less than they hold.
        bad |= (np.abs(one * bend) > 2.0 ** (p.CURVATURE_FORMAT.integer_bits - 1) - 2.0**-19).any(axis=1)
        bad |= (np.abs(one * slope) > 2.0 ** (slope_format.integer_bits - 1) - 2.0**-17).any(axis=1)
        miss = np.maximum(
            np.abs(left + slope / 4 + bend / 16 - quarter),
            np.abs(left + slope * 3 / 4 + bend * 9 / 16 - other),
        )
        error = interpolator.MARGIN * miss + bound(np.abs(slope), np.abs(bend))
        # The quadratic at its vertex, if that is on the span.
        place = np.clip(-slope / np.where(bend, 2 * bend, 1.0), 0, 1)
        vertex = left + place * (slope + place * bend)
        least = np.minimum(np.minimum(left, right), vertex)
        if name == "diffuse":
            allowed = interpolator.diffuse_tolerance
            in_front = np.maximum(np.maximum(left, right), vertex) + error >= 0
            checked = checked & in_front
            turns_dark = in_front & (least - error <= 0)
            diffuse = left, slope, bend
        else:
            least = np.maximum(least - miss, 0)
            allowed = interpolator.highlight_tolerance(exponent[part][:, np.newaxis], least)
            turns_dark &= interpolator.is_lit(exponent[part][:, np.newaxis], least)
        bad |= ((error > allowed) & checked).any(axis=1)
    chosen = np.flatnonzero(turns_dark.any(axis=1) & ~bad)
    kept = (origin, first, last, turns_dark, *diffuse)
    bad[chosen] = _mistakes_sign(scene, raster, *(values[chosen] for values in kept))
    out_of_range[several[part[bad]]] = True
    return out_of_range


def _mistakes_sign(scene, raster, origin, first, last, lights, left, slope, bend) -> np.ndarray:
    """Whether N·L of a pixel of a span might have the wrong sign, for the lights that are told."""
    result = np.zeros(len(origin), dtype=bool)
    bound = LocalChordSetup.diffuse_error(np.abs(slope), np.abs(bend))
    for run in runs_of(last - first + 1, CHUNK):
        span, step = pixels_of((last - first + 1)[run])
        of_pixel = run.start + span
        place = (first[of_pixel] + step) / (raster.length[origin[of_pixel]] - 1)
        exact = SurfacePoints.at(scene, raster, origin[of_pixel], place).diffuse
        t = (step / (last - first)[of_pixel])[:, np.newaxis]
        fit = left[of_pixel] + t * (slope[of_pixel] + t * bend[of_pixel])
        wrong = np.where(exact > 0, fit <= bound[of_pixel], fit > -bound[of_pixel])
        # Nearer to 0 no word tells the sign.
        wrong &= (np.abs(exact) > LocalChordSetup.DIFFUSE_FORMAT.step) & lights[of_pixel]
        result |= np.bincount(of_pixel, wrong.any(axis=1), len(origin)) > 0
    return result
