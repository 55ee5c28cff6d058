"""Meshes for records: triangles of any vertices."""

import numpy as np

from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.video.mesh_memory import MeshMemory

__all__ = ["any_memory"]


def any_memory(vertices: int = 40, triangles: int = 77, seed: int = 2026) -> MeshMemory:
    """A memory of random vertices and triangles. By default neither number is a power of two."""
    rng = np.random.default_rng(seed)
    faces = rng.integers(0, vertices, (triangles, 3))
    normals = normalise(rng.normal(size=(vertices, 3)))
    return MeshMemory.of([Mesh(rng.normal(size=(vertices, 3)), faces, normals)])
