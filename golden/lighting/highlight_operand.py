"""Base of the models of specular units."""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import UQ, Fixed, Format
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.reflection import ReflectionModel

__all__ = ["MAX_EXPONENT", "HighlightOperand"]

MAX_EXPONENT = 1000
"""Largest specular exponent."""


@dataclass(frozen=True)
class HighlightOperand:
    """Base of the models of specular units: format of the operand, range of the exponent.

    A subclass has an attribute ``operand``.

    - ``"cosine"``: the unit takes ``N . H`` of two unit vectors in ``SQ(4, 34)`` and subtracts it from
      `ONE_SQUARED`.
    - ``"one_minus_cosine"``: it takes ``1 - cos gamma`` in ``UQ(1, 25)``.
    """

    OPERANDS: ClassVar[tuple[str, ...]] = ("cosine", "one_minus_cosine")
    ARGUMENT_FORMAT = UQ(1, 25)
    RESULT_FORMAT = UQ(0, 17)
    EXPONENT_BITS = 10
    ERROR: ClassVar[float]

    def __post_init__(self) -> None:
        if self.operand not in self.OPERANDS:
            known = " or ".join(map(repr, self.OPERANDS))
            raise ValueError(f"operand must be {known}, not {self.operand!r}")

    @property
    def operand(self) -> Any:
        """Kind of the operand, one of ``OPERANDS``."""
        raise NotImplementedError

    @property
    def reflection(self) -> ReflectionModel:
        """The reflection model."""
        raise NotImplementedError

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        raise NotImplementedError

    @property
    def banks(self) -> int:
        """Number of tables of lobes; 0 without a table."""
        return 0

    @property
    def table_options(self) -> dict[str, Any]:
        """Options of a lobe's tables that do not depend on the operand. Empty without a table."""
        return {}

    @property
    def error(self) -> float:
        """Largest error of a term against the model, without `line_error`."""
        return self.ERROR

    @property
    def parts(self) -> int:
        """Number of parts of a table, each with its own argument, for a unit with tables."""
        return 1

    @property
    def argument_text(self) -> str:
        """Argument of the first table, as a text, for a unit with tables."""
        return "u = 1 - N.H"

    @property
    def word_formats(self) -> dict[str, Format]:
        """Formats of words of the unit that tools show, by the names of their registers."""
        return {}

    def line_error(self, parameter: float | None) -> float:
        """Largest error of a table between its entries; 0 without a table."""
        return 0.0

    def is_sharp(self, parameter: float | None) -> bool:
        """Whether a lobe is so sharp that a frame must report its `line_error`."""
        return False

    def for_operand(self, operand: Any, scale: int = 0) -> "HighlightOperand":
        """The unit for another operand.

        Parameters
        ----------
        operand : str
            Kind of the operand.
        scale : int
            Scale of the operand, see `Lobe`. A unit without a table ignores it.

        Raises
        ------
        ValueError
            If the unit does not take the operand.
        """
        if self.operand == operand:
            return self
        return replace(self, operand=operand)  # type: ignore[call-arg]  # a field of each unit

    def check(self, table: Any) -> None:
        """Refuse a table that the unit cannot read. A unit without a table refuses none.

        Raises
        ------
        ValueError
            If ``table`` is refused.
        """

    def compute(self, operand: Fixed, dark: np.ndarray, parameter: Any) -> Fixed:
        """Bit-accurate specular terms.

        Parameters
        ----------
        operand : Fixed, any shape
            Operand in `operand_format`.
        dark : bool array, same shape
            Whether the light is behind the surface: the result is 0.
        parameter : int or LobeTable
            Exponent, or table of the lobe.

        Returns
        -------
        Fixed, same shape, UQ(0, 17)
        """
        raise NotImplementedError

    @property
    def operand_format(self) -> Format:
        """Format of the input."""
        return DotProduct().result_format if self.operand == "cosine" else self.ARGUMENT_FORMAT

    def one_minus(self, operand: Fixed, exponent: int) -> Fixed:
        """One minus the cosine of an operand, exact, after a check of operand and exponent.

        Raises
        ------
        ValueError
            If the operand has another format or the exponent is out of range.
        """
        if operand.format != self.operand_format:
            raise ValueError(f"operand must be {self.operand_format}, not {operand.format}")
        if not 1 <= exponent <= MAX_EXPONENT:
            raise ValueError(f"exponent must be 1 to {MAX_EXPONENT}, not {exponent}")
        return ONE_SQUARED - operand if self.operand == "cosine" else operand

    @property
    def has_table(self) -> bool:
        """Whether the unit computes by a table for each material, as a `Lobe` does."""
        return False

    @property
    def last_lit_arguments(self) -> np.ndarray:
        """For each exponent the largest ``1 - cos gamma`` that may give a term over 0, in steps of 2^-25.

        int64 array, shape (1024,). It is 2^27 if every argument may give a term over 0.
        """
        raise NotImplementedError
