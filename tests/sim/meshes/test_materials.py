"""Materials of mesh files: values that are read, told or refused, and the surfaces that follow."""

import os
import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import blysk.sim.meshes.mtl
from blysk.golden.frame_constants import MAX_MATERIALS
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.materials import FileMaterial, surfaces
from blysk.sim.meshes.mesh import load_mesh

from .files import (
    BLUE,
    CORNERS,
    GREEN,
    RED,
    TRIANGLE,
    base,
    by_position,
    check,
    check_refused,
    face_normals,
    gltf,
    indices,
    load,
    loaded_or_refused,
    material_gltf,
    material_obj,
    mesh_gltf,
    put,
    strip,
    vectors,
)

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
newmtl none

newmtl matt
Ns 0
"""


def test_obj_materials(tmp_path):
    names = ["red", "grey # the paint", "none", "red", "missing", "matt"]
    vertices, faces = strip(7)
    text = "mtllib my paint.mtl\n" + vertices + faces[0]
    text += "".join(f"usemtl {name}\n{face}" for name, face in zip(names, faces[1:], strict=True))
    put(tmp_path / "my paint.mtl", MTL)
    loaded = check(load(tmp_path / "a.obj", text))
    red = FileMaterial("red", RED, (0.5, 0.25, 0.1), 96)
    grey = FileMaterial("grey # the paint", (0.5, 0.5, 0.5))
    # Faces without a material, with an empty material, and with a missing material are all alike.
    nothing, matt = FileMaterial("none"), FileMaterial("matt", exponent=1)
    assert by_position(loaded) == [nothing, red, grey, nothing, red, nothing, matt]
    told = (
        "1 second definition of a material",
        "1 material name without a definition",
        "of materials: ambient colour (Ka), kd",
    )
    assert loaded.ignored == told
    one = load_mesh(str(tmp_path / "a.obj"), materials=False)
    assert (one.materials, one.ignored) == ((FileMaterial(),), ())
    assert np.array_equal(np.sort(one.mesh.vertices, axis=0), np.sort(loaded.mesh.vertices, axis=0))


@pytest.mark.parametrize(
    ("statement", "files"),
    [
        ("mtllib a.mtl b.mtl", {"a.mtl": "newmtl a\nKd 1 0 0", "b.mtl": "newmtl b\nKd 0 1 0"}),
        (
            "mtllib a.mtl\nmtllib ./b.mtl\r",
            {"a.mtl": "newmtl a\r\nKd 1 0 0\r", "b.mtl": "newmtl b\nKd 0 1 0"},
        ),
        (
            "mtllib .\\sub\\a.mtl\nmtllib b.mtl",
            {"sub/a.mtl": "newmtl a\nKd 1 0 0", "b.mtl": "newmtl b\nKd 0 1 0"},
        ),
        ("mtllib a.mtl # of a\nmtllib b.mtl", {"a.mtl": "newmtl a\nKd 1 0 0", "b.mtl": "newmtl b\nKd 0 1 0"}),
        ("  mtllib\tsub/c d.mtl", {"sub/c d.mtl": "\ufeffnewmtl a\nKd 1 0 0\n  newmtl\tb \nKd 0 1 0"}),
    ],
)
def test_spellings_of_material_files(tmp_path, statement, files):
    (tmp_path / "sub").mkdir()
    for name, text in files.items():
        put(tmp_path / name, text)
    vertices, faces = strip(3)
    # o and g make no difference, wherever they stand. A comment is no statement.
    text = f"o whole\n{statement}\n{vertices}g x\nusemtl a\no 7\n{faces[0]}# usemtl a\n\tusemtl \tb\r\n"
    loaded = load(tmp_path / "a.obj", f"{text}g y\no 1\n{faces[1]}usemtl\n{faces[2]}")
    expected = [FileMaterial("a", RED), FileMaterial("b", GREEN), FileMaterial()]
    assert (by_position(loaded), loaded.ignored) == (expected, ())


def test_material_names_with_a_number_sign(tmp_path):
    # If a material has a name that looks like a comment, the text is part of the name. Otherwise it is a
    # comment.
    put(tmp_path / "a.mtl", "newmtl Material #1\nKd 1 0 0\nnewmtl Material #2\nKd 0 1 0\nnewmtl c\nKd 0 0 1")
    loaded = load(tmp_path / "a.obj", material_obj(["Material #1", "Material #2", "c # the last"]))
    assert [material.diffuse for material in by_position(loaded)] == [RED, GREEN, BLUE]


def test_missing_material_files_are_told(tmp_path):
    loaded = load(tmp_path / "a.obj", material_obj(["a", "b"], "no.mtl"))
    assert loaded.materials == (FileMaterial("a"),)
    told = ("the material file 'no.mtl', which does not exist", "2 material names without a definition")
    assert loaded.ignored == told
    # Many statements in a line.
    put(tmp_path / "99.mtl", "newmtl a\nKd 1 0 0\n")
    names = " ".join(f"{number}.mtl" for number in range(100))
    loaded = load(tmp_path / "a.obj", material_obj(["a"], names))
    assert (loaded.materials, len(loaded.ignored)) == ((FileMaterial("a", diffuse=RED),), 99)


@pytest.mark.parametrize("normals", [None, [[0, 0, 1]] * 3])
def test_gltf_materials(tmp_path, normals):
    materials = [
        base(0, 0, 1, 0.5, name="blue"),
        base(9, 9, 9, 9, name="unused"),
        {"name": "white"},
        {"pbrMetallicRoughness": {"metallicFactor": 0.5, "roughnessFactor": 0.3}, "doubleSided": True},
        base(0, 0, 1, 1, name="blue too"),
        base(1, 0.25, 0, 1),
    ]
    # The effect of a texture on the factors is not known.
    materials[5]["pbrMetallicRoughness"] |= {"metallicRoughnessTexture": {"index": 0}}
    loaded = check(
        load(tmp_path / "a.glb", material_gltf(materials, [5, None, 0, 2, 3, 4, 0], None, normals))
    )
    of_factors, all_white = FileMaterial.of_metallic_roughness, (1.0, 1.0, 1.0)
    blue, white = of_factors("blue", BLUE, 0, 1), of_factors("white", all_white, 1, 1)
    half, orange = of_factors("", all_white, 0.5, 0.3, True), FileMaterial("", (1.0, 0.25, 0.0))
    assert by_position(loaded) == [orange, FileMaterial(), blue, white, half, blue, blue]
    assert loaded.ignored == ("textures: metallicRoughnessTexture",)
    one = load_mesh(str(tmp_path / "a.glb"), materials=False)
    assert one.materials == (FileMaterial(),)
    assert np.array_equal(one.mesh.vertices, loaded.mesh.vertices)
    assert np.array_equal(one.mesh.normals, loaded.mesh.normals)


def test_gltf_primitives_of_one_mesh(tmp_path):
    """Points and lines are among the primitives, and a mirrored node has the same mesh.

    No part takes another's material.
    """
    document, buffer = mesh_gltf()
    start = len(buffer)
    buffer += np.add(TRIANGLE, [2, 0, 0]).astype("<f4").tobytes()
    document["buffers"][0]["byteLength"] = len(buffer)
    document["bufferViews"].append({"buffer": 0, "byteOffset": start, "byteLength": 36})
    document["accessors"].append(vectors(3, 2))
    near, far = {"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 2}}
    document["meshes"][0]["primitives"] = [
        {**near, "mode": 0, "material": 0},
        {**near, "mode": 1, "material": 2},
        {**near, "mode": 3, "material": 2},
        {**far, "material": 1},
        {**near, "material": 0},
    ]
    document["materials"] = [base(1, 0, 0, 1), base(0, 1, 0, 1), base(0, 0, 1, 1)]
    document["nodes"] = [{"mesh": 0}, {"mesh": 0, "scale": [-1, 1, 1], "translation": [7, 0, 0]}]
    document["scenes"][0]["nodes"] = [0, 1]
    loaded = check(load(tmp_path / "a.glb", (document, buffer)))
    assert (face_normals(loaded.mesh) == [0, 0, 1]).all()
    assert [m.diffuse for m in by_position(loaded)] == [RED, GREEN, GREEN, RED]


@pytest.mark.parametrize("stored", [True, False])
@pytest.mark.parametrize("mirror", [False, True])
def test_material_of_a_face_survives_what_is_done_to_the_mesh(tmp_path, stored, mirror):
    """Octants have 8 materials; flat triangles are dropped, creases cut, vertices welded, and a node mirrors.

    Each triangle's material is known from the position of its middle.
    """
    sphere = trimesh.creation.icosphere(subdivisions=2)
    octant = (sphere.vertices[sphere.faces].mean(axis=1) > 0) @ [1, 2, 4]
    blobs = [np.asarray(sphere.vertices, "<f4").tobytes()]
    accessors, primitives = [vectors(len(sphere.vertices), 0)], []
    for index in range(8):
        own = sphere.faces[octant == index]
        # Every second triangle is between triangles without area.
        own = np.stack([own, own[:, [0, 0, 1]]], axis=1).reshape(-1, 3)
        blobs.append(own.astype("<u4").tobytes())
        accessors.append(indices(own.size, index + 1))
        attributes = {"POSITION": 0, "NORMAL": 0} if stored and index % 2 else {"POSITION": 0}
        primitives.append({"attributes": attributes, "indices": index + 1, "material": 7 - index})
    colors = np.random.default_rng(4).random((8, 4)).tolist()
    node = {"mesh": 0, "scale": [-1, 2, 1]} if mirror else {"mesh": 0}
    document = gltf(primitives, blobs, accessors, [node], materials=[base(*c) for c in colors])
    loaded = check(load(tmp_path / "a.glb", document, crease_angle=5))
    assert loaded.dropped_faces == len(loaded.mesh.faces) == len(sphere.faces)
    middle = loaded.mesh.vertices[loaded.mesh.faces].mean(axis=1) * [-1 if mirror else 1, 1, 1]
    expected = np.array(colors)[7 - (middle > 0) @ [1, 2, 4], :3]
    actual = np.array([m.diffuse for m in loaded.materials])[loaded.mesh.material]
    assert np.array_equal(actual, expected)


def test_material_of_dropped_faces_only_is_dropped(tmp_path):
    put(tmp_path / "a.mtl", "newmtl a\nKd 9 9 9\nnewmtl b\nKd 0 1 0\nnewmtl c\nKd x\n")
    text = f"mtllib a.mtl\n{CORNERS}usemtl a\nf 1 1 2\nusemtl b\nf 1 2 3\nusemtl c\n"
    loaded = load(tmp_path / "a.obj", text)
    assert (loaded.materials, loaded.dropped_faces) == ((FileMaterial("b", GREEN),), 1)


def test_other_textures_and_missing_images_are_told(tmp_path):
    put(tmp_path / "a.mtl", "newmtl a\nmap_Kd no.png\nmap_bump -bm 1 b.png\nnewmtl b\nmap_Kd c.png\n")
    told = ("1 texture", "the image 'no.png', which does not exist")
    assert load(tmp_path / "a.obj", material_obj("a")).ignored == told


@pytest.mark.parametrize("suffix", [".obj", pytest.param(".glb", marks=pytest.mark.long)])
def test_most_materials(tmp_path, suffix):
    """`MAX_MATERIALS` materials load, and one more is refused.

    Equal materials count once, and unused materials do not count.
    """
    count, path = MAX_MATERIALS + 1, tmp_path / f"a{suffix}"

    def content(used, distinct):
        colors = [(k % distinct / 2000, 0.0, 0.5) for k in range(count)]
        if suffix == ".glb":
            return material_gltf([base(*color, 1) for color in colors], range(used))
        put(
            tmp_path / "a.mtl",
            "".join(f"newmtl {k}\nKd {r!r} {g} {b}\n" for k, (r, g, b) in enumerate(colors)),
        )
        return material_obj(range(used))

    for used, distinct in ((MAX_MATERIALS, count), (count, MAX_MATERIALS)):
        loaded = check(load(path, content(used, distinct)))
        assert len(loaded.materials) == MAX_MATERIALS
        assert [m.diffuse[0] for m in by_position(loaded)] == [k % distinct / 2000 for k in range(used)]
    reason = f"it has {count} materials; the limit is {MAX_MATERIALS}"
    check_refused(path, reason, "with one material", content=content(count, count))
    one = load_mesh(str(path), materials=False).materials
    assert one == (FileMaterial(),)


# Bad input


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("Kd nan 0 0", "material 'a' has Kd 'nan 0 0', not three numbers from 0 to 1"),
        ("Pr 1.5", "material 'a' has Pr '1.5', not a number from 0 to 1"),
        ("Pm", "material 'a' has Pm '', not a number from 0 to 1"),
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
    put(tmp_path / "a.mtl", f"newmtl a\n{line}\n")
    path = tmp_path / "a.obj"
    text = check_refused(path, reason, "shade the mesh with one material", content=material_obj("a"))
    assert text.isprintable()
    assert len(text) < 400
    assert load_mesh(str(path), materials=False).ignored == ()


@pytest.mark.parametrize(
    "name",
    [
        *("../secret.mtl", "sub/../../secret.mtl", "sub/../secret.mtl", "/etc/hostname", "C:\\a.mtl"),
        *("\\\\host\\a.mtl", "file:a.mtl", "link.mtl", "a.mtl ../secret.mtl"),
    ],
)
def test_material_files_outside_the_folder(tmp_path, name):
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    for place in (tmp_path, folder):
        put(place / "secret.mtl", "newmtl a\nKd 1 0 0\n")
    (folder / "link.mtl").symlink_to(tmp_path / "secret.mtl")
    loaded = load(folder / "a.obj", material_obj("a", name))
    assert loaded.materials == (FileMaterial("a"),)
    told = f"the material file {name!r}, outside its folder", "1 material name without a definition"
    assert loaded.ignored == told


def test_odd_material_files(tmp_path, monkeypatch):
    """The mesh itself, a folder, no name, a pipe, a circle of links, a name that no file can have."""
    (tmp_path / "b.mtl").mkdir()
    os.mkfifo(tmp_path / "pipe.mtl")
    (tmp_path / "loop.mtl").symlink_to("loop.mtl")
    put(tmp_path / "c.mtl", b"newmtl a\nKd 1 0 0\n# f\xfcr\n")
    path = tmp_path / "a.obj"
    assert load(path, material_obj("a", "a.obj")).ignored == ("1 material name without a definition",)
    for name in ("b.mtl", "pipe.mtl", "loop.mtl"):
        told = f"the material file '{name}', which does not exist"
        assert told in load(path, material_obj("a", name)).ignored
    assert load(path, material_obj("a", "")).materials == (FileMaterial("a"),)
    long = load(path, material_obj("a", "x" * 5000 + ".mtl"))
    assert long.ignored[0].endswith("x...', which does not exist")
    assert load(path, material_obj("a", "c.mtl")).materials == (FileMaterial("a", RED),)
    monkeypatch.setattr(blysk.sim.meshes.mtl, "_MAX_LIBRARY", 10)
    check_refused(path, "its material file 'c.mtl' is over 10 bytes")


RANGE = "not four numbers from 0 to 1"


@pytest.mark.parametrize(
    ("materials", "index", "reason"),
    [
        (
            [base(1, 0, 0, 1)],
            1,
            "a mesh refers to material 1, counted from 0, but the number of materials is 1",
        ),
        (None, 0, "a mesh refers to material 0, counted from 0, but the number of materials is 0"),
        ([base(1, 0, 0, 1)], -1, "a mesh refers to material -1"),
        ([base(1, 0, 0, 1)], 10**30, "a mesh refers to material 1000000000"),
        ([base(1, 0, 0, 1)], "0", "a mesh refers to material 0"),
        ([base(1, 0, 0, 1)], True, "a mesh refers to material True"),
        ([base(1, 0, 0, 1)], [0], "a mesh refers to material [0]"),
        ([base(float("nan"), 0, 0, 1, name="x")], 0, "material 'x' has baseColorFactor '[nan, 0, 0, 1]'"),
        ([base(0, float("inf"), 0, 1)], 0, "material 'number 0' has baseColorFactor"),
        ([base(0, 0, 1)], 0, "has baseColorFactor '[0, 0, 1]'"),
        *(([base(0, 0, value, 1)], 0, RANGE) for value in (1.5, -0.5, 10**400, True, "1")),
        ([{"pbrMetallicRoughness": {"baseColorFactor": {"r": 1}}}], 0, RANGE),
        ([{"pbrMetallicRoughness": [1]}], 0, "has pbrMetallicRoughness '[1]', not an object"),
        *(
            ([{"pbrMetallicRoughness": {key: value}}], 0, f"has {key} '{value}', not a number from 0 to 1")
            for key, value in (("metallicFactor", 2), ("roughnessFactor", -0.5), ("roughnessFactor", True))
        ),
        *(
            (value, 0, "its materials are not a list of objects")
            for value in ([7], {"0": base(1, 0, 0, 1)}, "red")
        ),
    ],
)
def test_bad_gltf_materials(tmp_path, materials, index, reason):
    path, document = tmp_path / "a.glb", material_gltf(materials, [index])
    text = check_refused(path, reason, "shade the mesh with one material", content=document)
    assert text.isprintable()
    assert len(text) < 400
    assert load_mesh(str(path), materials=False).materials == (FileMaterial(),)


_WORDS = st.sampled_from(["Kd", "Ks", "Ns", "newmtl", "a", "0.5", "1", "-1", "nan", "1e9", "map_Kd", "#"])


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(lines=st.lists(st.lists(_WORDS | st.text(max_size=5), max_size=5).map(" ".join), max_size=6))
def test_any_material_file(tmp_path, lines):
    """Any file gives a material in its ranges, or is refused in one line."""
    put(tmp_path / "a.obj", material_obj("a"))
    put(tmp_path / "a.mtl", "\n".join(["newmtl a", *lines]))
    loaded, refusal = loaded_or_refused(tmp_path / "a.obj")
    if loaded is None:
        assert refusal.isprintable()
        assert re.search("has K[ds] .* not three numbers from 0 to 1|has Ns .* not a number from 0", refusal)
    else:
        assert all(text.isprintable() for text in check(loaded).ignored)


@pytest.mark.parametrize("kind", [".mtl", ".glb", ".obj"])
def test_damaged_materials(tmp_path, kind):
    """Random bytes of the materials are changed: the result is a whole mesh, or a refusal in one line."""
    rng = np.random.default_rng(20261122)
    put(tmp_path / "a.obj", material_obj("abc"))
    put(
        tmp_path / "a.mtl",
        "newmtl a\nKd 1 0 0\nnewmtl b\nKs 0 1 0\nNs 20\nnewmtl c\nKd 0 0 1\nmap_Kd a.png\n",
    )
    materials = [base(1, 0, 0, 1, name="a"), base(0, 0.5, 0, 1), {"name": "c"}]
    put(tmp_path / "a.glb", material_gltf(materials, [0, 1, 2, None]))
    path, main = tmp_path / f"a{kind}", tmp_path / ("a.glb" if kind == ".glb" else "a.obj")
    data = path.read_bytes()
    begin, end = 0, len(data)
    if kind == ".glb":
        begin, end = data.index(b'"materials"'), len(data.rstrip(b"\0")) - 60
    outcomes = {True: 0, False: 0}
    for _ in range(200):
        damaged = bytearray(data)
        for at in rng.integers(begin, end, rng.integers(1, 4)):
            damaged[at] = rng.choice([rng.integers(0, 256), rng.choice(list(b"0123456789.-+e[]{}# "))])
        path.write_bytes(bytes(damaged))
        loaded, _ = loaded_or_refused(main)
        outcomes[loaded is None] += 1
        if loaded:
            check(loaded)
    assert min(outcomes.values()) > 5


# Surfaces


def test_surfaces():
    default = Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 50)
    said = FileMaterial("a", (0.5, 0.0, 1.0), (0.0, 0.0, 0.0), 7)
    black, nothing = FileMaterial("b", (0.0, 0.0, 0.0)), FileMaterial("c", exponent=3)
    assert surfaces([said, black, nothing], default) == (
        Material((0.05, 0, 0.1), (0.5, 0, 1), (0, 0, 0), 7),
        Material((0, 0, 0), (0, 0, 0), (0.6, 0.6, 0.6), 50),
        Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 3),
    )
    everything = {"ambient", "diffuse", "specular", "exponent"}
    assert surfaces([said, black, nothing], default, everything) == (default,) * 3
    kept = Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0, 0, 0), 50)
    assert surfaces([said], default, {"diffuse", "exponent"}) == (kept,)
    assert surfaces([said], default, {"ambient"}) == (Material(default.ambient, (0.5, 0, 1), (0, 0, 0), 7),)
    assert surfaces([FileMaterial()], default) == (default,)


def test_surfaces_of_factors():
    """By the formulas of glTF's appendix B.

    Options replace values of the file, and an exponent replaces a roughness.
    """
    default = Material((0.08, 0.05, 0.03), (0.75, 0.42, 0.2), (0.6, 0.6, 0.6), 50)
    said = FileMaterial.of_metallic_roughness("a", (0.5, 0.0, 1.0), 0.25, 0.8, two_sided=True)
    (made,) = surfaces([said], default)
    assert made.diffuse == pytest.approx((0.375, 0, 0.75))
    assert made.ambient == pytest.approx((0.05, 0, 0.1))
    assert made.fresnel == pytest.approx((0.03 + 0.125, 0.03, 0.03 + 0.25))
    assert made.specular == pytest.approx((1 / (4 * 0.64**2),) * 3)
    assert (made.roughness, made.exponent, made.two_sided) == (0.8, round(2 / 0.64**2 - 2), True)
    (shiny,) = surfaces([said], default, {"exponent"})
    assert (shiny.exponent, shiny.roughness) == (50, None)
    (painted,) = surfaces([said], default, {"diffuse", "specular"})
    assert (painted.ambient, painted.diffuse) == (default.ambient, default.diffuse)
    assert (painted.specular, painted.fresnel, painted.roughness) == (default.specular, None, 0.8)
    (rough,) = surfaces([said], replace(default, roughness=0.2, fresnel=(1, 1, 1)), {"roughness", "fresnel"})
    assert (rough.roughness, rough.fresnel, rough.exponent) == (0.2, (1, 1, 1), made.exponent)


def test_factors_of_obj(tmp_path):
    """Pr and Pm replace Ks and Ns."""
    put(
        tmp_path / "a.mtl",
        "newmtl a\nKd 1 0 0\nKs 1 1 1\nNs 9\nPr 0.25\nnewmtl b\nPm 1 # metal\nPr 0.5\nnewmtl c\nPm 0.5\n",
    )
    made = by_position(load(tmp_path / "a.obj", material_obj(["a", "b", "c"], "a.mtl")))
    factors = (RED, 0, 0.25), ((1.0,) * 3, 1, 0.5), ((1.0,) * 3, 0.5, 1)
    expected = zip("abc", factors, strict=True)
    assert made == [FileMaterial.of_metallic_roughness(name, *of) for name, of in expected]


def test_a_scene_of_a_file(tmp_path):
    """From a file to the constants of the pipeline: the surfaces fit the mesh."""
    loaded = load(tmp_path / "a.glb", material_gltf([base(1, 0, 0, 1), base(0, 0, 1, 1)], [1, None, 0]))
    default = Material((0, 0, 0), (0.5, 0.5, 0.5), (0, 0, 0), 1)
    camera = Camera.framing(loaded.mesh.vertices, (0, 0, 1), "orthographic", 3)
    given = surfaces(loaded.materials, default, {"specular"})
    scene = Scene(loaded.mesh, camera, 90, 30, given, (Light((0, 0, 1)),))
    image = render(scene).image
    colors = [[0.0, 0.0, 1.0], [0.5, 0.5, 0.5], [1.0, 0.0, 0.0]]
    assert np.unique(image[image.any(axis=-1)].round(9), axis=0).tolist() == colors
    # From left to right the picture has the order of the strip.
    thirds = np.split(image, 3, axis=1)
    assert [third.reshape(-1, 3).max(axis=0).round(9).tolist() for third in thirds] == colors
