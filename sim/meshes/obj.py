"""OBJ files: triangles with normals, colours and texture coordinates."""

import re
from collections.abc import Mapping

import numpy as np

from blysk.sim.meshes.colors import vertex_colors
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.mtl import ObjImage, plain_lines
from blysk.sim.meshes.parts import Part, distinct
from blysk.sim.meshes.polygons import check_corners, cut_polygons
from blysk.sim.meshes.refusal import Refused, shown

__all__ = ["read_obj", "split_obj"]

# Statements that are read, and statements that only name parts.
_STATEMENTS = {"usemtl", "mtllib", "o", "g", "s", "vt"}


def split_obj(data: bytes, found: Found, painted: bool) -> tuple[bytes, list[str]]:
    """An OBJ text with an object for each material, and the names of material files.

    An object's name is the number of its material. Statements of positions, normals, texture coordinates,
    faces and objects stay, each in a line of its own. Statements of other kinds are recorded as not read. A
    backslash at the end of a line continues the line, but not in a comment. In a material's name ``#`` begins
    no comment, as in ``usemtl Material #25``. If the file is ``painted``, colours in comments are recorded as
    not read.
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

    # ZBrush writes colours into comments.
    if painted and re.search(rb"(?:\A|[\r\n])[ \t]*+#MRGB[ \t]", data):
        found.tell("vertex colours in comments (#MRGB)")
    data = plain_lines(data)
    data = re.sub(rb"^[^\S\n]*+(?!(?:v[nt]?|f)(?!\S))(\S++)([^\n]*)\n?", replaced, data, flags=re.MULTILINE)
    if smooth and re.search(rb"^[ \t]*f[ \t]+[^\s/]+(?:/[^\s/]*)?(?!\S)", data, re.MULTILINE):
        found.tell("smoothing groups (--crease says which edges are sharp)")
    return data, libraries


# Possessive quantifiers, so that a line is scanned once.
_NUMBER = rb"[-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++|[nN][aA][nN]|[iI][nN][fF])(?:[eE][-+]?[0-9]++)?"
_THREE = rb"%b(?:[ \t]++%b){2}+" % (_NUMBER, _NUMBER)
_CORNER = rb"-?[0-9]++(?:/-?[0-9]*+){0,2}+"
_END = rb"[ \t]*+\r?$"


def read_obj(data: bytes, found: Found, images: Mapping[int, ObjImage], painted: bool) -> list[Part]:
    """Triangles of a text from `split_obj`.

    Parameters
    ----------
    data : bytes
        The text.
    found : Found
        Records contents that are not read.
    images : mapping of int to ObjImage
        Images of materials. Texture coordinates of other materials are left out.
    painted : bool
        Whether to read colours of vertices.

    Raises
    ------
    Refused
        - A number is not written as in C, or a position has a weight other than 1.
        - A face has fewer than 3 corners, or an index without a vertex, normal or texture coordinates.
        - A colour is out of range.
    """
    if re.search(rb"^(?:[ \t]++(?:v[nt]?|f)[ \t]|(?:v[nt]?|f)(?:\t| [ \t]))", data, re.MULTILINE):
        data = re.sub(rb"^[ \t]*(v[nt]?|f)[ \t]+", rb"\1 ", data, flags=re.MULTILINE)
    if not images:
        data = re.sub(rb"(?<!\S)(-?[0-9]++)/-?[0-9]*+/(-?[0-9]++)(?!\S)", rb"\1//\2", data)
        data = re.sub(rb"(?<!\S)(-?[0-9]++)/-?[0-9]*+/?+(?!\S)", rb"\1", data)
    colors = None
    if re.search(rb"^vn? (?!%b%b)" % (_THREE, _END), data, re.MULTILINE):
        data, colors = _positions(data, found, painted)
    if re.search(rb"^f(?: +[^\s]+){0,2}[ \t]*\r?$", data, re.MULTILINE):
        raise Refused("a face has fewer than 3 corners")
    corners = rb"^f (?!%b(?:[ \t]++%b)*+%b)([^\n]*)" % (_CORNER, _CORNER, _END)
    if bad := re.search(corners, data, re.MULTILINE):
        raise Refused(f"a face has the corners {shown(bad[1].decode().strip())!r}, not indices")
    if re.search(rb"^f .*(?<= )-?0+(?=[/\s]|\Z)", data, re.MULTILINE):
        raise Refused("a face has the vertex index 0, but the first vertex has index 1")
    if re.search(rb"^f\b.*[ \t/]-\d", data, re.MULTILINE):
        data = _absolute(data)
    vertices, normals = _rows(data, b"v"), _rows(data, b"vn")
    coordinates = _coordinates(data) if images else np.zeros((0, 2))
    triangles, numbers = _triangles(data, vertices, len(coordinates), len(normals))
    parts = []
    for number in np.unique(numbers).tolist():
        keys = triangles[numbers == number].reshape(-1, 3)
        image = images.get(number)
        if image is None or image.target is None:
            keys[:, 1] = 0
        has_normals = bool((keys[:, 2] > 0).all())
        if not has_normals:
            keys[:, 2] = 0
        first, faces = distinct(keys)
        corner = keys[first]
        of_image = None
        bare = int((corner[:, 1] == 0).sum())
        if image is not None and bare < len(corner):
            found.tell(
                "missing texture coordinates of a vertex", "missing texture coordinates of vertices", bare
            )
            of_image = np.concatenate([[[0.0, 1.0]], image.placed(coordinates)])[corner[:, 1]]
        at = corner[:, 0] - 1
        parts.append(
            Part(
                number,
                vertices[at],
                faces.reshape(-1, 3),
                normals[corner[:, 2] - 1] if has_normals else None,
                None if colors is None else colors[at],
                of_image,
            )
        )
    return parts


def _rows(data: bytes, keyword: bytes) -> np.ndarray:
    """The three numbers of each statement with a keyword."""
    numbers = b" ".join(re.findall(rb"^%b ([^\n]*)" % keyword, data, re.MULTILINE)).split()
    return np.array(numbers).astype(np.float64).reshape(-1, 3)


def _coordinates(data: bytes) -> np.ndarray:
    """Texture coordinates, two of each statement; v is 0 at the lower border. A missing v is 0."""
    wrong = rb"^vt (?!%b(?:[ \t]++%b){0,2}+%b)([^\n]*)" % (_NUMBER, _NUMBER, _END)
    if bad := re.search(wrong, data, re.MULTILINE):
        raise Refused(f"texture coordinates are {shown(bad[1].decode().strip())!r}, not 1 to 3 numbers")
    rows = [line.split()[:2] for line in re.findall(rb"^vt ([^\n]*)", data, re.MULTILINE)]
    found = np.array([row if len(row) == 2 else [*row, b"0"] for row in rows]).astype(np.float64)
    return found.reshape(-1, 2)


def _triangles(
    data: bytes, vertices: np.ndarray, coordinates: int, normals: int
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles, shape (T, 3, 3), and the numbers of their materials.

    A corner has the indices, from 1, of its position, texture coordinates and normal. A missing index is 0.
    """
    blocks = re.split(rb"^o ([0-9]+)\n?", data, flags=re.MULTILINE)
    of_block = [0, *map(int, blocks[1::2])]
    lines, number = [], []
    for block, material in zip(blocks[::2], of_block, strict=True):
        faces = re.findall(rb"^f ([^\n]*)", block, re.MULTILINE)
        lines += faces
        number.append(np.full(len(faces), material))
    text = b" ".join(lines) + b" "
    counts = np.array([len(line.split()) for line in lines], dtype=np.int64)
    # Missing indices become 0: of 1//3, of 1/2, and of 1.
    if re.search(rb"/[0-9]*+/0++(?![0-9])", text):
        raise Refused(f"a face has the normal 0, but there are {normals} normals")
    if re.search(rb"(?<![/0-9])[0-9]++/0++(?![0-9])", text):
        raise Refused(f"a face has the texture coordinates 0, but there are {coordinates}")
    text = re.sub(rb"/(?=[/\s])", b"/0", text)
    if text.count(b"/") < 2 * counts.sum():
        text = re.sub(rb"(?<![/0-9])([0-9]++)(?![/0-9])", rb"\1/0", text)
        text = re.sub(rb"(?<![/0-9])([0-9]++/[0-9]++)(?!/)", rb"\1/0", text)
    words = text.replace(b"/", b" ").split()
    if any(len(word) > 18 for word in words):
        raise Refused("a face has an index of over 18 digits")
    indices = np.array(words).astype(np.int64).reshape(-1, 3)
    check_corners(indices[:, 0] - 1, len(vertices))
    if (most := indices[:, 2].max(initial=0)) > normals:
        raise Refused(f"a face has the normal {most}, but there are {normals} normals")
    if (most := indices[:, 1].max(initial=0)) > coordinates:
        raise Refused(f"a face has the texture coordinates {most}, but there are {coordinates}")
    places, faces = cut_polygons(vertices, indices[:, 0] - 1, counts)
    return indices[places], np.concatenate(number)[faces]


