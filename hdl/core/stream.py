"""Parts of streaming units: connections, outputs that wait, and counts of pixels."""

from amaranth.hdl import (
    Module,
    Mux,
    Shape,
    Signal,
    Value,
    ValueCastable,
    ValueLike,
)
from amaranth.lib import fifo, stream

from blysk.hdl.core.views import copy, require_same_shape

__all__ = [
    "FIFO_LATENCY",
    "SLICE_LATENCY",
    "connect",
    "connect_fifo",
    "connect_slice",
    "count_down",
    "moving",
    "skid_buffer",
    "stop_output",
]

FIFO_LATENCY = 2
"""Cycles that a payload takes through the empty FIFO of `connect_fifo`."""

SLICE_LATENCY = 1
"""Cycles that a payload takes through the register of `connect_slice`."""


def _require_payload(output: stream.Interface, payload: ValueLike) -> None:
    """Refuse a payload of another shape than the stream's. Bits without a format are accepted."""
    if isinstance(payload, ValueCastable):
        require_same_shape(payload.shape(), output.payload.shape())


def connect(m: Module, source: stream.Interface, sink: stream.Interface) -> None:
    """Connect two streams whose payloads have the same fields and formats.

    Parameters
    ----------
    m : Module
        Module that gets the connection.
    source : stream.Interface
        Stream that gives payloads (the output of a submodule, or the input of the enclosing component).
    sink : stream.Interface
        Stream that accepts them.

    Raises
    ------
    TypeError
        If the payloads differ in a field or in a fixed-point format.
    """
    m.d.comb += [
        copy(sink.payload, source.payload, "payload"),
        sink.valid.eq(source.valid),
        source.ready.eq(sink.ready),
    ]


def connect_fifo(
    m: Module, name: str, source: stream.Interface, sink: stream.Interface, depth: int
) -> fifo.SyncFIFOBuffered:
    """Connect two streams through a FIFO, which takes payloads in while the sink waits.

    A payload takes `FIFO_LATENCY` cycles through the empty FIFO.

    Parameters
    ----------
    m : Module
        Module that gets the FIFO as a submodule ``name``.
    source, sink : stream.Interface
        As for `connect`.
    depth : int
        Payloads that the FIFO holds, at least 3.

    Returns
    -------
    SyncFIFOBuffered
        The FIFO.

    Raises
    ------
    TypeError
        If the payloads differ in a field or in a fixed-point format.
    """
    require_same_shape(source.payload.shape(), sink.payload.shape())
    width = Shape.cast(source.payload.shape()).width
    m.submodules[name] = buffer = fifo.SyncFIFOBuffered(width=width, depth=depth)
    m.d.comb += [
        buffer.w_data.eq(source.payload),
        buffer.w_en.eq(source.valid),
        source.ready.eq(buffer.w_rdy),
        Value.cast(sink.payload).eq(buffer.r_data),
        sink.valid.eq(buffer.r_rdy),
        buffer.r_en.eq(sink.ready),
    ]
    return buffer


def skid_buffer(
    m: Module, output: stream.Interface, valid: ValueLike, payload: ValueLike, stands: bool = False
) -> Value:
    """Skid buffer: drive a stream from registers, with a spare register for a beat that is not accepted.

    The result, *advance*, tells whether the registers of ``valid`` and ``payload`` take their next values on
    this cycle. It is a register. So in a chain of any length no path leads from the ready of a unit to the
    ready of the unit before. A beat that is not accepted on its first cycle moves into the spare register.
    The beat behind it moves into the output registers and waits there.

    This costs a register and a multiplexer for each bit of the payload. It costs no cycle: a beat is on the
    output on the cycle on which ``valid`` rises. The payload is held while it waits. Reset empties the spare
    register.

    A payload that *stands* stays the same at the next ``advance``, and no payload follows it there. Then the
    spare register and the multiplexer are not needed.

    Parameters
    ----------
    m : Module
        Module that gets the register.
    output : stream.Interface
        Stream to drive.
    valid : ValueLike
        Whether there is a payload. This is a register that changes only while ``advance`` is high.
    payload : ValueLike
        The payload, a register that changes only while ``advance`` is high.
    stands : bool
        Whether payloads stand.

    Returns
    -------
    Value
        ``advance``, one bit.

    Raises
    ------
    TypeError
        If the payload is a view or a fixed-point value and has another shape than the stream.
    """
    _require_payload(output, payload)
    held, moves = Signal(name="held"), Signal(name="moves", init=1)
    shown = payload
    if not stands:
        spare = Signal(len(Value.cast(payload)), name="spare", reset_less=True)
        shown = Mux(held, spare, Value.cast(payload))
    m.d.comb += [output.valid.eq(held | valid), Value.cast(output.payload).eq(shown)]
    waits = output.valid & ~output.ready
    # There are two registers: one drives all enables, and the other selects the payload.
    m.d.sync += [held.eq(waits), moves.eq(~waits)]
    if not stands:
        with m.If(moves):
            m.d.sync += spare.eq(Value.cast(payload))
    return moves


