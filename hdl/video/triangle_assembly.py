"""Triangle assembly: the triangles in a band, from ranges of the mesh memory and screen vertices."""

from itertools import pairwise

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.edge_setup import X_BITS
from blysk.golden.geometry.triangles import MATERIAL_BITS
from blysk.golden.video.mesh_memory import BLOCK_BITS
from blysk.golden.video.triangle_assembly import COUNTERS, TriangleAssembly
from blysk.hdl.core.memory import read_domain, word_in_register
from blysk.hdl.core.scene_memory import scene_memory, word_write_shape, write_words
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.triangles import count_events, counters_shape, first_centre, triangle_shape
from blysk.hdl.video.mesh_memory import range_shape
from blysk.hdl.video.vertex_unit import screen_vertex_shape

__all__ = ["FIRST_BITS", "TriangleAssemblyUnit", "band_rows_shape", "draw_shape"]

FIRST_BITS = 2 * BLOCK_BITS
"""Bits of a screen vertex that are read first: its place, its depth, and some bits of its normal.

The other bits are read two cycles later, from a memory of their own. They arrive when it is known whether the
triangle is in the band. So they need no further registers, and are as many block RAMs as in a single memory.
"""

_OF_TRIANGLE = "material", "base", "range"


def draw_shape() -> data.StructLayout:
    """Shape of a range of triangles with its material."""
    return data.StructLayout(dict(range_shape().members) | {"material": unsigned(MATERIAL_BITS)})


def band_rows_shape() -> data.StructLayout:
    """Shape of a band: its scanlines, ``top`` to ``bottom - 1``."""
    return data.StructLayout({"top": signed(X_BITS), "bottom": signed(X_BITS)})


