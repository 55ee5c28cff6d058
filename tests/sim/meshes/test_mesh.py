"""Mesh files of every format: the loaded mesh, scenes of nodes, and faces without area."""

import logging
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

import blysk.sim.meshes.loaded_mesh
from blysk.golden.reference.geometry import normalise
from blysk.sim.errors import InputError
from blysk.sim.meshes.loaded_mesh import LoadedMesh
from blysk.sim.meshes.materials import FileMaterial
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.meshes.mesh_path import SUFFIXES

from .files import (
    CORNERS,
    TRIANGLE,
    check,
    check_refused,
    face_normals,
    load,
    mesh_gltf,
    obj_of,
    put,
    volume,
    with_normals,
    without_normals,
)

DATA = Path(__file__).parents[2] / "data"


@pytest.fixture
def sphere():
    return trimesh.creation.icosphere(subdivisions=2)


# Sources


def test_teapot_by_name(tmp_path, monkeypatch):
    """The word always gives the built-in teapot."""
    monkeypatch.chdir(tmp_path)
    Path("teapot").write_text("not a mesh")
    loaded = load_mesh("teapot", triangles=992)
    assert isinstance(loaded, LoadedMesh)
    assert (loaded.name, loaded.repaired_normals, loaded.dropped_faces) == ("teapot", 0, 0)
    assert len(loaded.mesh.faces) == 992
    check_refused("./teapot", "has no suffix")
    with pytest.raises(InputError, match="teapot of 10 triangles"):
        load_mesh("teapot", triangles=10)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb", ".GLB", ".Obj", ".PLY", ".STL"])
def test_every_format(tmp_path, suffix):
    cube = without_normals(trimesh.creation.box(extents=(2, 2, 2)))
    put(tmp_path / f"x{suffix.lower()}", cube)
    loaded = load(tmp_path / f"my.cube{suffix}", (tmp_path / f"x{suffix.lower()}").read_bytes())
    check(loaded)
    assert (loaded.name, loaded.repaired_normals, loaded.dropped_faces) == ("my.cube", 0, 0)
    assert (len(loaded.mesh.faces), len(loaded.mesh.vertices)) == (12, 24)
    assert volume(loaded.mesh) == pytest.approx(8, rel=1e-12)
    # Each corner of a flat face has exactly that face's normal.
    corner = loaded.mesh.normals[loaded.mesh.faces]
    assert np.abs(corner - face_normals(loaded.mesh)[:, np.newaxis]).max() < 1e-15


@pytest.mark.parametrize("uri", ["a.bin", "sub/my%20data.bin", None])
def test_buffer_of_a_gltf_file(tmp_path, uri):
    """The buffer is beside the file, under an escaped name, or in the URI."""
    (tmp_path / "sub").mkdir()
    document, buffer = mesh_gltf(uri=uri)
    (tmp_path / (uri or "unused").replace("%20", " ")).write_bytes(buffer)
    assert load(tmp_path / "a.gltf", (document, buffer)).mesh.vertices.tolist() == TRIANGLE


def test_real_file():
    # 992 triangles without normals, from the same patches as the built-in teapot, 5 times as large.
    loaded = check(load_mesh(str(DATA / "teapot992.obj")))
    assert (len(loaded.mesh.faces), loaded.repaired_normals, loaded.dropped_faces) == (992, 0, 0)
    expected = volume(load_mesh("teapot", triangles=992).mesh)
    assert volume(loaded.mesh) / 125 == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("suffix", [*SUFFIXES, "teapot"])
def test_a_file_without_materials_has_one(tmp_path, suffix):
    content = mesh_gltf() if suffix == ".gltf" else without_normals(trimesh.creation.box())
    path = "teapot" if suffix == "teapot" else put(tmp_path / f"a{suffix}", content)
    loaded = check(load_mesh(path, triangles=240))
    assert (loaded.materials, loaded.ignored) == ((FileMaterial(),), ())


def test_missing_folder_and_suffix(tmp_path):
    check_refused(tmp_path / "no.obj", "there is no such file")
    check_refused(tmp_path, "is a folder")
    check_refused("a\0b.obj", "there is no such file")
    check_refused("x" * 5000 + ".obj", "cannot be opened")
    (tmp_path / "folder.obj").mkdir()
    check_refused(tmp_path / "folder.obj", "is a folder")
    use = "use .obj, .ply, .stl, .glb or .gltf"
    check_refused(tmp_path / "a.dae", "unknown mesh type '.dae'", use, content="x")
    os.mkfifo(tmp_path / "pipe.obj")
    check_refused(tmp_path / "pipe.obj", "is not a regular file")
    assert check_refused("a\nb.obj").startswith("a?b.obj: there is no such file")


