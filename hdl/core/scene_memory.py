"""Memories whose words depend on the scene, other words for them, and their writes."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar

from amaranth.hdl import Module, Mux, Shape, Value, ValueLike, unsigned
from amaranth.lib import data, stream
from amaranth.lib.memory import Memory, ReadPort

__all__ = ["Contents", "contents_from", "scene_memory", "word_write_shape", "write_words"]

Contents = Callable[[str, int, Sequence[int]], Sequence[int]]
"""Gives the words of a `scene_memory` from its name, the bits of a word, and the words of its scene."""

_CONTENTS: ContextVar[Contents | None] = ContextVar("contents", default=None)


@contextmanager
def contents_from(chosen: Contents) -> Iterator[None]:
    """Within the block, the memories of `scene_memory` in components that are elaborated get other words.

    Parameters
    ----------
    chosen : callable
        Gives the words. There are as many words as in the memory.
    """
    token = _CONTENTS.set(chosen)
    try:
        yield
    finally:
        _CONTENTS.reset(token)


def scene_memory(name: str, width: int, depth: int, words: Sequence[int]) -> Memory:
    """Memory whose words after power-up depend on the scene. In an FPGA they may be replaced later.

    Parameters
    ----------
    name : str
        Name, which no other such memory of the design has.
    width, depth : int
        Bits of a word, and number of words.
    words : sequence of int
        First words of the scene. All others are zeros. `contents_from` replaces all words.
    """
    if chosen := _CONTENTS.get():
        words = chosen(name, width, [*words, *[0] * (depth - len(words))])
    return Memory(shape=width, depth=depth, init=words)


def word_write_shape(depth: int, width: int) -> data.StructLayout:
    """Shape of a write into a memory: address, and the bytes of a word, the lowest first."""
    place = unsigned(max((depth - 1).bit_length(), 1))
    return data.StructLayout({"address": place, "data": data.ArrayLayout(8, -(-width // 8))})


def write_words(
    m: Module, memory: Memory, read: ReadPort, address: ValueLike, write: stream.Interface, idle: ValueLike
) -> Value:
    """Write a memory from a stream of `word_write_shape`, while the unit does not read.

    Reads and writes share one address. With two addresses a block RAM would need look-up tables beside it.

    Parameters
    ----------
    m : Module
        Module that gets the logic.
    memory : Memory
        The memory.
    read : ReadPort
        Its read port, which gets its address here.
    address : ValueLike
        Address that the unit reads.
    write : stream.Interface
        Words to write.
    idle : ValueLike
        Whether the unit reads no word. The word of the read port then has no meaning.

    Returns
    -------
    Value
        Whether a word is written. The port must not read in this cycle.
    """
    port = memory.write_port()
    width = Shape.cast(memory.shape).width
    m.d.comb += [
        write.ready.eq(idle),
        read.addr.eq(Mux(idle, write.payload.address, address)),
        port.addr.eq(read.addr),
        port.data.eq(Value.cast(write.payload.data)[:width]),
        port.en.eq(write.valid & idle),
    ]
    return port.en
