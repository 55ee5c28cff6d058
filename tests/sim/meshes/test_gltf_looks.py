"""Colours of vertices, textures, emission and other looks of glTF files, by values found by hand."""

import base64
import io
import math
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from blysk.golden.reference.lighting import Material
from blysk.golden.reference.texture import Texture
from blysk.sim.meshes.materials import FileMaterial, surfaces
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.run_files import OutputIsInput, RunFiles

from .files import (
    BLUE,
    GREEN,
    RED,
    TRIANGLE,
    base,
    check,
    check_refused,
    load,
    material_gltf,
    mesh_gltf,
    put,
)

CODES = {"f4": 5126, "u1": 5121, "u2": 5123, "i1": 5120, "i2": 5122, "u4": 5125}
PLACES = [[0.25, 0.5], [1, 0], [0, 1]]
GLOSSY = "KHR_materials_pbrSpecularGlossiness"


def png(rows):
    """An image of codes, shape (height, width, 3 or 4)."""
    file = io.BytesIO()
    Image.fromarray(np.array(rows, np.uint8)).save(file, "PNG")
    return file.getvalue()


# Red and mid grey over green and black.
CHECKER = png([[[255, 0, 0], [128, 128, 128]], [[0, 255, 0], [0, 0, 0]]])
GREY = ((128 / 255 + 0.055) / 1.055) ** 2.4


def with_array(content, name, values, kind="f4", **accessor):
    """A document, with an attribute for the vertices of its first mesh."""
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
    """A triangle with a texture, its image in the buffer."""
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


# Colours of vertices


@pytest.mark.parametrize(
    ("kind", "scale"), [("f4", 1), ("u1", 255), ("u2", 65535)], ids=["float", "byte", "short"]
)
@pytest.mark.parametrize("alpha", [[], [0.2]], ids=["RGB", "RGBA"])
def test_colours_are_linear(tmp_path, kind, scale, alpha):
    colors = [[1, 0, 0.2], [0, 0.4, 1], [1, 1, 1]]
    values = np.rint(np.array([[*color, *alpha] for color in colors]) * scale * 1e6) / 1e6
    content = with_array(mesh_gltf(), "COLOR_0", values, kind, normalized=kind != "f4")
    loaded = check(load(tmp_path / "a.glb", content))
    np.testing.assert_allclose(at_vertices(loaded, loaded.mesh.colors), colors, atol=1e-7)
    assert (loaded.ignored, loaded.materials) == ((), (FileMaterial(colored=True),))
    assert loaded.mesh.coordinates.shape == (0, 2)
    one = load_mesh(str(tmp_path / "a.glb"), materials=False)
    assert (one.ignored, one.materials, one.mesh.colors.shape) == ((), (FileMaterial(),), (0, 3))


def test_alpha_of_vertices_is_told_where_it_counts(tmp_path):
    for mode, told in (("OPAQUE", ()), ("BLEND", ("of materials: alpha (alphaMode BLEND)",))):
        content = material_gltf([base(1, 1, 1, 1, alphaMode=mode)], [0])
        content = with_array(content, "COLOR_0", [[1, 0, 0, 1]] * 2 + [[1, 0, 0, 0.5]])
        assert load(tmp_path / "a.glb", content).ignored == told


def test_colours_over_1_are_told(tmp_path):
    content = with_array(mesh_gltf(), "COLOR_0", [[2, 0, 0], [0, 1 + 1e-7, 0], [0, 0, 3]])
    loaded = load(tmp_path / "a.glb", content)
    assert at_vertices(loaded, loaded.mesh.colors) == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert loaded.ignored == ("2 vertex colours' parts over 1",)


