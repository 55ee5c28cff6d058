"""Shapes of triangles, of the settings of a frame, and of counters."""

from collections.abc import Sequence

from amaranth.hdl import Module, Mux, Signal, Value, ValueLike, signed, unsigned
from amaranth.lib import data

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.edge_setup import X_BITS
from blysk.golden.geometry.triangles import (
    ATTRIBUTE,
    DEPTH,
    GRID,
    LIMIT_BITS,
    MATERIAL_BITS,
    Grid,
)
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.geometry.surface_words import corner_surface_shape, placement_of

__all__ = [
    "COUNTER_BITS",
    "corners_shape",
    "count_events",
    "counters_shape",
    "first_centre",
    "frame_shape",
    "in_order",
    "order_shape",
    "tag_shape",
    "triangle_shape",
]

COUNTER_BITS = 32
"""Bits of a counter, which counts modulo 2^32."""


def corners_shape(grid: Grid = GRID, surface: AttributeSpans | None = None) -> dict:
    """Members of three corners: coordinates, depth, and N/W over the largest 1/W of the triangle.

    With ``surface`` there are also its attributes, see `SurfaceWords`.
    """
    coordinate, component = FixedShape(grid.coordinate), FixedShape(ATTRIBUTE)
    return {
        "x": data.ArrayLayout(coordinate, 3),
        "y": data.ArrayLayout(coordinate, 3),
        "depth": data.ArrayLayout(FixedShape(DEPTH), 3),
        "normal": data.ArrayLayout(data.ArrayLayout(component, 3), 3),
        **corner_surface_shape(surface),
    }


def triangle_shape(grid: Grid = GRID, surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of a triangle: corners in any order, index of its material, whether the material is two-sided.

    With texture coordinates there are also their base, range and level.
    """
    flags = {"material": unsigned(MATERIAL_BITS), "two_sided": unsigned(1)}
    return data.StructLayout(corners_shape(grid, surface) | flags | placement_of(surface))


def tag_shape() -> dict:
    """Members that go with a triangle to its scanlines: long edge on the right, normals negated, material."""
    return {"right": unsigned(1), "flip": unsigned(1), "material": unsigned(MATERIAL_BITS)}


def order_shape() -> dict:
    """Members of an order of three corners: indices of the first and of the last corner."""
    return {"top": unsigned(2), "bottom": unsigned(2)}


def in_order(top: Value, bottom: Value, corners: Sequence[ValueLike]) -> list[Value]:
    """Words of three corners in the order that `order_shape` describes."""
    words = [Value.cast(word) for word in corners]
    # The exclusive or of the three indices is 3.
    return [
        Mux(index[1], words[2], Mux(index[0], words[1], words[0])) for index in (top, ~(top ^ bottom), bottom)
    ]


def frame_shape() -> data.StructLayout:
    """Shape of `FrameSettings.codes`: borders of the picture, index in `BACK_FACES`, limit of a span."""
    borders = {name: signed(X_BITS) for name in ("left", "top", "right", "bottom")}
    return data.StructLayout(borders | {"back_faces": unsigned(2), "limit": unsigned(LIMIT_BITS)})


def counters_shape(*names: str) -> data.StructLayout:
    """Shape of counters by name."""
    return data.StructLayout({name: unsigned(COUNTER_BITS) for name in names})


def count_events(m: Module, counters: data.View, **events: ValueLike) -> None:
    """Count the cycles on which each event is 1, in registers that drive the fields of ``counters``."""
    for name, event in events.items():
        count = Signal(COUNTER_BITS, name=f"count_{name}")
        with m.If(event):
            m.d.sync += count.eq(count + 1)
        m.d.comb += counters[name].eq(count)


def first_centre(code: Value, grid: Grid) -> Value:
    """First column or scanline whose centre is not before a coordinate, signed, as `Grid.first_centre`."""
    code = Value.cast(code)
    return (code + (grid.half - 1))[grid.subpixel_bits :].as_signed()
