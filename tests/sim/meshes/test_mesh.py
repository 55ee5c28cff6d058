"""Mesh loading against analytic shapes, facts about trimesh, and damaged files of every kind."""

import base64
import importlib.util
import io
import json
import logging
import os
import re
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import blysk.sim.meshes.mesh
import blysk.sim.meshes.obj
from blysk.golden.frame_constants import MAX_MATERIALS
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.sim.errors import InputError
from blysk.sim.meshes.materials import FileMaterial, surfaces
from blysk.sim.meshes.mesh import SUFFIXES, LoadedMesh, load_mesh

DATA = Path(__file__).parents[2] / "data"


def exported(mesh, file_type, **options):
    data = mesh.export(file_type=file_type, **options)
    return data.encode() if isinstance(data, str) else data


def save(path, mesh, **options):
    path.write_bytes(exported(mesh, path.suffix[1:], **options))
    return str(path)


def without_normals(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def with_normals(mesh, normals):
    return trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_normals=normals, process=False)


def face_normals(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return normalise(np.cross(b - a, c - a))


def volume(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return np.einsum("fi,fi->", a, np.cross(b, c)) / 6


def check_mesh(mesh):
    """What every loaded mesh promises."""
    assert len(mesh.faces) > 0
    assert np.isfinite(mesh.vertices).all()
    # Three squares, a sum, a root and a division round to less than 8 units of 2**-53.
    assert np.abs(np.linalg.norm(mesh.normals, axis=1) - 1).max() < 8 * 2**-53
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))
    assert mesh.faces.dtype == np.int64


def check_refused(source, *words, **options):
    with pytest.raises(InputError) as refusal:
        load_mesh(str(source), **options)
    text = str(refusal.value)
    assert "\n" not in text
    assert text.startswith(str(source)) or not os.path.exists(str(source))
    for word in words:
        assert word in text
    return text


def gltf(primitives, blobs, accessors, nodes, **extra):
    """A glTF document and its one buffer, each blob a view of its own."""
    buffer, views = b"", []
    for blob in blobs:
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(blob)})
        buffer += blob + bytes(-len(blob) % 4)
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": primitives}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(buffer)}],
        **extra,
    }
    return document, buffer


def glb(document, buffer):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if buffer:
        chunks += struct.pack("<II", len(buffer), 0x004E4942) + buffer
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def mesh_gltf(vertices, faces, normals=None, nodes=None, **extra):
    blobs = [np.asarray(vertices, "<f4").tobytes(), np.asarray(faces, "<u4").tobytes()]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
        {"bufferView": 1, "componentType": 5125, "count": np.size(faces), "type": "SCALAR"},
    ]
    attributes = {"POSITION": 0}
    if normals is not None:
        blobs.append(np.asarray(normals, "<f4").tobytes())
        accessors.append({"bufferView": 2, "componentType": 5126, "count": len(normals), "type": "VEC3"})
        attributes["NORMAL"] = 2
    primitives = [{"attributes": attributes, "indices": 1}]
    return gltf(primitives, blobs, accessors, nodes or [{"mesh": 0}], **extra)


TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.fixture
def sphere():
    return trimesh.creation.icosphere(subdivisions=2)


# Sources


def test_teapot_by_name():
    loaded = load_mesh("teapot", triangles=992)
    assert isinstance(loaded, LoadedMesh)
    assert (loaded.name, loaded.repaired_normals, loaded.dropped_faces) == ("teapot", 0, 0)
    assert len(loaded.mesh.faces) == 992


def test_teapot_is_always_the_built_in_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("teapot").write_text("not a mesh")
    assert load_mesh("teapot", triangles=240).name == "teapot"
    check_refused("./teapot", "has no suffix")


def test_teapot_count_out_of_range():
    with pytest.raises(InputError, match="teapot of 10 triangles"):
        load_mesh("teapot", triangles=10)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb", ".GLB", ".Obj", ".PLY", ".STL"])
def test_every_format(tmp_path, suffix):
    cube = without_normals(trimesh.creation.box(extents=(2, 2, 2)))
    path = tmp_path / f"my.cube{suffix}"
    path.write_bytes(Path(save(tmp_path / f"x{suffix.lower()}", cube)).read_bytes())
    loaded = load_mesh(str(path))
    check_mesh(loaded.mesh)
    assert (loaded.name, loaded.repaired_normals, loaded.dropped_faces) == ("my.cube", 0, 0)
    assert loaded.mesh.faces.shape == (12, 3)
    assert len(loaded.mesh.vertices) == 24
    assert volume(loaded.mesh) == pytest.approx(8, rel=1e-12)
    # Each corner of a flat face has exactly that face's normal.
    corner = loaded.mesh.normals[loaded.mesh.faces]
    assert np.abs(corner - face_normals(loaded.mesh)[:, np.newaxis]).max() < 1e-15


def test_gltf_with_buffer_beside_it(tmp_path):
    for name, data in trimesh.Scene(trimesh.creation.box()).export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    assert len(load_mesh(str(tmp_path / "model.gltf")).mesh.faces) == 12


def test_gltf_with_data_in_the_uri(tmp_path):
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2])
    document["buffers"][0]["uri"] = (
        "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    )
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(document))
    assert load_mesh(str(path)).mesh.vertices.tolist() == TRIANGLE


def test_gltf_with_escaped_name(tmp_path):
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2])
    document["buffers"][0]["uri"] = "sub/my%20data.bin"
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "my data.bin").write_bytes(buffer)
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(document))
    assert len(load_mesh(str(path)).mesh.faces) == 1


def test_real_file():
    # 992 triangles without normals, from the same patches as the built-in teapot, 5 times as large.
    loaded = load_mesh(str(DATA / "teapot992.obj"))
    check_mesh(loaded.mesh)
    assert (len(loaded.mesh.faces), loaded.repaired_normals, loaded.dropped_faces) == (992, 0, 0)
    assert volume(loaded.mesh) / 125 == pytest.approx(
        volume(load_mesh("teapot", triangles=992).mesh), rel=0.02
    )


# Computed normals


def prism(sides):
    """The side of a prism: quadrilaterals at 360 / sides degrees to each other."""
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(turn), np.zeros(sides), -np.sin(turn)], axis=-1)
    vertices = np.concatenate([ring, ring + np.array([0, 1, 0])])
    i = np.arange(sides)
    j = (i + 1) % sides
    faces = np.concatenate(
        [np.stack([i, j, j + sides], axis=-1), np.stack([i, j + sides, i + sides], axis=-1)]
    )
    return trimesh.Trimesh(vertices, faces, process=False)


@pytest.mark.parametrize(
    ("crease", "vertices"), [(0, 48), (20, 48), (29.9, 48), (30, 24), (30.1, 24), (40, 24), (180, 24)]
)
def test_crease_angle(tmp_path, crease, vertices):
    # 12 sides meet at 30 degrees: smooth (24 vertices, radial normals) or cut (4 vertices a side). At exactly
    # 30 the cut needs an angle above, and the slack takes up the rounding of the float32 file.
    path = save(tmp_path / "prism.ply", prism(12))
    mesh = load_mesh(path, crease_angle=crease).mesh
    check_mesh(mesh)
    assert len(mesh.vertices) == vertices
    if vertices == 24:
        radial = normalise(mesh.vertices * [1, 0, 1])
        # float32 stores a coordinate to 6e-8; an edge of 0.5 turns by at most 4 times that.
        assert np.abs(mesh.normals - radial).max() < 1e-6
    else:
        assert np.abs(mesh.normals[mesh.faces] - face_normals(mesh)[:, np.newaxis]).max() < 1e-6


def test_default_crease_angle_is_40_degrees(tmp_path):
    path = save(tmp_path / "prism.ply", prism(9))
    assert len(load_mesh(path).mesh.vertices) == len(load_mesh(path, crease_angle=40).mesh.vertices) == 18
    assert len(load_mesh(save(tmp_path / "p8.ply", prism(8))).mesh.vertices) == 32


