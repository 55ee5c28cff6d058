"""GLB and glTF files: checks that trimesh does not make, materials, and a text that trimesh reads right."""

import importlib.util
import json
import re
import struct
from functools import partial

from blysk.sim.meshes.gltf_arrays import check_arrays
from blysk.sim.meshes.materials import FileMaterial, Found, color_of
from blysk.sim.meshes.refusal import MAX_FACES, ONE_MATERIAL, Refused, shown

__all__ = ["check_gltf", "find_gltf_materials", "gltf_document", "plain_gltf"]

_NEEDS_DECODER = {"EXT_meshopt_compression", "KHR_meshopt_compression"}
# Extensions whose geometry is read, and those that say nothing of geometry.
_SUPPORTED = re.compile(
    "KHR_draco_mesh_compression|KHR_mesh_quantization|EXT_mesh_gpu_instancing|"
    "[A-Z0-9]+_(materials?|textures?|lights?|image|xmp|animation)(_.+)?"
)


def gltf_document(data: bytes, suffix: str) -> dict:
    """The JSON part of a GLB or glTF file."""
    if suffix == ".glb":
        if len(data) < 20 or data[:4] != b"glTF":
            raise Refused("it is no GLB file")
        length, json_length = struct.unpack_from("<II", data, 8)
        if len(data) < (said := max(length, 20 + json_length)):
            raise Refused(f"it is cut short: the header says {said} bytes, there are {len(data)}")
        data = data[20 : 20 + json_length]
    try:
        document = json.loads(data.decode("utf-8-sig"))
    except ValueError as error:
        raise Refused(f"its JSON is damaged ({error})") from error
    if not isinstance(document, dict):
        raise Refused("its JSON is no glTF document")
    return document


def check_gltf(document: dict) -> None:
    """Refuse geometry that trimesh would load as zeros, and counts that would exhaust the memory."""
    for extension in sorted(_NEEDS_DECODER.intersection(document.get("extensionsUsed", []))):
        raise Refused(
            f"it is compressed with {extension}, for which there is no decoder", "export it uncompressed"
        )
    for extension in sorted(map(str, document.get("extensionsRequired", []))):
        if not _SUPPORTED.fullmatch(extension):
            raise Refused(
                f"it needs the extension {shown(extension)}, which is not supported", "export it without"
            )
    check_arrays(document)
    _check_nodes(document)
    accessors = document.get("accessors", [])
    for accessor in accessors:
        if accessor["count"] > 3 * MAX_FACES:
            raise Refused(f"it has an array of {accessor['count']} elements; the limit is {3 * MAX_FACES}")
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            used = [attributes[k] for k in ("POSITION", "NORMAL") if k in attributes]
            used += [primitive["indices"]] if "indices" in primitive else []
            if any("sparse" in accessors[index] for index in used):
                raise Refused("it has sparse accessors, which are not supported", "export it without them")
            draco = "KHR_draco_mesh_compression" in primitive.get("extensions", {})
            if not all("bufferView" in accessors[index] for index in used):
                if not draco:
                    raise Refused("a mesh has no data")
                if importlib.util.find_spec("DracoPy") is None:
                    raise Refused(
                        "it is Draco-compressed and the decoder DracoPy is not installed",
                        "pip install 'blysk[draco]'",
                    )


def _check_nodes(document: dict) -> None:
    """Refuse nodes that form no trees: trimesh would draw one of several places, or none, or never end."""
    nodes = document.get("nodes", [])
    children = [node.get("children", []) for node in nodes]
    roots = [scene.get("nodes", []) for scene in document.get("scenes", [])]
    below = [child for row in children for child in row]
    for index in [*below, *(root for row in roots for root in row)]:
        if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(nodes):
            raise Refused(f"it refers to node {shown(str(index))} (from 0), there are {len(nodes)}")
    if len(set(below)) < len(below):
        raise Refused("one of its nodes hangs on two others", "export it with one parent a node")
    reached = list(set(range(len(nodes))).difference(below))
    for index in reached:
        reached += children[index]
    if len(reached) < len(nodes):
        raise Refused("its nodes hang on each other in a circle")
    if any(len(set(row)) < len(row) or not set(row).isdisjoint(below) for row in roots):
        raise Refused("one of its nodes is twice in a scene", "export it with the roots alone in the scene")


