"""Colours of vertices, images and texture coordinates of OBJ, PLY and STL files."""

import struct

import numpy as np
import pytest
from PIL import Image

from blysk.sim.meshes.materials import FileMaterial
from blysk.sim.meshes.mesh import load_mesh

from .files import CORNERS, TRIANGLE, check, check_refused, load, put

# Codes of 8 bits and their linear light, computed with other tools from IEC 61966-2-1.
LINEAR = {0: 0.0, 51: 0.0331048, 102: 0.1328683, 128: 0.2158605, 204: 0.6038273, 255: 1.0}
FACE = "f 1 2 3\n"


def at_corners(loaded, values):
    """Values of the vertices of the first face, by position."""
    mesh = loaded.mesh
    return {tuple(mesh.vertices[k].tolist()): tuple(np.round(values[k], 6).tolist()) for k in mesh.faces[0]}


def linear(*codes):
    return tuple(round(LINEAR[code], 6) for code in codes)


def same(found, expected):
    assert found.keys() == expected.keys()
    for place, values in expected.items():
        assert np.allclose(found[place], values, rtol=0, atol=2e-6), place


# OBJ

COLORED = ["0 0 0", "1 0 0", "0 1 0"]
BEHIND = {
    "floats": ((".2 .4 0", "1 .8 0", "0 0 1"), ()),
    "codes": (("51 102 0", "255 204 0", "0 0 255"), ()),
    "alpha": ((".2 .4 0 1", "1 .8 0 1", "0 0 1 1"), ()),
    "codes, alpha": (("51 102 0 255", "255 204 0 255", "0 0 255 255"), ()),
    "weight": (("1 .2 .4 0", "1 1 .8 0", "1 0 0 1"), ()),
    "weight and alpha": (("1 .2 .4 0 1", "1 1 .8 0 .5", "1 0 0 1 1"), ("vertex alpha",)),
}


@pytest.mark.parametrize("name", BEHIND)
def test_obj_colours(tmp_path, name):
    rows, told = BEHIND[name]
    text = "".join(f"v {place}  {row}\n" for place, row in zip(COLORED, rows, strict=True))
    loaded = check(load(tmp_path / "a.obj", text + FACE))
    colors = at_corners(loaded, loaded.mesh.colors)
    same(
        colors,
        dict(zip(TRIANGLE_PLACES, (linear(51, 102, 0), linear(255, 204, 0), linear(0, 0, 255)), strict=True)),
    )
    assert loaded.ignored == told
    assert loaded.materials[0].colored
    one = load_mesh(str(tmp_path / "a.obj"), materials=False)
    assert (len(one.mesh.colors), one.ignored, one.materials) == (0, (), (FileMaterial(),))


TRIANGLE_PLACES = [tuple(map(float, place)) for place in TRIANGLE]


def test_obj_weight_alone_is_no_colour(tmp_path):
    loaded = load(tmp_path / "a.obj", "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\n" + FACE)
    assert (len(loaded.mesh.colors), loaded.ignored) == (0, ())


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("nan 0 0", "a vertex has nan in its colour, not a number from 0 to 1"),
        ("-0.5 0 0", "a vertex has -0.5 in its colour"),
        ("1.5 0 0", "a vertex has 1.5 in its colour, not a number from 0 to 1"),
        ("300 0 0", "a vertex has 300 in its colour, not a number from 0 to 255"),
        ("0 0", "a position has 5 numbers"),
        ("2 1 1 1 1", "a weight w other than 1"),
        ("x 0 0", "not 3 numbers"),
    ],
)
def test_bad_obj_colours(tmp_path, row, reason):
    check_refused(tmp_path / "a.obj", reason, content=f"v 0 0 0 {row}\nv 1 0 0\nv 0 1 0\n{FACE}")


def wood(folder, name="wood.png", pixels=((51, 102), (204, 255))):
    """A grey image, with its upper row first."""
    Image.fromarray(np.array(pixels, np.uint8)).save(folder / name)


MAPPED = f"mtllib a.mtl\n{CORNERS}vt 0 0\nvt 1 0 0\nvt .25 .75\nusemtl a\nf 1/1 2/2 3/3\n"


