"""Meshes for records: triangles of any vertices."""

from dataclasses import replace

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.texture import Texture
from blysk.golden.video.mesh_memory import MeshMemory

__all__ = ["any_memory"]


def any_memory(
    vertices: int = 40, triangles: int = 77, seed: int = 2026, surface: AttributeSpans | None = None
) -> MeshMemory:
    """A memory of random vertices and triangles. By default neither number is a power of two.

    With a surface there are three materials, and the first two have textures.
    """
    rng = np.random.default_rng(seed)
    faces = rng.integers(0, vertices, (triangles, 3))
    normals = normalise(rng.normal(size=(vertices, 3)))
    mesh = Mesh(rng.normal(size=(vertices, 3)), faces, normals)
    if surface is None:
        return MeshMemory.of([mesh])
    looks = {"colors": rng.random((vertices, 3)), "coordinates": rng.uniform(-3, 3, (vertices, 2))}
    mesh = replace(mesh, material=rng.integers(0, 3, triangles), **looks)
    textures = {0: Texture(np.ones((8, 2, 3))), 1: Texture(np.ones((1, 64, 3)), wrap=("clamp", "mirror"))}
    return MeshMemory.of([mesh], surface, textures)