def test_crease_that_ends_in_a_smooth_patch(tmp_path):
    # A sheet cut half way by a fold: sharp at one end, flat at the other, all faces connected by smooth edges
    # elsewhere. The corner in the middle of the fold must be cut although its faces are one smooth patch.
    x, z = np.meshgrid([-1.0, 0.0, 1.0], [0.0, 1.0, 2.0, 3.0])
    y = np.where(x == 0, np.array([[0.0], [0.0], [0.0], [1.0]]), 0.0)
    grid = np.arange(12).reshape(4, 3)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    faces = np.concatenate([np.stack([a, d, c], axis=-1), np.stack([a, c, b], axis=-1)]).reshape(-1, 3)
    sheet = trimesh.Trimesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), faces, process=False)
    mesh = load_mesh(save(tmp_path / "sheet.ply", sheet), crease_angle=40).mesh
    ridge = (mesh.vertices == [0, 1, 3]).all(axis=1)
    assert ridge.sum() == 2
    assert mesh.normals[ridge][0] @ mesh.normals[ridge][1] < np.cos(np.radians(40))
    assert (mesh.vertices == [0, 0, 0]).all(axis=1).sum() == 1


def test_angle_weighted(tmp_path):
    # At a cube's corner the three faces have 90 degrees each, in 3 to 6 triangles: only weights by angle give
    # the diagonal.
    path = save(tmp_path / "cube.stl", trimesh.creation.box(extents=(2, 2, 2)))
    mesh = load_mesh(path, crease_angle=180).mesh
    assert len(mesh.vertices) == 8
    assert np.abs(mesh.normals - mesh.vertices / np.sqrt(3)).max() < 1e-15


def test_faces_back_to_back(tmp_path):
    path = tmp_path / "leaf.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n")
    mesh = load_mesh(str(path), crease_angle=180).mesh
    check_mesh(mesh)
    assert (np.abs(mesh.normals) == [0, 0, 1]).all()
    assert len(load_mesh(str(path)).mesh.vertices) == 6


@pytest.mark.parametrize("angle", [-0.1, 180.1, float("nan"), float("inf")])
def test_crease_angle_out_of_range(angle):
    with pytest.raises(InputError, match=r"crease angle .*: it must be 0 to 180 degrees"):
        load_mesh("teapot", crease_angle=angle)


# Facts about trimesh


def tilted(sphere):
    """Unit normals of a sphere, all turned by 40 degrees about y: nothing that could be computed."""
    return sphere.vertices @ trimesh.transformations.rotation_matrix(np.radians(40), [0, 1, 0])[:3, :3].T


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_stored_normals_survive(tmp_path, sphere, suffix):
    options = {"include_normals": True} if suffix == ".obj" else {}
    path = save(tmp_path / f"s{suffix}", with_normals(sphere, tilted(sphere)), **options)
    loaded = load_mesh(path)
    assert loaded.repaired_normals == 0
    expected = tilted(trimesh.Trimesh(normalise(loaded.mesh.vertices), loaded.mesh.faces, process=False))
    # float32 in PLY and GLB; OBJ is written with 8 decimals.
    assert np.abs(loaded.mesh.normals - expected).max() < 3e-7
    # The fact: trimesh's own way to one mesh loses them.
    lost = trimesh.load_mesh(path, process=False).vertex_normals
    if suffix == ".glb":
        assert np.abs(lost - expected).max() > 0.3


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_bad_stored_normals_are_mended_and_counted(tmp_path, sphere, suffix):
    normals = np.array(sphere.vertices)
    normals[0] = 0
    normals[1] = np.nan
    normals[2] = [np.inf, 0, 0]
    normals[3] *= 1.01
    normals[4] *= 1 + 1 / 512
    normals[5] *= 1e-30
    normals[6] *= 0.5
    normals[7] *= 1 + 1 / 256
    normals[8] *= 1 - 1 / 256
    path = tmp_path / f"s{suffix}"
    if suffix == ".ply":
        save(path, with_normals(sphere, normals))
    else:
        path.write_bytes(glb(*mesh_gltf(sphere.vertices, sphere.faces, normals)))
    path = str(path)
    stored = next(iter(trimesh.load_scene(path, process=False).geometry.values())).vertex_normals
    assert np.isnan(stored[1]).all()
    assert not stored[0].any()
    loaded = load_mesh(path)
    check_mesh(loaded.mesh)
    assert loaded.repaired_normals == 6
    radial = normalise(loaded.mesh.vertices)
    # The icosphere is regular to a degree or so: a computed normal is that near to the radius.
    assert np.einsum("vi,vi->v", loaded.mesh.normals, radial).min() > np.cos(np.radians(3))
    right = np.ones(len(radial), dtype=bool)
    right[:3] = False
    assert np.abs(loaded.mesh.normals[right] - radial[right]).max() < 3e-7


def test_normals_of_unused_vertices_do_not_count(tmp_path):
    document, buffer = mesh_gltf([*TRIANGLE, [5, 5, 5]], [0, 1, 2], [[0, 0, 1]] * 3 + [[0, 0, 0]])
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    loaded = load_mesh(str(tmp_path / "a.glb"))
    assert (loaded.repaired_normals, len(loaded.mesh.vertices)) == (0, 3)


def test_obj_whose_normals_cannot_be_used_is_counted(tmp_path):
    # trimesh drops all normals if one face has none, or if one index is out of range.
    head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0.6 0.8\n"
    for faces in ("f 1//1 2//1 3//1\nf 2 4 3\n", "f 1//1 2//1 3//1\nf 2//1 4//7 3//1\n"):
        (tmp_path / "a.obj").write_text(head + faces)
        loaded = load_mesh(str(tmp_path / "a.obj"))
        assert loaded.repaired_normals == 4
        assert (loaded.mesh.normals == [0, 0, 1]).all()


@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1, 1e9, 1e150])
def test_small_and_large_models(tmp_path, sphere, scale):
    # The fact: below an area of about 1e-13 trimesh computes no normal at all.
    if scale == 1e-9:
        tiny = trimesh.Trimesh(sphere.vertices * scale, sphere.faces, process=False)
        assert not tiny.vertex_normals.any()
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in (sphere.vertices * scale).tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (sphere.faces + 1).tolist()]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    loaded = load_mesh(str(tmp_path / "a.obj"))
    check_mesh(loaded.mesh)
    assert (loaded.dropped_faces, len(loaded.mesh.faces)) == (0, len(sphere.faces))
    one = normalise(loaded.mesh.vertices)
    assert np.einsum("vi,vi->v", loaded.mesh.normals, one).min() > np.cos(np.radians(3))


def test_stl_cube_stays_sharp(tmp_path):
    path = save(tmp_path / "cube.stl", trimesh.creation.box())
    # The fact: merged vertices make trimesh shade a cube like a ball.
    assert len(trimesh.load_mesh(path).vertices) == 8
    mesh = load_mesh(path).mesh
    assert np.sort(np.abs(mesh.normals), axis=1).tolist() == [[0, 0, 1]] * 24


def draco_glb():
    accessors = [
        {"componentType": 5126, "count": 3, "type": "VEC3"},
        {"componentType": 5125, "count": 3, "type": "SCALAR"},
    ]
    extension = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    primitives = [{"attributes": {"POSITION": 0}, "indices": 1, "extensions": extension}]
    return glb(
        *gltf(
            primitives, [b"DRACO123"], accessors, [{"mesh": 0}], extensionsUsed=["KHR_draco_mesh_compression"]
        )
    )


def test_draco_without_its_decoder(tmp_path, monkeypatch):
    path = tmp_path / "a.glb"
    path.write_bytes(draco_glb())
    find_spec = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "DracoPy" else find_spec(name)
    )
    check_refused(path, "DracoPy", "pip install DracoPy")


def test_draco_that_does_not_decode_is_no_mesh(tmp_path, monkeypatch):
    # The fact: trimesh then leaves zeros and only logs it.
    path = tmp_path / "a.glb"
    path.write_bytes(draco_glb())
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    check_refused(path, "all its vertices are at one point")


