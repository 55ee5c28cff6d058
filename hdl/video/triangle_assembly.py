"""Triangle assembly: the triangles in a band, from ranges of the mesh memory and screen vertices."""

from amaranth.hdl import Array, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.edge_setup import X_BITS
from blysk.golden.geometry.triangles import MATERIAL_BITS
from blysk.golden.video.triangle_assembly import COUNTERS, TriangleAssembly
from blysk.hdl.core.scene_memory import scene_memory, word_write_shape, write_words
from blysk.hdl.core.views import copy
from blysk.hdl.geometry.triangles import count_events, counters_shape, first_centre, triangle_shape
from blysk.hdl.video.mesh_memory import range_shape
from blysk.hdl.video.vertex_unit import screen_vertex_shape

__all__ = ["TriangleAssemblyUnit", "band_rows_shape", "draw_shape"]


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
        vertex = self.write.payload.vertex.shape()
        m.submodules.vertices = vertices = Memory(shape=vertex.size, depth=mesh.vertex_room, init=[])
        write, face, read = vertices.write_port(), triangles.read_port(), vertices.read_port()
        result, valid = Signal(self.o.payload.shape(), name="result"), Signal(name="valid")
        advance = Signal(name="advance")
        m.d.comb += [
            # Reads and writes share one address, and never come in the same cycle. If not, a block RAM would
            # need registers beside it, or give words of half its width.
            write.addr.eq(read.addr),
            write.data.eq(Value.cast(self.write.payload.vertex)),
            write.en.eq(self.write.valid),
            self.write.ready.eq(1),
            # A skid buffer would cost 400 bits without a gain, because the next unit takes at least 5 cycles
            # for a triangle.
            advance.eq(~valid | self.o.ready),
            self.o.valid.eq(valid),
            copy(self.o.payload, result),
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
            read.addr.eq(
                Mux(
                    self.write.valid,
                    self.write.payload.index,
                    Array(face.data.word_select(k, mesh.index_bits) for k in range(3))[corner],
                )
            ),
            read.en.eq(advance & ~self.write.valid),
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
        found = self._gather(m, advance, walks, corner, data.View(vertex, read.data), material)
        self._judge(m, advance, found, result, valid)
        inside = walks | (left != 0) | found["inside"] | found["whole"] | found["valid"] | valid
        m.d.comb += self.idle.eq(~inside)
        return m

    def _gather(self, m: Module, advance, walks, corner, word, material) -> dict:
        """Shift corners in. Find the range of their scanlines, and whether a corner is outside."""
        grid = self.model.grid
        arrives, arriving = Signal(name="arrives"), Signal(2, name="arriving")
        corners = [Signal(word.shape(), name=f"corner_{k}") for k in range(3)]
        low, high = (Signal(signed(X_BITS), name=name) for name in ("low", "high"))
        outside, whole = Signal(name="outside"), Signal(name="whole")
        kept = Signal.like(material, name="material_of_corners")
        # A word of the memory comes late in its cycle, so its scanline is compared on the next cycle.
        row, came, judged = (
            Signal.like(first_centre(word.y, grid), name="row"),
            Signal(name="came"),
            Signal(name="judged"),
        )
        first, first_row, was_outside = arriving == 0, Signal(name="first_row"), Signal(name="was_outside")
        with m.If(advance):
            m.d.sync += [arrives.eq(walks), arriving.eq(corner), whole.eq(arrives & (arriving == 2))]
            m.d.sync += [came.eq(arrives), first_row.eq(first), judged.eq(whole), was_outside.eq(outside)]
            with m.If(arrives):
                m.d.sync += [
                    copy(corners[0], corners[1]),
                    copy(corners[1], corners[2]),
                    copy(corners[2], word),
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
            "low": low,
            "high": high,
            "outside": was_outside,
            "whole": whole,
            "valid": judged,
            "inside": arrives,
            "material": kept,
        }

    def _judge(self, m: Module, advance, found: dict, result, valid) -> None:
        """Give the triangle to the output, if it is in the band."""
        band = self.constants
        low = Mux(found["low"] > band.top, found["low"], band.top)
        high = Mux(found["high"] < band.bottom, found["high"], band.bottom)
        covered = low < high
        judged, outside = found["valid"], found["outside"]
        with m.If(advance):
            m.d.sync += valid.eq(judged & covered & ~outside)
            # All corners are there a cycle before the test of the band has a result.
            with m.If(found["whole"]):
                names = [name for name in found["corners"][0].shape().members if name != "outside"]
                for k, corner in enumerate(found["corners"]):
                    m.d.sync += [copy(result[name][k], corner[name]) for name in names]
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
