"""Files with features of real files, made by code: a name, the file, and the options to look at it.

A glTF file has the name of the Khronos sample whose features it has. No file of the samples is copied. For
files of other formats the sample says what they show.

Coordinates are under 1, and the largest is over 1/2. Then a scene has the same unit as its file.
"""

import io
import json
import math
import struct

import numpy as np
from PIL import Image

CODES = {"f4": 5126, "u1": 5121, "u2": 5123}
REPEAT, MIRROR, CLAMP = 10497, 33648, 33071
NEAREST, LINEAR = ({"magFilter": code, "minFilter": code} for code in (9728, 9729))
UNLIT, TRANSFORM = "KHR_materials_unlit", "KHR_texture_transform"
SQUARE = np.array([[-0.75, -0.75, 0], [0.75, -0.75, 0], [0.75, 0.75, 0], [-0.75, 0.75, 0]])
PLACES = np.array([[0.0, 1], [1, 1], [1, 0], [0, 0]])
"""Texture coordinates of the square, v down."""

BOX = np.array(np.meshgrid(*[[-0.6, 0.6]] * 3, indexing="ij")).reshape(3, 8).T
BOX_FACES = [
    *([4, 6, 7], [4, 7, 5], [0, 1, 3], [0, 3, 2], [2, 3, 7], [2, 7, 6]),
    *([0, 4, 5], [0, 5, 1], [1, 5, 7], [1, 7, 3], [0, 2, 6], [0, 6, 4]),
]


class File:
    """A document that grows, with one buffer."""

    def __init__(self):
        self.buffer = b""
        names = ("scenes", "nodes", "meshes", "materials", "textures", "samplers", "images")
        self.document = {name: [] for name in (*names, "accessors", "bufferViews")}
        self.document |= {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}

    def view(self, data, **more):
        """Add bytes; the number of their view."""
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data), **more}
        )
        self.buffer += data + bytes(-len(data) % 4)
        return len(self.document["bufferViews"]) - 1

    def array(self, values, kind="f4"):
        """Add vectors, each in whole words; whole numbers are normalised.

        The result is the number of their accessor.
        """
        values = np.asarray(values, "<" + kind)
        rows = [row.tobytes() + bytes(-row.nbytes % 4) for row in values]
        accessor = {
            "bufferView": self.view(b"".join(rows), byteStride=len(rows[0])),
            "componentType": CODES[kind],
            "count": len(values),
            "type": f"VEC{values.shape[1]}",
        }
        accessor |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        accessor |= {} if kind == "f4" else {"normalized": True}
        self.document["accessors"].append(accessor)
        return len(self.document["accessors"]) - 1

    def corners(self, faces):
        """Add indices; the number of their accessor."""
        data = np.asarray(faces, "<u2").reshape(-1)
        accessor = {"bufferView": self.view(data.tobytes()), "componentType": 5123}
        self.document["accessors"].append({**accessor, "count": len(data), "type": "SCALAR"})
        return len(self.document["accessors"]) - 1

    def material(self, image=None, sampler=None, info=None, unlit=True, kind="PNG", **factors):
        """Add a material, perhaps with a texture of an image of some kind; its number."""
        if image is not None:
            view = self.view(picture(image, kind))
            self.document["images"].append({"bufferView": view, "mimeType": f"image/{kind.lower()}"})
            number = len(self.document["images"]) - 1
            texture = {"source": number}
            if sampler:
                self.document["samplers"].append(sampler)
                texture["sampler"] = len(self.document["samplers"]) - 1
            self.document["textures"].append(texture)
            factors["baseColorTexture"] = {"index": number, **(info or {})}
        made = {"pbrMetallicRoughness": factors}
        self.document["materials"].append(made | ({"extensions": {UNLIT: {}}} if unlit else {}))
        return len(self.document["materials"]) - 1

    def part(self, material, attributes, faces, mode=4, **node):
        """Add a mesh of one part, and its node. Attributes are accessors."""
        primitive = {"attributes": attributes, "indices": self.corners(faces), "material": material}
        self.document["meshes"].append({"primitives": [{**primitive, "mode": mode}]})
        self.document["nodes"].append({"mesh": len(self.document["meshes"]) - 1, **node})
        self.document["scenes"][0]["nodes"].append(len(self.document["nodes"]) - 1)

    def square(self, material, places=PLACES, kind="f4", name="TEXCOORD_0", **node):
        """Add a square with texture coordinates."""
        attributes = {"POSITION": self.array(SQUARE), name: self.array(places, kind)}
        self.part(material, attributes, [0, 1, 2, 0, 2, 3], **node)

    def write(self, folder):
        """Write a GLB file; its path."""
        used = [UNLIT, TRANSFORM]
        document = {name: value for name, value in self.document.items() if value != []}
        document |= {"buffers": [{"byteLength": len(self.buffer)}]}
        document["extensionsUsed"] = [name for name in used if name in json.dumps(document)]
        if not document["extensionsUsed"]:
            del document["extensionsUsed"]
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<2I", len(self.buffer), 0x004E4942) + self.buffer
        path = folder / "sample.glb"
        path.write_bytes(struct.pack("<3I", 0x46546C67, 2, 12 + len(chunks)) + chunks)
        return path

    def for_vtk(self, folder):
        """Write the file without unlit materials and alpha modes, which `drawn` sets; its path.

        In some of its versions VTK's importer changes colours without light.
        """
        for material in self.document["materials"]:
            for name in ("extensions", "alphaMode", "alphaCutoff"):
                material.pop(name, None)
        return self.write(folder)


