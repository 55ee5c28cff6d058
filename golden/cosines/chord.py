"""Chord unit: half the squared distance of two unit vectors, which is 1 minus their cosine."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["Chord"]


@dataclass(frozen=True)
class Chord:
    """``u = |a - b|^2 / 2``, for unit vectors ``1 - a . b``.

    A length error e of a vector makes the dot product wrong by e, the chord by ``e^2/2 + e u`` only; and near
    u = 0 it is no difference of nearly equal numbers.

    ========== ========== =======================================================================
    word       format     why
    ========== ========== =======================================================================
    a - b      SQ(1, 17)  multiplier operand; where a component is 1 or more all three are halved
    u          UQ(2, 35)  saturates
    operand    UQ(1, 25)  of the specular unit; cut, saturates
    ========== ========== =======================================================================

    u is exact where all components of ``a - b`` are under 1, which is wherever u < 1/2. Elsewhere halving
    cuts half a step of each, and u is off by at most ``sqrt(3) 2^-17 |a - b| + 3 * 2^-35``, 2.7e-5.

    Source: chord.md; R. Lyon, *Phong shading reformulation for hardware renderer simplification*, 1993.
    """

    FORMAT = UQ(2, 35)
    ARGUMENT_FORMAT = UQ(1, 25)

    def compute(self, a: Fixed, b: Fixed) -> Fixed:
        """Bit-true u.

        Parameters
        ----------
        a, b : Fixed, shape (..., 3), SQ(1, 17)
            Unit vectors.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        if {a.format, b.format} != {COMPONENT}:
            raise ValueError(f"operands must be {COMPONENT}, not {a.format}, {b.format}")
        codes = (a - b).codes
        far = np.any((codes < COMPONENT.min_code) | (codes > COMPONENT.max_code), axis=-1)
        operand = Fixed(COMPONENT, np.where(far[..., np.newaxis], codes >> 1, codes))
        square = DotProduct().compute(operand, operand)
        return Fixed(SQ(6, 34), square.codes << 2 * far).scale(-1).saturate(self.FORMAT)

    def operand(self, a: Fixed, b: Fixed) -> Fixed:
        """Bit-true u as the specular unit takes it, UQ(1, 25)."""
        return self.compute(a, b).truncate(25).saturate(self.ARGUMENT_FORMAT)
