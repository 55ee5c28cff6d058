"""GLB and glTF files: their materials, checks that trimesh lacks, and a text that trimesh reads right."""

import importlib.util
import json
import re
import struct
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

from blysk.golden.reference.light import Triple
from blysk.golden.text import plain_text
from blysk.sim.installation import install_extra
from blysk.sim.meshes.gltf_arrays import check_arrays
from blysk.sim.meshes.gltf_parts import MESHOPT, extension_of, has_extension
from blysk.sim.meshes.gltf_textures import GLOSSY, GltfTextures, color_texture
from blysk.sim.meshes.materials import FileMaterial, Found, color_of
from blysk.sim.meshes.refusal import MAX_FACES, ONE_MATERIAL, Refused, shown

__all__ = [
    "check_gltf",
    "complete_scene",
    "find_gltf_materials",
    "gltf_document",
    "plain_gltf",
    "tell_contents",
]

# Three groups of extensions: ``_READ`` are read. ``_SILENT`` have no effect on the parts that are read.
# ``_TOLD`` are left out of the picture, and listed.
_READ = {"KHR_draco_mesh_compression", "KHR_mesh_quantization", "EXT_mesh_gpu_instancing"}
_UNLIT, _STRENGTH = "KHR_materials_unlit", "KHR_materials_emissive_strength"
_READ |= {"KHR_node_visibility", "KHR_texture_transform", "EXT_texture_webp", GLOSSY, _UNLIT, _STRENGTH}
_READ |= {"KHR_lights_punctual"}
_SILENT = {
    "KHR_texture_basisu",
    "EXT_texture_avif",
    "MSFT_texture_dds",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "KHR_animation_pointer",
}
_SILENT |= {"KHR_materials_variants", "KHR_node_hoverability", "KHR_node_selectability", "EXT_mesh_manifold"}
_TOLD = {"EXT_lights_image_based", "EXT_lights_ies"}
_TOLD |= {
    f"KHR_materials_{name}"
    for name in (
        *("anisotropy", "clearcoat", "diffuse_transmission", "dispersion", "ior", "iridescence", "sheen"),
        *("specular", "transmission", "volume", "volume_scatter"),
    )
}
# Known keys: keys of parts that are read or counted, and keys that do not change the look.
_ANY = {"name", "extensions", "extras"}
_KNOWN = {
    "document": {"asset", "scene", "scenes", "nodes", "meshes", "materials", "accessors", "bufferViews"}
    | {"buffers", "animations", "skins", "cameras", "images", "textures", "samplers"}
    | {"extensionsUsed", "extensionsRequired"},
    "nodes": {"children", "matrix", "translation", "rotation", "scale", "mesh", "skin", "weights", "camera"},
    "meshes": {"primitives", "weights"},
    "primitives": {"attributes", "indices", "material", "mode", "targets"},
    "materials": {"pbrMetallicRoughness", "doubleSided", "alphaMode", "alphaCutoff", "emissiveFactor"}
    | {"normalTexture", "occlusionTexture", "emissiveTexture"},
    "factors": {"baseColorFactor", "metallicFactor", "roughnessFactor", "baseColorTexture"}
    | {"metallicRoughnessTexture", "diffuseFactor", "specularFactor", "glossinessFactor", "diffuseTexture"}
    | {"specularGlossinessTexture"},
}
_ATTRIBUTES = re.compile("POSITION|NORMAL|TANGENT|COLOR_0|(TEXCOORD|JOINTS|WEIGHTS)_[0-9]+|_.*")


