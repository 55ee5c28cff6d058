"""Chord unit: half the squared distance of two unit vectors, which is 1 minus their cosine."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["Chord"]


@dataclass(frozen=True)
class Chord:
    """Half the squared chord ``u = |a - b|^2 / 2``; for unit vectors ``1 - a . b``.

    A length error e of a vector gives an error e of the dot product. The error of u is only ``e^2/2 + e u``.
    Near u = 0 the formula subtracts no nearly equal numbers.

    ========== ========== =======================================================================
    word       format     why
    ========== ========== =======================================================================
    a - b      SQ(1, 17)  multiplier operand; where a component is 1 or more all three are halved
    u          UQ(2, 35)  saturates
    operand    UQ(1, 25)  operand of the specular unit; cut, saturates
    ========== ========== =======================================================================

    If all components of ``a - b`` are under 1, u is exact. This always holds for u < 1/2. Else halving cuts
    up to half a step of each component, and the error of u is at most ``sqrt(3) 2^-17 |a - b| + 3 * 2^-35``,
    2.7e-5 for unit vectors.

    Source: docs/theory/chord.md#the-chord; [Lyon93].
    """

    FORMAT = UQ(2, 35)
    ARGUMENT_FORMAT = UQ(1, 25)

    def compute(self, a: Fixed, b: Fixed) -> Fixed:
        """Bit-accurate u.

        Parameters
        ----------
        a, b : Fixed, shape (..., 3), SQ(1, 17)
            Unit vectors.

        Returns
        -------
        Fixed, shape (...), UQ(2, 35)

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
        """Bit-accurate u in UQ(1, 25), as the specular unit takes it.

        Parameters and errors are those of `compute`.
        """
        return self.compute(a, b).truncate(25).saturate(self.ARGUMENT_FORMAT)