def find_gltf_materials(document: dict, materials: bool, found: Found) -> None:
    """Replace a document's materials by their numbers, and remove textures and vertex colours.

    trimesh then gives the material's number of each part of a mesh, and looks for no image file.
    """
    texts = document.pop("materials", None) or []
    for unread in ("images", "textures", "samplers"):
        document.pop(unread, None)
    colored = False
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            for name in list(attributes):
                if name.startswith(("COLOR_", "TEXCOORD_")):
                    colored |= name.startswith("COLOR_")
                    del attributes[name]
            index = primitive.pop("material", None)
            if index is None or not materials:
                continue
            if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(texts):
                raise Refused(
                    f"a mesh refers to material {shown(str(index))} (from 0), there are {len(texts)}",
                    ONE_MATERIAL,
                )
            primitive["material"] = index
    if colored:
        found.ignored.append("vertex colours")
    if materials and texts:
        if not isinstance(texts, list) or not all(isinstance(text, dict) for text in texts):
            raise Refused("its materials are no list of objects", ONE_MATERIAL)
        found.names += [str(text.get("name", "")) for text in texts]
        for number, (name, text) in enumerate(zip(found.names[-len(texts) :], texts, strict=True)):
            given = shown(name)
            found.readers.append(partial(_gltf_material, text, given or f"number {number}", given))
        document["materials"] = [{"name": str(number)} for number in range(1, len(texts) + 1)]


def _gltf_material(text: dict, name: str, given_name: str) -> tuple[FileMaterial, int]:
    """A material of a glTF document, and how many textures it has.

    Missing factors are 1, as glTF defines. Metallic and roughness factors of a texture do not count, as
    textures are not read.
    """
    look = text.get("pbrMetallicRoughness", {})
    factor = look.get("baseColorFactor", [1, 1, 1, 1]) if isinstance(look, dict) else look
    numbers = factor if isinstance(factor, list) and len(factor) == 4 else []
    usable = all(isinstance(number, int | float) and not isinstance(number, bool) for number in numbers)
    color = color_of(numbers[:3] if usable else [], "baseColorFactor", name, str(factor))
    textures = sum(key.endswith("Texture") for part in (look, text) for key in part)
    two_sided = text.get("doubleSided") is True
    if "metallicRoughnessTexture" in look:
        return FileMaterial(given_name, color, two_sided=two_sided), textures
    factors = [_factor(look, key, name) for key in ("metallicFactor", "roughnessFactor")]
    return FileMaterial.of_metallic_roughness(given_name, color, *factors, two_sided), textures


def _factor(look: dict, key: str, name: str) -> float:
    """A factor of a material; `Refused` if it is no number from 0 to 1."""
    value = look.get(key, 1)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 1:
        raise Refused(
            f"material {name!r} has {key} {shown(str(value))!r}, not a number from 0 to 1", ONE_MATERIAL
        )
    return float(value)


def plain_gltf(document: dict, found: Found) -> bytes:
    """The text of a document without cameras; what the picture will not show goes into ``found.ignored``.

    trimesh would lose the nodes below a camera. Skins, and morph targets with a weight other than 0, are
    counted: the mesh is drawn without them.
    """
    meshes = document.get("meshes", [])
    morphed = {
        node["mesh"]
        for node in document.get("nodes", [])
        if "mesh" in node and any(node.get("weights", meshes[node["mesh"]].get("weights", [])))
    }
    skins = {node["skin"] for node in document.get("nodes", []) if "skin" in node and "mesh" in node}
    for count, what in ((len(morphed), "mesh with morph weights"), (len(skins), "skin")):
        if count:
            found.ignored.append(f"{count} {what if count == 1 else _PLURALS[what]}")
    for node in document.get("nodes", []):
        node.pop("camera", None)
    return json.dumps(document).encode()


_PLURALS = {"mesh with morph weights": "meshes with morph weights", "skin": "skins"}
