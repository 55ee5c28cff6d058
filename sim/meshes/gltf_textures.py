"""Textures of glTF files: images, samplers, and coordinates of the texture of a material's colour."""

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from blysk.golden.reference.texture import Texture
from blysk.sim.meshes.gltf_parts import (
    data_of_uri,
    extension_of,
    has_extension,
    holds_data,
    listed,
    view_bytes,
    whole,
)
from blysk.sim.meshes.images import NOT_THERE, OUTSIDE, load_texture, read_texture
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.refusal import ONE_MATERIAL, Refused, inside, shown

__all__ = ["GLOSSY", "GltfTextures", "color_texture", "texture_coordinates", "texture_set"]

GLOSSY = "KHR_materials_pbrSpecularGlossiness"
"""Extension with specular and glossiness factors in place of metallic and roughness factors."""

_TRANSFORM = "KHR_texture_transform"
_WRAPS = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
_MAG = {9728: "nearest", 9729: "bilinear"}
# Filter inside a level, and whether levels are used. Levels are chosen, not blended.
_MIN = {9728: ("nearest", False), 9729: ("bilinear", False)}
_MIN |= {9984: ("nearest", True), 9985: ("bilinear", True), 9986: ("nearest", True), 9987: ("bilinear", True)}
# Keys that are read, and keys that do not change the look.
_KNOWN = {
    "texture infos": {"index", "texCoord"},
    _TRANSFORM: {"offset", "rotation", "scale", "texCoord"},
    "textures": {"sampler", "source"},
    "samplers": {"magFilter", "minFilter", "wrapS", "wrapT"},
    "images": {"uri", "mimeType", "bufferView"},
}
_ANY = {"name", "extensions", "extras"}
# A whole number of JSON may be too large for a float.
_LARGEST = 1e30
# Extensions that give a texture other images, in addition to an image that is read.
_IMAGES = {"EXT_texture_webp", "KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"}


def color_texture(material: dict) -> dict | None:
    """The part of a material that says which texture its colour has; ``None`` if there is none.

    Raises
    ------
    Refused
        If this part is not an object.
    """
    key, look = "baseColorTexture", material.get("pbrMetallicRoughness", {})
    if has_extension(material, GLOSSY):
        key, look = "diffuseTexture", extension_of(material, GLOSSY)
    if not isinstance(look, dict) or key not in look:
        return None
    if not isinstance(look[key], dict):
        raise Refused(f"a material has the {key} {shown(str(look[key]))!r}, not an object", ONE_MATERIAL)
    return look[key]


def texture_set(info: dict) -> str:
    """Name of the attribute with the coordinates of a texture."""
    number = extension_of(info, _TRANSFORM).get("texCoord", info.get("texCoord", 0))
    return f"TEXCOORD_{whole(number, 'a texture with the texCoord', remedy=ONE_MATERIAL)}"


def texture_coordinates(info: dict, coordinates: np.ndarray) -> np.ndarray:
    """Coordinates scaled, then turned to ``(u cos + v sin, v cos - u sin)``, then moved.

    With v downwards this is anticlockwise, as the text of KHR_texture_transform and its example say. The
    matrix in the same specification turns the other way.

    Parameters
    ----------
    info : dict
        Part of a material, perhaps with KHR_texture_transform.
    coordinates : float64 array, shape (V, 2)
        u and v of the file.

    Returns
    -------
    float64 array, shape (V, 2)

    Raises
    ------
    Refused
        If a number of the transform is missing, not finite or over 1e30.
    """
    transform = extension_of(info, _TRANSFORM)
    if not transform:
        return coordinates
    (angle,) = _numbers(transform, "rotation", [0.0])
    cos, sin = math.cos(angle), math.sin(angle)
    scaled = coordinates * _numbers(transform, "scale", [1.0, 1.0])
    placed: np.ndarray = scaled @ np.array([[cos, -sin], [sin, cos]])
    return placed + _numbers(transform, "offset", [0.0, 0.0])


def _numbers(transform: dict, key: str, default: list[float]) -> list[float]:
    """One or two finite numbers of a transform."""
    value = transform.get(key, default if len(default) > 1 else default[0])
    numbers = value if len(default) > 1 else [value]
    usable = isinstance(numbers, list) and len(numbers) == len(default)
    for number in numbers if usable else []:
        usable &= type(number) in (int, float) and -_LARGEST <= number <= _LARGEST
    if not usable:
        many = "a finite number" if len(default) == 1 else f"{len(default)} finite numbers"
        raise Refused(f"a texture has the transform's {key} {shown(str(value))!r}, not {many}", ONE_MATERIAL)
    return [float(number) for number in numbers]


