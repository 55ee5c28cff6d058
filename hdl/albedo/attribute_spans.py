"""Spans of attributes: vertex colours and texture coordinates over W, and 1/W, of a pixel on every cycle."""

from amaranth.hdl import unsigned
from amaranth.lib import data

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedShape

__all__ = ["attribute_span_shape", "attribute_words_shape"]


def _lines(model: AttributeSpans) -> dict:
    """Members of a word of every line: ``colors``, ``coordinates``, ``weight``, as far as there are any."""
    word, members = FixedShape(model.WORD_FORMAT), {}
    if model.colors:
        members["colors"] = data.ArrayLayout(word, 3)
    if model.coordinates:
        members["coordinates"] = data.ArrayLayout(word, 2)
    if model.perspective:
        members["weight"] = word
    return members


def _of_span(model: AttributeSpans) -> dict:
    """Members that all pixels of a span share."""
    if not model.coordinates:
        return {}
    return {
        "base": data.ArrayLayout(FixedShape(model.BASE_FORMAT), 2),
        "range": unsigned(model.RANGE_FORMAT.width),
        "level": unsigned(model.LEVEL_FORMAT.width),
    }


def attribute_span_shape(model: AttributeSpans, length_bits: int = LENGTH_BITS) -> data.StructLayout:
    """Shape of a span: words at the first pixel, their steps, the exponent of all steps, and the length.

    ``start`` and ``step`` have the members ``colors`` (3 words), ``coordinates`` (2 words) and ``weight``, as
    far as the model has them. With texture coordinates there are also ``base``, ``range`` and ``level``.

    Parameters
    ----------
    model : AttributeSpans
        The attributes.
    length_bits : int
        Bits of the length.
    """
    lines = data.StructLayout(_lines(model))
    exponent = unsigned(model.EXPONENT_FORMAT.width)
    members = {"start": lines, "step": lines, "exponent": exponent}
    return data.StructLayout(members | _of_span(model) | {"length": unsigned(length_bits)})


def attribute_words_shape(model: AttributeSpans) -> data.StructLayout:
    """Shape of the words of a pixel: ``colors``, ``coordinates``, ``weight``, ``base``, ``range``, ``level``.

    Members that the model has not are left out.

    Parameters
    ----------
    model : AttributeSpans
        The attributes.
    """
    return data.StructLayout(_lines(model) | _of_span(model))