def test_obj_index_out_of_range(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
    with pytest.raises(IndexError):
        trimesh.load_scene(str(path))
    check_refused(path, "IndexError", "out of bounds")


def test_obj_of_lines(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    assert isinstance(next(iter(trimesh.load_scene(str(path)).geometry.values())), trimesh.PointCloud)
    check_refused(path, "it has no faces")


def test_corrupt_gltf_does_not_load_its_neighbour(tmp_path):
    # The fact: trimesh falls back to a file called model.gltf in the same folder.
    for name, data in trimesh.Scene(trimesh.creation.box()).export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    path = tmp_path / "mine.gltf"
    path.write_text("{ not json")
    assert len(trimesh.load_scene(str(path)).geometry) == 1
    check_refused(path, "its JSON is damaged")


def test_trimesh_log_stays_off_the_terminal(tmp_path, monkeypatch, capfd):
    path = save(tmp_path / "a.stl", trimesh.creation.box())
    load = trimesh.load_scene

    def noisy(*args, **kwargs):
        logging.getLogger("trimesh").warning("noise")
        return load(*args, **kwargs)

    monkeypatch.setattr(blysk.sim.meshes.mesh.trimesh, "load_scene", noisy)
    level = logging.getLogger("trimesh").level
    load_mesh(path)
    assert capfd.readouterr() == ("", "")
    assert logging.getLogger("trimesh").level == level


# Scenes


@pytest.mark.parametrize("stored", [True, False])
@pytest.mark.parametrize("mirror", [1, -1])
def test_node_transforms(tmp_path, sphere, stored, mirror):
    # A sphere stretched, turned and moved by two nested nodes is an ellipsoid x = M s + t; its normals are
    # those of |M^-1 (x - t)| = 1, along M^-T s.
    outer = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])
    outer[:3, 3] = [10, -20, 30]
    inner = np.diag([mirror * 2.0, 0.5, 3.0, 1.0])
    nodes = [
        {"children": [1], "matrix": outer.T.ravel().tolist()},
        {"mesh": 0, "scale": np.diag(inner)[:3].tolist()},
    ]
    document, buffer = mesh_gltf(sphere.vertices, sphere.faces, sphere.vertices if stored else None, nodes)
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    loaded = load_mesh(str(tmp_path / "a.glb"), crease_angle=180)
    check_mesh(loaded.mesh)
    assert (loaded.repaired_normals, loaded.dropped_faces) == (0, 0)
    matrix = (outer @ inner)[:3, :3]
    unit = (loaded.mesh.vertices - outer[:3, 3]) @ np.linalg.inv(matrix).T
    assert np.abs(np.linalg.norm(unit, axis=1) - 1).max() < 1e-6
    expected = normalise(unit @ np.linalg.inv(matrix))
    angle = np.degrees(np.arccos(np.clip(np.einsum("vi,vi->v", loaded.mesh.normals, expected), -1, 1)))
    # float32 for stored ones; a coarse, stretched ellipsoid for computed ones.
    assert angle.max() < (1e-4 if stored else 15)
    assert volume(loaded.mesh) == pytest.approx(3 * sphere.volume, rel=1e-5)
    assert (
        np.einsum("fi,fki->fk", face_normals(loaded.mesh), loaded.mesh.normals[loaded.mesh.faces]) > 0
    ).all()


def test_one_mesh_at_two_nodes(tmp_path, sphere):
    scene = trimesh.Scene()
    scene.add_geometry(with_normals(sphere, sphere.vertices), node_name="a", geom_name="s")
    mirror = np.diag([-1.0, 1, 1, 1])
    mirror[0, 3] = 10
    scene.graph.update("b", matrix=mirror, geometry="s")
    path = save(tmp_path / "two.glb", scene)
    mesh = load_mesh(path).mesh
    assert len(mesh.faces) == 2 * len(sphere.faces)
    assert volume(mesh) == pytest.approx(2 * sphere.volume, rel=1e-6)
    centre = np.where(mesh.vertices[:, :1] > 5, [10.0, 0, 0], [0.0, 0, 0])
    assert np.abs(mesh.normals - (mesh.vertices - centre)).max() < 1e-6


def test_node_that_flattens(tmp_path, sphere):
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "scale": [0, 0, 0]}]
    document, buffer = mesh_gltf(sphere.vertices, sphere.faces, sphere.vertices, nodes)
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    loaded = load_mesh(str(tmp_path / "a.glb"))
    assert (len(loaded.mesh.faces), loaded.dropped_faces) == (len(sphere.faces), len(sphere.faces))


def test_points_beside_a_mesh(tmp_path):
    scene = trimesh.Scene([trimesh.creation.box(), trimesh.PointCloud(np.eye(3) * 50)])
    loaded = load_mesh(save(tmp_path / "a.glb", scene))
    assert len(loaded.mesh.faces) == 12
    assert np.abs(loaded.mesh.vertices).max() == 0.5
    check_refused(save(tmp_path / "p.glb", trimesh.Scene([trimesh.PointCloud(np.eye(3))])), "it has no faces")


def test_objects_and_materials_weld_to_one(tmp_path):
    # Two halves of a flat sheet in two materials: no seam in the normals.
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n"
    (tmp_path / "a.obj").write_text(text)
    assert len(load_mesh(str(tmp_path / "a.obj")).mesh.vertices) == 4


@pytest.mark.parametrize(
    "text",
    [
        "f 1 2 3 4\nf 5 6 7 8 9",
        "f 1 2 3 4 # last\nf -5 -4 -3 -2 -1",
        "  f\t1 2 \\\n3 4\nf 5 6 7 8 9",
        "f 1 2 3 4\r\nf 5 6 7 8 9\r\n",
    ],
)
def test_polygons_and_odd_spelling_in_obj(tmp_path, text):
    vertices = [(0, 0), (1, 0), (1, 1), (0, 1), (3, 0), (4, 0), (4, 1), (3.5, 2), (3, 1)]
    head = "".join(f" v\t{x} {y} 0 # {i}\n" for i, (x, y) in enumerate(vertices))
    (tmp_path / "a.obj").write_bytes((head + text).encode())
    mesh = load_mesh(str(tmp_path / "a.obj")).mesh
    assert len(mesh.faces) == 5
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == 1 + 1.5


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl"])
def test_names_in_another_encoding(tmp_path, suffix):
    box = trimesh.creation.box()
    if suffix == ".obj":
        data = "o Größe\n# für\n".encode("latin-1") + exported(box, "obj")
    elif suffix == ".ply":
        data = exported(box, "ply").replace(b"1.0\n", "1.0\ncomment für\n".encode("latin-1"), 1)
    else:
        data = exported(box, "stl_ascii").replace(b"solid", "solid für".encode("latin-1"), 1)
    (tmp_path / f"a{suffix}").write_bytes(data)
    assert len(load_mesh(str(tmp_path / f"a{suffix}")).mesh.faces) == 12


def test_binary_stl_that_begins_like_a_text(tmp_path):
    data = b"solid".ljust(80, b" ") + exported(trimesh.creation.box(), "stl")[80:]
    (tmp_path / "a.stl").write_bytes(data)
    assert len(load_mesh(str(tmp_path / "a.stl")).mesh.faces) == 12
    (tmp_path / "a.stl").write_bytes(data[:-50])
    check_refused(tmp_path / "a.stl", "the header says 12 triangles")


def test_ply_with_texture_coordinates_keeps_its_normals(tmp_path):
    # The fact: cutting at texture seams reorders the vertices and leaves the normals.
    header = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "property float nx\nproperty float ny\nproperty float nz\nelement face 2\n"
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
    )
    rows = "0 0 0 0 0 1\n1 0 0 0.6 0 0.8\n1 1 0 0 0.6 0.8\n0 1 0 0 1 0\n"
    rows += "3 3 2 1 6 0 0 1 0 1 1\n3 3 1 0 6 0 0 1 1 0 1\n"
    (tmp_path / "a.ply").write_text(header + rows)
    mesh = load_mesh(str(tmp_path / "a.ply")).mesh
    normal = {tuple(v): n for v, n in zip(mesh.vertices.tolist(), mesh.normals, strict=True)}
    expected = {
        (0, 0, 0): [0, 0, 1],
        (1, 0, 0): [0.6, 0, 0.8],
        (1, 1, 0): [0, 0.6, 0.8],
        (0, 1, 0): [0, 1, 0],
    }
    for place, value in expected.items():
        assert np.abs(normal[place] - value).max() < 1e-6


def test_faces_without_area_are_dropped_and_counted(tmp_path):
    vertices = [*TRIANGLE, [2, 0, 0], [1 / 3, 1 / 3, 1 / 3], [2 / 3, 2 / 3, 2 / 3], [1, 1, 1]]
    faces = [[0, 1, 2], [0, 1, 3], [1, 1, 2], [4, 5, 6], [2, 2, 2]]
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    loaded = load_mesh(str(tmp_path / "a.obj"))
    check_mesh(loaded.mesh)
    assert (len(loaded.mesh.faces), loaded.dropped_faces) == (1, 4)


