"""PLY files: text and binary, with polygons of any count of corners."""

import re
import struct
from typing import NamedTuple

import numpy as np

from blysk.golden.text import is_wide, plain_text
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.polygons import check_corners, triangulated
from blysk.sim.meshes.refusal import Refused, shown
from blysk.sim.meshes.strips import strip_triangles

__all__ = ["read_ply"]

_KINDS = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_TYPES = {
    **_KINDS,
    **{f"{'u' * (kind[0] == 'u')}int{8 * int(kind[1])}": kind for kind in _KINDS.values()},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
# Properties that are read, and those that say nothing of the look, or only where textures do.
_KNOWN = {
    "vertex": {"x", "y", "z", "nx", "ny", "nz", "s", "t", "u", "v", "texture_u", "texture_v"}
    | {"texture_s", "texture_t", "confidence", "intensity", "quality", "value", "flags", "radius"},
    "face": {"vertex_indices", "vertex_index", "texcoord", "texnumber", "quality", "flags"}
    | {"nx", "ny", "nz"},
    "tristrips": {"vertex_indices", "vertex_index"},
}
_COLORS = {"red", "green", "blue", "diffuse_red", "diffuse_green", "diffuse_blue", "r", "g", "b"}
_ALPHA = {"alpha", "diffuse_alpha", "a"}
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
    """A list of each row: the values of all lists, joined, and the length of each list."""

    values: np.ndarray
    counts: np.ndarray


_Columns = dict[str, np.ndarray | _List]


def read_ply(data: bytes, found: Found) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Vertices, their normals if there are any, and triangles of a PLY file.

    Raises
    ------
    Refused
        If the header is damaged, or rows or bytes are missing. If a list has another length than its count,
        or a face has fewer than 3 corners or a missing corner.
    """
    order, elements, body = _header(data, found)
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
            _tell(element, columns[element.name], found)
    unit = "byte" if order else "line"
    rest = len(body if order else rows) - start
    found.tell(f"{unit} after the last element", f"{unit}s after the last element", rest)
    vertex = columns.get("vertex", {})
    if not all(isinstance(vertex.get(name), np.ndarray) for name in "xyz"):
        raise Refused("its vertices have no x, y and z")
    vertices = np.column_stack([vertex[name] for name in "xyz"]).astype(np.float64)
    normals = None
    if all(isinstance(vertex.get(name), np.ndarray) for name in ("nx", "ny", "nz")):
        normals = np.column_stack([vertex[name] for name in ("nx", "ny", "nz")]).astype(np.float64)
    faces = _triangles(vertices, columns.get("face", {}))
    if "tristrips" in columns:
        strips = _indices(columns["tristrips"])
        corners = np.zeros(0, np.int64) if strips is None else _separated(strips)
        check_corners(corners[corners != -1], len(vertices))
        faces = np.concatenate([faces, strip_triangles(corners)])
    return vertices, normals, faces


def _tell(element: _Element, columns: _Columns, found: Found) -> None:
    """Tell an element, or those of its properties, that change the look and are not read."""
    if element.name not in _KNOWN:
        found.tell_names("elements", [element.name])
        return
    names = {each.name for each in element.properties}
    if names & _COLORS:
        found.tell(f"{element.name} colours")
    for name in names & _ALPHA:
        values, whole = columns[name], {"u1": 255, "u2": 65535}
        kind = next(each.kind for each in element.properties if each.name == name)
        if isinstance(values, _List) or (values != whole.get(kind, 1)).any():
            found.tell(f"{element.name} alpha")
    others = sorted(names - _COLORS - _ALPHA)
    found.tell_names(f"{element.name} properties", others, _KNOWN[element.name])


def _indices(columns: _Columns) -> _List | None:
    """The list of vertices of an element: of the usual name, or the only list."""
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


def _triangles(vertices: np.ndarray, face: _Columns) -> np.ndarray:
    indices = _indices(face)
    if indices is None:
        return np.zeros((0, 3), dtype=np.int64)
    values = indices.values
    check_corners(values, len(vertices))
    if (indices.counts < 3).any():
        raise Refused("a face has fewer than 3 corners")
    starts = np.cumsum(indices.counts) - indices.counts
    pieces, faces = [], []
    for sides in np.unique(indices.counts).tolist():
        chosen = np.flatnonzero(indices.counts == sides)
        polygons = values[starts[chosen][:, np.newaxis] + np.arange(sides)]
        corners, owners = triangulated(vertices, polygons)
        pieces.append(polygons[owners[:, np.newaxis], corners])
        faces.append(chosen[owners])
    if not pieces:
        return np.zeros((0, 3), dtype=np.int64)
    return np.concatenate(pieces)[np.argsort(np.concatenate(faces), kind="stable")]


def _header(data: bytes, found: Found) -> tuple[str, list[_Element], bytes]:
    """Byte order (empty for text), the elements, and the rest after the header."""
    if is_wide(data):
        data = plain_text(data, "replace").encode()
    # The word stands at the head of a line, and not in a comment.
    end = re.search(rb"[\r\n][ \t]*+end_header[ \t]*+(?=[\r\n]|\Z)", data)
    if end is None:
        raise Refused("the PLY header has no end")
    order, elements, textures = None, [], 0
    head, body = data[: end.start()], data[end.end() :]
    lines = [line.strip() for line in plain_text(head, "replace").split("\n") if line.strip()] or [""]
    if lines[0].lower() != "ply":
        raise Refused("it is not a PLY file")
    for line in lines[1:]:
        words = line.split()
        # A comment of several lines: some programs forget the word before the second.
        if not words or words[0] not in ("format", "element", "property"):
            textures += [word.lower() for word in words[:2]] == ["comment", "texturefile"]
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
    found.tell("texture", "textures", textures)
    # A file of lone carriage returns may have a line feed as the first byte of its data.
    for mark in (b"\r\n", b"\n", b"\r") if b"\n" in head else (b"\r", b"\n"):
        if body.startswith(mark):
            return order, elements, body.removeprefix(mark)
    return order, elements, b""


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
    # Most files have lists of one length only, of which one row's type tells all.
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
