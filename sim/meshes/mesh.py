"""Meshes by file or by name, with unit vertex normals, materials, and every flaw counted or reported."""

import importlib.util
import io
import json
import logging
import math
import os
import re
import struct
import warnings
from collections.abc import Collection, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from blysk.golden.frame_constants import MAX_MATERIALS
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Material, Triple
from blysk.sim.errors import InputError, one_line
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "DEFAULT_CREASE",
    "DEFAULT_TRIANGLES",
    "MAX_FACES",
    "SUFFIXES",
    "FileMaterial",
    "LoadedMesh",
    "load_mesh",
    "surfaces",
]

SUFFIXES = (".obj", ".ply", ".stl", ".glb", ".gltf")
MAX_FACES = 20_000_000

DEFAULT_TRIANGLES = 10_000
"""Triangles of the teapot, about."""

DEFAULT_CREASE = 40.0
"""Degrees over which an edge is sharp, where a mesh has no normals."""

# The largest error of a stored normal's length that counts as rounding, itself stored in float32.
_LENGTH_TOLERANCE = 1 / 256 + 1e-6
# A triangle whose height is below this part of the largest coordinate is rounding only: 32 units of 2**-53.
_FLAT = 2.0**-48
# Slack of the crease test in the cosine: the rounding of vertices stored as float32.
_COSINE_SLACK = 1e-6

# k_a of a material whose k_d is the file's: most MTL files have a Ka of 1, which would wash the picture out.
_AMBIENT_SHARE = 0.1

# Bytes of a material file; 100,000 materials take less.
_MAX_LIBRARY = 16_000_000

_REEXPORT = "check the file or export it again"
_ONE_MATERIAL = "mend it, or shade the mesh with one material"
_NEEDS_DECODER = {"EXT_meshopt_compression", "KHR_meshopt_compression"}


