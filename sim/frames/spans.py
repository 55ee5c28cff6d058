"""From the rasteriser's spans to the pipeline's: cut where too wide, and quantised."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator, SpanValues
from blysk.golden.number.spans import pixels_of, runs_of
from blysk.golden.number.unit_vector import ONE_SQUARED, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = ["cut_local_spans", "cut_wide_spans", "local_values", "quantise_spans", "sort_by_material"]

# Spans worked on at once; bounds the memory, changes no result.
_CHUNK = 1 << 16


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
        out_of_range = (np.einsum("ij,ij->i", left, right) < cosine) & (last > first)
        # A whole span bends evenly; a part of two pixels has nothing between them.
        part = np.flatnonzero((last - first > 1) & (last - first < raster.length[origin] - 1) & ~out_of_range)
        if len(part) and largest_bend < math.inf:
            own = normals(origin[part], (first[part] + last[part]) / 2)
            bend = np.linalg.norm(own - normalise(left[part] + right[part]), axis=-1)
            out_of_range[part[bend > largest_bend]] = True
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
            weights, line = _along(raster, origin, place / steps)
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


def _along(raster: Raster, span: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights and normals, not of unit length, at places of spans; both linear along a span."""
    t = t[:, np.newaxis]
    weights = (1 - t) * raster.weights_left[span] + t * raster.weights_right[span]
    left = raster.magnitude_left[span][:, np.newaxis] * raster.normal_left[span]
    right = raster.magnitude_right[span][:, np.newaxis] * raster.normal_right[span]
    return weights, (1 - t) * left + t * right


@dataclass(frozen=True)
class _Places:
    """What places on the surface have: N and V (count, 3); f, u (count, lights); L (lights, count, 3)."""

    normal: np.ndarray
    viewer: np.ndarray
    direction: np.ndarray
    diffuse: np.ndarray
    highlight: np.ndarray

    @classmethod
    def at(cls, scene: Scene, raster: Raster, span: np.ndarray, t: np.ndarray) -> "_Places":
        """Those of spans, at t of each."""
        weights, line = _along(raster, span, t)
        # Between opposite normals the line passes through 0, where any normal is as good.
        normal = np.where(line.any(axis=1, keepdims=True), normalise(line), raster.normal_left[span])
        share = weights / weights.sum(axis=1, keepdims=True)
        corners = scene.mesh.vertices[scene.mesh.faces[raster.triangle[span]]]
        points = np.einsum("sn,snk->sk", share, corners)
        viewer = np.broadcast_to(scene.view_vectors(points), points.shape)
        direction = np.empty((len(scene.lights), *points.shape))
        for index, light in enumerate(scene.lights):
            direction[index] = light.towards(points)
        halfway = halfway_vector(direction, viewer)
        diffuse = np.einsum("sk,lsk->sl", normal, direction)
        highlight = np.square(normal - halfway).sum(axis=2).T / 2
        highlight = np.where(halfway.any(axis=2).T, highlight, 2.0)
        return cls(normal, viewer, direction, np.clip(diffuse, -1, 1), np.clip(highlight, 0, 2))

    def turned(self, other: "_Places", method: LocalChordInterpolator) -> np.ndarray:
        """Whether a vector turns by more than the method allows from here to there; bool, shape (count,)."""
        least = np.cos(np.radians(method.MAX_VECTOR_ANGLE))
        result = np.einsum("sk,sk->s", self.normal, other.normal) < least
        result |= np.einsum("sk,sk->s", self.viewer, other.viewer) < least
        result |= (np.einsum("lsk,lsk->ls", self.direction, other.direction) < least).any(axis=0)
        move = np.linalg.norm(self.viewer - other.viewer, axis=1)
        move = move + np.linalg.norm(self.direction - other.direction, axis=2)
        total = [np.linalg.norm(place.direction + place.viewer, axis=2) for place in (self, other)]
        return result | (move > method.MAX_HALFWAY_CHANGE * np.minimum(*total)).any(axis=0)


def _chunks(count: int) -> Iterator[slice]:
    for start in range(0, count, _CHUNK):
        yield slice(start, start + _CHUNK)


def cut_local_spans(
    scene: Scene, raster: Raster, interpolator: LocalChordInterpolator | None = None
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
    exponents = np.array([material.exponent for material in scene.materials])
    origin = np.arange(len(raster.length))
    first = np.zeros(len(origin), dtype=np.int64)
    last = raster.length.astype(np.int64) - 1
    settled = []
    while len(origin):
        out_of_range = np.zeros(len(origin), dtype=bool)
        for part in _chunks(len(origin)):
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
        _, line = _along(whole, origin, place / steps)
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
    ends = [_Places.at(scene, raster, origin, place / steps) for place in (first, last)]
    turned = (pixels > 3) & ends[0].turned(ends[1], interpolator)
    out_of_range[several[turned]] = True
    # Of the rest, what lies between tells.
    part = np.flatnonzero(~turned)
    origin, first, last, steps = origin[part], first[part], last[part], steps[part]
    between = [_Places.at(scene, raster, origin, (first + (last - first) * k / 4) / steps) for k in (1, 2, 3)]
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
    for run in runs_of(last - first + 1, _CHUNK):
        span, step = pixels_of((last - first + 1)[run])
        of_pixel = run.start + span
        place = (first[of_pixel] + step) / (raster.length[origin[of_pixel]] - 1)
        exact = _Places.at(scene, raster, origin[of_pixel], place).diffuse
        t = (step / (last - first)[of_pixel])[:, np.newaxis]
        fit = left[of_pixel] + t * (slope[of_pixel] + t * bend[of_pixel])
        wrong = np.where(exact > 0, fit <= bound[of_pixel], fit > -bound[of_pixel])
        # Nearer to 0 no word tells the sign.
        wrong &= (np.abs(exact) > LocalChordSetup.DIFFUSE_FORMAT.step) & lights[of_pixel]
        result |= np.bincount(of_pixel, wrong.any(axis=1), len(origin)) > 0
    return result


def local_values(scene: Scene, raster: Raster, lights: int | None = None) -> SpanValues:
    """What the local chord method needs of each span: exact values of N·L and u at three places, as codes.

    N, L and H are of unit length at each of the three. Where a point light is on the surface itself N·L is 0;
    where there is no half-way vector (``L = -V``) u is 2. A span of two pixels has nothing in the middle: it
    gets the mean, and no bend.

    Parameters
    ----------
    scene : Scene
        Mesh, lights and viewer.
    raster : Raster
        Spans from `cut_local_spans`, in any order.
    lights : int, optional
        Lights of the pipeline, by default those of the scene. Lights that the scene does not have have an
        N·L of 0, and are dark.
    """
    count = len(scene.lights) if lights is None else lights
    spans = np.arange(len(raster.length))
    diffuse, highlight = np.zeros((2, len(spans), count, 3))
    # Of a span of one pixel the first value is all three; of two, there is none in the middle.
    for place, t, pixels in ((0, 0.0, 1), (2, 1.0, 2), (1, 0.5, 3)):
        has = spans[raster.length >= pixels]
        lacks = spans[raster.length < pixels]
        for values in (diffuse, highlight):
            values[lacks, :, place] = (
                values[lacks, :, ::2].mean(axis=2) if place == 1 else values[lacks, :, 0]
            )
        for part in _chunks(len(has)):
            exact = _Places.at(scene, raster, has[part], np.full(len(has[part]), t))
            diffuse[has[part], : len(scene.lights), place] = exact.diffuse
            highlight[has[part], : len(scene.lights), place] = exact.highlight
    return SpanValues.quantise(diffuse, highlight)


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
