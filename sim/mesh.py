"""Meshes by file or by name, with unit vertex normals and every flaw counted or reported."""

import importlib.util
import io
import json
import logging
import re
import struct
import warnings
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from golden.geometry import Mesh, normalise
from sim.errors import InputError
from sim.teapot import teapot

__all__ = ["MAX_FACES", "SUFFIXES", "LoadedMesh", "load_mesh"]

SUFFIXES = (".obj", ".ply", ".stl", ".glb", ".gltf")
MAX_FACES = 20_000_000

# The largest error of a stored normal's length that counts as rounding, itself stored in float32.
_LENGTH_TOLERANCE = 1 / 256 + 1e-6
# A triangle whose height is below this part of the largest coordinate is rounding only: 32 units of 2**-53.
_FLAT = 2.0**-48
# Slack of the crease test in the cosine: the rounding of vertices stored as float32.
_COSINE_SLACK = 1e-6

_REEXPORT = "check the file or export it again"
_NEEDS_DECODER = {"EXT_meshopt_compression", "KHR_meshopt_compression"}


@dataclass(frozen=True)
class LoadedMesh:
    """A mesh and what had to be mended in it.

    Parameters
    ----------
    mesh : Mesh
        The triangles, with unit vertex normals.
    name : str
        ``teapot``, or the file's name without folder and suffix.
    repaired_normals : int
        Stored vertex normals that were zero, not finite, or more than 1/256 off unit length, or that the
        file refers to but does not hold.
    dropped_faces : int
        Triangles without area, left out.
    """

    mesh: Mesh
    name: str
    repaired_normals: int
    dropped_faces: int


def load_mesh(source: str, *, triangles: int = 10_000, crease_angle: float = 40.0) -> LoadedMesh:
    """Load a mesh from a file, or build the teapot.

    Normals stored at the vertices of an OBJ, PLY, GLB or glTF file are kept. Zero, NaN and infinite ones
    are replaced by the computed normal, ones of another length are normalised; both are counted. Without
    stored normals (and for STL, which has them a face) vertices of equal position are welded, the mesh is
    cut along the edges where two faces meet at more than ``crease_angle``, and a vertex gets the sum of its
    face normals, weighted by the face's angle there.

    All meshes of a scene are put together in world coordinates: vertices by the node's matrix ``M``,
    normals by its inverse transpose, and a mirroring node (``det M < 0``) turns the triangles round.
    Points and lines beside a mesh are left out, as are materials, textures and colours.

    Parameters
    ----------
    source : str
        ``teapot`` for the built-in one (a file of that name is ``./teapot``), else a path that ends in
        .obj, .ply, .stl, .glb or .gltf, in any case.
    triangles : int
        Triangles of the teapot, 64 to 4,000,000; of no effect for a file.
    crease_angle : float
        Degrees, 0 to 180. At 0 only coplanar faces share a normal, at 180 all faces do.

    Returns
    -------
    LoadedMesh
        The mesh and the counts of what was mended.

    Raises
    ------
    InputError
        If a number is out of range, or the file is missing, empty, of unknown type, damaged, refers to
        files outside its folder, needs a decoder that is not installed, or holds no triangle, a vertex
        that is not finite, an index out of range, or more than 20 million triangles.
    """
    if not 0 <= crease_angle <= 180:
        raise InputError(
            f"crease angle {crease_angle}", "it must be 0 to 180 degrees", "choose one in that range"
        )
    if source == "teapot":
        return LoadedMesh(teapot(triangles), "teapot", 0, 0)

    path = Path(source)
    shown = "".join(c if c.isprintable() else "?" for c in source)
    try:
        data = _read(path)
        with _quiet_trimesh():
            scene = _load_scene(path, data)
        # Overflow and NaN are looked for, and reported, in what comes out.
        with np.errstate(over="ignore", invalid="ignore"):
            return _assemble(scene, path, data, crease_angle)
    except _Refused as refusal:
        raise InputError(shown, refusal.reason, refusal.remedy) from None
    # The loaders raise whatever a damaged file makes them trip over.
    except Exception as error:
        text = str(error).strip().split("\n")[0]
        kind = type(error).__name__
        reason = f"cannot be read ({kind}: {text})" if text else f"cannot be read ({kind})"
        raise InputError(shown, reason, _REEXPORT) from error


