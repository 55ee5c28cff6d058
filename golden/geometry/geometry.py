"""Geometry ([T] figure 4.10): triangles to spans."""

from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.attribute_serialiser import AttributeSerialiser
from blysk.golden.geometry.edge_normals import EdgeNormals, TrueSpans
from blysk.golden.geometry.edge_setup import EdgeSetup
from blysk.golden.geometry.edge_walk import EdgeWalk
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.plane_assembler import PlaneAssembler, Planes
from blysk.golden.geometry.plane_setup import PlaneSetup
from blysk.golden.geometry.span_adapter import LineAdapter, LineSpans
from blysk.golden.geometry.span_attributes import Pieces, SpanAttributes, WholeSpans
from blysk.golden.geometry.span_clip import ClippedRows, SpanClip
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.triangles import ATTRIBUTE, GRID, FrameSettings, Grid, Triangles
from blysk.golden.geometry.vector_adapter import VectorAdapter, VectorSpans
from blysk.golden.geometry.vertex_sort import TESTED, SortedTriangles, VertexSort
from blysk.golden.number.fixed import Fixed

__all__ = ["COUNTERS", "Geometry"]

COUNTERS = ("empty", "zero_area", "culled", "sliver", "cut", "repaired")
"""Counters of triangles (no pixel, no area, culled, slivers), of cut spans and of repaired normals."""


@dataclass(frozen=True)
class Geometry:
    """Bit-accurate model of geometry.

    It is a chain of models, from `VertexSort` to `EdgeNormals`, `LineAdapter` or `VectorAdapter`.

    Parameters
    ----------
    grid : Grid
        Fraction bits of the coordinates.
    lines : bool
        Whether spans have their true line, N/W at both ends, in place of unit normals. Then no span is cut
        into pieces, and no normal is normalised.
    vectors : bool
        Whether spans have N/W at the first pixel and its step in place of unit normals. `SpanHalver` then
        cuts spans, and no normal is normalised. Not with ``lines``.
    rotates : bool
        Whether vectors will be turned into the frames of further lights, see `VectorAdapter`. Only with
        ``vectors``.
    surface : AttributeSpans or None
        Vertex colours and texture coordinates that triangles bring, with 1/W. Only with ``vectors``.
    tested : int
        As in `VertexSort`. It changes no span, but triangles that the test drops are not counted as slivers.

    Raises
    ------
    ValueError
        If both ``lines`` and ``vectors`` are given, ``rotates`` or ``surface`` without ``vectors``, or a
        ``surface`` has no 1/W.

    Source: docs/theory/geometry.md#composition; [T] figure 4.10.
    """

    grid: Grid = GRID
    lines: bool = False
    vectors: bool = False
    rotates: bool = False
    surface: AttributeSpans | None = None
    tested: int = TESTED

    def __post_init__(self) -> None:
        if self.lines and self.vectors:
            raise ValueError("spans have true lines or vectors, not both")
        if self.rotates and not self.vectors:
            raise ValueError("only vectors are turned into the frames of lights")
        if self.surface is not None and not (self.vectors and self.surface.perspective):
            raise ValueError("vertex colours and textures of triangles need vectors and 1/W")

    @property
    def gives(self) -> str:
        """Kind of spans: unit normals, true lines, vectors, or vectors for several lights."""
        vectors = "vectors for several lights" if self.rotates else "vectors"
        return "true lines" if self.lines else vectors if self.vectors else "unit normals"

    def rows(
        self, triangles: Triangles, frame: FrameSettings
    ) -> tuple[SortedTriangles, ClippedRows, np.ndarray, dict[str, int]]:
        """Sorted triangles, clipped scanlines with the index of their triangle, and the counts so far."""
        drawn, counts = VertexSort(self.grid, self.tested).compute(triangles, frame)
        edges = EdgeSetup(self.grid).compute(drawn)
        rows = EdgeWalk().compute(edges, drawn, frame)
        clipped = SpanClip().compute(rows, frame)
        return drawn, clipped, rows.triangle, counts

    def planes(self, drawn: SortedTriangles, frame: FrameSettings) -> tuple[Planes, int]:
        """Planes of sorted triangles, and the number of slivers among them."""
        scales = PlaneSetup(self.grid).compute(drawn, EdgeSetup(self.grid).compute(drawn))
        first, middle, last = (Fixed(ATTRIBUTE, drawn.triangles.attributes[:, k]) for k in range(3))
        gradients = GradientSetup().compute(first, middle, last, scales)
        planes = PlaneAssembler(not (self.lines or self.vectors)).compute(
            gradients, AttributeSerialiser().least(drawn.triangles), frame
        )
        return planes, int(scales.sliver.sum())

    def pieces(
        self, triangles: Triangles, frame: FrameSettings
    ) -> tuple[SortedTriangles, Pieces, dict[str, int]]:
        """Sorted triangles, the pieces of their spans with N/W at both ends, and the counts so far."""
        drawn, rows, _, counts = self.rows(triangles, frame)
        planes, sliver = self.planes(drawn, frame)
        spans, more = SpanAttributes(self.vectors).compute(rows, planes)
        if isinstance(spans, WholeSpans):
            pieces, more["cut"] = SpanHalver(self.rotates).compute(spans)
        else:
            pieces = spans
        counts = {
            **counts,
            "empty": counts["empty"] + more["empty"],
            "sliver": sliver,
            "cut": more["cut"],
        }
        return drawn, pieces, counts

    def compute(
        self, triangles: Triangles, frame: FrameSettings
    ) -> tuple[TrueSpans | LineSpans | VectorSpans, dict[str, int]]:
        """Bit-accurate spans, and the counters.

        Parameters
        ----------
        triangles : Triangles
            In the order of drawing.
        frame : FrameSettings
            The picture, the treatment of back faces, and the largest chord of a span.

        Returns
        -------
        spans : TrueSpans, or with ``lines`` LineSpans, with ``vectors`` VectorSpans
            They are in the order of the triangles. Within a triangle they go from top to bottom, within a
            scanline from the long edge on. Their ``triangle`` is the index in ``triangles``.
        counts : dict of str to int
            `COUNTERS`.

        Raises
        ------
        ValueError
            If a coordinate is out of the grid's range, or triangles have other attributes than the geometry.
        """
        self._check(triangles)
        drawn, pieces, counts = self.pieces(triangles, frame)
        spans, repaired = self._shaded(pieces)
        counts = {**counts, "repaired": repaired}
        spans = replace(spans, triangle=drawn.source[spans.triangle])
        if isinstance(spans, VectorSpans) and spans.attributes is not None and triangles.base is not None:
            places = {name: getattr(triangles, name)[spans.triangle] for name in ("base", "range", "level")}
            spans = replace(spans, attributes=spans.attributes._replace(**places))
        return spans, counts

    def _check(self, triangles: Triangles) -> None:
        own = self.surface
        given = 0 if triangles.surface is None else triangles.surface.shape[2]
        if given != (0 if own is None else own.attributes + 1):
            raise ValueError("the triangles have other attributes than the geometry")
        if (own is not None and own.coordinates) != (triangles.base is not None):
            raise ValueError("texture coordinates need a base, a range and a level of each triangle")

    def _shaded(self, pieces: Pieces) -> tuple[TrueSpans | LineSpans | VectorSpans, int]:
        """Spans of the pieces, with the words that the pipeline reads, and the number of repaired normals."""
        if self.lines or self.vectors:
            return (LineAdapter() if self.lines else VectorAdapter(self.rotates)).compute(pieces), 0
        return EdgeNormals().compute(pieces)
