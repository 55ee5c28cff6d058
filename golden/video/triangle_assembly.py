"""Triangle assembly: from screen vertices and ranges of the mesh memory to the triangles in a band."""

from dataclasses import dataclass, field

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.triangles import ATTRIBUTE, DEPTH, GRID, Grid, Triangles
from blysk.golden.video.mesh_memory import MeshMemory
from blysk.golden.video.vertex_unit import ScreenVertices

__all__ = ["COUNTERS", "TriangleAssembly", "screen_bits"]

COUNTERS = ("sent", "rejected", "outside")
"""Counters: triangles sent, rejected by y, and dropped because a corner is outside."""


def screen_bits(grid: Grid = GRID, surface: AttributeSpans | None = None) -> int:
    """Bits of a screen vertex, with the attributes of a surface and their 1/W."""
    words = 3 + (0 if surface is None else surface.attributes + 1)
    return 2 * grid.bits + DEPTH.width + words * ATTRIBUTE.width + 1


@dataclass(frozen=True)
class TriangleAssembly:
    """Chooses triangles that have no corner outside, and may cover the centre of a scanline of the band.

    A triangle is *rejected* if no scanline from ``top`` to ``bottom - 1`` has its centre between the highest
    corner (included) and the lowest corner (excluded). These are exactly the triangles that `VertexSort`
    would find empty by y.

    A triangle with texture coordinates has the base and the range of its material, and level 0.

    Parameters
    ----------
    mesh : MeshMemory
        Memory with the triangles.
    grid : Grid
        Fraction bits of the coordinates.

    Source: docs/theory/video.md#vertices; [T] figure 4.10.
    """

    mesh: MeshMemory
    grid: Grid = field(default_factory=lambda: GRID)

    @property
    def screen_bits(self) -> int:
        """Bits of a screen vertex."""
        return screen_bits(self.grid, self.mesh.surface)

    def compute(
        self,
        vertices: ScreenVertices,
        first: np.ndarray,
        count: np.ndarray,
        material: np.ndarray,
        top: int,
        bottom: int,
    ) -> tuple[Triangles, dict[str, int]]:
        """Bit-accurate triangles, and the counters.

        Parameters
        ----------
        vertices : ScreenVertices
            All vertices of the memory.
        first, count, material : int64 arrays, shape (R,)
            For each range the first triangle, the number of triangles (1 or more), and the material.
        top, bottom : int
            First scanline of the band, and first scanline after it.
        """
        first, count, material = (np.atleast_1d(value) for value in (first, count, material))
        source = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())
        corners = self.mesh.faces[source]
        y = vertices.y[corners]
        low, high = (self.grid.first_centre(f(y, axis=1)) for f in (np.min, np.max))
        outside = vertices.outside[corners].any(axis=1)
        covered = np.maximum(low, top) < np.minimum(high, bottom)
        kept = corners[covered & ~outside]
        kinds = np.repeat(material, count)[covered & ~outside]
        placed: dict[str, np.ndarray] = {}
        if (placement := self.mesh.placement) is not None:
            of_kind = placement[np.minimum(kinds, len(placement) - 1)]
            placed = {"base": of_kind[:, :2], "range": of_kind[:, 2], "level": np.zeros(len(kept), np.int64)}
        triangles = Triangles(
            x=vertices.x[kept],
            y=vertices.y[kept],
            depth=vertices.depth[kept],
            normal=vertices.normal[kept],
            material=kinds,
            two_sided=np.zeros(len(kept), dtype=bool),
            surface=None if vertices.surface is None else vertices.surface[kept],
            **placed,
        )
        counts = {
            "sent": len(kept),
            "rejected": int((~covered & ~outside).sum()),
            "outside": int(outside.sum()),
        }
        return triangles, counts