class _Refused(Exception):
    """A reason and a remedy, before the file's name is put to them."""

    def __init__(self, reason: str, remedy: str = _REEXPORT):
        super().__init__(reason)
        self.reason = reason
        self.remedy = remedy


@contextmanager
def _quiet_trimesh():
    """Keep trimesh's log off the terminal, and make NumPy's note on half-read numbers an error."""
    logger = logging.getLogger("trimesh")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.filterwarnings(
                "error", message=".*could not be read to its end", category=DeprecationWarning
            )
            yield
    finally:
        logger.setLevel(level)


def _read(path: Path) -> bytes:
    """The file's bytes, once path, suffix and size are known to be good."""
    try:
        if not path.exists():
            raise _Refused("there is no such file", "check the path, or use the name teapot")
        if path.is_dir():
            raise _Refused("is a folder", "name a file in it")
        if not path.is_file():
            raise _Refused("is not a regular file", "name a mesh file")
        if path.suffix.lower() not in SUFFIXES:
            raise _Refused(
                f"unknown mesh type {path.suffix!r}" if path.suffix else "the name has no suffix",
                f"use {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}",
            )
        data = path.read_bytes()
    except OSError as error:
        raise _Refused(
            f"cannot be opened ({error.strerror})", "check the path and its permissions"
        ) from error
    if not data:
        raise _Refused("the file is empty")
    return data


def _load_scene(path: Path, data: bytes) -> trimesh.Scene:
    """Check what trimesh does not, and load without touching any file that was not checked."""
    suffix = path.suffix.lower()
    references, options = {}, {}
    if suffix == ".obj":
        data = _tidy_obj(data)
    elif suffix == ".ply":
        data = _tidy_ply(data)
        # Cutting the mesh at texture seams would leave the stored normals in the old order.
        options["fix_texture"] = False
    elif suffix == ".stl":
        data = _tidy_stl(data)
    else:
        document = _gltf_document(data, suffix)
        _check_gltf(document)
        references = _gltf_references(document, path.parent)
    return trimesh.load_scene(
        io.BytesIO(data),
        file_type=suffix[1:],
        resolver=references,
        process=False,
        skip_materials=True,
        **options,
    )


def _utf8(text: bytes) -> bytes:
    """Text with the names and comments of another encoding made harmless."""
    return text.decode("utf-8", "replace").encode()


def _tidy_obj(data: bytes) -> bytes:
    """An OBJ file in the form that trimesh reads; face lines that it would take wrongly are refused."""
    data = re.sub(rb"\\\r?\n|#.*", b"", _utf8(data))
    data = re.sub(rb"^[ \t]*(v|vn|vt|f)[ \t]+", rb"\1 ", data, flags=re.MULTILINE)
    if re.search(rb"^f(?: +[^\s]+){0,2}[ \t]*\r?$", data, re.MULTILINE):
        raise _Refused("a face has fewer than 3 corners")
    if re.search(rb"^f .*(?<= )-?0+(?=[/\s]|\Z)", data, re.MULTILINE):
        raise _Refused("a face has the vertex index 0; they count from 1")
    # trimesh counts relative indices from the end of the file, not from the face.
    relative = re.search(rb"^f .*[ /]-\d", data, re.MULTILINE)
    if relative and re.search(rb"^vn? ", data[relative.end() :], re.MULTILINE):
        raise _Refused("relative face indices with vertices after them", "export it with absolute indices")
    return data


def _tidy_ply(data: bytes) -> bytes:
    """Refuse an ASCII PLY with fewer lines than its header says; trimesh would load a part of it."""
    head, mark, body = data.partition(b"end_header")
    if not mark:
        raise _Refused("the PLY header has no end")
    rows = sum(int(count) for count in re.findall(rb"^\s*element\s+\S+\s+(\d+)", head, re.MULTILINE))
    if b"format ascii" in head:
        lines = sum(1 for line in body.splitlines()[1:] if line.strip())
        if lines < rows:
            raise _Refused(f"it is cut short: the header says {rows} lines of data, there are {lines}")
    return _utf8(head) + mark + body


