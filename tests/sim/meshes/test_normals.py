"""Vertex normals: computed normals against analytic shapes, stored normals kept or repaired."""

import numpy as np
import pytest
import trimesh

from blysk.golden.reference.geometry import normalise
from blysk.sim.errors import InputError
from blysk.sim.meshes.mesh import load_mesh

from .files import CORNERS, check, face_normals, load, mesh_gltf, put, with_normals


@pytest.fixture
def sphere():
    return trimesh.creation.icosphere(subdivisions=2)


# Computed


def prism(sides):
    """The side of a prism: quadrilaterals at 360 / sides degrees to each other."""
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(turn), np.zeros(sides), -np.sin(turn)], axis=-1)
    i = np.arange(sides)
    j = (i + 1) % sides
    rows = [np.stack([i, j, j + sides], axis=-1), np.stack([i, j + sides, i + sides], axis=-1)]
    return trimesh.Trimesh(
        np.concatenate([ring, np.add(ring, [0, 1, 0])]), np.concatenate(rows), process=False
    )


@pytest.mark.parametrize(
    ("crease", "vertices"), [(0, 48), (20, 48), (29.9, 48), (30, 24), (30.1, 24), (40, 24), (180, 24)]
)
def test_crease_angle(tmp_path, crease, vertices):
    # 12 sides meet at 30 degrees: smooth (24 vertices, radial normals) or cut (4 vertices a side). At exactly
    # 30 the cut needs a larger angle, and the slack covers the rounding of the float32 file.
    mesh = check(load(tmp_path / "prism.ply", prism(12), crease_angle=crease)).mesh
    assert len(mesh.vertices) == vertices
    if vertices == 24:
        radial = normalise(mesh.vertices * [1, 0, 1])
        # float32 stores a coordinate to 6e-8. An edge of 0.5 turns by at most 4 times that.
        assert np.abs(mesh.normals - radial).max() < 1e-6
    else:
        assert np.abs(mesh.normals[mesh.faces] - face_normals(mesh)[:, np.newaxis]).max() < 1e-6


def test_default_crease_angle_is_40_degrees(tmp_path):
    path = tmp_path / "prism.ply"
    sides = [len(load(path, prism(9), **options).mesh.vertices) for options in ({}, {"crease_angle": 40})]
    assert sides == [18, 18]
    assert len(load(path, prism(8)).mesh.vertices) == 32


@pytest.mark.parametrize("angle", [-0.1, 180.1, float("nan"), float("inf")])
def test_crease_angle_out_of_range(angle):
    with pytest.raises(InputError, match=r"crease angle .*: it must be 0 to 180 degrees"):
        load_mesh("teapot", crease_angle=angle)


def test_crease_that_ends_in_a_smooth_patch(tmp_path):
    # A fold cuts a sheet half way: it is sharp at one end and flat at the other. Elsewhere smooth edges
    # connect all faces. The corner in the middle of the fold must be cut, although its faces are one smooth
    # patch.
    x, z = np.meshgrid([-1.0, 0.0, 1.0], [0.0, 1.0, 2.0, 3.0])
    y = np.where(x == 0, np.array([[0.0], [0.0], [0.0], [1.0]]), 0.0)
    grid = np.arange(12).reshape(4, 3)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    faces = np.concatenate([np.stack([a, d, c], axis=-1), np.stack([a, c, b], axis=-1)]).reshape(-1, 3)
    sheet = trimesh.Trimesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), faces, process=False)
    mesh = load(tmp_path / "sheet.ply", sheet, crease_angle=40).mesh
    ridge = (mesh.vertices == [0, 1, 3]).all(axis=1)
    assert ridge.sum() == 2
    assert mesh.normals[ridge][0] @ mesh.normals[ridge][1] < np.cos(np.radians(40))
    assert (mesh.vertices == [0, 0, 0]).all(axis=1).sum() == 1


def test_angle_weighted(tmp_path):
    # At a cube's corner the three faces have 90 degrees each, in 3 to 6 triangles. Only weights by angle give
    # the diagonal.
    mesh = load(tmp_path / "cube.stl", trimesh.creation.box(extents=(2, 2, 2)), crease_angle=180).mesh
    assert len(mesh.vertices) == 8
    assert np.abs(mesh.normals - mesh.vertices / np.sqrt(3)).max() < 1e-15


def test_faces_back_to_back(tmp_path):
    loaded = load(tmp_path / "leaf.obj", f"{CORNERS}f 1 2 3\nf 1 3 2\n", crease_angle=180)
    assert (np.abs(check(loaded).mesh.normals) == [0, 0, 1]).all()
    assert len(load_mesh(str(tmp_path / "leaf.obj")).mesh.vertices) == 6


