"""Meshes by file or by name, with unit vertex normals and materials. Every flaw is counted or reported."""

import io
import logging
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

import numpy as np
from numpy.typing import ArrayLike

from blysk.golden.frame_constants import MAX_MATERIALS
from blysk.golden.reference.geometry import Mesh
from blysk.sim.errors import InputError
from blysk.sim.meshes.gltf import (
    check_gltf,
    complete_scene,
    find_gltf_materials,
    gltf_document,
    plain_gltf,
    tell_contents,
)
from blysk.sim.meshes.gltf_arrays import gltf_buffers, plain_arrays
from blysk.sim.meshes.gltf_textures import GltfTextures
from blysk.sim.meshes.materials import FileMaterial, Found
from blysk.sim.meshes.mesh_path import check_mesh_path
from blysk.sim.meshes.mtl import find_obj_materials
from blysk.sim.meshes.normals import (
    DEFAULT_CREASE,
    crease_normals,
    face_directions,
    repaired_normals,
    transformed,
)
from blysk.sim.meshes.obj import read_obj, split_obj
from blysk.sim.meshes.parts import scene_of
from blysk.sim.meshes.ply import find_ply_images, read_ply
from blysk.sim.meshes.refusal import MAX_FACES, ONE_MATERIAL, REEXPORT, Refused, refers
from blysk.sim.meshes.stl import read_stl
from blysk.sim.meshes.teapot import DEFAULT_TRIANGLES, teapot
from blysk.sim.run_files import OutputIsInput, reads

if TYPE_CHECKING:
    import trimesh

__all__ = ["LoadedMesh", "given_mesh", "load_mesh", "merged"]


GIVE_ARRAYS = "give (vertices, faces) or (vertices, faces, normals)"
GIVE_A_MESH = (
    'give "teapot", the name of a mesh or scene file, a blysk.Mesh, a trimesh.Trimesh or trimesh.Scene, or '
    "(vertices, faces) or (vertices, faces, normals)"
)


# Coordinates beyond which the steps of a float32 are as large as an image of 8 texels.
_FARTHEST = 2.0**20
# How far from 0 to 1 a colour may lie by rounding.
_ROUNDED = 1e-6