def _tidy_stl(data: bytes) -> bytes:
    """Refuse an STL that is cut short: of a binary one trimesh would only say that it is empty."""
    if data[:5].lower() == b"solid" and b"\0" not in data:
        if b"endsolid" not in data.lower():
            raise _Refused("it is cut short: the end of the solid is missing")
        return _utf8(data)
    if len(data) < 84:
        raise _Refused(f"it is cut short: a binary STL has at least 84 bytes, there are {len(data)}")
    count = struct.unpack_from("<I", data, 80)[0]
    if len(data) != 84 + 50 * count:
        raise _Refused(
            f"its size is wrong: the header says {count} triangles, which take {84 + 50 * count} bytes, "
            f"there are {len(data)}"
        )
    return data


def _gltf_document(data: bytes, suffix: str) -> dict:
    """The JSON part of a GLB or glTF file."""
    if suffix == ".glb":
        if len(data) < 20 or data[:4] != b"glTF":
            raise _Refused("it is no GLB file")
        length, json_length = struct.unpack_from("<II", data, 8)
        if len(data) < length or len(data) < 20 + json_length:
            raise _Refused(f"it is cut short: the header says {length} bytes, there are {len(data)}")
        data = data[20 : 20 + json_length]
    try:
        document = json.loads(data.decode("utf-8-sig"))
    except ValueError as error:
        raise _Refused(f"its JSON is damaged ({error})") from error
    if not isinstance(document, dict):
        raise _Refused("its JSON is no glTF document")
    return document


def _check_gltf(document: dict) -> None:
    """Refuse geometry that trimesh would load as zeros, and counts that would exhaust the memory."""
    for extension in sorted(_NEEDS_DECODER.intersection(document.get("extensionsUsed", []))):
        raise _Refused(
            f"it is compressed with {extension}, for which there is no decoder", "export it uncompressed"
        )
    accessors = document.get("accessors", [])
    for accessor in accessors:
        if accessor["count"] > 3 * MAX_FACES:
            raise _Refused(f"it has an array of {accessor['count']} elements; the limit is {3 * MAX_FACES}")
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            used = [attributes[k] for k in ("POSITION", "NORMAL") if k in attributes]
            used += [primitive["indices"]] if "indices" in primitive else []
            if any("sparse" in accessors[index] for index in used):
                raise _Refused("it has sparse accessors, which are not supported", "export it without them")
            draco = "KHR_draco_mesh_compression" in primitive.get("extensions", {})
            if not all("bufferView" in accessors[index] for index in used):
                if not draco:
                    raise _Refused("a mesh has no data")
                if importlib.util.find_spec("DracoPy") is None:
                    raise _Refused(
                        "it is Draco-compressed and the decoder DracoPy is not installed",
                        "pip install DracoPy",
                    )


def _gltf_references(document: dict, folder: Path) -> dict[str, bytes]:
    """The files that a glTF document takes its buffers from, by the URI it calls them; all in its folder."""
    references = {}
    for buffer in document.get("buffers", []):
        uri = buffer.get("uri")
        if uri is None or uri.startswith("data:"):
            continue
        if re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", uri) or uri.startswith(("/", "\\")):
            raise _Refused(f"it refers to {uri!r}, outside its folder", "put that file beside it")
        target = (folder / unquote(uri)).resolve()
        if ".." in Path(unquote(uri)).parts or not target.is_relative_to(folder.resolve()):
            raise _Refused(f"it refers to {uri!r}, outside its folder", "put that file beside it")
        if not target.is_file():
            raise _Refused(f"it refers to {uri!r}, which does not exist", "put that file beside it")
        references[uri] = target.read_bytes()
    return references


