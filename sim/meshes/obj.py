"""OBJ files and their material files, in the form that trimesh reads."""

import math
import os
import re
from functools import partial
from pathlib import Path

from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.sim.meshes.materials import FileMaterial, Found, color_of
from blysk.sim.meshes.refusal import ONE_MATERIAL, Refused, inside, shown, utf8

__all__ = ["find_obj_materials", "split_obj", "tidy_obj"]

# Bytes of a material file; 100,000 materials take less.
_MAX_LIBRARY = 16_000_000


def split_obj(data: bytes, found: Found) -> tuple[bytes, list[str]]:
    """An OBJ file with an object for each material, by its number, and its material files' names.

    Two materials must not become one by what looks like a comment: ``usemtl Material #25`` is a name.
    """
    numbers = {"": 0}
    libraries = []

    def replaced(line):
        keyword, rest = line[1], line[2].decode("utf-8").strip()
        if keyword == b"mtllib":
            libraries.append(rest)
        if keyword != b"usemtl":
            return b""
        if rest not in numbers:
            numbers[rest] = len(numbers)
            found.names.append(rest)
            found.readers.append(None)
        return b"o %d" % numbers[rest]

    data = re.sub(rb"\\\r?\n", b"", utf8(data))
    data = re.sub(rb"^[ \t]*(o|usemtl|mtllib)(?![^\s])([^\n]*)", replaced, data, flags=re.MULTILINE)
    return data, libraries


def find_obj_materials(libraries: list[str], folder: Path, found: Found) -> None:
    """Look up the names of materials in the material files; the texts are read where a face uses them."""
    texts = {}
    for name in dict.fromkeys(libraries):
        # A name with spaces, or several names.
        for part in [name] if os.path.isfile(inside(folder, name)) else name.split():
            target = inside(folder, part)
            if not os.path.isfile(target):
                found.ignored.append(f"the material file {shown(part)!r}, which does not exist")
                continue
            if target.stat().st_size > _MAX_LIBRARY:
                raise Refused(
                    f"its material file {shown(part)!r} is over {_MAX_LIBRARY:,} bytes", "shorten it"
                )
            blocks = re.split(
                r"^[ \t]*newmtl(?!\S)", target.read_text("utf-8-sig", "replace"), flags=re.MULTILINE
            )
            for block in blocks[1:]:
                first, _, text = block.partition("\n")
                texts.setdefault(first.strip(), text)
    for number, name in enumerate(found.names[1:], 1):
        bare = name.partition(" #")[0].strip()
        text = texts.get(name, texts.get(bare))
        found.readers[number] = None if text is None else partial(_mtl_material, text, shown(name))
    if missing := found.readers[1:].count(None):
        found.ignored.append(f"{missing} material name{'s' * (missing > 1)} without a definition")


def _mtl_material(text: str, name: str) -> tuple[FileMaterial, int]:
    """A material of a material file, and how many textures it has."""
    values, textures = {}, 0
    for line in text.splitlines():
        keyword, *words = line.partition("#")[0].split() or [""]
        if re.match("map_|norm$|bump$|disp$|decal$|refl$", keyword.lower()):
            textures += 1
        elif keyword in ("Kd", "Ks", "Ns"):
            values[keyword] = words
    colors = {}
    for keyword in ("Kd", "Ks"):
        if keyword in values:
            # One number is for all channels.
            given = values[keyword] * 3 if len(values[keyword]) == 1 else values[keyword]
            colors[keyword] = color_of([_float(word) for word in given], keyword, name, " ".join(given))
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
    return FileMaterial(name, colors.get("Kd"), colors.get("Ks"), exponent), textures


def _float(word: str) -> float:
    """A number, or NaN."""
    try:
        return float(word)
    except ValueError:
        return math.nan


def tidy_obj(data: bytes) -> bytes:
    """An OBJ file in the form that trimesh reads; face lines that it would take wrongly are refused."""
    data = re.sub(rb"#.*", b"", data)
    data = re.sub(rb"^[ \t]*(v|vn|vt|f)[ \t]+", rb"\1 ", data, flags=re.MULTILINE)
    if re.search(rb"^f(?: +[^\s]+){0,2}[ \t]*\r?$", data, re.MULTILINE):
        raise Refused("a face has fewer than 3 corners")
    if re.search(rb"^f .*(?<= )-?0+(?=[/\s]|\Z)", data, re.MULTILINE):
        raise Refused("a face has the vertex index 0; they count from 1")
    # trimesh counts relative indices from the end of the file, not from the face.
    relative = re.search(rb"^f .*[ /]-\d", data, re.MULTILINE)
    if relative and re.search(rb"^vn? ", data[relative.end() :], re.MULTILINE):
        raise Refused("relative face indices with vertices after them", "export it with absolute indices")
    return data
