"""From a scene to the triangles that the hardware takes: projection, clipping, rounding, in float64."""

from dataclasses import dataclass, field, replace

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans, whole_texels
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.geometry.triangles import ATTRIBUTE, DEPTH, GRID, FrameSettings, Grid, Triangles
from blysk.golden.reference.faces import planes_of, seen_from_behind
from blysk.golden.reference.levels import texel_places, triangle_levels
from blysk.golden.reference.scene import Scene

__all__ = ["SceneTriangles", "check_texels", "scene_triangles"]

_LARGEST = ATTRIBUTE.max_code
# The depth to which a picture is cleared, minus 1.
_FARTHEST = DEPTH.max_code - 1

_DEEPEST = 1000.0
"""A triangle counts as far if its W is over this multiple of the least W of the frame."""


@dataclass(frozen=True)
class SceneTriangles:
    """The triangles of a scene, ready to be sent.

    Parameters
    ----------
    triangles : Triangles
        In the order of the mesh. The pieces of a clipped triangle follow each other.
    frame : FrameSettings
        The picture.
    source : int64 array, shape (T,)
        Index of the mesh face of each triangle or piece.
    clipped : int
        Number of faces from which the near plane or the guard band cut a part off.
    outside : int
        Number of faces left out because they have no part inside the near plane and the guard band.
    far : int
        Number of triangles that reach to over 1,000 times the least W of the frame, in a perspective. A depth
        is off by up to 16 steps of 2^-24 of the range of 1/W. At r times the least W this is ``r 2^-20`` of
        W. If r is over 1,000, surfaces 0.1 % apart may change places.
    several_levels : int
        Number of triangles in the picture at whose corners the level of the texture differs by more than 1. A
        triangle is drawn with a single level, see `triangle_levels`.
    levels : int64 array, shape (faces,)
        Level of each face of the mesh; 0 without textures.
    """

    triangles: Triangles
    frame: FrameSettings
    source: np.ndarray
    clipped: int
    outside: int
    far: int = 0
    several_levels: int = 0
    levels: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def by_material(self) -> "SceneTriangles":
        """The same triangles sorted by material. Triangles of a material stay in their order."""
        order = np.argsort(self.triangles.material, kind="stable")
        return replace(self, triangles=self.triangles[order], source=self.source[order])


