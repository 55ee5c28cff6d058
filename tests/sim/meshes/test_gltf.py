"""glTF as its specification has it: quantised arrays, instances, fans, extensions, and wrong indices."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from .files import check_refused, load

TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
FACES = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
SHAPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


def document_of(arrays, nodes=None, **extra):
    """A document of arrays, and their buffer. Rows have at least 4 bytes, as glTF demands."""
    views, accessors, buffer = [], [], b""
    for values, normalised in arrays:
        values = np.asarray(values)
        width = 1 if values.ndim == 1 else values.shape[1]
        step = values.dtype.itemsize * width
        stride = -(-step // 4) * 4 if width > 1 else step
        rows = np.zeros((len(values), stride), dtype=np.uint8)
        rows[:, :step] = np.ascontiguousarray(values).reshape(len(values), -1).view(np.uint8)
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": rows.size})
        if width > 1:
            views[-1]["byteStride"] = stride
        buffer += rows.tobytes() + bytes(-rows.size % 4)
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": COMPONENTS[values.dtype.str[1:]],
                "count": len(values),
                "type": SHAPES[width],
                **({"normalized": True} if normalised else {}),
            }
        )
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes or [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(buffer)}],
        **extra,
    }, buffer


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.glb"


PLAIN = (TETRAHEDRON.astype("<f4"), False), (FACES.ravel().astype("<u2"), False)


def plain(**extra):
    return document_of(PLAIN, **extra)


def corners(loaded):
    """Corners of the triangles in order, which do not depend on the numbers of the vertices."""
    return loaded.mesh.vertices[loaded.mesh.faces]


@pytest.mark.parametrize("kind", ["<i1", "<u1", "<i2", "<u2"])
@pytest.mark.parametrize("normalised", [False, True])
def test_quantised_positions(path, kind, normalised):
    """glTF 2.0, section 3.6.2.2: f = c / (2**bits - 1), for signed numbers max(c / (2**(bits-1) - 1), -1)."""
    limits = np.iinfo(kind)
    whole = np.where(TETRAHEDRON > 0, limits.max, limits.min).astype(kind)
    whole[0] //= 3
    document, buffer = document_of(
        [(whole, normalised), PLAIN[1]], extensionsRequired=["KHR_mesh_quantization"]
    )
    scale = limits.max if normalised else 1
    expected = [
        [max(int(c) / scale, -1.0) if normalised else float(c) for c in row] for row in whole.tolist()
    ]
    # Stored as float32 on the way.
    drawn = corners(load(path, (document, buffer)))
    np.testing.assert_allclose(drawn, np.array(expected)[FACES], rtol=2**-24)


@pytest.mark.parametrize("kind", ["<i1", "<i2"])
def test_quantised_normals(path, kind):
    """Rounding to whole numbers is no fault of a file. The direction is that of the numbers."""
    directions = TETRAHEDRON @ Rotation.from_rotvec([0.3, 0.2, 0.1]).as_matrix() / np.sqrt(3)
    whole = np.rint(directions * np.iinfo(kind).max).astype(kind)
    document, buffer = document_of([*PLAIN, (whole, True)], extensionsRequired=["KHR_mesh_quantization"])
    document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 2
    loaded = load(path, (document, buffer))
    assert loaded.repaired_normals == 0
    expected = whole / np.linalg.norm(whole, axis=1, keepdims=True)
    np.testing.assert_allclose(loaded.mesh.normals, expected, atol=2**-23)


def test_quantised_normals_that_are_no_unit_vectors_are_counted(path):
    whole = np.array([[127, 0, 0], [0, 60, 0], [0, 0, 0], [0, 0, -127]], "<i1")
    document, buffer = document_of([*PLAIN, (whole, True)])
    document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 2
    loaded = load(path, (document, buffer))
    assert loaded.repaired_normals == 2
    np.testing.assert_allclose(loaded.mesh.normals[[0, 1, 3]], [[1, 0, 0], [0, 1, 0], [0, 0, -1]])


@pytest.mark.parametrize("indexed", [False, True])
@pytest.mark.parametrize(
    ("mode", "expected"),
    [(5, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]), (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0]])],
    ids=["strip", "fan"],
)
def test_strips_and_fans(path, mode, expected, indexed):
    """The order of corners is that of glTF 2.0, section 3.7.2.1. trimesh leaves fans out."""
    points = np.array([[0, 0, 0], [1, 0, 0.1], [1, 1, 0.3], [0, 1, 0.4], [-1, 1, 0.9]])
    order = np.array([3, 1, 4, 0, 2]) if indexed else np.arange(5)
    document, buffer = document_of([(points.astype("<f4"), False), (order.astype("<u1"), False)])
    primitive = document["meshes"][0]["primitives"][0]
    primitive["mode"] = mode
    if not indexed:
        del primitive["indices"]
    loaded = load(path, (document, buffer))

    def rotated(triangles):
        return sorted(
            min(t[k:] + t[:k] for k in range(3)) for t in np.round(triangles.astype(float), 6).tolist()
        )

    assert rotated(corners(loaded)) == rotated(points.astype("<f4")[order[expected]])


def instances(**attributes):
    """A node of instances."""
    return {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}


@pytest.mark.parametrize("kind", ["<f4", "<i2", "<i1"])
def test_instances(path, kind):
    """Vertices by T R S, for each instance. SciPy makes the matrices."""
    turns = Rotation.from_rotvec([[0, 0, 0], [0, 0, 1.5], [2, 1, 0]])
    moves = np.array([[0, 0, 0], [5, 0, 0], [0, 7, 1]])
    sizes = np.array([[1, 1, 1], [1, 2, 3], [-1, 1, 1]])
    quaternions = turns.as_quat()
    if kind != "<f4":
        quaternions = np.rint(quaternions * np.iinfo(kind).max)
    stored = quaternions.astype(kind)
    document, buffer = document_of(
        [
            *PLAIN,
            (moves.astype("<f4"), False),
            (stored, kind != "<f4"),
            (sizes.astype("<f4"), False),
        ],
        nodes=[{"translation": [10, 0, 0], **instances(TRANSLATION=2, ROTATION=3, SCALE=4)}],
        extensionsRequired=["EXT_mesh_gpu_instancing"],
    )
    drawn = corners(load(path, (document, buffer)))
    expected = []
    for turn, move, size in zip(Rotation.from_quat(stored.astype(float)), moves, sizes, strict=True):
        places = turn.apply(TETRAHEDRON * size) + move + [10, 0, 0]
        mirrored = size.prod() < 0
        expected += [places[face[::-1] if mirrored else face] for face in FACES]

    def order(triangles):
        return np.array(sorted(np.round(triangles, 4).tolist()))

    np.testing.assert_allclose(order(drawn), order(expected), atol=2e-4)


@pytest.mark.parametrize(
    ("attributes", "reason"),
    [
        ({}, "no count of instances"),
        ({"TRANSLATION": -1}, "not a whole number of at least 0"),
        ({"TRANSLATION": 9}, "there are only 2"),
        ({"TRANSLATION": 1}, "not 3 finite numbers"),
    ],
)
def test_bad_instances(path, attributes, reason):
    check_refused(path, reason, content=plain(nodes=[instances(**attributes)]))


@pytest.mark.parametrize("name", ["EXT_unheard_of", "KHR_meshopt_compression", "EXT_meshopt_compression"])
def test_required_extensions_that_are_unknown(path, name):
    reason = f"it needs the extension {name}, which is not supported; export it without"
    check_refused(path, reason, content=plain(extensionsRequired=[name]))
    load(path, plain(extensionsUsed=["EXT_unheard_of"]))


@pytest.mark.parametrize(
    "name", ["KHR_materials_unlit", "KHR_texture_transform", "EXT_texture_webp", "KHR_lights_punctual"]
)
def test_required_extensions_that_are_no_geometry(path, name):
    assert len(load(path, plain(extensionsRequired=[name])).mesh.faces) == 4


def test_morph_weights_and_skins_are_told(path):
    nodes = [{"mesh": 0, "skin": 0}, {"mesh": 0, "weights": [0, 0.5]}, {"mesh": 1}]
    document, buffer = plain(nodes=[{"children": [1, 2, 3]}, *nodes], skins=[{"joints": [0]}])
    document["meshes"].append(json.loads(json.dumps(document["meshes"][0])))
    document["meshes"][1]["weights"] = [0.0, 0.0]
    assert load(path, (document, buffer)).ignored == ("1 mesh with morph weights", "1 skin")
    document["meshes"][1]["weights"] = [1.0, 0.0]
    assert load(path, (document, buffer)).ignored[0] == "2 meshes with morph weights"


NEGATIVE = {
    "accessor": lambda d: d["meshes"][0]["primitives"][0]["attributes"].update(POSITION=-2),
    "indices": lambda d: d["meshes"][0]["primitives"][0].update(indices=-1),
    "mesh": lambda d: d["nodes"][0].update(mesh=-1),
    "view": lambda d: d["accessors"][0].update(bufferView=-2),
    "buffer": lambda d: d["bufferViews"][0].update(buffer=-1),
    "offset": lambda d: d["accessors"][0].update(byteOffset=-4),
    "view's offset": lambda d: d["bufferViews"][1].update(byteOffset=-4),
    "length": lambda d: d["bufferViews"][0].update(byteLength=-1),
    "count": lambda d: d["accessors"][0].update(count=-1),
    "scene": lambda d: d.update(scene=-1),
    "mode": lambda d: d["meshes"][0]["primitives"][0].update(mode=-1),
    "not a number": lambda d: d["nodes"][0].update(mesh="0"),
}


@pytest.mark.parametrize("change", NEGATIVE.values(), ids=NEGATIVE)
def test_negative_numbers(path, change):
    document, buffer = plain()
    change(document)
    check_refused(path, "not a whole number of at least 0", content=(document, buffer))


@pytest.mark.parametrize("kind", ["<i1", "<i2", "<f4"])
def test_indices_of_a_wrong_type(path, kind):
    content = document_of([PLAIN[0], (FACES.ravel().astype(kind), False)])
    check_refused(path, "its indices are not unsigned whole numbers", content=content)


def test_quantised_array_that_is_too_long_for_its_view(path):
    document, buffer = document_of([(TETRAHEDRON.astype("<i1"), True), PLAIN[1]])
    document["accessors"][0]["count"] = 5
    check_refused(path, "does not fit into its view", content=(document, buffer))


def test_draco(path):
    """With the decoder, vertices are within its quantisation to 14 bits."""
    pytest.importorskip("DracoPy")
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(TETRAHEDRON, FACES, process=False)
    data = mesh.scene().export(file_type="glb", extension_draco=True)
    assert b"KHR_draco_mesh_compression" in data
    loaded = load(path, data)
    assert len(loaded.mesh.faces) == 4
    np.testing.assert_allclose(np.sort(np.abs(loaded.mesh.vertices).ravel()), 1, atol=2**-12)