def test_stl_cube_stays_sharp(tmp_path):
    # With merged vertices trimesh shades a cube like a ball.
    mesh = load(tmp_path / "cube.stl", trimesh.creation.box()).mesh
    assert np.sort(np.abs(mesh.normals), axis=1).tolist() == [[0, 0, 1]] * 24


# Stored


def tilted(sphere):
    """Unit normals of a sphere, all turned by 40 degrees about y. They cannot be computed from the shape."""
    return sphere.vertices @ trimesh.transformations.rotation_matrix(np.radians(40), [0, 1, 0])[:3, :3].T


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_stored_normals_survive(tmp_path, sphere, suffix):
    content = with_normals(sphere, tilted(sphere))
    if suffix == ".obj":
        content = content.export(file_type="obj", include_normals=True)
    loaded = load(tmp_path / f"s{suffix}", content)
    assert loaded.repaired_normals == 0
    expected = tilted(trimesh.Trimesh(normalise(loaded.mesh.vertices), loaded.mesh.faces, process=False))
    # float32 in PLY and GLB; OBJ is written with 8 decimals. trimesh's own way to a single mesh loses them.
    assert np.abs(loaded.mesh.normals - expected).max() < 3e-7


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_bad_stored_normals_are_mended_and_counted(tmp_path, sphere, suffix):
    normals = np.array(sphere.vertices)
    normals[:3] = [[0] * 3, [np.nan] * 3, [np.inf, 0, 0]]
    normals[3:9] *= np.array([1.01, 1 + 1 / 512, 1e-30, 0.5, 1 + 1 / 256, 1 - 1 / 256])[:, np.newaxis]
    content = with_normals(sphere, normals)
    if suffix == ".glb":
        content = mesh_gltf(sphere.vertices, sphere.faces, normals)
    path = put(tmp_path / f"s{suffix}", content)
    stored = next(iter(trimesh.load_scene(path, process=False).geometry.values())).vertex_normals
    assert np.isnan(stored[1]).all()
    assert not stored[0].any()
    loaded = check(load_mesh(path))
    assert loaded.repaired_normals == 6
    radial = normalise(loaded.mesh.vertices)
    # The icosphere is regular to about a degree, so a computed normal is that near to the radius.
    assert np.einsum("vi,vi->v", loaded.mesh.normals, radial).min() > np.cos(np.radians(3))
    assert np.abs(loaded.mesh.normals - radial)[3:].max() < 3e-7


def test_normals_of_unused_vertices_do_not_count(tmp_path):
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]]
    loaded = load(tmp_path / "a.glb", mesh_gltf(vertices, [0, 1, 2], [[0, 0, 1]] * 3 + [[0, 0, 0]]))
    assert (loaded.repaired_normals, len(loaded.mesh.vertices)) == (0, 3)


def test_obj_whose_normals_cannot_be_used_is_counted(tmp_path):
    # trimesh drops all normals if one face has none.
    faces = "f 1//1 2//1 3//1\nf 2 4 3\n"
    loaded = load(tmp_path / "a.obj", f"{CORNERS}v 1 1 0\nvn 0 0.6 0.8\n{faces}")
    assert loaded.repaired_normals == 4
    assert (loaded.mesh.normals == [0, 0, 1]).all()


def test_ply_with_texture_coordinates_keeps_its_normals(tmp_path):
    # The fact is: a cut at texture seams reorders the vertices and leaves the normals.
    header = ["ply", "format ascii 1.0", "element vertex 4"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    header += ["element face 2", "property list uchar int vertex_indices"]
    header += ["property list uchar float texcoord", "end_header"]
    expected = {
        (0, 0, 0): [0, 0, 1],
        (1, 0, 0): [0.6, 0, 0.8],
        (1, 1, 0): [0, 0.6, 0.8],
        (0, 1, 0): [0, 1, 0],
    }
    rows = [" ".join(map(str, (*point, *normal))) for point, normal in expected.items()]
    rows += ["3 3 2 1 6 0 0 1 0 1 1", "3 3 1 0 6 0 0 1 1 0 1", ""]
    mesh = load(tmp_path / "a.ply", "\n".join(header + rows)).mesh
    normal = {tuple(v): n for v, n in zip(mesh.vertices.tolist(), mesh.normals, strict=True)}
    for point, value in expected.items():
        assert np.abs(normal[point] - value).max() < 1e-6
