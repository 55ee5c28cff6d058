"""Connection of two streams by one register: half the rate of a register slice, and half its registers."""

from amaranth.hdl import Module, Shape, Signal, Value
from amaranth.lib import stream

from blysk.hdl.core.stream import require_same_shape

__all__ = ["connect_register"]


def connect_register(m: Module, name: str, source: stream.Interface, sink: stream.Interface) -> None:
    """Connect two streams through one register, which takes a payload each two cycles at most.

    The source's ready and the sink's valid follow from a register.

    Parameters
    ----------
    m, source, sink
        As for `connect`.
    name : str
        Of the registers.

    Raises
    ------
    TypeError
        If the payloads differ in a field or in a fixed-point format.
    """
    require_same_shape(source.payload.shape(), sink.payload.shape())
    full = Signal(name=f"{name}_full")
    payload = Signal(Shape.cast(source.payload.shape()).width, name=name, reset_less=True)
    m.d.comb += [
        source.ready.eq(~full),
        sink.valid.eq(full),
        Value.cast(sink.payload).eq(payload),
    ]
    with m.If(~full):
        m.d.sync += [full.eq(source.valid), payload.eq(source.payload)]
    with m.Elif(sink.ready):
        m.d.sync += full.eq(0)
