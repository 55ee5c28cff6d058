"""Shapes of payloads that many units share: unit normals, spans, light vectors."""

from amaranth.hdl import unsigned
from amaranth.lib import data

from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.fixed import FixedShape

__all__ = ["light_vectors_shape", "normal_shape", "span_normals_shape"]


def normal_shape() -> data.ArrayLayout:
    """Shape of a unit normal: three components ``SQ(1, 17)``."""
    return data.ArrayLayout(FixedShape(COMPONENT), 3)


def span_normals_shape(length_bits: int = LENGTH_BITS) -> data.StructLayout:
    """Shape of a span: the normals at its ends, and its length in pixels, of ``length_bits``."""
    normals = {f"normal_{place}": normal_shape() for place in ("left", "right")}
    return data.StructLayout(normals | {"length": unsigned(length_bits)})


def light_vectors_shape(lights: int) -> data.ArrayLayout:
    """Shape of the vectors of each light: direction L and half-way vector H."""
    vectors = data.StructLayout({"direction": normal_shape(), "halfway": normal_shape()})
    return data.ArrayLayout(vectors, lights)
