"""Diffuse unit: the Lambert term of one light."""

from blysk.golden.lighting.diffuse import Diffuse
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit

__all__ = ["DiffuseUnit"]


class DiffuseUnit(PipelinedUnit):
    """Diffuse term of one light. `Diffuse` is the bit-accurate model.

    The term is ``max(N . L, 0)``, rounded half up to ``UQ(0, 17)`` and saturated. The latency is ``latency``
    cycles: one for rounding, one for saturation, and a delay for the rest. If the initiation interval is over
    1, one more cycle takes the operand in. With the delay the term leaves together with the term of a unit
    that works on the same beat and takes more cycles. If the interval is 1, the delay is a memory of look-up
    tables. Else it is a register for each interval. The unit has no multipliers.

    Parameters
    ----------
    model : Diffuse
        Bit-accurate model: format of the operand.
    latency : int or None
        At least 2, or 3 if the initiation interval is over 1. ``None``: the least latency.
    initiation_interval : int
        Cycles from an input to the next, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(model.operand_format))`
        ``N . L`` of two unit vectors.
    o : :py:`Out(stream.Signature(UQ(0, 17)))`
        Diffuse term.

    Raises
    ------
    ValueError
        If the latency is too short or the interval under 1.

    Source: docs/theory/models.md#lighting; [B] 4, [T] 6.
    """

    def __init__(
        self,
        model: Diffuse | None = None,
        *,
        latency: int | None = None,
        initiation_interval: int = 1,
    ):
        self.model = model or Diffuse()
        self._graph = graph = Dataflow(initiation_interval, memories=True)
        operand = graph.input("operand", lambda operand: operand)
        rounded = graph.register("rounded", lambda cosine: cosine.round_half_up(17), operand)
        self._result = graph.register(
            "result", lambda rounded: rounded.saturate(Diffuse.RESULT_FORMAT), rounded
        )
        least = self._result.stage
        if latency is not None and latency < least:
            raise ValueError(f"latency must be at least {least}, not {latency}")
        super().__init__(
            FixedShape(self.model.operand_format),
            FixedShape(Diffuse.RESULT_FORMAT),
            latency=latency or least,
            initiation_interval=initiation_interval,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph. The result is read at the stage at which the beat leaves."""
        return self._graph.build(m, self, operands)(self._result, self.latency)