def scene_triangles(
    scene: Scene,
    grid: Grid = GRID,
    limit: int = FrameSettings.limit,
    axes: np.ndarray | None = None,
    surface: AttributeSpans | None = None,
) -> SceneTriangles:
    """Transform a scene's triangles, clip and round them.

    Vertices go through the camera in float64. The near plane and the guard band cut a triangle, so that its
    coordinates fit the grid. Triangles inside both stay whole. Positions are rounded to the nearest step of
    the grid. A normal is divided by W over the largest 1/W of its triangle and rounded to `ATTRIBUTE`. The
    depth is ``-1/W`` in a perspective, or the distance along the line of sight. It is linear on the screen,
    scaled to 0 at the nearest corner of the frame and 2^24 - 2 at the farthest, and rounded.

    Parameters
    ----------
    scene : Scene
        Scene of at most 4095 pixels in width and height. The picture is in the middle of the grid.
    grid : Grid
        Fraction bits of the coordinates.
    limit : int
        `FrameSettings.limit`.
    axes : float64 array, shape (3, 3), optional
        Unit vectors x, y and z of the frame of the normals, see `vector_axes`. ``None``: the scene's frame.
    surface : AttributeSpans, optional
        Attributes of the surface that the triangles bring, see `SurfaceWords`. A mesh without vertex colours
        is white.

    Returns
    -------
    SceneTriangles

    Raises
    ------
    ValueError
        If the picture is too large, the limit out of range, or a triangle crosses too many texels.
    """
    frame = FrameSettings.centred(scene.width, scene.height, back_faces=scene.back_faces, limit=limit)
    mesh = scene.mesh
    homogeneous = scene.camera.homogeneous(mesh.vertices, scene.width, scene.height)
    # The grid's origin is in the middle of the picture.
    homogeneous[:, 0] += frame.left * homogeneous[:, 2]
    homogeneous[:, 1] += frame.top * homogeneous[:, 2]
    normals = mesh.normals if axes is None else mesh.normals @ axes.T
    records = np.concatenate((homogeneous[mesh.faces], normals[mesh.faces]), axis=-1)
    if surface is not None:
        records = np.concatenate((records, _surface_of(scene, surface)), axis=-1)
    source = np.arange(len(records))
    low, high = grid.coordinate.min_code / grid.steps, grid.coordinate.max_code / grid.steps
    # Half a step of the grid is left for the rounding.
    planes = [np.array([0.0, 0.0, 0.0, 1.0, -scene.camera.near])]
    for axis in (0, 1):
        for sign, bound in ((1.0, low), (-1.0, high)):
            plane = np.zeros(5)
            plane[axis], plane[2] = sign, -sign * bound
            planes.append(plane)
    whole = len(records)
    cut = np.zeros(whole, dtype=bool)
    for plane in planes:
        records, source, crossed = _clip(records, source, plane)
        cut[crossed] = True
    order = np.argsort(source, kind="stable")
    records, source = records[order], source[order]
    present = np.zeros(whole, dtype=bool)
    present[source] = True

    w = records[..., 2]
    position = np.rint(records[..., :2] / w[..., np.newaxis] * grid.steps).astype(np.int64)
    position = np.clip(position, grid.coordinate.min_code, grid.coordinate.max_code)
    normal = records[..., 4:7] * (w.min(axis=1, keepdims=True) / w)[..., np.newaxis]
    # Normals of a mesh may be a little longer than 1. Vectors in the frame of a light must not be longer than
    # 1.
    longest = np.linalg.norm(normal, axis=2).max(axis=1)
    beyond = (longest > 1 + ATTRIBUTE.step) & (axes is not None)
    normal[beyond] /= longest[beyond, np.newaxis, np.newaxis]
    depth = -1 / w if scene.camera.projection == "perspective" else records[..., 3]
    near, far = (depth.min(), depth.max()) if len(depth) else (0.0, 1.0)
    depth = (depth - near) * (_FARTHEST / ((far - near) or 1.0))
    triangles = Triangles(
        x=position[..., 0],
        y=position[..., 1],
        depth=np.rint(depth).astype(np.int64),
        normal=np.clip(np.rint(normal * 2.0**ATTRIBUTE.fraction_bits), -_LARGEST, _LARGEST).astype(np.int64),
        material=mesh.material[source].astype(np.int64),
        two_sided=scene.two_sided[source],
    )
    spread, levels = np.zeros(len(source), dtype=np.int64), np.zeros(whole, dtype=np.int64)
    if surface is not None:
        places: dict[str, np.ndarray] = {}
        if surface.coordinates:
            places, levels, spread = _placed(scene, source, records)
        triangles = replace(triangles, surface=_surface_codes(records[..., 7:], w), **places)
    triangles = _turned(scene, triangles, source)
    far = 0
    if scene.camera.projection == "perspective" and len(w):
        far = int((w.max(axis=1) > _DEEPEST * w.min()).sum())
    low, high = position.min(axis=1), position.max(axis=1)
    start, end = (np.array(of) * grid.steps for of in ((frame.left, frame.top), (frame.right, frame.bottom)))
    several = (spread > 1) & ((low < end) & (high > start)).all(axis=1)
    counts = int((cut & present).sum()), int((~present).sum()), far, int(several.sum())
    return SceneTriangles(triangles, frame, source, *counts, levels)


def check_texels(scene: Scene) -> None:
    """Refuse texture coordinates that no base and range of a triangle hold.

    Raises
    ------
    ValueError
        If a face crosses more texels than the largest range holds, or a corner is too far outside a clamped
        image.
    """
    faces = scene.mesh.faces
    _, periodic, size = texel_places(scene, np.arange(len(faces)), np.zeros(len(faces), dtype=np.int64))
    texels = scene.mesh.coordinates[faces] * size[:, np.newaxis]
    most, beyond = (2 << AttributeSpans.LARGEST_RANGE) - 2, AttributeSpans.LARGEST_BASE
    if np.ptp(texels, axis=1).max(initial=0) > most:
        raise ValueError(f"a triangle crosses more than {most} texels; divide the triangles")
    if (~periodic & (np.abs(texels).max(axis=1, initial=0) > beyond)).any():
        raise ValueError(
            f"a corner is over {beyond} texels from the border of a clamped image; divide the triangle"
        )


def _surface_of(scene: Scene, surface: AttributeSpans) -> np.ndarray:
    """Attributes at the corners of each face, shape (faces, 3, attributes)."""
    mesh, found = scene.mesh, []
    if surface.colors:
        found.append(mesh.given_colors)
    if surface.coordinates:
        found.append(mesh.given_coordinates)
    corners: np.ndarray = np.concatenate(found, axis=1)[mesh.faces]
    return corners


