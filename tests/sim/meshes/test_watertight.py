"""Closed solids of polygons of all kinds: every side is kept, and no background shows through."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from blysk.golden.frames.compare import compare_image
from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.scene_triangles import scene_triangles
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.renderer import visible_mask
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer
from blysk.sim.meshes.polygons import triangulated

from .files import load, obj_of
from .test_polygons import shoelace, spiral

SIZE = (80, 60)
GREY = (0.5, 0.5, 0.5)


def outline_of(seed, repeated=False):
    """A concave polygon around the origin, with corners on its straight sides."""
    rng = np.random.default_rng(seed)
    points = spiral(int(rng.integers(4, 9)), seed)
    result = []
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        shares = np.sort(rng.uniform(0.05, 0.95, rng.integers(0, 4)))
        result += [start, *(start + share * (end - start) for share in shares)]
        result += result[-1:] * (repeated and rng.random() < 0.3)
    return np.roll(np.array(result), rng.integers(len(result)), axis=0)


def check_sides(triangles, count):
    """Check that each side of the polygon is in one triangle, and each other side in two, in opposite
    directions."""
    sides = Counter((t[k], t[(k + 1) % 3]) for t in triangles for k in range(3))
    alone = {(a, b) for a, b in sides if (b, a) not in sides}
    assert set(sides.values()) == {1}
    assert alone == {(k, (k + 1) % count) for k in range(count)}


@pytest.mark.parametrize("kind", ["straight", "repeated", "warped", "crossing"])
def test_every_side_and_corner_is_kept(kind):
    for seed in range(30):
        rng = np.random.default_rng(seed)
        outline = outline_of(seed, kind == "repeated")
        if kind == "crossing":
            outline = np.round(2 * rng.normal(size=outline.shape))
        height = rng.normal(size=len(outline)) * (kind == "warped")
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        places = np.c_[outline, height] @ turn + 10
        corners, _ = triangulated(places, np.arange(len(outline))[np.newaxis])
        check_sides(corners.tolist(), len(outline))
        areas = np.array([shoelace(outline[triangle]) for triangle in corners]) * np.sign(shoelace(outline))
        if kind == "straight":
            assert areas.min() > 1e-9
        elif kind == "repeated":
            assert areas.min() > -1e-9
            distinct = len(np.unique(outline, axis=0))
            assert (areas > 1e-9).sum() == distinct - 2
        # The flux through a surface equals that through any other surface with its border.
        first, second, third = np.moveaxis(places[corners], 1, 0)
        flux = np.cross(second - first, third - first).sum(axis=0)
        np.testing.assert_allclose(flux, np.cross(places, np.roll(places, -1, axis=0)).sum(axis=0), atol=1e-9)


def prism(outline, heights):
    """Vertices and faces of a closed solid: two polygons, and a wall with four corners on each side."""
    count = len(outline)
    low, high = np.c_[outline, -1 + heights], np.c_[outline, 1 + heights]
    walls = [[k, (k + 1) % count, count + (k + 1) % count, count + k] for k in range(count)]
    caps = [list(range(count))[::-1], list(range(count, 2 * count))]
    return np.concatenate([low, high]), caps + walls


def check_closed(mesh):
    """Check that each side, by position, occurs equally often in both directions."""
    _, place = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)
    faces = place.ravel()[mesh.faces]
    sides = Counter(zip(faces.ravel().tolist(), np.roll(faces, -1, axis=1).ravel().tolist(), strict=True))
    assert all(sides[b, a] == count for (a, b), count in sides.items())


def inside(outline, points):
    """Which points are inside a polygon, and farther than 0.002 from its sides."""
    start, end = outline, np.roll(outline, -1, axis=0)
    side, offset = end - start, points[..., np.newaxis, :] - start
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.einsum("...i,...i->...", offset, side) / np.einsum("...i,...i->...", side, side)
        crossing = offset[..., 0] < side[..., 0] * offset[..., 1] / side[..., 1]
    nearest = offset - np.clip(np.nan_to_num(share), 0, 1)[..., np.newaxis] * side
    above = (start[:, 1] > points[..., 1:]) != (end[:, 1] > points[..., 1:])
    odd = (above & crossing).sum(axis=-1) % 2 == 1
    return odd & (np.linalg.norm(nearest, axis=-1) > 0.002).all(axis=-1)


def silhouette(outline, camera):
    """Pixels whose rays meet the prism, in float64: points of a ray between the planes of its polygons."""
    width, height = SIZE
    basis = np.eye(4)[:3]
    basis = np.concatenate([np.zeros((1, 3)), basis[:, :3]])
    x, y, w, _ = camera.homogeneous(basis, width, height).T
    row, column = np.mgrid[:height, :width] + 0.5
    # A point p with (x_p, y_p) = w_p (column, row) is on the ray: two equations, linear in p.
    first = (x[1:] - x[0]) - column[..., np.newaxis] * (w[1:] - w[0])
    second = (y[1:] - y[0]) - row[..., np.newaxis] * (w[1:] - w[0])
    right = np.stack([column * w[0] - x[0], row * w[0] - y[0]], axis=-1)
    matrix = np.stack([first, second], axis=-2)
    found = np.zeros((height, width), dtype=bool)
    for z in np.linspace(-0.999, 0.999, 30):
        side = right - matrix[..., 2] * z
        found |= inside(outline, np.linalg.solve(matrix[..., :2], side[..., np.newaxis])[..., 0])
    return found


def covered(rows):
    """Pixels of the picture in scanlines of hardware geometry."""
    width, height = SIZE
    edges = np.zeros((height, width + 1), dtype=int)
    np.add.at(edges, (rows.y, rows.x), 1)
    np.add.at(edges, (rows.y, rows.x + rows.length), -1)
    return edges.cumsum(axis=1)[:, :-1] > 0


def check_covered(loaded, outline, away, back_faces):
    """Check that no background shows within the silhouette, in the golden frame and in the coverage of
    hardware geometry."""
    camera = Camera(7 * away / np.linalg.norm(away), (0, 0, 0), projection="perspective")
    material = Material(GREY, GREY, GREY, 10)
    scene = Scene(loaded.mesh, camera, *SIZE, material, (Light((0, 0, 1)),), back_faces=back_faces)
    expected = silhouette(outline, camera)
    assert expected.sum() > 300
    assert visible_mask(scene, rasterise(scene))[expected].all()
    sent = scene_triangles(scene)
    _, rows, _, _ = Geometry().rows(sent.triangles, sent.frame)
    assert covered(rows)[expected].all()


def check_shaded(loaded, away):
    """Check that hardware geometry negates no normal of a triangle that rounding turned over."""
    camera = Camera(7 * away / np.linalg.norm(away), (0, 0, 0), projection="perspective")
    design = preset("linear", "cosquad", 1)
    scene = Scene(loaded.mesh, camera, 160, 120, Material(GREY, GREY, GREY, 10), (Light(away),))
    image = triangle_frame(scene, Renderer(design)).image
    assert compare_image(scene, design, image).method_error.max_lsb < 0.6


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.long) for k in (1, 2, 3))])
def test_no_background_shows_through_a_solid(tmp_path, seed):
    outline = outline_of(seed, seed % 2 == 1) * 2
    vertices, faces = prism(outline, np.zeros(len(outline)))
    loaded = load(tmp_path / "a.obj", obj_of(vertices, faces))
    check_closed(loaded.mesh)
    away = np.random.default_rng(seed).normal(size=3)
    for back_faces in ("flip", "cull"):
        check_covered(loaded, outline, away, back_faces)


def test_triangles_without_area_of_the_file_close_its_seams(tmp_path):
    """The file itself cuts the two polygons, as fans whose triangles lie along a side."""
    corners = 2 * np.array([[-0.9, -0.8], [1.0, -0.3], [-0.2, 0.9]])
    along = np.linspace(0, 1, 14)[1:-1, np.newaxis]
    first, second, third = corners
    outline = [[first], first + along * (second - first), [second, third], third + along * (first - third)]
    outline = np.concatenate(outline)
    vertices, faces = prism(outline, np.zeros(len(outline)))
    fans = [
        [face[0], *pair] for face in (faces[0][-1:] + faces[0][:-1], faces[1]) for pair in pairwise(face[1:])
    ]
    loaded = load(tmp_path / "a.obj", obj_of(vertices, fans + faces[2:]))
    check_closed(loaded.mesh)
    assert loaded.dropped_faces == 0
    # At a crease angle of 40 degrees each corner has the normal of its own polygon.
    facing = np.abs(loaded.mesh.normals[:, 2])
    assert ((facing > 1 - 1e-9) | (facing < 1e-9)).all()
    for away in np.random.default_rng(1).normal(size=(6, 3))[3:]:
        check_covered(loaded, outline, away, "flip")
        check_shaded(loaded, away)


@pytest.mark.parametrize("kind", ["repeated", "warped"])
def test_solids_of_other_polygons_stay_closed(tmp_path, kind):
    for seed in range(10):
        outline = outline_of(seed, kind == "repeated")
        heights = np.random.default_rng(seed).normal(size=len(outline)) * (kind == "warped")
        check_closed(load(tmp_path / "a.obj", obj_of(*prism(outline, heights))).mesh)