@dataclass(frozen=True)
class LoadedMesh:
    """A mesh, its materials, and the counts of repairs.

    Parameters
    ----------
    mesh : Mesh
        The triangles, with unit vertex normals, and perhaps colours and texture coordinates.
    name : str
        ``teapot``, or the file's name without folder and suffix.
    repaired_normals : int
        Stored vertex normals that were zero, not finite, or more than 1/256 off unit length, or that the
        file refers to but does not hold.
    dropped_faces : int
        Dropped triangles without area: two corners are at one position, or no triangle shares a side. Other
        triangles without area stay, because they close the seam between a side and its parts.
    opposed_faces : int
        Triangles whose stored normals all point against their winding. Their light falls on the other side.
    materials : tuple of FileMaterial
        Materials that the mesh's ``material`` refers to, at least one. Each is used by a face, and any two
        differ in more than the name.
    ignored : tuple of str
        Contents or references of the file that change a picture and are not read: alpha, textures other than
        those of the colour, a missing image or material file, and the names that a reader does not know.
    """

    mesh: Mesh
    name: str
    repaired_normals: int
    dropped_faces: int
    opposed_faces: int = 0
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

    *Normals* stored at the vertices of an OBJ, PLY, GLB or glTF file are kept. The computed normal replaces
    zero, NaN and infinite normals. Normals of another length are normalised. Both kinds are counted. Without
    stored normals (and for STL, whose normals belong to faces)

    - vertices of equal position are welded;
    - the mesh is cut along the edges where two faces meet at more than ``crease_angle``;
    - a vertex gets the unit vector along the sum of its face normals, each weighted by the face's angle at
      the vertex.

    *Geometry.* All meshes of a scene are put together in world coordinates: vertices by the node's matrix
    ``M``, normals by its inverse transpose. A mirroring node (``det M < 0``) turns the triangles round.
    Points and lines beside a mesh are left out. Polygons of OBJ and PLY files are cut into triangles that
    cover them and keep all their corners, concave polygons by ear clipping. Strips of PLY and glTF are drawn.
    Quantised and sparse arrays of glTF are read, and all instances of a node drawn. Morph weights and skins
    are not applied. A glTF file without scenes shows its root nodes. Invisible nodes (KHR_node_visibility)
    are left out. Texts may begin with a byte order mark, and have any ends of lines.

    *Materials.* Of a GLB or glTF file these are read:

    - the base colour without its alpha, metallic and roughness factors of ``pbrMetallicRoughness``, each 1 if
      missing (see `Material.of_metallic_roughness`);
    - the factors of KHR_materials_pbrSpecularGlossiness, which replace them (see
      `Material.of_specular_glossiness`);
    - ``emissiveFactor``, with KHR_materials_emissive_strength, unless it has a texture;
    - KHR_materials_unlit and ``doubleSided``;
    - the texture of the colour, see `load_texture`: its sampler, its set of coordinates,
      KHR_texture_transform, and its image in the buffer, in the text or in a file of the folder;
    - colours of vertices, COLOR_0, without alpha.

    A sampler's filter for enlarging serves both ways. Levels are chosen, not blended.

    Of an OBJ file these are read from the ``mtllib`` files in its folder: ``Kd``, ``Ks`` and ``Ns`` (rounded,
    at least 1), or ``Kd``, roughness ``Pr`` and metallic factor ``Pm``. The factors of glTF are linear, as
    k_d is, and the picture is written without a transfer curve. So they are used without conversion, and Kd,
    too. If a material file is missing, or lacks a name, the colours are ``None``. Materials of no face are
    left out, and equal materials merged. PLY and STL files have one material.

    *Looks.* In a mesh with colours of vertices other vertices are white. Colours over 1 count as 1, and are
    told. Corners of equal normal are welded only if their colours and texture coordinates are equal, too. A
    part without texture coordinates is drawn without its texture, and so is a part whose image is not there.

    Contents that change a picture and are not read are in ``ignored``: other textures, alpha, ``illum``,
    smoothing groups, lights, cameras, animations. Each reader has a list of the
    statements, keywords, properties, keys and extensions that it knows. Others are in ``ignored`` by their
    names.

    Parameters
    ----------
    source : str
        ``teapot`` for the built-in mesh (a file of that name is ``./teapot``), else a path that ends in
        .obj, .ply, .stl, .glb or .gltf, in upper or lower case.
    triangles : int
        Approximate number of triangles of the teapot, 64 to 4,000,000. Without effect for a file.
    crease_angle : float
        Degrees, 0 to 180. At 0 only coplanar faces share a normal, at 180 all faces do.
    materials : bool
        Whether to read the file's materials and colours. If not, all faces have one material without values.

    Returns
    -------
    LoadedMesh
        The mesh, its materials, and the counts of repairs.

    Raises
    ------
    InputError
        In one of these cases:

        - a number is out of range;
        - the file is missing, empty, of unknown type or damaged;
        - it refers to buffers outside its folder;
        - it needs a decoder that is not installed, or a glTF extension that is not supported;
        - it has numbers in another form than the format's;
        - it holds no triangle, a vertex that is not finite, an index out of range, nodes that form no trees,
          or more than 20 million triangles;
        - a used material has a colour that is not three numbers from 0 to 1, or an exponent over 1000;
        - an image, colour, texture coordinate, sampler or transform that is used is damaged or out of range;
        - more than 1024 materials are in use.
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
            return _assemble(scene, found, path, data, crease_angle, materials)
    except Refused as refusal:
        raise InputError(source, refusal.reason, refusal.remedy) from None
    except OutputIsInput:
        raise
    except RecursionError as error:
        raise InputError(source, "is nested too deeply", REEXPORT) from error
    # The loaders raise whatever a damaged file makes them trip over.
    except Exception as error:
        raise InputError(source, _fault(error), REEXPORT) from error