def gltf_document(data: bytes, suffix: str, found: Found) -> dict:
    """The JSON part of a GLB or glTF file, of version 2."""
    if suffix == ".glb":
        if len(data) < 20 or data[:4] != b"glTF":
            raise Refused("it is not a GLB file")
        version, length, json_length = struct.unpack_from("<3I", data, 4)
        if version != 2:
            raise _of_version(f"{version}.0")
        if len(data) < (said := max(length, 20 + json_length)):
            raise Refused(f"it is cut short: the header says {said} bytes, but there are {len(data)}")
        found.tell("byte after its end", "bytes after its end", len(data) - said)
        data = data[20 : 20 + json_length]
    try:
        document = json.loads(plain_text(data))
    except ValueError as error:
        raise Refused(f"its JSON is damaged ({error})") from error
    if not isinstance(document, dict):
        raise Refused("its JSON is not a glTF document")
    asset = document.get("asset")
    asset = asset if isinstance(asset, dict) else {}
    # Version 1 stores its parts by name. Drafts of version 1 have no asset.
    old = any(isinstance(document.get(name), dict) for name in ("accessors", "meshes", "nodes", "buffers"))
    version = asset.get("minVersion", asset.get("version", "1.0" if old else "2.0"))
    if str(version).split(".")[0] != "2" or str(asset.get("minVersion", "2.0")) not in ("2", "2.0"):
        raise _of_version(shown(str(version)))
    return document


def _of_version(version: str) -> Refused:
    return Refused(f"it has glTF version {version}, and only version 2.0 is read", "convert it to glTF 2.0")


def check_gltf(document: dict) -> None:
    """Refuse geometry that trimesh would load as zeros, and counts that would fill the memory."""
    for extension in sorted(map(str, document.get("extensionsRequired", []))):
        if extension not in _READ | _SILENT | _TOLD:
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
            draco = "KHR_draco_mesh_compression" in primitive.get("extensions", {})
            if not all({"bufferView", "sparse"} & accessors[index].keys() for index in used):
                if not draco:
                    raise Refused("a mesh has no data")
                if importlib.util.find_spec("DracoPy") is None:
                    raise Refused(
                        "it is Draco-compressed and the decoder DracoPy is not installed",
                        install_extra("draco"),
                    )


def _check_nodes(document: dict) -> None:
    """Refuse nodes that form no trees. trimesh would draw them at some of their places only, or never end."""
    nodes = document.get("nodes", [])
    children = [node.get("children", []) for node in nodes]
    roots = [scene.get("nodes", []) for scene in document.get("scenes", [])]
    below = [child for row in children for child in row]
    for index in [*below, *(root for row in roots for root in row)]:
        if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(nodes):
            raise Refused(
                f"it refers to node {shown(str(index))}, counted from 0, but the number of nodes is "
                f"{len(nodes)}"
            )
    if len(set(below)) < len(below):
        raise Refused("one of its nodes has two parents", "export it with one parent for each node")
    reached = list(set(range(len(nodes))).difference(below))
    for index in reached:
        reached += children[index]
    if len(reached) < len(nodes):
        raise Refused("its nodes form a circle")
    if any(len(set(row)) < len(row) or not set(row).isdisjoint(below) for row in roots):
        raise Refused("one of its nodes is twice in a scene", "export it with only the roots in the scene")


def complete_scene(document: dict, found: Found) -> None:
    """Put the root nodes of a document without scenes into a scene, and leave out invisible nodes."""
    nodes = document.setdefault("nodes", [])
    if not document.get("scenes"):
        if not nodes:
            nodes += [{"mesh": number} for number in range(len(document.get("meshes", [])))]
        below = {child for node in nodes for child in node.get("children", [])}
        document["scenes"] = [{"nodes": [k for k in range(len(nodes)) if k not in below]}]
    elif "scene" not in document:
        found.tell("scene after the first", "scenes after the first", len(document["scenes"]) - 1)
    document.setdefault("scene", 0)
    hidden = [node for node in nodes if extension_of(node, "KHR_node_visibility").get("visible") is False]
    for node in hidden:
        node.pop("mesh", None)
        hidden += [nodes[child] for child in node.get("children", [])]


def find_gltf_materials(
    document: dict, materials: bool, textures: GltfTextures, found: Found
) -> list[dict] | None:
    """Take the materials out of a document; ``None`` if they are not asked for.

    A material, and its texture, is read if a face uses it.
    """
    texts = document.pop("materials", None) or []
    if not materials:
        return None
    if not isinstance(texts, list) or not all(isinstance(text, dict) for text in texts):
        raise Refused("its materials are not a list of objects", ONE_MATERIAL)
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            index = primitive.get("material", 0)
            if "material" in primitive and (
                isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(texts)
            ):
                raise Refused(
                    f"a mesh refers to material {shown(str(index))}, counted from 0, but the number of "
                    f"materials is {len(texts)}",
                    ONE_MATERIAL,
                )
    found.names += [str(text.get("name", "")) for text in texts]
    for number, (name, text) in enumerate(zip(found.names[1:], texts, strict=True)):
        given = shown(name)
        read = partial(_gltf_material, text, given or f"number {number}", given, textures, found)
        found.readers.append(read)
    return texts


