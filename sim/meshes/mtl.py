"""Material files of OBJ files: colours, and images."""

import math
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.reference.light import Triple
from blysk.golden.reference.texture import Texture
from blysk.golden.text import plain_text
from blysk.sim.meshes.images import NOT_THERE, OUTSIDE, find_image, read_texture
from blysk.sim.meshes.materials import FileMaterial, Found, color_of
from blysk.sim.meshes.refusal import ONE_MATERIAL, Refused, inside, refers, shown
from blysk.sim.run_files import reads

__all__ = ["ObjImage", "find_obj_materials", "plain_lines"]

# Keywords that are read, and keywords that have an effect only together with keywords of `_UNREAD`.
_KNOWN = {"Kd", "Ks", "Ke", "Ns", "Pr", "Pm", "Ni", "sharpness", "Pcr", "anisor", "map_aat"}
# Keywords that are not read: the meaning, and the number that changes nothing.
_UNREAD = {
    "d": ("alpha", 1),
    "Tr": ("alpha", 0),
    "Tf": ("transmission", 1),
    "Ka": ("ambient colour", math.nan),
    "Ps": ("sheen", 0),
    "Pc": ("clearcoat", 0),
    "aniso": ("anisotropy", 0),
    "illum": ("", 2),
}
_ALPHA_MAPS = ("map_d", "map_Tr")
# Largest material file in bytes. A file of 100,000 materials is smaller.
_MAX_LIBRARY = 16_000_000
_IMAGE = re.compile(
    r"^[ \t]*(?:map_\w+|norm|bump|disp|decal|refl)[ \t]+(\S.*)$", re.MULTILINE | re.IGNORECASE
)


def plain_lines(data: bytes) -> bytes:
    """A text without comments, and each statement in a line of its own. In names ``#`` begins no comment."""

    def without_comment(line):
        name = line[1] or b""
        return name.rstrip(b"\\") if b"#" in name else name

    data = plain_text(data, "replace").encode()
    names = rb"^([ \t]*(?:usemtl|mtllib|newmtl|map_[Kk]d)(?!\S)[^\n]*)|#[^\n]*"
    data = re.sub(names, without_comment, data, flags=re.MULTILINE)
    return re.sub(rb"\\[ \t]*\n", b" ", data)


class ObjImage(NamedTuple):
    """Image of a material, by ``map_Kd``: texture coordinates are scaled, then moved."""

    name: str
    target: Path | None
    """``None`` if the image is not read."""
    reason: str
    """Why the image is not read."""
    scale: tuple[float, float]
    offset: tuple[float, float]
    wrap: str
    unread: tuple[str, ...]
    """Options that are not read."""

    def placed(self, coordinates: np.ndarray) -> np.ndarray:
        """Coordinates for `Texture`, from coordinates of the file. In the file v is 0 at the lower border."""
        placed: np.ndarray = coordinates * self.scale + self.offset
        return np.column_stack([placed[:, 0], 1 - placed[:, 1]])


def find_obj_materials(libraries: list[str], folder: Path, found: Found) -> dict[int, ObjImage]:
    """Find the materials' definitions in the material files, and the images of materials.

    Definitions and images are read only if a face uses them.
    """
    blocks, commented = {}, {}
    for target in dict.fromkeys(file for name in libraries for file in _library_files(name, folder, found)):
        if target.stat().st_size > _MAX_LIBRARY:
            raise Refused(
                f"its material file {shown(target.name)!r} is over {_MAX_LIBRARY:,} bytes", "shorten it"
            )
        reads(target)
        library = plain_lines(target.read_bytes()).decode()
        for rest in _IMAGE.findall(library):
            refers(folder, rest.strip(), rest.split()[-1])
        for block in re.split(r"^[ \t]*newmtl(?!\S)", library, flags=re.MULTILINE)[1:]:
            first, _, text = block.partition("\n")
            known, _ = blocks.setdefault(first.strip(), (text, target.parent))
            if known.split() != text.split():
                found.tell("second definition of a material", "second definitions of materials")
            commented.setdefault(first.partition(" #")[0].strip(), (text, target.parent))
    images: dict[int, ObjImage] = {}
    textures: dict[tuple[Path, str], Texture] = {}
    for number, name in enumerate(found.names[1:], 1):
        bare = name.partition(" #")[0].strip()
        block = blocks.get(name, blocks.get(bare, commented.get(name)))
        if block is None:
            continue
        text, beside = block
        statements = re.findall(r"^[ \t]*map_Kd[ \t]+(\S.*)$", text, re.MULTILINE | re.IGNORECASE)
        if statements:
            images[number] = image = _image(statements[-1].strip(), beside, folder)
            refers(folder, *([] if image.target is None else [str(image.target)]))
        read = partial(_texture, images.get(number), textures, found)
        found.readers[number] = partial(_mtl_material, text, shown(name), read, found)
    missing = found.readers[1:].count(None)
    found.tell("material name without a definition", "material names without a definition", missing)
    return images