@pytest.mark.parametrize(
    ("options", "scale", "offset", "wrap", "told"),
    [
        ("", (1, 1), (0, 0), "repeat", ()),
        ("-s 2", (2, 1), (0, 0), "repeat", ()),
        ("-s 2 4 1 -o .5 .25", (2, 4), (0.5, 0.25), "repeat", ()),
        ("-clamp on", (1, 1), (0, 0), "clamp", ()),
        ("-clamp off -blendu on -blendv on -mm 0 1 -t 0 0 0 -texres 64", (1, 1), (0, 0), "repeat", ()),
        ("-colorspace sRGB", (1, 1), (0, 0), "repeat", ()),
        ("-colorspace linear", (1, 1), (0, 0), "repeat", ("options of map_Kd: -colorspace linear",)),
        (
            "-bm 2 -mm .1 1 -blendu off",
            (1, 1),
            (0, 0),
            "repeat",
            ("options of map_Kd: -bm 2, -mm .1 1, -blendu off",),
        ),
    ],
)
def test_obj_image(tmp_path, options, scale, offset, wrap, told):
    wood(tmp_path)
    put(tmp_path / "a.mtl", f"newmtl a\nKd .5 .5 .5\nmap_Ka {options} wood.png\nmap_Kd {options} wood.png\n")
    loaded = check(load(tmp_path / "a.obj", MAPPED))
    assert loaded.ignored == told
    (material,) = loaded.materials
    assert material.diffuse == (0.5, 0.5, 0.5)
    # The upper row is first, and v counts downwards.
    assert np.allclose(
        material.texture.texels[..., 0], [[LINEAR[51], LINEAR[102]], [LINEAR[204], 1]], atol=1e-6
    )
    assert material.texture.wrap == (wrap, wrap)
    places = [
        (u * scale[0] + offset[0], 1 - v * scale[1] - offset[1]) for u, v in ((0, 0), (1, 0), (0.25, 0.75))
    ]
    same(at_corners(loaded, loaded.mesh.coordinates), dict(zip(TRIANGLE_PLACES, places, strict=True)))
    plain = load_mesh(str(tmp_path / "a.obj"), materials=False)
    assert (len(plain.mesh.coordinates), plain.ignored) == (0, ())


@pytest.mark.parametrize(
    "statement",
    [
        "map_Kd maps/my wood.png",
        "map_kd -s 1 1 1 maps\\my wood.png",
        "map_Kd C:\\textures\\my wood.png",
        "map_Kd /home/me/my wood.png",
        'map_Kd "maps/my wood.png"',
        "map_Kd maps/my wood.png # of the table",
        "map_Kd ../my wood.png",
    ],
)
def test_obj_image_by_any_name(tmp_path, statement):
    (tmp_path / "maps").mkdir()
    wood(tmp_path / "maps", "my wood.png")
    wood(tmp_path, "my wood.png")
    put(tmp_path / "a.mtl", f"newmtl a\n{statement}\n")
    loaded = load(tmp_path / "a.obj", MAPPED)
    assert loaded.ignored == ()
    assert loaded.materials[0].texture.texels.shape == (2, 2, 3)


def test_obj_image_beside_its_material_file(tmp_path):
    (tmp_path / "maps").mkdir()
    wood(tmp_path / "maps", pixels=((128,),))
    put(tmp_path / "maps" / "a.mtl", "newmtl a\nmap_Kd wood.png\n")
    loaded = load(tmp_path / "a.obj", MAPPED.replace("a.mtl", "maps/a.mtl"))
    assert np.allclose(loaded.materials[0].texture.texels, LINEAR[128], atol=1e-6)


def test_obj_images_that_are_not_read(tmp_path):
    (tmp_path / "in").mkdir()
    wood(tmp_path, "outside.png")
    for name, reason in (("no.png", "which does not exist"), ("../outside.png", "outside its folder")):
        put(tmp_path / "in" / "a.mtl", f"newmtl a\nKd 1 0 0\nmap_Kd {name}\n")
        loaded = load(tmp_path / "in" / "a.obj", MAPPED)
        assert loaded.ignored == (f"the image {name!r}, {reason}",)
        assert (loaded.materials[0].texture, len(loaded.mesh.coordinates)) == (None, 0)
    put(tmp_path / "in" / "a.mtl", "newmtl a\nmap_Kd\n")
    assert load(tmp_path / "in" / "a.obj", MAPPED).ignored == ("of materials: map_Kd without a file",)
    put(tmp_path / "in" / "a.mtl", "newmtl a\nmap_Kd a.png\n")
    put(tmp_path / "in" / "a.png", b"damaged")
    check_refused(tmp_path / "in" / "a.obj", "its image 'a.png' is damaged", content=MAPPED)
    assert load_mesh(str(tmp_path / "in" / "a.obj"), materials=False).ignored == ()


