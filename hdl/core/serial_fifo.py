"""FIFO whose payloads go through a memory in parts: many wide payloads in a single block RAM."""

from amaranth.hdl import Array, Cat, Module, Mux, Shape, Signal, Value
from amaranth.lib import stream
from amaranth.lib.memory import Memory

from blysk.golden.video.mesh_memory import BLOCK_BITS
from blysk.hdl.core.memory import registered_read
from blysk.hdl.core.views import require_same_shape

__all__ = ["connect_serial_fifo"]


def connect_serial_fifo(
    m: Module, name: str, source: stream.Interface, sink: stream.Interface, words: int, bits: int = BLOCK_BITS
) -> None:
    """Connect two streams through a FIFO whose payloads are written and read in parts, one a cycle.

    A payload of p parts is accepted p + 1 cycles after another or later. It is offered p + 2 cycles after
    another was taken or later. So the FIFO serves streams whose payloads come seldom. A payload takes 2 p + 2
    cycles through the empty FIFO. The source's ready and the sink's valid depend on registers alone.

    Parameters
    ----------
    m, name, source, sink
        As for `connect_fifo`.
    words : int
        Words of the memory, a power of two, for two payloads or more.
    bits : int
        Bits of a word, fewer than those of a payload.

    Raises
    ------
    TypeError
        As `connect_fifo`.
    ValueError
        If the number of words is no power of two or is too small, or a payload has a single part.
    """
    require_same_shape(source.payload.shape(), sink.payload.shape())
    width = Shape.cast(source.payload.shape()).width
    parts = -(-width // bits)
    if parts < 2:
        raise ValueError(f"a payload must have over {bits} bits, not {width}")
    room = words // parts
    if words & (words - 1) or room < 2:
        raise ValueError(f"words must be a power of two from {2 * parts} on, not {words}")
    m.submodules[name] = memory = Memory(shape=bits, depth=words, init=[])
    port = memory.write_port()
    payload = Signal(width, name=f"{name}_payload", reset_less=True)
    writes, free = Signal(name=f"{name}_writes"), Signal(name=f"{name}_free", init=1)
    turn, step = Signal(range(parts), name=f"{name}_turn"), Signal(range(parts + 1), name=f"{name}_step")
    # Whole payloads in the memory. A payload counts until its last word is read.
    level, there = Signal(range(room + 1), name=f"{name}_level"), Signal(name=f"{name}_there")
    came, gone = Signal(name=f"{name}_came"), Signal(name=f"{name}_gone")
    m.d.comb += [
        source.ready.eq(free & ~writes),
        port.data.eq(Array(payload[k * bits : (k + 1) * bits] for k in range(parts))[turn]),
        port.en.eq(writes),
        came.eq(writes & (turn == parts - 1)),
    ]
    with m.If(writes):
        m.d.sync += [turn.eq(Mux(came, 0, turn + 1)), port.addr.eq(port.addr + 1), writes.eq(~came)]
    with m.Else():
        m.d.sync += [payload.eq(source.payload), writes.eq(source.valid & free)]
    # ``free`` is a cycle late, so it keeps a place for the payload that was just written.
    m.d.sync += [level.eq(level + came - gone), free.eq(level < room - 1)]

    address = Signal.like(port.addr, name=f"{name}_address")
    word, moves = registered_read(m, memory, address, ~there & level.any(), port)
    others = Signal((parts - 1) * bits, name=f"{name}_others", reset_less=True)
    # A word is read on each step but the last, which takes the last word into its register.
    ends = step == parts
    m.d.comb += [
        gone.eq(moves & ends),
        Value.cast(sink.payload).eq(Cat(others, word)),
        sink.valid.eq(there),
    ]
    with m.If(moves):
        m.d.sync += [
            others.eq(Cat(others, word)[bits:]),
            address.eq(Mux(ends, address, address + 1)),
            step.eq(Mux(ends, 0, step + 1)),
            there.eq(ends),
        ]
    with m.Elif(sink.ready):
        m.d.sync += there.eq(0)
