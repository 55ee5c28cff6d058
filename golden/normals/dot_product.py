"""Dot product of two fixed-point vectors ([T] figure 2.5)."""

from dataclasses import dataclass

from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["DotProduct"]


@dataclass(frozen=True)
class DotProduct:
    """Dot product ``a . b = a0 b0 + a1 b1 + a2 b2``, exact: no rounding, no arithmetic error.

    Parameters
    ----------
    a_format, b_format : Format
        Number formats of the components, unit vectors by default.

    Source: docs/theory/interpolation.md#dot-product; [T] figure 2.5.
    """

    a_format: Format = COMPONENT
    b_format: Format = COMPONENT

    @property
    def result_format(self) -> Format:
        """Format of the sum, ``SQ(4, 34)`` for unit vectors."""
        product = self.a_format * self.b_format
        return product + product + product

    def compute(self, a: Fixed, b: Fixed) -> Fixed:
        """Bit-accurate result.

        Parameters
        ----------
        a, b : Fixed, shape (..., 3)
            Vectors in ``a_format`` and ``b_format``; they broadcast.

        Returns
        -------
        Fixed, shape (...)
            Dot products in ``result_format``.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        if (a.format, b.format) != (self.a_format, self.b_format):
            raise ValueError(
                f"operands must be {self.a_format} and {self.b_format}, not {a.format} and {b.format}"
            )
        products = a * b
        return products[..., 0] + products[..., 1] + products[..., 2]
