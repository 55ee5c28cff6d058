"""Contents of glTF files: read, told or refused by name; versions, scenes, sparse arrays, compressed
views."""

import numpy as np
import pytest

from .files import TRIANGLE, base, check, check_refused, glb, load, material_gltf, mesh_gltf


def changed(change, **extra):
    document, buffer = mesh_gltf(**extra)
    change(document)
    return document, buffer


def primitive(document):
    return document["meshes"][0]["primitives"][0]


MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")


def compress(name, uri=None, required=False):
    def change(document):
        document["bufferViews"][0]["extensions"] = {name: {"buffer": 1, "byteLength": 4, "count": 3}}
        document["buffers"].append({"byteLength": 4, "uri": "data:;base64,AAAAAA=="})
        document["buffers"][0]["extensions"] = {name: {"fallback": True}}
        document["extensionsUsed"] = [name]
        if required:
            document["extensionsRequired"] = [name]

    return change


@pytest.mark.parametrize("name", MESHOPT)
def test_plain_data_beside_compressed_data_is_drawn(tmp_path, name):
    document, buffer = changed(compress(name))
    assert np.array_equal(load(tmp_path / "a.gltf", (document, buffer)).mesh.vertices, TRIANGLE)
    reason = f"it needs the extension {name}, which is not supported"
    check_refused(tmp_path / "b.gltf", reason, content=changed(compress(name, required=True)))
    # This fallback does not exist.
    document, _ = changed(compress(name))
    document["buffers"].reverse()
    document["buffers"][1]["uri"] = None
    for view in document["bufferViews"]:
        view["buffer"] = 1
    reason = f"it is compressed with {name}, for which there is no decoder; export it uncompressed"
    check_refused(tmp_path / "c.gltf", reason, content=(document, b""))


@pytest.mark.parametrize("version", ["1.0", "1.1", "0.8", 1.0, "3.0", None])
@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_other_versions_are_named(tmp_path, version, suffix):
    document, buffer = mesh_gltf()
    document["asset"] = {} if version is None else {"version": version}
    if version is None:
        document["buffers"] = {"a": document["buffers"][0]}
        version = "1.0"
        if suffix == ".gltf":
            document["buffers"] = [{"uri": "data:,"}]
            document["meshes"] = {"a": document["meshes"][0]}
    data = glb(document, buffer) if suffix == ".glb" else (document, buffer)
    check_refused(tmp_path / f"a{suffix}", f"it has glTF version {version}", content=data)


def test_versions_that_are_read(tmp_path):
    for asset in ({"version": "2.0"}, {"version": "2.1"}, {"version": "2.0", "minVersion": "2.0"}, {}):
        assert load(tmp_path / "a.glb", changed(lambda d, a=asset: d.update(asset=a))).ignored == ()
    content = changed(lambda d: d.update(asset={"version": "2.1", "minVersion": "2.1"}))
    check_refused(tmp_path / "a.glb", "it has glTF version 2.1", content=content)
    data = bytearray(glb(*mesh_gltf()))
    data[4] = 1
    check_refused(tmp_path / "a.glb", "it has glTF version 1.0", content=bytes(data))


@pytest.mark.parametrize("scenes", [None, []])
@pytest.mark.parametrize(
    "nodes", [[{"mesh": 0, "translation": [5, 0, 0]}], [{"children": [1]}, {"mesh": 0}], []]
)
def test_without_scenes_the_roots_are_drawn(tmp_path, scenes, nodes):
    document, buffer = mesh_gltf()
    del document["scene"], document["scenes"]
    document |= {"nodes": nodes} | ({} if scenes is None else {"scenes": scenes})
    mesh = load(tmp_path / "a.glb", (document, buffer)).mesh
    move = 5 * ("translation" in str(nodes))
    assert np.array_equal(mesh.vertices[mesh.faces], [np.add(TRIANGLE, [move, 0, 0])])


def test_nodes_that_are_not_visible_are_left_out(tmp_path):
    def shown(visible):
        return {"extensions": {"KHR_node_visibility": {"visible": visible}}}

    nodes = [
        {"children": [1, 2, 4]},
        {"mesh": 0, **shown(True)},
        {"mesh": 0, "translation": [5, 0, 0], "children": [3], **shown(False)},
        {"mesh": 0, **shown(True)},
        {"mesh": 0, "translation": [7, 0, 0]},
    ]
    document = mesh_gltf(nodes=nodes, extensionsRequired=["KHR_node_visibility"])
    loaded = load(tmp_path / "a.glb", document)
    assert sorted(loaded.mesh.vertices[:, 0]) == [0, 0, 1, 7, 7, 8]
    assert loaded.ignored == ()


def with_node(**parts):
    return lambda document: document["nodes"][0].update(parts)


def with_part(**parts):
    return lambda document: primitive(document).update(parts)


