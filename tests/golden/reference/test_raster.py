from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial import Delaunay

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.fragments import fragment_barycentrics, fragment_normals
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.scene import Scene

GREY = (0.5, 0.5, 0.5)
MATERIAL = Material(GREY, GREY, GREY, 10)


def pixel_scene(points, faces, width, height, normals=None, **options):
    """A scene whose vertices are given in pixels (x, y down) and in distance towards the viewer.

    One world unit is one pixel. All numbers are small dyadic numbers, so the projection is exact.
    """
    points = np.asarray(points, dtype=np.float64)
    vertices = points * (1, -1, 1) + (-width / 2, height / 2, 0)
    if normals is None:
        normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    mesh = Mesh(vertices, np.asarray(faces, dtype=np.int64).reshape(-1, 3), normals)
    camera = Camera((0, 0, 4096), (0, 0, 0), height=height)
    return Scene(mesh, camera, width, height, MATERIAL, (Light((0, 0, 1)),), **options)


def barycentrics(triangle, x, y):
    (ax, ay), (bx, by), (cx, cy) = triangle
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
    third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
    return 1 - second - third, second, third


def covers(triangle, column, row):
    """Whether the pixel's centre belongs to the triangle, in exact integers of 1/256 pixel.

    Ties on an edge are decided without classes of edges: the centre is moved right by an infinitesimal, and
    down by the square of this. The triangle that then contains it has it. Edge functions are whole numbers.
    With coordinates below 2^16 the moves of 2^-40 and 2^-80 change a function by less than 1.
    """
    one = 1 << 80
    x, y = (256 * column + 128) * one + (1 << 40), (256 * row + 128) * one + 1
    a, b, c = triangle
    sides = [
        (tail[0] - head[0]) * (y - head[1] * one) - (tail[1] - head[1]) * (x - head[0] * one)
        for head, tail in ((a, b), (b, c), (c, a))
    ]
    return min(sides) > 0 or max(sides) < 0


def brute_force(points, faces, width, height):
    """Exact rational coverage and depth: the nearest triangle of every pixel, or -1, and the covered
    pairs."""
    exact = [[Fraction(float(value)) for value in point] for point in points]
    steps = [[int(value * 256) for value in point[:2]] for point in exact]
    owner = np.full((height, width), -1)
    pairs = set()
    for row in range(height):
        for column in range(width):
            best = None
            for index, face in enumerate(faces):
                if not covers([steps[corner] for corner in face], column, row):
                    continue
                triangle = [exact[corner][:2] for corner in face]
                pairs.add((index, row * width + column))
                shares = barycentrics(triangle, column + Fraction(1, 2), row + Fraction(1, 2))
                depth = sum(s * exact[c][2] for s, c in zip(shares, face, strict=True))
                if best is None or depth > best:
                    best = depth
                    owner[row, column] = index
    return owner, pairs


def found_owner(raster, width, height):
    owner = np.full(width * height, -1)
    visible = np.flatnonzero(raster.visible)
    owner[raster.pixel[visible]] = raster.triangle[raster.span[visible]]
    return owner.reshape(height, width)


def check_structure(scene, raster):
    """Check what every raster has to fulfil."""
    assert (raster.length >= 1).all()
    assert (raster.x >= 0).all()
    assert (raster.x + raster.length <= scene.width).all()
    assert ((raster.y >= 0) & (raster.y < scene.height)).all()
    order = np.lexsort((raster.x, raster.y, raster.triangle))
    assert (order == np.arange(len(order))).all()
    expected = [(s, o) for s, length in enumerate(raster.length.tolist()) for o in range(length)]
    assert list(zip(raster.span.tolist(), raster.offset.tolist(), strict=True)) == expected
    assert (raster.pixel == raster.y[raster.span] * scene.width + raster.x[raster.span] + raster.offset).all()
    shown = raster.pixel[raster.visible]
    assert len(np.unique(shown)) == len(shown) == len(np.unique(raster.pixel))
    assert set(raster.span[raster.visible].tolist()) == set(range(len(raster.x)))
    for normals in (raster.normal_left, raster.normal_right):
        assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-14)
    left_out = raster.degenerate + raster.culled + raster.outside + raster.uncovered
    assert len(np.unique(raster.triangle)) <= raster.triangles - left_out
    if not raster.hidden_spans:
        assert len(np.unique(raster.triangle)) == raster.triangles - left_out


