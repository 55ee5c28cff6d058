"""Record of the vertex sort of the compact style."""

from dataclasses import replace

from blysk.bench.units.geometry.vertex_sort import RECORD as SORT
from blysk.bench.units.record import Variant
from blysk.hdl.geometry.serial_vertex_sort import SerialVertexSortUnit

__all__ = ["RECORD"]

RECORD = replace(
    SORT,
    name="serial_vertex_sort",
    title="Corners from top to bottom, orientation, and dropped triangles, one triangle at a time",
    variants={"": Variant(SerialVertexSortUnit, note="exact")},
    still={
        "a constant 0 stands below the first Booth digit": "rest_{0,1}[0]",
        "a counter has room for more events than a run has": "count_empty[8-31] "
        "count_culled[7-31] count_zero_area[6-31]",
    },
)
