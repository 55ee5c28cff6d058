"""OBJ files and their material files, in the form that trimesh reads."""

import math
import os
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.text import plain_text
from blysk.sim.meshes.materials import FileMaterial, Found, color_of
from blysk.sim.meshes.polygons import check_corners, triangulated
from blysk.sim.meshes.refusal import ONE_MATERIAL, Refused, inside, refers, shown
from blysk.sim.run_files import reads

__all__ = ["find_obj_materials", "split_obj", "tidy_obj"]

# Statements that are read, and those that only name parts; texture coordinates are told with the textures.
_STATEMENTS = {"usemtl", "mtllib", "o", "g", "s", "vt"}
# Keywords of materials that are read, and those that count only together with others that are told.
_KNOWN = {"Kd", "Ks", "Ns", "Pr", "Pm", "Ni", "sharpness", "Pcr", "anisor", "map_aat"}
# Others, each with its meaning, and with the number that changes nothing.
_UNREAD = {
    "d": ("alpha", 1),
    "Tr": ("alpha", 0),
    "Tf": ("transmission", 1),
    "Ke": ("emission", 0),
    "Ka": ("ambient colour", math.nan),
    "Ps": ("sheen", 0),
    "Pc": ("clearcoat", 0),
    "aniso": ("anisotropy", 0),
    "illum": ("", 2),
}
# Why a material file is not read.
_REASONS = ("which does not exist", "outside its folder")
# Bytes of a material file; 100,000 materials take less.
_MAX_LIBRARY = 16_000_000
_IMAGE = re.compile(
    r"^[ \t]*(?:map_\w+|norm|bump|disp|decal|refl)[ \t]+(\S.*)$", re.MULTILINE | re.IGNORECASE
)


def split_obj(data: bytes, found: Found) -> tuple[bytes, list[str]]:
    """An OBJ file with an object for each material, named by its number, and the names of its material files.

    Statements of positions, normals, faces and the objects stay, a line for each. Statements of other kinds
    are told. A backslash at the end of a line continues the line, but not in a comment. The text after ``#``
    is part of a material's name, as in ``usemtl Material #25``, and no comment.
    """
    numbers = {"": 0}
    libraries = []
    smooth = False

    def replaced(line):
        nonlocal smooth
        keyword, rest = line[1].decode("utf-8"), line[2].decode("utf-8").strip()
        smooth |= keyword == "s"
        if keyword == "mtllib":
            libraries.append(rest)
        found.tell_names("statements", [keyword], _STATEMENTS)
        if keyword != "usemtl":
            return b""
        if rest not in numbers:
            numbers[rest] = len(numbers)
            found.names.append(rest)
            found.readers.append(None)
        return b"o %d\n" % numbers[rest]

    data = _joined(data)
    data = re.sub(rb"^[^\S\n]*+(?!(?:vn?|f)(?!\S))(\S++)([^\n]*)\n?", replaced, data, flags=re.MULTILINE)
    # Texture coordinates have gone.
    data = re.sub(rb"(?<!\S)(-?[0-9]++)/-?[0-9]*+/(-?[0-9]++)(?!\S)", rb"\1//\2", data)
    data = re.sub(rb"(?<!\S)(-?[0-9]++)/-?[0-9]*+/?+(?!\S)", rb"\1", data)
    if smooth and re.search(rb"^[ \t]*f[ \t]+[^\s/]+(?!\S)", data, re.MULTILINE):
        found.tell("smoothing groups (--crease says which edges are sharp)")
    return data, libraries


def _joined(data: bytes) -> bytes:
    """A text without comments, each statement in a line of its own; names keep what looks like a comment."""

    def without_comment(line):
        name = line[1] or b""
        return name.rstrip(b"\\") if b"#" in name else name

    data = plain_text(data, "replace").encode()
    names = rb"^([ \t]*(?:usemtl|mtllib|newmtl)(?!\S)[^\n]*)|#[^\n]*"
    data = re.sub(names, without_comment, data, flags=re.MULTILINE)
    return re.sub(rb"\\[ \t]*\n", b" ", data)


def find_obj_materials(libraries: list[str], folder: Path, found: Found) -> None:
    """Find the materials' definitions in the material files. A definition is read if a face uses it."""
    texts, commented = {}, {}
    for target in dict.fromkeys(file for name in libraries for file in _library_files(name, folder, found)):
        if target.stat().st_size > _MAX_LIBRARY:
            raise Refused(
                f"its material file {shown(target.name)!r} is over {_MAX_LIBRARY:,} bytes", "shorten it"
            )
        reads(target)
        library = _joined(target.read_bytes()).decode()
        for rest in _IMAGE.findall(library):
            refers(folder, rest.strip(), rest.split()[-1])
        for block in re.split(r"^[ \t]*newmtl(?!\S)", library, flags=re.MULTILINE)[1:]:
            first, _, text = block.partition("\n")
            texts.setdefault(first.strip(), text)
            commented.setdefault(first.partition(" #")[0].strip(), text)
    for number, name in enumerate(found.names[1:], 1):
        bare = name.partition(" #")[0].strip()
        text = texts.get(name, texts.get(bare, commented.get(name)))
        found.readers[number] = None if text is None else partial(_mtl_material, text, shown(name), found)
    missing = found.readers[1:].count(None)
    found.tell("material name without a definition", "material names without a definition", missing)