def grid(rng, size, low, high, step=256):
    return rng.integers(low * step, high * step, size) / step


@pytest.mark.parametrize("step", [2, 4, 256])
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.long) for k in (1, 2))])
def test_every_pixel_of_a_triangulation_exactly_once(seed, step):
    # With step 2 and 4 many vertices and edges lie exactly on pixel centres.
    rng = np.random.default_rng(seed)
    width, height = 23, 17
    frame = np.array([[-3, -3], [width + 3, -3], [-3, height + 3], [width + 3, height + 3]])
    flat = np.concatenate((frame, grid(rng, (60, 2), -2, 19, step)))
    faces = Delaunay(flat).simplices
    points = np.column_stack((flat, np.zeros(len(flat))))
    scene = pixel_scene(points, faces, width, height)
    raster = rasterise(scene)
    check_structure(scene, raster)
    assert raster.hidden_spans == 0
    assert raster.visible.all()
    assert (np.sort(raster.pixel) == np.arange(width * height)).all()
    owner, pairs = brute_force(points, faces, width, height)
    assert len(pairs) == width * height
    assert (found_owner(raster, width, height) == owner).all()


@pytest.mark.parametrize("step", [2, 256])
@pytest.mark.parametrize("seed", range(4))
def test_coverage_and_occlusion_of_random_triangles(seed, step):
    # Both windings, overlaps, intersections, and corners off the screen.
    rng = np.random.default_rng(100 + seed)
    width, height = 20, 15
    points = np.column_stack((grid(rng, (36, 2), -6, 24, step), grid(rng, 36, -8, 8)))
    faces = np.arange(36).reshape(12, 3)
    scene = pixel_scene(points, faces, width, height)
    raster = rasterise(scene)
    check_structure(scene, raster)
    owner, pairs = brute_force(points, faces, width, height)
    assert (found_owner(raster, width, height) == owner).all()
    fragments = set(zip(raster.triangle[raster.span].tolist(), raster.pixel.tolist(), strict=True))
    # Kept spans are whole. A missing fragment lies on a scanline where nothing of its triangle is visible.
    assert fragments <= pairs
    lines = {(t, p // width) for t, p in pairs}
    kept_lines = {(t, p // width) for t, p in fragments}
    assert {(t, p) for t, p in pairs if (t, p // width) in kept_lines} == fragments
    assert raster.hidden_spans == len(lines) - len(kept_lines)
    drawn = {t for t, _ in pairs}
    assert len(drawn) == raster.triangles - raster.degenerate - raster.outside - raster.uncovered


def test_spans_of_a_known_triangle():
    # The right angle is at the top left pixel centre, and the legs are 4 pixels long: edges go through pixel
    # centres everywhere.
    points = [[0.5, 0.5, 0], [4.5, 0.5, 0], [0.5, 4.5, 0]]
    scene = pixel_scene(points, [[0, 1, 2]], 8, 8)
    raster = rasterise(scene)
    # The slanted edge is a right edge, so its centres do not belong to the triangle.
    assert raster.x.tolist() == [0, 0, 0, 0]
    assert raster.y.tolist() == [0, 1, 2, 3]
    assert raster.length.tolist() == [4, 3, 2, 1]
    assert raster.triangle.dtype == raster.span.dtype == raster.pixel.dtype == np.int32


def test_triangle_of_one_pixel_and_of_none():
    around = [[2.25, 3.25, 0], [2.75, 3.25, 0], [2.5, 3.75, 0]]
    raster = rasterise(pixel_scene(around, [[0, 2, 1]], 8, 8))
    assert (raster.x.tolist(), raster.y.tolist(), raster.length.tolist()) == ([2], [3], [1])
    assert raster.normal_left.tolist() == raster.normal_right.tolist() == [[0, 0, 1]]
    between = np.add(around, [0.5, 0.5, 0])
    raster = rasterise(pixel_scene(between, [[0, 1, 2]], 8, 8))
    assert (len(raster.x), len(raster.span), raster.uncovered) == (0, 0, 1)


def test_slivers():
    # A fan of needles, 1/256 pixel wide at their ends, covers a rectangle exactly once.
    width, height = 30, 6
    right = np.arange(height * 256 + 1) / 256
    points = np.concatenate(
        ([[0, 0, 0], [0, height, 0]], np.column_stack((np.full(len(right), 30.0), right, 0 * right)))
    )
    needles = np.column_stack((np.zeros(len(right) - 1, int), np.arange(2, len(right) + 1)))
    faces = np.concatenate((np.column_stack((needles, needles[:, 1] + 1)), [[0, len(right) + 1, 1]]))
    scene = pixel_scene(points, faces, width, height)
    raster = rasterise(scene)
    check_structure(scene, raster)
    assert raster.visible.all()
    assert (np.sort(raster.pixel) == np.arange(width * height)).all()


def test_degenerate_triangles_are_counted():
    points = [[1, 1, 0], [5, 5, 0], [3, 3, 0], [1, 1, 5], [5.001, 5, 0], [1.001, 1, 0], [5, 1, 0]]
    # Two triangles without area in the world, one seen edge-on, one that vanishes when rounded to 1/256
    # pixel, and a good one.
    faces = [[0, 1, 2], [0, 0, 1], [0, 1, 3], [0, 5, 0], [0, 1, 6]]
    scene = pixel_scene(points, faces, 8, 8)
    raster = rasterise(scene)
    check_structure(scene, raster)
    assert raster.degenerate == 4
    assert set(raster.triangle.tolist()) == {4}
    rounded = pixel_scene([[1, 1, 0], [1.001, 1, 0], [5, 5, 0]], [[0, 1, 2]], 8, 8)
    assert rasterise(rounded).degenerate == 1


def test_off_screen():
    shape = np.array([[1, 1, 0], [5, 1, 0], [1, 5, 0]])
    points = np.concatenate([np.add(shape, (dx, dy, 0)) for dx, dy in ((20, 0), (-20, 0), (0, 20), (0, -20))])
    scene = pixel_scene(points, np.arange(12).reshape(4, 3), 8, 8)
    raster = rasterise(scene)
    assert (raster.outside, len(raster.x)) == (4, 0)
    # These lie around a corner of the screen. No single border excludes them, and still they are not in the
    # picture.
    corner = pixel_scene([[-10, 5, 0], [5, -10, 0], [-10, -10, 0]], [[0, 1, 2]], 8, 8)
    raster = rasterise(corner)
    assert (raster.uncovered, len(raster.x)) == (1, 0)
    # This is behind the camera.
    raster = rasterise(pixel_scene(np.add(shape, (0, 0, 5000)), [[0, 1, 2]], 8, 8))
    assert (raster.outside, len(raster.x)) == (1, 0)


@pytest.mark.parametrize("size", [2.0**12, 2.0**19, 2.0**24, 2.0**40])
def test_huge_triangles(size):
    # Two halves of a huge square, cut by a line through the picture with a slope of 2.
    points = [[-size, -size, 0], [size, -size, 0], [size, size, 0], [-size, size, 0]]
    points += [[16 - size / 2, 8 - size, 0], [16 + size / 2, 8 + size, 0]]
    faces = [[0, 4, 5], [0, 5, 3], [4, 1, 2], [4, 2, 5]]
    scene = pixel_scene(points, faces, 32, 16)
    raster = rasterise(scene)
    check_structure(scene, raster)
    owner = found_owner(raster, 32, 16)
    column, row = np.meshgrid(np.arange(32) + 0.5, np.arange(16) + 0.5)
    side = 2 * (column - 16) - (row - 8)
    clear = np.abs(side) > 0.01
    assert clear.sum() > 480
    assert (np.isin(owner, (2, 3)) == (side > 0))[clear].all()
    assert (owner >= 0).all()
    assert raster.hidden_spans == 0
    assert raster.visible.all()


def test_equal_depth_goes_to_the_lowest_index():
    points = [[0, 0, 1], [8, 0, 1], [0, 8, 1]]
    faces = [[0, 1, 2]] * 3
    raster = rasterise(pixel_scene(points, faces, 8, 8))
    assert set(raster.triangle.tolist()) == {0}
    assert raster.hidden_spans == 2 * len(raster.x)


def test_span_of_largest_length():
    points = [[0, 0, 0], [8190, 0, 0], [0, 2, 0]]
    raster = rasterise(pixel_scene(points, [[0, 1, 2]], 4095, 2))
    assert raster.length.max() == 4095
    assert raster.offset.max() == 4094


def random_normals(rng, count, towards=1.0):
    return normalise(rng.normal((0, 0, towards), size=(count, 3)))


def test_normals_and_barycentrics_of_an_exact_projection():
    rng = np.random.default_rng(20)
    width, height = 24, 18
    points = np.column_stack((grid(rng, (15, 2), -4, 24), grid(rng, 15, -8, 8)))
    faces = np.arange(15).reshape(5, 3)
    normals = random_normals(rng, 15, 2)
    scene = pixel_scene(points, faces, width, height, normals, back_faces="show")
    raster = rasterise(scene)
    every = np.arange(len(raster.span))
    found_shares = fragment_barycentrics(raster, every)
    found_normals = fragment_normals(scene, raster, every)
    assert len(every) > 100
    for fragment in every:
        span = raster.span[fragment]
        face = faces[raster.triangle[span]]
        triangle = [[Fraction(v) for v in points[corner, :2].tolist()] for corner in face]
        line, column = divmod(int(raster.pixel[fragment]), width)
        shares = barycentrics(triangle, column + Fraction(1, 2), line + Fraction(1, 2))
        shares = np.array([float(share) for share in shares])
        assert found_shares[fragment] == pytest.approx(shares, abs=1e-13)
        exact = normalise(shares @ normals[face])
        # Vertex normals may nearly cancel. These keep at least a hundredth of their length.
        assert np.linalg.norm(shares @ normals[face]) > 0.01
        assert found_normals[fragment] == pytest.approx(exact, abs=1e-11)
        if raster.offset[fragment] == 0:
            assert raster.normal_left[span] == pytest.approx(exact, abs=1e-11)
        if raster.offset[fragment] == raster.length[span] - 1:
            assert raster.normal_right[span] == pytest.approx(exact, abs=1e-11)


def test_back_faces():
    front, rear = [0, 2, 1], [3, 4, 5]
    shape = [[0, 0, 0], [8, 0, 0], [0, 8, 0]]
    points = np.concatenate((shape, np.add(shape, (8, 0, 0))))
    normals = np.tile(normalise([0.1, 0.2, 1]), (6, 1))
    scene = pixel_scene(points, [front, rear], 16, 8, normals)
    for back_faces, sign in (("show", 1), ("flip", -1)):
        raster = rasterise(replace(scene, back_faces=back_faces))
        assert (raster.back == (raster.triangle == 1)).all()
        for triangle, factor in ((0, 1), (1, sign)):
            chosen = raster.triangle == triangle
            assert chosen.any()
            assert raster.normal_left[chosen] == pytest.approx(
                factor * np.tile(normals[0], (chosen.sum(), 1))
            )
    raster = rasterise(replace(scene, back_faces="cull"))
    assert raster.culled == 1
    assert set(raster.triangle.tolist()) == {0}
    # A two-sided material is not culled: its normals are turned.
    both = replace(scene.material, two_sided=True)
    for material, triangles in (
        (both, {0, 1}),
        ((both, scene.material), {0}),
        ((scene.material, both), {0, 1}),
    ):
        mesh = replace(scene.mesh, material=np.array([0, 1] if isinstance(material, tuple) else [0, 0]))
        given = replace(scene, mesh=mesh, back_faces="cull", material=material)
        raster = rasterise(given)
        assert (raster.culled, set(raster.triangle.tolist())) == (2 - len(triangles), triangles)
        turned = rasterise(replace(given, back_faces="flip"))
        chosen = np.isin(turned.triangle, list(triangles))
        assert np.array_equal(raster.normal_left, turned.normal_left[chosen])


def test_cancelled_normals_become_the_normal_of_the_face():
    # Normals of opposite vertices cancel in the middle of the first scanline, exactly at pixel 4 of 9.
    points = [[0.5, 0.5, 0], [8.5, 0.5, 0], [0.5, 8.5, 0]]
    normals = np.array([[1.0, 0, 0], [-1, 0, 0], [1, 0, 0]])
    scene = pixel_scene(points, [[0, 2, 1]], 9, 9, normals)
    raster = rasterise(scene)
    middle = fragment_normals(scene, raster, raster.pixel == 4)
    assert middle.tolist() == [[0, 0, 1]]
    # They cancel along the whole column 4, where the span of the fourth scanline ends.
    assert raster.repaired_normals == 1
    assert raster.length[3] == 5
    assert raster.normal_right[3].tolist() == [0, 0, 1]
    none = pixel_scene(points, [[0, 2, 1]], 9, 9, np.zeros((3, 3)))
    raster = rasterise(none)
    assert raster.repaired_normals == 2 * len(raster.x)
    assert (raster.normal_left == [0, 0, 1]).all()
    assert (fragment_normals(none, raster, raster.visible) == [0, 0, 1]).all()
    turned = pixel_scene(points, [[0, 1, 2]], 9, 9, np.zeros((3, 3)))
    assert (rasterise(turned).normal_left == [0, 0, 1]).all()
    assert (rasterise(replace(turned, back_faces="show")).normal_left == [0, 0, -1]).all()


def test_empty_mesh():
    scene = pixel_scene(np.zeros((3, 3)), np.zeros((0, 3)), 4, 4)
    raster = rasterise(scene)
    assert (raster.triangles, len(raster.x), len(raster.pixel)) == (0, 0, 0)


def test_results_do_not_depend_on_the_chunks(monkeypatch):
    rng = np.random.default_rng(21)
    points = np.column_stack((grid(rng, (90, 2), -6, 70), grid(rng, 90, 0, 3, 1)))
    # Depths are whole numbers, so parallel triangles have many exact ties, also across chunks.
    points[:, 2] = np.repeat(points[::3, 2], 3)
    scene = pixel_scene(points, np.arange(90).reshape(30, 3), 64, 48)
    whole = rasterise(scene)
    monkeypatch.setattr("blysk.golden.reference.raster._CHUNK", 37)
    parts = rasterise(scene)
    for name in whole.__dataclass_fields__:
        assert np.array_equal(getattr(whole, name), getattr(parts, name)), name


def test_scene_refusals():
    scene = pixel_scene(np.zeros((3, 3)), np.zeros((0, 3)), 4, 4)
    for values, text in (
        ({"width": 0}, "a scene's width must be in 1 to 4095, not 0"),
        ({"height": 4096}, "a scene's height must be in 1 to 4095, not 4096"),
        ({"background": (0, 0, 2)}, "a scene's background must be in 0 to 1"),
        ({"ambient_light": (0, 0, -1)}, "a scene's ambient_light must be at least 0"),
        ({"back_faces": "hide"}, "back_faces must be one of flip, show, cull, not 'hide'"),
    ):
        with pytest.raises(ValueError, match=text):
            replace(scene, **values)
    with pytest.raises(TypeError, match="a scene's lights must be Light, not tuple"):
        replace(scene, lights=((0, 0, 1),))
    with pytest.raises(TypeError):
        replace(scene, width=4.5)
