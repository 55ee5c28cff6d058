"""Fixed-point signals: the shapes and operations of `fixed`, as hardware.

``Signal(SQ(1, 17))`` is a `FixedValue`. So is a field of a layout with the shape ``SQ(1, 17)``. The
operations have the names, the exact growth and the result formats of `Fixed`. They refuse an assignment that
would lose bits, and a number without a format.
"""

from fractions import Fraction

from amaranth.hdl import Cat, Const, Mux, Shape, ShapeCastable, Value, ValueCastable

from blysk.golden.number import fixed as golden_fixed
from blysk.golden.number.fixed import Format

__all__ = ["SQ", "UQ", "FixedShape", "FixedValue"]


class FixedShape(ShapeCastable):
    """Shape of a fixed-point signal; make one with `SQ` or `UQ`, or from a `Format`.

    Two shapes are equal, and hash alike, when their formats are equal.

    Parameters
    ----------
    format : Format
        Number format.
    """

    def __init__(self, format: Format):
        if not isinstance(format, Format):
            raise TypeError(f"format must be a Format, not {format!r}")
        # The attribute cannot be called `format`: `ShapeCastable.format` prints a value.
        self.number_format = format

    def as_shape(self) -> Shape:
        """Plain shape of the code."""
        return Shape(self.number_format.width, self.number_format.signed)

    def __call__(self, value) -> "FixedValue":
        """The bits of ``value``, interpreted in this format."""
        return FixedValue(self.number_format, value)

    def const(self, init: int | float | Fraction | None) -> Const:
        """Constant of a number that the format holds exactly; ``None`` is 0.

        Raises
        ------
        ValueError
            If the format does not hold the number.
        """
        if isinstance(init, FixedValue):
            if init.format != self.number_format:
                raise ValueError(f"{init!r} is not a constant of {self!r}")
            return Const.cast(init.as_value())
        return Const(self.number_format.code(0 if init is None else init), self.as_shape())

    def from_bits(self, raw: int) -> "FixedValue":
        """Constant of a bit pattern."""
        return FixedValue(self.number_format, Const(raw, self.as_shape()))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, FixedShape) and self.number_format == other.number_format

    def __hash__(self) -> int:
        return hash(self.number_format)

    def __repr__(self):
        return repr(self.number_format)


def SQ(integer_bits: int, fraction_bits: int) -> FixedShape:
    """Shape of a signed fixed-point signal; see `golden.number.fixed.SQ`."""
    return FixedShape(golden_fixed.SQ(integer_bits, fraction_bits))


def UQ(integer_bits: int, fraction_bits: int) -> FixedShape:
    """Shape of an unsigned fixed-point signal; see `golden.number.fixed.UQ`."""
    return FixedShape(golden_fixed.UQ(integer_bits, fraction_bits))