def test_trimesh_log_stays_off_the_terminal(tmp_path, monkeypatch, capfd):
    original = trimesh.load_scene

    def noisy(*args, **kwargs):
        logging.getLogger("trimesh").warning("noise")
        return original(*args, **kwargs)

    monkeypatch.setattr(trimesh, "load_scene", noisy)
    level = logging.getLogger("trimesh").level
    load(tmp_path / "a.stl", trimesh.creation.box())
    assert capfd.readouterr() == ("", "")
    assert logging.getLogger("trimesh").level == level


# Scenes


@pytest.mark.parametrize("stored", [True, False])
@pytest.mark.parametrize("mirror", [1, -1])
def test_node_transforms(tmp_path, sphere, stored, mirror):
    # A sphere that two nested nodes stretch, turn and move is an ellipsoid x = M s + t. Its normals are those
    # of |M^-1 (x - t)| = 1, along M^-T s.
    outer = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])
    outer[:3, 3] = [10, -20, 30]
    inner = np.diag([mirror * 2.0, 0.5, 3.0, 1.0])
    nodes = [{"children": [1], "matrix": outer.T.ravel().tolist()}]
    nodes += [{"mesh": 0, "scale": np.diag(inner)[:3].tolist()}]
    document = mesh_gltf(sphere.vertices, sphere.faces, sphere.vertices if stored else None, nodes)
    loaded = check(load(tmp_path / "a.glb", document, crease_angle=180))
    assert (loaded.repaired_normals, loaded.dropped_faces) == (0, 0)
    matrix = (outer @ inner)[:3, :3]
    unit = (loaded.mesh.vertices - outer[:3, 3]) @ np.linalg.inv(matrix).T
    assert np.abs(np.linalg.norm(unit, axis=1) - 1).max() < 1e-6
    expected = normalise(unit @ np.linalg.inv(matrix))
    angle = np.degrees(np.arccos(np.clip(np.einsum("vi,vi->v", loaded.mesh.normals, expected), -1, 1)))
    # float32 for stored normals; a coarse, stretched ellipsoid for computed normals.
    assert angle.max() < (1e-4 if stored else 15)
    assert volume(loaded.mesh) == pytest.approx(3 * sphere.volume, rel=1e-5)
    corners = loaded.mesh.normals[loaded.mesh.faces]
    assert (np.einsum("fi,fki->fk", face_normals(loaded.mesh), corners) > 0).all()


def test_one_mesh_at_two_nodes(tmp_path, sphere):
    scene = trimesh.Scene()
    scene.add_geometry(with_normals(sphere, sphere.vertices), node_name="a", geom_name="s")
    mirror = np.diag([-1.0, 1, 1, 1])
    mirror[0, 3] = 10
    scene.graph.update("b", matrix=mirror, geometry="s")
    mesh = load(tmp_path / "two.glb", scene).mesh
    assert len(mesh.faces) == 2 * len(sphere.faces)
    assert volume(mesh) == pytest.approx(2 * sphere.volume, rel=1e-6)
    centre = np.where(mesh.vertices[:, :1] > 5, [10.0, 0, 0], [0.0, 0, 0])
    assert np.abs(mesh.normals - (mesh.vertices - centre)).max() < 1e-6


def test_node_that_flattens(tmp_path, sphere):
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "scale": [0, 0, 0]}]
    loaded = load(tmp_path / "a.glb", mesh_gltf(sphere.vertices, sphere.faces, sphere.vertices, nodes))
    assert (len(loaded.mesh.faces), loaded.dropped_faces) == (len(sphere.faces), len(sphere.faces))


def test_points_beside_a_mesh(tmp_path):
    points = trimesh.PointCloud(np.eye(3) * 50)
    loaded = load(tmp_path / "a.glb", trimesh.Scene([trimesh.creation.box(), points]))
    assert len(loaded.mesh.faces) == 12
    assert np.abs(loaded.mesh.vertices).max() == 0.5
    check_refused(tmp_path / "p.glb", "it has no faces", content=trimesh.Scene([points]))