def test_obj_corners_keep_their_texture_coordinates(tmp_path):
    """Two triangles share a side, and its ends have other coordinates in each.

    All forms of corners are tried.
    """
    wood(tmp_path)
    put(tmp_path / "a.mtl", "newmtl a\nmap_Kd wood.png\n")
    head = f"mtllib a.mtl\nusemtl a\n{CORNERS}v 1 1 0\nvn 0 0 1\n" + "".join(
        f"vt 0.{k} 0\n" for k in range(1, 7)
    )
    for faces in (
        "f 1/1 2/2 3/3\nf 2/4 4/5 3/6\n",
        "f 1/1/1 2/2/1 3/3/1\nf 2/4/1 4/5/1 3/6/1\n",
        "f 1/1/1 2/2/1 3/3/1\nf 2/4 4/5/ 3/6\n",
        "f -4/-6 -3/-5 -2/-4\nf -3/-3 -1/-2 -2/-1\n",
    ):
        mesh = load(tmp_path / "a.obj", head + faces).mesh
        found = sorted(
            sorted((tuple(mesh.vertices[k].tolist()), round(mesh.coordinates[k, 0], 9)) for k in face)
            for face in mesh.faces
        )
        assert found == [
            [((0, 0, 0), 0.1), ((0, 1, 0), 0.3), ((1, 0, 0), 0.2)],
            [((0, 1, 0), 0.6), ((1, 0, 0), 0.4), ((1, 1, 0), 0.5)],
        ]
    mixed = load(tmp_path / "a.obj", head + "f 1/1 2/2 3\n")
    assert mixed.ignored == ("1 missing texture coordinates of a vertex",)
    assert load(tmp_path / "a.obj", head + "f 1 2 3\n").ignored == (
        "1 texture of a part without coordinates",
    )
    for faces, reason in (
        ("f 1/1 2/7 3/3\n", "has the texture coordinates 7, but there are 6"),
        ("f 1/1 2/0 3/3\n", "has the texture coordinates 0, but there are 6"),
        ("f 1/1 2/-7 3/3\n", "has the index -7, with 6 vt before it"),
        ("vt x 0\nf 1/1 2/2 3/3\n", "texture coordinates are 'x 0', not 1 to 3 numbers"),
        ("vt nan 0\nf 1/1 2/7 3/3\n", "has the texture coordinates 'nan 1'"),
    ):
        check_refused(tmp_path / "a.obj", reason, content=head + faces)


def test_obj_materials_with_and_without_images(tmp_path):
    wood(tmp_path)
    put(
        tmp_path / "a.mtl",
        "newmtl a\nmap_Kd wood.png\nnewmtl b\nKd 1 0 0\nnewmtl c\nPr .5\nPm 1\nmap_Kd wood.png",
    )
    text = f"mtllib a.mtl\n{CORNERS}vt .5 .5\n" + "".join(f"usemtl {name}\nf 1/1 2/1 3/1\n" for name in "abc")
    loaded = check(load(tmp_path / "a.obj", text))
    assert [material.texture is None for material in loaded.materials] == [False, True, False]
    assert loaded.materials[0].texture is loaded.materials[2].texture
    assert loaded.materials[2].metallic == 1


def test_obj_light_of_its_own(tmp_path):
    """Ke is emission, unless it has an image. illum 0 shows Kd without light."""
    of_each = ("Ke 0.5 0 2", "Kd 1 0 0\nillum 0", "Ke 1\nmap_Ke c.png", "Ke 0 0 0\nKd 0 0 1")
    text = "".join(f"newmtl {name}\n{text}\n" for name, text in zip("abcd", of_each, strict=True))
    put(tmp_path / "a.mtl", text)
    faces = "".join(f"usemtl {name}\nf 1 2 3\n" for name in "abcd")
    loaded = check(load(tmp_path / "a.obj", f"mtllib a.mtl\n{CORNERS}{faces}"))
    assert [material.emission for material in loaded.materials] == [(0.5, 0, 2), None, None, None]
    assert [material.unlit for material in loaded.materials] == [False, True, False, False]
    assert loaded.ignored == ("1 texture",)
    for words in ("-1 0 0", "x", "1 2", "inf 0 0", "nan"):
        put(tmp_path / "a.mtl", f"newmtl a\nKe {words}\n")
        check_refused(tmp_path / "a.obj", "has Ke", "not three numbers of at least 0")