def test_a_sliver_is_no_face_without_area(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0.5 1e-12 0\nf 1 2 3\n")
    loaded = load_mesh(str(tmp_path / "a.obj"))
    assert loaded.dropped_faces == 0
    assert loaded.mesh.normals.tolist() == [[0, 0, 1]] * 3


# Bad input


def test_missing_folder_and_suffix(tmp_path):
    check_refused(tmp_path / "no.obj", "there is no such file")
    check_refused(tmp_path, "is a folder")
    check_refused("a\0b.obj", "there is no such file")
    check_refused("x" * 5000 + ".obj", "cannot be opened")
    folder = tmp_path / "folder.obj"
    folder.mkdir()
    check_refused(folder, "is a folder")
    (tmp_path / "a.dae").write_text("x")
    check_refused(tmp_path / "a.dae", "unknown mesh type '.dae'", "use .obj, .ply, .stl, .glb or .gltf")
    pipe = tmp_path / "pipe.obj"
    os.mkfifo(pipe)
    check_refused(pipe, "is not a regular file")


def test_name_with_a_line_break_gives_one_line():
    with pytest.raises(InputError) as refusal:
        load_mesh("a\nb.obj")
    assert str(refusal.value).startswith("a?b.obj: there is no such file")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_empty_and_nonsense(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"")
    check_refused(path, "the file is empty")
    for nonsense in (b"\0", b"hello\n", b"\xff\xfe" * 50, bytes(range(256)) * 4, b"{}", b"[]", b"null"):
        path.write_bytes(nonsense)
        check_refused(path)


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".glb"])
def test_cut_short_at_every_byte(tmp_path, suffix):
    whole = Path(save(tmp_path / f"whole{suffix}", trimesh.creation.box())).read_bytes()
    path = tmp_path / f"a{suffix}"
    for length in range(1, len(whole), 7):
        path.write_bytes(whole[:length])
        check_refused(path)


def test_cut_short_text(tmp_path):
    ply = trimesh.creation.box().export(file_type="ply", encoding="ascii")
    path = tmp_path / "a.ply"
    lines = ply.splitlines(keepends=True)
    for count in range(1, len(lines)):
        path.write_bytes(b"".join(lines[:count]))
        check_refused(path)
    path = tmp_path / "a.stl"
    path.write_text("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n")
    check_refused(path, "cut short")


@pytest.mark.parametrize("word", ["", "element", "property", "element vertex", "property float"])
def test_much_space_in_a_ply_header(tmp_path, word):
    """The time grows with the length, and not with its square: of that this would take minutes."""
    path = tmp_path / "a.ply"
    for space in ("\n", " ", "\t"):
        path.write_text(f"ply\nformat ascii 1.0\n{word}{300_000 * space}x\nend_header\n")
        check_refused(path)


@pytest.mark.parametrize("name", ["x" * 300, "loop", "loop/a"])
def test_references_that_are_no_files(tmp_path, name):
    (tmp_path / "loop").symlink_to("loop")
    document, _ = mesh_gltf(TRIANGLE, [0, 1, 2])
    document["buffers"][0]["uri"] = name
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    check_refused(
        tmp_path / "a.gltf", f"it refers to {name!r}, which does not exist; put that file beside it"
    )


def test_many_material_files_in_a_line(tmp_path):
    names = [f"{number}.mtl" for number in range(100)]
    (tmp_path / "99.mtl").write_text("newmtl a\nKd 1 0 0\n")
    text = f"mtllib {' '.join(names)}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text)
    loaded = load_mesh(str(tmp_path / "a.obj"))
    assert loaded.materials == (FileMaterial("a", diffuse=RED),)
    assert len(loaded.ignored) == 99


@pytest.mark.parametrize("count", [10**6, 2**31, 2**32 - 1, 10**18, 10**30])
def test_absurd_counts(tmp_path, count):
    # None of these may be believed: allocated for, or waited for.
    ply = trimesh.creation.box().export(file_type="ply")
    path = tmp_path / "a.ply"
    path.write_bytes(ply.replace(b"element vertex 8", b"element vertex %d" % count))
    check_refused(path)
    path.write_bytes(ply.replace(b"element face 12", b"element face %d" % count))
    check_refused(path)
    if count < 2**32:
        stl = trimesh.creation.box().export(file_type="stl")
        path = tmp_path / "a.stl"
        path.write_bytes(stl[:80] + struct.pack("<I", count) + stl[84:])
        check_refused(path, f"the header says {count} triangles")
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2])
    document["accessors"][0]["count"] = count
    path = tmp_path / "a.glb"
    path.write_bytes(glb(document, buffer))
    check_refused(path)
    del document["accessors"][0]["bufferView"]
    path.write_bytes(glb(document, buffer))
    check_refused(path)


def test_too_many_triangles(tmp_path, monkeypatch):
    monkeypatch.setattr(blysk.sim.meshes.mesh, "MAX_FACES", 100)
    nodes = [{"children": list(range(1, 11))}] + [{"mesh": 0} for _ in range(10)]
    box = trimesh.creation.box()
    document, buffer = mesh_gltf(box.vertices, box.faces, None, nodes)
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    check_refused(tmp_path / "a.glb", "it has 120 triangles; the limit is 100")


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e400"])
def test_vertices_that_are_not_finite(tmp_path, value):
    path = tmp_path / "a.obj"
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 {value} 0\nf 1 2 3\n")
    check_refused(path, "1 of its vertices are NaN or infinite")
    path = tmp_path / "a.ply"
    vertices = np.array(TRIANGLE, dtype=float)
    vertices[1, 2] = float(value)
    with np.errstate(over="ignore"):
        save(path, trimesh.Trimesh(vertices, [[0, 1, 2]], process=False))
    check_refused(path, "NaN or infinite")


def test_unused_vertex_that_is_not_finite(tmp_path):
    (tmp_path / "a.obj").write_text("v nan 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n")
    assert len(load_mesh(str(tmp_path / "a.obj")).mesh.vertices) == 3


def test_transform_that_is_not_finite(tmp_path):
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2], [[0, 0, 1]] * 3, [{"mesh": 0, "scale": [1e300, 1, 1]}])
    document["nodes"][0]["translation"] = [float("nan"), 0, 0]
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    check_refused(tmp_path / "a.glb", "NaN or infinite")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3", "all its vertices are at one point"),
        ("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3", "none of its faces has an area"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9", "it has no faces"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2", "vertex index 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2", "fewer than 3 corners"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9", "out of bounds"),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1",
            "relative face indices",
        ),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 x 3", "could not be read"),
        ("v 0 0\nv 1 0\nv 0 1\nf 1 2 3", "cannot be read"),
    ],
)
def test_bad_obj(tmp_path, text, reason):
    path = tmp_path / "a.obj"
    path.write_text(text)
    check_refused(path, reason)


@pytest.mark.parametrize("index", [3, 2**31, 2**32 - 1])
def test_gltf_index_out_of_range(tmp_path, index):
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, index])
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    check_refused(tmp_path / "a.glb", f"a face refers to vertex {index} (from 0), there are 3")


def test_ply_negative_index(tmp_path):
    ply = trimesh.Trimesh(TRIANGLE, [[0, 1, 2]], process=False).export(file_type="ply", encoding="ascii")
    path = tmp_path / "a.ply"
    path.write_bytes(ply.replace(b"3 0 1 2", b"3 0 1 -1"))
    check_refused(path, "a face refers to vertex -1")


def test_gltf_features_that_would_load_wrongly(tmp_path):
    path = tmp_path / "a.glb"
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2], extensionsUsed=["EXT_meshopt_compression"])
    path.write_bytes(glb(document, buffer))
    check_refused(path, "EXT_meshopt_compression", "export it uncompressed")
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2])
    document["accessors"][0]["sparse"] = {"count": 1}
    path.write_bytes(glb(document, buffer))
    check_refused(path, "sparse accessors")
    del document["accessors"][0]["sparse"], document["accessors"][0]["bufferView"]
    path.write_bytes(glb(document, buffer))
    check_refused(path, "a mesh has no data")


@pytest.mark.parametrize(
    "uri",
    [
        "../secret.bin",
        "%2e%2e/secret.bin",
        "sub/../../secret.bin",
        "sub/../secret.bin",
        "/etc/hostname",
        "file:///etc/hostname",
        "https://example.org/a.bin",
        "C:\\a.bin",
        "\\\\host\\a.bin",
        "link.bin",
    ],
)
def test_references_outside_the_folder(tmp_path, uri):
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2])
    (tmp_path / "secret.bin").write_bytes(buffer)
    # trimesh would take a file of the same name in the folder instead.
    (folder / "secret.bin").write_bytes(buffer)
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    document["buffers"][0]["uri"] = uri
    path = folder / "a.gltf"
    path.write_text(json.dumps(document))
    check_refused(path, "outside its folder")