@pytest.mark.parametrize(
    ("name", "values", "accessor", "reason"),
    [
        (
            "COLOR_0",
            [[math.nan, 0, 1]] * 3,
            {},
            "a vertex has the colour 'nan 0 1', not three numbers from 0",
        ),
        ("COLOR_0", [[math.inf, 0, 1]] * 3, {}, "a vertex has the colour 'inf 0 1'"),
        ("COLOR_0", [[0, -0.5, 1]] * 3, {}, "a vertex has the colour '0 -0.5 1'"),
        ("COLOR_0", [[0, 1]] * 3, {}, "its COLOR_0 is of the type VEC2, not VEC3 or VEC4"),
        ("COLOR_0", [[0, 0, 1]] * 3, {"kind": "u1"}, "its COLOR_0 has whole numbers that are not normalised"),
        (
            "COLOR_0",
            [[0, 0, 1]] * 3,
            {"kind": "i1", "normalized": True},
            "its COLOR_0 has the componentType 5120",
        ),
        ("COLOR_0", [[0, 0, 1]] * 3, {"kind": "u4"}, "its COLOR_0 has the componentType 5125"),
        (
            "TEXCOORD_0",
            [[0, math.nan]] * 3,
            {},
            "a vertex has the texture coordinates '0 nan', not numbers to",
        ),
        ("TEXCOORD_0", [[0, 1e30]] * 3, {}, "a vertex has the texture coordinates '0 1e+30', not numbers to"),
        ("TEXCOORD_0", [[0, 0, 0]] * 3, {}, "its TEXCOORD_0 is of the type VEC3, not VEC2"),
        ("TEXCOORD_0", [[0, 0]] * 3, {"kind": "u4"}, "its TEXCOORD_0 has the componentType 5125"),
    ],
)
def test_unusable_colours_and_coordinates(tmp_path, name, values, accessor, reason):
    content = textured(places=None)
    content = with_array(content, name, values, **accessor)
    remedy = "mend it, or shade the mesh with one material"
    check_refused(tmp_path / "a.glb", reason, remedy, content=content)
    assert load_mesh(str(tmp_path / "a.glb"), materials=False).ignored == ()


def test_colours_of_another_number_than_positions(tmp_path):
    content = with_array(mesh_gltf(), "COLOR_0", [[1, 0, 0]] * 2)
    loaded = load(tmp_path / "a.glb", content)
    assert loaded.ignored == ("COLOR_0 of another number than positions",)
    assert (len(loaded.mesh.colors), loaded.materials) == (0, (FileMaterial(),))
    document, buffer = with_array(mesh_gltf(), "COLOR_0", [[1, 0, 0]] * 3)
    del document["accessors"][-1]["bufferView"]
    check_refused(tmp_path / "a.glb", "its COLOR_0 has no data", content=(document, buffer))
    # It is not made, only to be left out.
    document["accessors"][-1]["count"] = 3 * 10**7
    told = ("COLOR_0 of another number than positions",)
    assert load(tmp_path / "a.glb", (document, buffer)).ignored == told
    document, buffer = mesh_gltf()
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 9
    reason = "it has a mesh with the accessor 9 (from 0), but there are 2"
    check_refused(tmp_path / "a.glb", reason, content=(document, buffer))


def test_unused_vertices_may_have_any_colour(tmp_path):
    content = mesh_gltf(vertices=[*TRIANGLE, [5, 5, 5]])
    content = with_array(content, "COLOR_0", [RED, GREEN, BLUE, [math.nan, 7, 7]])
    loaded = check(load(tmp_path / "a.glb", content))
    assert (at_vertices(loaded, loaded.mesh.colors), loaded.ignored) == (
        list(map(list, (RED, GREEN, BLUE))),
        (),
    )


def test_welded_corners_keep_their_colours(tmp_path):
    """A flat square of two triangles: normals are joined across the diagonal, colours are not."""
    vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]
    content = mesh_gltf(vertices=vertices, faces=range(6))
    colors = [RED, RED, GREEN, RED, BLUE, BLUE]
    loaded = check(load(tmp_path / "a.glb", with_array(content, "COLOR_0", colors)))
    mesh = loaded.mesh
    # Of the two corners of the diagonal, the red ones are one vertex, and the others are two.
    assert len(mesh.vertices) == 5
    found = {
        (*place, *color) for place, color in zip(mesh.vertices.tolist(), mesh.colors.tolist(), strict=True)
    }
    assert found == {(*place, *color) for place, color in zip(map(tuple, vertices), colors, strict=True)}
    assert {tuple(map(tuple, face)) for face in mesh.colors[mesh.faces].tolist()} == {
        (RED, RED, GREEN),
        (RED, BLUE, BLUE),
    }
    assert mesh.normals.tolist() == [[0, 0, 1]] * 5


