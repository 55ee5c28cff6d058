"""Mesh memory: vertices and triangles of meshes as words of block RAM."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans, whole_texels
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.texture import Texture

__all__ = ["BLOCK_BITS", "BLOCK_WORDS", "MeshMemory", "Part", "block_rams"]

BLOCK_BITS = 36
"""Width in bits of an ECP5's block RAM with 512 words."""

BLOCK_WORDS = 512
"""Words of this block RAM."""


def block_rams(words: int, width: int) -> int:
    """Least number of block RAMs of an ECP5 (18 kbit, at most 36 bits wide) for a memory.

    Blocks have 512 words of 36 bits, 1024 of 18, 2048 of 9, 4096 of 4, 8192 of 2 or 16384 of 1. The shape
    that needs the fewest blocks is taken.
    """
    shapes = ((512, 36), (1024, 18), (2048, 9), (4096, 4), (8192, 2), (16384, 1))
    return min(-(-words // depth) * -(-width // bits) for depth, bits in shapes)


@dataclass(frozen=True)
class Part:
    """A mesh in the memory.

    Parameters
    ----------
    first, count : int
        First vertex and number of vertices.
    draws : tuple of (int, int, int)
        Material, first triangle and number of triangles of each range.
    centre : float64 array, shape (3,)
        Middle of the mesh's box, in world units.
    scale : float
        Length in world units that 1 in the memory stands for.
    """

    first: int
    count: int
    draws: tuple[tuple[int, int, int], ...]
    centre: np.ndarray
    scale: float


@dataclass(frozen=True)
class MeshMemory:
    """Contents of the vertex memory and the triangle memory.

    Positions count from the middle of their mesh's box, in units in which the largest component is ONE.
    Positions and normals are rounded to ``SQ(1, 17)``. So the error of a position is at most 2^-18 of half
    the box's longest side.

    A vertex may bring attributes of the surface: its colour, and texture coordinates from -1 to 1. They stand
    for texels of level 0: ``base + A 2^range``, with a base and a range for each material. So each vertex
    belongs to a single material. Attributes are multiplied by `SurfaceWords.LARGEST`, and rounded to
    ``SQ(1, 17)``.

    Parameters
    ----------
    position, normal : int64 arrays, shape (V, 3)
        Positions and unit normals, ``SQ(1, 17)``.
    faces : int64 array, shape (T, 3)
        Indices of the corners.
    parts : tuple of Part
        The meshes.
    surface : AttributeSpans, optional
        The attributes that vertices bring.
    attributes : int64 array, shape (V, A), optional
        These attributes, first colours, then texture coordinates.
    placement : int64 array, shape (M, 3), optional
        Base of u, base of v and range of the texture coordinates of each material.
    room : (int, int), optional
        Vertices and triangles that the memories can hold. By default as many as there are.

    Raises
    ------
    ValueError
        If there are too few or too many vertices or triangles, or a corner is no vertex. If the memories are
        too small or too large.

    Source: docs/theory/video.md#vertices; not in the documents.
    """

    position: np.ndarray
    normal: np.ndarray
    faces: np.ndarray
    parts: tuple[Part, ...]
    surface: AttributeSpans | None = None
    attributes: np.ndarray | None = None
    placement: np.ndarray | None = None
    room: tuple[int, int] | None = None

    VERTEX_BITS = 6 * COMPONENT.width
    LARGEST = 4096

    def __post_init__(self) -> None:
        for name, count in (("vertices", len(self.position)), ("triangles", len(self.faces))):
            if not 1 <= count < self.LARGEST:
                raise ValueError(f"a mesh memory holds 1 to {self.LARGEST - 1} {name}, not {count}")
        for name, count, size in (
            ("vertices", self.vertices, self.vertex_room),
            ("triangles", self.triangles, self.triangle_room),
        ):
            if not count <= size < self.LARGEST:
                raise ValueError(f"a memory for {count} to {self.LARGEST - 1} {name}, not {size}")
        for wrong in self.faces[(self.faces < 0) | (self.faces >= self.vertices)][:1]:
            raise ValueError(f"a corner must be a vertex, 0 to {self.vertices - 1}, not {wrong}")

    @classmethod
    def of(
        cls,
        meshes: Sequence[Mesh],
        surface: AttributeSpans | None = None,
        textures: Mapping[int, Texture] | None = None,
    ) -> "MeshMemory":
        """The memory of meshes, with the triangles of a mesh sorted by material.

        Parameters
        ----------
        meshes : sequence of Mesh
            The meshes. A mesh without vertex colours is white.
        surface : AttributeSpans, optional
            The attributes that vertices bring. With texture coordinates a vertex of several materials is
            stored once for each material.
        textures : mapping of int to Texture, optional
            Texture of each material that has a texture.

        Raises
        ------
        ValueError
            If there are no vertices or triangles, or more than `LARGEST` - 1. If texture coordinates cross
            too many texels.
        """
        found: list[np.ndarray] = []
        placement: np.ndarray | None = None
        if surface is not None:
            meshes = [_of_one_material(mesh) if surface.coordinates else mesh for mesh in meshes]
            if surface.coordinates:
                placement = _placement(meshes, textures or {})
            found = [_attributes(mesh, surface, placement, textures or {}) for mesh in meshes]
        if placement is not None:
            placement = _in_range(placement, textures or {})
        positions, normals, faces, parts = [], [], [], []
        vertices = triangles = 0
        for mesh in meshes:
            low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
            centre = (low + high) / 2
            half = float(np.abs(mesh.vertices - centre).max()) or 1.0
            codes = np.rint((mesh.vertices - centre) / half * ONE).astype(np.int64)
            order = np.argsort(mesh.material, kind="stable")
            counts = np.bincount(mesh.material)
            starts = triangles + np.cumsum(counts) - counts
            draws = tuple(
                (material, int(start), int(count))
                for material, (start, count) in enumerate(zip(starts, counts, strict=True))
                if count
            )
            scale = half * 2.0**COMPONENT.fraction_bits / ONE
            parts.append(Part(vertices, len(codes), draws, centre, scale))
            positions.append(codes)
            normals.append(quantise(mesh.normals))
            faces.append(mesh.faces[order] + vertices)
            vertices, triangles = vertices + len(codes), triangles + len(order)
        return cls(
            np.concatenate(positions),
            np.concatenate(normals),
            np.concatenate(faces),
            tuple(parts),
            surface,
            np.concatenate(found) if found else None,
            placement,
        )

    @property
    def vertices(self) -> int:
        """Number of vertices."""
        return len(self.position)

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self.faces)

    @property
    def vertex_room(self) -> int:
        """Number of vertices that the memory can hold."""
        return self.vertices if self.room is None else self.room[0]

    @property
    def triangle_room(self) -> int:
        """Number of triangles that the memory can hold."""
        return self.triangles if self.room is None else self.room[1]

    @property
    def index_bits(self) -> int:
        """Bits of the index of a vertex."""
        return max((self.vertex_room - 1).bit_length(), 1)

    @property
    def vertex_bits(self) -> int:
        """Bits of a vertex."""
        return self.bits_of(self.surface)

    @classmethod
    def bits_of(cls, surface: AttributeSpans | None) -> int:
        """Bits of a vertex with the attributes of a surface."""
        return cls.VERTEX_BITS + (0 if surface is None else surface.attributes * COMPONENT.width)

    @property
    def vertex_words(self) -> list[int]:
        """Words of the vertices. From the lowest bit up: position x, y, z, normal x, y, z, attributes."""
        given = self.position, self.normal, *([] if self.attributes is None else [self.attributes])
        return _words(np.concatenate(given, axis=1), COMPONENT.width)

    @property
    def triangle_words(self) -> list[int]:
        """Words of the triangles: three indices from the lowest bit up."""
        return _words(self.faces, self.index_bits)

    def world(self, part: Part) -> Mesh:
        """The mesh of a part in world units, as the memory holds it."""
        chosen = slice(part.first, part.first + part.count)
        position = Fixed(COMPONENT, self.position[chosen]).values * part.scale + part.centre
        normal = self.normal[chosen] / np.linalg.norm(self.normal[chosen], axis=1, keepdims=True)
        ranges = [np.arange(start, start + count) for _, start, count in part.draws]
        material = np.repeat([m for m, _, _ in part.draws], [count for _, _, count in part.draws])
        return Mesh(position, self.faces[np.concatenate(ranges)] - part.first, normal, material)

    def blocks(self, screen_bits: int) -> int:
        """Number of block RAMs for vertices, triangles, and screen vertices of ``screen_bits`` bits."""
        return (
            block_rams(self.vertex_room, self.vertex_bits)
            + block_rams(self.triangle_room, 3 * self.index_bits)
            + block_rams(self.vertex_room, screen_bits)
        )

    def largest_room(self, screen_bits: int) -> tuple[int, int]:
        """Most vertices and triangles in as many block RAMs as the memories take.

        Parameters
        ----------
        screen_bits : int
            As for `blocks`.
        """
        whole = range(BLOCK_WORDS, self.LARGEST + 1, BLOCK_WORDS)
        limits = [min(words, self.LARGEST - 1) for words in whole]

        def taken(vertices: int, triangles: int) -> list[int]:
            index_bits = max((vertices - 1).bit_length(), 1)
            words = (vertices, self.vertex_bits), (triangles, 3 * index_bits), (vertices, screen_bits)
            return [block_rams(*memory) for memory in words]

        def fits(vertices: int, triangles: int) -> bool:
            own = taken(self.vertex_room, self.triangle_room)
            return all(new <= old for new, old in zip(taken(vertices, triangles), own, strict=True))

        vertices = max(self.vertex_room, *(words for words in limits if fits(words, self.triangle_room)))
        triangles = max(self.triangle_room, *(words for words in limits if fits(vertices, words)))
        return vertices, triangles

    @classmethod
    def triangles_that_fit(
        cls,
        blocks: int,
        screen_bits: int,
        vertices_per_triangle: float = 0.6,
        surface: AttributeSpans | None = None,
    ) -> int:
        """Largest number of triangles of a mesh that fits a number of block RAMs.

        Parameters
        ----------
        blocks : int
            Block RAMs for the mesh.
        screen_bits : int
            Bits of a screen vertex.
        vertices_per_triangle : float
            Ratio of vertices to triangles: 0.5 for a closed mesh, and more for its seams.
        surface : AttributeSpans, optional
            The attributes that vertices bring.
        """
        best = 0
        for triangles in range(1, cls.LARGEST):
            vertices = max(int(np.ceil(triangles * vertices_per_triangle)), 3)
            index_bits = (vertices - 1).bit_length()
            taken = block_rams(triangles, 3 * index_bits)
            taken += block_rams(vertices, cls.bits_of(surface)) + block_rams(vertices, screen_bits)
            if vertices < cls.LARGEST and taken <= blocks:
                best = triangles
        return best


def _of_one_material(mesh: Mesh) -> Mesh:
    """The mesh with a copy of a vertex for each material of its faces, without vertices that no face has."""
    kinds = int(mesh.material.max(initial=0)) + 1
    pairs = mesh.faces * kinds + mesh.material[:, np.newaxis]
    used, faces = np.unique(pairs, return_inverse=True)
    of = used // kinds
    looks = {name: getattr(mesh, name) for name in ("colors", "coordinates", "alpha")}
    moved = {name: values[of] if values.size else values for name, values in looks.items()}
    vertices, normals = mesh.vertices[of], mesh.normals[of]
    return replace(mesh, vertices=vertices, normals=normals, faces=faces.reshape(-1, 3), **moved)


def _texels(mesh: Mesh, material: int, texture: Texture) -> tuple[np.ndarray, np.ndarray]:
    """Vertices of a material, and their texture coordinates in texels of level 0."""
    chosen = np.unique(mesh.faces[mesh.material == material])
    given = mesh.coordinates if mesh.coordinates.size else np.zeros((len(mesh.vertices), 2))
    return chosen, given[chosen] * texture.size


def _placement(meshes: Sequence[Mesh], textures: Mapping[int, Texture]) -> np.ndarray:
    """Base of u, base of v and range of each material. They are 0 for a material without a texture."""
    kinds = 1 + max(int(mesh.material.max(initial=0)) for mesh in meshes)
    placement = np.zeros((kinds, 3), dtype=np.int64)
    for material, texture in textures.items():
        texels = np.concatenate([_texels(mesh, material, texture)[1] for mesh in meshes])
        if not len(texels):
            continue
        base, reach = whole_texels(texels.min(axis=0, keepdims=True), texels.max(axis=0, keepdims=True))
        if reach[0] > AttributeSpans.LARGEST_RANGE:
            most = 2 << AttributeSpans.LARGEST_RANGE
            raise ValueError(f"material {material} crosses over {most} texels; use a smaller image")
        placement[material] = *base[0], reach[0]
    return placement


def _attributes(
    mesh: Mesh, surface: AttributeSpans, placement: np.ndarray | None, textures: Mapping[int, Texture]
) -> np.ndarray:
    """Codes of the attributes of vertices."""
    found = []
    if surface.colors:
        found.append(np.clip(mesh.colors, 0, 1) if mesh.colors.size else np.ones((len(mesh.vertices), 3)))
    if placement is not None:
        places = np.zeros((len(mesh.vertices), 2))
        for material, texture in textures.items():
            chosen, texels = _texels(mesh, material, texture)
            *base, reach = placement[material]
            places[chosen] = (texels - base) * 0.5**reach
        found.append(places)
    words = np.concatenate(found, axis=1) * SurfaceWords.LARGEST
    return Fixed.round(COMPONENT, words).codes


def _in_range(placement: np.ndarray, textures: Mapping[int, Texture]) -> np.ndarray:
    """The placement with bases of images that repeat brought into the range of a base."""
    period, most = AttributeSpans.PERIOD, AttributeSpans.LARGEST_BASE
    found = placement.copy()
    for material, texture in textures.items():
        for axis, wrap in enumerate(texture.wrap):
            base = int(found[material, axis])
            if wrap != "clamp":
                found[material, axis] = (base + period // 2) % period - period // 2
            elif abs(base) > most:
                raise ValueError(f"material {material} is over {most} texels from the border of its image")
    return found


def _words(codes: np.ndarray, width: int) -> list[int]:
    """Rows of codes as words, the first from the lowest bit up."""
    mask = (1 << width) - 1
    return [sum((code & mask) << (width * k) for k, code in enumerate(row)) for row in codes.tolist()]
