"""Readers of each format: spellings that are read, files that are refused, references, and damage."""

import io
import struct

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from blysk.sim.installation import install_extra
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.meshes.mesh_path import SUFFIXES

from .files import (
    CORNERS,
    TRIANGLE,
    base,
    check,
    check_refused,
    draco_gltf,
    load,
    loaded_or_refused,
    material_gltf,
    mesh_gltf,
    put,
)

# OBJ


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
    mesh = load(tmp_path / "a.obj", head + text).mesh
    assert len(mesh.faces) == 5
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == 1 + 1.5


def test_objects_and_materials_weld_to_one(tmp_path):
    # Two halves of a flat sheet have two materials, and there is no seam in the normals.
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n"
    assert len(load(tmp_path / "a.obj", text).mesh.vertices) == 4


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3", "all its vertices are at one point"),
        ("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3", "none of its faces has an area"),
        (CORNERS + "v 9 9 9", "it has no faces"),
        ("v 0 0 0\nv 1 0 0\nl 1 2", "it has no faces"),
        (CORNERS + "f 1 2 4", "refers to vertex 3, counted from 0, but the number of vertices is 3"),
        (CORNERS + "f 0 1 2", "vertex index 0"),
        (CORNERS + "f 1 2 3\nf 1 2", "fewer than 3 corners"),
        (CORNERS + "f 1 2 -9", "has the index -9, with 3 v before it"),
        (CORNERS + "vn 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//3", "has the normal 3, but there are 2 normals"),
        (CORNERS + "f 1/1/1 2/1/1 3/1/1", "has the normal 1, but there are 0 normals"),
        (CORNERS + "vn 0 1 0\nf 1//1 2//0 3//1", "has the normal 0, but there are 1 normals"),
        (CORNERS + "f 1 2 3\nf 1 x 3", "not indices"),
        ("v 0 0\nv 1 0\nv 0 1\nf 1 2 3", "not 3 numbers"),
    ],
)
def test_bad_obj(tmp_path, text, reason):
    check_refused(tmp_path / "a.obj", reason, content=text)


def test_relative_indices_count_from_their_face(tmp_path):
    text = (
        CORNERS
        + "vn 0 0 1\nf -3//-1 -2//-1 -1//-1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nvn 0 1 0\nf -3//-1 -2//-1 3//-2\n"
    )
    mesh = load(tmp_path / "a.obj", text).mesh
    third = mesh.vertices[mesh.faces[0][2]]
    assert sorted(mesh.vertices[mesh.faces[1]].tolist()) == sorted([[5, 0, 0], [6, 0, 0], third.tolist()])


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_obj_however_it_is_written(tmp_path, data):
    """Triangles side by side, in any spacing, order and numbering, with other lines between them."""
    space = data.draw(st.sampled_from([" ", "  ", "\t", " \t "]))
    end = data.draw(st.sampled_from(["\n", "\r\n"]))
    tail = st.sampled_from(["", " ", "\t", " # note", "#"])
    other = ["", "# f 1 2 3", "o a", "g a b", "s off", "s 1", "usemtl m", "vt 0 0", "mtllib a.mtl"]
    number = st.sampled_from(["{:g}", "{:.3f}", "{:+e}", "{:.0f}."])
    form = data.draw(st.sampled_from(["{}", "{}/1", "{}/1/1", "{}//1"]))
    points, relative = [], data.draw(st.booleans())
    lines = ["vt 0 0", "vn 0 0 1"]
    for triangle in range(data.draw(st.integers(1, 5))):
        points.append([(2 * triangle + x, y, 0) for x, y in ((0, 0), (1, 0), (0, 1))])
        lines += [space.join(["v", *(data.draw(number).format(part) for part in p)]) for p in points[-1]]
    first = -3 * len(points) if relative else 1
    faces = [[3 * k + corner + first for corner in range(3)] for k in range(len(points))]
    for face in data.draw(st.permutations(faces)):
        lines += [space.join(["f", *(form.format(corner) for corner in face)])]
    text = "".join(
        f"{data.draw(st.sampled_from(['', ' ']))}{line}{data.draw(tail)}{end}"
        f"{data.draw(st.sampled_from(other))}{end}"
        for line in lines
    )
    loaded = load(tmp_path / "a.obj", text)
    found = loaded.mesh.vertices[loaded.mesh.faces].round(9).tolist()
    assert sorted(sorted(map(tuple, triangle)) for triangle in found) == [sorted(three) for three in points]
    assert (loaded.dropped_faces, loaded.repaired_normals) == (0, 0)


# PLY and STL


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl"])
def test_names_in_another_encoding(tmp_path, suffix):
    box = trimesh.creation.box()
    data = {
        ".obj": lambda: "o Größe\n# für\n".encode("latin-1") + box.export(file_type="obj").encode(),
        ".ply": lambda: box.export(file_type="ply").replace(b"1.0\n", b"1.0\ncomment f\xfcr\n", 1),
        ".stl": lambda: box.export(file_type="stl_ascii").encode().replace(b"solid", b"solid f\xfcr", 1),
    }[suffix]()
    assert len(load(tmp_path / f"a{suffix}", data).mesh.faces) == 12