def test_parts_without_colours_are_white(tmp_path):
    """Two nodes of a coloured mesh, mirrored at one, and a part with a material and no colours."""
    document, buffer = with_array(mesh_gltf(), "COLOR_0", [RED, GREEN, BLUE])
    plain = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    document["materials"] = [base(0, 0.5, 1, 1)]
    document["meshes"].append({"primitives": [plain]})
    document["nodes"] = [{"mesh": 0}, {"mesh": 0, "scale": [-1, 1, 1]}, {"mesh": 1, "translation": [5, 0, 0]}]
    document["scenes"][0]["nodes"] = [0, 1, 2]
    loaded = check(load(tmp_path / "a.glb", (document, buffer)))
    # A material of its own: the other has no colours.
    assert [of.colored for of in loaded.materials] == [True, False]
    assert loaded.materials[1].diffuse == (0, 0.5, 1)
    for corner, color in zip(loaded.mesh.vertices.tolist(), loaded.mesh.colors.tolist(), strict=True):
        by_place = {(0, 0): RED, (1, 0): GREEN, (-1, 0): GREEN, (0, 1): BLUE}
        assert tuple(color) == by_place.get(tuple(corner[:2]), (1, 1, 1))


# Textures


def test_texture_in_the_buffer(tmp_path):
    loaded = check(load(tmp_path / "a.glb", textured(baseColorFactor=[0.5, 1, 1, 1])))
    (material,) = loaded.materials
    assert loaded.ignored == ()
    assert material.diffuse == (0.5, 1, 1)
    texture = material.texture
    expected = [[[1, 0, 0], [GREY] * 3], [[0, 1, 0], [0, 0, 0]]]
    np.testing.assert_allclose(texture.texels, expected, atol=1e-12)
    assert (texture.wrap, texture.filter, texture.mipmapped) == (("repeat", "repeat"), "bilinear", True)
    assert at_vertices(loaded, loaded.mesh.coordinates) == PLACES
    assert len(loaded.mesh.colors) == 0


@pytest.mark.parametrize("kind", ["data", "file", "encoded name", "in a folder"])
@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_places_of_images(tmp_path, kind, suffix):
    names = {"file": "a.png", "encoded name": "a b#.png", "in a folder": "sub/ä.png"}
    uris = {
        "encoded name": "a%20b%23.png",
        "data": "data:image/png;base64," + base64.b64encode(CHECKER).decode(),
    }
    (tmp_path / "sub").mkdir()
    if kind in names:
        (tmp_path / names[kind]).write_bytes(CHECKER)
    uri = uris.get(kind, names.get(kind))
    loaded = check(load(tmp_path / f"a{suffix}", textured(image={"uri": uri})))
    assert loaded.ignored == ()
    assert loaded.materials[0].texture.texels[0, 0].tolist() == [1, 0, 0]


@pytest.mark.parametrize(
    ("uri", "told"),
    [
        ("no.png", "the image 'no.png', which does not exist"),
        ("../a.png", "the image '../a.png', outside its folder"),
        ("https://example.org/a.png", "the image 'https://example.org/a.png', outside its folder"),
        ("sub", "the image 'sub', which does not exist"),
    ],
)
def test_images_that_are_not_there_are_told(tmp_path, uri, told):
    """As material files of OBJ are; the part is drawn in its own colour."""
    (tmp_path / "a.png").write_bytes(CHECKER)
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    loaded = check(load(folder / "a.gltf", textured(image={"uri": uri}, baseColorFactor=[1, 0, 0, 1])))
    assert loaded.ignored == (told,)
    (material,) = loaded.materials
    assert (material.diffuse, material.texture) == ((1, 0, 0), None)
    assert len(loaded.mesh.coordinates) == 0