# PLY

HEAD = "ply\nformat ascii 1.0\n{}element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face 1\nproperty list uchar int vertex_indices\n"


def ply_of(kind="", names=(), rows=("", "", ""), comment="", face="", tail=""):
    text = (
        HEAD.format(comment)
        + "".join(f"property {kind} {name}\n" for name in names)
        + FACES
        + face
        + "end_header\n"
    )
    return (
        text
        + "".join(f"{place} {row}\n" for place, row in zip(COLORED, rows, strict=True))
        + f"3 0 1 2{tail}\n"
    )


@pytest.mark.parametrize(
    ("kind", "rows"),
    [
        ("uchar", ("51 102 0", "255 204 0", "0 0 255")),
        ("ushort", ("13107 26214 0", "65535 52428 0", "0 0 65535")),
        ("float", (".2 .4 0", "1 .8 0", "0 0 1")),
        ("float", ("51 102 0", "255 204 0", "0 0 255")),
        ("int", ("51 102 0", "255 204 0", "0 0 255")),
    ],
)
@pytest.mark.parametrize("prefix", ["", "diffuse_"])
def test_ply_colours(tmp_path, kind, rows, prefix):
    text = ply_of(kind, [prefix + name for name in ("red", "green", "blue")], rows)
    loaded = check(load(tmp_path / "a.ply", text))
    colors = (linear(51, 102, 0), linear(255, 204, 0), linear(0, 0, 255))
    same(at_corners(loaded, loaded.mesh.colors), dict(zip(TRIANGLE_PLACES, colors, strict=True)))
    assert (loaded.ignored, loaded.materials[0].colored) == ((), True)
    assert len(load_mesh(str(tmp_path / "a.ply"), materials=False).mesh.colors) == 0


def test_ply_colours_of_several_types(tmp_path):
    text = ply_of("uchar", ("red", "green", "blue"), ("51 .4 0", "255 .8 0", "0 0 65535"))
    text = text.replace("uchar green", "float green").replace("uchar blue", "ushort blue")
    colors = (linear(51, 102, 0), linear(255, 204, 0), linear(0, 0, 255))
    loaded = load(tmp_path / "a.ply", text)
    same(at_corners(loaded, loaded.mesh.colors), dict(zip(TRIANGLE_PLACES, colors, strict=True)))


def test_binary_ply_colours(tmp_path):
    head = HEAD.format("").replace("ascii", "binary_big_endian")
    head += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue")) + FACES + "end_header\n"
    codes = ((51, 102, 0), (255, 204, 0), (0, 0, 255))
    body = b"".join(struct.pack(">3f3B", *place, *row) for place, row in zip(TRIANGLE, codes, strict=True))
    loaded = load(tmp_path / "a.ply", head.encode() + body + struct.pack(">B3i", 3, 0, 1, 2))
    same(
        at_corners(loaded, loaded.mesh.colors),
        {p: linear(*c) for p, c in zip(TRIANGLE_PLACES, codes, strict=True)},
    )


@pytest.mark.parametrize(
    ("kind", "row", "reason"),
    [
        ("int", "300 0 0", "a vertex has 300 in its colour, not a number from 0 to 255"),
        ("char", "-1 0 0", "a vertex has -1 in its colour"),
        ("float", "nan 0 0", "a vertex has nan in its colour"),
    ],
)
def test_bad_ply_colours(tmp_path, kind, row, reason):
    text = ply_of(kind, ("red", "green", "blue"), (row, "0 0 0", "0 0 0"))
    check_refused(tmp_path / "a.ply", reason, content=text)
    assert load_mesh(str(tmp_path / "a.ply"), materials=False).ignored == ()


IMAGE = "comment TextureFile my wood.png\n"


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_ply_image(tmp_path, names):
    wood(tmp_path, "my wood.png")
    rows = ("0 0", "1 0", ".25 .75")
    loaded = check(load(tmp_path / "a.ply", ply_of("float", names, rows, IMAGE)))
    places = ((0, 1), (1, 1), (0.25, 0.25))
    same(at_corners(loaded, loaded.mesh.coordinates), dict(zip(TRIANGLE_PLACES, places, strict=True)))
    assert (loaded.ignored, loaded.materials[0].texture.texels.shape) == ((), (2, 2, 3))
    assert len(load_mesh(str(tmp_path / "a.ply"), materials=False).mesh.coordinates) == 0
    # Coordinates without an image change nothing.
    assert len(load(tmp_path / "a.ply", ply_of("float", names, rows)).mesh.coordinates) == 0


