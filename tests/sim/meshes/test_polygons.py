"""Polygons of OBJ and PLY files cut into triangles, and faces that are no polygons."""

import struct

import numpy as np
import pytest

from blysk.sim.meshes.polygons import triangulated

from .files import check_refused, load, obj_of

# Corners in order, counter-clockwise. Only in the square does the first corner see all other corners.
OUTLINES = {
    "square": [(0, 0), (1, 0), (1, 1), (0, 1)],
    "dart": [(4, 0), (0, 4), (1, 1), (0, -4)],
    "L": [(2, 1), (1, 1), (1, 3), (0, 3), (0, 0), (2, 0)],
    "C": [(3, 1), (1, 1), (1, 2), (3, 2), (3, 3), (0, 3), (0, 0), (3, 0)],
    "comb": [(0, 0), (7, 0), (7, 3), (6, 3), (6, 1), (4, 1), (4, 3), (3, 3), (3, 1), (1, 1), (1, 3), (0, 3)],
}


def shoelace(points):
    """Twice the signed area of a polygon of the plane."""
    x, y = np.asarray(points, dtype=float).T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()


def placed(outline, seed):
    """A polygon turned and moved in space."""
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.c_[np.array(outline, dtype=float), np.zeros(len(outline))] @ axes.T + rng.normal(size=3) * 10


def spiral(count, seed):
    """A polygon around the origin whose corners go in and out."""
    rng = np.random.default_rng(seed)
    angle = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) * 2 * np.pi / count
    return (rng.uniform(0.1, 1, count) * [np.cos(angle), np.sin(angle)]).T


def check_cover(outline, corners):
    """Check that the triangles have the polygon's area and its orientation: no overlap and no gap."""
    areas = np.array([shoelace(np.asarray(outline)[triangle]) for triangle in corners])
    assert (areas * np.sign(shoelace(outline)) >= -1e-12).all()
    assert areas.sum() == pytest.approx(shoelace(outline), rel=1e-12)
    assert len(corners) == len(outline) - 2


CASES = {**OUTLINES, **{f"spiral{k}": spiral(5 + k, k) for k in range(20)}}


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("outline", CASES.values(), ids=CASES)
def test_triangles_cover_the_polygon(outline, turn):
    outline = list(outline)[::turn]
    for first in range(len(outline)):
        points = outline[first:] + outline[:first]
        corners, owners = triangulated(placed(points, first), np.arange(len(points))[np.newaxis])
        check_cover(points, corners)
        assert not owners.any()


def test_many_polygons_keep_their_order():
    """Convex and concave polygons with equal numbers of corners, far from each other, are cut together as
    alone."""
    outlines = [spiral(7, seed) for seed in range(50)]
    vertices = np.concatenate([placed(outline, seed) for seed, outline in enumerate(outlines)])
    polygons = np.arange(350).reshape(50, 7)
    corners, owners = triangulated(vertices, polygons)
    assert (np.diff(owners) >= 0).all()
    for number, outline in enumerate(outlines):
        check_cover(outline, corners[owners == number])


def test_polygons_without_area():
    """Polygons without area give triangles without area. Other code drops and counts these."""
    for points in (np.zeros((5, 3)), np.outer(np.arange(5), [1, 2, 3]), np.full((5, 3), np.nan)):
        corners, _ = triangulated(points.astype(float), np.arange(5)[np.newaxis])
        assert len(corners) == 3


