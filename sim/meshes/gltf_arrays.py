"""Arrays of glTF files: quantised ones as floats, fans as triangles, instances as nodes."""

import base64
import binascii
import importlib.util
import math
import os
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from blysk.sim.meshes.refusal import REEXPORT, Refused, inside, shown

__all__ = ["check_arrays", "gltf_buffers", "plain_arrays"]

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_FLOAT, _INDEX = 5126, (5121, 5123, 5125)
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# How far from unit length a normal of three signed bytes may be: a step in each coordinate.
_ROUNDED = math.sqrt(3) / 127
_INSTANCING = "EXT_mesh_gpu_instancing"
_MAX_INSTANCES = 100_000
_DRACO = "KHR_draco_mesh_compression"
_LINES, _FAN, _MODES = 3, 6, 7


def _listed(document: dict, name: str) -> list[dict]:
    """An array of objects of a document."""
    rows = document.get(name, [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise Refused(f"its {name} are no list of objects")
    return rows


def _whole(value: Any, what: str, below: float = math.inf) -> int:
    """Check a whole number: 0 or more, as Python would count a negative index from the end."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise Refused(f"it has {what} {shown(str(value))}, no whole number from 0")
    if value >= below:
        raise Refused(f"it has {what} {value} (from 0), there are {below}")
    return value


def check_arrays(document: dict) -> None:
    """Refuse references between the parts of a document that are negative or lead nowhere."""
    lists = {
        name: _listed(document, name)
        for name in ("accessors", "bufferViews", "buffers", "meshes", "nodes", "scenes", "skins")
    }
    counts = {name: len(rows) for name, rows in lists.items()}
    for view in lists["bufferViews"]:
        _whole(view["buffer"], "a view of buffer", counts["buffers"])
        for name in ("byteOffset", "byteStride"):
            _whole(view.get(name, 0), f"the {name}")
        _whole(view["byteLength"], "the byteLength")
    for accessor in lists["accessors"]:
        _whole(accessor["count"], "an array of the count")
        _whole(accessor.get("byteOffset", 0), "the byteOffset")
        if "bufferView" in accessor:
            _whole(accessor["bufferView"], "an array in the view", counts["bufferViews"])
    for mesh in lists["meshes"]:
        for primitive in _listed(mesh, "primitives"):
            _whole(primitive.get("mode", 4), "the primitive mode", _MODES)
            for index in primitive["attributes"].values():
                _whole(index, "a mesh with the accessor", counts["accessors"])
            if "indices" in primitive:
                _whole(primitive["indices"], "a mesh with the indices' accessor", counts["accessors"])
    for node in lists["nodes"]:
        if "mesh" in node:
            _whole(node["mesh"], "a node with the mesh", counts["meshes"])
    if "scene" in document:
        _whole(document["scene"], "the scene", counts["scenes"])


def gltf_buffers(document: dict, data: bytes, suffix: str, folder: Path) -> list[bytes]:
    """Bytes of a document's buffers, from the document, the GLB file, or files of its folder."""
    buffers = []
    for number, buffer in enumerate(_listed(document, "buffers")):
        uri = buffer.get("uri")
        if uri is None and number == 0 and suffix == ".glb":
            found = _glb_chunk(data)
        elif not isinstance(uri, str):
            raise Refused(f"its buffer {number} has no data")
        elif uri.startswith("data:"):
            try:
                found = base64.b64decode(uri.partition("base64,")[2])
            except (binascii.Error, ValueError):
                raise Refused(f"the text of its buffer {number} is no base64") from None
        else:
            found = _beside(folder, uri)
        length = _whole(buffer.get("byteLength", 0), "the byteLength")
        if len(found) < length:
            raise Refused(f"its buffer {number} is cut short: it says {length} bytes, there are {len(found)}")
        buffers.append(found)
    return buffers


def _beside(folder: Path, uri: str) -> bytes:
    target = inside(folder, uri, unquote(uri))
    if not os.path.isfile(target):
        raise Refused(f"it refers to {uri!r}, which does not exist", "put that file beside it")
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


class _Arrays:
    """The accessors of a document, and a buffer of arrays put to them."""

    def __init__(self, document: dict, buffers: list[bytes]):
        self.document, self.buffers = document, buffers
        self.more: list[np.ndarray] = []
        self.places: dict[tuple[int, str], int] = {}

    def read(self, index: int) -> np.ndarray:
        """Values of an accessor, float64 or whole; normalised ones between -1 and 1 as glTF defines them."""
        accessor = self.document["accessors"][index]
        kind, width = np.dtype(_TYPES[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        if "bufferView" not in accessor or "sparse" in accessor:
            raise Refused("it has sparse accessors or such without data", "export it without them")
        view, count = self.document["bufferViews"][accessor["bufferView"]], accessor["count"]
        data = self.buffers[view["buffer"]][view.get("byteOffset", 0) :][: view["byteLength"]]
        step = view.get("byteStride") or kind.itemsize * width
        start = accessor.get("byteOffset", 0)
        if count == 0:
            return np.zeros((0, width))
        if start + (count - 1) * step + kind.itemsize * width > len(data) or step < kind.itemsize * width:
            raise Refused(f"an array of {count} elements does not fit into its view")
        values = np.ndarray((count, width), kind, data, start, (step, kind.itemsize))
        if accessor.get("normalized") and kind.kind != "f":
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values.astype(np.float64 if kind.kind == "f" else np.int64)

    def check_draco(self, compressed: dict) -> None:
        """Refuse compressed data that its decoder refuses: trimesh would leave the part out.

        Without the decoder, only data that is also there uncompressed gets here, and is read in that form.
        """
        if importlib.util.find_spec("DracoPy") is None:
            return
        import DracoPy

        views = self.document.get("bufferViews", [])
        view = views[_whole(compressed.get("bufferView"), "Draco-compressed data", len(views))]
        data = self.buffers[view["buffer"]][view.get("byteOffset", 0) :][: view["byteLength"]]
        try:
            DracoPy.decode(data)
        # The decoder raises whatever it trips over.
        except Exception as error:
            raise Refused("its Draco-compressed data is damaged", REEXPORT) from error

    def add(self, values: np.ndarray) -> int:
        """Add an array, float32 vectors or 32-bit indices; the number of its new accessor."""
        kind, component = ("<f4", _FLOAT) if values.dtype.kind == "f" else ("<u4", 5125)
        stored = np.ascontiguousarray(values, dtype=kind)
        views, accessors = self.document["bufferViews"], self.document["accessors"]
        offset = sum(array.nbytes for array in self.more)
        self.more.append(stored)
        views.append({"buffer": len(self.buffers), "byteOffset": offset, "byteLength": stored.nbytes})
        shape = {"count": len(stored), "type": "VEC3" if stored.ndim == 2 else "SCALAR"}
        accessors.append({"bufferView": len(views) - 1, "componentType": component, **shape})
        return len(accessors) - 1

    def as_floats(self, index: int, name: str) -> int:
        """Number of an accessor that has an attribute as floats; quantised normals get unit length."""
        accessor = self.document["accessors"][index]
        if accessor["type"] != "VEC3":
            raise Refused(f"its {name} is of the type {shown(str(accessor['type']))}, not VEC3")
        if accessor["componentType"] == _FLOAT:
            return index
        if accessor["componentType"] == 5125 or accessor["componentType"] not in _TYPES:
            raise Refused(f"its {name} has the componentType {shown(str(accessor['componentType']))}")
        if (index, name) not in self.places:
            values = self.read(index).astype(np.float64)
            if name == "NORMAL":
                # Rounding is no fault of the file.
                length = np.linalg.norm(values, axis=1, keepdims=True)
                near = np.abs(length - 1) <= _ROUNDED
                values = np.where(near, values / np.where(near, length, 1.0), values)
            self.places[index, name] = self.add(values)
        return self.places[index, name]


def plain_arrays(document: dict, buffers: list[bytes]) -> list[bytes]:
    """Put a document into a form that trimesh reads right; the buffers, perhaps with a new one.

    trimesh does not scale normalised whole numbers, leaves out triangle fans, and draws only one of a node's
    instances.

    Parameters
    ----------
    document : dict
        After `check_arrays`; it is changed.
    buffers : list of bytes
        Of `gltf_buffers`.
    """
    arrays = _Arrays(document, buffers)
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            if primitive.get("mode", 4) > _LINES:
                if compressed := primitive.get("extensions", {}).get(_DRACO):
                    arrays.check_draco(compressed)
                _plain_primitive(primitive, arrays)
    _plain_instances(document, arrays)
    if arrays.more:
        buffers = [*buffers, b"".join(array.tobytes() for array in arrays.more)]
    document["buffers"] = [{"uri": str(number), "byteLength": len(b)} for number, b in enumerate(buffers)]
    return buffers


def _plain_primitive(primitive: dict, arrays: _Arrays) -> None:
    attributes, accessors = primitive["attributes"], arrays.document["accessors"]
    for name in {"POSITION", "NORMAL"}.intersection(attributes):
        accessor = accessors[attributes[name]]
        if "bufferView" in accessor:
            attributes[name] = arrays.as_floats(attributes[name], name)
        elif accessor["componentType"] != _FLOAT:
            raise Refused(f"its {name} is compressed and quantised, too", "export it with one of both")
    if "indices" in primitive:
        accessor = accessors[primitive["indices"]]
        if accessor["componentType"] not in _INDEX or accessor["type"] != "SCALAR":
            raise Refused("its indices are no unsigned whole numbers")
    if primitive.get("mode", 4) == _FAN:
        if "indices" in primitive:
            corners = arrays.read(primitive["indices"])[:, 0]
        else:
            corners = np.arange(accessors[attributes["POSITION"]]["count"])
        if len(corners) < 3:
            raise Refused("a triangle fan has fewer than 3 corners")
        first = np.full(len(corners) - 2, corners[0])
        fan = np.stack([corners[1:-1], corners[2:], first], axis=1)
        primitive |= {"mode": 4, "indices": arrays.add(fan.ravel())}


def _plain_instances(document: dict, arrays: _Arrays) -> None:
    """Give a node with instances a child for each of them."""
    nodes = document.get("nodes", [])
    total = 0
    for node in list(nodes):
        attributes = node.get("extensions", {}).get(_INSTANCING, {}).get("attributes")
        if attributes is None or "mesh" not in node:
            continue
        columns = {}
        for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)):
            if name in attributes:
                index = _whole(attributes[name], "instances with the accessor", len(document["accessors"]))
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
