"""Fixed-point formats and NumPy arrays of fixed-point numbers.

A format is ``SQ(i, f)`` (two's complement, the sign bit counted in ``i``) or ``UQ(i, f)`` (unsigned), with
``i`` integer bits and ``f`` fraction bits. A number is its integer *code* times ``2**-f``. The width
``i + f`` is 1 to 63 bits. Either count may be negative: ``UQ(-3, 20)`` has 17 bits, for numbers less than one
eighth.

Every operation is exact: its result has a format that holds every outcome. Only four operations lose bits:
`Fixed.truncate`, `Fixed.round_half_up`, `Fixed.saturate`, `Fixed.wrap`. `blysk.hdl.core.fixed` has the same
operations, with the same names and result formats, for signals.
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["SQ", "UQ", "Fixed", "Format", "require_same_point"]


@dataclass(frozen=True)
class Format:
    """A fixed-point format; make one with `SQ` or `UQ`.

    Two formats are equal, and hash alike, when signedness and both bit counts agree.

    Parameters
    ----------
    signed : bool
        Two's complement or unsigned.
    integer_bits : int
        Bits left of the binary point, the sign bit included.
    fraction_bits : int
        Bits right of the binary point.

    Raises
    ------
    TypeError
        If a bit count is not an integer.
    ValueError
        If the width is not 1 to 63 bits, the range in which codes fit an int64.
    """

    signed: bool
    integer_bits: int
    fraction_bits: int

    def __post_init__(self) -> None:
        for name in ("integer_bits", "fraction_bits"):
            if isinstance(getattr(self, name), bool) or not isinstance(getattr(self, name), int):
                raise TypeError(f"{name} must be an integer, not {getattr(self, name)!r}")
        if not 1 <= self.width <= 63:
            raise ValueError(f"{self} is {self.width} bits wide; a width must be 1 to 63 bits")

    def __repr__(self) -> str:
        return f"{'SQ' if self.signed else 'UQ'}({self.integer_bits}, {self.fraction_bits})"

    @property
    def width(self) -> int:
        """Number of bits."""
        return self.integer_bits + self.fraction_bits

    @property
    def min_code(self) -> int:
        """Smallest code."""
        return -(1 << (self.width - 1)) if self.signed else 0

    @property
    def max_code(self) -> int:
        """Largest code."""
        return (1 << (self.width - self.signed)) - 1

    @property
    def step(self) -> float:
        """Value of one unit of the code, ``2**-fraction_bits``."""
        return 2.0**-self.fraction_bits

    def wrap(self, codes: np.ndarray) -> np.ndarray:
        """Codes from the low bits of integers of any size. An int64 sum may have overflowed."""
        low = codes & ((1 << self.width) - 1)
        return low - ((low >> (self.width - 1)) << self.width) if self.signed else low

    def holds(self, other: "Format") -> bool:
        """Whether every number of ``other`` is a number of this format."""
        return (
            self.fraction_bits >= other.fraction_bits
            and (self.signed or not other.signed)
            and self.integer_bits - self.signed >= other.integer_bits - other.signed
        )

    def code(self, value: int | float | Fraction) -> int:
        """Code of a number.

        Raises
        ------
        ValueError
            If the format does not hold the number exactly.
        """
        scaled = Fraction(value) * Fraction(2) ** self.fraction_bits
        if scaled.denominator != 1 or not self.min_code <= scaled <= self.max_code:
            raise ValueError(f"{value} is not a number of {self}")
        return int(scaled)

    # Result formats of the operations, for arrays and for signals.

    def __add__(self, other: "Format") -> "Format":
        """Format of a sum: one more integer bit than the wider operand."""
        signed = self.signed or other.signed
        integer_bits = max(f.integer_bits + (signed and not f.signed) for f in (self, other)) + 1
        return Format(signed, integer_bits, max(self.fraction_bits, other.fraction_bits))

    def __sub__(self, other: "Format") -> "Format":
        """Format of a difference, always signed."""
        # The difference of two unsigned numbers needs one more bit, for the sign.
        if not (self.signed or other.signed):
            return Format(
                True,
                max(self.integer_bits, other.integer_bits) + 1,
                max(self.fraction_bits, other.fraction_bits),
            )
        return Format(True, (self + other).integer_bits, (self + other).fraction_bits)

    def __mul__(self, other: "Format") -> "Format":
        """Format of a product: both bit counts add."""
        return Format(
            self.signed or other.signed,
            self.integer_bits + other.integer_bits,
            self.fraction_bits + other.fraction_bits,
        )

    def __neg__(self) -> "Format":
        """Format of the negative, always signed and one bit wider."""
        return Format(True, self.integer_bits + 1, self.fraction_bits)

    def scaled(self, exponent: int) -> "Format":
        """Format in which the same code stands for ``2**exponent`` times the number: a wired shift."""
        return Format(self.signed, self.integer_bits + exponent, self.fraction_bits - exponent)

    def truncated(self, fraction_bits: int) -> "Format":
        """Format after `Fixed.truncate`."""
        if fraction_bits > self.fraction_bits:
            raise ValueError(f"{self} has no {fraction_bits} fraction bits to keep; use extend")
        return Format(self.signed, self.integer_bits, fraction_bits)

    def rounded(self, fraction_bits: int) -> "Format":
        """Format after `Fixed.round_half_up`: one more integer bit, as the largest code rounds up."""
        kept = self.truncated(fraction_bits)
        if fraction_bits == self.fraction_bits:
            return kept
        return Format(self.signed, self.integer_bits + 1, fraction_bits)


def SQ(integer_bits: int, fraction_bits: int) -> Format:
    """Signed format, the sign bit counted in ``integer_bits``: -2^(i-1) to 2^(i-1) - 2^-f."""
    return Format(True, integer_bits, fraction_bits)


def UQ(integer_bits: int, fraction_bits: int) -> Format:
    """Unsigned format: 0 to 2^i - 2^-f."""
    return Format(False, integer_bits, fraction_bits)


class Fixed:
    """An array of fixed-point numbers: the bit-accurate model of a fixed-point signal.

    Parameters
    ----------
    format : Format
        Number format.
    codes : integer or integer array, any shape
        Codes; the value is ``codes * 2**-fraction_bits``.

    Raises
    ------
    TypeError
        If the codes are not integers.
    ValueError
        If a code is outside the format's range.
    """

    def __init__(self, format: Format, codes: npt.ArrayLike) -> None:
        codes = np.asarray(codes)
        if codes.dtype.kind not in "iu":
            raise TypeError(f"codes must be integers, not {codes.dtype}")
        if codes.size and not (format.min_code <= int(codes.min()) and int(codes.max()) <= format.max_code):
            raise ValueError(f"codes from {codes.min()} to {codes.max()} exceed {format}")
        self.format = format
        self.codes = codes.astype(np.int64)

    @classmethod
    def _exact(cls, format: Format, codes: np.ndarray) -> "Fixed":
        """Result of an operation in a format that holds every outcome."""
        fixed = cls.__new__(cls)
        fixed.format = format
        fixed.codes = codes
        return fixed

    @classmethod
    def round(cls, format: Format, values: npt.ArrayLike) -> "Fixed":
        """Numbers nearest to float64 values, halves rounded up.

        Raises
        ------
        ValueError
            If a value is outside the format's range.
        """
        scaled = np.asarray(values, float) * 2.0**format.fraction_bits
        return cls(format, np.floor(scaled + 0.5).astype(np.int64))

    def __repr__(self) -> str:
        return f"Fixed({self.format}, {self.codes!r})"

    @property
    def values(self) -> np.ndarray:
        """Values in float64 (exact up to 53 significant bits)."""
        found: np.ndarray = np.ldexp(self.codes.astype(np.float64), -self.format.fraction_bits)
        return found

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        found: tuple[int, ...] = self.codes.shape
        return found

    def __getitem__(self, key: Any) -> "Fixed":
        """Numbers picked by a NumPy index."""
        return Fixed._exact(self.format, self.codes[key])

    def _aligned(self, other: "Fixed") -> tuple[np.ndarray, np.ndarray, int]:
        fraction_bits = max(self.format.fraction_bits, other.format.fraction_bits)
        return (
            self.codes << (fraction_bits - self.format.fraction_bits),
            other.codes << (fraction_bits - other.format.fraction_bits),
            fraction_bits,
        )

    def __add__(self, other: "Fixed") -> "Fixed":
        """Exact sum."""
        format = self.format + other.format
        a, b, _ = self._aligned(other)
        return Fixed._exact(format, a + b)

    def __sub__(self, other: "Fixed") -> "Fixed":
        """Exact difference."""
        format = self.format - other.format
        a, b, _ = self._aligned(other)
        return Fixed._exact(format, a - b)

    def __mul__(self, other: "Fixed") -> "Fixed":
        """Exact product."""
        return Fixed._exact(self.format * other.format, self.codes * other.codes)

    def __neg__(self) -> "Fixed":
        """Exact negative."""
        return Fixed._exact(-self.format, -self.codes)

    def _compare(
        self, other: "Fixed", comparison: Callable[[np.ndarray, np.ndarray], np.ndarray]
    ) -> np.ndarray:
        self.format - other.format  # Refuses operands that cannot be aligned in 63 bits.
        a, b, _ = self._aligned(other)
        return comparison(a, b)

    def __lt__(self, other: "Fixed") -> np.ndarray:
        """Elementwise comparison of the values."""
        return self._compare(other, np.less)

    def __le__(self, other: "Fixed") -> np.ndarray:
        """Elementwise comparison of the values."""
        return self._compare(other, np.less_equal)

    def __gt__(self, other: "Fixed") -> np.ndarray:
        """Elementwise comparison of the values."""
        return self._compare(other, np.greater)

    def __ge__(self, other: "Fixed") -> np.ndarray:
        """Elementwise comparison of the values."""
        return self._compare(other, np.greater_equal)

    def __eq__(self, other: object) -> np.ndarray:  # type: ignore[override]
        """Elementwise comparison of the values."""
        if not isinstance(other, Fixed):
            return NotImplemented
        return self._compare(other, np.equal)

    def __ne__(self, other: object) -> np.ndarray:  # type: ignore[override]
        """Elementwise comparison of the values."""
        if not isinstance(other, Fixed):
            return NotImplemented
        return self._compare(other, np.not_equal)

    __hash__ = None  # type: ignore[assignment]

    def scale(self, exponent: int) -> "Fixed":
        """Product with ``2**exponent``, exact: the binary point moves, the code stays."""
        return Fixed._exact(self.format.scaled(exponent), self.codes)

    def truncate(self, fraction_bits: int) -> "Fixed":
        """Round towards minus infinity to ``fraction_bits``."""
        format = self.format.truncated(fraction_bits)
        return Fixed._exact(format, self.codes >> (self.format.fraction_bits - fraction_bits))

    def round_half_up(self, fraction_bits: int) -> "Fixed":
        """Round to nearest, halves towards plus infinity, to ``fraction_bits``."""
        format = self.format.rounded(fraction_bits)
        dropped = self.format.fraction_bits - fraction_bits
        if dropped == 0:
            return self
        # All dropped bits but one are shifted out before the half is added. So no sum outgrows an int64.
        return Fixed._exact(format, ((self.codes >> (dropped - 1)) + 1) >> 1)

    def saturate(self, format: Format) -> "Fixed":
        """Clamp to the range of ``format``, which has the same fraction bits.

        Raises
        ------
        ValueError
            If the fraction bits differ: round, truncate or extend first.
        """
        require_same_point(self.format, format, "saturate")
        return Fixed._exact(format, np.clip(self.codes, format.min_code, format.max_code))

    def wrap(self, format: Format) -> "Fixed":
        """Keep the low bits: the value modulo ``2**integer_bits``, in a format with the same fraction bits.

        Raises
        ------
        ValueError
            If the fraction bits differ: round, truncate or extend first.
        """
        require_same_point(self.format, format, "wrap")
        return Fixed._exact(format, format.wrap(self.codes))

    def extend(self, format: Format) -> "Fixed":
        """Same values in a format that holds them all.

        Raises
        ------
        ValueError
            If ``format`` does not hold every number of this one's format.
        """
        if not format.holds(self.format):
            raise ValueError(f"{format} does not hold every number of {self.format}")
        return Fixed._exact(format, self.codes << (format.fraction_bits - self.format.fraction_bits))


def require_same_point(source: Format, target: Format, operation: str) -> None:
    """Refuse an operation that would move the binary point.

    Raises
    ------
    ValueError
        If the formats differ in their fraction bits.
    """
    if source.fraction_bits != target.fraction_bits:
        raise ValueError(f"{operation} from {source} to {target} needs equal fraction bits")