class TriangleAssemblyUnit(wiring.Component):
    """Keeps the vertices of a frame, and makes triangles. `TriangleAssembly` is the bit-accurate model.

    A triangle takes three cycles, one for each corner that is read, even if the triangle is not sent. It is
    offered `latency` cycles after its first corner's address. A range is accepted while no other range is
    read. Each range costs two cycles besides the cycles of its triangles. The unit has no multipliers.

    Parameters
    ----------
    model : TriangleAssembly
        Bit-accurate model, with the mesh memory.
    loads : bool
        Whether the memory of the triangles can be written.

    Members
    -------
    i : :py:`In(stream.Signature(draw_shape()))`
        Ranges of triangles.
    o : :py:`Out(stream.Signature(triangle_shape(grid, surface)))`
        The triangles to draw.
    write : :py:`In(stream.Signature({"index", "vertex": screen_vertex_shape(grid, surface)}))`
        Vertices of the frame, one a cycle, while no triangle is read.
    faces : :py:`In(stream.Signature(word_write_shape(triangle_room, 3 index_bits)))`
        Triangles to write, accepted while no range is read. Only with ``loads``.
    constants : :py:`In(band_rows_shape())`
        The band, constant while triangles are read.
    status : :py:`Out(counters_shape(*COUNTERS))`
        Counters since the reset.

    Attributes
    ----------
    idle : Signal
        High while no range is read and no triangle waits.

    Source: docs/theory/video.md#vertices; [T] figure 4.10.
    """

    latency = 6

    def __init__(self, model: TriangleAssembly, loads: bool = False):
        self.model, self.loads = model, loads
        surface = model.mesh.surface
        vertex = screen_vertex_shape(model.grid, surface)
        index = unsigned(model.mesh.index_bits)
        faces = word_write_shape(model.mesh.triangle_room, 3 * model.mesh.index_bits)
        super().__init__(
            {
                "i": In(stream.Signature(draw_shape())),
                "o": Out(stream.Signature(triangle_shape(model.grid, surface))),
                "write": In(stream.Signature(data.StructLayout({"index": index, "vertex": vertex}))),
                "constants": In(band_rows_shape()),
                "status": Out(counters_shape(*COUNTERS)),
                **({"faces": In(stream.Signature(faces))} if loads else {}),
            }
        )
        self.idle = Signal(name="idle")

    def elaborate(self, platform):
        """The walk through the triangles' words, the corners' words, and the test of the band."""
        m = Module()
        mesh = self.model.mesh
        m.submodules.triangles = triangles = scene_memory(
            "triangles", 3 * mesh.index_bits, mesh.triangle_room, mesh.triangle_words
        )
        face, valid, advance = triangles.read_port(), Signal(name="valid"), Signal(name="advance")
        m.d.comb += [
            self.write.ready.eq(1),
            # A skid buffer would cost 400 bits without a gain, because the next unit takes at least 5 cycles
            # for a triangle.
            advance.eq(~valid | self.o.ready),
            self.o.valid.eq(valid),
        ]

        # A triangle's word is read a cycle before the address of its first corner, and kept for three cycles.
        left, following = (Signal(range(mesh.triangle_room + 1), name=name) for name in ("left", "following"))
        material, corner = Signal(MATERIAL_BITS, name="material"), Signal(2, name="corner")
        walks = Signal(name="walks")
        last = corner == 2
        rests, reads = (left == 0) & ~walks, advance & (~walks | last)
        if self.loads:
            reads = reads & ~write_words(m, triangles, face, following, self.faces, rests)
        else:
            m.d.comb += face.addr.eq(following)
        m.d.comb += [
            self.i.ready.eq(rests),
            face.en.eq(reads),
        ]
        with m.If(self.i.ready), m.If(self.i.valid):
            given = self.i.payload
            m.d.sync += [left.eq(given.count), following.eq(given.first), material.eq(given.material)]
        with m.Elif(advance):
            with m.If(~walks | last):
                m.d.sync += [walks.eq(left != 0), corner.eq(0)]
                with m.If(left != 0):
                    m.d.sync += [left.eq(left - 1), following.eq(following + 1)]
            with m.Else():
                m.d.sync += corner.eq(corner + 1)
        found = self._gather(m, advance, walks, corner, face.data, material)
        self._judge(m, advance, found, valid)
        inside = walks | (left != 0) | found["inside"] | found["whole"] | found["valid"] | valid
        m.d.comb += self.idle.eq(~inside)
        return m

    def _memory(self, m: Module, name: str, word: Value, advance: Value, index: Value) -> Signal:
        """A memory of a part of each vertex, and the register of the part that was read last."""
        write = self.write
        m.submodules[name] = memory = Memory(shape=len(word), depth=self.model.mesh.vertex_room, init=[])
        port, read, reads = memory.write_port(), memory.read_port(domain=read_domain()), Signal()
        m.d.comb += [
            # Reads and writes share one address, and never come in the same cycle. If not, a block RAM would
            # need registers beside it, or give words of half its width. Yosys sees this from the enable of a
            # register, and not from the enable of a port.
            reads.eq(advance & ~write.valid),
            read.addr.eq(Mux(write.valid, write.payload.index, index)),
            port.addr.eq(read.addr),
            port.data.eq(word),
            port.en.eq(write.valid),
        ]

        def register(value):
            kept = Signal.like(value, name=f"{name}_read", reset_less=True)
            with m.If(reads):
                m.d.sync += kept.eq(value)
            return kept

        return word_in_register(m, read, reads, register)

    def _gather(self, m: Module, advance, walks, corner, face, material) -> dict:
        """Shift corners in. Find the range of their scanlines, and whether a corner is outside."""
        grid, mesh, given = self.model.grid, self.model.mesh, self.write.payload.vertex
        # The first bits tell whether the triangle is in the band. The last bits come when this is known.
        names = "outside", *(name for name in given.shape().members if name != "outside")
        vertex = data.StructLayout({name: given.shape().members[name] for name in names})
        words = Cat(Value.cast(given[name]) for name in names)
        index = Array(face.word_select(k, mesh.index_bits) for k in range(3))[corner]
        indices = [index, *(Signal(mesh.index_bits, name=f"index_{k}", reset_less=True) for k in (1, 2))]
        with m.If(advance):
            m.d.sync += [later.eq(sooner) for sooner, later in pairwise(indices)]
        first_bits = self._memory(m, "vertices", words[:FIRST_BITS], advance, index)
        last_bits = self._memory(m, "vertices_last", words[FIRST_BITS:], advance, indices[2])
        word = data.View(vertex, Cat(first_bits, Const(0, vertex.size - FIRST_BITS)))
        arrives, arriving = Signal(name="arrives"), Signal(2, name="arriving")
        corners = [Signal(FIRST_BITS, name=f"corner_{k}", reset_less=True) for k in range(3)]
        lasts = [Signal(len(last_bits), name=f"last_bits_{k}", reset_less=True) for k in range(3)]
        low, high = (Signal(signed(X_BITS), name=name) for name in ("low", "high"))
        outside, whole = Signal(name="outside"), Signal(name="whole")
        kept = Signal.like(material, name="material_of_corners")
        # A word of the memory comes late in its cycle, so its scanline is compared on the next cycle.
        row, came, judged = (
            Signal.like(first_centre(word.y, grid), name="row"),
            Signal(name="came"),
            Signal(name="judged"),
        )
        comes_last = Signal(name="comes_last")
        first, first_row, was_outside = arriving == 0, Signal(name="first_row"), Signal(name="was_outside")
        with m.If(advance):
            m.d.sync += [arrives.eq(walks), arriving.eq(corner), whole.eq(arrives & (arriving == 2))]
            m.d.sync += [came.eq(arrives), first_row.eq(first), judged.eq(whole), was_outside.eq(outside)]
            m.d.sync += comes_last.eq(came)
            with m.If(comes_last):
                m.d.sync += [to.eq(behind) for to, behind in pairwise([*lasts, last_bits])]
            with m.If(arrives):
                m.d.sync += [
                    *(to.eq(behind) for to, behind in pairwise([*corners, first_bits])),
                    row.eq(first_centre(word.y, grid)),
                    outside.eq(word.outside | (outside & ~first)),
                ]
                with m.If(first):
                    m.d.sync += kept.eq(material)
            with m.If(came):
                m.d.sync += [
                    low.eq(Mux(first_row | (row < low), row, low)),
                    high.eq(Mux(first_row | (row > high), row, high)),
                ]
        return {
            "corners": corners,
            "lasts": lasts,
            "vertex": vertex,
            "low": low,
            "high": high,
            "outside": was_outside,
            "whole": whole,
            "valid": judged,
            "inside": arrives,
            "material": kept,
        }

    def _judge(self, m: Module, advance, found: dict, valid) -> None:
        """Give the triangle to the output, if it is in the band."""
        kept = {name: shape for name, shape in self.o.payload.shape().members.items() if name in _OF_TRIANGLE}
        result = Signal(data.StructLayout(kept), name="result", reset_less=True)
        m.d.comb += copy_fields(self.o.payload, result, kept)
        band = self.constants
        low = Mux(found["low"] > band.top, found["low"], band.top)
        high = Mux(found["high"] < band.bottom, found["high"], band.bottom)
        covered = low < high
        judged, outside = found["valid"], found["outside"]
        # The flag ``outside`` comes first, and is not kept.
        firsts = [Signal(FIRST_BITS - 1, name=f"first_bits_{k}", reset_less=True) for k in range(3)]
        for k, (first, last) in enumerate(zip(firsts, found["lasts"], strict=True)):
            corner = data.View(found["vertex"], Cat(Const(0, 1), first, last))
            names = [name for name in found["vertex"].members if name != "outside"]
            m.d.comb += [copy(self.o.payload[name][k], corner[name]) for name in names]
        with m.If(advance):
            m.d.sync += valid.eq(judged & covered & ~outside)
            # All corners are there a cycle before the test of the band has a result.
            with m.If(found["whole"]):
                m.d.sync += [to.eq(corner[1:]) for to, corner in zip(firsts, found["corners"], strict=True)]
                m.d.sync += result.material.eq(found["material"])
                if (placement := self.model.mesh.placement) is not None:
                    for to, codes in zip((*result.base, result.range), placement.T.tolist(), strict=True):
                        m.d.sync += Value.cast(to).eq(Array(codes)[found["material"]])
        moves = advance & judged
        count_events(
            m,
            self.status,
            sent=moves & covered & ~outside,
            rejected=moves & ~covered & ~outside,
            outside=moves & outside,
        )
