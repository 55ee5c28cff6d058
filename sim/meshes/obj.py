"""OBJ files and their material files, in the form that trimesh reads."""

import math
import os
import re
from functools import partial
from pathlib import Path

import numpy as np

from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.sim.meshes.materials import FileMaterial, Found, color_of
from blysk.sim.meshes.polygons import check_corners, triangulated
from blysk.sim.meshes.refusal import ONE_MATERIAL, Refused, inside, shown, utf8

__all__ = ["find_obj_materials", "split_obj", "tidy_obj"]

# Bytes of a material file; 100,000 materials take less.
_MAX_LIBRARY = 16_000_000


def split_obj(data: bytes, found: Found) -> tuple[bytes, list[str]]:
    """An OBJ file with an object for each material, named by its number, and the names of its material files.

    The text after ``#`` is part of a material's name, as in ``usemtl Material #25``, and no comment.
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
    """Find the materials' definitions in the material files; a definition is read if a face uses it."""
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
    """A material of a material file, and how many textures it has.

    If it has a roughness Pr or a metallic factor Pm, these replace Ks and Ns; a missing Pr is then 1, a
    missing Pm 0, and a missing Kd white.
    """
    values, textures = {}, 0
    for line in text.splitlines():
        keyword, *words = line.partition("#")[0].split() or [""]
        if re.match("map_|norm$|bump$|disp$|decal$|refl$", keyword.lower()):
            textures += 1
        elif keyword in ("Kd", "Ks", "Ns", "Pr", "Pm"):
            values[keyword] = words
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
    if factors.keys() & values.keys():
        base = colors.get("Kd", (1.0, 1.0, 1.0))
        return FileMaterial.of_metallic_roughness(name, base, *factors.values()), textures
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


# Possessive: a line is looked at once.
_NUMBER = rb"[-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++|[nN][aA][nN]|[iI][nN][fF])(?:[eE][-+]?[0-9]++)?"
_THREE = rb"%b(?:[ \t]++%b){2}+" % (_NUMBER, _NUMBER)
_CORNER = rb"-?[0-9]++(?:/-?[0-9]*+){0,2}+"
_END = rb"[ \t]*+\r?$"


def tidy_obj(data: bytes, found: Found) -> bytes:
    """An OBJ file in the form that trimesh reads: positions of 3 numbers, and faces of 3 corners.

    Lines that trimesh would read wrongly are refused: numbers in another form than C's, positions with a
    weight other than 1, indices that are 0.
    """
    data = re.sub(rb"#.*", b"", data)
    if re.search(rb"^(?:[ \t]++(?:vn?|vt|f)[ \t]|(?:vn?|vt|f)(?:\t| [ \t]))", data, re.MULTILINE):
        data = re.sub(rb"^[ \t]*(v|vn|vt|f)[ \t]+", rb"\1 ", data, flags=re.MULTILINE)
    if re.search(rb"^vn? (?!%b%b)" % (_THREE, _END), data, re.MULTILINE):
        data = _positions(data, found)
    if re.search(rb"^f(?: +[^\s]+){0,2}[ \t]*\r?$", data, re.MULTILINE):
        raise Refused("a face has fewer than 3 corners")
    corners = rb"^f (?!%b(?:[ \t]++%b)*+%b)([^\n]*)" % (_CORNER, _CORNER, _END)
    if bad := re.search(corners, data, re.MULTILINE):
        raise Refused(f"a face has the corners {shown(bad[1].decode().strip())!r}, not indices")
    if re.search(rb"^f .*(?<= )-?0+(?=[/\s]|\Z)", data, re.MULTILINE):
        raise Refused("a face has the vertex index 0; they count from 1")
    if re.search(rb"^f .*[ /]-\d", data, re.MULTILINE):
        data = _absolute(data)
    return _triangular(data)


def _absolute(data: bytes) -> bytes:
    """The text with absolute indices: trimesh counts relative ones from the end of the file."""
    counts = {b"v": 0, b"vt": 0, b"vn": 0}

    def absolute(corner):
        kinds = zip(counts, corner[0].split(b"/"), strict=False)
        return b"/".join(counted(kind, index) for kind, index in kinds)

    def counted(kind, index):
        if not index.startswith(b"-"):
            return index
        if int(index) < -counts[kind]:
            raise Refused(
                f"a face has the index {index.decode()}, with {counts[kind]} {kind.decode()} before it"
            )
        return b"%d" % (counts[kind] + 1 + int(index))

    def replaced(line):
        if line[1] == b"f":
            return b"f " + re.sub(rb"[^\s]+", absolute, line[2])
        counts[line[1]] += 1
        return line[0]

    return re.sub(rb"^(vn|vt|v|f) ([^\n]*)", replaced, data, flags=re.MULTILINE)


def _positions(data: bytes, found: Found) -> bytes:
    """The text with three numbers for each position, without weights and colours."""
    wrong = rb"^(?:v (?!%b(?:[ \t]++%b){0,5}+%b)|vn (?!%b%b))([^\n]*)" % (_THREE, _NUMBER, _END, _THREE, _END)
    if bad := re.search(wrong, data, re.MULTILINE):
        raise Refused(f"a position or normal is {shown(bad[1].decode().strip())!r}, not 3 numbers")
    weights = re.findall(rb"^v %b[ \t]++(%b)%b" % (_THREE, _NUMBER, _END), data, re.MULTILINE)
    if any(float(weight) != 1 for weight in weights):
        raise Refused("a position has a weight w other than 1", "export it without weights")
    if re.search(rb"^v %b(?:[ \t]++%b){2}+%b" % (_THREE, _NUMBER, _END), data, re.MULTILINE):
        raise Refused("a position has 5 numbers", "give x y z, and red green blue after them")
    if re.search(rb"^v %b(?:[ \t]++%b){3}" % (_THREE, _NUMBER), data, re.MULTILINE):
        found.ignored.append("vertex colours")
    return re.sub(rb"^(v %b)[^\n]*" % _THREE, rb"\1", data, flags=re.MULTILINE)


def _triangular(data: bytes) -> bytes:
    """The text with polygons cut into triangles, a line for each."""
    lines = list(re.finditer(rb"^f (\S++(?:[ \t]++\S++){3,}+)%b" % _END, data, re.MULTILINE))
    if not lines:
        return data
    numbers = b" ".join(re.findall(rb"^v ([^\n]*)", data, re.MULTILINE)).split()
    vertices = np.array(numbers).astype(np.float64).reshape(-1, 3)
    faces = [line[1].split() for line in lines]
    sides = np.array([len(face) for face in faces])
    texts: list[list[bytes]] = [[] for _ in faces]
    for count in np.unique(sides).tolist():
        chosen = np.flatnonzero(sides == count).tolist()
        indices = np.array([[int(corner.partition(b"/")[0]) for corner in faces[k]] for k in chosen])
        polygons = np.where(indices > 0, indices - 1, indices + len(vertices))
        check_corners(polygons, len(vertices))
        corners, owners = triangulated(vertices, polygons)
        for owner, (a, b, c) in zip(owners.tolist(), corners.tolist(), strict=True):
            face = faces[chosen[owner]]
            texts[chosen[owner]].append(b"f " + b" ".join((face[a], face[b], face[c])))
    pieces, start = [], 0
    for line, text in zip(lines, texts, strict=True):
        pieces += [data[start : line.start()], b"\n".join(text)]
        start = line.end()
    return b"".join([*pieces, data[start:]])
