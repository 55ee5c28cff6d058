"""Textures of glTF files: images, samplers, transforms, coordinates, by values found by hand."""

import base64
import io
import math
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from blysk.sim.meshes.materials import FileMaterial
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.run_files import OutputIsInput, RunFiles

from .files import (
    TRIANGLE,
    check,
    check_refused,
    load,
    put,
)
from .looks import CHECKER, GREY, PLACES, at_vertices, png, textured, with_array


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


def coded(data):
    """A text with a code for each byte."""
    return "".join(f"%{byte:02X}" for byte in data)


IN_BASE64 = base64.b64encode(CHECKER).decode()


@pytest.mark.parametrize(
    "uri",
    [
        "data:image/png;base64," + coded(IN_BASE64.encode()),
        "data:image/png;base64," + IN_BASE64.rstrip("="),
        f"data:image/png;base64,{IN_BASE64[:20]}\n {IN_BASE64[20:]}",
        f"DATA:image/png;name=a;BASE64,{IN_BASE64}",
        "data:image/png," + coded(CHECKER),
    ],
)
def test_data_in_the_text_of_a_reference(tmp_path, uri):
    """As RFC 2397 allows, for an image and for a buffer."""
    loaded = check(load(tmp_path / "a.glb", textured(image={"uri": uri})))
    assert (loaded.ignored, loaded.materials[0].texture.size) == ((), (2, 2))
    document, buffer = textured()
    text = uri.partition(",")[2]
    whole = base64.b64encode(buffer).decode()
    of = {coded(IN_BASE64.encode()): coded(whole.encode()), coded(CHECKER): coded(buffer)}
    document["buffers"][0]["uri"] = uri.replace(text, of.get(text, whole))
    assert load(tmp_path / "a.gltf", (document, buffer)).mesh.vertices.tolist() == np.array(TRIANGLE).tolist()


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
    """A missing image is told, as for material files of OBJ. The part is drawn in its own colour."""
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
        ({"uri": "data:;base64,@@" + base64.b64encode(CHECKER).decode()}, "its image 0 is not base64"),
        ({"uri": "data:,"}, "its image 'number 0' is empty"),
        ({"bufferView": 9}, "it has an image in the view 9, counted from 0, but there are only 3"),
        ({"bufferView": -1}, "it has an image in the view -1, not a whole number of at least 0"),
    ],
    ids=range(10),
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
        (
            {"info": {"index": 1}},
            "it has a material with the texture 1, counted from 0, but there are only 1",
        ),
        ({"info": {"index": "0"}}, "it has a material with the texture 0, not a whole number of at least 0"),
        (
            {"info": {"texCoord": -1}},
            "it has a texture with the texCoord -1, not a whole number of at least 0",
        ),
        (
            {"texture": {"source": 3}},
            "it has a texture with the image 3, counted from 0, but there are only 1",
        ),
        (
            {"texture": {"sampler": 0}},
            "it has a texture with the sampler 0, counted from 0, but there are only 0",
        ),
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
        ({"magFilter": 9728}, (("repeat", "repeat"), "nearest", True), ()),
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


def test_materials_with_alpha_and_without_share_texels(tmp_path):
    """The bark and leaves of a tree are in the same image."""
    document, buffer = textured(image=png([[[255, 0, 0, 255], [0, 255, 0, 9]]]))
    document["materials"].append({**document["materials"][0], "alphaMode": "MASK"})
    first = document["meshes"][0]["primitives"][0]
    document["meshes"].append({"primitives": [{**first, "material": 1}]})
    document["nodes"].append({"mesh": 1, "translation": [5, 0, 0]})
    document["scenes"][0]["nodes"] = [0, 1]
    opaque, masked = (of.texture for of in check(load(tmp_path / "a.glb", (document, buffer))).materials)
    assert (opaque.alpha.size, masked.alpha.size) == (0, 2)
    assert opaque.texels is masked.texels


@pytest.mark.parametrize("mode", ["OPAQUE", "MASK", "BLEND"])
def test_alpha_of_an_image_is_told_where_it_counts(tmp_path, mode):
    image = png([[[255, 0, 0, 255], [0, 255, 0, 9]]])
    loaded = load(tmp_path / "a.glb", textured(image=image, material={"alphaMode": mode}))
    assert loaded.ignored == (("alpha of images: number 0",) if mode == "BLEND" else ())
    (material,) = loaded.materials
    assert (material.cutoff, material.alpha) == (0.5 if mode == "MASK" else None, 1)
    assert material.texture.alpha.tolist() == ([[1, 9 / 255]] if mode == "MASK" else [])


def test_alpha_of_an_image_is_resampled_in_its_own_light(tmp_path):
    """Three columns of alpha become four, as Pillow resamples an image with a linear channel."""
    codes = np.array([[10, 200, 90]])
    image = png(np.dstack([codes, codes, codes, codes]))
    loaded = load(tmp_path / "a.glb", textured(image=image, material={"alphaMode": "MASK"}))
    tiles = Image.fromarray(np.tile(codes / 255, 3).astype(np.float32))
    expected = np.asarray(tiles.resize((4, 1), Image.Resampling.BILINEAR, (3, 0, 6, 1)))
    np.testing.assert_allclose(loaded.materials[0].texture.alpha, expected, atol=1e-6)


@pytest.mark.parametrize("materials", [True, False])
def test_an_output_replaces_no_image(tmp_path, materials):
    path = put(tmp_path / "a.gltf", textured(image={"uri": "a%20b.png"}))
    (tmp_path / "a b.png").write_bytes(CHECKER)
    files = RunFiles()
    with files.active():
        load_mesh(path, materials=materials)
    with pytest.raises(OutputIsInput):
        files.writes(tmp_path / "a b.png")
