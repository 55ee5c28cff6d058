"""PLY files: text and binary, with polygons of any count of corners."""

import re
import struct
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from blysk.golden.text import is_wide, plain_text
from blysk.sim.meshes.colors import vertex_colors
from blysk.sim.meshes.images import find_image, read_texture
from blysk.sim.meshes.materials import FileMaterial, Found
from blysk.sim.meshes.parts import Part, distinct
from blysk.sim.meshes.polygons import check_corners, cut_polygons
from blysk.sim.meshes.refusal import Refused, refers, shown
from blysk.sim.meshes.strips import strip_triangles

__all__ = ["find_ply_images", "read_ply"]

_KINDS = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_TYPES = {
    **_KINDS,
    **{f"{'u' * (kind[0] == 'u')}int{8 * int(kind[1])}": kind for kind in _KINDS.values()},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
# Known properties. Some are read. Others change nothing, or only the look of textures.
_KNOWN = {
    "vertex": {"x", "y", "z", "nx", "ny", "nz", "s", "t", "u", "v", "texture_u", "texture_v"}
    | {"texture_s", "texture_t", "confidence", "intensity", "quality", "value", "flags", "radius"},
    "face": {"vertex_indices", "vertex_index", "texcoord", "texnumber", "quality", "flags"}
    | {"nx", "ny", "nz"},
    "tristrips": {"vertex_indices", "vertex_index"},
}
# Names of a colour's channels, and of texture coordinates.
_CHANNELS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_COLORS = {name for names in _CHANNELS for name in names}
_ALPHA = {"alpha", "diffuse_alpha", "a"}
_COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class _Property(NamedTuple):
    name: str
    kind: str
    """Type of the value, or of the values of a list."""
    count: str = ""
    """Type of a list's count; empty if the property is no list."""


class _Element(NamedTuple):
    name: str
    rows: int
    properties: list[_Property]


class _List(NamedTuple):
    """A property with a list in each row: the values of all lists, joined, and the length of each list."""

    values: np.ndarray
    counts: np.ndarray


_Columns = dict[str, np.ndarray | _List]


def read_ply(data: bytes, found: Found, painted: bool) -> tuple[list[Part], list[str]]:
    """Triangles of a PLY file, a part for each image, and the names of its images.

    Vertices may have normals, colours (by the curve of sRGB) and texture coordinates. Corners of faces may
    have texture coordinates instead (``texcoord``), and faces the number of their image (``texnumber``).

    Parameters
    ----------
    data : bytes
        The file.
    found : Found
        Records contents that are not read.
    painted : bool
        Whether to read colours and texture coordinates.

    Returns
    -------
    tuple of list of Part, and list of str
        Part number 0 has no image, and part number k the image k, from 1. Files without images, and files
        that are not painted, have part 0 alone.

    Raises
    ------
    Refused
        - The header is damaged, or rows or bytes are missing.
        - A list has another length than its count.
        - A face has fewer than 3 corners, or a corner without a vertex.
        - A colour is out of range.
    """
    order, elements, images, body = _header(data)
    columns: dict[str, _Columns] = {}
    rows = []
    if not order:
        body = plain_text(body, "replace").encode()
        rows = [line for line in body.split(b"\n") if line.strip()]
        expected = sum(element.rows for element in elements)
        if len(rows) < expected:
            raise Refused(
                f"it is cut short: the header says {expected} lines of data, but there are {len(rows)}"
            )
        if b"_" in body:
            raise Refused("it has a number with the character _")
    start = 0
    for element in elements:
        if order:
            columns[element.name], start = _binary(element, body, start, order)
        else:
            columns[element.name] = _text(element, rows[start : start + element.rows])
            start += element.rows
        if element.rows:
            _tell(element, columns[element.name], found, painted)
    unit = "byte" if order else "line"
    rest = len(body if order else rows) - start
    found.tell(f"{unit} after the last element", f"{unit}s after the last element", rest)
    vertex, face = columns.get("vertex", {}), columns.get("face", {})
    vertices, normals = _table(vertex, ("x", "y", "z")), _table(vertex, ("nx", "ny", "nz"))
    if vertices is None:
        raise Refused("its vertices have no x, y and z")
    faces, places, owners = _triangles(vertices, face)
    if "tristrips" in columns:
        strips = _indices(columns["tristrips"])
        corners = np.zeros(0, np.int64) if strips is None else _separated(strips)
        check_corners(corners[corners != -1], len(vertices))
        faces = np.concatenate([faces, strip_triangles(corners)])
    if not painted:
        return [Part(0, vertices, faces, normals)], images
    whole = Part(0, vertices, faces, normals, _colors(vertex, elements))
    if not images:
        return [whole], []
    return _with_images(whole, columns, places, owners, len(images), found), images


def _with_images(
    whole: Part,
    columns: dict[str, _Columns],
    places: np.ndarray,
    owners: np.ndarray,
    images: int,
    found: Found,
) -> list[Part]:
    """A part for each image, with texture coordinates of the vertices, or of the corners of faces.

    ``places`` are the corners of triangles of faces, and ``owners`` their faces.
    """
    face = columns.get("face", {})
    number = np.ones(len(whole.faces), dtype=np.int64)
    chosen = face.get("texnumber")
    if isinstance(chosen, np.ndarray):
        number[: len(owners)] = 1 + chosen[owners]
        wrong = (number < 1) | (number > images)
        found.tell("missing image of a face", "missing images of faces", int(wrong.sum()))
        number[wrong] = 0
    given = (_table(columns["vertex"], names) for names in _COORDINATES)
    coordinates = next((each for each in given if each is not None), None)
    corners, indices = face.get("texcoord"), _indices(face)
    if isinstance(corners, _List) and indices is not None and len(corners.values):
        if len(whole.faces) == len(owners) and np.array_equal(corners.counts, 2 * indices.counts):
            pairs = corners.values.reshape(-1, 2)
            _, kinds = np.unique(pairs + 0.0, axis=0, return_inverse=True)
            at = whole.faces.ravel()
            first, faces = distinct(np.column_stack([at, kinds.ravel()[places.ravel()]]))
            vertices, normals, colors = (
                None if each is None else each[at[first]]
                for each in (whole.vertices, whole.normals, whole.colors)
            )
            whole = Part(0, vertices, faces.reshape(-1, 3), normals, colors)
            coordinates = pairs[places.ravel()[first]]
        else:
            found.tell("face texture coordinates")
    if coordinates is not None:
        coordinates = np.column_stack([coordinates[:, 0], 1 - coordinates[:, 1]])
    return [
        whole._replace(number=k, faces=whole.faces[number == k], coordinates=coordinates if k else None)
        for k in np.unique(number).tolist()
    ]


def find_ply_images(names: list[str], folder: Path, found: Found) -> None:
    """A material for each image, read if a face uses it."""
    for name in names:
        target, reason = find_image(name, folder)
        refers(folder, *([] if target is None else [str(target)]))
        found.names.append(name)
        found.readers.append(partial(_ply_material, name, target, reason, found))


def _ply_material(name: str, target: Path | None, reason: str, found: Found) -> FileMaterial:
    if target is None:
        found.tell(f"the image {shown(name)!r}, {reason}")
        return FileMaterial(shown(name))
    return FileMaterial(shown(name), texture=read_texture(target, found))


def _table(columns: _Columns, names: tuple[str, ...]) -> np.ndarray | None:
    """Columns of these names side by side, float64; ``None`` if one is missing."""
    found = [columns.get(name) for name in names]
    if not all(isinstance(column, np.ndarray) for column in found):
        return None
    table: np.ndarray = np.column_stack(found).astype(np.float64)
    return table


def _colors(vertex: _Columns, elements: list[_Element]) -> np.ndarray | None:
    """Colours of the vertices in linear light, shape (V, 3)."""
    kinds = {
        each.name: each.kind
        for element in elements
        if element.name == "vertex"
        for each in element.properties
    }
    for names in _CHANNELS:
        table = _table(vertex, names)
        if table is None:
            continue
        whole = [{"u2": 65535.0}.get(kinds[name], None if kinds[name][0] == "f" else 255.0) for name in names]
        if len(set(whole)) == 1:
            return vertex_colors(table, whole[0])
        # A number's type says which number is full light.
        columns = zip(table.T, whole, strict=True)
        return np.column_stack([vertex_colors(column, of or 1.0) for column, of in columns])
    return None


def _tell(element: _Element, columns: _Columns, found: Found, painted: bool) -> None:
    """Record an unknown element, or its properties that may change the look and are not read."""
    if element.name not in _KNOWN:
        found.tell_names("elements", [element.name])
        return
    names = {each.name for each in element.properties}
    read = element.name == "vertex" and any(_table(columns, channels) is not None for channels in _CHANNELS)
    if painted and names & _COLORS and not read:
        found.tell(f"{element.name} colours")
    for name in names & _ALPHA if painted else ():
        values, whole = columns[name], {"u1": 255, "u2": 65535}
        kind = next(each.kind for each in element.properties if each.name == name)
        if isinstance(values, _List) or (values != whole.get(kind, 1)).any():
            found.tell(f"{element.name} alpha")
    others = sorted(names - _COLORS - _ALPHA)
    found.tell_names(f"{element.name} properties", others, _KNOWN[element.name])


def _indices(columns: _Columns) -> _List | None:
    """The list of vertices of an element: the list with the usual name, or the only list."""
    lists = {name: column for name, column in columns.items() if isinstance(column, _List)}
    name = next((name for name in ("vertex_indices", "vertex_index") if name in lists), None)
    if name is None and len(lists) != 1:
        return None
    indices = lists[name] if name else next(iter(lists.values()))
    if (indices.values != np.floor(indices.values)).any():
        raise Refused("a face has an index that is not a whole number")
    return _List(indices.values.astype(np.int64), indices.counts)


def _separated(strips: _List) -> np.ndarray:
    """Strips in one array, each with -1 behind it."""
    return np.insert(strips.values, np.cumsum(strips.counts), -1)


def _triangles(vertices: np.ndarray, face: _Columns) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles of faces, the places of their corners in the list of all corners, and the face of each."""
    indices = _indices(face)
    if indices is None:
        return np.zeros((0, 3), dtype=np.int64), np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    values = indices.values
    check_corners(values, len(vertices))
    if (indices.counts < 3).any():
        raise Refused("a face has fewer than 3 corners")
    places, owners = cut_polygons(vertices, values, indices.counts)
    return values[places], places, owners


def _header(data: bytes) -> tuple[str, list[_Element], list[str], bytes]:
    """Byte order (empty for text), the elements, names of images, and the rest after the header."""
    if is_wide(data):
        data = plain_text(data, "replace").encode()
    # The word stands at the head of a line, and not in a comment.
    end = re.search(rb"[\r\n][ \t]*+end_header[ \t]*+(?=[\r\n]|\Z)", data)
    if end is None:
        raise Refused("the PLY header has no end")
    order, elements, images = None, [], []
    head, body = data[: end.start()], data[end.end() :]
    lines = [line.strip() for line in plain_text(head, "replace").split("\n") if line.strip()] or [""]
    if lines[0].lower() != "ply":
        raise Refused("it is not a PLY file")
    for line in lines[1:]:
        words = line.split()
        # Some programs write a comment of several lines without the word comment on later lines.
        if not words or words[0] not in ("format", "element", "property"):
            if [word.lower() for word in words[:2]] == ["comment", "texturefile"] and len(words) > 2:
                images.append(line.split(maxsplit=2)[2])
        elif words[0] == "format" and len(words) == 3 and words[1] in _ORDERS and order is None:
            order = _ORDERS[words[1]]
        elif words[0] == "element" and len(words) == 3 and re.fullmatch("[0-9]{1,18}", words[2]):
            elements.append(_Element(words[1], int(words[2]), []))
        elif words[0] == "property" and elements and (read := _property(words)):
            elements[-1].properties.append(read)
        else:
            raise Refused(f"its header has the line {shown(line.strip())!r}")
    if order is None:
        raise Refused("its header says no format")
    for element in elements:
        names = [each.name for each in element.properties]
        if len(set(names)) < len(names) or [e.name for e in elements].count(element.name) > 1:
            raise Refused("its header has a name twice")
    # A file of lone carriage returns may have a line feed as the first byte of its data.
    for mark in (b"\r\n", b"\n", b"\r") if b"\n" in head else (b"\r", b"\n"):
        if body.startswith(mark):
            return order, elements, images, body.removeprefix(mark)
    return order, elements, images, b""


def _property(words: list[str]) -> _Property | None:
    kinds = [_TYPES.get(word) for word in words[2:-1] if len(words) == 5] or [_TYPES.get(words[1])]
    if len(words) == 5 and words[1] == "list" and all(kinds) and kinds[0][0] != "f":
        return _Property(words[4], kinds[1], kinds[0])
    if len(words) == 3 and kinds[0]:
        return _Property(words[2], kinds[0])
    return None


def _text(element: _Element, rows: list[bytes]) -> _Columns:
    """Columns of an element of a text; each row must have the header's values, and nothing else."""
    words = [row.split() for row in rows]
    lengths = np.array([len(row) for row in words], dtype=np.int64)
    try:
        flat = np.array([float(word) for row in words for word in row])
    except ValueError:
        raise Refused(f"its {shown(element.name)} rows hold a word that is not a number") from None
    ends = np.cumsum(lengths)
    cursor = ends - lengths
    wrong = f"a row of its {shown(element.name)} has more or fewer numbers than it says"
    columns: _Columns = {}
    for each in element.properties:
        if (cursor >= ends).any():
            raise Refused(wrong)
        values, cursor = flat[cursor] if len(rows) else flat, cursor + 1
        if each.count:
            if not ((values >= 0) & (values == np.floor(values)) & (values <= ends - cursor)).all():
                raise Refused(wrong)
            counts = values.astype(np.int64)
            before = np.cumsum(counts) - counts
            places = np.arange(counts.sum()) + np.repeat(cursor - before, counts)
            columns[each.name], cursor = _List(flat[places], counts), cursor + counts
        else:
            columns[each.name] = values
    if (cursor != ends).any():
        raise Refused(wrong)
    return columns


def _binary(element: _Element, body: bytes, start: int, order: str) -> tuple[_Columns, int]:
    """Columns of an element of a binary file, and the byte after its end."""
    short = f"it is cut short: its {shown(element.name)} rows take more bytes than there are"
    counts: list[int] = []
    cursor = start
    for each in element.properties if element.rows else ():
        if each.count:
            kind = np.dtype(order + each.count)
            if cursor + kind.itemsize > len(body):
                raise Refused(short)
            counts.append(int(np.frombuffer(body, kind, 1, cursor)[0]))
            if not 0 <= counts[-1] <= len(body):
                raise Refused("a list has a wrong count")
            cursor += kind.itemsize
        cursor += np.dtype(each.kind).itemsize * (counts[-1] if each.count else 1)
    # In most files all lists of a property have the same length, and all rows the type of the first row.
    remaining = iter(counts)
    row = []
    for each in element.properties:
        if each.count:
            row += [(f"{each.name} count", order + each.count)]
        row += [(each.name, order + each.kind, (next(remaining, 0),))[: 3 if each.count else 2]]
    kind = np.dtype(row)
    end = start + element.rows * kind.itemsize
    if end <= len(body):
        table = np.frombuffer(body, kind, element.rows, start) if kind.itemsize else np.zeros(0, kind)
        lists = [each for each in element.properties if each.count]
        alike = [(table[f"{e.name} count"] == n).all() for e, n in zip(lists, counts, strict=bool(counts))]
        if all(alike):
            columns: _Columns = {e.name: table[e.name] for e in element.properties}
            for each in lists:
                columns[each.name] = _List(
                    table[each.name].ravel().astype(np.float64), table[f"{each.name} count"].astype(np.int64)
                )
            return columns, end
    elif not any(each.count for each in element.properties):
        raise Refused(short)
    try:
        return _ragged(element, body, start, order or "<")
    except struct.error:
        raise Refused(short) from None


def _ragged(element: _Element, body: bytes, start: int, order: str) -> tuple[_Columns, int]:
    """Columns of an element whose lists differ in length, read row by row, and the byte after its end."""
    letters = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
    values: dict[str, list] = {each.name: [] for each in element.properties}
    counts: dict[str, list[int]] = {each.name: [] for each in element.properties}
    sizes = {each: struct.calcsize(letters[each.kind]) for each in element.properties}
    for _ in range(element.rows):
        for each in element.properties:
            count = 1
            if each.count:
                (count,) = struct.unpack_from(order + letters[each.count], body, start)
                if not 0 <= count <= len(body):
                    raise Refused("a list has a wrong count")
                start += struct.calcsize(letters[each.count])
            values[each.name] += struct.unpack_from(f"{order}{count}{letters[each.kind]}", body, start)
            counts[each.name].append(count)
            start += count * sizes[each]
    columns: _Columns = {}
    for each in element.properties:
        column = np.array(values[each.name], dtype=np.float64)
        columns[each.name] = _List(column, np.array(counts[each.name])) if each.count else column
    return columns, start
