"""Parts of streaming units: connections, outputs that wait, and the pipeline with one enable."""

from collections.abc import Mapping

from amaranth.hdl import (
    Cat,
    EnableInserter,
    Module,
    Mux,
    Shape,
    ShapeLike,
    Signal,
    Value,
    ValueCastable,
    ValueLike,
)
from amaranth.lib import fifo, stream, wiring
from amaranth.lib.wiring import In, Member, Out

from blysk.hdl.core.views import copy, require_same_shape

__all__ = [
    "FIFO_LATENCY",
    "SLICE_LATENCY",
    "PipelinedUnit",
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

_UNGROUPED, _GROUP = 36, 12
"""Pipelines of more stages than the first reduce their valid bits in groups of the second."""

SLICE_LATENCY = 1
"""Cycles that a payload takes through the register of `connect_slice`."""


def _require_payload(output: stream.Interface, payload: ValueLike) -> None:
    """Refuse a payload of another shape than the stream's; bits without a format pass."""
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

    This costs a register and a multiplexer for each bit of the payload, and no cycle: a beat is on the output
    on the cycle on which ``valid`` rises. The payload is held while it waits. Reset empties the spare
    register.

    A payload that *stands* is the same after the next ``advance``, and no payload follows it there. It needs
    neither the spare register nor the multiplexer.

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
        If the payload is a view, or a fixed-point value, of another shape than that of the stream.
    """
    _require_payload(output, payload)
    held, moves = Signal(name="held"), Signal(name="moves", init=1)
    shown = payload
    if not stands:
        spare = Signal(len(Value.cast(payload)), name="spare", reset_less=True)
        shown = Mux(held, spare, Value.cast(payload))
    m.d.comb += [output.valid.eq(held | valid), Value.cast(output.payload).eq(Value.cast(shown))]
    waits = output.valid & ~output.ready
    # Two registers: one drives all enables, the other one selects the payload.
    m.d.sync += [held.eq(waits), moves.eq(~waits)]
    if not stands:
        with m.If(moves):
            m.d.sync += spare.eq(Value.cast(payload))
    return moves


def stop_output(m: Module, output: stream.Interface, coming: ValueLike, payload: ValueLike) -> Value:
    """Drive a stream from registers that stop with every beat until it is accepted, for one cycle at least.

    For units whose beats are some cycles apart. It is `skid_buffer` without the spare register and its
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
    """Connect two streams through registers for two payloads; a payload takes `SLICE_LATENCY` cycles.

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
    # With one payload waiting beyond the register there is room for one more in it.
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
) -> Value:
    """Whether payloads are between two streams, because more went in than came out.

    Parameters
    ----------
    m : Module
        Module that gets the counter, of at most 1023.
    name : str
        Of the counter.
    source, sink : stream.Interface
        Streams at which payloads go in and come out.
    last : ValueLike
        Whether the outgoing beat is the last, or only, part of a payload.
    dropped : ValueLike
        Whether a payload ends between the two.
    """
    inside = Signal(10, name=f"{name}_inside")
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
        Its pixels, 0 or more.
    advance : Value
        Whether the counter moves.

    Returns
    -------
    active, ends : Signal
        ``active``: whether there is a pixel. ``ends``: whether the next span may begin, because there is no
        pixel or the last pixel. Both are registers.
    """
    active, ends = Signal(name="active"), Signal(name="ends", init=1)
    remaining = Signal(len(length), name="remaining")
    with m.If(advance):
        with m.If(ends):
            # By bits: a comparison is a chain of carries.
            m.d.sync += [active.eq(valid & length.any()), ends.eq(~(valid & length[1:].any()))]
            m.d.sync += remaining.eq(length)
        with m.Else():
            m.d.sync += [ends.eq(remaining == 2), remaining.eq(remaining - 1)]
    return active, ends


class PipelinedUnit(wiring.Component):
    """A unit with a fixed latency and initiation interval, moved on by one common enable.

    A beat is on the output ``latency`` cycles after it was accepted. If the output is stalled, the whole unit
    is disabled and holds its payloads (`skid_buffer`). This begins in the cycle after the first refused beat.
    While a beat is inside, the next is accepted a whole multiple of ``initiation_interval`` enabled cycles
    after it. In a *spaced* unit it is accepted any number of enabled cycles from ``initiation_interval`` on.
    ``i.ready`` and ``o.valid`` follow from the unit's registers alone. Reset empties the unit.

    A subclass describes its registers in `datapath`, as if they were enabled on every cycle. Control comes
    from the *stage* of a beat: `at` tells whether a beat was accepted a number of enabled cycles ago.

    Parameters
    ----------
    input_shape, output_shape : ShapeLike
        Payloads.
    latency : int
        Cycles from input to output, at least 1.
    initiation_interval : int
        Cycles from an input to the next. With 1, `datapath` gets the input, and registers it. With more, it
        gets a register that holds the input on stages 1 to ``initiation_interval``.
    constants : ShapeLike or None
        Shape of the port ``constants``: values that are constant while beats are inside. ``None``: no port.
    spaced : bool
        Whether the next beat may come at any distance from ``initiation_interval`` on.
    ports : mapping of str to Member, optional
        Further members, by name.
    skid : bool
        Whether a spare register holds a beat that is not accepted (`skid_buffer`). Without the spare register
        the unit is disabled while a beat is on the output, for one cycle at least (`stop_output`). So without
        stalls a beat comes every ``initiation_interval + 1`` cycles.
    stands : bool
        Whether the result of `datapath` stands for a cycle more, so that the skid buffer has no spare
        register. This needs an ``initiation_interval`` over 1.

    Members
    -------
    i : :py:`In(stream.Signature(input_shape))`
        Operands.
    o : :py:`Out(stream.Signature(output_shape))`
        Results.
    constants : :py:`In(constants)`
        Only if ``constants`` is given.

    Attributes
    ----------
    advance : Signal
        The common enable, from `elaborate` on, for logic of the unit outside its data path.
    latency, initiation_interval, skid, stands
        As given.
    """

    def __init__(
        self,
        input_shape: ShapeLike,
        output_shape: ShapeLike,
        *,
        latency: int,
        initiation_interval: int = 1,
        constants: ShapeLike | None = None,
        spaced: bool = False,
        ports: Mapping[str, Member] | None = None,
        skid: bool = True,
        stands: bool = False,
    ):
        if latency < 1 or initiation_interval < 1:
            raise ValueError("latency and initiation_interval must be at least 1")
        self.latency = latency
        self.initiation_interval = initiation_interval
        self._spaced, self.skid, self.stands = spaced, skid, stands
        if spaced and not skid:
            raise ValueError("a spaced unit needs its skid buffer")
        if stands and not (skid and initiation_interval > 1):
            raise ValueError("a result that stands needs a skid buffer and an interval over 1")
        members = {"i": In(stream.Signature(input_shape)), "o": Out(stream.Signature(output_shape))}
        if constants is not None:
            members["constants"] = In(constants)
        super().__init__(members | dict(ports or {}))

    def datapath(self, m: Module, operands):
        """Describe the registers in ``m`` and return the payload of the output, ``latency`` registers on."""
        raise NotImplementedError

    def at(self, stage: int) -> Value:
        """Whether a beat was taken in ``stage`` enabled cycles ago, 1 to ``latency``."""
        return self._stages[stage - 1]

    @staticmethod
    def register(m: Module, value, name: str, *, when: Value | None = None):
        """A register that takes ``value`` on every enabled cycle, or only while ``when`` is high, too.

        It holds data and has no reset; `at` tells which data counts. A multiplier's own registers can take
        its place.
        """
        register = Signal(value.shape(), name=name, reset_less=True)
        if when is None:
            m.d.sync += register.eq(value)
        else:
            with m.If(when):
                m.d.sync += register.eq(value)
        return register

    def elaborate(self, platform):
        """Build the control and put the data path under the common enable."""
        m = Module()
        self._stages = Signal(self.latency, name="stages")
        self.advance = advance = Signal(name="advance")
        accept = Signal()
        if self.initiation_interval == 1:
            m.d.comb += self.i.ready.eq(advance)
        else:
            schedule = self._wait if self._spaced else self._turn
            m.d.comb += self.i.ready.eq(schedule(m, advance, accept))
        m.d.comb += accept.eq(self.i.valid & self.i.ready)
        with m.If(advance):
            m.d.sync += self._stages.eq(Cat(accept, self._stages[:-1]))

        inner = Module()
        operands = self.i.payload
        if self.initiation_interval > 1:
            # An operand that is not valid has no stage.
            operands = self.register(inner, operands, "operands", when=self.i.ready)
        result = self.datapath(inner, operands)
        m.submodules.datapath = EnableInserter(advance)(inner)
        if self.skid:
            m.d.comb += advance.eq(skid_buffer(m, self.o, self._stages[-1], result, self.stands))
        else:
            before = self._stages[-2] if self.latency > 1 else accept
            m.d.comb += advance.eq(stop_output(m, self.o, before, result))
        return m

    def _wait(self, m: Module, advance: Value, accept: Value) -> Value:
        """Whether a beat may come, ``initiation_interval`` enabled cycles after the last beat or later.

        A register, computed a cycle ahead.
        """
        ready = Signal(name="ready", init=1)
        left = Signal(range(self.initiation_interval), name="left")
        following = Signal.like(left, name="following")
        m.d.comb += following.eq(
            Mux(accept, self.initiation_interval - 1, Mux((left != 0) & advance, left - 1, left))
        )
        waits = self.o.valid & ~self.o.ready
        m.d.sync += [left.eq(following), ready.eq(~waits & (following == 0))]
        return ready

    def _turn(self, m: Module, advance: Value, accept: Value) -> Value:
        """Whether a beat may come, as shared parts serve beats of several stages in fixed slots.

        A register, computed a cycle ahead.
        """
        ready, turn = Signal(name="ready", init=1), Signal(range(self.initiation_interval))
        # Whether a beat will be inside on the next cycle even if none comes on this one.
        stays, opens = Signal(name="stays"), Signal(name="opens")
        inside = Cat(accept, self._stages)[: self.latency - 1]
        if self.latency > _UNGROUPED:
            # By parts, each of which is worked out from the stages before its own.
            parts = [Signal(name=f"inside_{k}") for k in range(-(-(self.latency - 3) // _GROUP))]
            with m.If(advance):
                m.d.sync += [
                    part.eq(inside[1 + k * _GROUP : 1 + (k + 1) * _GROUP].any())
                    for k, part in enumerate(parts)
                ]
            inside = Cat(inside[:2], *parts)
        m.d.comb += opens.eq((turn == self.initiation_interval - 1) | ~(accept | stays))
        with m.If(advance):
            m.d.sync += [
                stays.eq(inside.any()),
                turn.eq(Mux(opens, 0, turn + 1)),
            ]
        if not self.skid:
            with m.If(advance):
                m.d.sync += ready.eq(opens)
            return ready & advance
        waits = self.o.valid & ~self.o.ready
        m.d.sync += ready.eq(~waits & Mux(advance, opens, turn == 0))
        return ready