def test_binary_stl_that_begins_like_a_text(tmp_path):
    data = b"solid".ljust(80, b" ") + trimesh.creation.box().export(file_type="stl")[80:]
    assert len(load(tmp_path / "a.stl", data).mesh.faces) == 12
    check_refused(tmp_path / "a.stl", "the header says 12 triangles", content=data[:-50])


@pytest.mark.parametrize("word", ["", "element", "property", "element vertex", "property float"])
def test_much_space_in_a_ply_header(tmp_path, word):
    """The time grows with the length, and not with its square, with which this test would take minutes."""
    for space in ("\n", " ", "\t"):
        text = f"ply\nformat ascii 1.0\n{word}{300_000 * space}x\nend_header\n"
        check_refused(tmp_path / "a.ply", content=text)


def test_ply_negative_index(tmp_path):
    ply = trimesh.Trimesh(TRIANGLE, [[0, 1, 2]], process=False).export(file_type="ply", encoding="ascii")
    text = ply.replace(b"3 0 1 2", b"3 0 1 -1")
    check_refused(tmp_path / "a.ply", "a face refers to vertex -1", content=text)


# GLB and glTF


@pytest.mark.parametrize("index", [3, 2**31, 2**32 - 1])
def test_gltf_index_out_of_range(tmp_path, index):
    reason = f"a face refers to vertex {index}, counted from 0, but the number of vertices is 3"
    check_refused(tmp_path / "a.glb", reason, content=mesh_gltf(faces=[0, 1, index]))


def test_gltf_mesh_without_data(tmp_path):
    document, buffer = mesh_gltf()
    del document["accessors"][0]["bufferView"]
    check_refused(tmp_path / "a.glb", "a mesh has no data", content=(document, buffer))


def test_draco_without_its_decoder(tmp_path, uninstalled):
    uninstalled("DracoPy")
    reason = f"the decoder DracoPy is not installed; {install_extra('draco')}"
    check_refused(tmp_path / "a.glb", reason, content=draco_gltf())


def test_corrupt_gltf_does_not_load_its_neighbour(tmp_path):
    # The fact is: trimesh falls back to a file called model.gltf in the same folder.
    for name, data in trimesh.Scene(trimesh.creation.box()).export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    path = tmp_path / "mine.gltf"
    check_refused(path, "its JSON is damaged", content="{ not json")
    assert len(trimesh.load_scene(str(path)).geometry) == 1


@pytest.mark.parametrize(
    ("children", "reason"),
    [
        ([[0]], "form a circle"),
        ([[1], [0]], "form a circle"),
        ([[], [2], [1]], "form a circle"),
        ([[1], [2], [1]], "has two parents"),
        ([[1, 2], [2], []], "has two parents"),
        ([[1, 1], []], "has two parents"),
        ([[k + 1] for k in range(9999)] + [[0]], "form a circle"),
        ([[1]], "refers to node 1, counted from 0, but the number of nodes is 1"),
        ([[-1]], "refers to node -1, counted from 0"),
        ([["0"]], "refers to node 0, counted from 0"),
        ([[True], []], "refers to node True, counted from 0"),
        ([0], "a part is missing"),
        ([[1], []], "is twice in a scene"),
    ],
    ids=lambda value: str(value)[:30],
)
def test_gltf_nodes_that_are_no_trees(tmp_path, children, reason):
    nodes = [{"mesh": 0, "children": below} for below in children]
    check_refused(tmp_path / "a.glb", reason, content=material_gltf([base(1, 0, 0, 1)], [0], nodes))


# References


@pytest.mark.parametrize(
    "uri",
    [
        *("../secret.bin", "%2e%2e/secret.bin", "sub/../../secret.bin", "sub/../secret.bin", "link.bin"),
        *("/etc/hostname", "file:///etc/hostname", "https://example.org/a.bin", "C:\\a.bin"),
        "\\\\host\\a.bin",
    ],
)
def test_references_outside_the_folder(tmp_path, uri):
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    document, buffer = mesh_gltf(uri=uri)
    # trimesh would take a file of the same name in the folder instead.
    for place in (tmp_path, folder):
        (place / "secret.bin").write_bytes(buffer)
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    check_refused(folder / "a.gltf", "outside its folder", content=(document, buffer))


@pytest.mark.parametrize("name", ["no.bin", "x" * 300, "loop", "loop/a"])
def test_references_that_are_no_files(tmp_path, name):
    (tmp_path / "loop").symlink_to("loop")
    reason = f"it refers to {name!r}, which does not exist; put that file beside it"
    check_refused(tmp_path / "a.gltf", reason, content=mesh_gltf(uri=name))


