"""Triangles of the parts of a file as a mesh: placed, mended, with normals and merged materials."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from blysk.golden.frame_constants import MAX_MATERIALS
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import LARGEST_COORDINATE, Mesh
from blysk.golden.reference.light import Light
from blysk.sim.meshes.materials import FileMaterial, Found
from blysk.sim.meshes.normals import crease_normals, face_directions, repaired_normals, transformed
from blysk.sim.meshes.polygons import check_corners
from blysk.sim.meshes.refusal import MAX_FACES, ONE_MATERIAL, Refused

if TYPE_CHECKING:
    import trimesh

__all__ = ["LoadedMesh", "assembled", "finished", "merged"]

# Rounding may put a colour outside 0 to 1 by this much.
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
        Number of stored vertex normals that were repaired. A repaired normal was zero, was not finite, was
        more than 1/256 off unit length, or was missing although the file refers to it.
    dropped_faces : int
        Dropped triangles without area: two corners are at the same position, or no triangle shares a side.
        Other triangles without area stay, because they close the seam between a side and its parts.
    opposed_faces : int
        Triangles whose stored normals all point against their winding. Light falls on their other side.
    materials : tuple of FileMaterial
        Materials that the mesh's ``material`` refers to, at least one. Each is used by a face, and any two
        differ in more than the name.
    ignored : tuple of str
        Contents or references of the file that belong to the picture and are not read: alpha, textures other
        than the texture of the colour, a missing image or material file, and the names that a reader does not
        know.
    lights : tuple of Light
        Lights of a glTF file, in its unit of length; the brightest counts 1, see `placed_lights`.
    camera : Camera or None
        The first camera of a glTF file, in its unit of length.
    """

    mesh: Mesh
    name: str
    repaired_normals: int
    dropped_faces: int
    opposed_faces: int = 0
    materials: tuple[FileMaterial, ...] = (FileMaterial(),)
    ignored: tuple[str, ...] = ()
    lights: tuple[Light, ...] = ()
    camera: Camera | None = None


def assembled(
    scene: "trimesh.Scene",
    found: Found,
    path: Path,
    data: bytes,
    crease_angle: float,
    painted: bool = False,
) -> LoadedMesh:
    """All triangles of a scene in world coordinates, as one mesh.

    If the scene is ``painted``, a part's metadata have the number of its ``"material"``. They may have
    ``"colors"`` in linear light: a float64 array of shape (V, 3), or of shape (V, 4) with alpha. They may
    have ``"coordinates"``: a float64 array of shape (V, 2), with v from the top of the image.
    """
    import trimesh

    nodes = [(matrix, scene.geometry[name]) for matrix, name in _placed(scene)]
    nodes = [node for node in nodes if isinstance(node[1], trimesh.Trimesh) and len(node[1].faces)]
    if not nodes:
        ignored = f" (not read: {'; '.join(found.ignored)})" if found.ignored else ""
        raise Refused(f"it has no faces{ignored}", "use a mesh of triangles; points and lines are not shaded")
    if (total := sum(len(geometry.faces) for _, geometry in nodes)) > MAX_FACES:
        raise Refused(f"it has {total} triangles; the limit is {MAX_FACES}", "simplify it")

    # trimesh drops the normals of an OBJ file if one of their indices is missing or out of range.
    promised = path.suffix.lower() == ".obj" and re.search(rb"^f\b.*/-?\d*/-?\d", data, re.MULTILINE)
    vertices, normals, faces, material, lost = [], [], [], [], 0
    colors: list[np.ndarray | None] = []
    coordinates: list[np.ndarray | None] = []
    offset = 0
    for matrix, geometry in nodes:
        part, triangles = np.array(geometry.vertices), np.array(geometry.faces)
        check_corners(triangles, len(part))
        stored = np.full(part.shape, np.nan)
        # Only the cache shows whether normals were stored. Reading the property would compute them.
        has_normals = "vertex_normals" in geometry._cache
        if has_normals:
            stored = np.array(geometry.vertex_normals)
        elif promised:
            lost += len(np.unique(triangles))
        if not np.array_equal(matrix, np.eye(4)):
            rotation = np.array(matrix[:3, :3])
            # The cofactors are the inverse transpose times the determinant. They exist for determinant 0,
            # too.
            cofactors = np.cross(np.roll(rotation, -1, axis=0), np.roll(rotation, -2, axis=0))
            mirrored = np.linalg.det(rotation) < 0
            part = part @ rotation.T + matrix[:3, 3]
            stored = transformed(stored, -cofactors if mirrored else cofactors)
            triangles = triangles[:, ::-1] if mirrored else triangles
        metadata = geometry.metadata if painted else {}
        colors.append(_colors(metadata.get("colors"), triangles, found))
        coordinates.append(_coordinates(metadata.get("coordinates"), triangles))
        kind = 4 * metadata.get("material", 0) + 2 * (colors[-1] is not None) + (coordinates[-1] is not None)
        faces.append(triangles + offset)
        material.append(np.full(len(triangles), kind))
        vertices.append(part)
        normals.append((stored, np.full(len(part), has_normals)))
        offset += len(part)
    loaded = finished(
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(material),
        np.concatenate([stored for stored, _ in normals]),
        np.concatenate([flag for _, flag in normals]),
        _joined(colors, vertices, np.ones((1, 4))),
        _joined(coordinates, vertices, np.zeros((1, 2))),
        path.stem,
        lost,
        crease_angle,
    )
    return _with_materials(loaded, found)