def test_nodes_of_many_levels(tmp_path):
    """Nodes of many levels load in a moment, each at its position."""
    nodes = [{"mesh": 0, "translation": [1, 0, 0], "children": [k + 1]} for k in range(999)]
    mesh = load(tmp_path / "a.glb", mesh_gltf(nodes=[*nodes, {"mesh": 0}])).mesh
    assert len(mesh.faces) == 1000
    assert np.array_equal(np.unique(mesh.vertices[:, 0]), np.arange(1.0, 1001))


def test_meshes_below_a_camera(tmp_path):
    nodes = [{"translation": [5, 0, 0], "camera": 0, "mesh": 0, "children": [1]}]
    nodes += [{"mesh": 0, "scale": [2, 2, 2]}]
    camera = {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}
    mesh = load(tmp_path / "a.glb", mesh_gltf(nodes=nodes, cameras=[camera])).mesh
    assert sorted(mesh.vertices[:, 0]) == [5, 5, 5, 5, 6, 7]


# Faces


def test_faces_without_area_that_join_nothing_are_dropped_and_counted(tmp_path):
    vertices = [*TRIANGLE, [2, 0, 0], [1 / 3, 1 / 3, 1 / 3], [2 / 3, 2 / 3, 2 / 3], [1, 1, 1]]
    faces = [[0, 1, 2], [0, 1, 3], [1, 1, 2], [4, 5, 6], [2, 2, 2]]
    loaded = check(load(tmp_path / "a.obj", obj_of(vertices, faces)))
    # The second face lies along a side of the first, and has its normal.
    assert (len(loaded.mesh.faces), loaded.dropped_faces) == (2, 3)
    assert np.ptp(loaded.mesh.normals, axis=0).max() < 1e-15


def test_a_sliver_is_no_face_without_area(tmp_path):
    loaded = load(tmp_path / "a.obj", "v 0 0 0\nv 1 0 0\nv 0.5 1e-12 0\nf 1 2 3\n")
    assert loaded.dropped_faces == 0
    assert loaded.mesh.normals.tolist() == [[0, 0, 1]] * 3


@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1, 1e9, 1e150])
def test_small_and_large_models(tmp_path, sphere, scale):
    # Below an area of about 1e-13 trimesh computes no normal.
    loaded = check(load(tmp_path / "a.obj", obj_of(sphere.vertices * scale, sphere.faces)))
    assert (loaded.dropped_faces, len(loaded.mesh.faces)) == (0, len(sphere.faces))
    one = normalise(loaded.mesh.vertices)
    assert np.einsum("vi,vi->v", loaded.mesh.normals, one).min() > np.cos(np.radians(3))


def test_too_many_triangles(tmp_path, monkeypatch):
    monkeypatch.setattr(blysk.sim.meshes.loaded_mesh, "MAX_FACES", 100)
    nodes = [{"children": list(range(1, 11))}] + [{"mesh": 0} for _ in range(10)]
    box = trimesh.creation.box()
    document = mesh_gltf(box.vertices, box.faces, None, nodes)
    check_refused(tmp_path / "a.glb", "it has 120 triangles; the limit is 100", content=document)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e400"])
def test_vertices_that_are_not_finite(tmp_path, value):
    text = f"v 0 0 0\nv 1 0 0\nv 0 {value} 0\nf 1 2 3\n"
    check_refused(tmp_path / "a.obj", "1 of its vertices are NaN or infinite", content=text)
    vertices = np.array(TRIANGLE, dtype=float)
    vertices[1, 2] = float(value)
    with np.errstate(over="ignore"):
        put(tmp_path / "a.ply", trimesh.Trimesh(vertices, [[0, 1, 2]], process=False))
    check_refused(tmp_path / "a.ply", "NaN or infinite")
    # A vertex without a face does not matter.
    assert len(load(tmp_path / "a.obj", f"v {value} 0 0\n{CORNERS}f 2 3 4\n").mesh.vertices) == 3


def test_transform_that_is_not_finite(tmp_path):
    node = {"mesh": 0, "scale": [1e300, 1, 1], "translation": [float("nan"), 0, 0]}
    document = mesh_gltf(normals=[[0, 0, 1]] * 3, nodes=[node])
    check_refused(tmp_path / "a.glb", "NaN or infinite", content=document)