@dataclass(frozen=True)
class FileMaterial:
    """What a file says of a material; ``None`` where it says nothing.

    Parameters
    ----------
    name : str
        Its name; empty for faces that have no material in the file.
    diffuse, specular : three floats or None
        Colours, each channel 0 to 1: factors of k_d and k_s, as they stand.
    exponent : int or None
        Exponent of the highlight, 1 to 1000.
    """

    name: str = ""
    diffuse: Triple | None = None
    specular: Triple | None = None
    exponent: int | None = None


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
    materials : tuple of FileMaterial
        Those that the mesh's ``material`` refers to, at least one; each is used by a face, and no two are
        equal but for the name.
    ignored : tuple of str
        What the file holds, or refers to, that the mesh and the materials do not show: textures, vertex
        colours, a material file that is not there.
    """

    mesh: Mesh
    name: str
    repaired_normals: int
    dropped_faces: int
    materials: tuple[FileMaterial, ...] = (FileMaterial(),)
    ignored: tuple[str, ...] = ()


def load_mesh(
    source: str,
    *,
    triangles: int = DEFAULT_TRIANGLES,
    crease_angle: float = DEFAULT_CREASE,
    materials: bool = True,
) -> LoadedMesh:
    """Load a mesh from a file, or build the teapot.

    Normals stored at the vertices of an OBJ, PLY, GLB or glTF file are kept. Zero, NaN and infinite ones
    are replaced by the computed normal, ones of another length are normalised; both are counted. Without
    stored normals (and for STL, which has them a face) vertices of equal position are welded, the mesh is
    cut along the edges where two faces meet at more than ``crease_angle``, and a vertex gets the sum of its
    face normals, weighted by the face's angle there.

    All meshes of a scene are put together in world coordinates: vertices by the node's matrix ``M``,
    normals by its inverse transpose, and a mirroring node (``det M < 0``) turns the triangles round.
    Points and lines beside a mesh are left out.

    Materials: of a GLB or glTF file ``pbrMetallicRoughness.baseColorFactor`` without its alpha, white where
    there is none; of an OBJ file the ``Kd``, ``Ks`` and ``Ns`` (rounded, at least 1) of its ``usemtl``, from
    the ``mtllib`` files in its folder. The factor of glTF is linear, as k_d is, and the picture is written
    without a transfer curve: it is used as it stands, as is Kd. Metal, roughness, transparency, emission and
    ``illum`` are not read. A material file that does not exist, or lacks a name, leaves the colours open
    (``None``) and is told in ``ignored``, with textures and vertex colours, which are never read either.
    Materials of no face are left out, and equal ones are one. PLY and STL files have one.

    Parameters
    ----------
    source : str
        ``teapot`` for the built-in one (a file of that name is ``./teapot``), else a path that ends in
        .obj, .ply, .stl, .glb or .gltf, in any case.
    triangles : int
        Triangles of the teapot, 64 to 4,000,000; of no effect for a file.
    crease_angle : float
        Degrees, 0 to 180. At 0 only coplanar faces share a normal, at 180 all faces do.
    materials : bool
        Whether to look at the file's materials; without, all faces have one that says nothing.

    Returns
    -------
    LoadedMesh
        The mesh, its materials, and the counts of what was mended.

    Raises
    ------
    InputError
        If a number is out of range, or the file is missing, empty, of unknown type, damaged, refers to
        files outside its folder, needs a decoder that is not installed, or holds no triangle, a vertex
        that is not finite, an index out of range, nodes that are no trees, or more than 20 million
        triangles; or a material in use has a colour that is not three numbers from 0 to 1 or an exponent
        over 1000, or there are more than 1024 of them.
    """
    if not 0 <= crease_angle <= 180:
        raise InputError(
            f"crease angle {crease_angle}", "it must be 0 to 180 degrees", "choose one in that range"
        )
    if source == "teapot":
        return LoadedMesh(teapot(triangles), "teapot", 0, 0)

    path = Path(source)
    try:
        data = _read(path)
        with _quiet_trimesh():
            scene, found = _load_scene(path, data, materials)
        # Overflow and NaN are looked for, and reported, in what comes out.
        with np.errstate(over="ignore", invalid="ignore"):
            return _assemble(scene, found, path, data, crease_angle)
    except _Refused as refusal:
        raise InputError(source, refusal.reason, refusal.remedy) from None
    except RecursionError as error:
        raise InputError(source, "is nested too deeply", _REEXPORT) from error
    # The loaders raise whatever a damaged file makes them trip over.
    except Exception as error:
        text = str(error).strip().split("\n")[0]
        kind = type(error).__name__
        misshapen = isinstance(error, AttributeError | IndexError | KeyError | TypeError)
        what = "is damaged, a part is missing or of a wrong kind" if misshapen else "cannot be read"
        reason = f"{what} ({kind}: {text})" if text else f"{what} ({kind})"
        raise InputError(source, reason, _REEXPORT) from error


def surfaces(
    materials: Sequence[FileMaterial], default: Material, fixed: Collection[str] = ()
) -> tuple[Material, ...]:
    """Reflection coefficients of a mesh's materials: what the file says, before a default.

    The file's diffuse colour is k_d, and a tenth of it k_a; its specular colour is k_s.

    Parameters
    ----------
    materials : sequence of FileMaterial
        Of `load_mesh`.
    default : Material
        Coefficients where the file says nothing.
    fixed : collection of str
        Fields of ``default`` that hold for all materials, whatever the file says: ``"diffuse"`` and so on.
    """
    result = []
    for material in materials:
        color = None if "diffuse" in fixed else material.diffuse
        said = {
            "ambient": color and tuple(_AMBIENT_SHARE * channel for channel in color),
            "diffuse": color,
            "specular": material.specular,
            "exponent": material.exponent,
        }
        said = {name: value for name, value in said.items() if value is not None and name not in fixed}
        result.append(replace(default, **said))
    return tuple(result)


@dataclass
class _Found:
    """A file's materials: number 0 for faces without one, then its own, and what each has that is not read.

    A material's text is read by `read` when a face uses it.
    """

    names: list[str] = field(default_factory=lambda: [""])
    texts: list[object] = field(default_factory=lambda: [None])
    ignored: list[str] = field(default_factory=list)

    def read(self, number: int) -> tuple[FileMaterial, int]:
        """One material and how many textures it has."""
        text, shown = self.texts[number], _shown(self.names[number])
        if text is None:
            return FileMaterial(shown), 0
        if isinstance(text, dict):
            return _gltf_material(text, shown or f"number {number - 1}", shown)
        return _mtl_material(text, shown)


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


def _load_scene(path: Path, data: bytes, materials: bool) -> tuple[trimesh.Scene, _Found]:
    """Check what trimesh does not, and load without touching any file that was not checked."""
    suffix = path.suffix.lower()
    references, options, found = {}, {"skip_materials": True}, _Found()
    if suffix == ".obj":
        data, libraries = _split_obj(data, found)
        if materials and len(found.names) > 1:
            _find_obj_materials(libraries, path.parent, found)
        data = _tidy_obj(data)
        if re.search(rb"^v(?: +[^\s]+){6}", data, re.MULTILINE):
            found.ignored.append("vertex colours")
        options["split_objects"] = True
    elif suffix == ".ply":
        data = _tidy_ply(data)
        head = data.partition(b"end_header")[0]
        if re.search(rb"^[ \t]*property[ \t]+\w+[ \t]+(diffuse_)?red\s*$", head, re.MULTILINE):
            found.ignored.append("vertex colours")
        if re.search(rb"^comment\s+TextureFile\b", head, re.MULTILINE):
            found.ignored.append("1 texture")
        # Cutting the mesh at texture seams would leave the stored normals in the old order.
        options["fix_texture"] = False
    elif suffix == ".stl":
        data = _tidy_stl(data)
    else:
        document = _gltf_document(data, suffix)
        _check_gltf(document)
        references = _gltf_references(document, path.parent)
        _find_gltf_materials(document, materials, found)
        data = _plain_gltf(document, data, suffix)
        options["skip_materials"] = False
    scene = trimesh.load_scene(
        io.BytesIO(data), file_type=suffix[1:], resolver=references, process=False, **options
    )
    return scene, found


def _shown(text: str) -> str:
    """Text of a file in a message."""
    return one_line(text, 60)


def _utf8(text: bytes) -> bytes:
    """Text with the names and comments of another encoding made harmless."""
    return text.decode("utf-8", "replace").encode()


def _split_obj(data: bytes, found: _Found) -> tuple[bytes, list[str]]:
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
            found.texts.append(None)
        return b"o %d" % numbers[rest]

    data = re.sub(rb"\\\r?\n", b"", _utf8(data))
    data = re.sub(rb"^[ \t]*(o|usemtl|mtllib)(?![^\s])([^\n]*)", replaced, data, flags=re.MULTILINE)
    return data, libraries


def _find_obj_materials(libraries: list[str], folder: Path, found: _Found) -> None:
    """Look up the names of materials in the material files; the texts are read where a face uses them."""
    texts = {}
    for name in dict.fromkeys(libraries):
        # A name with spaces, or several names.
        for part in [name] if os.path.isfile(_inside(folder, name)) else name.split():
            target = _inside(folder, part)
            if not os.path.isfile(target):
                found.ignored.append(f"the material file {_shown(part)!r}, which does not exist")
                continue
            if target.stat().st_size > _MAX_LIBRARY:
                raise _Refused(
                    f"its material file {_shown(part)!r} is over {_MAX_LIBRARY:,} bytes", "shorten it"
                )
            blocks = re.split(
                r"^[ \t]*newmtl(?!\S)", target.read_text("utf-8-sig", "replace"), flags=re.MULTILINE
            )
            for block in blocks[1:]:
                first, _, text = block.partition("\n")
                texts.setdefault(first.strip(), text)
    for number, name in enumerate(found.names[1:], 1):
        bare = name.partition(" #")[0].strip()
        found.texts[number] = texts.get(name, texts.get(bare))
    if missing := found.texts[1:].count(None):
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
            colors[keyword] = _color([_float(word) for word in given], keyword, name, " ".join(given))
    exponent = None
    if "Ns" in values:
        number = _float(" ".join(values["Ns"]))
        if not 0 <= number <= MAX_EXPONENT:
            raise _Refused(
                f"material {name!r} has Ns {_shown(' '.join(values['Ns']))!r}, not a number from 0 to "
                f"{MAX_EXPONENT}",
                _ONE_MATERIAL,
            )
        exponent = max(1, math.floor(number + 0.5))
    return FileMaterial(name, colors.get("Kd"), colors.get("Ks"), exponent), textures


def _float(word: str) -> float:
    """A number, or NaN."""
    try:
        return float(word)
    except ValueError:
        return math.nan


def _color(channels: list[float], what: str, name: str, text: str) -> Triple:
    if len(channels) != 3 or not all(0 <= channel <= 1 for channel in channels):
        raise _Refused(
            f"material {name!r} has {what} {_shown(text)!r}, not three numbers from 0 to 1", _ONE_MATERIAL
        )
    return tuple(map(float, channels))


def _tidy_obj(data: bytes) -> bytes:
    """An OBJ file in the form that trimesh reads; face lines that it would take wrongly are refused."""
    data = re.sub(rb"#.*", b"", data)
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
    rows = sum(int(count) for count in re.findall(rb"^[ \t]*element[ \t]+\S+[ \t]+(\d+)", head, re.MULTILINE))
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
        if len(data) < (said := max(length, 20 + json_length)):
            raise _Refused(f"it is cut short: the header says {said} bytes, there are {len(data)}")
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
    _check_nodes(document)
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


def _check_nodes(document: dict) -> None:
    """Refuse nodes that are no trees: trimesh would draw one of several places, or none, or never end."""
    nodes = document.get("nodes", [])
    children = [node.get("children", []) for node in nodes]
    roots = [scene.get("nodes", []) for scene in document.get("scenes", [])]
    below = [child for row in children for child in row]
    for index in [*below, *(root for row in roots for root in row)]:
        if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(nodes):
            raise _Refused(f"it refers to node {_shown(str(index))} (from 0), there are {len(nodes)}")
    if len(set(below)) < len(below):
        raise _Refused("one of its nodes hangs on two others", "export it with one parent a node")
    reached = list(set(range(len(nodes))).difference(below))
    for index in reached:
        reached += children[index]
    if len(reached) < len(nodes):
        raise _Refused("its nodes hang on each other in a circle")
    if any(len(set(row)) < len(row) or not set(row).isdisjoint(below) for row in roots):
        raise _Refused("one of its nodes is twice in a scene", "export it with the roots alone in the scene")


def _find_gltf_materials(document: dict, materials: bool, found: _Found) -> None:
    """Put numbers of materials in place of the materials, and leave out what hangs on textures.

    trimesh then tells the number of each part of a mesh, and there is no image that it could look for.
    """
    texts = document.pop("materials", None) or []
    for unread in ("images", "textures", "samplers"):
        document.pop(unread, None)
    colored = False
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            for name in list(attributes):
                if name.startswith(("COLOR_", "TEXCOORD_")):
                    colored |= name.startswith("COLOR_")
                    del attributes[name]
            index = primitive.pop("material", None)
            if index is None or not materials:
                continue
            if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(texts):
                raise _Refused(
                    f"a mesh refers to material {_shown(str(index))} (from 0), there are {len(texts)}",
                    _ONE_MATERIAL,
                )
            primitive["material"] = index
    if colored:
        found.ignored.append("vertex colours")
    if materials and texts:
        if not isinstance(texts, list) or not all(isinstance(text, dict) for text in texts):
            raise _Refused("its materials are no list of objects", _ONE_MATERIAL)
        found.names += [str(text.get("name", "")) for text in texts]
        found.texts += texts
        document["materials"] = [{"name": str(number)} for number in range(1, len(texts) + 1)]


def _gltf_material(text: dict, name: str, given_name: str) -> tuple[FileMaterial, int]:
    """A material of a glTF document, and how many textures it has."""
    look = text.get("pbrMetallicRoughness", {})
    factor = look.get("baseColorFactor", [1, 1, 1, 1]) if isinstance(look, dict) else look
    numbers = factor if isinstance(factor, list) and len(factor) == 4 else []
    usable = all(isinstance(number, int | float) and not isinstance(number, bool) for number in numbers)
    color = _color(numbers[:3] if usable else [], "baseColorFactor", name, str(factor))
    textures = sum(key.endswith("Texture") for part in (look, text) for key in part)
    return FileMaterial(given_name, color), textures


def _plain_gltf(document: dict, data: bytes, suffix: str) -> bytes:
    """A GLB or glTF file with another document, without cameras: trimesh would lose what hangs on one."""
    for node in document.get("nodes", []):
        node.pop("camera", None)
    text = json.dumps(document).encode()
    if suffix == ".gltf":
        return text
    text += b" " * (-len(text) % 4)
    length, old = struct.unpack_from("<II", data, 8)
    rest = data[20 + old : length]
    return data[:8] + struct.pack("<II", 20 + len(text) + len(rest), len(text)) + data[16:20] + text + rest


def _gltf_references(document: dict, folder: Path) -> dict[str, bytes]:
    """The files that a glTF document takes its buffers from, by the URI it calls them; all in its folder."""
    references = {}
    for buffer in document.get("buffers", []):
        uri = buffer.get("uri")
        if uri is None or uri.startswith("data:"):
            continue
        target = _inside(folder, uri, unquote(uri))
        if not os.path.isfile(target):
            raise _Refused(f"it refers to {uri!r}, which does not exist", "put that file beside it")
        references[uri] = target.read_bytes()
    return references


def _inside(folder: Path, reference: str, name: str | None = None) -> Path:
    """The file that a reference means, in the folder or one below; it need not exist."""
    name = reference if name is None else name
    # Of a name that is too long, or links in a circle, `Path` has exceptions to tell.
    target = Path(os.path.realpath(folder / name))
    outside = re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", reference) or reference.startswith(("/", "\\"))
    if outside or ".." in Path(name).parts or not target.is_relative_to(folder.resolve()):
        raise _Refused(f"it refers to {reference!r}, outside its folder", "put that file beside it")
    return target


def _assemble(
    scene: trimesh.Scene, found: _Found, path: Path, data: bytes, crease_angle: float
) -> LoadedMesh:
    """All triangles of a scene in world coordinates, as one mesh."""
    nodes = _placed(scene)
    numbers = {name: _number(name, scene.geometry[name], path) for _, name in nodes}
    nodes = [(matrix, scene.geometry[name], numbers[name]) for matrix, name in nodes]
    nodes = [node for node in nodes if isinstance(node[1], trimesh.Trimesh) and len(node[1].faces)]
    if not nodes:
        raise _Refused("it has no faces", "use a mesh of triangles; points and lines are not shaded")
    if (total := sum(len(geometry.faces) for _, geometry, _ in nodes)) > MAX_FACES:
        raise _Refused(f"it has {total} triangles; the limit is {MAX_FACES}", "simplify it")

    # trimesh drops the normals of an OBJ file if one of their indices is missing or out of range.
    promised = path.suffix.lower() == ".obj" and re.search(rb"^f\b.*/-?\d*/-?\d", data, re.MULTILINE)
    vertices, normals, faces, material, lost = [], [], [], [], 0
    offset = 0
    for matrix, geometry, number in nodes:
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
        if not np.array_equal(matrix, np.eye(4)):
            rotation = np.array(matrix[:3, :3])
            # The cofactors are the inverse transpose times the determinant, and exist if it is 0.
            cofactors = np.cross(np.roll(rotation, -1, axis=0), np.roll(rotation, -2, axis=0))
            mirrored = np.linalg.det(rotation) < 0
            part = part @ rotation.T + matrix[:3, 3]
            stored = _transformed(stored, -cofactors if mirrored else cofactors)
            triangles = triangles[:, ::-1] if mirrored else triangles
        faces.append(triangles + offset)
        material.append(np.full(len(triangles), number))
        vertices.append(part)
        normals.append((stored, np.full(len(part), has_normals)))
        offset += len(part)
    loaded = _finish(
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(material),
        np.concatenate([stored for stored, _ in normals]),
        np.concatenate([flag for _, flag in normals]),
        path.stem,
        lost,
        crease_angle,
    )
    return _with_materials(loaded, found)


def _placed(scene: trimesh.Scene) -> list[tuple[np.ndarray, str]]:
    """Matrix into the world, and name, of the geometry of every node that has one.

    trimesh's own way takes time by the cube of a node's level.
    """
    graph = scene.graph.transforms
    below = {}
    for (parent, child), edge in graph.edge_data.items():
        below.setdefault(parent, []).append((child, edge["matrix"]))
    frames = [(scene.graph.base_frame, np.eye(4))]
    for frame, matrix in frames:
        frames += [(child, matrix @ step) for child, step in below.get(frame, [])]
    names = [(matrix, graph.node_data[frame].get("geometry")) for frame, matrix in frames]
    return [(matrix, name) for matrix, name in names if name is not None]


def _number(name: str, geometry: object, path: Path) -> int:
    """Number of a part's material."""
    suffix = path.suffix.lower()
    if suffix == ".obj":
        return int(name) if name.isdecimal() else 0
    material = getattr(getattr(geometry, "visual", None), "material", None)
    return 0 if material is None or suffix not in (".glb", ".gltf") else int(material.name)