class FixedValue(ValueCastable):
    """A fixed-point value in hardware; `Fixed` is its bit-accurate model, operation by operation.

    Parameters
    ----------
    format : Format
        Number format.
    code : Value
        Bits of the code, of exactly the format's width.

    Raises
    ------
    TypeError
        If the code has another width than the format.
    """

    def __init__(self, format: Format, code):
        code = Value.cast(code)
        if len(code) != format.width:
            raise TypeError(f"a code of {format} has {format.width} bits, not {len(code)}")
        self.format = format
        if code.shape().signed != format.signed:
            code = code.as_signed() if format.signed else code.as_unsigned()
        self._code = code

    @classmethod
    def constant(cls, format: Format, value: int | float | Fraction) -> "FixedValue":
        """Constant of a number that the format holds exactly."""
        return cls(format, FixedShape(format).const(value))

    def shape(self) -> FixedShape:
        """Shape, with the format."""
        return FixedShape(self.format)

    def as_value(self) -> Value:
        """The code."""
        return self._code

    def __repr__(self):
        return f"FixedValue({self.format}, {self._code!r})"

    def eq(self, other: "FixedValue"):
        """Assignment of a value that this format holds without loss.

        Raises
        ------
        TypeError
            If ``other`` is no fixed-point value.
        ValueError
            If the assignment would lose bits: round, truncate, saturate or wrap first.
        """
        _require_fixed(other)
        if not self.format.holds(other.format):
            raise ValueError(
                f"assigning {other.format} to {self.format} would lose bits; "
                "round, truncate, saturate or wrap first"
            )
        return self._code.eq(other.extend(self.format)._code)

    def _aligned(self, other: "FixedValue", format: Format) -> tuple[Value, Value]:
        return tuple(
            Cat(Const(0, format.fraction_bits - x.format.fraction_bits), x._code).as_signed()
            if x.format.signed
            else Cat(Const(0, format.fraction_bits - x.format.fraction_bits), x._code)
            for x in (self, other)
        )

    def __add__(self, other: "FixedValue") -> "FixedValue":
        """Exact sum."""
        _require_fixed(other)
        format = self.format + other.format
        a, b = self._aligned(other, format)
        return FixedValue(format, (a + b)[: format.width])

    def __sub__(self, other: "FixedValue") -> "FixedValue":
        """Exact difference."""
        _require_fixed(other)
        format = self.format - other.format
        a, b = self._aligned(other, format)
        return FixedValue(format, (a - b)[: format.width])

    def __mul__(self, other: "FixedValue") -> "FixedValue":
        """Exact product."""
        _require_fixed(other)
        format = self.format * other.format
        return FixedValue(format, (self._code * other._code)[: format.width])

    def __neg__(self) -> "FixedValue":
        """Exact negative."""
        format = -self.format
        return FixedValue(format, (-self._code)[: format.width])

    def _compared(self, other: "FixedValue") -> tuple[Value, Value]:
        _require_fixed(other)
        return self._aligned(other, self.format - other.format)

    def __lt__(self, other: "FixedValue") -> Value:
        """Whether the value is less than ``other``."""
        a, b = self._compared(other)
        return a < b

    def __le__(self, other: "FixedValue") -> Value:
        """Whether the value is at most ``other``."""
        a, b = self._compared(other)
        return a <= b

    def __gt__(self, other: "FixedValue") -> Value:
        """Whether the value is greater than ``other``."""
        a, b = self._compared(other)
        return a > b

    def __ge__(self, other: "FixedValue") -> Value:
        """Whether the value is at least ``other``."""
        a, b = self._compared(other)
        return a >= b

    def __eq__(self, other: "FixedValue") -> Value:
        """Whether the value is equal to ``other``."""
        a, b = self._compared(other)
        return a == b

    def __ne__(self, other: "FixedValue") -> Value:
        """Whether the value is different from ``other``."""
        a, b = self._compared(other)
        return a != b

    __hash__ = None

    def scale(self, exponent: int) -> "FixedValue":
        """The value times ``2**exponent``, exactly. The binary point moves, and the code stays."""
        return FixedValue(self.format.scaled(exponent), self._code)

    def truncate(self, fraction_bits: int) -> "FixedValue":
        """Round towards minus infinity to ``fraction_bits``."""
        format = self.format.truncated(fraction_bits)
        return FixedValue(format, self._code[self.format.fraction_bits - fraction_bits :])

    def round_half_up(self, fraction_bits: int) -> "FixedValue":
        """Round to nearest, halves towards plus infinity, to ``fraction_bits``."""
        format = self.format.rounded(fraction_bits)
        dropped = self.format.fraction_bits - fraction_bits
        if dropped == 0:
            return self
        kept = self.truncate(fraction_bits)._code
        return FixedValue(format, (kept + self._code[dropped - 1])[: format.width])

    def saturate(self, format: Format) -> "FixedValue":
        """Clamp to the range of ``format``, by a test of the bits above the bits of ``format``.

        Both formats must have the same fraction bits.

        Raises
        ------
        ValueError
            If the fraction bits differ: round, truncate or extend first.
        """
        golden_fixed.require_same_point(self.format, format, "saturate")
        if format.holds(self.format):
            return self.extend(format)
        low = self._code[: format.width]
        negative = self._code[-1] if self.format.signed else Const(0)
        if format.signed:
            # The value is in range if all bits from the target's sign bit upwards are equal. If the value is
            # unsigned, these bits must be 0.
            above = self._code[format.width - 1 :]
            fits = ~above.any() | (above.all() if self.format.signed else 0)
            end = Cat((~negative).replicate(format.width - 1), negative)
        else:
            above = self._code[format.width :]
            fits = ~above.any() & ~negative
            end = (~negative).replicate(format.width)
        return FixedValue(format, Mux(fits, low, end))

    def wrap(self, format: Format) -> "FixedValue":
        """Keep the low bits: the value modulo ``2**i``, where i is the integer bits of ``format``.

        Both formats must have the same fraction bits.

        Raises
        ------
        ValueError
            If the fraction bits differ: round, truncate or extend first.
        """
        golden_fixed.require_same_point(self.format, format, "wrap")
        return FixedValue(format, _resize(self._code, format.width))

    def extend(self, format: Format) -> "FixedValue":
        """Same value in a format that holds it.

        Raises
        ------
        ValueError
            If ``format`` does not hold every number of the value's own format.
        """
        if not format.holds(self.format):
            raise ValueError(f"{format} does not hold every number of {self.format}")
        low = Const(0, format.fraction_bits - self.format.fraction_bits)
        return FixedValue(format, Cat(low, _resize(self._code, format.width - len(low))))


def _resize(code: Value, width: int) -> Value:
    """Sign- or zero-extended, or cut, to ``width`` bits."""
    if width <= len(code):
        return code[:width]
    fill = code[-1] if code.shape().signed else Const(0)
    return Cat(code, fill.replicate(width - len(code)))


def _require_fixed(other: object) -> None:
    if not isinstance(other, FixedValue):
        raise TypeError(f"{other!r} carries no number format; wrap it in a FixedValue")
