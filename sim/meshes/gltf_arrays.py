"""Arrays of glTF files: quantised arrays as floats, fans as triangles, instances as nodes."""

import math
import os
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from blysk.sim.meshes.gltf_parts import MESHOPT, data_of_uri, holds_data, listed, view_bytes, whole
from blysk.sim.meshes.gltf_textures import color_texture, texture_coordinates, texture_set
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.refusal import ONE_MATERIAL, REEXPORT, Refused, inside, shown
from blysk.sim.meshes.strips import strip_triangles
from blysk.sim.run_files import reads

__all__ = ["check_arrays", "gltf_buffers", "plain_arrays"]

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_FLOAT, _INDEX = 5126, (5121, 5123, 5125)
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# How far from unit length a normal of three signed bytes may be: a step in each coordinate.
_ROUNDED = math.sqrt(3) / 127
_INSTANCING = "EXT_mesh_gpu_instancing"
_MAX_INSTANCES = 100_000
_DRACO = "KHR_draco_mesh_compression"
_LINES, _STRIP, _FAN, _MODES = 3, 5, 6, 7
_READ = ("POSITION", "NORMAL")
# Types of numbers of COLOR_0, and of texture coordinates, also with KHR_mesh_quantization.
_COLORS, _COORDINATES = (5121, 5123, _FLOAT), (5120, 5121, 5122, 5123, _FLOAT)


def check_arrays(document: dict) -> None:
    """Refuse references between the parts of a document that are negative or lead nowhere."""
    lists = {
        name: listed(document, name)
        for name in ("accessors", "bufferViews", "buffers", "meshes", "nodes", "scenes", "skins")
    }
    counts = {name: len(rows) for name, rows in lists.items()}
    for view in lists["bufferViews"]:
        whole(view["buffer"], "a view of buffer", counts["buffers"])
        for name in ("byteOffset", "byteStride"):
            whole(view.get(name, 0), f"the {name}")
        whole(view["byteLength"], "the byteLength")
    for accessor in lists["accessors"]:
        whole(accessor["count"], "an array of the count")
        whole(accessor.get("byteOffset", 0), "the byteOffset")
        if "bufferView" in accessor:
            whole(accessor["bufferView"], "an array in the view", counts["bufferViews"])
    for mesh in lists["meshes"]:
        for primitive in listed(mesh, "primitives"):
            whole(primitive.get("mode", 4), "the primitive mode", _MODES)
            for index in primitive["attributes"].values():
                whole(index, "a mesh with the accessor", counts["accessors"])
            if "indices" in primitive:
                whole(primitive["indices"], "a mesh with the indices' accessor", counts["accessors"])
    for node in lists["nodes"]:
        if "mesh" in node:
            whole(node["mesh"], "a node with the mesh", counts["meshes"])
    if "scene" in document:
        whole(document["scene"], "the scene", counts["scenes"])


def gltf_buffers(document: dict, data: bytes, suffix: str, folder: Path) -> list[bytes]:
    """Bytes of a document's buffers, from the document, the GLB file, or files of its folder."""
    buffers = []
    for number, buffer in enumerate(listed(document, "buffers")):
        uri = buffer.get("uri")
        length = whole(buffer.get("byteLength", 0), "the byteLength")
        if uri is None and any(
            buffer.get("extensions", {}).get(name, {}).get("fallback") for name in MESHOPT
        ):
            # Such a buffer has no bytes. It stands for the result of the decoder.
            found, length = b"", 0
        elif uri is None and number == 0 and suffix == ".glb":
            found = _glb_chunk(data)
        elif not isinstance(uri, str):
            raise Refused(f"its buffer {number} has no data")
        elif holds_data(uri):
            found = data_of_uri(uri, f"its buffer {number}")
        else:
            found = _beside(folder, uri)
        if len(found) < length:
            raise Refused(
                f"its buffer {number} is cut short: it says {length} bytes, but there are {len(found)}"
            )
        buffers.append(found)
    return buffers


def _beside(folder: Path, uri: str) -> bytes:
    target = inside(folder, uri, unquote(uri))
    if not os.path.isfile(target):
        raise Refused(f"it refers to {uri!r}, which does not exist", "put that file beside it")
    reads(target)
    return target.read_bytes()


def _glb_chunk(data: bytes) -> bytes:
    """The binary chunk of a GLB file; empty if there is none. Chunks of unknown types are passed over."""
    (length,) = struct.unpack_from("<I", data, 8)
    start = 12
    while start + 8 <= length:
        size, kind = struct.unpack_from("<II", data, start)
        if kind == 0x004E4942:
            return data[start + 8 : start + 8 + size]
        start += 8 + size
    return b""