def test_a_part_without_coordinates_is_drawn_without_its_texture(tmp_path):
    loaded = check(load(tmp_path / "a.glb", textured(places=None)))
    assert loaded.ignored == ("1 texture of a part without coordinates",)
    assert (loaded.materials[0].texture, loaded.materials[0].diffuse) == (None, (1, 1, 1))
    # Another part of the material has them.
    document, buffer = textured()
    document["meshes"].append({"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]})
    document["nodes"].append({"mesh": 1, "translation": [5, 0, 0]})
    document["scenes"][0]["nodes"] = [0, 1]
    loaded = check(load(tmp_path / "a.glb", (document, buffer)))
    assert [of.texture is None for of in loaded.materials] == [True, False]
    assert loaded.mesh.coordinates[loaded.mesh.vertices[:, 0] > 4].tolist() == [[0, 0]] * 3


def huge_png(width, height):
    """An image of a few bytes with a large size in its header."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (CHECKER[:60], "its image 'number 0' is damaged"),
        (b"not an image", "its image 'number 0' is damaged"),
        (huge_png(100_000, 100_000), "its image 'number 0' has over 67,108,864 pixels"),
        ({}, "its image 0 has no data"),
        ({"uri": 5}, "its image 0 has the uri '5', not a text"),
        ({"uri": "data:;base64,A"}, "the text of its image 0 is not base64"),
        ({"uri": "data:,"}, "its image 'number 0' is empty"),
        ({"bufferView": 9}, "it has an image in the view 9 (from 0), but there are 3"),
        ({"bufferView": -1}, "it has an image in the view -1, not a whole number from 0"),
    ],
    ids=range(9),
)
def test_unusable_images(tmp_path, image, reason):
    check_refused(tmp_path / "a.glb", reason, "with one material", content=textured(image=image))
    assert load_mesh(str(tmp_path / "a.glb"), materials=False).materials == (FileMaterial(),)
    document, buffer = textured()
    document["images"] = 5
    check_refused(tmp_path / "a.glb", "its images are not a list of objects", content=(document, buffer))


TRANSFORM = "KHR_texture_transform"


def transform(**values):
    return {"extensions": {TRANSFORM: values}}


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ({"info": {"index": 1}}, "it has a material with the texture 1 (from 0), but there are 1"),
        ({"info": {"index": "0"}}, "it has a material with the texture 0, not a whole number from 0"),
        ({"info": {"texCoord": -1}}, "it has a texture with the texCoord -1, not a whole number from 0"),
        ({"texture": {"source": 3}}, "it has a texture with the image 3 (from 0), but there are 1"),
        ({"texture": {"sampler": 0}}, "it has a texture with the sampler 0 (from 0), but there are 0"),
        ({"sampler": {"wrapS": 9729}}, "a sampler has the wrapS '9729', not one of 10497, 33648, 33071"),
        ({"sampler": {"magFilter": 9987}}, "a sampler has the magFilter '9987', not one of 9728, 9729"),
        ({"sampler": {"minFilter": [1]}}, "a sampler has the minFilter '[1]', not one of 9728"),
        ({"info": transform(offset=[1])}, "a texture has the transform's offset '[1]', not 2 finite numbers"),
        ({"info": transform(scale=[1, math.inf])}, "the transform's scale '[1, inf]', not 2 finite numbers"),
        ({"info": transform(scale=[1, 10**400])}, "not 2 finite numbers"),
        (
            {"info": transform(rotation="1")},
            "a texture has the transform's rotation '1', not a finite number",
        ),
        ({"baseColorTexture": 0}, "a material has the baseColorTexture '0', not an object"),
    ],
)
def test_unusable_references_of_textures(tmp_path, parts, reason):
    check_refused(tmp_path / "a.glb", reason, "with one material", content=textured(**parts))


@pytest.mark.parametrize(
    ("sampler", "expected", "told"),
    [
        ({}, (("repeat", "repeat"), "bilinear", True), ()),
        ({"wrapS": 33648, "wrapT": 33071}, (("mirror", "clamp"), "bilinear", True), ()),
        ({"magFilter": 9728, "minFilter": 9728}, (("repeat", "repeat"), "nearest", False), ()),
        ({"minFilter": 9984}, (("repeat", "repeat"), "nearest", True), ()),
        ({"magFilter": 9729, "minFilter": 9729}, (("repeat", "repeat"), "bilinear", False), ()),
        ({"magFilter": 9729, "minFilter": 9987}, (("repeat", "repeat"), "bilinear", True), ()),
        (
            {"magFilter": 9728, "minFilter": 9987},
            (("repeat", "repeat"), "nearest", True),
            ("of samplers: minFilter of another kind than magFilter",),
        ),
        ({"wrapR": 1}, (("repeat", "repeat"), "bilinear", True), ("of samplers: wrapR",)),
    ],
)
def test_samplers(tmp_path, sampler, expected, told):
    loaded = load(tmp_path / "a.glb", textured(sampler=sampler))
    texture = loaded.materials[0].texture
    assert (texture.wrap, texture.filter, texture.mipmapped) == expected
    assert loaded.ignored == told


def test_transforms(tmp_path):
    """The example of the extension's text: the lower left quadrant of the image, turned."""
    quadrant = transform(offset=[0, 1], rotation=math.pi / 2, scale=[0.5, 0.5])
    loaded = load(tmp_path / "a.glb", textured(quadrant, places=[[0, 0], [1, 0], [0, 1]]))
    found = at_vertices(loaded, loaded.mesh.coordinates)
    np.testing.assert_allclose(found, [[0, 1], [0, 0.5], [0.5, 1]], atol=1e-12)
    # Scaled before it is turned.
    loaded = load(tmp_path / "a.glb", textured(transform(rotation=math.pi / 2, scale=[2, 3]), places=PLACES))
    np.testing.assert_allclose(at_vertices(loaded, loaded.mesh.coordinates)[0], [1.5, -0.5], atol=1e-12)
    assert loaded.ignored == ()


def test_sets_of_coordinates(tmp_path):
    other = np.array([[0, 1], [0.5, 0.25], [1, 0]])
    for info, expected in (
        ({"texCoord": 1}, other),
        ({"texCoord": 1, **transform(texCoord=0)}, PLACES),
        ({**transform(texCoord=1)}, other),
    ):
        content = with_array(textured(info), "TEXCOORD_1", other)
        loaded = load(tmp_path / "a.glb", content)
        assert at_vertices(loaded, loaded.mesh.coordinates) == np.array(expected).tolist()
    content = with_array(textured({"texCoord": 2}), "TEXCOORD_1", other)
    assert load(tmp_path / "a.glb", content).ignored == ("1 texture of a part without coordinates",)


@pytest.mark.parametrize(
    ("kind", "values", "normalized", "expected"),
    [
        ("u1", [[0, 255], [51, 0], [255, 255]], True, [[0, 1], [0.2, 0], [1, 1]]),
        ("u2", [[0, 65535], [13107, 0], [65535, 65535]], True, [[0, 1], [0.2, 0], [1, 1]]),
        ("i2", [[0, 2], [-3, 0], [1, 1]], False, [[0, 2], [-3, 0], [1, 1]]),
    ],
)
def test_coordinates_of_whole_numbers(tmp_path, kind, values, normalized, expected):
    content = with_array(textured(places=None), "TEXCOORD_0", values, kind, normalized=normalized)
    loaded = load(tmp_path / "a.glb", content)
    assert at_vertices(loaded, loaded.mesh.coordinates) == expected


def test_images_of_other_kinds(tmp_path):
    webp = io.BytesIO()
    Image.fromarray(np.zeros((2, 2, 3), np.uint8)).save(webp, "WEBP", lossless=True)
    document, buffer = textured(image=webp.getvalue())
    document["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
    loaded = load(tmp_path / "a.glb", (document, buffer))
    assert (loaded.ignored, loaded.materials[0].texture.texels.max()) == ((), 0)
    document["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    loaded = load(tmp_path / "a.glb", (document, buffer))
    assert (loaded.ignored, loaded.materials[0].texture) == (
        ("images of textures: KHR_texture_basisu",),
        None,
    )


def test_an_image_is_read_once(tmp_path):
    document, buffer = textured()
    document["materials"].append({**document["materials"][0], "doubleSided": True})
    first = document["meshes"][0]["primitives"][0]
    document["meshes"].append({"primitives": [{**first, "material": 1}]})
    document["nodes"].append({"mesh": 1, "translation": [5, 0, 0]})
    document["scenes"][0]["nodes"] = [0, 1]
    one, other = check(load(tmp_path / "a.glb", (document, buffer))).materials
    assert one.texture is other.texture is not None


@pytest.mark.parametrize("mode", ["OPAQUE", "MASK", "BLEND"])
def test_alpha_of_an_image_is_told_where_it_counts(tmp_path, mode):
    image = png([[[255, 0, 0, 255], [0, 255, 0, 9]]])
    loaded = load(tmp_path / "a.glb", textured(image=image, material={"alphaMode": mode}))
    assert loaded.ignored == (() if mode == "OPAQUE" else ("alpha of images: number 0",))


# Materials


@pytest.mark.parametrize(
    ("material", "emission", "told"),
    [
        ({"emissiveFactor": [0.5, 0, 1]}, (0.5, 0, 1), ()),
        ({"emissiveFactor": [0, 0, 0]}, None, ()),
        (
            {
                "emissiveFactor": [0.5, 0, 1],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}},
            },
            (1.5, 0, 3),
            (),
        ),
        (
            {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}},
            None,
            ("textures: emissiveTexture",),
        ),
    ],
)
def test_emission(tmp_path, material, emission, told):
    loaded = load(tmp_path / "a.glb", material_gltf([base(1, 0, 0, 1, **material)], [0]))
    assert (loaded.materials[0].emission, loaded.ignored) == (emission, told)


@pytest.mark.parametrize(
    ("material", "reason"),
    [
        ({"emissiveFactor": [1, 1]}, "emissiveFactor '[1, 1]', not three numbers from 0"),
        ({"emissiveFactor": [1, 1, 10**400]}, "not three numbers from 0"),
        ({"emissiveFactor": [1, 1, -1]}, "emissiveFactor '[1, 1, -1]', not three numbers from 0"),
        ({"emissiveFactor": [1, 1, math.nan]}, "emissiveFactor '[1, 1, nan]', not three numbers from 0"),
        (
            {"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": "2"}}},
            "emissiveStrength '2', not a number from 0",
        ),
        (
            {"extensions": {GLOSSY: {"specularFactor": [1, 1, 2]}}},
            "specularFactor '[1, 1, 2]', not three numbers from 0 to 1",
        ),
        (
            {"extensions": {GLOSSY: {"glossinessFactor": 2}}},
            "glossinessFactor '2', not a number from 0 to 1",
        ),
        (
            {"extensions": {GLOSSY: {"diffuseFactor": [1, 1, 1]}}},
            "diffuseFactor '[1, 1, 1]', not three numbers",
        ),
        ({"pbrMetallicRoughness": 5}, "has pbrMetallicRoughness '5', not an object"),
    ],
)
def test_unusable_factors(tmp_path, material, reason):
    content = material_gltf([base(1, 0, 0, 1, **material)], [0])
    check_refused(tmp_path / "a.glb", "material 'number 0'", reason, "with one material", content=content)


