"""Reading a memory through the register that an FPGA's memories have behind their word."""

from amaranth.hdl import Module, Signal, Value
from amaranth.lib.memory import Memory, WritePort

__all__ = ["registered_read"]


def registered_read(
    m: Module,
    memory: Memory,
    address: Value,
    wanted: Value,
    write: WritePort | None = None,
) -> tuple[Signal, Value]:
    """Word of a memory, two cycles after its address; both registers move by one enable.

    A memory's word is there late in a clock's period, one from its register early. What a memory gives on the
    clock on which the same word is written differs between FPGAs: then nothing moves, so that no logic is
    needed for that between the memory and the register.

    Parameters
    ----------
    m : Module
        Module that gets the registers; the memory is its submodule.
    memory : Memory
        The memory.
    address : Value
        Of the word.
    wanted : Value
        Whether the registers are to move.
    write : WritePort or None
        Port that writes the memory; ``None``: none does.

    Returns
    -------
    word : Signal
        The word.
    moves : Value
        Whether the registers move.
    """
    port = memory.read_port(domain="comb")
    moves = wanted if write is None else wanted & ~(write.en & (write.addr == address))
    read, word = (Signal(len(port.data), name=name, reset_less=True) for name in ("read", "word"))
    m.d.comb += port.addr.eq(address)
    with m.If(moves):
        m.d.sync += [read.eq(port.data), word.eq(read)]
    return word, moves
