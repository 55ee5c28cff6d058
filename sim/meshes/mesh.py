"""Meshes from files, objects and arrays, with unit vertex normals and materials. Flaws are counted."""

import io
import logging
import re
import warnings
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

import numpy as np
from numpy.typing import ArrayLike

from blysk.golden.lighting.intensity import MAX_LIGHTS
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
from blysk.sim.meshes.gltf_views import GltfViews, gltf_views, placed_camera, placed_lights
from blysk.sim.meshes.loaded_mesh import LoadedMesh, assembled, finished
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.mesh_path import check_mesh_path
from blysk.sim.meshes.mtl import find_obj_materials
from blysk.sim.meshes.normals import DEFAULT_CREASE
from blysk.sim.meshes.obj import read_obj, split_obj
from blysk.sim.meshes.parts import scene_of
from blysk.sim.meshes.ply import find_ply_images, read_ply
from blysk.sim.meshes.polygons import check_corners
from blysk.sim.meshes.refusal import MAX_FACES, REEXPORT, Refused, refers
from blysk.sim.meshes.stl import read_stl
from blysk.sim.meshes.teapot import DEFAULT_TRIANGLES, teapot
from blysk.sim.run_files import OutputIsInput, reads

if TYPE_CHECKING:
    import trimesh

__all__ = ["given_mesh", "load_mesh"]

GIVE_ARRAYS = "give (vertices, faces) or (vertices, faces, normals)"
GIVE_A_MESH = (
    'give "teapot", the name of a mesh or scene file, a blysk.Mesh, a trimesh.Trimesh or trimesh.Scene, or '
    "(vertices, faces) or (vertices, faces, normals)"
)


