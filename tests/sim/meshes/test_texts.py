"""Texts are read the same however they were saved: marks, ends of lines, comments, headers of binary
files."""

import base64
import json
import struct

import numpy as np
import pytest

from .files import CORNERS, PLY, STL, TRIANGLE, load, mesh_gltf, put

SQUARE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 .5\n"
OBJ = CORNERS + "f 1 2 3\n"


def json_text(**extra):
    document, buffer = mesh_gltf(**extra)
    document["buffers"][0]["uri"] = "data:;base64," + base64.b64encode(buffer).decode()
    return json.dumps(document, indent=1)


SAVED = {
    "as it is": lambda text: text.encode(),
    "mark": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "UTF-16": lambda text: text.encode("utf-16"),
    "UTF-16 big endian": lambda text: b"\xfe\xff" + text.encode("utf-16-be"),
    "UTF-32": lambda text: text.encode("utf-32"),
    "CR LF": lambda text: text.replace("\n", "\r\n").encode(),
    "CR": lambda text: text.replace("\n", "\r").encode(),
    "CR LF once": lambda text: text.replace("\n", "\r\n", 2).replace("\r\n", "\n", 1).encode(),
    "CR CR LF": lambda text: text.replace("\n", "\r\r\n").encode(),
    "space": lambda text: b" " + text.encode(),
    "lines": lambda text: b"\n \r\n\t" + text.encode(),
    "mark and line": lambda text: b"\xef\xbb\xbf\n" + text.encode(),
    "end of file": lambda text: text.encode() + b"\x1a",
    "zeros": lambda text: text.encode() + b"\0\0",
    "no last line": lambda text: text.rstrip("\n").encode(),
}


@pytest.mark.parametrize("saved", SAVED)
@pytest.mark.parametrize("kind", ["obj", "mtl", "ply", "stl", "gltf"])
def test_text_is_read_the_same_everywhere(tmp_path, kind, saved):
    text = {"obj": OBJ, "mtl": "newmtl red\nKd 1 0 0\n", "ply": PLY, "stl": STL, "gltf": json_text()}[kind]
    path = tmp_path / f"a.{'obj' if kind == 'mtl' else kind}"
    if kind == "mtl":
        put(tmp_path / "a.mtl", SAVED[saved](text))
        text = "mtllib a.mtl\nusemtl red\n" + OBJ
        loaded = load(path, text)
        assert loaded.materials[0].diffuse == (1, 0, 0)
    else:
        loaded = load(path, SAVED[saved](text))
    assert np.array_equal(loaded.mesh.vertices[loaded.mesh.faces], [TRIANGLE])
    assert loaded.ignored == ()


@pytest.mark.parametrize(
    "text",
    [
        "# C:\\models\\\nf 2 4 3\n",
        "# C:\\models\\\r\nf 2 4 3\n",
        "f 2 4 3 # C:\\models\\\n",
        "usemtl a # C:\\models\\\nf 2 4 3\n",
        "f 2 \\\n4 \\\n3\n",
        "f 2 4\\\n3\n",
        "f 2 4 \\ \r\n3\n",
        "f 2 4 \\ # half\n 3\n",
        "\t # \\\n\\\nf 2 4 3\\\n",
        "# a\\\n# b\\\nf 2 4 3",
        "f 2/1 4/2 3/9",
        "f 2/1/ 4/2/ 3/3/",
        "vt x\nvt\nvt nan 0\nf -3/-1 -1/-1 -2/-1",
        "v 9 9 9\nf -4 -2 -3",
    ],
)
def test_a_comment_swallows_no_line(tmp_path, text):
    mesh = load(tmp_path / "a.obj", SQUARE + "f 1 2 3\n" + text).mesh
    corners = sorted(map(sorted, mesh.vertices[mesh.faces].tolist()))
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]]
    assert corners == sorted(sorted(points[k] for k in face) for face in ([0, 1, 2], [1, 3, 2]))


@pytest.mark.parametrize(
    "text",
    ["# C:\\maps\\\nKd 1 0 0\n", "Kd 1 \\\n0 0\n", "Kd 1 0 0 # \\\nNs 5\n", "\t# \\\r\nKd 1 \\\r\n 0 0"],
)
def test_comments_and_continued_lines_of_material_files(tmp_path, text):
    put(tmp_path / "a.mtl", f"newmtl a # C:\\\n{text}")
    loaded = load(tmp_path / "a.obj", "mtllib a.mtl\nusemtl a\n" + OBJ)
    assert loaded.materials[0].diffuse == (1, 0, 0)
    assert loaded.materials[0].exponent == (5 if "Ns" in text else None)
    assert loaded.ignored == ()


def binary_ply(end, newline="\n", comment="", order="little", tail=b""):
    lines = (
        f"ply|format binary_{order}_endian 1.0|{comment}element vertex 3|property float x|property float y|"
    )
    lines += "property float z|element face 1|property list uchar int vertex_indices|"
    sign = "<>"[order == "big"]
    # The first byte of the data is a line feed.
    data = struct.pack(f"{sign}9f", *np.frombuffer(b"\n\0\0\0", "<f4"), *np.ravel(TRIANGLE)[1:])
    data = data if order == "little" else struct.pack(">9f", *np.ravel(TRIANGLE))
    body = data + struct.pack(f"{sign}B3i", 3, 0, 1, 2)
    return lines.replace("|", newline).encode() + b"end_header" + end + body + tail


@pytest.mark.parametrize(
    "data",
    [
        binary_ply(b"\n"),
        binary_ply(b"\r\n"),
        binary_ply(b"\r\n", "\r\n"),
        binary_ply(b"\n", "\r\n"),
        binary_ply(b"\r", "\r"),
        binary_ply(b" \t\n"),
        binary_ply(b"\n", comment="comment no end_header here|"),
        binary_ply(b"\n", comment="obj_info num_cols 5|"),
        binary_ply(b"\n", order="big"),
        b"\xef\xbb\xbf" + binary_ply(b"\n"),
        b"\n " + binary_ply(b"\r\n"),
    ],
    ids=range(11),
)
def test_ends_of_a_ply_header(tmp_path, data):
    mesh = load(tmp_path / "a.ply", data).mesh
    np.testing.assert_allclose(mesh.vertices[mesh.faces], [TRIANGLE], atol=1e-40)
    assert load(tmp_path / "a.ply", data + b"\n").ignored == ("1 byte after the last element",)
