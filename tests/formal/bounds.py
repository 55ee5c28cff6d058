"""Run bit-accurate models on bounds of codes, and find where hardware wraps and cuts bits."""

import inspect
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from amaranth.hdl import Elaboratable, Fragment, Signal, Value
from amaranth.hdl._ast import Operator, Slice, SwitchValue

from blysk.golden.number.fixed import Fixed, Format
from blysk.hdl.core.fixed import FixedValue

__all__ = ["Bounds", "cut_by", "registers_of", "unknown", "word", "wrapped_by"]


@dataclass(frozen=True, eq=False)
class Unknown:
    """A number between two known ends. Nothing else is known of it."""

    low: float
    high: float


class Bounds:
    """An array of integers, enclosed in two ways at once; either enclosure may be the tighter.

    The first enclosure is an interval. The second is a sum: `Unknown` numbers times factors, plus a rest in
    an interval. In a sum such as ``N_r - N_l - G`` or ``t (1 - t) G`` a number that occurs twice keeps its
    identity, whatever order a model adds in. A product of two sums of this kind has only the interval. A
    shift to the right adds the cut bits to the rest.

    Arithmetic is in float64, which is exact for integers under 2^53; the ends of larger integers are moved
    outwards. Factors are about 1 and numbers are under 2^46. So rounding of a factor counts far less than the
    sixteenth by which the ends of a sum are moved.

    Parameters
    ----------
    low, high : array
        The interval, both ends included.
    parts : dict of Unknown to array, optional
        Factors of the sum.
    rest : tuple of arrays, optional
        The rest of the sum. ``None``: the interval itself.
    """

    def __init__(self, low, high, parts=None, rest=None):
        low, high = np.asarray(low, float), np.asarray(high, float)
        self.parts = {} if parts is None else parts
        self.rest = (low, high) if rest is None else rest
        if self.parts:
            ends = [
                (np.minimum(f * x.low, f * x.high), np.maximum(f * x.low, f * x.high))
                for x, f in self.parts.items()
            ]
            least, most = (sum(end[k] for end in ends) + self.rest[k] for k in range(2))
            # Outwards, then inwards to a whole number, because codes are whole numbers.
            pad = 2.0**-4 + 2.0**-48 * (np.abs(least) + np.abs(most))
            low, high = np.maximum(low, np.ceil(least - pad)), np.minimum(high, np.floor(most + pad))
        # From 2^53 on a step of float64 is added, so that no end is rounded inwards.
        self.low = np.where(np.abs(low) < 2.0**53, low, np.nextafter(low, -np.inf))
        self.high = np.where(np.abs(high) < 2.0**53, high, np.nextafter(high, np.inf))
        assert (self.low <= self.high).all(), "no number is within both enclosures"

    @classmethod
    def of(cls, codes) -> "Bounds":
        """Codes that are known exactly."""
        return codes if isinstance(codes, Bounds) else cls(codes, codes)

    @property
    def shape(self):
        return np.broadcast_shapes(self.low.shape, *(np.shape(factor) for factor in self.parts.values()))

    def __len__(self):
        return self.shape[0]

    def _each(self, function) -> "Bounds":
        """The result of a function that only rearranges elements, applied to every array."""
        arrays = (self.low, self.high, *self.rest, *self.parts.values())
        low, high, *others = (function(np.broadcast_to(array, self.shape)) for array in arrays)
        return Bounds(low, high, dict(zip(self.parts, others[2:], strict=True)), tuple(others[:2]))

    def __getitem__(self, key):
        return self._each(lambda array: array[key])

    def any(self, axis=None):
        return Bounds(self.low.any(axis=axis), self.high.any(axis=axis))

    def within(self, low, high) -> bool:
        """Whether every code is in a range."""
        return bool((self.low >= low).all() and (self.high <= high).all())

    def known(self, low, high) -> "Bounds":
        """The same code, with the additional knowledge that it is in a range."""
        return Bounds(np.maximum(self.low, low), np.minimum(self.high, high), self.parts, self.rest)

    def clip(self, low, high) -> "Bounds":
        """The code, limited to a range. A code that is in the range keeps its parts."""
        if self.within(low, high):
            return self
        return Bounds(np.clip(self.low, low, high), np.clip(self.high, low, high))

    def __add__(self, other):
        other = Bounds.of(other)
        parts = {x: self.parts.get(x, 0) + other.parts.get(x, 0) for x in {**self.parts, **other.parts}}
        rest = tuple(a + b for a, b in zip(self.rest, other.rest, strict=True))
        return Bounds(self.low + other.low, self.high + other.high, parts, rest)

    def __mul__(self, other):
        if isinstance(other, Bounds):
            if other.parts and not self.parts:
                return other * self
            ends = [a * b for a in (self.low, self.high) for b in (other.low, other.high)]
            low, high = np.minimum.reduce(ends), np.maximum.reduce(ends)
            if other.parts or not self.parts:
                return Bounds(low, high)
            # The middle of the other factor, plus the deviation from its middle.
            middle, left = (other.low + other.high) / 2, (other.high - other.low) / 2
            linear, rest = self * middle, left * np.maximum(np.abs(self.low), np.abs(self.high))
            return Bounds(low, high, linear.parts, (linear.rest[0] - rest, linear.rest[1] + rest))
        factor = np.asarray(other, float)
        (low, high), (least, most) = (
            (np.minimum(a * factor, b * factor), np.maximum(a * factor, b * factor))
            for a, b in ((self.low, self.high), self.rest)
        )
        return Bounds(low, high, {x: f * factor for x, f in self.parts.items()}, (least, most))

    def __neg__(self):
        return self * -1

    def __sub__(self, other):
        return self + -Bounds.of(other)

    def __lshift__(self, count):
        return self * 2.0 ** np.asarray(count)

    def __rshift__(self, count):
        scale = 2.0 ** -np.asarray(count)
        parts = {x: f * scale for x, f in self.parts.items()}
        low, high = np.floor(self.low * scale), np.floor(self.high * scale)
        if not parts:
            return Bounds(low, high)
        return Bounds(low, high, parts, (self.rest[0] * scale - (1 - scale), self.rest[1] * scale))

    def __and__(self, mask):
        """The low bits of the code."""
        assert mask & (mask + 1) == 0, "a mask has ones below and none above"
        return self if self.within(0, mask) else Bounds(np.zeros(self.shape), np.full(self.shape, mask))

    def __or__(self, other):
        other = Bounds.of(other)
        return Bounds(np.maximum(self.low, other.low), np.maximum(self.high, other.high))

    def __gt__(self, other):
        other = Bounds.of(other)
        return Bounds(self.low > other.high, self.high > other.low)

    def __lt__(self, other):
        return Bounds.of(other) > self

    def __ne__(self, other):
        other = Bounds.of(other)
        return Bounds(
            (self > other).low + (self < other).low > 0, (self > other).high + (self < other).high > 0
        )

    __hash__ = None
    __radd__, __rmul__, __ror__ = __add__, __mul__, __or__

    def __rsub__(self, other):
        return -self + other

    def __array_ufunc__(self, ufunc, method, *inputs, **_):
        """Operations with an array on the left, and NumPy's functions."""
        operations = {
            np.add: lambda a, b: Bounds.of(a) + b,
            np.subtract: lambda a, b: Bounds.of(a) - b,
            np.multiply: lambda a, b: b * a if isinstance(b, Bounds) else a * b,
            np.bitwise_or: lambda a, b: Bounds.of(a) | b,
            np.greater: lambda a, b: Bounds.of(a) > b,
            np.less: lambda a, b: Bounds.of(a) < b,
            np.not_equal: lambda a, b: Bounds.of(a) != b,
        }
        return operations[ufunc](*inputs) if method == "__call__" and ufunc in operations else NotImplemented

    def __array_function__(self, function, _, args, kwargs):
        return Bounds.clip(*args, **kwargs) if function is np.clip else NotImplemented


