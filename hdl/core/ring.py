"""Ring of words that take turns, in registers or in a memory of look-up tables."""

from itertools import pairwise

from amaranth.hdl import Module, Mux, Signal, Value, ValueLike
from amaranth.lib.memory import Memory

from blysk.hdl.core.memory import read_address, read_options

__all__ = ["RING_REGISTERS", "Ring", "next_turn"]

RING_REGISTERS = 4
"""Largest number of words of a ring in registers. A ring of more words is a memory of look-up tables."""


def next_turn(turn: Value, count: int) -> Value:
    """Index of the turn after ``turn``, of ``count`` turns."""
    return turn + 1 if count & (count - 1) == 0 else Mux(turn == count - 1, 0, turn + 1)


class Ring:
    """Words of equal width that take turns. On each turn the first word leaves and a word comes in.

    Parameters
    ----------
    m : Module
        Module of the ring.
    name : str
        Name of the ring. The memory is a submodule of this name.
    bits : int
        Bits of a word.
    count : int
        Number of words.
    turns : Value
        Whether the ring turns in this cycle.
    place : Value
        Index of the turn. The caller counts it with `next_turn`, from 0 on.
    late : bool
        Whether a word comes in one turn after it left. There are at least three words then.

    Attributes
    ----------
    first : Value
        The first word.
    newest : Value
        Word of the last turn. With ``late`` it is not there.
    """

    def __init__(
        self, m: Module, name: str, bits: int, count: int, turns: Value, place: Value, late: bool = False
    ):
        self._m, self._turns = m, turns
        if count <= RING_REGISTERS:
            words = [Signal(bits, name=f"{name}_{k}", reset_less=True) for k in range(count - late)]
            with m.If(turns):
                m.d.sync += [word.eq(behind) for word, behind in pairwise(words)]
            self.first, self.newest, self._write = words[0], words[-1], None
            return
        m.submodules[name] = memory = Memory(shape=bits, depth=count, init=[])
        self._write, self.newest = memory.write_port(), Signal(bits, name=f"{name}_newest", reset_less=True)
        read = memory.read_port(**read_options(memory))
        self.first, written = read.data, place
        if late:
            written = Signal(range(count), name=f"{name}_left", init=count - 1)
            with m.If(turns):
                m.d.sync += written.eq(place)
        m.d.comb += [
            read.addr.eq(read_address(place, Mux(turns, next_turn(place, count), place))),
            self._write.addr.eq(written),
            self._write.en.eq(turns),
        ]

    def takes(self, word: ValueLike) -> None:
        """Connect the word that comes in on each turn."""
        if self._write is not None:
            self._m.d.comb += self._write.data.eq(word)
        with self._m.If(self._turns):
            self._m.d.sync += self.newest.eq(word)
