"""Conversion between bytes of a bus and fields of a payload, in a layout that the payload's shape gives."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from amaranth.hdl import Cat, Const, Shape, ShapeLike, Value
from amaranth.lib import data

from blysk.golden.bus.byte_layout import ByteLayout, Field

__all__ = ["bytes_of", "fields_of", "layout_of", "misfits"]


def layout_of(
    shape: ShapeLike,
    without: Sequence[str] = (),
    below: Mapping[str, int] | None = None,
    multiple: int = 1,
) -> ByteLayout:
    """Layout of the bytes of a payload.

    A member of a nested structure has the structure's name and its own name, with an underscore between
    them. In an array of structures the index is the name of a structure.

    Parameters
    ----------
    shape : ShapeLike
        Shape of the payload, a structure.
    without : sequence of str
        Members that are left out, because the bus carries them in another place.
    below : mapping of str to int, optional
        `Field.below` of fields by name.
    multiple : int
        `ByteLayout.multiple`.
    """
    fields = (field for field, _ in _fields(shape, without))
    given = tuple(replace(field, below=(below or {}).get(field.name)) for field in fields)
    return ByteLayout(given, multiple)


def _fields(shape: ShapeLike, without: Sequence[str] = ()) -> Iterator[tuple[Field, int]]:
    """Fields, and the first bit of each in the payload."""
    for key, member in shape:
        if key not in without:
            yield from _members(str(key), member.shape, member.offset)


def _members(name: str, shape: ShapeLike, offset: int) -> Iterator[tuple[Field, int]]:
    if isinstance(shape, data.StructLayout):
        for key, member in shape:
            yield from _members(f"{name}_{key}", member.shape, offset + member.offset)
        return
    sizes, element = [], shape
    while isinstance(element, data.ArrayLayout):
        sizes.append(element.length)
        element = element.elem_shape
    if isinstance(element, data.StructLayout):
        for key, member in shape:
            yield from _members(f"{name}_{key}", member.shape, offset + member.offset)
        return
    plain = Shape.cast(element)
    if plain.width:
        text = "" if isinstance(element, int | Shape | range) else str(element)
        yield Field(name, plain.width, plain.signed, tuple(sizes), text), offset


def _places(shape: ShapeLike, without: Sequence[str]) -> Iterator[tuple[Field, int, int]]:
    """Every number: its field, its first bit in the payload, its first bit on the bus."""
    layout = layout_of(shape, without)
    for (field, bit), byte in zip(_fields(shape, without), layout.offsets, strict=True):
        for k in range(field.count):
            yield field, bit + k * field.width, 8 * (byte + k * field.size)


def fields_of(shape: ShapeLike, word: Value) -> Value:
    """Payload made from its bytes, without padding bits."""
    parts, bit = [], 0
    for field, first, place in _places(shape, ()):
        assert first == bit, "a structure without gaps"
        parts.append(word[place : place + field.width])
        bit += field.width
    return Cat(parts)


def misfits(layout: ByteLayout, word: Value) -> Value:
    """Whether a number on the bus does not fit its field."""
    wrong = []
    for field, byte in zip(layout.fields, layout.offsets, strict=True):
        for k in range(field.count):
            number = word[8 * (byte + k * field.size) :][: 8 * field.size]
            above = number[field.width :]
            if len(above):
                sign = number[field.width - 1].replicate(len(above)) if field.signed else 0
                wrong.append(above != sign)
            if field.below is not None:
                wrong.append(number[: field.width] >= field.below)
    return Cat(wrong).any()


def bytes_of(shape: ShapeLike, payload: Value, without: Sequence[str] = ()) -> Value:
    """Bytes of a payload."""
    parts, reached = [], 0
    for field, bit, place in _places(shape, without):
        number = payload[bit : bit + field.width]
        rest = 8 * field.size - field.width
        parts += [Const(0, place - reached), number]
        parts.append(number[-1].replicate(rest) if field.signed else Const(0, rest))
        reached = place + 8 * field.size
    return Cat(*parts, Const(0, 8 * layout_of(shape, without).size - reached))
