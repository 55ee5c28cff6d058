"""Triangles to spans and fragments: exact coverage, clipping, depth, perspective-correct normals at ends."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from blysk.golden.number.spans import runs_of
from blysk.golden.reference.clipped_triangles import SUBPIXELS, Pieces, clipped_triangles
from blysk.golden.reference.cutout import dropped_fragments
from blysk.golden.reference.faces import face_normals, seen_from_behind
from blysk.golden.reference.geometry import normalise, shares_between, sum_of_components
from blysk.golden.reference.levels import span_levels
from blysk.golden.reference.scene import Scene

__all__ = [
    "SUBPIXELS",
    "Raster",
    "rasterise",
]

# Scanlines or fragments handled at once; bounds the memory, changes no result.
_CHUNK = 1 << 16


@dataclass(frozen=True)
class Raster:
    """The spans and fragments of a scene.

    Spans without a visible pixel are left out. Spans are sorted by triangle, and within a triangle by y;
    fragments are sorted by span, and within a span by x. Every pixel of a span is a fragment, hidden pixels
    included, because hardware shades whole spans.

    Parameters
    ----------
    x, y : int32 arrays, shape (S,)
        First pixel of each span.
    length : int32 array, shape (S,)
        Pixels of each span, 1 to 4095.
    triangle : int32 array, shape (S,)
        Index into the mesh's faces.
    normal_left, normal_right : float64 arrays, shape (S, 3)
        Unit normals at the first and the last pixel centre: vertex normals interpolated
        perspective-correctly and normalised.
    magnitude_left, magnitude_right : float64 arrays, shape (S,)
        Lengths of these normals before they were normalised, divided by W of `Camera.homogeneous`. With them
        the normal between the ends is exactly ``normalise((1-t) m_l N_l + t m_r N_r)``.
    weights_left, weights_right : float64 arrays, shape (S, 3)
        Barycentric coordinates of the two ends in the triangle, divided by W; linear along the span.
    back : bool array, shape (S,)
        Whether the triangle is seen from behind.
    span : int32 array, shape (F,)
        Span of each fragment.
    offset : int16 array, shape (F,)
        Position of the fragment in its span, 0 to length - 1.
    pixel : int32 array, shape (F,)
        ``y * width + x``.
    visible : bool array, shape (F,)
        Whether the fragment is the nearest of its pixel; at equal depth the lowest triangle index counts as
        nearest. Dropped fragments do not count, see `dropped_fragments`.
    triangles : int
        Number of triangles of the mesh. A triangle is drawn if it has spans before the depth test. Else one
        of the next four counters counts it once.
    degenerate : int
        Triangles without area after rounding to 1/256 pixel. A triangle that gets its area only by rounding
        is drawn: it closes the seam between a side and its parts.
    culled : int
        Triangles that are clockwise after rounding, and that the scene leaves out.
    outside : int
        Triangles wholly outside the picture or nearer than the near plane.
    uncovered : int
        Triangles that hold no pixel centre of the picture.
    hidden_spans : int
        Spans that were left out because all of their pixels are hidden or dropped.
    repaired_normals : int
        Ends of spans whose interpolated normal was 0. The face's normal takes its place.
    level : int8 array, shape (S,)
        Level of each span's texture, see `span_levels`. Empty if no face has a texture with several levels.
        Parts of a span have the level of the whole span.
    dropped : int
        Fragments that were dropped before the depth test, as their alpha is under the cutoff.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    triangle: np.ndarray
    normal_left: np.ndarray
    normal_right: np.ndarray
    magnitude_left: np.ndarray
    magnitude_right: np.ndarray
    weights_left: np.ndarray
    weights_right: np.ndarray
    back: np.ndarray
    span: np.ndarray
    offset: np.ndarray
    pixel: np.ndarray
    visible: np.ndarray
    triangles: int
    degenerate: int
    culled: int
    outside: int
    uncovered: int
    hidden_spans: int
    repaired_normals: int
    level: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int8))
    dropped: int = 0


def _counting(counts: np.ndarray) -> np.ndarray:
    """0, 1, ... counts[0] - 1, 0, 1, ... counts[1] - 1, ..."""
    ends = np.cumsum(counts)
    found: np.ndarray = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts, counts)
    return found


