"""Cutting of spans that are too wide for an interpolation method."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.frames.highlight_limits import HighlightLimits
from blysk.golden.frames.local import chunks, lines_along, weights_along
from blysk.golden.frames.missed import missed_spans
from blysk.golden.frames.pieces import Pieces
from blysk.golden.frames.surface import MOST_TEXELS
from blysk.golden.methods.frame_steps import SpanCutter
from blysk.golden.methods.interpolator import Interpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.geometry import any_component, normalise, sum_of_components
from blysk.golden.reference.levels import texel_places
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = [
    "EXACT_DEPTH_RATIO",
    "cut_by_angle",
    "cut_by_attributes",
    "cut_by_ends",
    "cut_by_error",
    "cut_by_length",
    "cut_spans",
    "cutter_of",
    "split_pairs",
]

_Criterion = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Function of span, first pixel and last pixel: whether this part of the span has to be halved."""

EXACT_DEPTH_RATIO = 128.0
"""Ratio of depths up to which a colour is exact to a part of an LSB."""


def cut_spans(scene: Scene, raster: Raster, design: ShadingPipeline) -> tuple[Raster, int]:
    """Spans cut for the method of a pipeline, and the number of given spans that were cut.

    The normal at a cut is the true normal of the surface, ``normalise((1-t) m_l N_l + t m_r N_r)`` along the
    given span. The rasteriser gives the lengths m. An odd pixel goes to the right half. The fragments and
    their order do not change. For a design with an albedo spans are cut as `cut_by_attributes` cuts, too.

    Parameters
    ----------
    scene : Scene
        Materials, lights and viewer.
    raster : Raster
        Spans from `rasterise`.
    design : ShadingPipeline
        The pipeline.

    Returns
    -------
    raster : Raster
        The same fragments in narrower spans, with the weights and lengths m of their ends.
    cut : int
        Number of given spans that were cut.
    """
    return design.interpolator.cut(cutter_of(scene, raster, design))


@dataclass(frozen=True)
class _Cutter:
    """Cuts the spans of a scene for a design, see `SpanCutter`."""

    scene: Scene
    raster: Raster
    design: ShadingPipeline

    @property
    def _limits(self) -> HighlightLimits:
        return HighlightLimits.of(self.scene, self.design)

    @property
    def _also(self) -> _Criterion | None:
        return None if self.design.albedo is None else _by_attributes(self.scene, self.raster)

    def by_error(self) -> tuple[Raster, int]:
        return cut_by_error(self.scene, self.raster, self.design.interpolator, self._limits, self._also)

    def by_angle(self) -> tuple[Raster, int]:
        widest = min(map(self.design.interpolator.widest_span, self._limits.exponents))
        return cut_by_angle(self.raster, widest, self._also)

    def by_length(self, largest_ratio: float) -> tuple[Raster, int]:
        return cut_by_length(self.raster, largest_ratio, self._also)

    def by_ends(self, largest_ratio: float) -> tuple[Raster, int]:
        return cut_by_ends(self.raster, largest_ratio, self._also)

    def uncut(self) -> Raster:
        if self.design.albedo is None:
            return self.raster
        return cut_by_attributes(self.scene, self.raster)[0]

    def split_pairs(self) -> Raster:
        return split_pairs(self.raster, self._also)

    def missed(self, cut: Raster) -> int:
        return missed_spans(self.scene, cut, self.design.interpolator, self._limits)


def cutter_of(scene: Scene, raster: Raster, design: ShadingPipeline) -> SpanCutter:
    """Ways to cut the spans of a scene for a design. The design's method chooses a way."""
    return _Cutter(scene, raster, design)