def _with_materials(loaded: LoadedMesh, found: _Found) -> LoadedMesh:
    """The mesh with the materials that its faces use, numbered from 0, equal ones as one."""
    used, of_face = np.unique(loaded.mesh.material, return_inverse=True)
    places, materials, of_used, textures = {}, [], [], 0
    for number in used.tolist():
        material, its_textures = found.read(number)
        textures += its_textures
        place = places.setdefault(replace(material, name=""), len(materials))
        if place == len(materials):
            materials.append(material)
        elif not materials[place].name:
            materials[place] = material
        of_used.append(place)
    if len(materials) > MAX_MATERIALS:
        raise _Refused(f"it has {len(materials)} materials; the limit is {MAX_MATERIALS}", _ONE_MATERIAL)
    if textures:
        found.ignored.append(f"{textures} texture{'s' * (textures > 1)}")
    return replace(
        loaded,
        mesh=replace(loaded.mesh, material=np.array(of_used)[of_face.ravel()]),
        materials=tuple(materials),
        ignored=tuple(found.ignored),
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
    material: np.ndarray,
    normals: np.ndarray,
    has_normals: np.ndarray,
    name: str,
    lost: int,
    crease_angle: float,
) -> LoadedMesh:
    """Drop faces without area, mend stored normals, compute the others; materials still by their numbers."""
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
    faces, material = faces[solid], material[solid]
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
        material=np.concatenate([material[kept], material[~kept]]).astype(np.int64),
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
