"""What every streaming unit shares: checked connections and the pipeline with one common enable."""

from amaranth.hdl import Cat, EnableInserter, Module, Mux, Shape, ShapeLike, Signal, Value
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from .fixed import FixedShape

__all__ = ["BUFFER_LATENCY", "PipelinedUnit", "connect", "connect_buffered", "require_same_shape"]

BUFFER_LATENCY = 2
"""Clocks that a payload takes through an empty buffer."""


def require_same_shape(a: ShapeLike, b: ShapeLike, path: str = "payload") -> None:
    """Refuse two payload shapes that differ in a field, a width, a sign or a fixed-point format.

    Amaranth compares payloads by width alone, so that a moved binary point would pass.

    Raises
    ------
    TypeError
        If the shapes differ, naming the field.
    """
    if isinstance(a, data.StructLayout) and isinstance(b, data.StructLayout):
        if list(a.members) != list(b.members):
            raise TypeError(
                f"{path} has fields {list(a.members)} on one side, {list(b.members)} on the other"
            )
        for name, shape in a.members.items():
            require_same_shape(shape, b.members[name], f"{path}.{name}")
    elif isinstance(a, data.ArrayLayout) and isinstance(b, data.ArrayLayout):
        if a.length != b.length:
            raise TypeError(f"{path} has {a.length} elements on one side, {b.length} on the other")
        require_same_shape(a.elem_shape, b.elem_shape, f"{path}[]")
    else:
        custom = (FixedShape, data.Layout)
        same = a == b if isinstance(a, custom) or isinstance(b, custom) else Shape.cast(a) == Shape.cast(b)
        if not same:
            raise TypeError(f"{path} is {a!r} on one side, {b!r} on the other")


def connect(m: Module, source: stream.Interface, sink: stream.Interface) -> None:
    """Connect two streams whose payloads have the same fields and formats.

    Parameters
    ----------
    m : Module
        Module that gets the connection.
    source : stream.Interface
        Stream that offers payloads (the output of a submodule, or the input of the enclosing component).
    sink : stream.Interface
        Stream that accepts them.

    Raises
    ------
    TypeError
        If the payloads differ in a field or in a fixed-point format.
    """
    require_same_shape(source.payload.shape(), sink.payload.shape())
    m.d.comb += [
        Value.cast(sink.payload).eq(Value.cast(source.payload)),
        sink.valid.eq(source.valid),
        source.ready.eq(sink.ready),
    ]


def connect_buffered(
    m: Module, name: str, source: stream.Interface, sink: stream.Interface, depth: int
) -> None:
    """Connect two streams through a FIFO, which ends the combinational path of readies backwards.

    A payload takes `BUFFER_LATENCY` clocks through the empty FIFO.

    Parameters
    ----------
    m : Module
        Module that gets the FIFO as a submodule ``name``.
    source, sink : stream.Interface
        As for `connect`.
    depth : int
        Payloads that the FIFO holds, at least 3.

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


class PipelinedUnit(wiring.Component):
    """A unit with a fixed latency and initiation interval, moved on by one common enable.

    A beat taken in on one clock is offered on the output ``latency`` clocks later, unless the output waits:
    then the whole unit stands still and holds its payload. As long as a beat is inside, the next is taken
    in a whole multiple of ``initiation_interval`` clocks after it, not counting those of standing still.
    ``o.valid`` is a register; ``i.ready`` follows from ``o.ready`` and the unit's own state. Reset empties
    the unit.

    A subclass describes its registers in `datapath`, as if they moved on every clock. Control comes from the
    *age* of a beat: `at` tells whether a beat was taken in so many enabled clocks ago.

    Parameters
    ----------
    input_shape, output_shape : ShapeLike
        Payloads.
    latency : int
        Clocks from input to output, at least 1.
    initiation_interval : int
        Distance in clocks of two inputs. With 1, `datapath` gets the input itself, and registers it;
        with more, it gets a register that holds the input for ages 1 to ``initiation_interval``.
    constants : ShapeLike or None
        Shape of the port ``constants``: values that stay while beats are inside. ``None``: no such port.

    Members
    -------
    i : :py:`In(stream.Signature(input_shape))`
        Operands.
    o : :py:`Out(stream.Signature(output_shape))`
        Results.
    constants : :py:`In(constants)`
        Only where asked for.
    """

    def __init__(
        self,
        input_shape: ShapeLike,
        output_shape: ShapeLike,
        *,
        latency: int,
        initiation_interval: int = 1,
        constants: ShapeLike | None = None,
    ):
        if latency < 1 or initiation_interval < 1:
            raise ValueError("latency and initiation_interval must be at least 1")
        self.latency = latency
        self.initiation_interval = initiation_interval
        members = {"i": In(stream.Signature(input_shape)), "o": Out(stream.Signature(output_shape))}
        if constants is not None:
            members["constants"] = In(constants)
        super().__init__(members)

    def datapath(self, m: Module, operands):
        """Describe the registers in ``m`` and return the payload of the output, ``latency`` registers on."""
        raise NotImplementedError

    def at(self, age: int) -> Value:
        """Whether a beat was taken in ``age`` enabled clocks ago, 1 to ``latency``."""
        return self._ages[age - 1]

    @staticmethod
    def register(m: Module, value, name: str, *, when: Value | None = None):
        """A register that takes ``value`` on every enabled clock, or only ``when`` told."""
        register = Signal(value.shape(), name=name)
        if when is None:
            m.d.sync += register.eq(value)
        else:
            with m.If(when):
                m.d.sync += register.eq(value)
        return register

    def elaborate(self, platform):
        """Build the control and put the data path under the common enable."""
        m = Module()
        self._ages = Signal(self.latency, name="ages")
        advance = Signal()
        accept = Signal()
        m.d.comb += [
            self.o.valid.eq(self._ages[-1]),
            advance.eq(~self.o.valid | self.o.ready),
        ]
        if self.initiation_interval == 1:
            m.d.comb += self.i.ready.eq(advance)
        else:
            # A shared part serves beats of several ages, at turns fixed by their distance.
            turn = Signal(range(self.initiation_interval))
            empty = ~self._ages.any()
            m.d.comb += self.i.ready.eq(advance & (empty | (turn == 0)))
            with m.If(empty & accept):
                m.d.sync += turn.eq(1)
            with m.Elif(advance):
                m.d.sync += turn.eq(Mux(turn == self.initiation_interval - 1, 0, turn + 1))
        m.d.comb += accept.eq(self.i.valid & self.i.ready)
        with m.If(advance):
            m.d.sync += self._ages.eq(Cat(accept, self._ages[:-1]))

        inner = Module()
        operands = self.i.payload
        if self.initiation_interval > 1:
            operands = self.register(inner, operands, "operands", when=accept)
        result = self.datapath(inner, operands)
        m.submodules.datapath = EnableInserter(advance)(inner)
        m.d.comb += self.o.payload.eq(result)
        return m