def cut_by_angle(raster: Raster, largest_angle: float, also: _Criterion | None = None) -> tuple[Raster, int]:
    """Halve spans of more than two pixels until the angle between their end normals is small enough.

    Parameters
    ----------
    raster : Raster
        Spans.
    largest_angle : float
        Largest angle in degrees, over 0.
    also : callable, optional
        Function of span, first pixel and last pixel: whether to halve this part for another reason.

    Returns
    -------
    raster, cut
        As `cut_spans` returns them.
    """
    cosine = np.cos(np.radians(largest_angle))

    def is_wide(origin: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        left, right = (_normals(raster, origin, place) for place in (first, last))
        wide: np.ndarray = (np.einsum("ij,ij->i", left, right) < cosine) & (last > first)
        return wide

    return _halve(raster, is_wide, also)


def cut_by_attributes(scene: Scene, raster: Raster) -> tuple[Raster, int]:
    """Halve spans until the words of their attributes are exact enough, see `SpanAttributes`.

    A span of several pixels crosses at most `MOST_TEXELS`, and its depths are within `EXACT_DEPTH_RATIO`.

    Parameters
    ----------
    scene : Scene
        Mesh and materials.
    raster : Raster
        Spans.

    Returns
    -------
    raster, cut
        As `cut_spans` returns them.

    Source: docs/theory/textures.md#cuts.
    """
    return _halve(raster, _by_attributes(scene, raster))


def _by_attributes(scene: Scene, raster: Raster) -> _Criterion:
    """The criterion of `cut_by_attributes`."""
    size = texel_places(scene, raster.triangle, raster.level)[2]

    def is_wide(origin: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        steps = np.maximum(raster.length[origin] - 1, 1)
        ends = [weights_along(raster, origin, place / steps) for place in (first, last)]
        depths = [end.sum(axis=1, keepdims=True) for end in ends]
        wide: np.ndarray = (np.maximum(*depths) > EXACT_DEPTH_RATIO * np.minimum(*depths))[:, 0]
        if scene.textures:
            corners = scene.mesh.coordinates[scene.mesh.faces[raster.triangle[origin]]]
            corners = corners - corners[:, :1]
            left, right = (
                np.einsum("sn,snk->sk", end / depth, corners) for end, depth in zip(ends, depths, strict=True)
            )
            wide |= (np.abs(right - left) * size[origin] > MOST_TEXELS).any(axis=1)
        return wide & (last > first)

    return is_wide


def cut_by_length(raster: Raster, largest_ratio: float, also: _Criterion | None = None) -> tuple[Raster, int]:
    """Halve spans until no pixel's N/W is too short compared with the longer end's N/W.

    N/W is short if W differs much along a span, or if the ends are nearly opposite.

    Parameters
    ----------
    raster : Raster
        Spans.
    largest_ratio : float
        Largest length of N/W at an end, divided by the length of N/W at a pixel.
    also : callable, optional
        As for `cut_by_angle`.

    Returns
    -------
    raster, cut
        As `cut_spans` returns them.
    """

    def is_wide(origin: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        steps = np.maximum(raster.length[origin] - 1, 1)
        left, right = (lines_along(raster, origin, place / steps) for place in (first, last))
        change = right - left
        square = np.einsum("sk,sk->s", change, change)
        t = -np.einsum("sk,sk->s", left, change) / np.where(square, square, 1.0)
        nearest = first + np.clip(t, 0, 1) * (last - first)
        # The last pixel before the line's nearest place to 0, and the first pixel after this place.
        places = np.floor(nearest), np.ceil(nearest)
        least = [np.linalg.norm(lines_along(raster, origin, place / steps), axis=1) for place in places]
        longest = np.maximum(np.linalg.norm(left, axis=1), np.linalg.norm(right, axis=1))
        wide: np.ndarray = (np.minimum(*least) * largest_ratio < longest) & (last > first)
        return wide

    return _halve(raster, is_wide, also)


def cut_by_ends(raster: Raster, largest_ratio: float, also: _Criterion | None = None) -> tuple[Raster, int]:
    """Halve spans whose ends N/W differ by more than a ratio in length, or by over 90 degrees in direction.

    Spans of two pixels become two spans of one pixel, whatever their ends.

    Parameters
    ----------
    raster : Raster
        Spans.
    largest_ratio : float
        Largest ratio of the lengths of N/W.
    also : callable, optional
        As for `cut_by_angle`.

    Returns
    -------
    raster, cut
        As `cut_spans` returns them. Spans of two pixels count as cut only if their ends differ by more than
        the limits, or for the other reason.
    """

    def differs(origin: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        steps = np.maximum(raster.length[origin] - 1, 1)
        left, right = (lines_along(raster, origin, place / steps) for place in (first, last))
        squares = [sum_of_components(end * end) for end in (left, right)]
        shorter, longer = (np.sqrt(of(*squares)) for of in (np.minimum, np.maximum))
        wide: np.ndarray = longer > largest_ratio * shorter
        wide |= sum_of_components(left * right) < 0
        wide &= last > first
        return wide if also is None else wide | also(origin, first, last)

    last = raster.length.astype(np.int64) - 1
    wide = _answers(differs, np.arange(len(last)), np.zeros_like(last), last)
    is_wide: _Criterion = lambda *piece: differs(*piece) | (piece[2] - piece[1] == 1)  # noqa: E731
    whole, _ = _halve(raster, is_wide, whole=wide | (last == 1))
    return whole, int(np.count_nonzero(wide))


def split_pairs(raster: Raster, also: _Criterion | None = None) -> Raster:
    """Divide each span of two pixels into two spans, for a method that takes vectors. Other spans stay.

    ``also`` halves spans for another reason, as in `cut_by_angle`.
    """
    return _halve(raster, lambda _, first, last: last - first == 1, also)[0]


def _normals(raster: Raster, span: np.ndarray, place: np.ndarray) -> np.ndarray:
    """True unit normals at places of spans, in pixels, fractions included."""
    return _unit(raster, span, lines_along(raster, span, place / np.maximum(raster.length[span] - 1, 1)))


def _unit(raster: Raster, span: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Unit normals of `lines_along`."""
    # Between opposite normals the line passes through 0, where no normal is better than another.
    return np.where(any_component(line)[:, np.newaxis], normalise(line), raster.normal_left[span])


def _answers(is_wide: _Criterion, *piece: np.ndarray) -> np.ndarray:
    """Whether parts of spans have to be halved: ``is_wide(span, first pixel, last pixel)``, in chunks."""
    wide = np.zeros(len(piece[0]), dtype=bool)
    for part in chunks(len(wide)):
        wide[part] = is_wide(*(of[part] for of in piece))
    return wide


def _halve(
    raster: Raster, is_wide: _Criterion, also: _Criterion | None = None, whole: np.ndarray | None = None
) -> tuple[Raster, int]:
    """Halve spans while ``is_wide(span, first pixel, last pixel)`` or ``also`` with these arguments is true.

    ``whole`` has the answers for whole spans, if they are known. Also returns the number of halved spans.
    """
    origin = np.arange(len(raster.length))
    first = np.zeros(len(origin), dtype=np.int64)
    last = raster.length.astype(np.int64) - 1
    settled = []
    while len(origin):
        if whole is None:
            wide = _answers(is_wide, origin, first, last)
            if also is not None:
                wide |= _answers(also, origin, first, last)
        else:
            wide, whole = whole, None
        settled.append((origin[~wide], first[~wide], last[~wide]))
        origin, first, last = origin[wide], first[wide], last[wide]
        middle = (first + last + 1) // 2
        origin = np.concatenate((origin, origin))
        first, last = np.concatenate((first, middle)), np.concatenate((middle - 1, last))
    if settled:
        origin, first, last = (np.concatenate(field) for field in zip(*settled, strict=True))
    cut = int(np.count_nonzero(np.bincount(origin, minlength=1) > 1))
    return (_parts(raster, origin, first, last) if cut else raster), cut


def _parts(raster: Raster, origin: np.ndarray, first: np.ndarray, last: np.ndarray) -> Raster:
    """Raster of parts of spans: each part has the pixels ``first`` to ``last`` of the span ``origin``."""
    order = np.argsort((origin << LENGTH_BITS) | first)
    origin, first, last = (field[order] for field in (origin, first, last))
    length = (last - first + 1).astype(np.int32)
    start = np.cumsum(length) - length
    steps = raster.length[origin] - 1
    ends = {}
    for side, place in (("left", first), ("right", last)):
        for name in ("normal", "weights", "magnitude"):
            ends[f"{name}_{side}"] = getattr(raster, f"{name}_{side}").take(origin, axis=0)
        # The rasteriser's own ends stay as they are, to the bit.
        inner = np.flatnonzero(place != (0 if side == "left" else steps))
        span, t = origin[inner], place[inner] / steps[inner]
        line = lines_along(raster, span, t)
        ends[f"normal_{side}"][inner] = _unit(raster, span, line)
        ends[f"weights_{side}"][inner] = weights_along(raster, span, t)
        ends[f"magnitude_{side}"][inner] = np.sqrt(sum_of_components(line * line))
    span = np.repeat(np.arange(len(length), dtype=np.int32), length)
    found: Raster = replace(
        raster,
        x=(raster.x[origin] + first).astype(np.int32),
        y=raster.y[origin],
        length=length,
        triangle=raster.triangle[origin],
        **ends,
        back=raster.back[origin],
        level=raster.level[origin] if len(raster.level) else raster.level,
        span=span,
        offset=(np.arange(len(span)) - start[span]).astype(np.int16),
    )
    return found


def cut_by_error(
    scene: Scene,
    raster: Raster,
    interpolator: Interpolator,
    limits: HighlightLimits | None = None,
    also: _Criterion | None = None,
) -> tuple[Raster, int]:
    """Halve spans until the method's curve is near enough to the exact curve for every light.

    Exact N·L and u along a span are computed from its true normals and from the points of the surface,
    perspective-correct. A span is halved if

    - its angle is over the method's `Interpolator.widest_span`;
    - ``chord-local`` would flag it: a word of `ChordSetup` would overflow;
    - an error of ``chord-local`` is over a budget at any of its pixels, see `LocalChordInterpolator`. Spans
      of one or two pixels are not checked;
    - another method has pixels between the places whose values its curve has, and at the places that it
      checks vectors turn too far, or the error of N·L or u is over its tolerance, see `HighlightLimits`. The
      tolerance of u depends on the exponent of the span's material, and on the least u of the span.

    If a light is behind the surface along the whole span, only the angle of the span counts. A light that is
    off has no effect.

    Parameters
    ----------
    scene : Scene
        Mesh, lights, viewer and materials.
    raster : Raster
        Spans.
    interpolator : Interpolator
        The method.
    limits : HighlightLimits, optional
        Tolerances of the materials' highlights. By default they follow from the exponents.
    also : callable, optional
        As for `cut_by_angle`.

    Returns
    -------
    raster, cut
        As `cut_spans` returns them.
    """
    limits, scene = limits or HighlightLimits.of(scene), scene.lit
    cosines = np.cos(np.radians([interpolator.widest_span(exponent) for exponent in limits.exponents]))

    def is_wide(origin: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        material = scene.mesh.material[raster.triangle[origin]]
        left, right = (_normals(raster, origin, place) for place in (first, last))
        wide: np.ndarray = (np.einsum("ij,ij->i", left, right) < cosines[material]) & (last > first)
        rest = np.flatnonzero(~wide & (last - first > 1))
        pieces = Pieces.of(scene, raster, origin[rest], first[rest], last[rest])
        wide[rest] = pieces.miss(interpolator, limits, material[rest])
        return wide

    return _halve(raster, is_wide, also)
