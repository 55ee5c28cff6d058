"""Mesh memory: gives the vertices of a range, one after the other."""

from amaranth.hdl import Module, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.video.mesh_memory import MeshMemory
from blysk.hdl.core.scene_memory import scene_memory, word_write_shape, write_words
from blysk.hdl.core.single_register import hold_output
from blysk.hdl.video.vertex_unit import mesh_vertex_shape

__all__ = ["RANGE_BITS", "MeshMemoryUnit", "range_shape"]

RANGE_BITS = 12
"""Bits of a range's first index, and of its number of vertices or triangles."""


def range_shape() -> data.StructLayout:
    """Shape of a range: its first vertex or triangle, and its number of vertices or triangles, at least 1."""
    return data.StructLayout({"first": unsigned(RANGE_BITS), "count": unsigned(RANGE_BITS)})


class MeshMemoryUnit(wiring.Component):
    """Reads ranges of vertices, a vertex a cycle, from a memory that holds a mesh after power-up.

    A range is accepted while no other range is read. Its first vertex is offered two cycles later. The read
    depends on the output's ready of the same cycle. The unit has no multipliers.

    Parameters
    ----------
    model : MeshMemory
        The vertices.
    loads : bool
        Whether the memory can be written.

    Members
    -------
    i : :py:`In(stream.Signature(range_shape()))`
        Ranges.
    write : :py:`In(stream.Signature(word_write_shape(vertex_room, vertex_bits)))`
        Words to write, accepted while no range is read. Only with ``loads``.
    o : :py:`Out(stream.Signature(mesh_vertex_shape(index_bits, surface)))`
        Vertices of the ranges.

    Source: docs/theory/video.md#vertices; not in the documents.
    """

    latency = 2

    def __init__(self, model: MeshMemory, loads: bool = False):
        self.model, self.loads = model, loads
        write = word_write_shape(model.vertex_room, model.vertex_bits)
        super().__init__(
            {
                "i": In(stream.Signature(range_shape())),
                "o": Out(stream.Signature(mesh_vertex_shape(model.index_bits, model.surface))),
                **({"write": In(stream.Signature(write))} if loads else {}),
            }
        )

    def elaborate(self, platform):
        """A counter, the memory, and the index beside its word."""
        m = Module()
        given = self.model
        m.submodules.vertices = memory = scene_memory(
            "vertices", given.vertex_bits, given.vertex_room, given.vertex_words
        )
        read = memory.read_port()
        left, address = (
            Signal(range(given.vertex_room + 1), name="left"),
            Signal(given.index_bits, name="address"),
        )
        valid, index = Signal(name="valid"), Signal(given.index_bits, name="index")
        payload = Signal(self.o.payload.shape(), name="vertex")
        # The memory keeps its word. A skid buffer would cost a multiplexer for each bit of a vertex without a
        # gain, because the vertex unit takes many cycles for a vertex.
        advance = hold_output(m, self.o, valid, payload)
        words = Value.cast(payload)[given.index_bits :]
        if self.loads:
            written = write_words(m, memory, read, address, self.write, left == 0)
            m.d.comb += read.en.eq(advance & ~written)
        else:
            m.d.comb += [read.addr.eq(address), read.en.eq(advance)]
        m.d.comb += [payload.index.eq(index), words.eq(read.data), self.i.ready.eq(left == 0)]
        with m.If(advance):
            m.d.sync += [valid.eq(left != 0), index.eq(address)]
        with m.If(left == 0), m.If(self.i.valid):
            m.d.sync += [left.eq(self.i.payload.count), address.eq(self.i.payload.first)]
        with m.Elif(advance):
            m.d.sync += [left.eq(left - 1), address.eq(address + 1)]
        return m
