"""Streams through one register in place of two. Either the rate is half, or ready is combinational."""

from amaranth.hdl import Module, Shape, Signal, Value, ValueLike
from amaranth.lib import stream

from blysk.hdl.core.views import copy, require_same_shape

__all__ = ["connect_register", "hold_output"]


def connect_register(m: Module, name: str, source: stream.Interface, sink: stream.Interface) -> None:
    """Connect two streams through one register, which takes at most a payload in two cycles.

    The source's ready and the sink's valid depend on a register alone.

    Parameters
    ----------
    m, source, sink
        As for `connect`.
    name : str
        Common part of the registers' names.

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


def hold_output(m: Module, output: stream.Interface, valid: ValueLike, payload: ValueLike) -> Value:
    """Drive a stream from a register that keeps its payload until the sink takes the payload.

    Returns whether the register may change. This is `skid_buffer` without the spare register. So the result
    depends on the sink's ready of the same cycle. The parameters and errors are those of `skid_buffer`.
    """
    m.d.comb += [output.valid.eq(valid), copy(output.payload, payload, "payload")]
    return ~Value.cast(valid) | output.ready
