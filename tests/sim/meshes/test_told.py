"""Contents that change a picture and are not read are told: OBJ, MTL, PLY and STL. Plain data is drawn."""

import struct

import numpy as np
import pytest

from blysk.sim.meshes.mesh import load_mesh

from .files import CORNERS, PLY, STL, TRIANGLE, check, check_refused, load, put

FACE = "f 1 2 3\n"
OBJ = CORNERS + FACE

# OBJ and MTL

OBJ_TOLD = {
    "plain": (f"o a\ng b c\nvt 0 0\nvn 0 0 1\n{CORNERS}f 1/1/1 2/1/1 3/1/1\n", ()),
    "lines and points": (OBJ + "l 1 2 3\np 1\nl 1 2\n", ("statements: l, p",)),
    "curves": (OBJ + "cstype bezier\ndeg 2\ncurv 0 1 1 2 3\nend\n", ("statements: cstype, deg, curv, end",)),
    "another case": (OBJ + "V 0 0 9\nF 1 2 3\nUseMtl a\n", ("statements: V, F, UseMtl",)),
    "group of lines": (OBJ + "fo 1 2 3\nfoo\n1 2 3\n", ("statements: fo, foo, 1",)),
    "mixed colours": ("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\n" + FACE, ("2 missing colours of vertices",)),
    "transparent": ("v 0 0 0 1 0 0 .5\nv 1 0 0 0 0 0 1\nv 0 1 0 1 0 0 1\n" + FACE, ("vertex alpha",)),
    "smooth": (CORNERS + "s 1\n" + FACE, ("smoothing groups (--crease says which edges are sharp)",)),
    "colours in comments": (
        CORNERS + "#MRGB ffff0000ff00ff00ff0000ff\n" + FACE,
        ("vertex colours in comments (#MRGB)",),
    ),
    "flat": (CORNERS + "s off\nf 1/1 2/2 3/3\n", ("smoothing groups (--crease says which edges are sharp)",)),
    "smooth, with normals": (CORNERS + "vn 0 0 1\ns 1\nf 1//1 2//1 3//1\n", ()),
    "no library": ("usemtl a\n" + OBJ, ("1 material name without a definition",)),
    "absolute": (
        "mtllib /home/me/my files/a.mtl\nusemtl a\n" + OBJ,
        (
            "the material file '/home/me/my files/a.mtl', outside its folder",
            "1 material name without a definition",
        ),
    ),
    "absolute, of Windows": (
        "mtllib C:\\my files\\a.mtl\nusemtl a\n" + OBJ,
        (
            "the material file 'C:\\\\my files\\\\a.mtl', outside its folder",
            "1 material name without a definition",
        ),
    ),
    "missing": (
        "mtllib no file.mtl\nusemtl a\n" + OBJ,
        ("the material file 'no file.mtl', which does not exist", "1 material name without a definition"),
    ),
    "absolute, of no use": ("mtllib /home/a.mtl\n" + OBJ, ()),
}


@pytest.mark.parametrize("name", OBJ_TOLD)
def test_obj_contents_that_are_not_read(tmp_path, name):
    text, told = OBJ_TOLD[name]
    loaded = check(load(tmp_path / "a.obj", text))
    assert (loaded.ignored, len(loaded.mesh.faces)) == (told, 1)


MTL_TOLD = {
    "Kd 1 0 0\nKs 0 0 0\nNs 10\nillum 2\nNi 1.45\nd 1.0\nTr 0\nKe 0 0 0\nTf 1 1 1\nsharpness 60": (),
    "illum 1\nKs 0 0 0\nPc 0\nPs 0\naniso 0\nmap_aat on\nPcr 0.3": (),
    "Pr 0.5\nPm 0.1\nKd 1 1 1": (),
    "d 0.5": "alpha (d)",
    "d -halo 0.5": "alpha (d)",
    "Tr 0.25": "alpha (Tr)",
    "d 1\nTr 1": (),
    "d 0.3\nTr 0.7": "alpha (d)",
    "map_D a.png\nmap_Tr -s 1 1 b.png": "alpha (map_d), alpha (map_Tr)",
    "Ke 1 0 0": (),
    "Ka 1 1 1": "ambient colour (Ka)",
    "Tf 0.5": "transmission (Tf)",
    "illum 0": (),
    "illum 3": "illum 3",
    "illum 1": "illum 1",
    "illum 4": "illum 4",
    "kd 1 0 0\nKS 0 0 0\nke 1 1 1\nD 0.5": "kd, KS, ke, D",
    "Pc 1\nPs 0.5\naniso 0.2": "clearcoat (Pc), sheen (Ps), anisotropy (aniso)",
}