GLTF_TOLD = {
    "extras": (lambda d: d.update(extras={"extensions": {"A_b": {}}}, extensionsUsed=["A_b"]), ()),
    "camera": (with_node(camera=0), ("a damaged camera",)),
    "light": (
        with_node(extensions={"KHR_lights_punctual": {"light": 0}}),
        ("1 damaged light",),
    ),
    "animation": (lambda d: d.update(animations=[{}, {}]), ("2 animations",)),
    "skin": (lambda d: (with_node(skin=0)(d), d.update(skins=[{"joints": [0]}])), ("1 skin",)),
    "morph": (lambda d: d["meshes"][0].update(weights=[1]), ("1 mesh with morph weights",)),
    "morph of 0": (lambda d: (with_part(targets=[{"POSITION": 0}])(d), with_node(weights=[0])(d)), ()),
    "colours": (lambda d: primitive(d)["attributes"].update(COLOR_1=0), ("attributes: COLOR_1",)),
    "tangents": (
        lambda d: primitive(d)["attributes"].update(TANGENT=0, TEXCOORD_1=0, _OWN=0, JOINTS_0=0),
        (),
    ),
    "attribute": (lambda d: primitive(d)["attributes"].update(Normal=0), ("attributes: Normal",)),
    "points": (lambda d: d["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 0}), 1),
    "lines": (
        lambda d: d["meshes"][0]["primitives"].insert(0, {"attributes": {"POSITION": 0}, "mode": 2}),
        1,
    ),
    "no positions": (
        lambda d: d["meshes"][0]["primitives"].append({"attributes": {"NORMAL": 0}}),
        ("1 part without positions",),
    ),
    "extension of a scene": (
        lambda d: d["scenes"][0].update(extensions={"EXT_lights_image_based": {"light": 0}}),
        ("extensions: EXT_lights_image_based",),
    ),
    "extension of a part": (
        with_part(extensions={"FOO_bar": {"extensions": {"FOO_nested": {}}}}),
        ("extensions: FOO_bar, FOO_nested",),
    ),
    "extension of an accessor": (
        lambda d: d["accessors"][0].update(extensions={"FOO_bar": {}}),
        ("extensions: FOO_bar",),
    ),
    "node's key": (with_node(visible=False), ("of nodes: visible",)),
    "document's key": (lambda d: d.update(Materials=[]), ("of document: Materials",)),
    "part's key": (with_part(Material=0), ("of primitives: Material",)),
    "unused broken accessor": (
        lambda d: d["accessors"].append({"componentType": 1, "count": 9, "type": "X"}),
        (),
    ),
}


@pytest.mark.parametrize("name", GLTF_TOLD)
def test_gltf_contents_that_are_not_read(tmp_path, name):
    change, told = GLTF_TOLD[name]
    loaded = check(load(tmp_path / "a.glb", changed(change)))
    told = ("1 part of points or lines",) if told == 1 else told
    assert (loaded.ignored, loaded.mesh.vertices.tolist()) == (told, TRIANGLE)


def test_odd_counts_of_corners(tmp_path):
    content = mesh_gltf(faces=[0, 1, 2, 0])
    check_refused(
        tmp_path / "a.glb", "a part of triangles has 4 corners, not a multiple of 3", content=content
    )
    document, buffer = mesh_gltf()
    empty = {**document["accessors"][1], "count": 0}
    document["accessors"].append(empty)
    document["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "indices": 2})
    assert len(load(tmp_path / "a.glb", (document, buffer)).mesh.faces) == 1


def test_bytes_after_the_end(tmp_path):
    assert load(tmp_path / "a.glb", glb(*mesh_gltf()) + b"\n").ignored == ("1 byte after its end",)


def test_several_scenes(tmp_path):
    document, buffer = mesh_gltf(nodes=[{"mesh": 0}, {"mesh": 0}])
    document["scenes"].append({"nodes": [1]})
    assert load(tmp_path / "a.glb", (document, buffer)).ignored == ()
    del document["scene"]
    assert load(tmp_path / "a.glb", (document, buffer)).ignored == ("1 scene after the first",)


def extended(name, **values):
    return {"extensions": {name: values}}


MATERIAL_TOLD = [
    (base(1, 0, 0, 0.5), ()),
    (base(1, 0, 0, 0.5, alphaMode="BLEND"), "alpha (alphaMode BLEND)"),
    (base(1, 0, 0, 1, alphaMode="BLEND"), ()),
    (base(1, 0, 0, 0.6, alphaMode="MASK"), ()),
    (base(1, 0, 0, 0.6, alphaMode="MASK", alphaCutoff=0.7), ()),
    (base(1, 0, 0, 1, emissiveFactor=[0, 0, 0]), ()),
    (base(1, 0, 0, 1, emissiveFactor=[1, 0, 0]), ()),
    (base(1, 0, 0, 1, **extended("KHR_materials_unlit")), ()),
    (
        base(1, 0, 0, 1, **extended("KHR_materials_pbrSpecularGlossiness", diffuse=[1, 0, 0, 1])),
        "diffuse",
    ),
    (
        base(1, 0, 0, 1, extensions={"KHR_materials_clearcoat": {}, "KHR_materials_sheen": {}}),
        "KHR_materials_clearcoat, KHR_materials_sheen",
    ),
    (base(1, 0, 0, 1, **extended("KHR_materials_variants")), ()),
    (base(1, 0, 0, 1, extras={"emission": 1}), ()),
    (base(1, 0, 0, 1, emission=[1, 0, 0], DoubleSided=True), "emission, DoubleSided"),
]


@pytest.mark.parametrize(("material", "told"), MATERIAL_TOLD, ids=range(len(MATERIAL_TOLD)))
def test_gltf_materials_that_are_not_read_whole(tmp_path, material, told):
    used = list(material.get("extensions", ()))
    document, buffer = material_gltf([material], [0])
    document["extensionsRequired"] = used
    loaded = load(tmp_path / "a.glb", (document, buffer))
    assert loaded.ignored == ((f"of materials: {told}",) if told else ())
    # This belongs to no face.
    document, buffer = material_gltf([material, base(0, 0, 1, 1)], [1])
    assert load(tmp_path / "a.glb", (document, buffer)).ignored == ()


def test_textures_that_are_not_read_are_named(tmp_path):
    material = base(1, 0, 0, 1, **extended("KHR_materials_sheen", sheenColorTexture={}))
    material |= {"normalTexture": {"index": 0, **extended("KHR_texture_transform")}, "occlusionTexture": {}}
    told = (
        "textures: normalTexture, occlusionTexture, sheenColorTexture",
        "of materials: KHR_materials_sheen",
    )
    assert load(tmp_path / "a.glb", material_gltf([material], [0])).ignored == told


@pytest.mark.parametrize("name", ["FOO_materials_bar", "KHR_materials_unknown", "KHR_gaussian_splatting"])
def test_required_extensions_are_known_by_name(tmp_path, name):
    content = mesh_gltf(extensionsRequired=[name])
    check_refused(
        tmp_path / "a.glb", f"it needs the extension {name}, which is not supported", content=content
    )


@pytest.mark.parametrize("base_view", [True, False])
@pytest.mark.parametrize("kind", [5121, 5123, 5125])
def test_sparse_positions(tmp_path, base_view, kind):
    """glTF 2.0, section 3.6.2.3: a few elements replace those of the view, or zeros."""
    document, buffer = mesh_gltf()
    places = np.array([1, 2], {5121: "u1", 5123: "<u2", 5125: "<u4"}[kind]).tobytes()
    values = np.array([[3, 0, 0], [0, 4, 0]], "<f4").tobytes()
    start = len(buffer)
    document["bufferViews"] += [
        {"buffer": 0, "byteOffset": start, "byteLength": len(places)},
        {"buffer": 0, "byteOffset": start + 8, "byteLength": len(values)},
    ]
    buffer += places.ljust(8, b"\0") + values
    document["buffers"][0]["byteLength"] = len(buffer)
    sparse = {"count": 2, "indices": {"bufferView": 2, "componentType": kind}, "values": {"bufferView": 3}}
    document["accessors"][0]["sparse"] = sparse
    if not base_view:
        del document["accessors"][0]["bufferView"]
    mesh = load(tmp_path / "a.glb", (document, buffer)).mesh
    assert mesh.vertices.tolist() == [[0, 0, 0], [3, 0, 0], [0, 4, 0]]
    sparse["count"] = 4
    check_refused(tmp_path / "a.glb", "the count of a sparse array", content=(document, buffer))
    # By the bits of the number.
    sparse |= {"count": 1, "indices": {"bufferView": 3, "componentType": 5125}}
    check_refused(tmp_path / "a.glb", "a sparse array has an element over 2", content=(document, buffer))


def test_normals_of_another_number_than_positions(tmp_path):
    loaded = load(tmp_path / "a.glb", mesh_gltf(normals=[[1, 0, 0]] * 2))
    assert loaded.ignored == ("normals of another number than positions",)
    assert loaded.mesh.normals.tolist() == [[0, 0, 1]] * 3


# Normals against the winding


@pytest.mark.parametrize(("faces", "count"), [((0, 1, 2), 0), ((2, 1, 0), 1)])
@pytest.mark.parametrize("mirror", [1, -1])
def test_normals_against_the_winding_are_counted(tmp_path, faces, count, mirror):
    nodes = [{"mesh": 0, "scale": [mirror, 1, 1]}]
    loaded = load(tmp_path / "a.glb", mesh_gltf(faces=faces, normals=[[0, 0, 1]] * 3, nodes=nodes))
    assert loaded.opposed_faces == count
    assert load(tmp_path / "a.glb", mesh_gltf(faces=faces)).opposed_faces == 0
