"""Triangle assembly: triangles of a range of the mesh memory that lie in a band, from screen vertices."""

from dataclasses import dataclass, field

import numpy as np

from blysk.golden.geometry.triangles import ATTRIBUTE, DEPTH, GRID, Grid, Triangles
from blysk.golden.video.mesh_memory import MeshMemory
from blysk.golden.video.vertex_unit import ScreenVertices

__all__ = ["COUNTERS", "TriangleAssembly"]

COUNTERS = ("sent", "rejected", "outside")
"""What is counted: triangles sent, rejected by y, and dropped for a corner outside."""


@dataclass(frozen=True)
class TriangleAssembly:
    """Triangles of which no corner is outside and of which a scanline's centre may be in the band.

    A triangle is *rejected* where no scanline from ``top`` to ``bottom - 1`` has its centre from the highest
    corner on and above the lowest: exactly those that `VertexSort` would find empty by y.

    Parameters
    ----------
    mesh : MeshMemory
        The triangles.
    grid : Grid
        Fraction bits of the coordinates.

    Source: docs/theory/video.md#vertices; [T] figure 4.10.
    """

    mesh: MeshMemory
    grid: Grid = field(default_factory=lambda: GRID)

    @property
    def screen_bits(self) -> int:
        """Bits of a screen vertex."""
        return 2 * self.grid.bits + DEPTH.width + 3 * ATTRIBUTE.width + 1

    def compute(
        self,
        vertices: ScreenVertices,
        first: np.ndarray,
        count: np.ndarray,
        material: np.ndarray,
        top: int,
        bottom: int,
    ) -> tuple[Triangles, dict[str, int]]:
        """Bit-accurate triangles, and the counts of the others.

        Parameters
        ----------
        vertices : ScreenVertices
            All of the memory.
        first, count, material : int64 arrays, shape (R,)
            Ranges of triangles, 1 or more each, and the material of each.
        top, bottom : int
            Scanlines of the band.
        """
        first, count, material = (np.atleast_1d(value) for value in (first, count, material))
        source = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())
        corners = self.mesh.faces[source]
        y = vertices.y[corners]
        low, high = (self.grid.first_centre(f(y, axis=1)) for f in (np.min, np.max))
        outside = vertices.outside[corners].any(axis=1)
        covered = np.maximum(low, top) < np.minimum(high, bottom)
        kept = corners[covered & ~outside]
        triangles = Triangles(
            x=vertices.x[kept],
            y=vertices.y[kept],
            depth=vertices.depth[kept],
            normal=vertices.normal[kept],
            material=np.repeat(material, count)[covered & ~outside],
            two_sided=np.zeros(len(kept), dtype=bool),
        )
        counts = {
            "sent": len(kept),
            "rejected": int((~covered & ~outside).sum()),
            "outside": int(outside.sum()),
        }
        return triangles, counts