def _gltf_material(
    text: dict, name: str, given_name: str, textures: GltfTextures, found: Found
) -> FileMaterial:
    """A material of a glTF document. Properties of its look that are not read are recorded in ``found``.

    Missing factors are 1, as glTF defines. Factors that a texture multiplies do not count if the texture is
    not read: metallic factor and roughness, specular factor and glossiness, emission.
    """
    glossy = has_extension(text, GLOSSY)
    look = extension_of(text, GLOSSY) if glossy else text.get("pbrMetallicRoughness", {})
    if not isinstance(look, dict):
        raise Refused(
            f"material {name!r} has pbrMetallicRoughness {shown(str(look))!r}, not an object", ONE_MATERIAL
        )
    key = "diffuseFactor" if glossy else "baseColorFactor"
    color, alpha = _color(look, key, 4, name), look.get(key, [1] * 4)[3]
    two_sided, unlit = text.get("doubleSided") is True, has_extension(text, _UNLIT)
    if unlit or {"metallicRoughnessTexture", "specularGlossinessTexture"} & look.keys():
        made = FileMaterial(given_name, color, two_sided=two_sided, unlit=unlit)
    elif glossy:
        specular = _color(look, "specularFactor", 3, name)
        glossiness = _factor(look, "glossinessFactor", name)
        made = FileMaterial.of_specular_glossiness(given_name, color, specular, glossiness, two_sided)
    else:
        factors = [_factor(look, key, name) for key in ("metallicFactor", "roughnessFactor")]
        made = FileMaterial.of_metallic_roughness(given_name, color, *factors, two_sided)
    info = color_texture(text)
    _tell_look(text, look, info, alpha, found)
    mode = text.get("alphaMode", "OPAQUE")
    if info is not None:
        of_alpha = {"OPAQUE": "left out", "MASK": "read"}.get(str(mode), "told")
        made = replace(made, texture=textures.read(info, of_alpha))
    if mode == "MASK":
        made = replace(made, alpha=float(alpha), cutoff=_cutoff(text, alpha, key, name))
    if "emissiveTexture" not in text and not unlit:
        made = replace(made, emission=_emission(text, name))
    return made


def _color(look: dict, key: str, count: int, name: str) -> Triple:
    """A colour of a material, perhaps followed by alpha."""
    given = look.get(key, [1] * count)
    channels = given[:3] if _are_numbers(given, count) else []
    return color_of(channels, key, name, str(given), "three" if count == 3 else "four")


def _are_numbers(given: Any, count: int) -> bool:
    """Whether a value is a list of ``count`` numbers."""
    kinds = [type(number) in (int, float) for number in given] if isinstance(given, list) else []
    return len(kinds) == count and all(kinds)


def _cutoff(text: dict, alpha: float, key: str, name: str) -> float:
    """Cutoff of a material's alpha; `Refused` if the cutoff, or the alpha of a factor, is out of range."""
    cutoff = text.get("alphaCutoff", 0.5)
    for what, value, most in (("alphaCutoff", cutoff, 1e30), (f"alpha of {key}", alpha, 1)):
        if not _are_numbers([value], 1) or not 0 <= value <= most:
            wanted = "of at least 0" if what == "alphaCutoff" else "from 0 to 1"
            raise Refused(
                f"material {name!r} has the {what} {shown(str(value))!r}, not a number {wanted}", ONE_MATERIAL
            )
    return float(cutoff)


def _emission(text: dict, name: str) -> Triple | None:
    """Light that a material emits; ``None`` if it emits none."""
    given, strength = text.get("emissiveFactor", [0, 0, 0]), extension_of(text, _STRENGTH)
    factor = strength.get("emissiveStrength", 1)
    for key, value, numbers in (
        ("emissiveFactor", given, given),
        ("emissiveStrength", factor, [factor] * 3),
    ):
        if not _are_numbers(numbers, 3) or not all(0 <= number <= 1e30 for number in numbers):
            what = "three numbers" if numbers is given else "a number"
            raise Refused(
                f"material {name!r} has {key} {shown(str(value))!r}, not {what} of at least 0", ONE_MATERIAL
            )
    red, green, blue = (float(channel) * float(factor) for channel in given)
    return (red, green, blue) if red or green or blue else None