def given_mesh(source: object, crease_angle: float = DEFAULT_CREASE) -> LoadedMesh:
    """A mesh of another library, or of arrays, with its flaws mended as for a file.

    Parameters
    ----------
    source : trimesh.Trimesh or trimesh.Scene or sequence of arrays
        Arrays are vertices, shape (V, 3), faces, shape (F, 3), from 0 and anticlockwise seen from outside,
        and perhaps normals, one a vertex. Of trimesh's objects stored normals are kept. All faces have one
        material.
    crease_angle : float
        As for `load_mesh`, for a mesh without normals.

    Raises
    ------
    InputError
        If the source is no mesh, or has no faces or too many, an index out of range or a vertex that is not
        finite.
    """
    if any(base.__module__.partition(".")[0] == "trimesh" for base in type(source).__mro__):
        import trimesh

        name = f"trimesh.{type(source).__name__}"
        scene = trimesh.Scene(source) if isinstance(source, trimesh.Trimesh) else source
        if isinstance(scene, trimesh.Scene):
            found = Found()
            if any(_is_painted(geometry) for geometry in scene.geometry.values()):
                found.tell("materials and colours of trimesh")
            return _given(name, lambda: _assemble(scene, found, Path("trimesh"), b"", crease_angle))
    elif isinstance(source, list | tuple) and len(source) in (2, 3):
        return _given("the arrays of a mesh", lambda: _of_arrays(source, crease_angle))
    raise InputError(f"a mesh of type {type(source).__name__}", "cannot be drawn", GIVE_A_MESH)


def _given(name: str, load: Callable[[], LoadedMesh]) -> LoadedMesh:
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            return load()
    except Refused as refusal:
        remedy = "mend the mesh" if refusal.remedy == REEXPORT else refusal.remedy
        raise InputError(name, refusal.reason, remedy) from None


def _is_painted(geometry: object) -> bool:
    """Whether trimesh has a material or colours for a geometry."""
    visual = getattr(geometry, "visual", None)
    return visual is not None and bool(visual.defined)


def _of_arrays(source: Sequence[ArrayLike], crease_angle: float) -> LoadedMesh:
    """The mesh of vertices, faces and perhaps normals."""
    names = ("vertices", "faces", "normals")[: len(source)]
    arrays = {}
    for name, given in zip(names, source, strict=True):
        try:
            array = np.asarray(given)
        except ValueError:
            array = np.empty(0, dtype=object)
        kinds, what = ("iu", "whole numbers") if name == "faces" else ("iuf", "numbers")
        if array.ndim != 2 or array.shape[1] != 3 or not len(array) or array.dtype.kind not in kinds:
            found = f"{array.dtype} of shape {array.shape}" if array.dtype != object else "not"
            raise Refused(f"{name} must be {what} of shape (count, 3), and are {found}", GIVE_ARRAYS)
        arrays[name] = array.astype(np.int64 if name == "faces" else np.float64)
    vertices, faces = arrays["vertices"], arrays["faces"]
    if len(faces) > MAX_FACES:
        raise Refused(f"it has {len(faces)} triangles; the limit is {MAX_FACES}", "simplify it")
    if not 0 <= faces.min() <= faces.max() < len(vertices):
        wrong = faces.min() if faces.min() < 0 else faces.max()
        raise Refused(f"a face refers to vertex {wrong} (from 0), but there are {len(vertices)}")
    normals = arrays.get("normals", np.full(vertices.shape, np.nan))
    if normals.shape != vertices.shape:
        raise Refused(f"there are {len(normals)} normals for {len(vertices)} vertices", GIVE_ARRAYS)
    flags = np.full(len(vertices), "normals" in arrays)
    material = np.zeros(len(faces), dtype=np.int64)
    none = np.zeros((0, 3)), np.zeros((0, 2))
    return _finish(vertices, faces, material, normals, flags, *none, "arrays", 0, crease_angle)