def picture(image, kind="PNG"):
    """Bytes of an image in some format."""
    data = io.BytesIO()
    Image.fromarray(np.asarray(image, np.uint8)).save(data, kind)
    return data.getvalue()


def noise(width=4, height=4, seed=1):
    """An image whose texels all differ."""
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3))


def vertex_colors(kind, channels):
    """A box with colours at its corners: BoxVertexColors.

    VTK keeps 8 bits of linear light. So dark colours are codes of VTK, and colours over 0.3 are random.
    """
    file = File()
    whole = {"f4": 1, "u1": 255, "u2": 65535}[kind]
    colors = np.random.default_rng(4).random((8, channels))
    colors = np.where(colors < 0.3, np.rint(colors * 255) / 255, colors) * whole
    colors[:, 3:] = whole
    attributes = {"POSITION": file.array(BOX), "COLOR_0": file.array(colors, kind)}
    file.part(file.material(), attributes, BOX_FACES)
    return file, {}


def texture_coordinates(kind):
    """Four corners of different colours, and a mark beside the upper left corner: TextureCoordinateTest."""
    image = np.full((8, 8, 3), 40)
    image[:4, :4], image[:4, 4:], image[4:, :4], image[4:, 4:] = (
        [255] * 3,
        (255, 0, 0),
        (0, 255, 0),
        (0, 0, 255),
    )
    image[1, 1:3] = 0
    file = File()
    file.square(file.material(image, NEAREST), PLACES * {"f4": 1, "u1": 255, "u2": 65535}[kind], kind)
    return file, NEAREST


def texture_settings(along, down, filter, width=4, height=8):
    """Coordinates from -1.2 to 2.3 with each wrap mode and filter: TextureSettingsTest."""
    sampler, file = {"wrapS": along, "wrapT": down, **filter}, File()
    file.square(file.material(noise(width, height), sampler), PLACES * 3.5 - 1.2)
    return file, sampler


def linear_interpolation():
    """Pairs of saturated colours: TextureLinearInterpolationTest. The middle of black and white is 188."""
    image = np.array(
        [[[0] * 3, [255] * 3], [[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]], [[0] * 3] * 2]
    )
    sampler, file = {**LINEAR, "wrapS": CLAMP, "wrapT": CLAMP}, File()
    file.square(file.material(image, sampler))
    return file, sampler


