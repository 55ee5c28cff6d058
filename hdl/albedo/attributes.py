"""Attributes of a pixel: vertex colours and texture coordinates, by one reciprocal of 1/W."""

from amaranth.hdl import unsigned
from amaranth.lib import data

from blysk.golden.albedo.attributes import Attributes
from blysk.hdl.core.fixed import FixedShape

__all__ = ["attributes_shape"]


def attributes_shape(model: Attributes) -> data.StructLayout:
    """Shape of the attributes of a pixel: ``colors``, and ``coordinates`` and ``level``, if there are any.

    Parameters
    ----------
    model : Attributes
        Bit-accurate model, with the formats.
    """
    members = {}
    if model.spans.colors:
        members["colors"] = data.ArrayLayout(FixedShape(model.COLOR_FORMAT), 3)
    if model.spans.coordinates:
        members["coordinates"] = data.ArrayLayout(FixedShape(model.coordinate_format), 2)
        members["level"] = unsigned(model.spans.LEVEL_FORMAT.width)
    return data.StructLayout(members)
