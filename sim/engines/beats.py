"""Beats of a stream as NumPy arrays, and packed into the words that both engines drive and read.

A beat's layout is an `amaranth.lib.data` structure or array, nested as needed, or a plain shape. Fields of
all other shape-castables (a fixed-point format, an enumeration) are given as integer codes.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from amaranth.hdl import Shape, ShapeCastable
from amaranth.lib.data import ArrayLayout, Layout, StructLayout

__all__ = ["dtype_of", "pack", "unpack", "word_count"]

_WORD = 32


def _resolve(shape) -> Layout | Shape:
    """The structure or array layout of a shape. A plain shape is returned as it is."""
    while isinstance(shape, ShapeCastable) and not isinstance(shape, Layout):
        shape = shape.as_shape()
    if not isinstance(shape, Layout):
        shape = Shape.cast(shape)
        if shape.width > 64:
            raise ValueError(f"a field may have at most 64 bits, not {shape.width}")
    elif not isinstance(shape, (StructLayout, ArrayLayout)):
        raise TypeError(f"a beat is made of structures, arrays and plain shapes, not {type(shape).__name__}")
    return shape


def dtype_of(layout) -> np.dtype:
    """NumPy type of one beat.

    Parameters
    ----------
    layout : Layout or shape
        Layout of the stream's payload.

    Returns
    -------
    dtype
        A structured type with the layout's field names. A nested structure is a nested type, an array a
        subarray. A plain shape is the smallest of ``int8`` to ``int64`` or ``uint8`` to ``uint64`` that
        holds its codes.

    Raises
    ------
    ValueError
        If a field has more than 64 bits.
    TypeError
        If the layout has parts other than structures, arrays and plain shapes, for example a union.
    """
    shape = _resolve(layout)
    if isinstance(shape, StructLayout):
        return np.dtype([(name, dtype_of(member)) for name, member in shape.members.items()])
    if isinstance(shape, ArrayLayout):
        element = dtype_of(shape.elem_shape)
        return np.dtype((element.base, (shape.length, *element.shape)))
    size = next(size for size in (8, 16, 32, 64) if shape.width <= size)
    return np.dtype(f"{'int' if shape.signed else 'uint'}{size}")


def word_count(layout) -> int:
    """Number of 32-bit words of one packed beat."""
    return -(-Shape.cast(layout).width // _WORD)


def _leaves(layout, path: tuple = (), offset: int = 0) -> Iterator[tuple[tuple, int, Shape]]:
    """Path (names and indices), bit offset and shape of every leaf. A leaf is a field with a plain shape."""
    shape = _resolve(layout)
    if isinstance(shape, Layout):
        for key, field in shape:
            yield from _leaves(field.shape, (*path, key), offset + field.offset)
    else:
        yield path, offset, shape


def _name(path: tuple) -> str:
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return text.removeprefix(".") or "beat"


def _find(shape, beats, path: tuple = ()) -> Iterator[np.ndarray]:
    """Array of every leaf, in the order of `_leaves`; names, lengths and dtypes are checked."""
    shape = _resolve(shape)
    if isinstance(shape, StructLayout):
        given = beats.keys() if isinstance(beats, Mapping) else beats.dtype.names
        wanted = shape.members.keys()
        if given is None or set(given) != set(wanted):
            given = "no fields" if given is None else ", ".join(given)
            raise ValueError(f"{_name(path)} must have the fields {', '.join(wanted)}, not {given}")
        for name, member in shape.members.items():
            value = beats[name]
            yield from _find(
                member, value if isinstance(value, Mapping) else np.asarray(value), (*path, name)
            )
    elif isinstance(shape, ArrayLayout):
        if isinstance(beats, Mapping) or beats.ndim < 2 or beats.shape[1] != shape.length:
            raise ValueError(f"{_name(path)} must be an array of {shape.length} elements a beat")
        for index in range(shape.length):
            yield from _find(shape.elem_shape, beats[:, index], (*path, index))
    else:
        if isinstance(beats, Mapping) or beats.dtype.kind not in "iub":
            kind = "a mapping" if isinstance(beats, Mapping) else beats.dtype
            raise ValueError(f"{_name(path)} must be integer codes, not {kind}")
        if beats.ndim != 1:
            raise ValueError(f"{_name(path)} must be one integer a beat, not an array of shape {beats.shape}")
        yield beats


def pack(layout, beats: np.ndarray | Mapping) -> np.ndarray:
    """Beats as 32-bit words, least significant word first. Bits above the width are 0.

    Parameters
    ----------
    layout : Layout or shape
        Layout of one beat. A plain shape takes a plain array.
    beats : structured array, shape (count,), or mapping
        Integer codes by field name, of any integer type and width. A mapping of field names to arrays, nested
        as the layout, is accepted, too.

    Returns
    -------
    uint32 array, shape (count, `word_count`)

    Raises
    ------
    ValueError
        If a field is missing, unknown, of the wrong length or without integers, or a code does not fit its
        field. The message names the field and the beat. No code wraps.
    """
    if not isinstance(beats, Mapping):
        beats = np.asarray(beats)
    leaves = list(_leaves(layout))
    arrays = list(_find(layout, beats))
    if arrays:
        counts = {len(array) for array in arrays}
        if len(counts) > 1:
            raise ValueError(
                f"all fields must have equally many beats, not {' and '.join(map(str, sorted(counts)))}"
            )
        count = counts.pop()
    else:
        count = 0 if isinstance(beats, Mapping) else len(beats)
    words = np.zeros((count, word_count(layout)), dtype=np.uint32)
    for (path, offset, shape), array in zip(leaves, arrays, strict=True):
        low, high = (
            (-(1 << shape.width) // 2, (1 << shape.width) // 2 - 1)
            if shape.signed
            else (0, (1 << shape.width) - 1)
        )
        if count and not low <= int(array.min()) <= int(array.max()) <= high:
            worst = int(np.argmax((array < low) | (array > high)))
            raise ValueError(f"{_name(path)} of beat {worst} is {array[worst]}, outside {low} to {high}")
        # Two's complement through uint64; the mask removes the sign extension.
        code = array.astype(np.int64 if array.dtype.kind == "i" else np.uint64).view(np.uint64)
        code = code & np.uint64((1 << shape.width) - 1)
        for word in range(offset // _WORD, -(-(offset + shape.width) // _WORD)):
            shift = word * _WORD - offset
            part = code << np.uint64(-shift) if shift < 0 else code >> np.uint64(shift)
            words[:, word] |= part.astype(np.uint32)
    return words


def unpack(layout, words: np.ndarray) -> np.ndarray:
    """Beats from 32-bit words, the inverse of `pack`.

    Parameters
    ----------
    layout : Layout or shape
        Layout of one beat.
    words : uint32 array, shape (count, `word_count`)
        Packed beats. Bits above the layout's width are ignored.

    Returns
    -------
    array, shape (count,), of type `dtype_of(layout)`

    Raises
    ------
    ValueError
        If the shape is not ``(count, word_count)``.
    """
    if words.ndim != 2 or words.shape[1] != word_count(layout):
        raise ValueError(f"packed beats must have shape (count, {word_count(layout)}), not {words.shape}")
    beats = np.zeros(len(words), dtype=dtype_of(layout))
    for path, offset, shape in _leaves(layout):
        code = np.zeros(len(words), dtype=np.uint64)
        for word in range(offset // _WORD, -(-(offset + shape.width) // _WORD)):
            shift = word * _WORD - offset
            part = words[:, word].astype(np.uint64)
            code |= part >> np.uint64(-shift) if shift < 0 else part << np.uint64(shift)
        # The field's top bit is shifted to bit 63 and back. The arithmetic shift back extends the sign.
        spare = 64 - shape.width
        if spare < 64:
            code = code << np.uint64(spare)
            code = code.view(np.int64) >> np.int64(spare) if shape.signed else code >> np.uint64(spare)
        leaf = beats
        for key in path:
            leaf = leaf[:, key] if isinstance(key, int) else leaf[key]
        leaf[...] = code
    return beats
