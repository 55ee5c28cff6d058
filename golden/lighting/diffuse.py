"""Bit-accurate model of the diffuse unit: the Lambert term, and whether the light is behind the surface."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import UQ, Fixed, Format

__all__ = ["Diffuse"]


@dataclass(frozen=True)
class Diffuse:
    """Diffuse term: ``max(N . L, 0)``, rounded half up to ``UQ(0, 17)`` and saturated to ``1 - 2^-17``.

    The result has 17 bits, like the operands of the colour multipliers. Codes of unit vectors have the length
    ``ONE / 2^17``. So the term is too small by a relative 2^-16 (0.004 LSB of a full channel). The rounding
    adds at most 2^-18.

    Parameters
    ----------
    operand_format : Format
        Format of ``N . L``, signed.

    Source: docs/theory/models.md#lighting; [B] 4, [T] 6.
    """

    operand_format: Format = DotProduct().result_format

    RESULT_FORMAT = UQ(0, 17)

    def compute(self, cosine: Fixed) -> Fixed:
        """Bit-accurate diffuse terms.

        Parameters
        ----------
        cosine : Fixed, any shape, `operand_format`
            ``N . L`` of two unit vectors.

        Raises
        ------
        ValueError
            If the operand has another format.
        """
        if cosine.format != self.operand_format:
            raise ValueError(f"operand must be {self.operand_format}, not {cosine.format}")
        return cosine.round_half_up(17).saturate(self.RESULT_FORMAT)

    @staticmethod
    def dark(cosine: Fixed) -> np.ndarray:
        """Whether ``N . L <= 0``: a light behind the surface gives no diffuse and no specular term."""
        found: np.ndarray = cosine.codes <= 0
        return found