# Options of an image: least and largest number of values, and a pattern of values that change nothing.
_OPTIONS = {
    **{"-s": (1, 3, None), "-o": (1, 3, None), "-clamp": (1, 1, None), "-t": (1, 3, r"[0.\s]+")},
    **{"-mm": (2, 2, r"0(\.0*)?\s+1(\.0*)?"), "-blendu": (1, 1, "on"), "-blendv": (1, 1, "on")},
    **{"-cc": (1, 1, "off"), "-texres": (1, 1, ".*"), "-boost": (1, 1, ".*"), "-bm": (1, 1, r"1(\.0*)?")},
    **{"-imfchan": (1, 1, None), "-type": (1, 1, None), "-colorspace": (1, 1, "sRGB|srgb")},
}
_VALUE = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"


def _image(statement: str, beside: Path, folder: Path) -> ObjImage:
    """The image of a statement: options, then a name, which may have spaces."""
    values: dict[str, str] = {}
    unread = []
    while option := re.match(r"(-[a-zA-Z]+)\s+(?=\S)", statement):
        name = option[1].lower()
        if name not in _OPTIONS:
            break
        least, most, neutral = _OPTIONS[name]
        kind = _VALUE if name in ("-s", "-o", "-t", "-mm", "-bm", "-boost", "-texres") else r"\S+"
        found = re.match(rf"(?:{kind}\s+){{{least},{most}}}(?=\S)", statement[option.end() :])
        if found is None:
            break
        values[name] = found[0].strip()
        if name not in ("-s", "-o", "-clamp") and not (neutral and re.fullmatch(neutral, values[name])):
            unread.append(f"{name} {' '.join(values[name].split())}")
        statement = statement[option.end() + found.end() :]
    pairs = []
    for name, default in (("-s", 1.0), ("-o", 0.0)):
        numbers = [float(word) for word in values.get(name, "").split()]
        pairs.append(tuple([*numbers[:2], *[default] * 2][:2]))
    wrap = "clamp" if values.get("-clamp", "").lower() == "on" else "repeat"
    return ObjImage(statement, *find_image(statement, folder, beside), *pairs, wrap, tuple(unread))


def _texture(
    image: ObjImage | None, textures: dict[tuple[Path, str], Texture], found: Found
) -> Texture | None:
    """The texture of a material; each image is read once."""
    if image is None:
        return None
    found.tell_names("options of map_Kd", image.unread)
    if image.target is None:
        found.tell(f"the image {shown(image.name)!r}, {image.reason}")
        return None
    key = image.target, image.wrap
    if key not in textures:
        textures[key] = read_texture(image.target, found, wrap=(image.wrap, image.wrap))
    return textures[key]


def _library_files(name: str, folder: Path, found: Found) -> list[Path]:
    """Files that a statement names: a name with spaces, or several names. Missing files are recorded."""
    bare = name.partition(" #")[0].strip()
    files, reasons = [], {}
    for part in dict.fromkeys([name, bare, *bare.split()]):
        try:
            target = inside(folder, part, part.replace("\\", "/"))
        except Refused:
            reasons[part] = OUTSIDE
            continue
        if not os.path.isfile(target):
            reasons[part] = NOT_THERE
        elif part in (name, bare):
            return [target]
        else:
            files.append(target)
    if name and not files:
        reasons = {bare: max(reasons.values(), key=[NOT_THERE, OUTSIDE].index)}
    for part in bare.split() if files else [bare]:
        if part in reasons:
            found.tell(f"the material file {shown(part)!r}, {reasons[part]}")
    return files


