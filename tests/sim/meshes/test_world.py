"""Files that other programs wrote: triangles against a reader of a few lines each, and pictures."""

import base64
import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest

from blysk import scene
from blysk.golden.reference.renderer import render
from blysk.sim.errors import InputError
from blysk.sim.meshes.mesh import load_mesh

WORLD = Path(__file__).parent / "world"
FILES = sorted(path.name for path in WORLD.iterdir() if path.suffix != ".md")
PLY_TYPES = {"char": "i1", "uchar": "u1", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"}
PLY_TYPES |= {"int32": "i4", "int64": "i8", "uint8": "u1", "float64": "f8"}
NUMBERS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


def fan(points, polygons):
    """Triangles of convex polygons."""
    return np.array([points[[p[0], p[i], p[i + 1]]] for p in polygons for i in range(1, len(p) - 1)])


def of_stl(data):
    if data[:5] == b"solid" and b"vertex" in data:
        numbers = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", data)
        return np.array(numbers, dtype=float).reshape(-1, 3, 3)
    (count,) = struct.unpack_from("<I", data, 80)
    rows = np.frombuffer(data, [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")], count, 84)
    return rows["v"].astype(float)


def of_obj(data):
    lines = [line.split() for line in data.decode().splitlines()]
    points = np.array([row[1:4] for row in lines if row[:1] == ["v"]], dtype=float)
    polygons = [[int(part.split("/")[0]) - 1 for part in row[1:]] for row in lines if row[:1] == ["f"]]
    return fan(points, polygons)


def of_ply(data):
    head, body = re.split(rb"end_header\r?\n", data, maxsplit=1)
    head = re.sub(r"(?m)^(comment|obj_info).*\n", "", head.decode())
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[
        re.search(r"format (\w+)", head)[1]
    ]
    words = iter(body.split())
    place = 0

    def number(kind):
        nonlocal place
        if not order:
            return float(next(words))
        (value,) = np.frombuffer(body, order + PLY_TYPES[kind], 1, place)
        place += np.dtype(PLY_TYPES[kind]).itemsize
        return value

    found = {}
    for name, count, properties in re.findall(r"element (\w+) (\d+)\s+((?:property .*\s*)+)", head):
        kinds = [line.split()[1:] for line in properties.splitlines() if line]
        rows = []
        for _ in range(int(count)):
            row = []
            for kind in kinds:
                lists = kind[0] == "list"
                row.append(
                    [number(kind[2]) for _ in range(int(number(kind[1])))] if lists else number(kind[0])
                )
            rows.append(row)
        found[name] = rows
    points = np.array([row[:3] for row in found["vertex"]], dtype=float)
    return fan(points, [np.array(row[0], dtype=int) for row in found["face"]])


def of_gltf(data):
    if data[:4] == b"glTF":
        (length,) = struct.unpack_from("<I", data, 12)
        document, buffers = json.loads(data[20 : 20 + length]), [data[28 + length :]]
    else:
        document = json.loads(data)
        buffers = [base64.b64decode(buffer["uri"].split(",")[1]) for buffer in document["buffers"]]

    def array(index):
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        kind = np.dtype(NUMBERS[accessor["componentType"]])
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stride = view.get("byteStride", width * kind.itemsize)
        rows = np.ndarray(
            (accessor["count"], width), kind, buffers[view["buffer"]], start, (stride, kind.itemsize)
        )
        scale = np.iinfo(kind).max if accessor.get("normalized") else 1
        return np.maximum(rows / scale, -1) if accessor.get("normalized") else rows

    def matrix(translation, rotation, scale):
        x, y, z, w = rotation
        turn = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        result = np.eye(4)
        result[:3, :3], result[:3, 3] = np.array(turn) * scale, translation
        return result

    triangles = []

    def visit(index, above):
        node = document["nodes"][index]
        still = ([0, 0, 0], [0, 0, 0, 1], [1, 1, 1])
        parts = [
            node.get(name, rest)
            for name, rest in zip(("translation", "rotation", "scale"), still, strict=True)
        ]
        own = np.reshape(node["matrix"], (4, 4)).T if "matrix" in node else matrix(*parts)
        world = above @ own
        given = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes")
        places = [np.eye(4)]
        if given:
            count = document["accessors"][next(iter(given.values()))]["count"]
            names = ("TRANSLATION", "ROTATION", "SCALE")
            rows = [
                array(given[name]) if name in given else np.tile(rest, (count, 1))
                for name, rest in zip(names, still, strict=True)
            ]
            places = [matrix(*row) for row in zip(*rows, strict=True)]
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            assert primitive.get("mode", 4) == 4
            points = array(primitive["attributes"]["POSITION"]).astype(float)
            corners = array(primitive["indices"])[:, 0].reshape(-1, 3)
            for place in places:
                moved = points @ (world @ place)[:3, :3].T + (world @ place)[:3, 3]
                triangles.append(moved[corners])
        for child in node.get("children", []):
            visit(child, world)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, np.eye(4))
    return np.concatenate(triangles)


READERS = {".stl": of_stl, ".obj": of_obj, ".ply": of_ply, ".gltf": of_gltf, ".glb": of_gltf}


def moments(triangles):
    """Area, and integrals of the coordinates and of their products over the surface.

    They do not depend on the order.
    """
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    total = triangles.sum(axis=1)
    second = np.einsum("t,tci,tcj->ij", area, triangles, triangles) + np.einsum(
        "t,ti,tj->ij", area, total, total
    )
    return np.r_[area.sum(), cross.sum(axis=0), area @ total / 3, second.ravel() / 12]


def read(name):
    loaded = load_mesh(WORLD / name)
    return loaded.mesh.vertices[loaded.mesh.faces]


def test_there_are_enough():
    assert len(FILES) >= 10
    assert {Path(name).suffix for name in FILES} == READERS.keys()
    assert sum((WORLD / name).stat().st_size for name in FILES) < 300_000
    text = (WORLD / "README.md").read_text()
    assert all(name.split(".")[0] in text for name in FILES)


@pytest.mark.parametrize("name", [name for name in FILES if "draco" not in name])
def test_triangles(name):
    expected = READERS[Path(name).suffix]((WORLD / name).read_bytes())
    found = read(name)
    assert len(found) == len(expected) > 3
    size = np.abs(expected).max()
    np.testing.assert_allclose(found.min(axis=(0, 1)), expected.min(axis=(0, 1)), atol=1e-6 * size)
    np.testing.assert_allclose(found.max(axis=(0, 1)), expected.max(axis=(0, 1)), atol=1e-6 * size)
    area = moments(expected)[0]
    np.testing.assert_allclose(moments(found), moments(expected), atol=1e-5 * area * max(1, size) ** 2)


def test_draco():
    """Positions have 14 bits over each mesh's box of 3 units. Except for this, the scene is the same."""
    pytest.importorskip("DracoPy")
    found, expected = read("gltf-transform-draco.glb"), read("three-scene.glb")
    assert len(found) == len(expected)
    np.testing.assert_allclose(moments(found), moments(expected), rtol=1e-3, atol=0.02)


@pytest.mark.parametrize("start", [0, 60, 200])
def test_damaged_draco_is_refused(tmp_path, start):
    """trimesh would leave out this part, one of three."""
    pytest.importorskip("DracoPy")
    data = bytearray((WORLD / "gltf-transform-draco.glb").read_bytes())
    start += data.index(b"DRACO")
    data[start : start + 40] = b"\xff" * 40
    path = tmp_path / "damaged.glb"
    path.write_bytes(data)
    with pytest.raises(InputError, match="its Draco-compressed data is damaged"):
        load_mesh(str(path))


@pytest.mark.parametrize(
    ("first", "second", "tolerance"),
    [
        ("three-vase.gltf", "three-vase.obj", 1e-5),
        ("three-vase.gltf", "three-vase.ply", 1e-5),
        ("three-scene.glb", "gltf-transform-quantised.glb", 0.05),
        ("three-scene.glb", "gltf-transform-draco.glb", 0.05),
        ("meshio-saddle.ply", "meshio-saddle.obj", 1e-5),
    ],
)
def test_one_shape_in_two_formats_is_one_picture(first, second, tolerance):
    if "draco" in second:
        pytest.importorskip("DracoPy")
    frames = [render(scene(str(WORLD / name), size=(96, 72), materials="one")) for name in (first, second)]
    # Edges of the silhouette may be one pixel away.
    assert (frames[0].mask != frames[1].mask).mean() < 0.005
    both = frames[0].mask & frames[1].mask
    assert np.abs(frames[0].image - frames[1].image)[both].mean() < tolerance


@pytest.mark.filterwarnings("ignore:.* is drawn without:RuntimeWarning")
@pytest.mark.parametrize("name", FILES)
def test_picture(name):
    """The golden renderer draws each file. It fills a good part of the picture, and stays within its box."""
    if "draco" in name:
        pytest.importorskip("DracoPy")
    made = scene(str(WORLD / name), size=(80, 60))
    frame = render(made)
    assert np.isfinite(frame.image).all()
    assert 0.05 < frame.mask.mean() < 0.9
    assert frame.image[frame.mask].std() > 0.01
    edge = np.ones_like(frame.mask)
    edge[1:-1, 1:-1] = False
    assert not (frame.mask & edge).any()
