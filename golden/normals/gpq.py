"""Coefficients of the quadratic normal curve ([T] figure 2.8)."""

from dataclasses import dataclass

from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["GPQ"]


@dataclass(frozen=True)
class GPQ:
    """Coefficients ``G = 2 N_r - 4 N_c + 2 N_l``, ``P = 4 N_c - N_r - 3 N_l``, ``Q = N_l``, exact.

    ``N(t) = G t^2 + P t + Q`` passes through the three normals at t = 0, 1/2 and 1. ``N_c`` has 19 fraction
    bits. So G and P have 17 and are exact: there is no arithmetic error. Up to 45 degrees |G| <= 0.305 and
    |P| <= 0.83. So ``SQ(0, 17)`` and ``SQ(1, 17)`` hold them. The coefficients of a wider span, which the
    middle normal flags, saturate.

    Source: docs/theory/interpolation.md#quadratic-normals; [T] 2.2, figure 2.8.
    """

    G_FORMAT = SQ(0, 17)
    P_FORMAT = SQ(1, 17)
    Q_FORMAT = COMPONENT

    def compute(
        self, normal_left: Fixed, normal_middle: Fixed, normal_right: Fixed
    ) -> tuple[Fixed, Fixed, Fixed]:
        """Bit-accurate ``G``, ``P``, ``Q``.

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (..., 3), SQ(1, 17)
            Normals at the ends.
        normal_middle : Fixed, shape (..., 3), SQ(1, 19)
            Normal in the middle.

        Returns
        -------
        g, p, q : Fixed, shape (..., 3), SQ(0, 17), SQ(1, 17), SQ(1, 17)
            Coefficients.

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        formats = (normal_left.format, normal_middle.format, normal_right.format)
        if formats != (COMPONENT, MiddleNormal.FORMAT, COMPONENT):
            raise ValueError(
                f"operands must be {COMPONENT}, {MiddleNormal.FORMAT}, {COMPONENT}, not {formats}"
            )
        middle = normal_middle.scale(2)
        g = (normal_left + normal_right).scale(1).extend(SQ(3, 17)) - middle
        p = middle - normal_right - (normal_left.scale(1) + normal_left)
        return g.saturate(self.G_FORMAT), p.saturate(self.P_FORMAT), normal_left