def _fault(error: Exception) -> str:
    """A loader's exception as a reason in terms of the file, not of the program."""
    damaged = "is damaged, a part is missing or of a wrong kind"
    if isinstance(error, AssertionError | AttributeError | KeyError | TypeError):
        return damaged
    text = str(error).strip().split("\n")[0]
    text = re.sub(r"^(\w+\.)*\w*(Error|Exception)\b:? *", "", text)
    if isinstance(error, IndexError):
        found = re.match(r"index (-?\d+) is out of bounds .* with size (\d+)", text)
        where = f"entry {int(found[1]) + 1} of a list of {found[2]}" if found else text
        return f"refers to what is not there ({where})" if text else damaged
    what = "cannot be read"
    return f"{what} ({text})" if text else what


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
    """The file's bytes, after a check of its path, suffix and size."""
    try:
        check_mesh_path(path)
        reads(path)
        data = path.read_bytes()
    except OSError as error:
        raise Refused(f"cannot be opened ({error.strerror})", "check the path and its permissions") from error
    if not data:
        raise Refused("the file is empty")
    return data


def _load_scene(path: Path, data: bytes, materials: bool) -> "tuple[trimesh.Scene, Found]":
    """A scene of trimesh, glTF by trimesh's loader; no file is opened that was not checked."""
    suffix, found = path.suffix.lower(), Found()
    if suffix == ".obj":
        data, libraries = split_obj(data, found)
        for name in libraries:
            refers(path.parent, name, *name.split())
        images = {}
        if materials and len(found.names) > 1:
            images = find_obj_materials(libraries, path.parent, found)
        return scene_of(read_obj(data, found, images, materials)), found
    if suffix == ".ply":
        parts, names = read_ply(data, found, materials)
        refers(path.parent, *names)
        if materials:
            find_ply_images(names, path.parent, found)
        return scene_of(parts), found
    if suffix == ".stl":
        return scene_of([read_stl(data, found, materials)]), found
    document = gltf_document(data, suffix, found)
    check_gltf(document)
    images = document.get("images")
    images = images if isinstance(images, list) else []
    uris = [image.get("uri") for image in images if isinstance(image, dict)]
    refers(path.parent, *(unquote(uri) for uri in uris if isinstance(uri, str) and len(uri) < 4096))
    buffers = gltf_buffers(document, data, suffix, path.parent)
    complete_scene(document, found)
    textures = GltfTextures(document, buffers, path.parent, found)
    texts = find_gltf_materials(document, materials, textures, found)
    tell_contents(document, found)
    arrays, looks = plain_arrays(document, buffers, texts, found)
    data = plain_gltf(document)
    # Its import takes longer than to draw a small picture; only a file needs it.
    import trimesh

    scene = trimesh.load_scene(io.BytesIO(data), file_type="gltf", resolver={"0": arrays}, process=False)
    for geometry in scene.geometry.values():
        geometry.metadata.update(looks[int(geometry.visual.material.name)])
    return scene, found


def _assemble(
    scene: "trimesh.Scene",
    found: Found,
    path: Path,
    data: bytes,
    crease_angle: float,
    painted: bool = False,
) -> LoadedMesh:
    """All triangles of a scene in world coordinates, as one mesh.

    If it is ``painted``, a part's metadata may have ``"colors"``, a float64 array of shape (V, 3), linear,
    and ``"coordinates"``, a float64 array of shape (V, 2), with v from the top of the image.
    """
    import trimesh

    nodes = _placed(scene)
    nodes = [
        (matrix, scene.geometry[name], scene.geometry[name].metadata["material"]) for matrix, name in nodes
    ]
    nodes = [node for node in nodes if isinstance(node[1], trimesh.Trimesh) and len(node[1].faces)]
    if not nodes:
        ignored = f" (not read: {'; '.join(found.ignored)})" if found.ignored else ""
        raise Refused(f"it has no faces{ignored}", "use a mesh of triangles; points and lines are not shaded")
    if (total := sum(len(geometry.faces) for _, geometry, _ in nodes)) > MAX_FACES:
        raise Refused(f"it has {total} triangles; the limit is {MAX_FACES}", "simplify it")

    # trimesh drops the normals of an OBJ file if one of their indices is missing or out of range.
    promised = path.suffix.lower() == ".obj" and re.search(rb"^f\b.*/-?\d*/-?\d", data, re.MULTILINE)
    vertices, normals, faces, material, lost = [], [], [], [], 0
    colors: list[np.ndarray | None] = []
    coordinates: list[np.ndarray | None] = []
    offset = 0
    for matrix, geometry, number in nodes:
        part, triangles = np.array(geometry.vertices), np.array(geometry.faces)
        if not 0 <= triangles.min() <= triangles.max() < len(part):
            wrong = triangles.min() if triangles.min() < 0 else triangles.max()
            raise Refused(f"a face refers to vertex {wrong} (from 0), but there are {len(part)}")
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
            stored = transformed(stored, -cofactors if mirrored else cofactors)
            triangles = triangles[:, ::-1] if mirrored else triangles
        metadata = geometry.metadata if painted else {}
        colors.append(_colors(metadata.get("colors"), triangles, found))
        coordinates.append(_coordinates(metadata.get("coordinates"), triangles))
        kind = 4 * number + 2 * (colors[-1] is not None) + (coordinates[-1] is not None)
        faces.append(triangles + offset)
        material.append(np.full(len(triangles), kind))
        vertices.append(part)
        normals.append((stored, np.full(len(part), has_normals)))
        offset += len(part)
    loaded = _finish(
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(material),
        np.concatenate([stored for stored, _ in normals]),
        np.concatenate([flag for _, flag in normals]),
        _joined(colors, vertices, np.ones((1, 3))),
        _joined(coordinates, vertices, np.zeros((1, 2))),
        path.stem,
        lost,
        crease_angle,
    )
    return _with_materials(loaded, found)