def test_missing_reference(tmp_path):
    document, _ = mesh_gltf(TRIANGLE, [0, 1, 2])
    document["buffers"][0]["uri"] = "no.bin"
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(document))
    check_refused(path, "'no.bin', which does not exist")


def loaded_or_refused(path):
    try:
        return load_mesh(str(path)), None
    except InputError as refusal:
        return None, str(refusal)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb", "ascii.ply"])
def test_damaged_bytes(tmp_path, suffix):
    """A file with random bytes changed is loaded whole, or refused in one line; nothing else comes out."""
    sphere = trimesh.creation.icosphere(subdivisions=1)
    options = {"encoding": "ascii"} if suffix == "ascii.ply" else {}
    data = exported(sphere, suffix.split(".")[1], **options)
    random = np.random.default_rng(20261121)
    path = tmp_path / f"a.{suffix.split('.')[1]}"
    refused = 0
    for _ in range(150):
        damaged = bytearray(data)
        for at in random.integers(0, len(data), random.integers(1, 6)):
            damaged[at] = random.integers(0, 256)
        path.write_bytes(bytes(damaged))
        loaded, refusal = loaded_or_refused(path)
        if loaded:
            check_mesh(loaded.mesh)
        else:
            assert "\n" not in refusal
            refused += 1
    assert refused > 0


@pytest.mark.parametrize("kind", ["outside", "inside", "one material", "gltf"])
def test_reads_the_file_and_checked_references_only(tmp_path, monkeypatch, kind):
    # No material file outside the folder, no texture, and nothing at all where materials are not asked for.
    path = tmp_path / "a.obj"
    library = "../../secret.mtl" if kind == "outside" else "a.mtl"
    path.write_text(f"mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n")
    (tmp_path / "a.mtl").write_text("newmtl a\nKd 1 0 0\nmap_Kd a.png\n")
    expected = [str(path), str(tmp_path / "a.mtl")] if kind == "inside" else [str(path)]
    if kind == "gltf":
        path = tmp_path / "a.gltf"
        document, buffer = mesh_gltf(
            TRIANGLE,
            [0, 1, 2],
            images=[{"uri": "a.png"}, {"uri": "../secret.png"}],
            textures=[{"source": 0}, {"source": 1}],
            materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}],
        )
        document["meshes"][0]["primitives"][0]["material"] = 0
        document["buffers"][0]["uri"] = "a.bin"
        (tmp_path / "a.bin").write_bytes(buffer)
        path.write_text(json.dumps(document))
        expected = [str(path), str(tmp_path / "a.bin")]
    (tmp_path / "a.png").write_bytes(b"no picture")
    opened = []
    original = io.open

    def watching(file, *args, **kwargs):
        opened.append(str(file))
        return original(file, *args, **kwargs)

    monkeypatch.setattr("builtins.open", watching)
    monkeypatch.setattr("io.open", watching)
    if kind == "outside":
        check_refused(path, "outside its folder")
    else:
        load_mesh(str(path), materials=kind != "one material")
    assert opened == expected


# Materials


RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def strip(count):
    """Triangles side by side, the middle of number k at x = 2 k + 1/3, as lines of an OBJ file."""
    lines = [f"v {2 * k + x} {y} 0" for k in range(count) for x, y in ((0, 0), (1, 0), (0, 1))]
    return "\n".join(lines) + "\n", [f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}\n" for k in range(count)]


def by_place(loaded):
    """Material of each triangle of a `strip`, None where it is missing, in order of its place."""
    corner = loaded.mesh.vertices[loaded.mesh.faces].min(axis=1)[:, 0]
    place = np.rint(corner / 2).astype(int)
    result = [None] * (place.max() + 1)
    for where, index in zip(place.tolist(), loaded.mesh.material.tolist(), strict=True):
        assert result[where] is None
        result[where] = loaded.materials[index]
    return result


def check_materials(loaded):
    """What the materials of every loaded mesh promise."""
    assert loaded.mesh.material.dtype == np.int64
    assert loaded.mesh.material.shape == (len(loaded.mesh.faces),)
    # Each is used, and no two are equal but for the name.
    assert np.array_equal(np.unique(loaded.mesh.material), np.arange(len(loaded.materials)))
    assert len({(m.diffuse, m.specular, m.exponent) for m in loaded.materials}) == len(loaded.materials)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb", ".gltf", "teapot"])
def test_a_file_without_materials_has_one(tmp_path, suffix):
    path = "teapot"
    if suffix == ".gltf":
        document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2])
        path = str(tmp_path / "a.gltf")
        uri = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
        document["buffers"][0]["uri"] = uri
        Path(path).write_text(json.dumps(document))
    elif suffix != "teapot":
        path = save(tmp_path / f"a{suffix}", without_normals(trimesh.creation.box()))
    loaded = load_mesh(path, triangles=240)
    check_materials(loaded)
    assert (loaded.materials, loaded.ignored) == ((FileMaterial(),), ())


MTL = """
Kd 9 9 9
newmtl red
Ka 1 1 1
Kd 1 0 0
Ks .5 0.25 1e-1
Ns 96.078431
newmtl grey # the paint
    kd 0 0 0
\tKd\t0.5   # all channels
illum 2
newmtl none
newmtl red
Kd 0 0 1
newmtl matt
Ns 0
"""


def test_obj_materials(tmp_path):
    vertices, faces = strip(7)
    lines = ["red", "grey # the paint", "none", "red", "missing", "matt"]
    text = "mtllib my paint.mtl\n" + vertices + faces[0]
    text += "".join(f"usemtl {name}\n{face}" for name, face in zip(lines, faces[1:], strict=True))
    (tmp_path / "a.obj").write_text(text)
    (tmp_path / "my paint.mtl").write_text(MTL)
    loaded = load_mesh(str(tmp_path / "a.obj"))
    check_mesh(loaded.mesh)
    check_materials(loaded)
    red = FileMaterial("red", RED, (0.5, 0.25, 0.1), 96)
    grey = FileMaterial("grey # the paint", (0.5, 0.5, 0.5))
    # Faces of no material, of one that says nothing, and of one that is not there, are all alike.
    nothing = FileMaterial("none")
    matt = FileMaterial("matt", exponent=1)
    assert by_place(loaded) == [nothing, red, grey, nothing, red, nothing, matt]
    assert loaded.ignored == ("1 material name without a definition",)
    one = load_mesh(str(tmp_path / "a.obj"), materials=False)
    assert (one.materials, one.ignored) == ((FileMaterial("red"),), ())
    assert np.array_equal(np.sort(one.mesh.vertices, axis=0), np.sort(loaded.mesh.vertices, axis=0))


@pytest.mark.parametrize(
    ("statement", "files"),
    [
        ("mtllib a.mtl b.mtl", {"a.mtl": "newmtl a\nKd 1 0 0", "b.mtl": "newmtl b\nKd 0 1 0"}),
        (
            "mtllib a.mtl\nmtllib ./b.mtl\r",
            {"a.mtl": "newmtl a\r\nKd 1 0 0\r\n", "b.mtl": "newmtl b\nKd 0 1 0"},
        ),
        ("  mtllib\tsub/c d.mtl", {"sub/c d.mtl": "\ufeffnewmtl a\nKd 1 0 0\n  newmtl\tb \nKd 0 1 0"}),
    ],
)
def test_spellings_of_material_files(tmp_path, statement, files):
    (tmp_path / "sub").mkdir()
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    vertices, faces = strip(3)
    # o and g make no difference, nor does where they stand; a comment is no statement.
    text = f"o whole\n{statement}\n{vertices}g x\nusemtl a\no 7\n{faces[0]}# usemtl a\n\tusemtl \tb\r\n"
    (tmp_path / "a.obj").write_bytes((text + "g y\no 1\n" + faces[1] + "usemtl\n" + faces[2]).encode())
    loaded = load_mesh(str(tmp_path / "a.obj"))
    expected = [FileMaterial("a", RED), FileMaterial("b", GREEN), FileMaterial()]
    assert (by_place(loaded), loaded.ignored) == (expected, ())


def test_material_names_with_a_number_sign(tmp_path):
    # What looks like a comment is part of the name, if there is such a material, else a comment.
    vertices, faces = strip(3)
    (tmp_path / "a.mtl").write_text(
        "newmtl Material #1\nKd 1 0 0\nnewmtl Material #2\nKd 0 1 0\nnewmtl c\nKd 0 0 1"
    )
    names = ("Material #1", "Material #2", "c # the last")
    text = "".join(f"usemtl {name}\n{face}" for name, face in zip(names, faces, strict=True))
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{vertices}{text}")
    assert [m.diffuse for m in by_place(load_mesh(str(tmp_path / "a.obj")))] == [RED, GREEN, BLUE]


