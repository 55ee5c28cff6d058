"""FIFOs and delays in memories, and reads through the output register of an FPGA's memory block.

Some FPGAs and chips read a memory at a clock edge only. Within `clocked_reads` the functions of this file
make these reads. Each word comes in the same cycle as without `clocked_reads`.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from amaranth.hdl import Cat, Module, Mux, Shape, Signal, Value, ValueLike
from amaranth.lib import stream
from amaranth.lib.memory import Memory, ReadPort, WritePort

from blysk.hdl.core.views import of_shape, require_same_shape

__all__ = [
    "HEADED_FIFO_LATENCY",
    "LATE_FIFO_LATENCY",
    "LUT_WORDS",
    "NEEDS_ZEROS",
    "UNCOUNTED",
    "clocked_reads",
    "connect_headed_fifo",
    "connect_late_fifo",
    "connect_wide_fifo",
    "delayed",
    "first_in_turn",
    "pass_beside",
    "read_address",
    "read_domain",
    "read_options",
    "registered_read",
    "turn_of",
    "word_in_register",
    "words_in_turn",
]

HEADED_FIFO_LATENCY = 2
"""Cycles that a payload takes through the empty FIFO of `connect_headed_fifo`."""

LATE_FIFO_LATENCY = 4
"""Cycles that a payload takes through the empty FIFO of `connect_late_fifo`."""

LUT_WORDS = 16
"""Words of a memory in the look-up tables of an FPGA. More words take several memories, and multiplexers."""

UNCOUNTED = 3
"""Largest number of payloads inside `connect_late_fifo` that its level does not count yet."""

_CLOCKED: ContextVar[bool] = ContextVar("clocked", default=False)


NEEDS_ZEROS = {"needs_zeros": 1}
"""Attribute of a memory whose words are read before they are written. Verilog keeps their initial zeros."""


@contextmanager
def clocked_reads(wanted: bool = True) -> Iterator[None]:
    """Within the block, memories of components that are elaborated are read at clock edges.

    Parameters
    ----------
    wanted : bool
        Whether they are. If not, nothing changes.
    """
    token = _CLOCKED.set(wanted)
    try:
        yield
    finally:
        _CLOCKED.reset(token)


def read_options(memory: Memory) -> dict[str, Any]:
    """Options of a read port for an address in a register, see `read_address`.

    A clocked port gives a word that is written at its edge. ``memory`` has its write ports already.
    """
    return {"transparent_for": memory.write_ports} if _CLOCKED.get() else {"domain": read_domain()}


def read_address(address: Value, following: Value) -> Value:
    """Address of a port with `read_options`: a register, or its next value, which a clocked read needs."""
    return following[: len(address)] if _CLOCKED.get() else address


def read_domain() -> str:
    """Domain of a read port whose word goes into a register, see `word_in_register`."""
    return "sync" if _CLOCKED.get() else "comb"


def word_in_register(m: Module, port: ReadPort, wanted: Value, register: Callable[[Value], Value]) -> Value:
    """Word of a read port of `read_domain`, in the cycle after its address.

    Parameters
    ----------
    m : Module
        Module of the memory.
    port : ReadPort
        The port. The caller connects its address.
    wanted : Value
        Whether a new word is taken.
    register : callable
        Makes a register of the word, with the enable ``wanted``. A clocked port is the register itself.
    """
    if not _CLOCKED.get():
        return register(port.data)
    m.d.comb += port.en.eq(wanted)
    return port.data


def words_in_turn(m: Module, name: str, word: ValueLike, written: Value, depth: int) -> Memory:
    """Memory whose words come one after the other, at rising addresses. The caller adds the read ports.

    Parameters
    ----------
    m : Module
        Module that gets the memory as a submodule ``name``.
    word : ValueLike
        The written word.
    written : Value
        Whether the word is written.
    depth : int
        Largest number of words inside, a power of two.
    """
    word = Value.cast(word)
    m.submodules[name] = memory = Memory(shape=len(word), depth=depth, init=[])
    write = memory.write_port()
    m.d.comb += [write.data.eq(word), write.en.eq(written)]
    with m.If(written):
        m.d.sync += write.addr.eq(write.addr + 1)
    return memory


def first_in_turn(m: Module, memory: Memory, taken: Value) -> Value:
    """The first word of `words_in_turn` that has not been taken.

    Parameters
    ----------
    m : Module
        Module of the memory.
    memory : Memory
        The memory, with its write port.
    taken : Value
        Whether the first word is taken.
    """
    read = memory.read_port(**read_options(memory))
    if not _CLOCKED.get():
        with m.If(taken):
            m.d.sync += read.addr.eq(read.addr + 1)
        return read.data
    address = Signal.like(read.addr, name="address")
    m.d.comb += read.addr.eq(address + taken)
    m.d.sync += address.eq(read.addr)
    return read.data


def pass_beside(m: Module, name: str, word: ValueLike, written: Value, taken: Value, depth: int) -> ValueLike:
    """Words that wait beside a unit while its beats are inside. They keep their order and have no handshakes.

    The words are in a memory with a write and a read address. The unit's own handshakes tell when a word is
    there, so no level is counted.

    Parameters
    ----------
    m : Module
        Module that gets the memory as a submodule ``name``.
    word : ValueLike
        Word of the incoming beat.
    written, taken : Value
        Whether a beat enters the unit, and whether a beat leaves the unit. A beat is inside for two cycles or
        more.
    depth : int
        Largest number of beats inside.

    Returns
    -------
    ValueLike
        Word of the beat that leaves next, in the shape of ``word``. It is valid while a beat is inside.
    """
    bits = (depth - 1).bit_length()
    words = words_in_turn(m, name, word, written, 1 << bits)
    first, second = (words.read_port(**read_options(words)) for _ in range(2))
    address, following = Signal(bits, name=f"{name}_address"), Signal(bits, name=f"{name}_following", init=1)
    leaves = Signal(len(Value.cast(word)), name=f"{name}_leaves", reset_less=True)
    m.d.comb += [
        first.addr.eq(read_address(address, Mux(taken, following, address))),
        second.addr.eq(read_address(following, following + taken)),
    ]
    with m.If(taken):
        m.d.sync += [address.eq(following), following.eq(following + 1)]
    # ``taken`` comes late in a cycle, so both words that can be next are read before.
    m.d.sync += leaves.eq(Mux(taken, second.data, first.data))
    return of_shape(word, leaves)


def registered_read(
    m: Module,
    memory: Memory,
    address: Value,
    wanted: Value,
    write: WritePort | None = None,
) -> tuple[Signal, Value]:
    """Word of a memory, two cycles after its address. Both registers have the same enable.

    A memory gives its word late in a cycle, and the register behind it gives the word early. FPGAs differ in
    the word that they read while the same address is written. On these cycles both registers keep their
    words. So no logic is needed between the memory and the register.

    Parameters
    ----------
    m : Module
        Module that gets the registers. The memory is its submodule.
    memory : Memory
        The memory.
    address : Value
        Address of the word.
    wanted : Value
        Whether the registers should take new words.
    write : WritePort or None
        Port that writes the memory. ``None``: a ROM.

    Returns
    -------
    word : Signal
        The word.
    moves : Value
        Whether the registers take new words.
    """
    port = memory.read_port(domain=read_domain())
    moves = wanted if write is None else wanted & ~(write.en & (write.addr == address))
    read, word = (Signal(len(port.data), name=name, reset_less=True) for name in ("read", "word"))
    m.d.comb += port.addr.eq(address)
    if _CLOCKED.get():
        m.d.comb += [port.en.eq(moves), read.eq(port.data)]
        with m.If(moves):
            m.d.sync += word.eq(read)
        return word, moves
    with m.If(moves):
        m.d.sync += [read.eq(port.data), word.eq(read)]
    return word, moves


def turn_of(m: Module, cycles: int) -> Signal:
    """Address for `delayed`, which counts from 0 to ``cycles - 2``. Words with the same delay share it."""
    turn = Signal(range(cycles - 1), name=f"turn_{cycles}")
    m.d.sync += turn.eq(Mux(turn == cycles - 2, 0, turn + 1))
    return turn


def delayed(m: Module, name: str, value: Value, cycles: int, turn: Value) -> Signal:
    """A word delayed by ``cycles``, in a memory of look-up tables and a register behind the memory.

    Only enabled cycles of the module count. On each enabled cycle the memory is read at an address, and then
    written at the same address. After a reset, words from before the reset come first, in any order.

    Parameters
    ----------
    m : Module
        Module that gets the register. The memory is its submodule.
    name : str
        Name of the memory and of the register.
    value : Value
        The word, of any shape.
    cycles : int
        At least 3.
    turn : Value
        Address from `turn_of` with the same number of cycles, in the same module.

    Returns
    -------
    Signal
        The word, of the same shape.
    """
    m.submodules[name] = memory = Memory(shape=len(Value.cast(value)), depth=cycles - 1, init=[])
    word = Signal(value.shape(), name=name, reset_less=True)
    write, read = memory.write_port(), memory.read_port(domain=read_domain())
    m.d.comb += [
        write.addr.eq(turn),
        write.data.eq(value),
        write.en.eq(1),
        read.addr.eq(turn),
    ]
    if _CLOCKED.get():
        m.d.comb += Value.cast(word).eq(read.data)
    else:
        m.d.sync += Value.cast(word).eq(read.data)
    return word


def connect_late_fifo(
    m: Module, name: str, source: stream.Interface, sink: stream.Interface, depth: int
) -> Value:
    """Connect two streams through a FIFO in a memory, between registers.

    A register before the memory completes the source's handshake. Behind the memory are the registers of
    `registered_read`. The source's ready is a register that depends on the FIFO's level alone. `UNCOUNTED`
    places of the depth are reserved for payloads that the level does not count yet. A payload takes
    `LATE_FIFO_LATENCY` cycles through the empty FIFO.

    Parameters and errors are those of `connect_fifo`. Two payloads more than the depth can wait behind the
    memory.

    Returns
    -------
    Value
        Whether no payload is inside.

    Raises
    ------
    ValueError
        If the depth is `UNCOUNTED` or less. The FIFO would never have room.
    """
    if depth <= UNCOUNTED:
        raise ValueError(f"depth must be over {UNCOUNTED}, not {depth}")
    require_same_shape(source.payload.shape(), sink.payload.shape())
    width = Shape.cast(source.payload.shape()).width
    payload = Signal(width, name=f"{name}_payload", reset_less=True)
    written, room = Signal(name=f"{name}_written"), Signal(name=f"{name}_room", init=1)
    level = Signal(range(depth + 1), name=f"{name}_level")
    # The level does not count ``came`` and ``gone`` yet. ``one``: one payload waits in the memory. ``more``:
    # two or more payloads wait there.
    came, gone, one, more = (Signal(name=f"{name}_{word}") for word in ("came", "gone", "one", "more"))
    # Whether the first register behind the memory holds a payload, and whether the second register holds one.
    read, there = Signal(name=f"{name}_read"), Signal(name=f"{name}_there")
    address, reads = Signal((depth - 1).bit_length(), name=f"{name}_address"), Signal(name=f"{name}_reads")
    m.submodules[name] = memory = Memory(shape=width, depth=1 << len(address), init=[])
    port = memory.write_port()
    wanted, some = ~there | sink.ready, Signal(name=f"{name}_some")
    word, moves = registered_read(m, memory, address, wanted, port)
    m.d.comb += [
        source.ready.eq(room),
        port.data.eq(payload),
        port.en.eq(written),
        # ``reads`` implies ``moves``, because the address of a waiting word is not written.
        reads.eq(wanted & some),
        Value.cast(sink.payload).eq(word),
        sink.valid.eq(there),
    ]
    m.d.sync += [
        payload.eq(source.payload),
        written.eq(source.valid & room),
        room.eq(level < depth - UNCOUNTED),
        Cat(came, gone).eq(Cat(written, reads)),
        level.eq(level + came - gone),
        # ``reads`` comes late in a cycle, so it selects between terms that are ready.
        some.eq(written | more | (one & ~reads)),
        port.addr.eq(port.addr + written),
    ]
    few = [level == number for number in range(3)]
    m.d.comb += [
        one.eq((few[0] & came & ~gone) | (few[1] & (came == gone)) | (few[2] & ~came & gone)),
        more.eq(~Cat(few).any() | (few[1] & came & ~gone) | (few[2] & (came | ~gone))),
    ]
    with m.If(reads):
        m.d.sync += address.eq(address + 1)
    with m.If(moves):
        m.d.sync += [read.eq(reads), there.eq(read)]
    with m.Elif(sink.ready):
        m.d.sync += there.eq(0)
    return ~(written | some | read | there)


def connect_wide_fifo(
    m: Module, name: str, source: stream.Interface, sink: stream.Interface, depth: int = 2
) -> None:
    """Connect two streams through a FIFO without registers for payloads. A wide payload takes only memory.

    Use it for a sink that takes payloads directly into registers. A payload takes `SLICE_LATENCY` cycles
    through the empty FIFO. The source's ready and the sink's valid are registers.

    Parameters and errors are those of `connect_fifo`. The depth is 2 or more, as in a register slice.
    """
    require_same_shape(source.payload.shape(), sink.payload.shape())
    width = Shape.cast(source.payload.shape()).width
    bits = (depth - 1).bit_length()
    m.submodules[name] = memory = Memory(shape=width, depth=1 << bits, init=[])
    write, read = memory.write_port(), memory.read_port(**read_options(memory))
    first, free = (Signal(bits, name=f"{name}_{word}") for word in ("first", "free"))
    room, some = Signal(name=f"{name}_room", init=1), Signal(name=f"{name}_some")
    level, following = (Signal(range(depth + 1), name=f"{name}_{word}") for word in ("level", "following"))
    comes, goes = source.valid & room, some & sink.ready
    m.d.comb += [
        source.ready.eq(room),
        sink.valid.eq(some),
        write.data.eq(source.payload),
        write.addr.eq(free),
        read.addr.eq(read_address(first, first + goes)),
        # A word written without a payload is overwritten later.
        write.en.eq(room),
        Value.cast(sink.payload).eq(read.data),
        following.eq(level + comes - goes),
    ]
    m.d.sync += [
        free.eq(free + comes),
        first.eq(first + goes),
        level.eq(following),
        room.eq(following != depth),
        some.eq(following != 0),
    ]


def connect_headed_fifo(
    m: Module, name: str, source: stream.Interface, sink: stream.Interface, head: Value, depth: int
) -> Signal:
    """Connect two streams as `connect_wide_fifo` does, with some bits of the first payload in a register.

    Use it for a sink whose handshake depends on these bits. The payload itself is read late in a cycle. A
    payload takes `HEADED_FIFO_LATENCY` cycles through the empty FIFO.

    Parameters
    ----------
    m, name, source, sink
        As for `connect_fifo`.
    head : Value
        Bits of the source's payload, or bits made from it.
    depth : int
        Words of the memory: a power of two, at least 4. Up to ``depth - 1`` payloads wait there.

    Returns
    -------
    Signal
        ``head`` of the payload on the sink.

    Raises
    ------
    TypeError
        As `connect_fifo`.
    ValueError
        If the depth is less than 4 or no power of two.
    """
    require_same_shape(source.payload.shape(), sink.payload.shape())
    if depth < 4 or depth & (depth - 1):
        raise ValueError(f"depth must be a power of two from 4 on, not {depth}")
    width, bits = Shape.cast(source.payload.shape()).width, (depth - 1).bit_length()
    m.submodules[name] = memory = Memory(shape=width, depth=depth, init=[])
    m.submodules[f"{name}_heads"] = heads = Memory(shape=len(head), depth=depth, init=[])
    free, first, ahead = (Signal(bits, name=f"{name}_{word}") for word in ("free", "first", "ahead"))
    room, some = Signal(name=f"{name}_room", init=1), Signal(name=f"{name}_some")
    found = Signal(len(head), name=f"{name}_head", reset_less=True)
    comes, goes, fetches = source.valid & room, some & sink.ready, Signal(name=f"{name}_fetches")
    for port, value in ((memory.write_port(), source.payload), (heads.write_port(), head)):
        # A word written without a payload is overwritten later.
        m.d.comb += [port.data.eq(value), port.addr.eq(free), port.en.eq(room)]
    read, of_heads = memory.read_port(**read_options(memory)), heads.read_port(**read_options(heads))
    m.d.comb += [
        source.ready.eq(room),
        sink.valid.eq(some),
        read.addr.eq(read_address(first, first + goes)),
        of_heads.addr.eq(read_address(ahead, ahead + fetches)),
        Value.cast(sink.payload).eq(read.data),
        fetches.eq((free != ahead) & (~some | sink.ready)),
    ]
    m.d.sync += [
        some.eq(fetches | (some & ~sink.ready)),
        # ``room`` is a register, so one more payload may come after the test. The pointers can count up to
        # ``depth - 1`` payloads.
        room.eq((free - first)[:bits] < depth - 2),
    ]
    with m.If(comes):
        m.d.sync += free.eq(free + 1)
    with m.If(goes):
        m.d.sync += first.eq(first + 1)
    with m.If(fetches):
        m.d.sync += [ahead.eq(ahead + 1), found.eq(of_heads.data)]
    return found
