"""Short stand-ins for proven units, so that what is made of them can be proved."""

from collections.abc import Callable, Iterable

from amaranth.hdl import Signal

from hdl.stream import PipelinedUnit

__all__ = ["short"]


def short(
    unit: type[PipelinedUnit],
    hand_on: Callable[..., Iterable],
    latency: int = 2,
    initiation_interval: int | None = None,
) -> type[PipelinedUnit]:
    """A class with a unit's streams and control, a latency of its own, and a data path that hands bits on.

    `test_units` proves of every `PipelinedUnit` that beats leave in order, each once, ``latency`` clocks on.

    Parameters
    ----------
    unit : type
        The unit's class.
    hand_on : callable
        Of operands and result: assignments to some bits of the result; the others are 0.
    latency : int
        Clocks from input to output, at least 2 where the interval is over 1.
    initiation_interval : int or None
        ``None``: the unit's.
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