def stop_output(m: Module, output: stream.Interface, coming: ValueLike, payload: ValueLike) -> Value:
    """Drive a stream from registers that stop at every beat until it is accepted, at least for one cycle.

    Use it for units whose beats are some cycles apart. It is `skid_buffer` without the spare register and its
    multiplexer.

    Parameters
    ----------
    m : Module
        Module that gets the register.
    output : stream.Interface
        Stream to drive.
    coming : ValueLike
        Whether there is a payload after this cycle, if registers take their next values on this cycle.
    payload : ValueLike
        The payload, a register that changes only while the result is high.

    Returns
    -------
    Value
        Whether registers take their next values. This is a register.

    Raises
    ------
    TypeError
        As for `skid_buffer`.
    """
    _require_payload(output, payload)
    moves = Signal(name="moves", init=1)
    m.d.sync += moves.eq(Mux(moves, ~Value.cast(coming), output.ready))
    m.d.comb += [output.valid.eq(~moves), Value.cast(output.payload).eq(payload)]
    return moves


def connect_slice(m: Module, source: stream.Interface, sink: stream.Interface) -> None:
    """Connect two streams through registers for two payloads. A payload takes `SLICE_LATENCY` cycles.

    The source's ready follows from registers alone.

    Parameters
    ----------
    m, source, sink
        As for `connect`.

    Raises
    ------
    TypeError
        If the payloads differ in a field or in a fixed-point format.
    """
    require_same_shape(source.payload.shape(), sink.payload.shape())
    valid = Signal(name="valid")
    payload = Signal(Shape.cast(source.payload.shape()).width, name="payload", reset_less=True)
    # If one payload waits behind the register, the register has room for another payload.
    accepts = skid_buffer(m, sink, valid, payload) | ~valid
    m.d.comb += source.ready.eq(accepts)
    with m.If(accepts):
        m.d.sync += [valid.eq(source.valid), payload.eq(source.payload)]


def moving(
    m: Module,
    name: str,
    source: stream.Interface,
    sink: stream.Interface,
    last: ValueLike = 1,
    dropped: ValueLike = 0,
    most: int = 1023,
) -> Value:
    """Whether payloads are between two streams: whether more payloads went in than came out.

    Parameters
    ----------
    m : Module
        Module that gets the counter.
    name : str
        First part of the counter's name.
    source, sink : stream.Interface
        Streams at which payloads go in and come out.
    last : ValueLike
        Whether the outgoing beat is the last, or only, part of a payload.
    dropped : ValueLike
        Whether a payload ends between the two streams.
    most : int
        The counter counts at least so many payloads.
    """
    inside = Signal(range(most + 1), name=f"{name}_inside")
    enters, leaves = source.valid & source.ready, sink.valid & sink.ready & last
    m.d.sync += inside.eq(inside + enters - leaves - dropped)
    return inside.any()


def count_down(m: Module, valid: Value, length: Value, advance: Value) -> tuple[Signal, Signal]:
    """Count the pixels of spans, one on each cycle on which ``advance`` is high.

    A span is taken in while ``valid & advance & ends`` is high.

    Parameters
    ----------
    m : Module
        Module that gets the counter.
    valid : Value
        Whether there is a next span.
    length : Value
        Number of the span's pixels, 0 or more.
    advance : Value
        Whether the counter moves.

    Returns
    -------
    active, ends : Signal
        ``active``: whether there is a pixel. ``ends``: whether the next span may begin, because there is no
        pixel, or the pixel is the last. Both are registers.
    """
    active, ends = Signal(name="active"), Signal(name="ends", init=1)
    remaining = Signal(len(length), name="remaining")
    with m.If(advance):
        with m.If(ends):
            # Tested by bits, because a comparison would be a chain of carries.
            m.d.sync += [active.eq(valid & length.any()), ends.eq(~(valid & length[1:].any()))]
            m.d.sync += remaining.eq(length)
        with m.Else():
            m.d.sync += [ends.eq(remaining == 2), remaining.eq(remaining - 1)]
    return active, ends
