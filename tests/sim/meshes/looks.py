"""glTF files with images and colours, for tests."""

import io

import numpy as np
from PIL import Image

from .files import (
    TRIANGLE,
    material_gltf,
)

CODES = {"f4": 5126, "u1": 5121, "u2": 5123, "i1": 5120, "i2": 5122, "u4": 5125}
PLACES = [[0.25, 0.5], [1, 0], [0, 1]]
GLOSSY = "KHR_materials_pbrSpecularGlossiness"


def png(rows):
    """An image of codes, shape (height, width, 3 or 4)."""
    file = io.BytesIO()
    Image.fromarray(np.array(rows, np.uint8)).save(file, "PNG")
    return file.getvalue()


# Red and mid grey are above green and black.
CHECKER = png([[[255, 0, 0], [128, 128, 128]], [[0, 255, 0], [0, 0, 0]]])
GREY = ((128 / 255 + 0.055) / 1.055) ** 2.4


def with_array(content, name, values, kind="f4", **accessor):
    """A document, with a further attribute for the vertices of its first mesh."""
    document, buffer = content
    values = np.asarray(values, "<" + kind)
    buffer += bytes(-len(buffer) % 4)
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(buffer), "byteLength": values.nbytes})
    accessor = {"componentType": CODES[kind], "count": len(values), **accessor}
    accessor.setdefault("type", f"VEC{values.shape[1]}")
    document["accessors"].append({"bufferView": len(document["bufferViews"]) - 1, **accessor})
    buffer += values.tobytes()
    document["buffers"][0]["byteLength"] = len(buffer)
    for mesh in document["meshes"]:
        mesh["primitives"][0]["attributes"][name] = len(document["accessors"]) - 1
    return document, buffer


def textured(info=None, image=CHECKER, places=PLACES, texture=None, sampler=None, material=None, **factors):
    """A triangle with a texture, whose image is in the buffer."""
    material = material or {}
    factors = {"metallicFactor": 0, "baseColorTexture": {"index": 0, **(info or {})}, **factors}
    content = material_gltf([{"pbrMetallicRoughness": factors, **material}], [0])
    if places is not None:
        content = with_array(content, "TEXCOORD_0", places)
    document, buffer = content
    document["textures"] = [{"source": 0, **({} if sampler is None else {"sampler": 0}), **(texture or {})}]
    if sampler is not None:
        document["samplers"] = [sampler]
    document["images"] = [image]
    if isinstance(image, bytes):
        document["images"] = [{"bufferView": len(document["bufferViews"]), "mimeType": "image/png"}]
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(image)})
        buffer += image + bytes(-len(image) % 4)
        document["buffers"][0]["byteLength"] = len(buffer)
    return document, buffer


def at_vertices(loaded, values):
    """Values of the mesh's vertices in the order of `TRIANGLE`."""
    order = [loaded.mesh.vertices.tolist().index(corner) for corner in np.array(TRIANGLE, float).tolist()]
    return values[order].tolist()