def _normalised(values: np.ndarray, kind: np.dtype) -> np.ndarray:
    """Whole numbers scaled as in glTF: over the largest number of their type, and at least -1."""
    scaled: np.ndarray = np.maximum(values / np.iinfo(kind).max, -1.0)
    return scaled


class _Arrays:
    """The accessors of a document, and the arrays that are put in their place."""

    def __init__(self, document: dict, buffers: list[bytes]):
        self.document, self.buffers = document, buffers
        self.stored: list[np.ndarray] = []

    def read(self, index: int) -> np.ndarray:
        """Values of an accessor, float64 or whole numbers. Normalised values are -1 to 1, as glTF defines."""
        accessor = self.document["accessors"][index]
        kind, width = np.dtype(_TYPES[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        count = accessor["count"]
        values = np.zeros((count, width), kind)
        if "bufferView" in accessor:
            values = self._rows(accessor, count, kind, width)
        if sparse := accessor.get("sparse"):
            few = whole(sparse["count"], "the count of a sparse array")
            if few > count:
                raise Refused(f"it has the count of a sparse array {few}, but the array has {count} elements")
            where = sparse["indices"]
            places = self._rows(where, few, np.dtype(_TYPES[where["componentType"]]), 1)[:, 0]
            if few and not 0 <= places.min() <= places.max() < count:
                raise Refused(f"a sparse array has an element over {count - 1}")
            values = values.copy()
            values[places.astype(np.int64)] = self._rows(sparse["values"], few, kind, width)
        if accessor.get("normalized") and kind.kind != "f":
            return _normalised(values, kind)
        return values.astype(np.float64 if kind.kind == "f" else np.int64)

    def _rows(self, part: dict, count: int, kind: np.dtype, width: int) -> np.ndarray:
        """Rows of the view that a part of the document names."""
        views = self.document.get("bufferViews", [])
        view = views[whole(part["bufferView"], "an array in the view", len(views))]
        data = view_bytes(view, self.buffers)
        step = view.get("byteStride") or kind.itemsize * width
        start = whole(part.get("byteOffset", 0), "the byteOffset")
        if count == 0:
            return np.zeros((0, width), kind)
        if start + (count - 1) * step + kind.itemsize * width > len(data) or step < kind.itemsize * width:
            raise Refused(f"an array of {count} elements does not fit into its view")
        return np.ndarray((count, width), kind, data, start, (step, kind.itemsize))

    def decoded(self, primitive: dict) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Attributes and corners of Draco-compressed data; `Refused` if the decoder fails."""
        import DracoPy

        compressed = primitive["extensions"][_DRACO]
        views = self.document.get("bufferViews", [])
        place = whole(compressed.get("bufferView"), "Draco-compressed data in the view", len(views))
        data = view_bytes(views[place], self.buffers)
        try:
            mesh = DracoPy.decode(data)
            names = {number: name for name, number in compressed["attributes"].items()}
            found = {names.get(each["unique_id"]): np.array(each["data"]) for each in mesh.attributes}
            return found, np.array(mesh.faces).astype(np.int64).ravel()
        # The decoder may raise any exception.
        except Exception as error:
            raise Refused("its Draco-compressed data is damaged", REEXPORT) from error

    def add(self, values: np.ndarray) -> int:
        """Add an array of float32 vectors or 32-bit indices, and return the number of its new accessor."""
        self.stored.append(np.ascontiguousarray(values, dtype="<f4" if values.dtype.kind == "f" else "<u4"))
        return len(self.stored) - 1

    def corners(self, primitive: dict) -> np.ndarray:
        """Vertices of a primitive in order."""
        accessors = self.document["accessors"]
        if "indices" not in primitive:
            return np.arange(accessors[primitive["attributes"]["POSITION"]]["count"])
        accessor = accessors[primitive["indices"]]
        if accessor["componentType"] not in _INDEX or accessor["type"] != "SCALAR":
            raise Refused("its indices are not unsigned whole numbers")
        return self.read(primitive["indices"])[:, 0]

    def vectors(self, index: int, name: str) -> np.ndarray:
        """Values of an attribute as floats; quantised normals get unit length."""
        accessor = self.document["accessors"][index]
        if accessor["type"] != "VEC3":
            raise Refused(f"its {name} is of the type {shown(str(accessor['type']))}, not VEC3")
        if accessor["componentType"] == 5125 or accessor["componentType"] not in _TYPES:
            raise Refused(f"its {name} has the componentType {shown(str(accessor['componentType']))}")
        values = self.read(index).astype(np.float64)
        if name == "NORMAL" and accessor["componentType"] != _FLOAT:
            # Rounding is no fault of the file.
            length = np.linalg.norm(values, axis=1, keepdims=True)
            near = np.abs(length - 1) <= _ROUNDED
            values = np.where(near, values / np.where(near, length, 1.0), values)
        return values

    def look(self, index: int, name: str, decoded: dict[str, np.ndarray]) -> np.ndarray:
        """Values of COLOR_0 or of texture coordinates. Normalised whole numbers become -1 to 1."""
        accessor = self.document["accessors"][index]
        kind, shape = accessor["componentType"], accessor["type"]
        of_colors = name == "COLOR_0"
        shapes, kinds = (("VEC3", "VEC4"), _COLORS) if of_colors else (("VEC2",), _COORDINATES)
        if shape not in shapes:
            raise Refused(
                f"its {name} is of the type {shown(str(shape))}, not {' or '.join(shapes)}", ONE_MATERIAL
            )
        if kind not in kinds:
            raise Refused(f"its {name} has the componentType {shown(str(kind))}", ONE_MATERIAL)
        scaled = accessor.get("normalized") is True and kind != _FLOAT
        if of_colors and not scaled and kind != _FLOAT:
            raise Refused(f"its {name} has whole numbers that are not normalised", ONE_MATERIAL)
        if name not in decoded:
            if not {"bufferView", "sparse"} & accessor.keys():
                raise Refused(f"its {name} has no data", ONE_MATERIAL)
            return self.read(index).astype(np.float64)
        values = decoded[name].astype(np.float64)
        return _normalised(values, np.dtype(_TYPES[kind])) if scaled else values

    def document_parts(self) -> tuple[dict, bytes]:
        """Accessors, views and the buffer of the arrays that were added."""
        views, accessors, offset = [], [], 0
        for number, array in enumerate(self.stored):
            views.append({"buffer": 0, "byteOffset": offset, "byteLength": array.nbytes})
            offset += array.nbytes
            shape = {"count": len(array), "type": "VEC3" if array.ndim == 2 else "SCALAR"}
            kind = _FLOAT if array.dtype.kind == "f" else 5125
            accessors.append({"bufferView": number, "componentType": kind, **shape})
        buffers = [{"uri": "0", "byteLength": offset}]
        return {"accessors": accessors, "bufferViews": views, "buffers": buffers}, b"".join(
            array.tobytes() for array in self.stored
        )


def plain_arrays(
    document: dict, buffers: list[bytes], materials: list[dict] | None, found: Found
) -> tuple[bytes, list[dict[str, Any]]]:
    """Put a document into a form of triangles alone, which trimesh reads right.

    Each primitive has a material of its own, with the primitive's number as name.

    By itself trimesh scales no normalised whole numbers, reads no sparse arrays, leaves out triangle fans,
    and draws only one of a node's instances. Parts of points and lines are recorded as not read.

    Parameters
    ----------
    document : dict
        Document after `check_arrays`. It is changed.
    buffers : list of bytes
        From `gltf_buffers`.
    materials : list of dict or None
        Materials of the document. ``None``: neither materials nor colours of vertices are read.
    found : Found
        Takes the contents that are left out.

    Returns
    -------
    buffer : bytes
        Bytes of the new document's only buffer.
    looks : list of dict
        A dict for each primitive. ``"material"`` is the number of its material from 1, or 0 for none.
        ``"colors"`` and ``"coordinates"`` are float64 arrays of its vertices, or ``None``. Colours have a
        fourth column, alpha, if the file has alpha and the material has a cutoff.
    """
    arrays = _Arrays(document, buffers)
    looks: list[dict[str, Any]] = []
    for mesh in document.get("meshes", []):
        solid = [p for p in mesh["primitives"] if p.get("mode", 4) > _LINES]
        found.tell(
            "part of points or lines", "parts of points or lines", len(mesh["primitives"]) - len(solid)
        )
        drawn = [primitive for primitive in solid if "POSITION" in primitive["attributes"]]
        found.tell("part without positions", "parts without positions", len(solid) - len(drawn))
        mesh["primitives"] = []
        for primitive in drawn:
            plain, look = _plain_primitive(primitive, arrays, materials, found)
            mesh["primitives"].append({**plain, "material": len(looks)})
            looks.append(look)
    _plain_instances(document, arrays)
    for node in document["nodes"]:
        # trimesh would lose the nodes below a node with an empty mesh.
        if "mesh" in node and not document["meshes"][node["mesh"]]["primitives"]:
            del node["mesh"]
    parts, buffer = arrays.document_parts()
    document |= parts
    document["materials"] = [{"name": str(number)} for number in range(len(looks))]
    return buffer, looks


def _plain_primitive(
    primitive: dict, arrays: _Arrays, materials: list[dict] | None, found: Found
) -> tuple[dict, dict[str, Any]]:
    """A primitive of triangles with floats for positions and normals, and its look."""
    decoded: dict[str, np.ndarray] = {}
    accessors = arrays.document["accessors"]
    given = {name: primitive["attributes"][name] for name in _READ if name in primitive["attributes"]}
    used = [*given.values(), *([primitive["indices"]] if "indices" in primitive else [])]
    if all({"bufferView", "sparse"} & accessors[index].keys() for index in used):
        vectors = {name: arrays.vectors(index, name) for name, index in given.items()}
        corners = arrays.corners(primitive)
    else:
        if any(accessors[index]["componentType"] != _FLOAT for index in given.values()):
            raise Refused(
                "its POSITION is both compressed and quantised", "export it with only one of the two"
            )
        decoded, corners = arrays.decoded(primitive)
        vectors = {
            name: decoded[name].astype(np.float64) if name in decoded else arrays.vectors(index, name)
            for name, index in given.items()
        }
    if len({len(values) for values in vectors.values()}) > 1:
        found.tell("normals of another number than positions")
        del vectors["NORMAL"]
    mode = primitive.get("mode", 4)
    if mode != 4 and len(corners) < 3:
        raise Refused("a triangle strip or fan has fewer than 3 corners")
    if mode == _FAN:
        corners = np.stack([corners[1:-1], corners[2:], np.full(len(corners) - 2, corners[0])], axis=1)
    elif mode == _STRIP:
        corners = strip_triangles(corners)
    elif len(corners) % 3:
        raise Refused(f"a part of triangles has {len(corners)} corners, not a multiple of 3")
    plain = {"attributes": {name: arrays.add(values) for name, values in vectors.items()}}
    plain["indices"] = arrays.add(corners.ravel())
    if materials is None:
        return plain, {"material": 0, "colors": None, "coordinates": None}
    number = primitive.get("material")
    material = {} if number is None else materials[number]
    colors, coordinates = _looks(
        primitive["attributes"], material, len(vectors["POSITION"]), arrays, decoded, found
    )
    return plain, {
        "material": 0 if number is None else number + 1,
        "colors": colors,
        "coordinates": coordinates,
    }


def _looks(
    attributes: dict,
    material: dict,
    count: int,
    arrays: _Arrays,
    decoded: dict[str, np.ndarray],
    found: Found,
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Colours and texture coordinates of a primitive's vertices; ``None`` where there are none."""
    info = color_texture(material)
    names = ["COLOR_0", *([] if info is None else [texture_set(info)])]
    values = {}
    for name in [name for name in names if name in attributes]:
        if arrays.document["accessors"][attributes[name]]["count"] == count:
            values[name] = arrays.look(attributes[name], name, decoded)
        if len(values.get(name, ())) != count:
            found.tell(f"{name} of another number than positions")
            values.pop(name, None)
    colors, coordinates = values.get("COLOR_0"), values.get(names[-1])
    if colors is not None:
        mode = material.get("alphaMode", "OPAQUE")
        if mode != "MASK":
            if mode != "OPAQUE" and (colors[:, 3:] < 1).any():
                found.tell_names("of materials", [f"alpha (alphaMode {mode})"])
            colors = colors[:, :3]
    if info is None or coordinates is None:
        return colors, None
    return colors, texture_coordinates(info, coordinates)


def _plain_instances(document: dict, arrays: _Arrays) -> None:
    """Give each node with instances a child for each instance."""
    nodes = document.get("nodes", [])
    total = 0
    for node in list(nodes):
        attributes = node.get("extensions", {}).get(_INSTANCING, {}).get("attributes")
        if attributes is None or "mesh" not in node:
            continue
        columns = {}
        for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)):
            if name in attributes:
                index = whole(attributes[name], "instances with the accessor", len(document["accessors"]))
                columns[name.lower()] = values = arrays.read(index).astype(np.float64)
                if values.shape[1] != width or not np.isfinite(values).all():
                    raise Refused(f"the {name} of its instances are not {width} finite numbers each")
        counts = {len(values) for values in columns.values()}
        if len(counts) != 1:
            raise Refused("a node has no count of instances, or several")
        if (total := total + min(counts)) > _MAX_INSTANCES:
            raise Refused(f"it has over {_MAX_INSTANCES:,} instances", "export fewer, or as one mesh")
        if "rotation" in columns:
            length = np.linalg.norm(columns["rotation"], axis=1, keepdims=True)
            if not length.all():
                raise Refused("an instance has the rotation 0", REEXPORT)
            columns["rotation"] = columns["rotation"] / length
        mesh = node.pop("mesh")
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        children = [{"mesh": mesh, **dict(zip(columns, row, strict=True))} for row in rows]
        node["children"] = [*node.get("children", []), *range(len(nodes), len(nodes) + len(children))]
        nodes += children
