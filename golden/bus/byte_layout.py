"""Layout of a payload in the bytes of a bus, as a C compiler lays a structure out."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

__all__ = ["ByteLayout", "Field"]


@dataclass(frozen=True)
class Field:
    """A number, or an array of numbers, in the payload of a stream.

    Parameters
    ----------
    name : str
        A C identifier.
    width : int
        Bits of a number, 1 to 64.
    signed : bool
        Whether the number is in two's complement.
    shape : tuple of int
        Sizes of the array, the outer one first; empty for a single number.
    format : str
        Number format, for people.
    below : int, optional
        Number of values: codes are 0 to ``below - 1``. By default every code of the width is a value. A
        larger code on the bus is read as the last value.

    Raises
    ------
    ValueError
        If the width is out of range.
    """

    name: str
    width: int
    signed: bool = False
    shape: tuple[int, ...] = ()
    format: str = ""
    below: int | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.width <= 64:
            raise ValueError(f"a field of a layout must have 1 to 64 bits, not {self.width}")

    @property
    def size(self) -> int:
        """Bytes of a number: 1, 2, 4 or 8."""
        return next(size for size in (1, 2, 4, 8) if self.width <= 8 * size)

    @property
    def count(self) -> int:
        """Number of numbers in the field."""
        return prod(self.shape)

    @property
    def values(self) -> str:
        """Description of the field's numbers, for people."""
        return self.format or (f"0 to {self.below - 1}" if self.below else f"{self.width} bits")

    @property
    def c_type(self) -> str:
        """Type of a number in C."""
        return f"{'' if self.signed else 'u'}int{8 * self.size}_t"


@dataclass(frozen=True)
class ByteLayout:
    """Bytes of a payload, little endian: each number in 1, 2, 4 or 8 bytes at a multiple of its size.

    A number is extended to its bytes, by its sign or by zeros. Fields follow in the order of the payload. The
    size of the payload is a multiple of the largest number's size. Bytes between numbers are 0. So on every
    processor whose integers are aligned to their size, the layout equals a C structure of ``c_type`` members.
    A DMA controller can send an array of these structures as it stands.

    Parameters
    ----------
    fields : tuple of Field
        At least one field, with different names.
    multiple : int
        Number of bytes of which the size of the payload is a multiple, too: the width of a stream.

    Source: docs/theory/bus.md#streams.
    """

    fields: tuple[Field, ...]
    multiple: int = 1

    @property
    def dtype(self) -> np.dtype:
        """NumPy type of a payload."""
        kinds = [
            (field.name, f"<{'i' if field.signed else 'u'}{field.size}", field.shape) for field in self.fields
        ]
        plain = np.dtype(kinds, align=True)
        if plain.itemsize % self.multiple == 0:
            return plain
        return np.dtype([*kinds, ("padding", "u1", (-plain.itemsize % self.multiple,))], align=True)

    @property
    def padding(self) -> int:
        """Bytes at the end of a payload by which its size becomes a multiple of ``multiple``."""
        plain = ByteLayout(self.fields).size
        return -plain % self.multiple

    @property
    def size(self) -> int:
        """Bytes of a payload."""
        return self.dtype.itemsize

    @property
    def offsets(self) -> tuple[int, ...]:
        """Offset of each field in bytes."""
        places = self.dtype.fields
        assert places is not None
        return tuple(places[field.name][1] for field in self.fields)

    def columns(self, beats: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Codes of each field, from beats as the core has them.

        A member of a structure gets the name of the structure and its own name, as in the fields.

        Parameters
        ----------
        beats : mapping of str to array or mapping
            Arrays of codes, structured arrays, or mappings of them, by member.
        """
        found: dict[str, np.ndarray] = {}

        def add(name: str, value: Any) -> None:
            if isinstance(value, Mapping):
                for key, part in value.items():
                    add(f"{name}_{key}", part)
            elif names := np.asarray(value).dtype.names:
                places = range(value.shape[1]) if value.ndim > 1 else [None]
                for k in places:
                    part = value if k is None else value[:, k]
                    for key in names:
                        add("_".join(str(word) for word in (name, k, key) if word is not None), part[key])
            else:
                found[name] = np.asarray(value)

        for name, value in beats.items():
            add(name, value)
        return {field.name: found[field.name] for field in self.fields}

    def pack(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Bytes of payloads, uint8 of shape (N, size).

        Parameters
        ----------
        columns : mapping of str to int array
            Codes of each field, of shape (N, *shape).

        Raises
        ------
        ValueError
            If a code does not fit its field.
        """
        words = np.zeros(len(columns[self.fields[0].name]), dtype=self.dtype)
        for field in self.fields:
            codes = np.asarray(columns[field.name])
            low, high = (
                (-(1 << field.width - 1), (1 << field.width - 1) - 1)
                if field.signed
                else (0, (field.below or 1 << field.width) - 1)
            )
            if codes.size and not low <= codes.min() <= codes.max() <= high:
                raise ValueError(f"field {field.name} holds {low} to {high}")
            words[field.name] = codes
        return words.view(np.uint8).reshape(len(words), self.size)

    def unpack(self, data: np.ndarray) -> dict[str, np.ndarray]:
        """Codes of each field, int64 of shape (N, *shape), from the low bits of uint8 (N, size)."""
        found = {}
        for name, (field, codes) in self._numbers(data).items():
            low = codes & ((1 << field.width) - 1)
            sign = low >> (field.width - 1) & int(field.signed)
            code = low - (sign << field.width)
            found[name] = code if field.below is None else np.minimum(code, field.below - 1)
        return found

    def fits(self, data: np.ndarray) -> np.ndarray:
        """Whether every number of a payload fits its field, shape (N,)."""
        held = self.unpack(data)
        fit = [
            (held[name] == codes).reshape(len(codes), -1).all(axis=1)
            for name, (_, codes) in self._numbers(data).items()
        ]
        found: np.ndarray = np.logical_and.reduce(fit)
        return found

    def _numbers(self, data: np.ndarray) -> dict[str, tuple[Field, np.ndarray]]:
        """Each field with its numbers as on the bus, with all bits."""
        words = np.ascontiguousarray(data, dtype=np.uint8).view(self.dtype)[:, 0]
        return {field.name: (field, words[field.name].astype(np.int64)) for field in self.fields}
