"""Triangles to spans and fragments: exact coverage, clipping, depth, perspective-correct normals at ends."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from blysk.golden.number.spans import runs_of
from blysk.golden.reference.cutout import dropped_fragments
from blysk.golden.reference.faces import face_normals, seen_from_behind
from blysk.golden.reference.geometry import any_component, normalise, shares_between, sum_of_components
from blysk.golden.reference.levels import span_levels
from blysk.golden.reference.scene import Scene

__all__ = [
    "SUBPIXELS",
    "Raster",
    "rasterise",
]

SUBPIXELS = 256
"""Steps in a pixel; projected vertices are rounded to a step."""

# Pixels beyond which a triangle is cut, so that edge functions stay within int64. Coordinates within 2^28
# steps give products within 2^59.
_GUARD = float(2**20)
# Scanlines or fragments handled at once; bounds the memory, changes no result.
_CHUNK = 1 << 20


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


@dataclass(frozen=True)
class _Pieces:
    """Triangles ready to be filled: the mesh's triangles after clipping, all of one winding.

    ``points`` (P, 3, 2) are int64 in 1/256 pixel; ``area`` (P,) is twice the triangle's area, positive;
    ``weight`` (P, 3) is 1 / W, ``nearness`` (P, 3) is linear on the screen and larger when nearer; ``corner``
    (P, 3, 3) holds each corner's barycentric coordinates in the mesh's triangle ``triangle`` (P,).
    """

    points: np.ndarray
    area: np.ndarray
    weight: np.ndarray
    nearness: np.ndarray
    corner: np.ndarray
    triangle: np.ndarray

    def edges(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B and C of each edge function ``A x + B y + C``, shape (P, 3), with x and y in whole pixels.

        Edge i lies opposite corner i. Inside the triangle each function is positive. The sum of the three is
        the area.
        """
        start = self.points[:, [1, 2, 0]]
        end = self.points[:, [2, 0, 1]]
        a = start[..., 1] - end[..., 1]
        b = end[..., 0] - start[..., 0]
        half = SUBPIXELS // 2
        c = a * (half - start[..., 0]) + b * (half - start[..., 1])
        return a * SUBPIXELS, b * SUBPIXELS, c