def test_unlit(tmp_path):
    extension = {"extensions": {"KHR_materials_unlit": {}}}
    loaded = load(tmp_path / "a.glb", textured(baseColorFactor=[0.5, 0, 1, 1], material=extension))
    (material,) = loaded.materials
    assert (material.unlit, material.diffuse, loaded.ignored) == (True, (0.5, 0, 1), ())
    (surface,) = surfaces(loaded.materials, Material(0.1, 0.5, 0.5, 10))
    assert (surface.unlit, surface.diffuse, surface.texture) == (True, (0.5, 0, 1), material.texture)


def test_specular_glossiness(tmp_path):
    """The factors of the extension; the others are for programs that do not know it."""
    factors = {"diffuseFactor": [0.5, 1, 0, 1], "specularFactor": [0.5, 0.25, 0], "glossinessFactor": 0.6}
    document, buffer = textured()
    glossy = {GLOSSY: {**factors, "diffuseTexture": {"index": 0}}}
    document["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 7}}, "extensions": glossy}
    ]
    loaded = check(load(tmp_path / "a.glb", (document, buffer)))
    (material,) = loaded.materials
    assert loaded.ignored == ()
    assert (material.diffuse, material.fresnel) == ((0.25, 0.5, 0), (0.5, 0.25, 0))
    assert material.roughness == pytest.approx(0.4)
    assert material.texture.texels[0, 0].tolist() == [1, 0, 0]
    # What a texture says of the factors is not known.
    glossy[GLOSSY]["specularGlossinessTexture"] = {"index": 0}
    loaded = load(tmp_path / "a.glb", (document, buffer))
    (material,) = loaded.materials
    assert (material.diffuse, material.fresnel) == ((0.5, 1, 0), None)
    assert loaded.ignored == ("textures: specularGlossinessTexture",)