def _colors(given: np.ndarray | None, faces: np.ndarray, found: Found) -> np.ndarray | None:
    """Colours and alpha of a part's vertices, 0 to 1, shape (V, 4).

    Values over 1 become 1, and are recorded in ``found``.
    """
    if given is None:
        return None
    used = np.unique(faces)
    seen = given[used]
    if wrong := np.flatnonzero(~(np.isfinite(seen) & (seen >= -_ROUNDED)).all(axis=1)).tolist():
        text = " ".join(f"{channel:g}" for channel in seen[wrong[0]].tolist())
        many = "three" if given.shape[1] == 3 else "four"
        raise Refused(f"a vertex has the colour {text!r}, not {many} numbers of at least 0", ONE_MATERIAL)
    over = int((seen > 1 + _ROUNDED).any(axis=1).sum())
    found.tell("vertex colour's part over 1", "vertex colours' parts over 1", over)
    result = np.ones((len(given), 4))
    result[used, : given.shape[1]] = np.clip(seen, 0, 1)
    return result


def _coordinates(given: np.ndarray | None, faces: np.ndarray) -> np.ndarray | None:
    """Texture coordinates of a part's vertices, finite."""
    if given is None:
        return None
    used = np.unique(faces)
    if wrong := np.flatnonzero(~(np.abs(given[used]) <= LARGEST_COORDINATE).all(axis=1)).tolist():
        text = " ".join(f"{number:g}" for number in given[used[wrong[0]]].tolist())
        raise Refused(
            f"a vertex has the texture coordinates {text!r}, not numbers to {LARGEST_COORDINATE:,.0f}",
            ONE_MATERIAL,
        )
    result = np.zeros(given.shape)
    result[used] = given[used]
    return result


def _joined(parts: list[np.ndarray | None], vertices: list[np.ndarray], other: np.ndarray) -> np.ndarray:
    """Values of all vertices. A part without values gets ``other``. No rows if no part has values."""
    if all(part is None for part in parts):
        return other[:0]
    return np.concatenate(
        [
            np.repeat(other, len(of), axis=0) if part is None else part
            for part, of in zip(parts, vertices, strict=True)
        ]
    )


def _placed(scene: "trimesh.Scene") -> list[tuple[np.ndarray, str]]:
    """Matrix into the world, and name, of the geometry of every node that has a geometry.

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
    """The mesh with the materials that its faces use, numbered from 0. Equal materials are merged.

    The material of a face of ``loaded`` is a number. It is four times the number of the material in the file,
    plus 2 if the vertices have colours, plus 1 if the vertices have texture coordinates.
    """
    used = np.unique(loaded.mesh.material).tolist()
    read = {number: found.read(number) for number in sorted({kind // 4 for kind in used})}
    materials = {}
    for kind in used:
        material = read[kind // 4]
        # White vertices stay white. They do not take the default's diffuse colour.
        colored = kind & 2 > 0 and (len(loaded.mesh.colors) > 0 or material.diffuse is None)
        material = replace(material, colored=colored)
        if material.texture is not None and not kind & 1:
            found.tell("texture of a part without coordinates", "textures of parts without coordinates")
            material = replace(material, texture=None)
        transparent = len(loaded.mesh.alpha) > 0 and kind & 2 > 0
        if material.texture is not None:
            transparent |= material.texture.alpha.size > 0
        if material.cutoff is not None and not transparent and material.alpha >= material.cutoff:
            material = replace(material, alpha=1.0, cutoff=None)
        if material.has_albedo and 0 < (material.metallic or 0.0) < 1:
            found.tell("the exact highlights of colours that are partly metallic")
        materials[kind] = material
    loaded = merged(loaded, materials)
    mesh = loaded.mesh
    if all(material.texture is None for material in loaded.materials):
        mesh = replace(mesh, coordinates=mesh.coordinates[:0])
    if all(material.cutoff is None for material in loaded.materials):
        mesh = replace(mesh, alpha=mesh.alpha[:0])
    return replace(loaded, mesh=mesh, ignored=found.ignored)


def merged(loaded: LoadedMesh, of: Mapping[int, FileMaterial]) -> LoadedMesh:
    """A mesh with materials numbered from 0. Equal materials are merged.

    The material of a face of ``loaded`` is a key of ``of``, which has the materials.

    Raises
    ------
    Refused
        If there are more than 1024 materials.
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


def finished(
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
    """Make a mesh: mend stored normals, compute missing normals. Materials keep the file's numbers.

    A face without area stays if its sides join other faces, else it is dropped.
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
        colors=colors[kept_vertices, :3] if (colors[:, :3] != 1).any() else colors[:0, :3],
        coordinates=coordinates[kept_vertices] if len(coordinates) else coordinates,
        alpha=colors[kept_vertices, 3] if (colors[:, 3] != 1).any() else colors[:0, 3],
    )
    opposed = (np.einsum("fki,fi->fk", own_normals[renumbered], directions[kept]) < 0).all(axis=1).sum()
    return LoadedMesh(mesh, name, repaired + lost, dropped, int(opposed))