def negative_scale(two_sided):
    """Nodes that mirror, seen from in front and from behind, with back faces or without:
    NegativeScaleTest."""
    file = File()
    material = file.material(noise(2, 2), NEAREST)
    file.document["materials"][material]["doubleSided"] = two_sided
    scales = ([1, 1, 1], [-1, 1, 1], [1, -1, 1], [-1, -1, 1], [1, 1, -1], [-1, 1, -1], [-1, -1, -1])
    for number, scale in enumerate(scales):
        place = [0.48 * (number % 4) - 0.7, 0.35 - 0.6 * (number // 4), 0]
        file.square(material, scale=[0.28 * side for side in scale], translation=place)
    return file, {**NEAREST, "back_faces": "cull"}


def texture_transform(**values):
    """Offset, rotation and scale: TextureTransformTest."""
    file = File()
    file.square(file.material(noise(4, 4), NEAREST, {"extensions": {TRANSFORM: values}}))
    return file, NEAREST


def second_set():
    """The second set of coordinates: MultiUVTest."""
    file = File()
    attributes = {"POSITION": file.array(SQUARE), "TEXCOORD_0": file.array(0 * PLACES)}
    attributes["TEXCOORD_1"] = file.array(PLACES[:, ::-1] * 0.75)
    file.part(file.material(noise(), NEAREST, {"texCoord": 1}), attributes, [0, 1, 2, 0, 2, 3])
    return file, NEAREST


def factor_times_texture():
    """A factor, and a texture without sampler, which repeats: BoxTextured."""
    file = File()
    material = file.material(noise(), baseColorFactor=[0.5, 0.9, 0.25, 1])
    file.square(material, PLACES * 1.5, rotation=[0, 0, math.sin(0.2), math.cos(0.2)], scale=[0.8] * 3)
    return file, {}


def colors_times_texture():
    """Colours of vertices and a texture in one part: VertexColorTest."""
    file = File()
    attributes = {"POSITION": file.array(SQUARE), "TEXCOORD_0": file.array(PLACES)}
    attributes["COLOR_0"] = file.array([[1, 0.2, 0.2], [0.2, 1, 0.2], [0.2, 0.2, 1], [1, 1, 1]])
    file.part(file.material(noise(), LINEAR), attributes, [0, 1, 2, 0, 2, 3])
    return file, LINEAR


def single_texel():
    """An image of a texel, and a sampler without filters."""
    file = File()
    file.square(file.material([[[200, 90, 30]]], {"wrapS": CLAMP}))
    return file, {"wrapS": CLAMP}


def parts():
    """Four parts: with a factor, with a texture, with colours, and with colours and a texture.

    In VTK colours of vertices replace a factor. So no part has both.
    """
    file = File()
    textured, white = file.material(noise(), NEAREST), file.material()
    plain = file.material(baseColorFactor=[0.4, 0.8, 0.6, 1])
    colors = file.array([[1, 0.2, 0.2], [0.2, 1, 0.2], [0.2, 0.2, 1], [1, 1, 1]])
    for number, material in enumerate((plain, textured, white, textured)):
        attributes = {"POSITION": file.array(SQUARE), "TEXCOORD_0": file.array(PLACES)}
        attributes |= {"COLOR_0": colors} if number > 1 else {}
        place = [0.4 * (-1) ** number, 0.4 * (-1) ** (number // 2), 0]
        file.part(material, attributes, [0, 1, 2, 0, 2, 3], scale=[0.5] * 3, translation=place)
    return file, NEAREST


def unlit():
    """Orange and blue boxes without light, turned by nested nodes: UnlitTest, OrientationTest."""
    file = File()
    for color, place in (([1, 0.217637, 0, 1], -0.4), ([0, 0.217637, 1, 1], 0.4)):
        material = file.material(baseColorFactor=color)
        turn = [0.3, 0.2, 0.1, math.sqrt(1 - 0.14)]
        attributes = {"POSITION": file.array(BOX)}
        file.part(
            material, attributes, BOX_FACES, rotation=turn, scale=[0.4, 0.5, 0.6], translation=[place, 0, 0]
        )
    nodes, scene = file.document["nodes"], file.document["scenes"][0]
    nodes.append({"children": scene["nodes"], "rotation": [0, 0, 0.2, math.sqrt(0.96)]})
    scene["nodes"] = [len(nodes) - 1]
    return file, {}


def grey_ramp():
    """All codes of sRGB, each some pixels wide."""
    file = File()
    image = np.repeat(np.arange(256).reshape(16, 16, 1), 3, axis=2)
    file.square(file.material(image, NEAREST))
    return file, {**NEAREST, "view": "front"}


def primitive_modes():
    """A strip and a fan: MeshPrimitiveModes."""
    file = File()
    for mode, color, shift in ((5, [0.8, 0.1, 0.1, 1], -0.35), (6, [0.1, 0.1, 0.8, 1], 0.35)):
        turn = np.arange(7) * 0.8
        points = 0.4 * np.stack([np.cos(turn), np.sin(turn), 0.3 * turn], axis=1)
        if mode == 5:
            points = np.stack([0.2 * (np.arange(7) % 2), 0.2 * np.arange(7) - 0.6, 0 * turn], axis=1)
        attributes = {"POSITION": file.array(points)}
        node = {"mode": mode, "translation": [shift, 0, 0]}
        file.part(file.material(baseColorFactor=color), attributes, np.arange(7), **node)
    return file, {"back_faces": "cull"}


def plate(specular=None, node=None, **factors):
    """A bent plate with normals and a texture, with light: MetalRoughSpheres.

    In VTK a texture also multiplies highlights, as in our project for metals. So the other plate has no
    highlight. VTK gives normals unit length only in pixels, so a node scales all axes equally.
    """
    file = File()
    u, v = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9), indexing="ij")
    points = np.stack([0.75 * np.sin(2 * u - 1), 0.75 - 1.5 * v, 0.75 * np.cos(2 * u - 1)], axis=-1)
    normals = np.stack([np.sin(2 * u - 1), 0 * u, np.cos(2 * u - 1)], axis=-1)
    arrays = {"POSITION": points, "NORMAL": normals, "TEXCOORD_0": np.stack([u, v], axis=-1)}
    attributes = {name: file.array(values.reshape(81, -1)) for name, values in arrays.items()}
    at = np.arange(81).reshape(9, 9)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    faces = np.stack([a, b, c, a, c, d], axis=-1)
    material = file.material(noise(), LINEAR, unlit=False, **factors)
    file.part(material, attributes, faces, **(node or {}))
    look = {} if specular is None else {"specular": specular}
    return file, {**LINEAR, "lights": (0.3, 0.4, 1), "back_faces": "cull", **look}


def minified(step):
    """A power of two of texels to a pixel: a level of the image."""
    sampler, file = {"magFilter": 9729, "minFilter": 9985}, File()
    # Nine tenths of the picture's 96 lines show the square.
    file.square(file.material(noise(64, 64), sampler), PLACES * step * 0.9 * 96 / 64)
    return file, {**sampler, "view": "front"}


def jpeg_image():
    """An image that two decoders read: Duck."""
    file = File()
    file.square(file.material(noise(16, 16) // 4 + 90, LINEAR, kind="JPEG"))
    return file, LINEAR


def perspective():
    """A texture that is seen at a grazing angle: SimpleTexture."""
    file = File()
    file.square(file.material(noise(8, 8), NEAREST))
    return file, {**NEAREST, "view": (0.5, 1.2, 0.8), "projection": "perspective", "field_of_view": 70}


def holes(
    cutoff=None,
    filter=NEAREST,
    alpha=None,
    vertices=(255,) * 4,
    factor=1.0,
    mode="MASK",
    places=PLACES,
    look=(),
):
    """A sheet with holes, a plate behind it, and the background beside the plate: AlphaBlendModeTest.

    Alpha is the product of the image's, the corners' and the material's alpha. If no cutoff is given, it is
    1/2.
    """
    file = File()
    image = np.dstack([noise(*np.shape(alpha)[::-1], seed=2), alpha]) if alpha is not None else None
    sheet = file.material(image, filter if alpha is not None else None, baseColorFactor=[1, 1, 1, factor])
    file.document["materials"][sheet] |= {"alphaMode": mode}
    file.document["materials"][sheet] |= {} if cutoff is None else {"alphaCutoff": cutoff}
    colors = np.column_stack([[[255, 255, 200]] * 4, vertices])
    attributes = {"POSITION": file.array(SQUARE), "COLOR_0": file.array(colors, "u1")}
    if alpha is not None:
        attributes["TEXCOORD_0"] = file.array(places)
    file.part(sheet, attributes, [0, 1, 2, 0, 2, 3])
    plate = {"scale": [0.6, 0.6, 0.6], "translation": [0.15, 0.15, -0.4]}
    file.part(
        file.material(baseColorFactor=[0.1, 0.2, 0.9, 1]),
        {"POSITION": file.array(SQUARE)},
        [0, 1, 2, 0, 2, 3],
        **plate,
    )
    drops = (0.5 if cutoff is None else cutoff) if mode == "MASK" else 0.0
    return file, {**filter, "cutoff": drops, **dict(look)}


def reduced_holes():
    """An image of 2 x 2 texels to a pixel.

    In each group 3 texels, or 1, have an alpha of 1. So its level has 3/4 or 1/4.
    """
    dense = np.random.default_rng(6).random((16, 16)) < 0.6
    # Of each 2 x 2 texels the upper left is opaque, and two more where the image is dense.
    shown = np.kron(dense, np.ones((4, 4)))
    shown[::2, ::2] = 1
    shown[1::2, 1::2] = 0
    shown = 255 * shown
    places = PLACES * 2 * 0.9 * 96 / 64
    filter = {"magFilter": 9729, "minFilter": 9985}
    return holes(0.6, filter, shown, places=places, look={"view": "front"})


ALPHA = np.random.default_rng(3).integers(0, 256, (4, 4))
SAMPLES = {
    **{
        f"vertex colours, {kind} x {channels}": (vertex_colors, (kind, channels))
        for kind, channels in (("f4", 3), ("f4", 4), ("u1", 3), ("u1", 4), ("u2", 3), ("u2", 4))
    },
    **{f"texture coordinates, {kind}": (texture_coordinates, (kind,)) for kind in ("f4", "u1", "u2")},
    **{
        f"texture settings, {number}": (texture_settings, given)
        for number, given in enumerate(
            (
                *((REPEAT, MIRROR, NEAREST), (MIRROR, CLAMP, NEAREST), (CLAMP, REPEAT, NEAREST)),
                *((MIRROR, REPEAT, LINEAR), (CLAMP, MIRROR, LINEAR), (REPEAT, CLAMP, LINEAR)),
            )
        )
    },
    "a row of texels": (texture_settings, (MIRROR, MIRROR, LINEAR, 8, 1)),
    "linear interpolation": (linear_interpolation, ()),
    "negative scale": (negative_scale, (False,)),
    "negative scale, two-sided": (negative_scale, (True,)),
    "texture offset": (texture_transform, {"offset": [0.3, -0.6]}),
    "texture rotation": (texture_transform, {"rotation": 0.5}),
    "texture scale": (texture_transform, {"scale": [1.5, -2.5]}),
    "texture transform": (texture_transform, {"offset": [0.1, 0.2], "rotation": -0.4, "scale": [1.5, -2.5]}),
    "second set of coordinates": (second_set, ()),
    "factor times texture": (factor_times_texture, ()),
    "colours times texture": (colors_times_texture, ()),
    "single texel": (single_texel, ()),
    "parts": (parts, ()),
    "unlit": (unlit, ()),
    "grey ramp": (grey_ramp, ()),
    "strip and fan": (primitive_modes, ()),
    **{f"minified by {step}": (minified, (step,)) for step in (2, 4)},
    "JPEG": (jpeg_image, ()),
    "holes, nearest": (holes, {"alpha": ALPHA}),
    "holes, nearest, 0.75": (holes, {"cutoff": 0.75, "alpha": ALPHA}),
    "holes, bilinear": (holes, {"filter": LINEAR, "alpha": ALPHA}),
    "holes, bilinear, 0.3": (holes, {"cutoff": 0.3, "filter": LINEAR, "alpha": ALPHA}),
    "holes of vertices": (holes, {"vertices": (0, 255, 120, 200)}),
    "holes of vertices, 0.7": (holes, {"cutoff": 0.7, "vertices": (255, 20, 240, 130)}),
    "holes of a product": (
        holes,
        {"cutoff": 0.3, "filter": LINEAR, "alpha": ALPHA, "vertices": (255, 130, 240, 200), "factor": 0.8},
    ),
    "holes in perspective": (
        holes,
        {
            "alpha": ALPHA,
            "vertices": (255, 110, 140, 250),
            "look": {"view": (0.5, 1.2, 0.8), "projection": "perspective", "field_of_view": 70},
        },
    ),
    "holes, reduced": (reduced_holes, ()),
    "alpha without holes": (holes, {"alpha": ALPHA, "vertices": (0, 99, 9, 0), "mode": "OPAQUE"}),
    "perspective": (perspective, ()),
    "metal": (plate, {"metallicFactor": 1, "roughnessFactor": 0.75, "baseColorFactor": [0.9, 0.8, 0.7, 1]}),
    "matte": (plate, {"specular": 0, "metallicFactor": 0}),
    "matte, mirrored": (
        plate,
        {
            "specular": 0,
            "metallicFactor": 0,
            "node": {"scale": [-0.9, 0.9, 0.9], "rotation": [0, 0.28, 0, 0.96]},
        },
    ),
}
"""For each sample the function that makes it, and its arguments."""