@pytest.mark.parametrize(("metallic", "tinted"), [(0, False), (0.25, False), (0.5, True), (1, True)])
@pytest.mark.parametrize("kind", ["texture", "colours", "neither"])
def test_metals_take_colours_in_highlights(tmp_path, metallic, tinted, kind):
    content = textured(metallicFactor=metallic)
    if kind != "texture":
        content = material_gltf([{"pbrMetallicRoughness": {"metallicFactor": metallic}}], [0])
    if kind == "colours":
        content = with_array(content, "COLOR_0", [RED, GREEN, BLUE])
    loaded = load(tmp_path / "a.glb", content)
    (surface,) = surfaces(loaded.materials, Material(0.1, 0.5, 0.5, 10))
    assert surface.tinted == (tinted and kind != "neither")
    told = ("the exact highlights of colours that are partly metallic",)
    assert loaded.ignored == (told if 0 < metallic < 1 and kind != "neither" else ())


def test_surfaces_of_colours():
    texture = Texture(np.ones((1, 1, 3)))
    default = Material(0.3, (0.8, 0.4, 0.2), 0.5, 10)
    given = [
        FileMaterial("a", (0.5, 0.25, 0), texture=texture, emission=(0.5, 3, 0)),
        FileMaterial("b", texture=texture),
        FileMaterial("c", colored=True),
        FileMaterial("d"),
    ]
    made = surfaces(given, default)
    assert [of.diffuse for of in made] == [(0.5, 0.25, 0), (1, 1, 1), (1, 1, 1), (0.8, 0.4, 0.2)]
    assert [of.ambient for of in made] == [(0.05, 0.025, 0), (0.1,) * 3, (0.1,) * 3, (0.3,) * 3]
    assert [of.texture for of in made] == [texture, texture, None, None]
    assert [of.emission for of in made] == [(0.5, 1, 0), *[(0, 0, 0)] * 3]
    # An option replaces the factor.
    made = surfaces(given, default, {"diffuse"})
    assert [of.diffuse for of in made] == [(0.8, 0.4, 0.2)] * 4
    assert [of.texture for of in made] == [texture, texture, None, None]