def _absolute(data: bytes) -> bytes:
    """The text with absolute indices, in place of indices that count back from their line."""
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

    return re.sub(rb"^(v[nt]?|f) ([^\n]*)", replaced, data, flags=re.MULTILINE)


def _positions(data: bytes, found: Found, painted: bool) -> tuple[bytes, np.ndarray | None]:
    """The text with three numbers for each position, and the colours behind positions, if there are any.

    The numbers behind x, y, z are, by their count:

    - 1: a weight;
    - 3: red, green, blue;
    - 4: either red, green, blue and alpha, or else a weight, red, green and blue. The first number is the
      weight if it is 1 for all positions and the last number is not;
    - 5: a weight, red, green, blue, alpha.
    """
    wrong = rb"^(?:v (?!%b(?:[ \t]++%b){0,5}+%b)|vn (?!%b%b))([^\n]*)" % (_THREE, _NUMBER, _END, _THREE, _END)
    if bad := re.search(wrong, data, re.MULTILINE):
        raise Refused(f"a position or normal is {shown(bad[1].decode().strip())!r}, not 3 numbers")
    rows = [line.split()[3:] for line in re.findall(rb"^v ([^\n]*)", data, re.MULTILINE)]
    counts = np.array([len(row) for row in rows])
    if (counts == 2).any():
        raise Refused("a position has 5 numbers", "give x y z, and red green blue after them")
    colors = np.ones((len(rows), 3))
    has_color = counts >= 3
    for count in np.unique(counts[counts > 0]).tolist():
        chosen = np.flatnonzero(counts == count)
        numbers = np.array([rows[k] for k in chosen.tolist()]).astype(np.float64)
        weighted = count in (1, 5)
        if count == 4:
            weighted = bool((numbers[:, 0] == 1).all() and (numbers[:, 3] != 1).any())
        if weighted:
            if (numbers[:, 0] != 1).any():
                raise Refused("a position has a weight w other than 1", "export it without weights")
            numbers = numbers[:, 1:]
        whole = 255 if (numbers[:, :3] > 1).any() else 1
        if painted and numbers.shape[1] > 3 and (numbers[:, 3] != whole).any():
            found.tell("vertex alpha")
        if numbers.shape[1] >= 3:
            colors[chosen] = numbers[:, :3]
    data = re.sub(rb"^(v %b)[^\n]*" % _THREE, rb"\1", data, flags=re.MULTILINE)
    if not painted or not has_color.any():
        return data, None
    without = int((~has_color).sum())
    found.tell("missing colour of a vertex", "missing colours of vertices", without)
    colors[has_color] = vertex_colors(colors[has_color])
    return data, colors