def test_missing_material_file_is_told(tmp_path):
    vertices, faces = strip(2)
    (tmp_path / "a.obj").write_text(f"mtllib no.mtl\n{vertices}usemtl a\n{faces[0]}usemtl b\n{faces[1]}")
    loaded = load_mesh(str(tmp_path / "a.obj"))
    assert loaded.materials == (FileMaterial("a"),)
    told = ("the material file 'no.mtl', which does not exist", "2 material names without a definition")
    assert loaded.ignored == told


def material_glb(path, materials, primitives, nodes=None, normals=None, **extra):
    """A strip of triangles, one a primitive, of the materials of these indices; None is for none."""
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2], normals, **extra)
    first = document["meshes"][0]["primitives"][0]
    document["meshes"] = []
    for index in primitives:
        primitive = first if index is None else {**first, "material": index}
        document["meshes"].append({"primitives": [primitive]})
    if materials is not None:
        document["materials"] = materials
    places = range(len(primitives))
    document["nodes"] = nodes or [{"mesh": k, "translation": [2 * k, 0, 0]} for k in places]
    document["scenes"][0]["nodes"] = list(range(len(document["nodes"])))
    path.write_bytes(glb(document, buffer))
    return str(path)


def base(*color, **other):
    return {"pbrMetallicRoughness": {"baseColorFactor": list(color)}, **other}


@pytest.mark.parametrize("normals", [None, [[0, 0, 1]] * 3])
def test_gltf_materials(tmp_path, normals):
    materials = [
        base(0, 0, 1, 0.5, name="blue"),
        base(9, 9, 9, 9, name="unused"),
        {"name": "white"},
        {"pbrMetallicRoughness": {"metallicFactor": 0.5}},
        base(0, 0, 1, 1, name="blue too"),
        base(1, 0.25, 0, 1),
    ]
    loaded = load_mesh(material_glb(tmp_path / "a.glb", materials, [5, None, 0, 2, 3, 4, 0], normals=normals))
    check_mesh(loaded.mesh)
    check_materials(loaded)
    blue, white = FileMaterial("blue", BLUE), FileMaterial("white", (1.0, 1.0, 1.0))
    assert by_place(loaded) == [
        FileMaterial("", (1.0, 0.25, 0.0)),
        FileMaterial(),
        blue,
        white,
        white,
        blue,
        blue,
    ]
    one = load_mesh(str(tmp_path / "a.glb"), materials=False)
    assert one.materials == (FileMaterial(),)
    assert np.array_equal(one.mesh.vertices, loaded.mesh.vertices)
    assert np.array_equal(one.mesh.normals, loaded.mesh.normals)


def test_gltf_primitives_of_one_mesh(tmp_path):
    """Points and lines among them, and the same mesh at a mirrored node: no part takes another's material."""
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2])
    shifted = np.add(TRIANGLE, [2, 0, 0])
    start = len(buffer)
    buffer += shifted.astype("<f4").tobytes()
    document["buffers"][0]["byteLength"] = len(buffer)
    document["bufferViews"].append({"buffer": 0, "byteOffset": start, "byteLength": 36})
    document["accessors"].append({"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3"})
    near, far = {"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 2}}
    document["meshes"][0]["primitives"] = [
        {**near, "mode": 0, "material": 0},
        {**near, "mode": 1, "material": 2},
        {**near, "mode": 3, "material": 2},
        {**far, "material": 1},
        {**near, "material": 0},
    ]
    document["materials"] = [base(1, 0, 0, 1), base(0, 1, 0, 1), base(0, 0, 1, 1)]
    mirrored = {"mesh": 0, "scale": [-1, 1, 1], "translation": [7, 0, 0]}
    document["nodes"] = [{"mesh": 0}, mirrored]
    document["scenes"][0]["nodes"] = [0, 1]
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    loaded = load_mesh(str(tmp_path / "a.glb"))
    check_materials(loaded)
    assert (face_normals(loaded.mesh) == [0, 0, 1]).all()
    assert [m.diffuse for m in by_place(loaded)] == [RED, GREEN, GREEN, RED]


@pytest.mark.parametrize("stored", [True, False])
@pytest.mark.parametrize("mirror", [False, True])
def test_material_of_a_face_survives_what_is_done_to_the_mesh(tmp_path, sphere, stored, mirror):
    """Octants in 8 materials: flat triangles dropped, creases cut, vertices welded, a node that mirrors.

    Each triangle's material is known from the place of its middle.
    """
    middle = sphere.vertices[sphere.faces].mean(axis=1)
    octant = (middle > 0) @ [1, 2, 4]
    rng = np.random.default_rng(4)
    blobs = [np.asarray(sphere.vertices, "<f4").tobytes()]
    accessors = [{"bufferView": 0, "componentType": 5126, "count": len(sphere.vertices), "type": "VEC3"}]
    primitives = []
    for index in range(8):
        own = sphere.faces[octant == index]
        # Every second one is between triangles without area.
        own = np.stack([own, own[:, [0, 0, 1]]], axis=1).reshape(-1, 3)
        blobs.append(own.astype("<u4").tobytes())
        view = {"bufferView": index + 1, "componentType": 5125, "count": own.size, "type": "SCALAR"}
        accessors.append(view)
        attributes = {"POSITION": 0, "NORMAL": 0} if stored and index % 2 else {"POSITION": 0}
        primitives.append({"attributes": attributes, "indices": index + 1, "material": 7 - index})
    colors = rng.random((8, 4)).tolist()
    node = {"mesh": 0, "scale": [-1, 2, 1]} if mirror else {"mesh": 0}
    document, buffer = gltf(primitives, blobs, accessors, [node], materials=[base(*c) for c in colors])
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    loaded = load_mesh(str(tmp_path / "a.glb"), crease_angle=5)
    check_mesh(loaded.mesh)
    check_materials(loaded)
    assert loaded.dropped_faces == len(loaded.mesh.faces) == len(sphere.faces)
    middle = loaded.mesh.vertices[loaded.mesh.faces].mean(axis=1) * [-1 if mirror else 1, 1, 1]
    expected = np.array(colors)[7 - (middle > 0) @ [1, 2, 4], :3]
    actual = np.array([m.diffuse for m in loaded.materials])[loaded.mesh.material]
    assert np.array_equal(actual, expected)


def test_material_of_dropped_faces_only_is_dropped(tmp_path):
    text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 1 2\nusemtl b\nf 1 2 3\nusemtl c\n"
    (tmp_path / "a.obj").write_text(text)
    (tmp_path / "a.mtl").write_text("newmtl a\nKd 9 9 9\nnewmtl b\nKd 0 1 0\nnewmtl c\nKd x\n")
    loaded = load_mesh(str(tmp_path / "a.obj"))
    assert (loaded.materials, loaded.dropped_faces) == ((FileMaterial("b", GREEN),), 1)


def test_textures_and_vertex_colours_are_told(tmp_path):
    vertices, faces = strip(1)
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd a.png\nmap_bump -bm 1 b.png\nnewmtl b\nmap_Kd c.png\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{vertices}usemtl a\n{faces[0]}")
    assert load_mesh(str(tmp_path / "a.obj")).ignored == ("2 textures",)
    (tmp_path / "a.obj").write_text("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n")
    assert load_mesh(str(tmp_path / "a.obj")).ignored == ("vertex colours",)
    textured = base(1, 0, 0, 1, normalTexture={"index": 0})
    textured["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    path = material_glb(tmp_path / "a.glb", [textured, textured], [0])
    assert load_mesh(path).ignored == ("2 textures",)
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2], TRIANGLE)
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    attributes["COLOR_0"] = attributes.pop("NORMAL")
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    assert load_mesh(str(tmp_path / "a.glb")).ignored == ("vertex colours",)
    box = trimesh.creation.box()
    box.visual.vertex_colors = np.full((8, 4), 255, np.uint8)
    assert load_mesh(save(tmp_path / "a.ply", box)).ignored == ("vertex colours",)