def test_draco_compressed_colours_and_coordinates(tmp_path):
    draco = pytest.importorskip("DracoPy")
    colors = np.array([[255, 0, 0], [0, 51, 0], [0, 0, 102]], np.uint8)
    data = draco.encode(
        np.array(TRIANGLE, np.float32),
        faces=np.array([[0, 1, 2]], np.uint32),
        colors=colors,
        tex_coord=np.array(PLACES),
        preserve_order=True,
    )
    decoded = {each["attribute_type"]: each["unique_id"] for each in draco.decode(data).attributes}
    names = {"POSITION": decoded[0], "COLOR_0": decoded[2], "TEXCOORD_0": decoded[3]}
    document, buffer = textured(places=None)
    start = len(buffer)
    document["bufferViews"].append({"buffer": 0, "byteOffset": start, "byteLength": len(data)})
    document["accessors"] = [
        {"componentType": 5126, "count": 3, "type": "VEC3"},
        {"componentType": 5125, "count": 3, "type": "SCALAR"},
        {"componentType": 5121, "count": 3, "type": "VEC3", "normalized": True},
        {"componentType": 5126, "count": 3, "type": "VEC2"},
    ]
    extension = {"bufferView": len(document["bufferViews"]) - 1, "attributes": names}
    document["meshes"][0]["primitives"][0] |= {
        "attributes": {"POSITION": 0, "COLOR_0": 2, "TEXCOORD_0": 3},
        "extensions": {"KHR_draco_mesh_compression": extension},
    }
    document["buffers"][0]["byteLength"] = start + len(data)
    loaded = check(load(tmp_path / "a.glb", (document, buffer + data)))
    order = np.argsort(loaded.mesh.vertices @ [1, 2, 0])
    np.testing.assert_allclose(loaded.mesh.colors[order], colors / 255, atol=1e-9)
    np.testing.assert_allclose(loaded.mesh.coordinates[order], PLACES, atol=1e-3)


@pytest.mark.parametrize("materials", [True, False])
def test_an_output_replaces_no_image(tmp_path, materials):
    path = put(tmp_path / "a.gltf", textured(image={"uri": "a%20b.png"}))
    (tmp_path / "a b.png").write_bytes(CHECKER)
    files = RunFiles()
    with files.active():
        load_mesh(path, materials=materials)
    with pytest.raises(OutputIsInput):
        files.writes(tmp_path / "a b.png")


def test_extras_of_a_mesh_are_no_colours(tmp_path):
    document, buffer = mesh_gltf()
    document["meshes"][0]["extras"] = {"colors": [1], "coordinates": "x", "material": 9}
    loaded = load(tmp_path / "a.glb", (document, buffer))
    assert (loaded.materials, loaded.ignored) == ((FileMaterial(),), ())