def load_mesh(
    source: str,
    *,
    triangles: int = DEFAULT_TRIANGLES,
    crease_angle: float = DEFAULT_CREASE,
    materials: bool = True,
    lights: int = MAX_LIGHTS,
    local: bool = True,
    camera: bool = True,
) -> LoadedMesh:
    """Load a mesh from a file, or build the teapot.

    *Normals* stored at the vertices of an OBJ, PLY, GLB or glTF file are kept. The computed normal replaces
    zero, NaN and infinite normals. Normals of another length are normalised. Both repairs are counted.
    Without stored normals (and for STL, whose normals belong to faces)

    - vertices of equal position are welded;
    - the mesh is cut along the edges where two faces meet at more than ``crease_angle``;
    - a vertex gets the unit vector along the sum of its face normals, each weighted by the face's angle at
      the vertex.

    *Geometry.* All meshes of a scene are put together in world coordinates: vertices by the node's matrix
    ``M``, normals by its inverse transpose. A mirroring node (``det M < 0``) reverses the order of corners.
    Points and lines in a file with a mesh are left out. Polygons of OBJ and PLY files are cut into triangles.
    The triangles cover the polygons and keep all their corners. Concave polygons are cut by ear clipping.
    Strips of PLY and glTF are drawn. Quantised and sparse arrays of glTF are read. All instances of a node
    are drawn. Morph weights and skins are not applied. A glTF file without scenes shows its root nodes.
    Invisible nodes (KHR_node_visibility) are left out. Text files may begin with a byte order mark, and may
    have any line ends.

    *Materials.* Of a GLB or glTF file these are read:

    - the base colour, metallic and roughness factors of ``pbrMetallicRoughness``, each 1 if
      missing (see `Material.of_metallic_roughness`);
    - the factors of KHR_materials_pbrSpecularGlossiness, which replace them (see
      `Material.of_specular_glossiness`);
    - ``emissiveFactor``, with KHR_materials_emissive_strength, unless it has a texture;
    - KHR_materials_unlit and ``doubleSided``;
    - the texture of the colour, see `load_texture`: its sampler, its set of coordinates,
      KHR_texture_transform, and its image in the buffer, in the text or in a file of the folder;
    - colours of vertices, COLOR_0;
    - with ``alphaMode`` MASK the ``alphaCutoff`` (0.5 if missing), and alpha of the factor, of the texture
      and of COLOR_0. Pixels under the cutoff are dropped before the depth test. Alpha of other modes is not
      read, and is listed in ``ignored``.

    A sampler's filter for enlarging also serves for reducing. Levels are chosen, not blended.

    Of an OBJ file these are read from the ``mtllib`` files in its folder:

    - the colour ``Kd``;
    - ``Ks`` and ``Ns`` (rounded, at least 1), or in their place roughness ``Pr`` and metallic factor ``Pm``;
    - ``Ke``, light that the surface emits;
    - ``illum 0``, which makes the material unlit.

    The factors of glTF are linear, as k_d is. So they are used without conversion. ``Kd`` is used without
    conversion, too. If a material file is missing, or has no material of the name that is used, the colours
    are ``None``. If a name is defined twice, the first definition counts. Materials that no face uses are
    left out, and equal materials are merged.

    *Colours of other formats* are decoded by the curve of sRGB:

    - of OBJ red, green and blue behind a position, and the image of ``map_Kd`` with ``-s``, ``-o`` and
      ``-clamp``;
    - of PLY the colours of vertices, and the images of ``comment TextureFile``, by coordinates of vertices or
      of the corners of faces;
    - of binary STL the colours of facets, see `read_stl`.

    Images lie in the folder of the file, or below. If a name leads elsewhere, its last part is looked for.

    *Lights and camera* of a glTF file are read: KHR_lights_punctual, see `placed_lights`, and the first
    camera.

    *Looks.* If only some vertices of a mesh have colours, the others are white. Colours over 1 count as 1,
    and are listed in ``ignored``. Corners of equal normal are welded only if their colours and texture
    coordinates are equal, too. A part without texture coordinates is drawn without its texture. So is a part
    whose image is not there.

    Contents that belong to the picture and are not read are in ``ignored``: other textures, alpha, ``illum``,
    smoothing groups, animations. Each reader has a list of the statements, keywords, properties, keys and
    extensions that it knows. Other names are in ``ignored``.

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
    lights : int
        Largest number of lights to read from a file. Of more lights the brightest are taken.
    local : bool
        Whether to read lights with a position.
    camera : bool
        Whether to read the camera of a file.

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
        - its numbers are not written as the format demands;
        - it holds no triangle, or more than 20 million triangles;
        - a vertex is not finite, or an index is out of range;
        - its nodes do not form trees;
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
            scene, found, views = _load_scene(path, data, materials, lights > 0, camera)
        # The results are checked for overflow and NaN.
        with np.errstate(over="ignore", invalid="ignore"):
            loaded = assembled(scene, found, path, data, crease_angle, materials)
            places = loaded.mesh.vertices
            return replace(
                loaded,
                lights=placed_lights(views.lights, places, lights, local, found),
                camera=placed_camera(views.cameras, places, found),
                ignored=found.ignored,
            )
    except Refused as refusal:
        raise InputError(source, refusal.reason, refusal.remedy) from None
    except OutputIsInput:
        raise
    except RecursionError as error:
        raise InputError(source, "is nested too deeply", REEXPORT) from error
    # A damaged file may make a loader raise any exception.
    except Exception as error:
        raise InputError(source, _fault(error), REEXPORT) from error


def given_mesh(source: object, crease_angle: float = DEFAULT_CREASE) -> LoadedMesh:
    """A mesh from trimesh or from arrays. Its flaws are mended as for a file.

    Parameters
    ----------
    source : trimesh.Trimesh or trimesh.Scene or sequence of arrays
        Arrays are vertices, shape (V, 3), faces, shape (F, 3), and, if known, a normal for each vertex, shape
        (V, 3). Faces count vertices from 0, anticlockwise seen from outside. Stored normals of trimesh's
        objects are kept. All faces have the same material.
    crease_angle : float
        As for `load_mesh`, for a mesh without normals.

    Raises
    ------
    InputError
        In one of these cases:

        - the source is no mesh;
        - it has no faces, or too many faces;
        - an index is out of range, or a vertex is not finite.
    """
    if any(base.__module__.partition(".")[0] == "trimesh" for base in type(source).__mro__):
        import trimesh

        name = f"trimesh.{type(source).__name__}"
        scene = trimesh.Scene(source) if isinstance(source, trimesh.Trimesh) else source
        if isinstance(scene, trimesh.Scene):
            found = Found()
            if any(_is_painted(geometry) for geometry in scene.geometry.values()):
                found.tell("materials and colours of trimesh")
            return _given(name, lambda: assembled(scene, found, Path("trimesh"), b"", crease_angle))
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
    check_corners(faces, len(vertices))
    normals = arrays.get("normals", np.full(vertices.shape, np.nan))
    if normals.shape != vertices.shape:
        raise Refused(f"there are {len(normals)} normals for {len(vertices)} vertices", GIVE_ARRAYS)
    flags = np.full(len(vertices), "normals" in arrays)
    material = np.zeros(len(faces), dtype=np.int64)
    none = np.zeros((0, 4)), np.zeros((0, 2))
    return finished(vertices, faces, material, normals, flags, *none, "arrays", 0, crease_angle)


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
    """Keep trimesh's log off the terminal, and make NumPy's warning of half-read numbers an error."""
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


def _load_scene(
    path: Path, data: bytes, materials: bool, lights: bool, camera: bool
) -> "tuple[trimesh.Scene, Found, GltfViews]":
    """A scene of trimesh. Only glTF is read by trimesh's loader. No file is opened that was not checked."""
    none = GltfViews([], [])
    suffix, found = path.suffix.lower(), Found()
    if suffix == ".obj":
        data, libraries = split_obj(data, found, materials)
        for name in libraries:
            refers(path.parent, name, *name.split())
        images = {}
        if materials and len(found.names) > 1:
            images = find_obj_materials(libraries, path.parent, found)
        return scene_of(read_obj(data, found, images, materials)), found, none
    if suffix == ".ply":
        parts, names = read_ply(data, found, materials)
        refers(path.parent, *names)
        if materials:
            find_ply_images(names, path.parent, found)
        return scene_of(parts), found, none
    if suffix == ".stl":
        return scene_of([read_stl(data, found, materials)]), found, none
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
    views = gltf_views(document, lights, camera, found)
    arrays, looks = plain_arrays(document, buffers, texts, found)
    data = plain_gltf(document)
    # The import takes longer than drawing a small picture, and only a file needs it.
    import trimesh

    scene = trimesh.load_scene(io.BytesIO(data), file_type="gltf", resolver={"0": arrays}, process=False)
    for geometry in scene.geometry.values():
        geometry.metadata.update(looks[int(geometry.visual.material.name)])
    return scene, found, views
