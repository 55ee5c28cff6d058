"""G/P/Q unit ([T] figure 2.8): adders and wired shifts."""

from typing import ClassVar

from amaranth.hdl import Signal
from amaranth.lib import data

from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import SQ
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import normal_shape

__all__ = ["GPQUnit", "curve_shapes"]


def curve_shapes() -> dict[str, data.ArrayLayout]:
    """Shapes of the coefficients of a quadratic normal curve, by name: ``g``, ``p`` and ``q``."""
    return {
        "g": data.ArrayLayout(FixedShape(GPQ.G_FORMAT), 3),
        "p": data.ArrayLayout(FixedShape(GPQ.P_FORMAT), 3),
        "q": normal_shape(),
    }


class GPQUnit(PipelinedUnit):
    """Coefficients ``G = 2 N_r - 4 N_c + 2 N_l``, ``P = 4 N_c - N_r - 3 N_l``, ``Q = N_l``.

    The coefficients are exact for spans up to 45 degrees. For wider spans they saturate.

    The latency is 3 cycles (first sums, second sums, saturation), the initiation interval 1. The unit has no
    multipliers.

    Parameters
    ----------
    model : GPQ
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left", "normal_middle", "normal_right"})))`
        Normals: ``SQ(1, 17)`` at the ends, ``SQ(1, 19)`` in the middle.
    o : :py:`Out(stream.Signature(StructLayout(curve_shapes())))`
        Coefficients: ``SQ(0, 17)``, ``SQ(1, 17)``, ``SQ(1, 17)``.

    Source: docs/theory/interpolation.md#quadratic-normals; [T] figure 2.8.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        r"ends_(\d)": r"2·(N_l + N_r)_\1",
        r"four_middle_(\d)": r"4·N_m_\1",
        r"rise_(\d)": r"4·N_m_\1 − N_r_\1",
        r"three_left_(\d)": r"3·N_l_\1",
        r"g_sum_(\d)|g_(\d)": "G = 2·(N_l + N_r) − 4·N_m",
        r"p_sum_(\d)|p_(\d)": "P = 4·N_m − N_r − 3·N_l",
        "q_.*": "Q = N_l",
    }

    def __init__(self, model: GPQ | None = None):
        self.model = model or GPQ()
        super().__init__(
            data.StructLayout(
                {
                    "normal_left": normal_shape(),
                    "normal_middle": data.ArrayLayout(FixedShape(MiddleNormal.FORMAT), 3),
                    "normal_right": normal_shape(),
                }
            ),
            data.StructLayout(curve_shapes()),
            latency=3,
        )

    def datapath(self, m, operands):
        """First sums, second sums and saturation of each component."""
        register = self.register
        result = Signal(self.o.payload.shape())
        for c in range(3):
            left, right = operands.normal_left[c], operands.normal_right[c]
            middle = operands.normal_middle[c].scale(2)
            ends = register(m, (left + right).scale(1), f"ends_{c}")
            four_middle = register(m, middle, f"four_middle_{c}")
            rise = register(m, middle - right, f"rise_{c}")
            three_left = register(m, left.scale(1) + left, f"three_left_{c}")
            g = register(m, ends.extend(SQ(3, 17)) - four_middle, f"g_sum_{c}")
            p = register(m, rise - three_left, f"p_sum_{c}")
            q = left
            for stage in range(3):
                q = register(m, q, f"q_{c}_{stage}")
            m.d.comb += [
                result.g[c].eq(register(m, g.saturate(GPQ.G_FORMAT), f"g_{c}")),
                result.p[c].eq(register(m, p.saturate(GPQ.P_FORMAT), f"p_{c}")),
                result.q[c].eq(q),
            ]
        return result
