"""Products of words wider than a multiplier's operand, from three products of their halves."""

from blysk.golden.number.fixed import UQ, Fixed, Format

__all__ = ["GUARD_BITS", "LOST", "halves", "low_format", "wide_product"]

GUARD_BITS = 3
"""Bits that the three products keep below the result's last bit."""

LOST = 2.0**-1 + 3 * 2.0**-GUARD_BITS
"""Error of a `wide_product` by rounding and by three cuts, in steps of the result."""


def low_format(format: Format, low_bits: int) -> Format:
    """Number format of the last ``low_bits`` bits of a word, unsigned."""
    return UQ(low_bits - format.fraction_bits, format.fraction_bits)


def halves(value: Fixed, low_bits: int) -> tuple[Fixed, Fixed]:
    """Signed high part of a number, and its unsigned low part of ``low_bits`` bits.

    The sum of both is exact.
    """
    low = low_format(value.format, low_bits)
    return value.truncate(value.format.fraction_bits - low_bits), Fixed(low, value.codes & low.max_code)


def wide_product(a: Fixed, b: Fixed, a_low: int, b_low: int, fraction_bits: int) -> Fixed:
    """Product ``a b`` from three products of the halves. The product of the two low halves is omitted.

    Each product is cut to `GUARD_BITS` more fraction bits than the result has. Their sum is rounded half up.

    Parameters
    ----------
    a, b : Fixed
        Operands; they broadcast.
    a_low, b_low : int
        Bits of their low halves.
    fraction_bits : int
        Fraction bits of the result.

    Returns
    -------
    Fixed
        The product. It is off by at most `LOST` steps of the result. The omitted product adds less than
        ``2^(a_low + b_low)`` steps of the exact product.
    """
    (a_high, a_rest), (b_high, b_rest) = halves(a, a_low), halves(b, b_low)
    keep = fraction_bits + GUARD_BITS
    parts = [_cut(x * y, keep) for x, y in ((a_high, b_high), (a_high, b_rest), (a_rest, b_high))]
    return (parts[0] + (parts[1] + parts[2])).round_half_up(fraction_bits)


def _cut(product: Fixed, fraction_bits: int) -> Fixed:
    return product.truncate(min(fraction_bits, product.format.fraction_bits))