@pytest.mark.parametrize("suffix", [".obj", ".glb"])
def test_most_materials(tmp_path, suffix):
    """`MAX_MATERIALS` load, one more is refused; equal ones count as one, and unused ones not at all."""
    count = MAX_MATERIALS + 1
    vertices, faces = strip(count)

    def saved(used, distinct):
        colors = [(k % distinct / 2000, 0.0, 0.5) for k in range(count)]
        if suffix == ".glb":
            materials = [base(*color, 1) for color in colors]
            return material_glb(tmp_path / "a.glb", materials, range(used))
        (tmp_path / "a.mtl").write_text(
            "".join(f"newmtl {k}\nKd {r!r} {g} {b}\n" for k, (r, g, b) in enumerate(colors))
        )
        text = "".join(f"usemtl {k}\n{faces[k]}" for k in range(used))
        (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{vertices}{text}")
        return str(tmp_path / "a.obj")

    for used, distinct in ((MAX_MATERIALS, count), (count, MAX_MATERIALS)):
        loaded = load_mesh(saved(used, distinct))
        check_materials(loaded)
        assert len(loaded.materials) == MAX_MATERIALS
        given = [material.diffuse[0] for material in by_place(loaded)]
        assert given == [k % distinct / 2000 for k in range(used)]
    path = saved(count, count)
    check_refused(path, f"it has {count} materials; the limit is {MAX_MATERIALS}", "with one material")
    assert load_mesh(path, materials=False).materials == (FileMaterial("0" if suffix == ".obj" else ""),)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("Kd nan 0 0", "material 'a' has Kd 'nan 0 0', not three numbers from 0 to 1"),
        ("Kd 0 inf 0", "material 'a' has Kd"),
        ("Kd 0 0 1.001", "material 'a' has Kd"),
        ("Kd 0 0 -1e-9", "material 'a' has Kd"),
        ("Kd", "material 'a' has Kd ''"),
        ("Kd 0 0", "material 'a' has Kd"),
        ("Kd 0 0 0 0", "material 'a' has Kd"),
        ("Kd spectral red.rfl 1", "material 'a' has Kd 'spectral red.rfl 1'"),
        ("Ks 0 0 \x00\x1b[2J", "material 'a' has Ks '0 0 ??[2J'"),
        (f"Kd {'9' * 5000}", "..."),
        ("Ns 1000.1", "material 'a' has Ns '1000.1', not a number from 0 to 1000"),
        ("Ns -1", "material 'a' has Ns"),
        ("Ns nan", "material 'a' has Ns"),
        ("Ns 1 2", "material 'a' has Ns"),
        ("Ns", "material 'a' has Ns"),
    ],
)
def test_bad_material_file(tmp_path, line, reason):
    vertices, faces = strip(1)
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{vertices}usemtl a\n{faces[0]}")
    (tmp_path / "a.mtl").write_text(f"newmtl a\n{line}\n")
    text = check_refused(tmp_path / "a.obj", reason, "shade the mesh with one material")
    assert text.isprintable()
    assert len(text) < 400
    assert load_mesh(str(tmp_path / "a.obj"), materials=False).ignored == ()


@pytest.mark.parametrize(
    "name",
    [
        "../secret.mtl",
        "sub/../../secret.mtl",
        "sub/../secret.mtl",
        "/etc/hostname",
        "C:\\a.mtl",
        "\\\\host\\a.mtl",
        "file:a.mtl",
        "link.mtl",
        "a.mtl ../secret.mtl",
    ],
)
def test_material_files_outside_the_folder(tmp_path, name):
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    for place in (tmp_path, folder):
        (place / "secret.mtl").write_text("newmtl a\nKd 1 0 0\n")
    (folder / "link.mtl").symlink_to(tmp_path / "secret.mtl")
    vertices, faces = strip(1)
    (folder / "a.obj").write_text(f"mtllib {name}\n{vertices}usemtl a\n{faces[0]}")
    check_refused(folder / "a.obj", "outside its folder", "put that file beside it")


def test_odd_material_files(tmp_path, monkeypatch):
    vertices, faces = strip(1)
    path = tmp_path / "a.obj"

    def loaded(name):
        path.write_text(f"mtllib {name}\n{vertices}usemtl a\n{faces[0]}")
        return load_mesh(str(path))

    # The mesh itself, a folder, no name, a name that no file can have.
    assert loaded("a.obj").ignored == ("1 material name without a definition",)
    (tmp_path / "b.mtl").mkdir()
    assert "the material file 'b.mtl', which does not exist" in loaded("b.mtl").ignored
    assert loaded("").materials == (FileMaterial("a"),)
    os.mkfifo(tmp_path / "pipe.mtl")
    assert "the material file 'pipe.mtl', which does not exist" in loaded("pipe.mtl").ignored
    (tmp_path / "loop.mtl").symlink_to("loop.mtl")
    assert "the material file 'loop.mtl', which does not exist" in loaded("loop.mtl").ignored
    assert loaded("x" * 5000 + ".mtl").ignored[0].endswith("x...', which does not exist")
    (tmp_path / "c.mtl").write_bytes(b"newmtl a\nKd 1 0 0\n# f\xfcr\n")
    assert loaded("c.mtl").materials == (FileMaterial("a", RED),)
    monkeypatch.setattr(blysk.sim.meshes.obj, "_MAX_LIBRARY", 10)
    path.write_text(f"mtllib c.mtl\n{vertices}usemtl a\n{faces[0]}")
    check_refused(path, "its material file 'c.mtl' is over 10 bytes")


@pytest.mark.parametrize(
    ("materials", "index", "reason"),
    [
        ([base(1, 0, 0, 1)], 1, "a mesh refers to material 1 (from 0), there are 1"),
        (None, 0, "a mesh refers to material 0 (from 0), there are 0"),
        ([base(1, 0, 0, 1)], -1, "a mesh refers to material -1"),
        ([base(1, 0, 0, 1)], 10**30, "a mesh refers to material 1000000000"),
        ([base(1, 0, 0, 1)], "0", "a mesh refers to material 0"),
        ([base(1, 0, 0, 1)], True, "a mesh refers to material True"),
        ([base(1, 0, 0, 1)], [0], "a mesh refers to material [0]"),
        ([base(float("nan"), 0, 0, 1, name="x")], 0, "material 'x' has baseColorFactor '[nan, 0, 0, 1]'"),
        ([base(0, float("inf"), 0, 1)], 0, "material 'number 0' has baseColorFactor"),
        ([base(0, 0, 1.5, 1)], 0, "not three numbers from 0 to 1"),
        ([base(0, 0, -0.5, 1)], 0, "not three numbers from 0 to 1"),
        ([base(0, 0, 10**400, 1)], 0, "not three numbers from 0 to 1"),
        ([base(0, 0, 1)], 0, "has baseColorFactor '[0, 0, 1]'"),
        ([base(0, 0, True, 1)], 0, "not three numbers from 0 to 1"),
        ([base(0, 0, "1", 1)], 0, "not three numbers from 0 to 1"),
        ([{"pbrMetallicRoughness": {"baseColorFactor": {"r": 1}}}], 0, "not three numbers from 0 to 1"),
        ([{"pbrMetallicRoughness": [1]}], 0, "not three numbers from 0 to 1"),
        ([7], 0, "its materials are no list of objects"),
        ({"0": base(1, 0, 0, 1)}, 0, "its materials are no list of objects"),
        ("red", 0, "its materials are no list of objects"),
    ],
)
def test_bad_gltf_materials(tmp_path, materials, index, reason):
    path = material_glb(tmp_path / "a.glb", materials, [index])
    text = check_refused(path, reason, "shade the mesh with one material")
    assert text.isprintable()
    assert len(text) < 400
    assert load_mesh(path, materials=False).materials == (FileMaterial(),)


@pytest.mark.parametrize(
    ("children", "reason"),
    [
        ([[0]], "in a circle"),
        ([[1], [0]], "in a circle"),
        ([[], [2], [1]], "in a circle"),
        ([[1], [2], [1]], "hangs on two others"),
        ([[1, 2], [2], []], "hangs on two others"),
        ([[1, 1], []], "hangs on two others"),
        ([[k + 1] for k in range(9999)] + [[0]], "in a circle"),
        ([[1]], "refers to node 1 (from 0), there are 1"),
        ([[-1]], "refers to node -1 (from 0)"),
        ([["0"]], "refers to node 0 (from 0)"),
        ([[True], []], "refers to node True (from 0)"),
        ([0], "a part is missing"),
        ([[1], []], "is twice in a scene"),
    ],
    ids=lambda value: str(value)[:30],
)
def test_gltf_nodes_that_are_no_trees(tmp_path, children, reason):
    nodes = [{"mesh": 0, "children": below} for below in children]
    path = material_glb(tmp_path / "a.glb", [base(1, 0, 0, 1)], [0], nodes)
    check_refused(path, reason)