@pytest.mark.parametrize("kind", ["outside", "inside", "one material", "gltf"])
def test_reads_the_file_and_checked_references_only(tmp_path, monkeypatch, kind):
    # No material file outside the folder is read, and none at all if materials are not wanted.
    library = "../../secret.mtl" if kind == "outside" else "a.mtl"
    path, other = tmp_path / "a.obj", tmp_path / "a.mtl"
    put(path, f"mtllib {library}\n{CORNERS}vt 0 0\nusemtl a\nf 1/1 2/1 3/1\n")
    put(other, "newmtl a\nKd 1 0 0\nmap_Kd a.png\n")
    if kind == "gltf":
        path, other = tmp_path / "a.gltf", tmp_path / "a.bin"
        document, buffer = mesh_gltf(
            uri="a.bin",
            images=[{"uri": "a.png"}, {"uri": "../secret.png"}],
            textures=[{"source": 0}, {"source": 1}],
            materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}],
        )
        document["meshes"][0]["primitives"][0]["material"] = 0
        put(path, (document, buffer))
        other.write_bytes(buffer)
    Image.new("L", (1, 1)).save(tmp_path / "a.png")
    opened = []
    original = io.open

    def watching(file, *args, **kwargs):
        opened.append(str(file))
        return original(file, *args, **kwargs)

    monkeypatch.setattr("builtins.open", watching)
    monkeypatch.setattr("io.open", watching)
    load_mesh(str(path), materials=kind != "one material")
    read = {"inside": [str(other), str(tmp_path / "a.png")], "gltf": [str(other)]}
    assert opened == [str(path), *read.get(kind, [])]


# Damage


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_empty_and_nonsense(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    check_refused(path, "the file is empty", content=b"")
    for nonsense in (b"\0", b"hello\n", b"\xff\xfe" * 50, bytes(range(256)) * 4, b"{}", b"[]", b"null"):
        check_refused(path, content=nonsense)


@pytest.mark.parametrize(
    ("suffix", "reason"),
    [
        (".ply", "cut short"),
        (".stl", "the header says 12 triangles"),
        (".glb", "cut short"),
        ("ascii.ply", "cut short"),
    ],
)
def test_cut_short(tmp_path, suffix, reason):
    """A file is cut at every seventh byte, a text after every line."""
    box, path = trimesh.creation.box(), tmp_path / f"a.{suffix.split('.')[1]}"
    if suffix == "ascii.ply":
        lines = box.export(file_type="ply", encoding="ascii").splitlines(keepends=True)
        pieces = [b"".join(lines[:count]) for count in range(1, len(lines))]
    else:
        whole = box.export(file_type=suffix[1:])
        pieces = [whole[:length] for length in range(1, len(whole), 7)]
    for piece in pieces:
        check_refused(path, content=piece)
    check_refused(path, reason)
    text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    check_refused(tmp_path / "text.stl", "cut short", content=text)


@pytest.mark.parametrize("count", [10**6, 2**31, 2**32 - 1, 10**18, 10**30])
def test_absurd_counts(tmp_path, count):
    # No memory may be allocated for these numbers, and nothing may wait for them.
    ply, stl = (trimesh.creation.box().export(file_type=kind) for kind in ("ply", "stl"))
    for old, new in ((b"element vertex 8", b"element vertex %d"), (b"element face 12", b"element face %d")):
        check_refused(tmp_path / "a.ply", content=ply.replace(old, new % count))
    if count < 2**32:
        content = stl[:80] + struct.pack("<I", count) + stl[84:]
        check_refused(tmp_path / "a.stl", f"the header says {count} triangles", content=content)
    document, buffer = mesh_gltf()
    document["accessors"][0]["count"] = count
    check_refused(tmp_path / "a.glb", content=(document, buffer))
    del document["accessors"][0]["bufferView"]
    check_refused(tmp_path / "a.glb", content=(document, buffer))


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb", "ascii.ply"])
def test_damaged_bytes(tmp_path, suffix):
    """A file with changed random bytes is loaded whole, or refused in one line. Nothing else is printed."""
    options = {"encoding": "ascii"} if suffix == "ascii.ply" else {}
    path = tmp_path / f"a.{suffix.split('.')[1]}"
    data = trimesh.creation.icosphere(subdivisions=1).export(file_type=path.suffix[1:], **options)
    data = data.encode() if isinstance(data, str) else data
    random = np.random.default_rng(20261121)
    refused = 0
    for _ in range(150):
        damaged = bytearray(data)
        for at in random.integers(0, len(data), random.integers(1, 6)):
            damaged[at] = random.integers(0, 256)
        path.write_bytes(bytes(damaged))
        loaded, refusal = loaded_or_refused(path)
        refused += refusal is not None
        if loaded:
            check(loaded)
    assert refused > 0