def _clip(records: np.ndarray, source: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut triangles by one plane: corners with a negative distance are outside."""
    inside = distance >= 0
    count = inside.sum(axis=1)
    kept = [records[count == 3]]
    kept_source = [source[count == 3]]
    for corners_inside in (1, 2):
        chosen = np.flatnonzero(count == corners_inside)
        # The corner that is alone on its side becomes corner 0. The winding stays.
        odd = (inside[chosen] == (corners_inside == 1)).argmax(axis=1)
        order = (odd[:, np.newaxis] + np.arange(3)) % 3
        first, second, third = np.moveaxis(records[chosen[:, np.newaxis], order], 1, 0)
        d_first, d_second, d_third = distance[chosen[:, np.newaxis], order].T

        # Cuts go from the inside to the outside, so that two triangles cut their shared edge in the same
        # bits.
        def cut(near: np.ndarray, far: np.ndarray, d_near: np.ndarray, d_far: np.ndarray) -> np.ndarray:
            place: np.ndarray = near + (d_near / (d_near - d_far))[:, np.newaxis] * (far - near)
            return place

        if corners_inside == 1:
            pieces = [(first, cut(first, second, d_first, d_second), cut(first, third, d_first, d_third))]
        else:
            towards_second = cut(second, first, d_second, d_first)
            towards_third = cut(third, first, d_third, d_first)
            pieces = [(second, third, towards_third), (second, towards_third, towards_second)]
        for piece in pieces:
            kept.append(np.stack(piece, axis=1))
            kept_source.append(source[chosen])
    return np.concatenate(kept), np.concatenate(kept_source)


def _assemble(
    scene: Scene, candidates: np.ndarray, corners: np.ndarray
) -> tuple[_Pieces, np.ndarray, np.ndarray]:
    """Clip, divide and round triangles. Drop triangles without area, and back faces if the scene culls.

    Also returns the mesh triangles with a part left after clipping, and with an area left after rounding.
    The rounded corners decide whether a face is a back face. So a closed surface has a front wherever it has
    a back.
    """
    near = scene.camera.near
    x, y, w, depth = np.moveaxis(corners, -1, 0)
    beyond = (np.maximum(np.abs(x), np.abs(y)) > _GUARD * w) | (depth < near)
    crossing = any_component(beyond)
    whole = ~crossing
    corner = np.broadcast_to(np.eye(3), (len(corners), 3, 3))
    triangle = candidates
    if crossing.any():
        records = np.concatenate((corners[crossing], corner[crossing]), axis=-1)
        source = candidates[crossing]
        records, source = _clip(records, source, records[..., 3] - near)
        for axis in (0, 1):
            for sign in (1, -1):
                records, source = _clip(records, source, _GUARD * records[..., 2] - sign * records[..., axis])
        corners = np.concatenate((corners[whole], records[..., :4]))
        corner = np.concatenate((corner[whole], records[..., 4:]))
        triangle = np.concatenate((candidates[whole], source))
        order = np.argsort(triangle, kind="stable")
        corners, corner, triangle = corners[order], corner[order], triangle[order]
    left_over = triangle

    points = np.rint(corners[..., :2] / corners[..., 2:3] * SUBPIXELS).astype(np.int64)
    first, second = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    weight = 1 / corners[..., 2]
    nearness = weight if scene.camera.projection == "perspective" else -corners[..., 3]
    clockwise = area < 0
    turn = np.where(clockwise[:, np.newaxis], [0, 2, 1], [0, 1, 2])
    rows = np.arange(len(area))[:, np.newaxis]
    solid = area != 0
    # y grows downwards, so an area over 0 is clockwise.
    shown = solid & ~((area > 0) & scene.culls[triangle])
    pieces = _Pieces(
        points=points[rows, turn][shown],
        area=np.abs(area[shown]),
        weight=weight[rows, turn][shown],
        nearness=nearness[rows, turn][shown],
        corner=corner[rows, turn][shown],
        triangle=triangle[shown],
    )
    return pieces, left_over, triangle[solid]


def _counting(counts: np.ndarray) -> np.ndarray:
    """0, 1, ... counts[0] - 1, 0, 1, ... counts[1] - 1, ..."""
    ends = np.cumsum(counts)
    found: np.ndarray = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts, counts)
    return found


def _spans(
    pieces: _Pieces, width: int, height: int
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Spans in chunks: piece, x, y, length, nearness at the first pixel, step of nearness per pixel."""
    a, b, c = pieces.edges()
    # A pixel centre exactly on an edge belongs to the triangle on whose left or top that edge is.
    top_left = (a > 0) | ((a == 0) & (b > 0))
    # E >= 0 on top and left edges, E >= 1 on the others.
    biased = c - ~top_left
    scaled = pieces.nearness / pieces.area[:, np.newaxis]
    step = sum_of_components(a * scaled)
    half = SUBPIXELS // 2
    low = np.maximum(-((half - pieces.points[..., 1].min(axis=1)) // SUBPIXELS), 0)
    high = np.minimum((pieces.points[..., 1].max(axis=1) - half) // SUBPIXELS, height - 1)
    lines = np.maximum(high - low + 1, 0)
    for run in runs_of(lines, _CHUNK):
        count = lines[run]
        piece = np.repeat(np.arange(run.start, run.stop), count)
        y = np.repeat(low[run], count) + _counting(count)
        left = np.zeros(len(piece), dtype=np.int64)
        right = np.full(len(piece), width - 1, dtype=np.int64)
        for edge in range(3):
            slope = a[piece, edge]
            value = biased[piece, edge] + b[piece, edge] * y
            bound = value // np.where(slope == 0, 1, np.abs(slope))
            np.maximum(left, -bound, out=left, where=slope > 0)
            np.minimum(right, bound, out=right, where=slope < 0)
            np.copyto(right, -1, where=(slope == 0) & (value < 0))
        covered = np.flatnonzero(right >= left)
        piece, left, y = piece[covered], left[covered], y[covered]
        nearness = np.zeros(len(piece))
        for edge in range(3):
            value = c[piece, edge] + b[piece, edge] * y + a[piece, edge] * left
            nearness += value * scaled[piece, edge]
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
    outside = np.zeros(len(faces), dtype=bool)
    for beyond in (x < 0, x > width * w, y < 0, y > height * w, depth < scene.camera.near):
        outside |= beyond[faces[:, 0]] & beyond[faces[:, 1]] & beyond[faces[:, 2]]
    candidates = np.flatnonzero(~outside)
    pieces, left_over, solid = _assemble(scene, candidates, homogeneous[faces[candidates]])
    present = np.zeros((4, len(faces)), dtype=bool)
    for row, triangles in zip(present, (left_over, solid, pieces.triangle), strict=False):
        row[triangles] = True

    (piece, left, line, length), owner, dropped = _drawn(scene, pieces)
    count = len(piece)
    present[3, pieces.triangle[piece]] = True
    seen = np.zeros(count, dtype=bool)
    seen[owner[owner >= 0]] = True
    kept = np.flatnonzero(seen)
    if (left_over[1:] == left_over[:-1]).any():
        # The pieces of a clipped triangle follow each other; its spans follow y.
        kept = kept[np.lexsort((left[kept], line[kept], pieces.triangle[piece[kept]]))]
    renumbered = np.full(count + 1, -1, dtype=np.int32)
    renumbered[kept] = np.arange(len(kept), dtype=np.int32)
    owner = renumbered[owner]
    piece, left, line, length = piece[kept], left[kept], line[kept], length[kept]

    triangle = pieces.triangle[piece].astype(np.int32)
    span_back = back[triangle]
    turn = np.where(span_back & scene.flips[triangle], -1.0, 1.0)
    fallback = plane[triangle] * turn[:, np.newaxis]
    corners = mesh.normals[faces[triangle]] * turn[:, np.newaxis, np.newaxis]
    ends = [
        _end(corners, fallback, _weights(pieces, piece, column, line)) for column in (left, left + length - 1)
    ]

    level = np.zeros(0, dtype=np.int64)
    if any(texture.mipmapped for texture in scene.textures.values()):
        level = span_levels(scene, triangle, [end.weights for end in ends], _slopes(pieces, piece))

    offset = _counting(length).astype(np.int16)
    span = np.repeat(np.arange(len(length), dtype=np.int32), length)
    pixel = np.repeat(line * width + left, length)
    pixel += offset
    return Raster(
        x=left,
        y=line,
        length=length,
        triangle=triangle,
        normal_left=ends[0].normal,
        normal_right=ends[1].normal,
        magnitude_left=ends[0].magnitude,
        magnitude_right=ends[1].magnitude,
        weights_left=ends[0].weights,
        weights_right=ends[1].weights,
        back=span_back,
        span=span,
        offset=offset,
        pixel=pixel,
        visible=owner[pixel] == span,
        triangles=len(faces),
        degenerate=int((present[0] & ~present[1]).sum()),
        culled=int((present[1] & ~present[2]).sum()),
        outside=int(outside.sum() + len(candidates) - present[0].sum()),
        uncovered=int((present[2] & ~present[3]).sum()),
        hidden_spans=count - len(kept),
        repaired_normals=sum(int(end.lost.sum()) for end in ends),
        level=level.astype(np.int8),
        dropped=dropped,
    )


def _drawn(scene: Scene, pieces: _Pieces) -> tuple[np.ndarray, np.ndarray, int]:
    """Piece, first x, y and length of every span, shape (4, spans), and the span of each pixel, or -1.

    Also returns the number of dropped fragments.
    """
    width, height = scene.width, scene.height
    cut_out = np.isin(scene.mesh.material[pieces.triangle], list(scene.cutoffs))
    dropped = 0
    owner = np.full(width * height, -1, dtype=np.int32)
    buffer = np.full(width * height, -np.inf)
    columns = []
    count = 0
    for piece, left, line, length, nearness, step in _spans(pieces, width, height):
        columns.append(np.stack([piece, left, line, length]).astype(np.int32))
        first_pixel = line * width + left
        for run in runs_of(length, _CHUNK):
            lengths = length[run]
            offset = _counting(lengths)
            pixel = np.repeat(first_pixel[run], lengths) + offset
            value = np.repeat(nearness[run], lengths) + np.repeat(step[run], lengths) * offset
            if cut_out[piece[run]].any():
                which = _dropped(scene, pieces, cut_out, piece[run], left[run], line[run], lengths)
                value[which] = -np.inf
                dropped += int(which.sum())
            before = buffer[pixel]
            np.maximum.at(buffer, pixel, value)
            # A pixel must be nearer than the stored depth. At equal depth the triangle with the lower index
            # stays. It was drawn before.
            winner = np.flatnonzero((value > before) & (value == buffer[pixel]))[::-1]
            # If a pixel is assigned several times, the last assignment counts. In reversed order it comes
            # from the first span of the chunk.
            index = np.repeat(np.arange(count + run.start, count + run.stop, dtype=np.int32), lengths)
            owner[pixel[winner]] = index[winner]
        count += len(piece)
    return np.concatenate([np.zeros((4, 0), dtype=np.int32), *columns], axis=1), owner, dropped


def _dropped(
    scene: Scene,
    pieces: _Pieces,
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
    ends = [_weights(pieces, piece, column, line) for column in (left, left + length - 1)]
    level = np.zeros(len(piece), dtype=np.int64)
    if any(texture.mipmapped for texture in scene.textures.values()):
        level = span_levels(scene, triangle, ends, _slopes(pieces, piece))
    t = _counting(length) / np.repeat(np.maximum(length - 1, 1), length)
    spans = np.repeat(np.arange(len(length)), length)
    shares = shares_between(ends[0][spans], ends[1][spans], t[:, np.newaxis])
    found[np.flatnonzero(found)] = dropped_fragments(scene, triangle[spans], shares, level[spans])
    return found


class _End(NamedTuple):
    """Ends of spans on one side: weights, unit normals, lengths before normalising, flags of lost normals."""

    weights: np.ndarray
    normal: np.ndarray
    magnitude: np.ndarray
    lost: np.ndarray


def _end(corners: np.ndarray, fallback: np.ndarray, weights: np.ndarray) -> _End:
    """Weighted normals of corners (count, 3, 3), and the fallback where they cancel."""
    normal = np.zeros((len(weights), 3))
    for corner in range(3):
        normal += weights[:, corner, np.newaxis] * corners[:, corner]
    magnitude = np.sqrt(sum_of_components(normal * normal))
    # Opposite unit normals leave a remainder of about 1e-16 where they should cancel.
    lost = magnitude <= 1e-12 * sum_of_components(weights)
    magnitude[lost] = 0.0
    normal[lost] = fallback[lost]
    return _End(weights, normalise(normal), magnitude, lost)


def _weights(pieces: _Pieces, piece: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Barycentric coordinates in the mesh's triangle, divided by W, at pixel centres; shape (count, 3)."""
    a, b, c = pieces.edges()
    result = np.zeros((len(piece), 3))
    for edge in range(3):
        value = c[piece, edge] + b[piece, edge] * y + a[piece, edge] * x
        share = value / pieces.area[piece] * pieces.weight[piece, edge]
        result += share[:, np.newaxis] * pieces.corner[piece, edge]
    return result


def _slopes(pieces: _Pieces, piece: np.ndarray) -> list[np.ndarray]:
    """Derivatives of `_weights` along x and along y, in pixels, each of shape (count, 3)."""
    share = pieces.weight / pieces.area[:, np.newaxis]
    return [np.einsum("pe,pek->pk", of * share, pieces.corner)[piece] for of in pieces.edges()[:2]]
