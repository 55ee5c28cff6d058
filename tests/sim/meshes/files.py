"""Mesh files of every kind for tests, and checks that every loaded mesh must pass."""

import base64
import json
import os
import re
import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from blysk.golden.reference.geometry import normalise
from blysk.sim.errors import InputError
from blysk.sim.meshes.mesh import load_mesh

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
STL = (
    "solid a vertex 9 9 9\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid a vertex\n"
)
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def put(path, content):
    """Write text, bytes, a glTF document with its buffer, or what trimesh exports.

    The result is the path as text.
    """
    if isinstance(content, tuple) and path.suffix == ".glb":
        content = glb(*content)
    elif isinstance(content, tuple):
        document, buffer = content
        uri = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
        document["buffers"][0].setdefault("uri", uri)
        content = json.dumps(document)
    elif not isinstance(content, str | bytes):
        content = content.export(file_type=path.suffix[1:])
    path.write_bytes(content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content)
    return str(path)


def load(path, content, **options):
    """Write a file as `put` does, and load it."""
    return load_mesh(put(path, content), **options)


def check_refused(source, *words, content=None, **options):
    """Check for one line that names the file, the reason and the remedy, and has the given words.

    The result is the line.
    """
    if content is not None:
        put(source, content)
    with pytest.raises(InputError) as refusal:
        load_mesh(str(source), **options)
    text = str(refusal.value)
    assert re.fullmatch(r"[^\n]+: [^\n]+; [^\n]+", text)
    assert "Error" not in text
    assert text.startswith(str(source)) or not os.path.exists(str(source))
    for word in words:
        assert word in text
    return text


def loaded_or_refused(path):
    """The mesh, or the line that refuses it."""
    try:
        return load_mesh(str(path)), None
    except InputError as refusal:
        text = str(refusal)
    assert "\n" not in text
    return None, text


def without_normals(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def with_normals(mesh, normals):
    return trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_normals=normals, process=False)


def obj_of(vertices, faces):
    """Text of an OBJ file, with every bit of a coordinate."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, dtype=float).tolist()]
    return "\n".join(lines + [f"f {' '.join(str(corner + 1) for corner in face)}" for face in faces])


def gltf(primitives, blobs, accessors, nodes, **extra):
    """A glTF document and its single buffer. Each blob has its own view."""
    buffer, views = b"", []
    for blob in blobs:
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(blob)})
        buffer += blob + bytes(-len(blob) % 4)
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes}
    document |= {"meshes": [{"primitives": primitives}], "accessors": accessors, "bufferViews": views}
    return document | {"buffers": [{"byteLength": len(buffer)}], **extra}, buffer


def vectors(count, view):
    return {"bufferView": view, "componentType": 5126, "count": count, "type": "VEC3"}


def indices(count, view):
    return {"bufferView": view, "componentType": 5125, "count": count, "type": "SCALAR"}


def glb(document, buffer):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if buffer:
        chunks += struct.pack("<II", len(buffer), 0x004E4942) + buffer
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def mesh_gltf(vertices=TRIANGLE, faces=(0, 1, 2), normals=None, nodes=None, uri=None, **extra):
    """A document of one mesh, by default of one triangle, and its buffer, perhaps in a separate file."""
    blobs = [np.asarray(vertices, "<f4").tobytes(), np.asarray(faces, "<u4").tobytes()]
    accessors = [vectors(len(vertices), 0), indices(np.size(faces), 1)]
    attributes = {"POSITION": 0}
    if normals is not None:
        blobs.append(np.asarray(normals, "<f4").tobytes())
        accessors.append(vectors(len(normals), 2))
        attributes["NORMAL"] = 2
    primitives = [{"attributes": attributes, "indices": 1}]
    document, buffer = gltf(primitives, blobs, accessors, nodes or [{"mesh": 0}], **extra)
    if uri is not None:
        document["buffers"][0]["uri"] = uri
    return document, buffer


def draco_gltf():
    """A document with compressed data that nothing decodes."""
    name = "KHR_draco_mesh_compression"
    extension = {name: {"bufferView": 0, "attributes": {"POSITION": 0}}}
    primitives = [{"attributes": {"POSITION": 0}, "indices": 1, "extensions": extension}]
    accessors = [{"componentType": 5126, "count": 3, "type": "VEC3"}]
    accessors += [{"componentType": 5125, "count": 3, "type": "SCALAR"}]
    return gltf(primitives, [b"DRACO123"], accessors, [{"mesh": 0}], extensionsUsed=[name])


def base(*color, **other):
    """A material of a glTF document, not metallic."""
    return {"pbrMetallicRoughness": {"baseColorFactor": list(color), "metallicFactor": 0}, **other}


def material_gltf(materials, primitives, nodes=None, normals=None):
    """A strip of triangles, one in each primitive, with the materials of these indices.

    None is for no material.
    """
    document, buffer = mesh_gltf(normals=normals)
    first = document["meshes"][0]["primitives"][0]
    of_each = [first if index is None else {**first, "material": index} for index in primitives]
    document["meshes"] = [{"primitives": [primitive]} for primitive in of_each]
    if materials is not None:
        document["materials"] = materials
    count = range(len(primitives))
    document["nodes"] = nodes or [{"mesh": k, "translation": [2 * k, 0, 0]} for k in count]
    document["scenes"][0]["nodes"] = list(range(len(document["nodes"])))
    return document, buffer


def strip(count):
    """Triangles side by side, as lines of an OBJ file. The middle of number k is at x = 2 k + 1/3."""
    lines = [f"v {2 * k + x} {y} 0" for k in range(count) for x, y in ((0, 0), (1, 0), (0, 1))]
    return "\n".join(lines) + "\n", [f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}\n" for k in range(count)]


def material_obj(names, library="a.mtl"):
    """A `strip` as an OBJ file, each triangle with the material of its name."""
    vertices, faces = strip(len(names))
    return f"mtllib {library}\n{vertices}" + "".join(
        f"usemtl {name}\n{face}" for name, face in zip(names, faces, strict=True)
    )


def by_position(loaded):
    """Material of each triangle of a `strip`, or None, in order of its position."""
    corner = loaded.mesh.vertices[loaded.mesh.faces].min(axis=1)[:, 0]
    position = np.rint(corner / 2).astype(int)
    result = [None] * (position.max() + 1)
    for where, index in zip(position.tolist(), loaded.mesh.material.tolist(), strict=True):
        assert result[where] is None
        result[where] = loaded.materials[index]
    return result


def face_normals(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return normalise(np.cross(b - a, c - a))


def volume(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return np.einsum("fi,fi->", a, np.cross(b, c)) / 6


def check(loaded):
    """Check what every loaded mesh and its materials must fulfil."""
    mesh = loaded.mesh
    assert len(mesh.faces) > 0
    assert np.isfinite(mesh.vertices).all()
    # Three squares, a sum, a root and a division round to less than 8 units of 2**-53.
    assert np.abs(np.linalg.norm(mesh.normals, axis=1) - 1).max() < 8 * 2**-53
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))
    assert mesh.faces.dtype == mesh.material.dtype == np.int64
    assert mesh.material.shape == (len(mesh.faces),)
    # Each material is used, and no two are equal except for the name.
    assert np.array_equal(np.unique(mesh.material), np.arange(len(loaded.materials)))
    assert len({replace(m, name="") for m in loaded.materials}) == len(loaded.materials)
    return loaded
