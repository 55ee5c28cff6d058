"""Diffuse unit: the Lambert term of one light."""

from golden.diffuse import Diffuse

from .fixed import FixedShape
from .stream import PipelinedUnit

__all__ = ["DiffuseUnit"]


class DiffuseUnit(PipelinedUnit):
    """``max(N . L, 0)`` rounded half up to ``UQ(0, 17)``, saturated; `golden.diffuse.Diffuse` is its twin.

    The latency is ``latency`` clocks, of which 2 work (rounding, saturation) and the rest wait, so that the
    term leaves together with that of a longer unit beside it. The initiation interval is 1. No multipliers.

    Parameters
    ----------
    latency : int
        At least 2.

    Members
    -------
    i : :py:`In(stream.Signature(SQ(4, 34)))`
        ``N . L`` of two unit vectors.
    o : :py:`Out(stream.Signature(UQ(0, 17)))`
        Diffuse term.

    Source: [B] 4, [T] 6.
    """

    def __init__(self, latency: int = 2):
        if latency < 2:
            raise ValueError("latency must be at least 2")
        super().__init__(
            FixedShape(Diffuse.OPERAND_FORMAT), FixedShape(Diffuse.RESULT_FORMAT), latency=latency
        )

    def datapath(self, m, operands):
        """Rounding, saturation, waiting."""
        rounded = self.register(m, operands.round_half_up(17), "rounded")
        result = rounded.saturate(Diffuse.RESULT_FORMAT)
        for stage in range(2, self.latency + 1):
            result = self.register(m, result, f"result_{stage}")
        return result