def _mtl_material(text: str, name: str, texture: Callable[[], Texture | None], found: Found) -> FileMaterial:
    """A material of a material file.

    Texels of map_Kd multiply Kd, which is white if it is missing. Ke, without an image of its own, is light
    that the surface emits. With illum 0 the surface shows Kd, whatever the lights.

    If the material has a roughness Pr or a metallic factor Pm, these replace Ks and Ns. A missing Pr is then
    1, a missing Pm 0, and a missing Kd white. Other statements that change the look are recorded as not read.
    """
    values: dict[str, list[str]] = {}
    maps: dict[str, list[str]] = {}
    for line in text.split("\n"):
        keyword, *words = line.split() or [""]
        is_map = re.match("map_|norm$|bump$|disp$|decal$|refl$", keyword.lower()) and keyword != "map_aat"
        if keyword:
            (maps if is_map else values)[keyword.lower() if is_map else keyword] = words
    # Texels of map_Kd multiply ambient light, too. So map_Ka with the same image counts as read.
    drawn = maps.pop("map_kd", None)
    if drawn == []:
        found.tell_names("of materials", ["map_Kd without a file"])
    found.tell_names("of materials", (f"alpha ({key})" for key in _ALPHA_MAPS if maps.pop(key.lower(), None)))
    others = [words for keyword, words in maps.items() if keyword != "map_ka" or words != drawn]
    found.tell("texture", "textures", len(others))
    found.tell_names("of materials", _unread(values))
    colors = {}
    for keyword in ("Kd", "Ks"):
        if keyword in values:
            # One number is for all channels.
            given = values[keyword] * 3 if len(values[keyword]) == 1 else values[keyword]
            colors[keyword] = color_of([_float(word) for word in given], keyword, name, " ".join(given))
    factors = {"Pm": 0.0, "Pr": 1.0}
    for keyword in factors.keys() & values.keys():
        given = " ".join(values[keyword])
        if not 0 <= (number := _float(given)) <= 1:
            raise Refused(
                f"material {name!r} has {keyword} {shown(given)!r}, not a number from 0 to 1", ONE_MATERIAL
            )
        factors[keyword] = number
    looks: dict[str, Any] = {"texture": texture(), "unlit": values.get("illum") == ["0"]}
    if "Ke" in values and "map_ke" not in maps:
        looks["emission"] = _emission(values["Ke"], name)
    if factors.keys() & values.keys():
        base = colors.get("Kd", (1.0, 1.0, 1.0))
        return replace(FileMaterial.of_metallic_roughness(name, base, *factors.values()), **looks)
    exponent = None
    if "Ns" in values:
        number = _float(" ".join(values["Ns"]))
        if not 0 <= number <= MAX_EXPONENT:
            raise Refused(
                f"material {name!r} has Ns {shown(' '.join(values['Ns']))!r}, not a number from 0 to "
                f"{MAX_EXPONENT}",
                ONE_MATERIAL,
            )
        exponent = max(1, math.floor(number + 0.5))
    return FileMaterial(name, colors.get("Kd"), colors.get("Ks"), exponent, **looks)


def _emission(words: list[str], name: str) -> Triple | None:
    """Light that a material emits; ``None`` if it is 0."""
    numbers = [_float(word) for word in (words * 3 if len(words) == 1 else words)]
    if len(numbers) != 3 or not all(0 <= number < math.inf for number in numbers):
        raise Refused(
            f"material {name!r} has Ke {shown(' '.join(words))!r}, not three numbers of at least 0",
            ONE_MATERIAL,
        )
    red, green, blue = numbers
    return (red, green, blue) if any(numbers) else None


def _unread(values: dict[str, list[str]]) -> Iterator[str]:
    """Keywords of a material that change its look and are not read, with their meanings."""
    for keyword, words in values.items():
        numbers = [_float(word) for word in words]
        meaning, neutral = _UNREAD.get(keyword, ("", math.nan))
        if keyword in _KNOWN or (numbers and all(number == neutral for number in numbers)):
            continue
        if keyword == "Tr" and "d" in values:
            continue
        if keyword == "illum":
            # illum 0 is without lights, and illum 1 without a highlight.
            if words == ["0"] or (numbers == [1] and not any(map(_float, values.get("Ks", ["1"])))):
                continue
            yield " ".join([keyword, *words])
        else:
            yield f"{meaning} ({keyword})" if meaning else keyword


def _float(word: str) -> float:
    """A number, or NaN."""
    try:
        return float(word)
    except ValueError:
        return math.nan
