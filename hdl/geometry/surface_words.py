"""Attributes of a surface that triangles bring: shapes, turns, and the shift of a step."""

from amaranth.hdl import Mux, Value, unsigned
from amaranth.lib import data

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.geometry.triangles import ATTRIBUTE, ATTRIBUTES
from blysk.hdl.albedo.attribute_spans import placement_shape
from blysk.hdl.core.fixed import FixedShape

__all__ = [
    "STEP_BITS",
    "attribute_count",
    "corner_surface_shape",
    "halved_surface_shape",
    "placement_of",
    "surface_count",
    "surface_exponent",
    "surface_start",
    "surface_step",
    "used_step",
]

STEP_BITS = SurfaceWords.PLANE_FORMAT.width - 1
"""Bits of a step modulo 2."""

_WORD_BITS = SurfaceWords.FORMAT.width


def surface_count(surface: AttributeSpans | None) -> int:
    """Number of planes besides N/W and the depth."""
    return 0 if surface is None else surface.attributes + 1


def attribute_count(surface: AttributeSpans | None) -> int:
    """Number of planes of a triangle."""
    return ATTRIBUTES + surface_count(surface)


def placement_of(surface: AttributeSpans | None) -> dict:
    """Members that place the texture coordinates of a triangle: base, range, level."""
    return {} if surface is None else placement_shape(surface)


def corner_surface_shape(surface: AttributeSpans | None) -> dict:
    """Member ``surface``: for each of three corners the attributes, then 1/W."""
    if surface is None:
        return {}
    words = data.ArrayLayout(FixedShape(ATTRIBUTE), surface_count(surface))
    return {"surface": data.ArrayLayout(words, 3)}


def halved_surface_shape(surface: AttributeSpans | None) -> dict:
    """Members of a piece: words at the first pixel, and steps to the right modulo 2."""
    if surface is None:
        return {}
    count = surface_count(surface)
    words = {
        "surface_start": data.ArrayLayout(unsigned(_WORD_BITS), count),
        "surface_step": data.ArrayLayout(unsigned(STEP_BITS), count),
    }
    return words | placement_of(surface)


def surface_start(code: Value) -> Value:
    """Word at the first pixel, from the code of a plane, as in `SurfaceWords`."""
    return code[SurfaceWords.LARGEST_EXPONENT :][:_WORD_BITS]


def used_step(code: Value) -> Value:
    """First bits below the sign of a step that differ from the sign; the step has `STEP_BITS`."""
    return (code[: STEP_BITS - 1] ^ code[STEP_BITS - 1].replicate(STEP_BITS - 1))[
        -SurfaceWords.LARGEST_EXPONENT :
    ]


def surface_exponent(used: Value) -> Value:
    """Places by which steps may be shifted, from their used bits."""
    found = SurfaceWords.LARGEST_EXPONENT
    for place in range(SurfaceWords.LARGEST_EXPONENT):
        found = Mux(used[place], SurfaceWords.LARGEST_EXPONENT - 1 - place, found)
    return found[: SurfaceWords.LARGEST_EXPONENT.bit_length()]


def surface_step(code: Value, exponent: Value) -> Value:
    """Word of a step, shifted by ``exponent`` and cut."""
    for k in reversed(range(len(exponent))):
        code = Mux(exponent[k], code << (1 << k), code)[:STEP_BITS]
    return surface_start(code)