def _colors(given: np.ndarray | None, faces: np.ndarray, found: Found) -> np.ndarray | None:
    """Colours of a part's vertices, 0 to 1; colours over 1 are told."""
    if given is None:
        return None
    used = np.unique(faces)
    seen = given[used]
    if wrong := np.flatnonzero(~(np.isfinite(seen) & (seen >= -_ROUNDED)).all(axis=1)).tolist():
        text = " ".join(f"{channel:g}" for channel in seen[wrong[0]].tolist())
        raise Refused(f"a vertex has the colour {text!r}, not three numbers from 0", ONE_MATERIAL)
    over = int((seen > 1 + _ROUNDED).any(axis=1).sum())
    found.tell("vertex colour's part over 1", "vertex colours' parts over 1", over)
    result = np.ones(given.shape)
    result[used] = np.clip(seen, 0, 1)
    return result


def _coordinates(given: np.ndarray | None, faces: np.ndarray) -> np.ndarray | None:
    """Texture coordinates of a part's vertices, finite."""
    if given is None:
        return None
    used = np.unique(faces)
    if wrong := np.flatnonzero(~(np.abs(given[used]) <= _FARTHEST).all(axis=1)).tolist():
        text = " ".join(f"{number:g}" for number in given[used[wrong[0]]].tolist())
        raise Refused(
            f"a vertex has the texture coordinates {text!r}, not numbers to {_FARTHEST:,.0f}", ONE_MATERIAL
        )
    result = np.zeros(given.shape)
    result[used] = given[used]
    return result


def _joined(parts: list[np.ndarray | None], vertices: list[np.ndarray], other: np.ndarray) -> np.ndarray:
    """Values of all vertices, with another value where a part has none; no rows if no part has any."""
    if all(part is None for part in parts):
        return other[:0]
    return np.concatenate(
        [
            np.repeat(other, len(of), axis=0) if part is None else part
            for part, of in zip(parts, vertices, strict=True)
        ]
    )