def _tell_look(text: dict, look: dict, info: dict | None, alpha: float, found: Found) -> None:
    """Record the properties that change the look of a material and are not read."""
    if has_extension(text, GLOSSY):
        # The other factors are for programs that do not know the extension.
        text = {key: value for key, value in text.items() if key != "pbrMetallicRoughness"}
    extensions = list(_extension_names(text))
    textures = (
        key for part in _parts(text) for key in part if key.endswith("Texture") and part[key] is not info
    )
    found.tell_names("textures", textures)
    mode, kind = text.get("alphaMode", "OPAQUE"), "of materials"
    if mode not in ("OPAQUE", "MASK") and alpha < 1:
        found.tell_names(kind, [f"alpha (alphaMode {mode})"])
    found.tell_names(kind, extensions, _SILENT | _READ)
    found.tell_names(kind, text, _KNOWN["materials"] | _ANY)
    found.tell_names(kind, look, _KNOWN["factors"] | _ANY)


def _parts(part: Any) -> Iterator[dict]:
    """A part of a document and all parts in it, without ``extras``, which belong to applications."""
    if isinstance(part, dict):
        yield part
        part = [value for key, value in part.items() if key != "extras"]
    if isinstance(part, list):
        for value in part:
            if isinstance(value, dict | list):
                yield from _parts(value)


def _extension_names(part: Any) -> Iterator[str]:
    """Names of all extensions in a part of a document."""
    for each in _parts(part):
        extensions = each.get("extensions")
        if isinstance(extensions, dict):
            yield from extensions


def _factor(look: dict, key: str, name: str) -> float:
    """A factor of a material; `Refused` if the factor is not a number from 0 to 1."""
    value = look.get(key, 1)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 1:
        raise Refused(
            f"material {name!r} has {key} {shown(str(value))!r}, not a number from 0 to 1", ONE_MATERIAL
        )
    return float(value)


def tell_contents(document: dict, found: Found) -> None:
    """Record contents of a document that belong to the picture and are not read. Materials are left out here.

    Skins, and morph targets with a weight other than 0, are counted. The mesh is drawn without them.
    """
    meshes, nodes = document.get("meshes", []), document.get("nodes", [])
    morphed = {
        node["mesh"]
        for node in nodes
        if "mesh" in node and any(node.get("weights", meshes[node["mesh"]].get("weights", [])))
    }
    found.tell("mesh with morph weights", "meshes with morph weights", len(morphed))
    skins = {node["skin"] for node in nodes if "skin" in node and "mesh" in node}
    found.tell("skin", "skins", len(skins))
    found.tell("animation", "animations", len(document.get("animations", [])))
    primitives = [primitive for mesh in meshes for primitive in mesh["primitives"]]
    attributes = {name for primitive in primitives for name in primitive["attributes"]}
    found.tell_names("attributes", sorted(a for a in attributes if not _ATTRIBUTES.fullmatch(a)))
    known = _READ | _SILENT | MESHOPT
    found.tell_names("extensions", _extension_names(document), known)
    parts = {"document": [document], "nodes": nodes, "meshes": meshes, "primitives": primitives}
    for name, each in parts.items():
        found.tell_names(f"of {name}", (key for part in each for key in part), _KNOWN[name] | _ANY)


def plain_gltf(document: dict) -> bytes:
    """The text of a document with meshes and nodes alone.

    Cameras are removed, because trimesh would lose the nodes below a camera.
    """
    for node in document["nodes"]:
        for name in ("camera", "skin", "weights", "extensions", "extras"):
            node.pop(name, None)
    names = (
        "asset",
        "scene",
        "scenes",
        "nodes",
        "meshes",
        "materials",
        "accessors",
        "bufferViews",
        "buffers",
    )
    return json.dumps({name: document[name] for name in names if name in document}).encode()
