"""Small good meshes and a scene, of every format."""

import base64
import io
import itertools
import json
import struct
from typing import Any

import numpy as np
import trimesh
from PIL import Image

_VERTICES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], "<f4")

_FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]], "<u4"
)

LIBRARY = b"newmtl red\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 40\nmap_Kd a.png\nnewmtl blue\nKd 0.1 0.1 0.8\n"


def _image() -> bytes:
    """A PNG of 2 x 2 pixels."""
    file = io.BytesIO()
    Image.fromarray(np.arange(0, 240, 20, dtype=np.uint8).reshape(2, 2, 3)).save(file, "PNG")
    return file.getvalue()


SCENE = b"""# A scene.
size = [16, 12]
background = "#1a1c20"
ambient_light = [1, 0.9, 0.8]
back_faces = "flip"
[mesh]
file = "a.stl"
crease = 40
materials = "file"
[camera]
projection = "perspective"
position = [3, 2, 4]
target = [0, 0.1, 0]
up = [0, 1, 0]
field_of_view = 30
viewer = "near"
[[lights]]
direction = [-0.5, 0.8, 0.7]
color = [1, 1, 1]
[[lights]]
position = [2, 3, 4]
color = "#405060"
[material]
ambient = [0.08, 0.05, 0.03]
diffuse = [0.75, 0.42, 0.2]
specular = 0.6
exponent = 50
[pipeline]
method = "chord-local"
model = "cosquad"
setup_interval = 3
gate = false
short_words = false
pipes = 2
"""


def obj() -> bytes:
    lines = ["# An octahedron.", "mtllib a.mtl"]
    lines += [f"v {x:g} {y:g} {z:g}" for x, y, z in _VERTICES]
    lines += [f"vn {x:g} {y:g} {z:g}" for x, y, z in _VERTICES]
    lines += ["vt 0 0", "vt 1 0.5"]
    for number, face in enumerate(_FACES + 1):
        lines += [f"usemtl {'red' if number < 4 else 'blue'}"] * (number % 4 == 0)
        lines.append("f " + " ".join(f"{k}/1/{k}" for k in face))
    return ("\n".join(lines) + "\n").encode()


def document_of(uri: str | None) -> tuple[dict, bytes]:
    """A glTF document of two nodes, and its buffer."""
    colors = np.tile(np.array([255, 128, 0, 255], np.uint8), (6, 1))
    views = [_VERTICES.tobytes(), _VERTICES.tobytes(), _FACES.tobytes(), colors.tobytes()]
    views += [_VERTICES[:, :2].tobytes(), _image()]
    offsets = np.cumsum([0, *map(len, views)]).tolist()
    buffer = {"byteLength": offsets[-1]} | ({"uri": uri} if uri else {})
    attributes = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 3, "TEXCOORD_0": 4}
    transform = {"offset": [0, 0.5], "rotation": 0.5, "scale": [1, 2]}
    texture = {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": transform}}
    look = {"baseColorFactor": [0.8, 0.1, 0.1, 1], "baseColorTexture": texture}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"mesh": 0, "children": [1]},
            {"mesh": 0, "translation": [0.5, 0, 0], "scale": [0.5, 0.5, 0.5]},
        ],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "material": 0}]}],
        "materials": [{"name": "red", "pbrMetallicRoughness": look, "emissiveFactor": [0, 0, 0.1]}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 10497}],
        "images": [{"bufferView": 5, "mimeType": "image/png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 6, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5125, "count": 24, "type": "SCALAR"},
            {"bufferView": 3, "componentType": 5121, "normalized": True, "count": 6, "type": "VEC4"},
            {"bufferView": 4, "componentType": 5126, "count": 6, "type": "VEC2"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": begin, "byteLength": end - begin}
            for begin, end in itertools.pairwise(offsets)
        ],
        "buffers": [buffer],
    }
    return document, b"".join(views)


def glb(document: Any, buffer: bytes) -> bytes:
    """A GLB file."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(buffer), 0x004E4942) + buffer
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def gltf(uri: str = "a.bin") -> dict[str, bytes]:
    document, buffer = document_of(uri)
    return {"a.gltf": json.dumps(document, indent=1).encode(), "a.bin": buffer}


def data_gltf() -> dict[str, bytes]:
    buffer = document_of(None)[1]
    data = base64.b64encode(buffer).decode()
    document, _ = document_of(f"data:application/octet-stream;base64,{data}")
    return {"a.gltf": json.dumps(document).encode()}


def good_files() -> dict[str, dict[str, bytes]]:
    """For each kind, the files of a good mesh or scene. The first is the file to name."""
    mesh = trimesh.Trimesh(_VERTICES, _FACES, vertex_normals=_VERTICES, process=False)
    stl = mesh.export(file_type="stl")
    return {
        "obj": {"a.obj": obj(), "a.mtl": LIBRARY},
        "mtl": {"a.obj": obj(), "a.mtl": LIBRARY},
        "stl": {"a.stl": stl},
        "ascii stl": {"a.stl": mesh.export(file_type="stl_ascii").encode()},
        "ply": {"a.ply": mesh.export(file_type="ply", vertex_normal=True)},
        "ascii ply": {"a.ply": mesh.export(file_type="ply", vertex_normal=True, encoding="ascii")},
        "glb": {"a.glb": glb(*document_of(None))},
        "gltf": gltf(),
        "gltf with data": data_gltf(),
        "scene": {"a.toml": SCENE, "a.stl": stl},
    }