def test_ply_image_by_corners(tmp_path):
    """A file as MeshLab writes it, here with two images. The second image is missing."""
    wood(tmp_path, "my wood.png")
    lists = "property list uchar float texcoord\nproperty int texnumber\n"
    text = ply_of(comment=IMAGE + "comment TextureFile b.png\n", face=lists, tail=" 6 0 0 1 0 .25 .75 0")
    text = text.replace("face 1", "face 3")
    loaded = check(load(tmp_path / "a.ply", text + "3 0 1 2 6 .1 0 .2 0 .3 0 0\n3 0 1 2 6 0 0 0 0 0 0 1\n"))
    assert loaded.ignored == ("the image 'b.png', which does not exist",)
    assert [material.texture is None for material in loaded.materials] == [False, True]
    mesh = loaded.mesh
    assert mesh.material.tolist() == [0, 0, 1]
    assert np.allclose(mesh.coordinates[mesh.faces[0]], [[0, 1], [1, 1], [0.25, 0.25]])
    assert np.allclose(mesh.coordinates[mesh.faces[1]], [[0.1, 1], [0.2, 1], [0.3, 1]])
    wrong = text.replace(" 6 0 0 1 0 .25 .75 0", " 2 0 0 5").replace("face 3", "face 1")
    assert load(tmp_path / "a.ply", wrong).ignored == (
        "1 missing image of a face",
        "face texture coordinates",
    )


# STL


def stl(attributes, head=b""):
    """A strip of triangles with these attributes."""
    data = head.ljust(80) + struct.pack("<I", len(attributes))
    for k, attribute in enumerate(attributes):
        corners = np.add(TRIANGLE, (2 * k, 0, 0)).ravel()
        data += struct.pack("<12fH", 0, 0, 1, *corners, attribute)
    return data


RED, GREEN, BLUE = ([float(k == channel) for k in range(3)] for channel in range(3))


@pytest.mark.parametrize(
    ("attributes", "head", "expected", "told"),
    [
        ((0x8000 | 31 << 10, 0x8000 | 31 << 5, 0x8000 | 31), b"", [RED, GREEN, BLUE], ()),
        ((0x8000 | 31 << 10, 0), b"", [RED, [1, 1, 1]], ("1 missing colour of a facet",)),
        ((31 << 10, 31 << 5, 31), b"x COLOR=\xff\0\0\xff", [BLUE, GREEN, RED], ()),
        ((0x8000, 31), b"COLOR=\0\xff\0\xff", [GREEN, RED], ()),
        ((0, 0), b"COLOR=\0\0\xff\xff", [BLUE, BLUE], ()),
        # 10 of 31 is 0.3226, and 0.0849 of linear light.
        ((0x8000 | 10,), b"", [[0, 0, 0.084921]], ()),
    ],
)
def test_stl_colours(tmp_path, attributes, head, expected, told):
    loaded = check(load(tmp_path / "a.stl", stl(attributes, head)))
    mesh = loaded.mesh
    order = np.argsort(mesh.vertices[mesh.faces].min(axis=1)[:, 0])
    assert np.allclose(mesh.colors[mesh.faces[order]], np.array(expected)[:, np.newaxis], atol=1e-6)
    assert loaded.ignored == told
    assert len(load_mesh(str(tmp_path / "a.stl"), materials=False).mesh.colors) == 0


def test_stl_colours_meet_at_a_smooth_edge(tmp_path):
    """Two flat triangles of different colours share a normal at their side, and no colour."""
    other = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0]])
    data = bytes(80) + struct.pack("<I", 2)
    for corners, attribute in ((np.array(TRIANGLE), 0x8000 | 31 << 10), (other, 0x8000 | 31)):
        data += struct.pack("<12fH", 0, 0, 1, *corners.ravel(), attribute)
    mesh = check(load(tmp_path / "a.stl", data)).mesh
    assert np.array_equal(mesh.colors[mesh.faces], np.repeat([[RED], [BLUE]], 3, axis=1))
    assert np.allclose(mesh.normals, [0, 0, 1])
