"""Drawing a frame band by band: from a mesh in memory to the pixels of each band."""

from amaranth.hdl import Array, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.edge_setup import X_BITS
from blysk.golden.video.band_depth import BandDepth
from blysk.golden.video.controls import BUTTONS
from blysk.golden.video.draw_commands import KINDS
from blysk.golden.video.draw_unit import Drawing
from blysk.golden.video.triangle_assembly import COUNTERS
from blysk.hdl.core.single_register import connect_register
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import copy_fields
from blysk.hdl.geometry.triangles import count_events, counters_shape
from blysk.hdl.render import STATUS as RENDERED
from blysk.hdl.render import RendererUnit
from blysk.hdl.video.band_depth import BandDepthUnit
from blysk.hdl.video.controls import ControlsUnit
from blysk.hdl.video.draw_commands import DrawCommandsUnit
from blysk.hdl.video.mesh_memory import MeshMemoryUnit
from blysk.hdl.video.motion import MotionUnit
from blysk.hdl.video.triangle_assembly import TriangleAssemblyUnit
from blysk.hdl.video.vertex_unit import VertexUnit

__all__ = ["STATUS", "DrawUnit", "band_shape", "drawn_band_pixel_shape", "load_shape"]

STATUS = (*COUNTERS, *RENDERED, "frames", "bands", "busy")
"""Counters of `DrawUnit`: those of assembly and renderer, then begun frames, begun bands, busy cycles."""


def band_shape(bands: int):
    """Shape of a band's index."""
    return unsigned(max((bands - 1).bit_length(), 1))


def load_shape(model: Drawing) -> data.StructLayout:
    """Shape of a word for a memory of `Drawing.memories`: its index, address, bytes from the lowest on."""
    size = max(memory.word_bytes for memory in model.memories)
    place = {"target": unsigned(2), "address": unsigned(16)}
    return data.StructLayout({**place, "data": data.ArrayLayout(8, size)})


def drawn_band_pixel_shape(x_bits: int, y_bits: int) -> data.StructLayout:
    """Shape of a pixel of a band: column, line inside the band, colour."""
    place = {"x": unsigned(x_bits), "y": unsigned(y_bits)}
    return data.StructLayout(place | {channel: unsigned(8) for channel in "rgb"})


