"""Short stubs for units that are proved elsewhere, for proofs of larger units."""

from collections.abc import Callable, Iterable

from amaranth.hdl import Signal, Value

from blysk.hdl.core.pipelined_unit import PipelinedUnit

__all__ = ["short", "short_wave"]


def short(
    unit: type[PipelinedUnit],
    hand_on: Callable[..., Iterable],
    latency: int = 2,
    initiation_interval: int | None = None,
) -> type[PipelinedUnit]:
    """A class with the streams and control of a unit, another latency, and a data path that passes bits on.

    `test_units` proves for every `PipelinedUnit` that beats leave in order and once each, ``latency`` cycles
    later.

    Parameters
    ----------
    unit : type
        The unit's class.
    hand_on : callable
        Takes operands and result, and gives assignments to some bits of the result. The other bits are 0.
    latency : int
        Cycles from input to output; at least 2 if the initiation interval is over 1.
    initiation_interval : int or None
        Initiation interval. ``None``: that of the unit.
    """

    class Short(unit):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            self.latency = latency
            self.initiation_interval = initiation_interval or self.initiation_interval

        elaborate = PipelinedUnit.elaborate

        def datapath(self, m, operands):
            result = Signal(self.o.payload.shape())
            m.d.comb += list(hand_on(operands, result))
            for stage in range(self.latency - (self.initiation_interval > 1)):
                result = self.register(m, result, f"stage_{stage}")
            return result

    return Short


def short_wave(hand_on: Callable[[Value, Value], Value]) -> Callable:
    """A stub for stages 2 to the last of the highlight-cosine unit: registers for a code.

    Parameters
    ----------
    hand_on : callable
        Takes theta and cos beta, and gives the code of the result.
    """

    def wave(unit, m, theta, cos_beta):
        result = Signal(unit.o.payload.shape())
        m.d.comb += Value.cast(result).eq(hand_on(theta, cos_beta))
        for stage in range(2, unit.latency + 1):
            result = PipelinedUnit.register(m, result, f"stage_{stage}")
        return result

    return wave