def _library_files(name: str, folder: Path, found: Found) -> list[Path]:
    """Files that a statement names, as a name with spaces, or as several names; others are told."""
    bare = name.partition(" #")[0].strip()
    files, reasons = [], {}
    for part in dict.fromkeys([name, bare, *bare.split()]):
        try:
            target = inside(folder, part, part.replace("\\", "/"))
        except Refused:
            reasons[part] = _REASONS[1]
            continue
        if not os.path.isfile(target):
            reasons[part] = _REASONS[0]
        elif part in (name, bare):
            return [target]
        else:
            files.append(target)
    if name and not files:
        reasons = {bare: max(reasons.values(), key=_REASONS.index)}
    for part in bare.split() if files else [bare]:
        if part in reasons:
            found.tell(f"the material file {shown(part)!r}, {reasons[part]}")
    return files


def _mtl_material(text: str, name: str, found: Found) -> FileMaterial:
    """A material of a material file.

    If it has a roughness Pr or a metallic factor Pm, these replace Ks and Ns; a missing Pr is then 1, a
    missing Pm 0, and a missing Kd white. What else changes its look is told.
    """
    values = {}
    for line in text.split("\n"):
        keyword, *words = line.split() or [""]
        if re.match("map_|norm$|bump$|disp$|decal$|refl$", keyword.lower()) and keyword != "map_aat":
            found.tell("texture", "textures")
        elif keyword:
            values[keyword] = words
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
    if factors.keys() & values.keys():
        base = colors.get("Kd", (1.0, 1.0, 1.0))
        return FileMaterial.of_metallic_roughness(name, base, *factors.values())
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
    return FileMaterial(name, colors.get("Kd"), colors.get("Ks"), exponent)


def _unread(values: dict[str, list[str]]) -> Iterator[str]:
    """Keywords of a material that change its look and are not read, with what they mean."""
    for keyword, words in values.items():
        numbers = [_float(word) for word in words]
        meaning, neutral = _UNREAD.get(keyword, ("", math.nan))
        if keyword in _KNOWN or (numbers and all(number == neutral for number in numbers)):
            continue
        if keyword == "Tr" and "d" in values:
            continue
        if keyword == "illum":
            # 1 is without a highlight.
            if numbers == [1] and not any(map(_float, values.get("Ks", ["1"]))):
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


# Possessive: a line is looked at once.
_NUMBER = rb"[-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++|[nN][aA][nN]|[iI][nN][fF])(?:[eE][-+]?[0-9]++)?"
_THREE = rb"%b(?:[ \t]++%b){2}+" % (_NUMBER, _NUMBER)
_CORNER = rb"-?[0-9]++(?:/-?[0-9]*+){0,2}+"
_END = rb"[ \t]*+\r?$"


def tidy_obj(data: bytes, found: Found) -> bytes:
    """An OBJ file in the form that trimesh reads, with positions of 3 numbers and faces of 3 corners.

    Lines that trimesh would read wrongly are refused:

    - numbers in another form than C's;
    - positions with a weight other than 1;
    - indices that are 0;
    - missing normals, for which trimesh leaves out all others.
    """
    if re.search(rb"^(?:[ \t]++(?:vn?|f)[ \t]|(?:vn?|f)(?:\t| [ \t]))", data, re.MULTILINE):
        data = re.sub(rb"^[ \t]*(v|vn|f)[ \t]+", rb"\1 ", data, flags=re.MULTILINE)
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
    normals, faces = (
        len(re.findall(rb"^vn ", data, re.MULTILINE)),
        re.findall(rb"^f [^\n]*", data, re.MULTILINE),
    )
    used = map(int, set(re.findall(rb"\d/\d*/(\d+)", b"\n".join(faces))))
    if wrong := [index for index in used if not 1 <= index <= normals]:
        raise Refused(f"a face has the normal {max(wrong)}, but there are {normals} normals")
    return _triangular(data)


def _absolute(data: bytes) -> bytes:
    """The text with absolute indices: trimesh counts relative ones from the end of the file."""
    counts = {b"v": 0, b"": 0, b"vn": 0}

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

    return re.sub(rb"^(vn|v|f) ([^\n]*)", replaced, data, flags=re.MULTILINE)


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
        found.tell("vertex colours")
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