def ply(points, order):
    format = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = f"ply\nformat {format} 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property double {name}\n" for name in "xyz")
    head += "element face 2\nproperty list uchar int vertex_indices\nproperty uchar flags\nend_header\n"
    faces = [list(range(len(points))), [0, 1, 2]]
    if order:
        body = struct.pack(f"{order}{points.size}d", *points.ravel())
        body += b"".join(struct.pack(f"{order}B{len(f)}iB", len(f), *f, 7) for f in faces)
    else:
        lines = [f"{x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
        lines += [" ".join(map(str, [len(f), *f, 7])) for f in faces]
        body = ("\n".join(lines) + "\n").encode()
    return head.encode() + body


def drawn_area(loaded):
    a, b, c = np.moveaxis(loaded.mesh.vertices[loaded.mesh.faces], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


@pytest.mark.parametrize("outline", [OUTLINES["dart"], OUTLINES["C"]], ids=["dart", "C"])
def test_concave_polygon_of_obj(tmp_path, outline):
    loaded = load(tmp_path / "a.obj", obj_of(placed(outline, 1), [range(len(outline))]))
    assert drawn_area(loaded) == pytest.approx(shoelace(outline))
    # All triangles face the same way. A fan would turn some over.
    assert (loaded.mesh.normals @ loaded.mesh.normals[0] > 0.999).all()


@pytest.mark.parametrize("order", ["", "<", ">"])
def test_concave_polygon_beside_a_triangle_of_ply(tmp_path, order):
    """Lists have different lengths.

    trimesh refuses binary files of this kind and splits those in texts as fans.
    """
    loaded = load(tmp_path / "a.ply", ply(placed(OUTLINES["C"], 2), order))
    extra = abs(shoelace(OUTLINES["C"][:3]))
    assert drawn_area(loaded) == pytest.approx(shoelace(OUTLINES["C"]) + extra)


def test_polygon_keeps_normals_and_relative_indices(tmp_path):
    lines = [f"v {x} {y} 0" for x, y in OUTLINES["L"]] + ["vn 0 0 1", "vn 0 0.6 0.8"]
    corners = [f"{k - 6}//{-1 - (k % 2)}" for k in range(6)]
    loaded = load(tmp_path / "a.obj", "\n".join([*lines, "f " + " ".join(corners)]))
    assert loaded.repaired_normals == 0
    assert drawn_area(loaded) == pytest.approx(shoelace(OUTLINES["L"]))
    for place, normal in zip(loaded.mesh.vertices, loaded.mesh.normals, strict=True):
        number = OUTLINES["L"].index((place[0], place[1]))
        np.testing.assert_allclose(normal, [0, 0, 1] if number % 2 else [0, 0.6, 0.8])


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (SQUARE + "f 1 2 3_0\n", "corners '1 2 3_0'"),
        (SQUARE + "f 1 2 1_0 4\n", "corners '1 2 1_0 4'"),
        (SQUARE + "f 1 2 3.5\n", "corners"),
        (SQUARE + "f 1/1/1/1 2 3\n", "corners"),
        (SQUARE + "f 1 2 3 9\n", "vertex 8, counted from 0, but the number of vertices is 4"),
        (SQUARE + "f 1 2 3 -9\n", "index -9"),
        (SQUARE.replace("v 1 0 0", "v 1_0 0 0") + "f 1 2 3\n", "'1_0 0 0', not 3 numbers"),
        (SQUARE + "vn 0 0 1_0\nf 1//1 2//1 3//1\n", "not 3 numbers"),
        (SQUARE.replace("v 1 0 0", "v 1 0 0 2") + "f 1 2 3\n", "weight w other than 1"),
        (SQUARE.replace("v 1 0 0", "v 1 0 0 0.5") + "f 1 2 3\n", "weight w other than 1"),
        (SQUARE.replace("v 1 0 0", "v 1 0 0 1 1") + "f 1 2 3\n", "5 numbers"),
    ],
)
def test_bad_obj(tmp_path, text, reason):
    check_refused(tmp_path / "a.obj", reason, content=text)


def test_weight_of_1_and_colours(tmp_path):
    """These stand beside positions without a weight. trimesh takes the columns of the first line."""
    text = "v 0 0 0 1.0\nv 1 0 0\nv 1 1 0 1 0 0\nv 0 1 0 1e0\nf 1 2 3 4\n"
    loaded = load(tmp_path / "a.obj", text)
    assert drawn_area(loaded) == pytest.approx(2)
    assert loaded.ignored == ("3 missing colours of vertices",)


HEAD = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 0 1 2\n", "more or fewer numbers"),
        ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 1 2 3\n", "more or fewer numbers"),
        ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n-3 0 1 2\n", "more or fewer numbers"),
        ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n2.5 0 1 2\n", "more or fewer numbers"),
        ("0 0 0\n1 0 0\n1 1 0\n0 1\n3 0 1 2\n3 0 1 2\n", "more or fewer numbers"),
        ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n2 0 1\n", "fewer than 3 corners"),
        ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 1 1_0\n", "the character _"),
        ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 1 2.5\n", "not a whole number"),
        (
            "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 1 4\n",
            "vertex 4, counted from 0, but the number of vertices is 4",
        ),
        ("0 0 0\n1 0 0\n1 1 0\n0 1 zero\n3 0 1 2\n3 0 1 2\n", "not a number"),
    ],
)
def test_bad_ply(tmp_path, body, reason):
    check_refused(tmp_path / "a.ply", reason, content=HEAD + body)


def test_wrong_counts_of_binary_lists(tmp_path):
    whole = ply(placed(OUTLINES["C"], 2), "<")
    start = whole.index(b"end_header\n") + 11 + 8 * 24
    for count in (0, 2, 7, 9, 255):
        check_refused(tmp_path / "a.ply", content=whole[:start] + bytes([count]) + whole[start + 1 :])