def _placed(
    scene: Scene, source: np.ndarray, records: np.ndarray
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Placement of texture coordinates; levels of faces, and spread of each triangle, see `triangle_levels`.

    In ``records`` attributes from -1 to 1 replace the texture coordinates.
    """
    check_texels(scene)
    coordinates = records[..., -2:]
    levels, spread = triangle_levels(scene, source, records[..., :3], coordinates)
    level, periodic, size = texel_places(scene, source, levels[source])
    texels = coordinates * size[:, np.newaxis]
    base, found = whole_texels(texels.min(axis=1), texels.max(axis=1))
    period = AttributeSpans.PERIOD
    moved = np.where(periodic, (base + period // 2) % period - period // 2, base)
    records[..., -2:] = (texels - base[:, np.newaxis]) * np.ldexp(1.0, -found)[:, np.newaxis, np.newaxis]
    return {"base": moved, "range": found, "level": level}, levels, spread


def _surface_codes(attributes: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Codes of ``A s`` and of s at the corners, see `SurfaceWords`; shape (T, 3, attributes + 1)."""
    scale = (SurfaceWords.LARGEST * w.min(axis=1, keepdims=True) / w)[..., np.newaxis]
    words = np.concatenate((attributes * scale, scale), axis=-1)
    codes: np.ndarray = np.rint(words * 2.0**ATTRIBUTE.fraction_bits).astype(np.int64)
    return codes


def _turned(scene: Scene, triangles: Triangles, source: np.ndarray) -> Triangles:
    """Triangles. Triangles without area in the world are turned to the side that their normals face.

    Only rounding gives triangles without area an orientation, and the hardware negates normals by the
    orientation. If the hardware culls, triangles that rounding turns to the front stay, because they may
    close a seam.
    """
    plane, flat = planes_of(scene.mesh)
    chosen = np.flatnonzero(np.isin(source, flat))
    if not len(chosen):
        return triangles
    (dx, ex), (dy, ey) = ((v[chosen, 1:] - v[chosen, :1]).T for v in (triangles.x, triangles.y))
    # y grows downwards. So an area over 0 means clockwise corners, which show the back.
    area = dx * ey - ex * dy
    behind = seen_from_behind(scene, plane)[source[chosen]]
    wrong = np.where(behind, (area < 0) & ~scene.culls[source[chosen]], area > 0)
    values = {}
    for name in triangles.corners:
        values[name] = getattr(triangles, name).copy()
        values[name][chosen[wrong]] = values[name][chosen[wrong]][:, [0, 2, 1]]
    return replace(triangles, **values)


def _clip(
    records: np.ndarray, source: np.ndarray, plane: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut triangles by a plane. Also returns the faces that were cut.

    ``plane`` has four coefficients and a constant. A point is inside if the sum is not negative.
    """
    distance = records[..., :4] @ plane[:4] + plane[4]
    inside = distance >= 0
    count = inside.sum(axis=1)
    kept, kept_source = [records[count == 3]], [source[count == 3]]
    crossed = (count > 0) & (count < 3)
    for corners_inside in (1, 2):
        chosen = np.flatnonzero(count == corners_inside)
        # The corner that is alone on its side becomes the first corner. The winding stays.
        odd = (inside[chosen] == (corners_inside == 1)).argmax(axis=1)
        turn = (odd[:, np.newaxis] + np.arange(3)) % 3
        rows = chosen[:, np.newaxis]
        first, second, third = np.moveaxis(records[rows, turn], 1, 0)
        d_first, d_second, d_third = distance[rows, turn].T
        if corners_inside == 1:
            pieces = [
                (
                    first,
                    _between(first, second, d_first, d_second),
                    _between(first, third, d_first, d_third),
                )
            ]
        else:
            to_second = _between(second, first, d_second, d_first)
            to_third = _between(third, first, d_third, d_first)
            pieces = [(second, third, to_third), (second, to_third, to_second)]
        for piece in pieces:
            kept.append(np.stack(piece, axis=1))
            kept_source.append(source[chosen])
    return np.concatenate(kept), np.concatenate(kept_source), source[crossed]


def _between(inner: np.ndarray, outer: np.ndarray, d_inner: np.ndarray, d_outer: np.ndarray) -> np.ndarray:
    """Intersections of the plane with lines from inner to outer corners.

    They are always computed from the inner corner, so that two triangles that share an edge cut it at the
    same point, to the bit.
    """
    found: np.ndarray = inner + (d_inner / (d_inner - d_outer))[:, np.newaxis] * (outer - inner)
    return found
