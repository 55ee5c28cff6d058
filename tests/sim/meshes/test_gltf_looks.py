"""Colours of vertices, emission and other looks of glTF files, by values found by hand."""

import math

import numpy as np
import pytest

from blysk.golden.reference.lighting import Material
from blysk.golden.reference.texture import Texture
from blysk.sim.meshes.materials import FileMaterial, surfaces
from blysk.sim.meshes.mesh import load_mesh

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
)
from .looks import GLOSSY, PLACES, at_vertices, textured, with_array

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
        loaded = load(tmp_path / "a.glb", content)
        assert (loaded.ignored, loaded.mesh.alpha.size) == (told, 0)


@pytest.mark.parametrize(("kind", "scale"), [("f4", 1), ("u1", 255), ("u2", 65535)])
def test_alpha_of_vertices_is_read_for_a_cutoff(tmp_path, kind, scale):
    """White is no colour, and its alpha still counts."""
    for color, colors in (([1, 0, 0], 3), ([1, 1, 1], 0)):
        content = material_gltf([base(1, 1, 1, 0.9, alphaMode="MASK", alphaCutoff=0.25)], [0])
        values = np.array([[*color, 1], [*color, 0.2], [*color, 0.4]]) * scale
        content = with_array(content, "COLOR_0", values, kind, normalized=kind != "f4")
        loaded = load(tmp_path / "a.glb", content)
        (material,) = loaded.materials
        assert (loaded.ignored, material.alpha, material.cutoff) == ((), 0.9, 0.25)
        np.testing.assert_allclose(
            at_vertices(loaded, loaded.mesh.alpha[:, None]), [[1], [0.2], [0.4]], atol=1e-7
        )
        assert len(loaded.mesh.colors) == colors


def test_a_cutoff_that_drops_nothing_is_left_out(tmp_path):
    content = material_gltf([base(1, 1, 1, 0.6, alphaMode="MASK")], [0])
    (material,) = load(tmp_path / "a.glb", content).materials
    assert (material.alpha, material.cutoff) == (1, None)
    content = material_gltf([base(1, 1, 1, 0.4, alphaMode="MASK")], [0])
    assert load(tmp_path / "a.glb", content).materials[0].cutoff == 0.5


@pytest.mark.parametrize(
    ("material", "reason"),
    [
        (
            base(1, 1, 1, 1, alphaMode="MASK", alphaCutoff=-0.1),
            "the alphaCutoff '-0.1', not a number of at least 0",
        ),
        (
            base(1, 1, 1, 1, alphaMode="MASK", alphaCutoff="a"),
            "the alphaCutoff 'a', not a number of at least 0",
        ),
        (base(1, 1, 1, 1, alphaMode="MASK", alphaCutoff=math.nan), "the alphaCutoff 'nan', not a number"),
        (
            base(1, 1, 1, 1.5, alphaMode="MASK"),
            "the alpha of baseColorFactor '1.5', not a number from 0 to 1",
        ),
    ],
)
def test_bad_cutoffs_are_refused(tmp_path, material, reason):
    check_refused(tmp_path / "a.glb", reason, content=material_gltf([material], [0]))


def test_a_bad_alpha_of_a_vertex_is_refused(tmp_path):
    content = material_gltf([base(1, 1, 1, 1, alphaMode="MASK")], [0])
    content = with_array(content, "COLOR_0", [[1, 0, 0, 1]] * 2 + [[1, 0, 0, math.nan]])
    reason = "a vertex has the colour '1 0 0 nan', not four numbers of at least 0"
    check_refused(tmp_path / "a.glb", reason, content=content)


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
            "a vertex has the colour 'nan 0 1', not three numbers of at least 0",
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
    # The texture is not made, only told.
    document["accessors"][-1]["count"] = 3 * 10**7
    told = ("COLOR_0 of another number than positions",)
    assert load(tmp_path / "a.glb", (document, buffer)).ignored == told
    document, buffer = mesh_gltf()
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 9
    reason = "it has a mesh with the accessor 9, counted from 0, but there are only 2"
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
    """A flat square of two triangles: normals are joined across the diagonal, and colours are not."""
    vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]]
    content = mesh_gltf(vertices=vertices, faces=range(6))
    colors = [RED, RED, GREEN, RED, BLUE, BLUE]
    loaded = check(load(tmp_path / "a.glb", with_array(content, "COLOR_0", colors)))
    mesh = loaded.mesh
    # At the corners of the diagonal, the red corners are one vertex, and the others are two.
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
    """Two nodes have a coloured mesh, which one of them mirrors.

    A further part has a material and no colours.
    """
    document, buffer = with_array(mesh_gltf(), "COLOR_0", [RED, GREEN, BLUE])
    plain = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    document["materials"] = [base(0, 0.5, 1, 1)]
    document["meshes"].append({"primitives": [plain]})
    document["nodes"] = [{"mesh": 0}, {"mesh": 0, "scale": [-1, 1, 1]}, {"mesh": 1, "translation": [5, 0, 0]}]
    document["scenes"][0]["nodes"] = [0, 1, 2]
    loaded = check(load(tmp_path / "a.glb", (document, buffer)))
    # It has its own material, because the other part has no colours.
    assert [of.colored for of in loaded.materials] == [True, False]
    assert loaded.materials[1].diffuse == (0, 0.5, 1)
    for corner, color in zip(loaded.mesh.vertices.tolist(), loaded.mesh.colors.tolist(), strict=True):
        by_place = {(0, 0): RED, (1, 0): GREEN, (-1, 0): GREEN, (0, 1): BLUE}
        assert tuple(color) == by_place.get(tuple(corner[:2]), (1, 1, 1))


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
        ({"emissiveFactor": [1, 1]}, "emissiveFactor '[1, 1]', not three numbers of at least 0"),
        ({"emissiveFactor": [1, 1, 10**400]}, "not three numbers of at least 0"),
        ({"emissiveFactor": [1, 1, -1]}, "emissiveFactor '[1, 1, -1]', not three numbers of at least 0"),
        (
            {"emissiveFactor": [1, 1, math.nan]},
            "emissiveFactor '[1, 1, nan]', not three numbers of at least 0",
        ),
        (
            {"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": "2"}}},
            "emissiveStrength '2', not a number of at least 0",
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
            "diffuseFactor '[1, 1, 1]', not four numbers from 0 to 1",
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
    """The factors are those of the extension. The other factors are for programs that do not know it."""
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
    # The effect of a texture on the factors is not known.
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


def test_extras_of_a_mesh_are_no_colours(tmp_path):
    document, buffer = mesh_gltf()
    document["meshes"][0]["extras"] = {"colors": [1], "coordinates": "x", "material": 9}
    loaded = load(tmp_path / "a.glb", (document, buffer))
    assert (loaded.materials, loaded.ignored) == ((FileMaterial(),), ())