def _placed(scene: "trimesh.Scene") -> list[tuple[np.ndarray, str]]:
    """Matrix into the world, and name, of the geometry of every node that has one.

    The time of trimesh's own function grows with the cube of a node's depth in the tree.
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


def _with_materials(loaded: LoadedMesh, found: Found) -> LoadedMesh:
    """The mesh with the materials that its faces use, numbered from 0, equal ones merged.

    The faces have four times the number of their material in the file, plus 2 if their vertices have colours,
    plus 1 if these have texture coordinates.
    """
    used = np.unique(loaded.mesh.material).tolist()
    read = {number: found.read(number) for number in sorted({kind // 4 for kind in used})}
    materials = {}
    for kind in used:
        material = read[kind // 4]
        # White vertices are white, and not of the colour of a default.
        colored = kind & 2 > 0 and (len(loaded.mesh.colors) > 0 or material.diffuse is None)
        material = replace(material, colored=colored)
        if material.texture is not None and not kind & 1:
            found.tell("texture of a part without coordinates", "textures of parts without coordinates")
            material = replace(material, texture=None)
        if material.has_albedo and 0 < (material.metallic or 0.0) < 1:
            found.tell("the exact highlights of colours that are partly metallic")
        materials[kind] = material
    loaded = merged(loaded, materials)
    mesh = loaded.mesh
    if all(material.texture is None for material in loaded.materials):
        mesh = replace(mesh, coordinates=mesh.coordinates[:0])
    return replace(loaded, mesh=mesh, ignored=found.ignored)


def merged(loaded: LoadedMesh, of: Mapping[int, FileMaterial]) -> LoadedMesh:
    """A mesh with materials numbered from 0, equal ones merged; its faces have the keys of these materials.

    Raises
    ------
    Refused
        If there are more than 1024.
    """
    used, of_face = np.unique(loaded.mesh.material, return_inverse=True)
    places: dict[FileMaterial, int] = {}
    materials: list[FileMaterial] = []
    of_used = []
    for number in used.tolist():
        material = of[number]
        place = places.setdefault(replace(material, name=""), len(materials))
        if place == len(materials):
            materials.append(material)
        elif not materials[place].name:
            materials[place] = material
        of_used.append(place)
    if len(materials) > MAX_MATERIALS:
        raise Refused(f"it has {len(materials)} materials; the limit is {MAX_MATERIALS}", ONE_MATERIAL)
    return replace(
        loaded,
        mesh=replace(loaded.mesh, material=np.array(of_used)[of_face.ravel()]),
        materials=tuple(materials),
    )


def _finish(
    vertices: np.ndarray,
    faces: np.ndarray,
    material: np.ndarray,
    normals: np.ndarray,
    has_normals: np.ndarray,
    colors: np.ndarray,
    coordinates: np.ndarray,
    name: str,
    lost: int,
    crease_angle: float,
) -> LoadedMesh:
    """Mend stored normals, compute the others; materials keep the file's numbers.

    Faces without area stay where their sides join others, and are dropped where they join none.
    """
    used = np.unique(faces)
    broken = len(used) - np.isfinite(vertices[used]).all(axis=1).sum()
    if broken:
        raise Refused(f"{broken} of its vertices are NaN or infinite")
    if not np.ptp(vertices[used], axis=0).any():
        raise Refused("all its vertices are at one point")

    # Tiny and huge models would under- and overflow in the products below.
    scaled = vertices / np.abs(vertices[used]).max()
    directions, found, solid = face_directions(scaled, faces)
    if not solid.any():
        raise Refused("none of its faces has an area")
    dropped = int(len(faces) - found.sum())
    faces, material, directions = faces[found], material[found], directions[found]

    kept = has_normals[faces[:, 0]]
    if (colors == 1).all():
        colors = colors[:0]
    looks = np.concatenate([given for given in (colors, coordinates) if len(given)] or [colors], axis=1)
    corner, smooth_faces, smooth_normals = crease_normals(
        scaled, faces[~kept], directions[~kept], crease_angle, looks
    )
    own = np.unique(faces[kept])
    own_normals, repaired = repaired_normals(scaled, faces[kept], directions[kept], normals, own)
    renumbered = np.searchsorted(own, faces[kept])
    kept_vertices = np.concatenate([own, corner])
    mesh = Mesh(
        vertices=vertices[kept_vertices],
        faces=np.concatenate([renumbered, smooth_faces + len(own)]).astype(np.int64),
        normals=np.concatenate([own_normals, smooth_normals]),
        material=np.concatenate([material[kept], material[~kept]]).astype(np.int64),
        colors=colors[kept_vertices] if len(colors) else colors,
        coordinates=coordinates[kept_vertices] if len(coordinates) else coordinates,
    )
    opposed = (np.einsum("fki,fi->fk", own_normals[renumbered], directions[kept]) < 0).all(axis=1).sum()
    return LoadedMesh(mesh, name, repaired + lost, dropped, int(opposed))
