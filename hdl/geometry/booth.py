"""Products without a multiplier, from Booth digits."""

from amaranth.hdl import Mux, Value

__all__ = ["booth_term"]


def booth_term(value: Value, bits: Value) -> Value:
    """Value times the Booth digit that three bits encode, -2 to 2.

    Parameters
    ----------
    value : Value
        Signed.
    bits : Value
        Three bits, lowest first: the bit below the digit, then the digit's two bits.

    Returns
    -------
    Value
        Signed.
    """
    low, middle, high = bits
    one, two = low ^ middle, (low == middle) & (middle != high)
    size = Mux(two, value << 1, Mux(one, value, 0))
    return Mux(high, -size, size)