def _assemble(scene: trimesh.Scene, path: Path, data: bytes, crease_angle: float) -> LoadedMesh:
    """All triangles of a scene in world coordinates, as one mesh."""
    nodes = [scene.graph[node] for node in scene.graph.nodes_geometry]
    nodes = [(matrix, scene.geometry[name]) for matrix, name in nodes]
    nodes = [(m, g) for m, g in nodes if isinstance(g, trimesh.Trimesh) and len(g.faces)]
    if not nodes:
        raise _Refused("it has no faces", "use a mesh of triangles; points and lines are not shaded")
    if (total := sum(len(g.faces) for _, g in nodes)) > MAX_FACES:
        raise _Refused(f"it has {total} triangles; the limit is {MAX_FACES}", "simplify it")

    # trimesh drops the normals of an OBJ file if one of their indices is missing or out of range.
    promised = path.suffix.lower() == ".obj" and re.search(rb"^f\b.*/-?\d*/-?\d", data, re.MULTILINE)
    vertices, normals, faces, lost = [], [], [], 0
    offset = 0
    for matrix, geometry in nodes:
        part, triangles = np.array(geometry.vertices), np.array(geometry.faces)
        if not 0 <= triangles.min() <= triangles.max() < len(part):
            wrong = triangles.min() if triangles.min() < 0 else triangles.max()
            raise _Refused(f"a face refers to vertex {wrong} (from 0), there are {len(part)}")
        stored = np.full(part.shape, np.nan)
        # Only the cache tells a stored normal from a computed one; asking for the property computes it.
        has_normals = "vertex_normals" in geometry._cache
        if has_normals:
            stored = np.array(geometry.vertex_normals)
        elif promised:
            lost += len(np.unique(triangles))
        rotation = np.array(matrix[:3, :3])
        # The cofactors are the inverse transpose times the determinant, and exist if it is 0.
        cofactors = np.cross(np.roll(rotation, -1, axis=0), np.roll(rotation, -2, axis=0))
        mirrored = np.linalg.det(rotation) < 0
        if not np.array_equal(matrix, np.eye(4)):
            part = part @ rotation.T + matrix[:3, 3]
            stored = _transformed(stored, -cofactors if mirrored else cofactors)
        faces.append((triangles[:, ::-1] if mirrored else triangles) + offset)
        vertices.append(part)
        normals.append((stored, np.full(len(part), has_normals)))
        offset += len(part)
    return _finish(
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate([stored for stored, _ in normals]),
        np.concatenate([flag for _, flag in normals]),
        path.stem,
        lost,
        crease_angle,
    )