def unknown(low, high, reach=1.0) -> Bounds:
    """A code with unknown value in an interval, times ``reach``, an array of shape (..., 1)."""
    reach = np.atleast_2d(reach)
    return Bounds(low * reach, high * reach, {Unknown(low, high): reach}, (np.zeros_like(reach),) * 2)


def word(format: Format, *shape: int) -> Fixed:
    """Any code of a format, for each element."""
    return Fixed(format, Bounds(np.full(shape, format.min_code), np.full(shape, format.max_code)))


def _fragments(part: Elaboratable) -> Iterator[Fragment]:
    """The hardware of a unit and of all units inside."""
    yield (fragment := Fragment.get(part, None))
    for inner, *_ in fragment.subfragments:
        yield from _fragments(inner)


def wrapped_by(unit: Elaboratable) -> set[Format]:
    """Formats to which a unit wraps by `FixedValue.wrap`. `cut_by` finds the cuts by raw slices."""
    found, wrap = set(), FixedValue.wrap

    def noted(value, format):
        found.add(format)
        return wrap(value, format)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FixedValue, "wrap", noted)
        list(_fragments(unit))
    assert found
    return found


def _inner(value: Value) -> Value:
    """The value from which low bits are taken, without conversions of its sign."""
    if isinstance(value, Slice) and value.start == 0:
        return _inner(value.value)
    if isinstance(value, Operator) and value.operator in ("s", "u"):
        return _inner(value.operands[0])
    return value


def cut_by(unit: Elaboratable) -> set[str]:
    """Functions in which a unit's hardware cuts upper bits of a sum, a product, a left shift or a choice.

    It finds raw slices, and no operations of `FixedValue`. It does not find cuts of a register, or cuts by an
    assignment to a shorter signal.
    """
    found, make = set(), Slice.__init__

    def noted(bits, value, start, stop, **options):
        make(bits, value, start, stop, **options)
        inner = _inner(value)
        arithmetic = isinstance(inner, Operator) and inner.operator in ("+", "-", "*", "<<")
        if start == 0 and stop < len(value) and (arithmetic or isinstance(inner, SwitchValue)):
            frame = inspect.currentframe().f_back
            while frame.f_globals["__name__"].startswith("amaranth."):
                frame = frame.f_back
            if (module := frame.f_globals["__name__"]) != FixedValue.__module__:
                found.add(f"{module}.{frame.f_code.co_qualname.split('.<locals>')[0]}")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Slice, "__init__", noted)
        list(_fragments(unit))
    return found


def registers_of(unit: Elaboratable) -> list[Signal]:
    """Registers of a unit and of all units inside."""
    statements = (x for fragment in _fragments(unit) for x in fragment.statements.get("sync", ()))
    return [signal for statement in statements for signal in statement._lhs_signals()]
