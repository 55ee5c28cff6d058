"""Formulas of a data flow's words, read from the functions that describe them.

A word's function is called with formulas in the place of values. Exact sums, differences, products and
components come out as text. Rounding, saturation and formats leave a text as it is. A function that looks at
bits has no formula, and its word keeps its name. Only drawings use formulas.
"""

import re
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from amaranth.hdl import Const

from blysk.hdl.core.fixed import FixedValue

__all__ = ["LONGEST", "SYMBOLS", "Formula", "component", "formula_of"]

SYMBOLS = {
    "normal": "N",
    "normal_left": "N_l",
    "normal_middle": "N_m",
    "normal_right": "N_r",
    "normal_a": "N_a",
    "normal_b": "N_b",
    "vector": "V",
    "length": "m",
    "one_minus_cosine": "u",
    "position": "P",
}
"""Symbols of a beat's fields in formulas. Other fields appear by their names."""

LONGEST = 14
"""Largest number of characters of a formula that other formulas repeat.

For a longer formula they show the word's name.
"""

_SUM, _PRODUCT, _ATOM = range(3)

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Formula(FixedValue):
    """Text in the place of a value, for the operations that a `FixedValue` has.

    `Formula` is a subclass of `FixedValue`. So Python calls the operator of the formula first, even if the
    left operand is a `FixedValue`.

    Parameters
    ----------
    text : str
        Formula. The formula of a vector begins with a capital letter.
    binding : int
        Binding strength of the outermost operation: 0 for a sum, 1 for a product, else 2.
    """

    def __init__(self, text: str, binding: int = _ATOM):
        self.text, self._binding = text, binding

    def __repr__(self):
        return f"Formula({self.text!r})"

    @classmethod
    def read(cls, text: str) -> "Formula":
        """Formula of a text written by hand. Its binding follows from the operators outside parentheses."""
        outer = re.sub(r"\([^()]*\)", "", text)
        return cls(text, _SUM if re.search(" [+−<≤>≥=] ", outer) else _PRODUCT if "·" in outer else _ATOM)

    def as_value(self):
        """Refuse, because a formula has no bits.

        Raises
        ------
        TypeError
            Always.
        """
        raise TypeError(f"the formula {self.text} has no bits")

    def shape(self):
        """Refuse, because a formula has no shape, see `as_value`."""
        return self.as_value()

    def within(self, binding: int) -> str:
        """Text as an operand of an operation with this binding strength, in parentheses if needed."""
        return self.text if self._binding >= binding else f"({self.text})"

    def _sum(self, sign: str, other: Any, swapped: bool = False) -> "Formula":
        a, b = (_cast(other), self) if swapped else (self, _cast(other))
        return Formula(f"{a.text} {sign} {b.within(_SUM if sign == '+' else _PRODUCT)}", _SUM)

    def __add__(self, other):
        return self._sum("+", other)

    def __radd__(self, other):
        return self._sum("+", other, swapped=True)

    def __sub__(self, other):
        return self._sum("−", other)

    def __rsub__(self, other):
        return self._sum("−", other, swapped=True)

    def __neg__(self):
        return Formula(f"−{self.within(_PRODUCT)}", _SUM)

    def __mul__(self, other):
        other = _cast(other)
        if self.text == other.text:
            return Formula(f"{self.within(_ATOM)}²", _PRODUCT)
        return Formula(f"{self.within(_PRODUCT)}·{other.within(_PRODUCT)}", _PRODUCT)

    def __rmul__(self, other):
        return _cast(other) * self

    def _compared(self, sign: str, other: Any) -> "Formula":
        return Formula(f"{self.text} {sign} {_cast(other).text}", _SUM)

    def __lt__(self, other):
        return self._compared("<", other)

    def __le__(self, other):
        return self._compared("≤", other)

    def __gt__(self, other):
        return self._compared(">", other)

    def __ge__(self, other):
        return self._compared("≥", other)

    def __eq__(self, other):
        return self._compared("=", other)

    def __ne__(self, other):
        return self._compared("≠", other)

    __hash__ = None

    def __getitem__(self, index):
        if not isinstance(index, int):
            raise TypeError(f"the formula {self.text} has no bits")
        return component(self, index)

    def scale(self, exponent: int) -> "Formula":
        """Formula of the value times a power of two."""
        if exponent == 0:
            return self
        if exponent == -1:
            return Formula(f"{self.within(_PRODUCT)}/2", _PRODUCT)
        factor = "2" if exponent == 1 else "2" + str(exponent).translate(_SUPERSCRIPTS)
        return Formula(f"{factor}·{self.within(_PRODUCT)}", _PRODUCT)

    def _kept(self, _) -> "Formula":
        """The same formula, for a number rounded or in another format."""
        return self

    truncate = round_half_up = saturate = wrap = extend = _kept


def component(vector: Formula, index: int) -> Formula:
    """Component of a vector (``N_x`` or ``N_l,x``), or element of a row (``f_0``)."""
    text = vector.within(_ATOM)
    if text[:1].isupper() and index < 3:
        return Formula(f"{text}{',' if '_' in text else '_'}{'xyz'[index]}")
    return Formula(f"{text}_{index}")


def formula_of(function: Callable[..., Any], operands: Iterable[Formula]) -> Any:
    """Result of a function called with formulas. ``None`` if it looks at bits, or at the unit around it."""
    try:
        return function(*operands)
    except (AttributeError, IndexError, TypeError, ValueError):
        return None


def _cast(value: Any) -> Formula:
    """The formula itself, or the formula of a constant.

    Raises
    ------
    TypeError
        If the value is neither a formula nor a constant.
    """
    if isinstance(value, Formula):
        return value
    if isinstance(value, int):
        return Formula(f"{value}")
    if isinstance(value, FixedValue):
        code = value.as_value()
        # `as_signed` and `as_unsigned` wrap a constant in an operator.
        code = code.operands[0] if getattr(code, "operator", "") in ("s", "u") else code
        if isinstance(code, Const):
            number = int(value.format.wrap(np.array(code.value))) * value.format.step
            return Formula(f"{number:.5g}" if number >= 0 else f"(−{-number:.5g})")
    raise TypeError(f"{value!r} has no formula")