def test_gltf_nodes_of_many_levels(tmp_path):
    """In a moment, and each in its place."""
    nodes = [{"mesh": 0, "translation": [1, 0, 0], "children": [k + 1]} for k in range(999)]
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2], None, [*nodes, {"mesh": 0}])
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    mesh = load_mesh(str(tmp_path / "a.glb")).mesh
    assert len(mesh.faces) == 1000
    assert np.array_equal(np.unique(mesh.vertices[:, 0]), np.arange(1.0, 1001))


def test_gltf_meshes_that_hang_on_a_camera(tmp_path):
    nodes = [
        {"translation": [5, 0, 0], "camera": 0, "mesh": 0, "children": [1]},
        {"mesh": 0, "scale": [2, 2, 2]},
    ]
    camera = {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}
    document, buffer = mesh_gltf(TRIANGLE, [0, 1, 2], None, nodes, cameras=[camera])
    (tmp_path / "a.glb").write_bytes(glb(document, buffer))
    mesh = load_mesh(str(tmp_path / "a.glb")).mesh
    assert sorted(mesh.vertices[:, 0]) == [5, 5, 5, 5, 6, 7]


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_obj_however_it_is_written(tmp_path, data):
    """Triangles side by side, in any spacing, order and numbering, with lines between that are none."""
    space, end = (
        data.draw(st.sampled_from([" ", "  ", "\t", " \t "])),
        data.draw(st.sampled_from(["\n", "\r\n"])),
    )
    tail = st.sampled_from(["", " ", "\t", " # note", "#"])
    other = st.sampled_from(
        ["", "# f 1 2 3", "o a", "g a b", "s off", "s 1", "usemtl m", "vt 0 0", "mtllib a.mtl"]
    )
    number = st.sampled_from(["{:g}", "{:.3f}", "{:+e}", "{:.0f}."])
    form = data.draw(st.sampled_from(["{}", "{}/1", "{}/1/1", "{}//1"]))
    places, relative = [], data.draw(st.booleans())
    lines = ["vt 0 0", "vn 0 0 1"]
    for triangle in range(data.draw(st.integers(1, 5))):
        places.append([(2 * triangle + x, y, 0) for x, y in ((0, 0), (1, 0), (0, 1))])
        lines += [space.join(["v", *(data.draw(number).format(part) for part in p)]) for p in places[-1]]
    count = 3 * len(places)
    faces = [
        [3 * k + corner - relative * count + (not relative) for corner in range(3)]
        for k in range(len(places))
    ]
    for face in data.draw(st.permutations(faces)):
        lines += [space.join(["f", *(form.format(corner) for corner in face)])]
    text = "".join(
        f"{data.draw(st.sampled_from(['', ' ']))}{line}{data.draw(tail)}{end}{data.draw(other)}{end}"
        for line in lines
    )
    (tmp_path / "a.obj").write_text(text, newline="")
    loaded = load_mesh(str(tmp_path / "a.obj"))
    found = loaded.mesh.vertices[loaded.mesh.faces].round(9).tolist()
    assert sorted(sorted(map(tuple, triangle)) for triangle in found) == [sorted(place) for place in places]
    assert (loaded.dropped_faces, loaded.repaired_normals) == (0, 0)


_WORDS = st.sampled_from(["Kd", "Ks", "Ns", "newmtl", "a", "0.5", "1", "-1", "nan", "1e9", "map_Kd", "#"])


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(lines=st.lists(st.lists(_WORDS | st.text(max_size=5), max_size=5).map(" ".join), max_size=6))
def test_any_material_file(tmp_path, lines):
    """It gives a material in its ranges, or is refused in one line."""
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
    text = "\n".join(["newmtl a", *lines])
    (tmp_path / "a.mtl").write_text(text, encoding="utf-8", errors="surrogatepass")
    loaded, refusal = loaded_or_refused(tmp_path / "a.obj")
    if loaded is None:
        assert refusal.isprintable()
        assert re.search("has K[ds] .* not three numbers from 0 to 1|has Ns .* not a number from 0", refusal)
    else:
        check_mesh(loaded.mesh)
        check_materials(loaded)
        assert all(text.isprintable() for text in loaded.ignored)


@pytest.mark.parametrize("kind", [".mtl", ".glb", ".obj"])
def test_damaged_materials(tmp_path, kind):
    """Random bytes of the materials changed: a whole mesh, or a refusal in one line."""
    rng = np.random.default_rng(20261122)
    vertices, faces = strip(3)
    files = {
        ".obj": (
            f"mtllib a.mtl\n{vertices}" + "".join(f"usemtl {n}\n{faces[k]}" for k, n in enumerate("abc"))
        ),
        ".mtl": "newmtl a\nKd 1 0 0\nnewmtl b\nKs 0 1 0\nNs 20\nnewmtl c\nKd 0 0 1\nmap_Kd a.png\n",
    }
    for suffix, text in files.items():
        (tmp_path / f"a{suffix}").write_text(text)
    materials = [base(1, 0, 0, 1, name="a"), base(0, 0.5, 0, 1), {"name": "c"}]
    material_glb(tmp_path / "a.glb", materials, [0, 1, 2, None])
    path = tmp_path / f"a{kind}"
    data, main = path.read_bytes(), str(tmp_path / ("a.glb" if kind == ".glb" else "a.obj"))
    begin, end = 0, len(data)
    if kind == ".glb":
        begin, end = data.index(b'"materials"'), len(data.rstrip(b"\0")) - 60
    outcomes = {True: 0, False: 0}
    for _ in range(200):
        damaged = bytearray(data)
        for at in rng.integers(begin, end, rng.integers(1, 4)):
            damaged[at] = rng.choice([rng.integers(0, 256), rng.choice(list(b"0123456789.-+e[]{}# "))])
        path.write_bytes(bytes(damaged))
        loaded, refusal = loaded_or_refused(main)
        outcomes[loaded is None] += 1
        if loaded:
            check_mesh(loaded.mesh)
            check_materials(loaded)
        else:
            assert "\n" not in refusal
    assert min(outcomes.values()) > 5


def test_surfaces():
    default = Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 50)
    said = FileMaterial("a", (0.5, 0.0, 1.0), (0.0, 0.0, 0.0), 7)
    black = FileMaterial("b", (0.0, 0.0, 0.0))
    nothing = FileMaterial("c", exponent=3)
    given = surfaces([said, black, nothing], default)
    assert given == (
        Material((0.05, 0, 0.1), (0.5, 0, 1), (0, 0, 0), 7),
        Material((0, 0, 0), (0, 0, 0), (0.6, 0.6, 0.6), 50),
        Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 3),
    )
    everything = {"ambient", "diffuse", "specular", "exponent"}
    assert surfaces([said, black, nothing], default, everything) == (default,) * 3
    assert surfaces([said], default, {"diffuse", "exponent"}) == (
        Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0, 0, 0), 50),
    )
    assert surfaces([said], default, {"ambient"}) == (
        Material((0.08, 0.05, 0.03), (0.5, 0, 1), (0, 0, 0), 7),
    )
    assert surfaces([FileMaterial()], default) == (default,)


def test_a_scene_of_a_file(tmp_path):
    """From a file to the constants of the pipeline: the surfaces fit the mesh."""
    path = material_glb(tmp_path / "a.glb", [base(1, 0, 0, 1), base(0, 0, 1, 1)], [1, None, 0])
    loaded = load_mesh(path)
    default = Material((0, 0, 0), (0.5, 0.5, 0.5), (0, 0, 0), 1)
    camera = Camera.framing(loaded.mesh.vertices, (0, 0, 1), "orthographic", 3)
    light = Light((0, 0, 1))
    scene = Scene(loaded.mesh, camera, 90, 30, surfaces(loaded.materials, default), (light,))
    image = render(scene).image
    colors = np.unique(image[image.any(axis=-1)].round(9), axis=0)
    assert colors.tolist() == [[0.0, 0.0, 1.0], [0.5, 0.5, 0.5], [1.0, 0.0, 0.0]]
    # Left to right in the picture as in the strip.
    shown = [
        image[:, part].reshape(-1, 3).max(axis=0).round(9).tolist() for part in np.split(np.arange(90), 3)
    ]
    assert shown == [[0.0, 0.0, 1.0], [0.5, 0.5, 0.5], [1.0, 0.0, 0.0]]