@pytest.mark.parametrize("text", MTL_TOLD)
def test_mtl_keywords_that_are_not_read(tmp_path, text):
    put(tmp_path / "a.mtl", f"newmtl a\n{text}\n")
    told = MTL_TOLD[text]
    loaded = load(tmp_path / "a.obj", "mtllib a.mtl\nusemtl a\n" + OBJ)
    assert loaded.ignored == ((f"of materials: {told}",) if told else ())
    # Contents that no face has, or that no option asked for, change no picture.
    assert load(tmp_path / "a.obj", "mtllib a.mtl\n" + OBJ).ignored == ()
    assert load_mesh(put(tmp_path / "a.obj", "mtllib a.mtl\nusemtl a\n" + OBJ), materials=False).ignored == ()


def test_many_names_are_cut(tmp_path):
    statements = "".join(f"word{k} 1\n" for k in range(50))
    (told,) = load(tmp_path / "a.obj", statements + OBJ).ignored
    assert told.endswith("word10, word11, 38 more")
    check_refused(
        tmp_path / "b.obj", "it has no faces (not read: statements: F)", content=CORNERS + "F 1 2 3"
    )


# PLY and STL


def ply_of(properties="", rows=("", "", ""), elements="", tail="", faces="3 0 1 2\n"):
    return (
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        f"{properties}element face {faces.count(chr(10))}\nproperty list uchar int vertex_index\n{elements}"
        "end_header\n"
        + "".join(f"{x} {y} {z}{row}\n" for (x, y, z), row in zip(TRIANGLE, rows, strict=True))
        + faces
        + tail
    )


COLOR = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
PLY_TOLD = {
    "plain": (ply_of("property float confidence\nproperty float intensity\n", (" .5 1",) * 3), ()),
    "texture coordinates": (ply_of("property float s\nproperty float t\n", (" .5 1",) * 3), ()),
    "colours": (ply_of(COLOR, (" 1 2 3",) * 3), ()),
    "opaque": (ply_of(COLOR + "property uchar alpha\n", (" 1 2 3 255",) * 3), ()),
    "half a colour": (ply_of("property uchar red\n", (" 1",) * 3), ("vertex colours",)),
    "alpha": (
        ply_of(COLOR + "property uchar alpha\n", (" 1 2 3 255", " 1 2 3 9", " 1 2 3 255")),
        ("vertex alpha",),
    ),
    "floats": (ply_of("property float alpha\n", (" 1", " 1", " 1")), ()),
    "another name": (ply_of("property int kind_of\n", (" 1",) * 3), ("vertex properties: kind_of",)),
    "edges": (
        ply_of(elements="element edge 1\nproperty int vertex1\nproperty int vertex2\n", tail="0 1\n"),
        ("elements: edge",),
    ),
    "no edges": (ply_of(elements="element edge 0\nproperty int vertex1\n"), ()),
    "face colours": (ply_of(elements="property uchar red\n", faces="3 0 1 2 9\n"), ("face colours",)),
    "material": (
        ply_of(elements="property int material\n", faces="3 0 1 2 9\n"),
        ("face properties: material",),
    ),
    "lines behind": (ply_of(tail="3 0 1 2\n\n3 0 1 2\n"), ("2 lines after the last element",)),
    "texture": (
        ply_of().replace("1.0\n", "1.0\ncomment TextureFile a.png\ncomment texturefile b.png\n", 1),
        ("the image 'a.png', which does not exist",),
    ),
}


@pytest.mark.parametrize("name", PLY_TOLD)
def test_ply_contents_that_are_not_read(tmp_path, name):
    text, told = PLY_TOLD[name]
    loaded = check(load(tmp_path / "a.ply", text))
    assert (loaded.ignored, len(loaded.mesh.faces)) == (told, 1)