def _transformed(normals: np.ndarray, cofactors: np.ndarray) -> np.ndarray:
    """Normals turned by the cofactors, each with the length that it was stored with."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    finite = np.isfinite(normals).all(axis=1)
    turned = np.full(normals.shape, np.nan)
    turned[finite] = normalise(normals[finite] @ cofactors.T) * length[finite]
    return turned


def _finish(
    vertices: np.ndarray,
    faces: np.ndarray,
    normals: np.ndarray,
    has_normals: np.ndarray,
    name: str,
    lost: int,
    crease_angle: float,
) -> LoadedMesh:
    """Drop faces without area, mend stored normals, compute the others."""
    used = np.unique(faces)
    broken = len(used) - np.isfinite(vertices[used]).all(axis=1).sum()
    if broken:
        raise _Refused(f"{broken} of its vertices are NaN or infinite")
    if not np.ptp(vertices[used], axis=0).any():
        raise _Refused("all its vertices are at one point")

    # Tiny and huge models would under- and overflow in the products below.
    scaled = vertices / np.abs(vertices[used]).max()
    cross, longest = _face_cross(scaled, faces)
    solid = cross > _FLAT * longest
    dropped = int(len(faces) - solid.sum())
    faces = faces[solid]
    if not len(faces):
        raise _Refused("none of its faces has an area")

    kept = has_normals[faces[:, 0]]
    corner, smooth_faces, smooth_normals = _crease_normals(scaled, faces[~kept], crease_angle)
    own = np.unique(faces[kept])
    own_normals, repaired = _repaired(scaled, faces[kept], normals, own)
    renumbered = np.searchsorted(own, faces[kept])
    mesh = Mesh(
        vertices=np.concatenate([vertices[own], vertices[corner]]),
        faces=np.concatenate([renumbered, smooth_faces + len(own)]).astype(np.int64),
        normals=np.concatenate([own_normals, smooth_normals]),
    )
    return LoadedMesh(mesh, name, repaired + lost, dropped)


def _face_cross(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twice the area, and the longest side, of each face."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    sides = np.stack([b - a, c - b, a - c])
    return np.linalg.norm(np.cross(sides[0], sides[1]), axis=-1), np.linalg.norm(sides, axis=-1).max(axis=0)


def _weighted_normals(
    vertices: np.ndarray, faces: np.ndarray, owner: np.ndarray, owners: int
) -> tuple[np.ndarray, np.ndarray]:
    """Unit face normals, and their sums, weighted by angle, over the corners of each ``owner`` (F, 3)."""
    corners = vertices[faces]
    face_normals = normalise(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    sides = np.roll(corners, -1, axis=1) - corners
    back = -np.roll(sides, 1, axis=1)
    angles = np.arctan2(np.linalg.norm(np.cross(sides, back), axis=-1), np.einsum("fki,fki->fk", sides, back))
    weighted = (face_normals[:, np.newaxis] * angles[..., np.newaxis]).reshape(-1, 3)
    flat = owner.ravel()
    total = np.stack([np.bincount(flat, weights=weighted[:, i], minlength=owners) for i in range(3)], axis=-1)
    # Faces back to back cancel but for rounding, 1e-12 at most; one is as good as the other.
    cancelled = np.linalg.norm(total, axis=1) < 1e-12
    if cancelled.any():
        one = np.zeros(owners, dtype=np.int64)
        one[flat] = np.repeat(np.arange(len(faces)), 3)
        total[cancelled] = face_normals[one[cancelled]]
    return face_normals, normalise(total)


def _repaired(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray, own: np.ndarray
) -> tuple[np.ndarray, int]:
    """Unit stored normals of the vertices ``own``, and how many had to be mended."""
    stored = normals[own]
    usable = np.isfinite(stored).all(axis=1) & stored.any(axis=1)
    # The largest component bounds the length without overflow.
    rough = np.abs(np.where(usable[:, np.newaxis], stored, 0)).max(axis=1)
    sane = usable & (rough < 2)
    length = np.linalg.norm(np.where(sane[:, np.newaxis], stored, 0), axis=1)
    bad = np.abs(length - 1) > _LENGTH_TOLERANCE
    result = normalise(np.where(usable[:, np.newaxis], stored, 0))
    if not usable.all():
        owner = np.searchsorted(own, faces)
        _, computed = _weighted_normals(vertices, faces, owner, len(own))
        result[~usable] = computed[~usable]
    return result, int(bad.sum())


def _crease_normals(
    vertices: np.ndarray, faces: np.ndarray, crease_angle: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut a mesh at its creases: for each new vertex the old one and its normal, and the new faces.

    Two corners at one place belong to one new vertex if a chain of faces around it leads from one to the
    other over edges that are no creases.
    """
    if not len(faces):
        return np.zeros(0, dtype=np.int64), faces, np.zeros((0, 3))
    _, welded = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    places = welded.ravel()[faces]
    face_normals, _ = _weighted_normals(vertices, faces, np.zeros_like(faces), 1)

    corner = np.arange(faces.size).reshape(faces.shape)
    start, end = places.ravel(), np.roll(places, -1, axis=1).ravel()
    start_corner, end_corner = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    low_corner = np.where(start < end, start_corner, end_corner)
    high_corner = np.where(start < end, end_corner, start_corner)
    edge = np.minimum(start, end) * (places.max() + 1) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    first, second = order[:-1], order[1:]
    shared = edge[first] == edge[second]
    first, second = first[shared], second[shared]
    cosine = np.einsum("ei,ei->e", face_normals[first // 3], face_normals[second // 3])
    smooth = cosine >= np.cos(np.radians(crease_angle)) - _COSINE_SLACK
    first, second = first[smooth], second[smooth]

    rows = np.concatenate([low_corner[first], high_corner[first]])
    columns = np.concatenate([low_corner[second], high_corner[second]])
    graph = coo_array((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(faces.size, faces.size))
    count, group = connected_components(graph, directed=False)
    new_faces = group.reshape(faces.shape).astype(np.int64)
    old_vertex = np.zeros(count, dtype=np.int64)
    old_vertex[group] = faces.ravel()
    _, normals = _weighted_normals(vertices, faces, new_faces, count)
    return old_vertex, new_faces, normals