def _spans(
    pieces: Pieces, width: int
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Spans in chunks: piece, x, y, length, nearness at the first pixel, step of nearness per pixel."""
    a, b, c = pieces.a, pieces.b, pieces.c
    scaled = pieces.nearness / pieces.area
    step = sum_of_components((a * scaled).T)
    # On one side of a triangle there is one edge, on the other side there are one or two.
    single_left = (a > 0).sum(axis=0) == 1
    side = np.where(single_left, a, -a)
    order = np.stack(
        [
            np.where(side[0] > 0, 0, np.where(side[1] > 0, 1, 2)),
            np.where(side[0] < 0, 0, np.where(side[1] < 0, 1, 2)),
            np.where(side[2] < 0, 2, np.where(side[1] < 0, 1, 0)),
        ]
    )
    # A pixel centre exactly on an edge belongs to the triangle on whose left or top that edge is. E >= 0 on
    # top and left edges, E >= 1 on the others.
    biased = c - ~((a > 0) | ((a == 0) & (b > 0)))
    lines = np.maximum(pieces.high - pieces.low + 1, 0)
    edges = [np.take_along_axis(of, order, axis=0) for of in (np.abs(a), b, biased)]
    for run in runs_of(lines, _CHUNK):
        count = lines[run]
        piece = np.repeat(np.arange(run.start, run.stop), count)
        y = pieces.low[piece] + _counting(count)
        single, one, other = (
            (biased[piece] + b[piece] * y) // slope[piece] for slope, b, biased in zip(*edges, strict=True)
        )
        double = np.minimum(one, other)
        on_left = single_left[piece]
        left = np.maximum(-np.where(on_left, single, double), 0)
        right = np.minimum(np.where(on_left, double, single), width - 1)
        covered = np.flatnonzero(right >= left)
        piece, left, y = piece[covered], left[covered], y[covered]
        nearness = np.zeros(len(piece))
        for edge in range(3):
            value = c[edge][piece] + b[edge][piece] * y + a[edge][piece] * left
            nearness += value * scaled[edge][piece]
        yield piece, left, y, right[covered] - left + 1, nearness, step[piece]


def rasterise(scene: Scene) -> Raster:
    """Spans and fragments of a scene.

    Triangles are clipped against the near plane, projected, and rounded to 1/256 pixel. A pixel belongs to a
    triangle if its centre lies inside, or exactly on a left or top edge. Edge functions are integers. So the
    test is exact, and no pixel of a shared edge is drawn twice or missed. Each scanline's interval comes from
    an exact floor division. Depth is interpolated in float64, linearly on the screen (1/W, or the depth
    itself in the orthographic projection). Fragments under the cutoff of their material are dropped before
    the depth test, see `dropped_fragments`.

    Parameters
    ----------
    scene : Scene
        Scene to be drawn.

    Returns
    -------
    Raster
    """
    mesh, width, height = scene.mesh, scene.width, scene.height
    faces = mesh.faces
    plane = face_normals(mesh)
    homogeneous = scene.camera.homogeneous(mesh.vertices, width, height)
    back = seen_from_behind(scene, plane)

    x, y, w, depth = homogeneous.T
    beyond = np.zeros(len(homogeneous), dtype=np.uint8)
    for bit, of in enumerate((x < 0, x > width * w, y < 0, y > height * w, depth < scene.camera.near)):
        beyond |= of.astype(np.uint8) << bit
    outside = (beyond[faces[:, 0]] & beyond[faces[:, 1]] & beyond[faces[:, 2]]) != 0
    candidates = np.flatnonzero(~outside)
    pieces, left_over, solid = clipped_triangles(scene, candidates, homogeneous)
    present = np.zeros((4, len(faces)), dtype=bool)
    for row, triangles in zip(present, (left_over, solid, pieces.triangle), strict=False):
        row[triangles] = True

    (piece, left, line, length), owner, dropped = _drawn(scene, pieces)
    count = len(piece)
    present[3, pieces.triangle[piece]] = True
    seen = np.zeros(count + 1, dtype=bool)
    # Pixels without a span, whose owner is -1, mark the place behind the last span.
    seen[owner] = True
    kept = np.flatnonzero(seen[:count])
    if (left_over[1:] == left_over[:-1]).any():
        # The pieces of a clipped triangle follow each other; its spans follow y.
        kept = kept[np.lexsort((left[kept], line[kept], pieces.triangle[piece[kept]]))]
    piece, left, line, length = piece[kept], left[kept], line[kept], length[kept]

    triangle = pieces.triangle[piece].astype(np.int32)
    ends = _Ends.empty(len(kept))
    for start in range(0, len(kept), _CHUNK):
        part = slice(start, start + _CHUNK)
        weights = _weights(pieces, piece[part], left[part], line[part], length[part])
        ends.fill(part, scene, triangle[part], back, plane, weights)

    level = np.zeros(0, dtype=np.int64)
    if any(texture.mipmapped for texture in scene.textures.values()):
        level = span_levels(scene, triangle, list(ends.weights), _slopes(pieces, piece))

    span = np.repeat(np.arange(len(length), dtype=np.int32), length)
    first = np.cumsum(length, dtype=np.int32) - length
    offset = np.arange(len(span), dtype=np.int32) - first[span]
    pixel = (line * np.int32(width) + left)[span] + offset
    return Raster(
        x=left,
        y=line,
        length=length,
        triangle=triangle,
        normal_left=ends.normal[0],
        normal_right=ends.normal[1],
        magnitude_left=ends.magnitude[0],
        magnitude_right=ends.magnitude[1],
        weights_left=ends.weights[0],
        weights_right=ends.weights[1],
        back=back[triangle],
        span=span,
        offset=offset.astype(np.int16),
        pixel=pixel,
        visible=owner[pixel] == kept.astype(np.int32)[span],
        triangles=len(faces),
        degenerate=int((present[0] & ~present[1]).sum()),
        culled=int((present[1] & ~present[2]).sum()),
        outside=int(outside.sum() + len(candidates) - present[0].sum()),
        uncovered=int((present[2] & ~present[3]).sum()),
        hidden_spans=count - len(kept),
        repaired_normals=int(ends.lost.sum()),
        level=level.astype(np.int8),
        dropped=dropped,
    )


def _drawn(scene: Scene, pieces: Pieces) -> tuple[np.ndarray, np.ndarray, int]:
    """Piece, first x, y and length of every span, shape (4, spans), and the span of each pixel, or -1.

    Also returns the number of dropped fragments.
    """
    width, height = scene.width, scene.height
    cut_out = np.isin(scene.mesh.material[pieces.triangle], list(scene.cutoffs)) if scene.cutoffs else None
    dropped = 0
    owner = np.full(width * height, -1, dtype=np.int32)
    buffer = np.full(width * height, -np.inf)
    columns = []
    count = 0
    for piece, left, line, length, nearness, step in _spans(pieces, width):
        columns.append(np.stack([piece, left, line, length]).astype(np.int32))
        first_pixel = line * width + left
        for run in runs_of(length, _CHUNK):
            lengths = length[run]
            span = np.repeat(np.arange(len(lengths)), lengths)
            offset = np.arange(len(span)) - (np.cumsum(lengths) - lengths)[span]
            pixel = first_pixel[run][span] + offset
            value = nearness[run][span] + step[run][span] * offset
            if cut_out is not None and cut_out[piece[run]].any():
                which = _dropped(scene, pieces, cut_out, piece[run], left[run], line[run], lengths)
                value[which] = -np.inf
                dropped += int(which.sum())
            # A pixel must be nearer than the stored depth. At equal depth the triangle with the lower index
            # stays. It was drawn before.
            nearer = np.flatnonzero(value > buffer[pixel])
            pixel, value = pixel[nearer], value[nearer]
            np.maximum.at(buffer, pixel, value)
            winner = np.flatnonzero(value == buffer[pixel])[::-1]
            # If a pixel is assigned several times, the last assignment counts. In reversed order it comes
            # from the first span of the chunk.
            owner[pixel[winner]] = span[nearer[winner]] + (count + run.start)
        count += len(piece)
    return np.concatenate([np.zeros((4, 0), dtype=np.int32), *columns], axis=1), owner, dropped


def _dropped(
    scene: Scene,
    pieces: Pieces,
    cut_out: np.ndarray,
    piece: np.ndarray,
    left: np.ndarray,
    line: np.ndarray,
    length: np.ndarray,
) -> np.ndarray:
    """Whether each fragment of spans is dropped, see `dropped_fragments`; ``cut_out`` marks pieces."""
    of = cut_out[piece]
    found = np.repeat(of, length)
    piece, left, line, length = piece[of], left[of], line[of], length[of]
    triangle = pieces.triangle[piece]
    ends = _weights(pieces, piece, left, line, length)
    level = np.zeros(len(piece), dtype=np.int64)
    if any(texture.mipmapped for texture in scene.textures.values()):
        level = span_levels(scene, triangle, ends, _slopes(pieces, piece))
    t = _counting(length) / np.repeat(np.maximum(length - 1, 1), length)
    spans = np.repeat(np.arange(len(length)), length)
    shares = shares_between(ends[0][spans], ends[1][spans], t[:, np.newaxis])
    found[np.flatnonzero(found)] = dropped_fragments(scene, triangle[spans], shares, level[spans])
    return found


class _Ends(NamedTuple):
    """Both ends of spans: weights, unit normals, lengths before normalising, flags of lost normals."""

    weights: np.ndarray
    normal: np.ndarray
    magnitude: np.ndarray
    lost: np.ndarray

    @classmethod
    def empty(cls, count: int) -> "_Ends":
        """Arrays for the ends of some spans."""
        vectors = np.empty((2, 2, count, 3))
        return cls(vectors[0], vectors[1], np.empty((2, count)), np.empty((2, count), dtype=bool))

    def fill(
        self,
        part: slice,
        scene: Scene,
        triangle: np.ndarray,
        back: np.ndarray,
        plane: np.ndarray,
        weights: list[np.ndarray],
    ) -> None:
        """Fill a part by the weighted normals of the corners, and by the face's normal where they cancel."""
        corners = [scene.mesh.normals[of] for of in scene.mesh.faces[triangle].T]
        turn = np.where(back[triangle] & scene.flips[triangle], -1.0, 1.0)
        for side, of_end in enumerate(weights):
            first, second, third = of_end.T
            normal = np.empty_like(of_end)
            for axis in range(3):
                of_axis = first * corners[0][:, axis] + second * corners[1][:, axis]
                # The sum with 0 makes no -0.
                normal[:, axis] = (of_axis + third * corners[2][:, axis]) * turn + 0.0
            magnitude = np.sqrt(sum_of_components(normal * normal))
            # Opposite unit normals leave a remainder of about 1e-16 where they should cancel.
            lost = magnitude <= 1e-12 * sum_of_components(of_end)
            which = np.flatnonzero(lost)
            magnitude[which] = 0.0
            normal[which] = plane[triangle[which]] * turn[which, np.newaxis]
            self.weights[side, part] = of_end
            self.normal[side, part] = normalise(normal)
            self.magnitude[side, part] = magnitude
            self.lost[side, part] = lost


def _weights(
    pieces: Pieces, piece: np.ndarray, x: np.ndarray, y: np.ndarray, length: np.ndarray
) -> list[np.ndarray]:
    """Barycentric coordinates in the mesh's triangle, divided by W, at the first and the last pixel centre.

    Each has the shape (spans, 3).
    """
    found = [np.zeros((len(piece), 3)) for _ in range(2)]
    area, turned = pieces.area[piece], pieces.turned[piece]
    for edge in range(3):
        slope, weight = pieces.a[edge][piece], pieces.weight[edge][piece]
        first = pieces.c[edge][piece] + pieces.b[edge][piece] * y + slope * x
        for weights, value in zip(found, (first, first + slope * (length - 1)), strict=True):
            share = value / area * weight
            if pieces.corner is not None:
                weights += share[:, np.newaxis] * pieces.corner[piece, edge]
            else:
                weights[:, edge] = share
    if pieces.corner is None:
        for weights in found:
            weights[turned, 1:] = weights[turned, :0:-1]
    return found


def _slopes(pieces: Pieces, piece: np.ndarray) -> list[np.ndarray]:
    """Derivatives of `_weights` along x and along y, in pixels, each of shape (count, 3)."""
    corner = pieces.corner
    if corner is None:
        corner = np.eye(3)[np.where(pieces.turned[:, np.newaxis], [0, 2, 1], [0, 1, 2])]
    share = pieces.weight / pieces.area
    return [np.einsum("ep,pek->pk", of * share, corner)[piece] for of in (pieces.a, pieces.b)]