class DrawUnit(wiring.Component):
    """Draws bands on request. `Drawing` is the bit-accurate model.

    A band begins a frame if its index is at most the index of the band before. Then the controls take a step,
    the vertices of all meshes are transformed, and the constants are written. In each band the triangles of
    the command list are read, and triangles in the band are drawn. When the last pixel has left, ``done``
    gives the band's index. Then the depths are cleared, before the next request is accepted.

    A frame takes the renderer's cycles, and these cycles:

    - 3 for each triangle in each band;
    - `VertexTransform.cycles` for each vertex;
    - 150 for each mesh;
    - `BandDepth.swept` for each band, if the next band is requested at once.

    Parameters
    ----------
    model : Drawing
        Bit-accurate model, with all contents of memories.
    loads : bool
        Whether the memories of `Drawing.memories` can be written.

    Members
    -------
    request : :py:`In(stream.Signature(band_shape(bands)))`
        Bands to draw, from 0 on. Some bands may be left out.
    done : :py:`Out(stream.Signature(band_shape(bands)))`
        Bands whose pixels have all been taken.
    pixels : :py:`Out(stream.Signature(drawn_band_pixel_shape(x_bits, y_bits)))`
        Pixels of the last requested band. Of several pixels at a place, the last pixel counts.
    buttons : :py:`In(4)`
        Buttons, see `ControlsUnit`.
    status : :py:`Out(counters_shape(*STATUS))`
        Counters since the reset.
    rest : :py:`In(1)`
        While it is high, no band is accepted. Only with ``loads``.
    load : :py:`In(stream.Signature(load_shape(model)))`
        Words to write, accepted while the unit rests. The next band then begins a frame. Only with ``loads``.

    Source: docs/theory/video.md#bands; [T] figure 4.10.
    """

    def __init__(self, model: Drawing, loads: bool = False):
        self.model, self.loads = model, loads
        given = model
        design = given.renderer.design
        self.render = RendererUnit(given.renderer)
        self.depth = BandDepthUnit(BandDepth((given.size[0], given.lines)), design.x_bits, design.y_bits)
        self.mesh = MeshMemoryUnit(given.mesh, loads)
        self.commands = DrawCommandsUnit(given.commands, loads)
        self.vertex = VertexUnit(given.transform, given.mesh.index_bits)
        self.assembly = TriangleAssemblyUnit(given.assembly, loads)
        self.motion, self.controls = MotionUnit(given.motion, loads), ControlsUnit(given.controls)
        band = band_shape(given.bands)
        super().__init__(
            {
                "request": In(stream.Signature(band)),
                "done": Out(stream.Signature(band)),
                "pixels": Out(stream.Signature(drawn_band_pixel_shape(design.x_bits, design.y_bits))),
                "buttons": In(len(BUTTONS)),
                "status": Out(counters_shape(*STATUS)),
                **({"rest": In(1), "load": In(stream.Signature(load_shape(given)))} if loads else {}),
            }
        )

    def elaborate(self, platform):
        """The units, and the logic that executes the commands."""
        m = Module()
        for name in ("render", "depth", "mesh", "commands", "vertex", "assembly", "motion", "controls"):
            m.submodules[name] = getattr(self, name)
        render, drawn = self.render, self.render.o
        connect(m, self.motion.o, self.vertex.write)
        connect(m, self.mesh.o, self.vertex.i)
        connect(m, self.vertex.o, self.assembly.write)
        connect(m, self.assembly.o, render.i)
        wiring.connect(m, render.memory, self.depth.memory)
        m.d.comb += [
            *copy_fields(self.pixels.payload, drawn.payload, "xyrgb"),
            self.pixels.valid.eq(drawn.valid),
            drawn.ready.eq(self.pixels.ready),
            self.controls.buttons.eq(self.buttons),
        ]
        self._band(m)
        return m

    def _band(self, m: Module) -> None:
        """Draw one band after the other."""
        given, commands = self.model, self.commands
        # A register follows the memory, because its word comes late in the cycle.
        self._command_in = stream.Signature(commands.o.payload.shape()).create(path=("command",))
        connect_register(m, "waiting_command", commands.o, self._command_in)
        command = self._command_in.payload
        frame, render = given.frames[0], self.render
        band, first = Signal.like(self.request.payload, name="band"), Signal(name="first_band")
        begun = Signal(name="begun")
        angle, index = (
            Signal.like(self.controls.angle, name="angle"),
            Signal.like(self.controls.index, name="index"),
        )
        rows = [Signal(signed(X_BITS), name=name) for name in ("top", "bottom")]
        bounds = [given.rows(k) for k in range(given.bands)]
        m.d.comb += [
            *(
                render.constants[name].eq(Const(frame.codes[name], render.constants[name].shape()))
                for name in ("left", "right", "back_faces")
            ),
            render.constants.limit.eq(Array(each.codes["limit"] for each in given.frames)[index]),
            render.constants.top.eq(rows[0]),
            render.constants.bottom.eq(rows[1]),
            self.assembly.constants.top.eq(rows[0]),
            self.assembly.constants.bottom.eq(rows[1]),
            commands.i.payload.start.eq(Array(given.commands.starts)[index]),
            commands.i.payload.first_band.eq(first),
            self.motion.i.payload.slot.eq(command.index),
            self.motion.i.payload.angle.eq(angle),
            *copy_fields(self.mesh.i.payload, command, ("first", "count")),
            *copy_fields(self.assembly.i.payload, command, ("first", "count")),
            self.assembly.i.payload.material.eq(command.index),
            render.write.payload.address.eq(command.index),
            render.write.payload.data.eq((command.count << 12) | command.first),
            self.done.payload.eq(band),
        ]
        idle = Signal(name="idle")
        # ``idle`` is a cycle late, but in time for the command after a draw command.
        m.d.sync += idle.eq(self.assembly.idle & render.idle)
        with m.FSM(name="state") as state:
            with m.State("clear"):
                m.d.comb += self.depth.begin.eq(1)
                m.next = "wait"
            with m.State("wait"):
                m.d.comb += self.request.ready.eq(
                    ~self.depth.busy & ~self.rest if self.loads else ~self.depth.busy
                )
                m.d.sync += [band.eq(self.request.payload), first.eq(~begun | (self.request.payload <= band))]
                with m.If(self.request.valid & self.request.ready):
                    m.d.sync += begun.eq(1)
                    m.next = "begin"
                with m.Else():
                    m.d.sync += [band.eq(band), first.eq(first)]
                if self.loads:
                    self._load(m, begun)
            with m.State("begin"):
                m.d.comb += self.controls.frame.eq(first)
                m.d.sync += [
                    rows[0].eq(frame.top + band * given.lines),
                    rows[1].eq(
                        Mux(band == given.bands - 1, bounds[-1].bottom, frame.top + (band + 1) * given.lines)
                    ),
                ]
                m.next = "choose"
            with m.State("choose"):
                with m.If(first):
                    m.d.sync += [angle.eq(self.controls.angle), index.eq(self.controls.index)]
                m.next = "ask"
            with m.State("ask"):
                m.d.comb += commands.i.valid.eq(1)
                with m.If(commands.i.ready):
                    m.next = "command"
            self._command(m, idle)
            with m.State("end"), m.If(idle):
                m.next = "done"
            with m.State("done"):
                m.d.comb += self.done.valid.eq(1)
                with m.If(self.done.ready):
                    m.next = "clear"
            begins = state.ongoing("begin")
            waits = state.ongoing("wait")
        self._count(m, frames=begins & first, bands=begins, busy=~waits | self.depth.busy)

    def _load(self, m: Module, begun: Signal) -> None:
        """Write a word while the unit rests."""
        load, given = self.load, self.load.payload
        writes = (self.mesh.write, self.assembly.faces, self.commands.write, self.motion.write)
        with m.If(self.rest), m.Switch(given.target):
            for target, write in enumerate(writes):
                address, data = write.payload.address, Value.cast(write.payload.data)
                with m.Case(target):
                    m.d.comb += [
                        address.eq(given.address),
                        data.eq(Value.cast(given.data)),
                        write.valid.eq(load.valid),
                        load.ready.eq(write.ready),
                    ]
        with m.If(load.valid & load.ready):
            m.d.sync += begun.eq(0)

    def _command(self, m: Module, idle: Signal) -> None:
        """States that execute the commands."""
        command = self._command_in
        kind, take, valid = command.payload.kind, command.ready, command.valid
        left = Signal(12, name="vertices_left")
        with m.State("command"), m.Switch(kind):
            with m.Case(KINDS.index("end")):
                m.d.comb += take.eq(1)
                with m.If(valid):
                    m.next = "end"
            with m.Case(KINDS.index("transform")):
                m.d.comb += self.motion.i.valid.eq(valid)
                with m.If(valid & self.motion.i.ready):
                    m.next = "turn"
            with m.Case(KINDS.index("draw")):
                m.d.comb += [self.assembly.i.valid.eq(valid), take.eq(self.assembly.i.ready)]
            with m.Default():
                m.d.comb += [
                    self.render.write.valid.eq(valid & idle),
                    take.eq(idle & self.render.write.ready),
                ]
        with m.State("turn"):
            m.d.sync += left.eq(command.payload.count)
            # When its last entry was taken, the motion unit waits for the next slot.
            with m.If(self.motion.i.ready):
                m.next = "read"
        with m.State("read"):
            m.d.comb += self.mesh.i.valid.eq(1)
            with m.If(self.mesh.i.ready):
                m.next = "transform"
        with m.State("transform"):
            with m.If(self.assembly.write.valid & self.assembly.write.ready):
                m.d.sync += left.eq(left - 1)
            with m.If(left == 0):
                m.d.comb += take.eq(1)
                m.next = "command"

    def _count(self, m: Module, **events) -> None:
        """Drive the counters of this unit and of the units inside."""
        status = self.status
        count_events(m, status, **events)
        m.d.comb += [
            *copy_fields(status, self.assembly.status, COUNTERS),
            *copy_fields(status, self.render.status, RENDERED),
        ]