STRIPS = np.array([0, 1, 2, 3, -1, 2, 3, 4, -1, 4, 3, 3, 2])


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("rows", [1, 3])
@pytest.mark.parametrize("faces", [False, True])
def test_ply_strips(tmp_path, form, rows, faces):
    """Strips as Stanford writes them, in one list, or in a list for each strip; also beside faces."""
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 2, 0.4)]
    lists = [STRIPS.tolist()] if rows == 1 else [[0, 1, 2, 3], [2, 3, 4], [4, 3, 3, 2]]
    head = f"ply\nformat {form} 1.0\nelement vertex 5\n" + "".join(f"property float {x}\n" for x in "xyz")
    head += "element face 1\nproperty list int int vertex_indices\n" * faces
    head += f"element tristrips {rows}\nproperty list int int vertex_indices\nend_header\n"
    lists = [[0, 1, 4]] * faces + lists
    if form == "ascii":
        body = "\n".join(
            " ".join(map(str, row)) for row in [*points, *([len(r), *r] for r in lists)]
        ).encode()
    else:
        sign = "<" if "little" in form else ">"
        body = np.array(points, f"{sign}f4").tobytes()
        body += b"".join(np.array([len(row), *row], f"{sign}i4").tobytes() for row in lists)
    mesh = load(tmp_path / "a.ply", head.encode() + body).mesh
    expected = [[0, 1, 4]] * faces + [[0, 1, 2], [2, 1, 3], [2, 3, 4]]
    found = sorted(min(t[k:] + t[:k] for k in range(3)) for t in mesh.vertices[mesh.faces].round(6).tolist())
    triangles = [[list(map(float, points[k])) for k in face] for face in expected]
    assert found == sorted(min(t[k:] + t[:k] for k in range(3)) for t in triangles)


def test_ply_strip_of_a_vertex_that_is_not_there(tmp_path):
    text = PLY.replace("element face", "element tristrips").replace("3 0 1 2", "3 0 1 3")
    check_refused(
        tmp_path / "a.ply",
        "a face refers to vertex 3, counted from 0, but the number of vertices is 3",
        content=text,
    )


def binary_stl(tail=b"", attribute=0, head=b"", count=1):
    corners = struct.pack("<12fH", 0, 0, 1, *np.ravel(TRIANGLE), attribute)
    return head.ljust(80, b" ") + struct.pack("<I", count) + corners + tail


SINGLE = STL.replace("\n", " ").replace("a vertex 9 9 9", "a").replace("a vertex", "a")
STL_TOLD = {
    "binary": (binary_stl(), ()),
    "begins like a text": (binary_stl(head=b"solid a"), ()),
    "a stray byte": (binary_stl(b"\n"), ("1 byte after the last triangle",)),
    "stray bytes": (binary_stl(bytes(60)), ("60 bytes after the last triangle",)),
    "colours": (binary_stl(attribute=0x801F), ()),
    "another attribute": (binary_stl(attribute=0x1F), ("1 attribute that may be a colour",)),
    "colour of all": (binary_stl(head=b"COLOR=\xff\0\0\xff"), ()),
    "material of all": (
        binary_stl(head=b"COLOR=\xff\0\0\x80,MATERIAL=" + bytes(12)),
        ("the alpha of its header", "the material of its header"),
    ),
    "upper case": (STL.upper(), ()),
    "indented": (STL.replace("\n", "\n\t  "), ()),
    "a comment before": ("; made by hand\n" + STL, ()),
    "one line": (SINGLE, ()),
    "two solids": (STL + STL, ()),
    "without a name": ("solid\n" + STL.partition("\n")[2].replace("endsolid a vertex", "endsolid"), ()),
    "color": (STL.replace("outer", "color 1 0 0\nouter"), ("keywords: color",)),
}


@pytest.mark.parametrize("name", STL_TOLD)
def test_stl_contents_that_are_not_read(tmp_path, name):
    content, told = STL_TOLD[name]
    loaded = load(tmp_path / "a.stl", content)
    assert np.array_equal(loaded.mesh.vertices[loaded.mesh.faces[0]], TRIANGLE)
    assert loaded.ignored == told


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (STL.replace("vertex 0 1 0\n", ""), "a facet does not have 3 vertices"),
        (STL.replace("0 1 0", "0,5 1 0"), "a vertex holds no number"),
        (STL.replace("0 1 0", "1_0 1 0"), "a number with the character _"),
        (STL.replace("endsolid a vertex", ""), "cut short"),
        (STL + STL.replace("endsolid a vertex", ""), "cut short"),
        ("x" * 100, "a text without solid and facet"),
        ("solid a\nendsolid a\n", "it has no faces"),
    ],
)
def test_stl_texts_that_are_refused_for_what_they_are(tmp_path, text, reason):
    check_refused(tmp_path / "a.stl", reason, content=text)
