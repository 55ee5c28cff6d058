"""Draw commands: lists in a memory, read through for every band."""

from amaranth.hdl import Module, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.video.draw_commands import COMMAND_BITS, KINDS, DrawCommands
from blysk.hdl.core.scene_memory import scene_memory, word_write_shape, write_words
from blysk.hdl.core.stream import skid_buffer

__all__ = ["DrawCommandsUnit", "command_shape", "walk_request_shape"]


def command_shape() -> data.StructLayout:
    """Shape of a command; see `DrawCommands`."""
    return data.StructLayout(
        {"kind": unsigned(3), "index": unsigned(9), "first": unsigned(12), "count": unsigned(12)}
    )


def walk_request_shape(commands: int) -> data.StructLayout:
    """Shape of a request for a walk: start address of the list, and whether the band is a frame's first."""
    bits = max((commands - 1).bit_length(), 1)
    return data.StructLayout({"start": unsigned(bits), "first_band": unsigned(1)})


class DrawCommandsUnit(wiring.Component):
    """Walks a list from its start to its end. `DrawCommands` is the bit-accurate model.

    The unit reads a word a cycle. Some commands are for a frame's first band only. In other bands the unit
    leaves them out. The first command is offered two cycles after the request was accepted. The next request
    is accepted after the end was taken. The unit has no multipliers.

    Parameters
    ----------
    model : DrawCommands
        Bit-accurate model with the words after power-up.
    loads : bool
        Whether the memory can be written.

    Members
    -------
    i : :py:`In(stream.Signature(walk_request_shape(commands)))`
        Requests.
    write : :py:`In(stream.Signature(word_write_shape(commands, COMMAND_BITS)))`
        Words to write, accepted while no list is walked. Only with ``loads``.
    o : :py:`Out(stream.Signature(command_shape()))`
        Commands of the list, the command ``end`` last.

    Source: docs/theory/video.md#bands; [T] chapter 4.
    """

    def __init__(self, model: DrawCommands, loads: bool = False):
        self.model, self.loads = model, loads
        write = word_write_shape(len(model.words), COMMAND_BITS)
        super().__init__(
            {
                "i": In(stream.Signature(walk_request_shape(len(model.words)))),
                "o": Out(stream.Signature(command_shape())),
                **({"write": In(stream.Signature(write))} if loads else {}),
            }
        )

    def elaborate(self, platform):
        """The address, and the word that the memory gives."""
        m = Module()
        words = self.model.codes
        m.submodules.commands = memory = scene_memory("commands", COMMAND_BITS, len(words), words)
        read = memory.read_port()
        address, first_band = Signal.like(self.i.payload.start, name="address"), Signal(name="first_band")
        walks, waits, valid = Signal(name="walks"), Signal(name="waits"), Signal(name="valid")
        command = data.View(command_shape(), read.data)
        once = (command.kind == KINDS.index("transform")) | (command.kind == KINDS.index("frame_constant"))
        ends = valid & (command.kind == KINDS.index("end"))
        advance = skid_buffer(m, self.o, valid & (first_band | ~once), read.data)
        idle = ~walks & ~waits
        if self.loads:
            m.d.comb += read.en.eq(advance & ~write_words(m, memory, read, address, self.write, idle))
        else:
            m.d.comb += [read.addr.eq(address), read.en.eq(advance)]
        m.d.comb += self.i.ready.eq(idle)
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += [address.eq(self.i.payload.start), first_band.eq(self.i.payload.first_band)]
            m.d.sync += walks.eq(1)
        with m.If(advance):
            m.d.sync += valid.eq(walks & ~ends)
            with m.If(walks):
                m.d.sync += address.eq(address + 1)
            with m.If(ends):
                # A word read behind the end is no command.
                m.d.sync += [walks.eq(0), waits.eq(1)]
        with m.If(waits & ~self.o.valid):
            m.d.sync += waits.eq(0)
        return m