class GltfTextures:
    """Textures of a document, each read when a material needs it.

    Parameters
    ----------
    document : dict
        Document after `check_gltf`. Its images, textures and samplers are removed, so that nothing else opens
        an image.
    buffers : list of bytes
        From `gltf_buffers`.
    folder : Path
        Folder of the file.
    found : Found
        Records contents that are not read.
    """

    def __init__(self, document: dict, buffers: list[bytes], folder: Path, found: Found):
        self._parts = {name: document.pop(name, []) for name in ("textures", "samplers", "images")}
        self._views, self._buffers = document.get("bufferViews", []), buffers
        self._folder, self._found = folder, found
        self._made: dict[tuple[Any, ...], Texture | None] = {}

    def read(self, info: dict, alpha: str) -> Texture | None:
        """The texture to which a part of a material refers. ``None`` if its image is missing.

        Parameters
        ----------
        info : dict
            From `color_texture`.
        alpha : {"told", "left out", "read"}
            What becomes of the alpha of the image:

            - "told": it is recorded as not read;
            - "left out": the image is read with its alpha, and the alpha is then removed without a record;
            - "read": it is kept.

        Raises
        ------
        Refused
            If a reference leads nowhere, or the image or a number is not usable.
        """
        transform = extension_of(info, _TRANSFORM)
        for name, part in (("texture infos", info), (_TRANSFORM, transform)):
            self._found.tell_names(f"of {name}", part, _KNOWN[name] | _ANY)
        texture = self._part("textures", info.get("index"), "a material with the texture")
        image = texture.get("source", extension_of(texture, "EXT_texture_webp").get("source"))
        if image is None:
            why = texture.get("extensions") or ["no image"]
            self._found.tell_names("images of textures", why)
            return None
        sampler = {}
        if "sampler" in texture:
            sampler = self._part("samplers", texture["sampler"], "a texture with the sampler")
        options = self._options(sampler)
        options["alpha"] = alpha != "told"
        key = (str(image), *options.values())
        if key not in self._made:
            self._made[key] = self._texture(image, options)
        made = self._made[key]
        if alpha == "read" or made is None or not made.alpha.size:
            return made
        if (*key, alpha) not in self._made:
            self._made[(*key, alpha)] = replace(made, alpha=np.zeros((0, 0)))
        return self._made[(*key, alpha)]

    def _part(self, name: str, number: Any, what: str) -> dict:
        """A part of the document by its number."""
        rows = listed(self._parts, name)
        part = rows[whole(number, what, len(rows), ONE_MATERIAL)]
        self._found.tell_names(f"of {name}", part, _KNOWN[name] | _ANY)
        self._found.tell_names("extensions", part.get("extensions", {}), _IMAGES)
        return part

    def _options(self, sampler: dict) -> dict[str, Any]:
        """Wrap modes, filter, and whether levels are used, as for `load_texture`."""
        small, mipmapped = _chosen(sampler, "minFilter", _MIN, 9987)
        filter = _chosen(sampler, "magFilter", _MAG, 9728 if small == "nearest" else 9729)
        if filter != small and "minFilter" in sampler:
            self._found.tell_names("of samplers", ["minFilter of another kind than magFilter"])
        wrap = _chosen(sampler, "wrapS", _WRAPS, 10497), _chosen(sampler, "wrapT", _WRAPS, 10497)
        return {"wrap": wrap, "filter": filter, "mipmapped": mipmapped}

    def _texture(self, number: Any, options: dict[str, Any]) -> Texture | None:
        """The texture of an image."""
        image = self._part("images", number, "a texture with the image")
        uri, name = image.get("uri"), image.get("name")
        if uri is None and "bufferView" not in image:
            raise Refused(f"its image {number} has no data", ONE_MATERIAL)
        if uri is None:
            place = whole(image["bufferView"], "an image in the view", len(self._views), ONE_MATERIAL)
            data = view_bytes(self._views[place], self._buffers)
        elif not isinstance(uri, str):
            raise Refused(f"its image {number} has the uri {shown(str(uri))!r}, not a text", ONE_MATERIAL)
        elif holds_data(uri):
            data = data_of_uri(uri, f"its image {number}", ONE_MATERIAL)
        else:
            name = unquote(uri)
            target = self._target(uri)
            if target is None:
                return None
            return read_texture(target, self._found, name or None, **options)
        name = name if isinstance(name, str) and name else f"number {number}"
        return load_texture(data, name, self._found, **options)

    def _target(self, uri: str) -> Path | None:
        """The file of an image. ``None``, and a record, if the file is missing or outside the folder."""
        why = OUTSIDE
        try:
            target = inside(self._folder, uri, unquote(uri))
            if os.path.isfile(target):
                return target
            why = NOT_THERE
        except Refused:
            pass
        self._found.tell(f"the image {shown(unquote(uri))!r}, {why}")
        return None


def _chosen(sampler: dict, key: str, of: dict[int, Any], default: int) -> Any:
    """The value for which a code of a sampler stands."""
    value = sampler.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or value not in of:
        codes = ", ".join(map(str, of))
        raise Refused(f"a sampler has the {key} {shown(str(value))!r}, not one of {codes}", ONE_MATERIAL)
    return of[int(value)]
