"""A core on a bus: AXI4-Stream for its input and output, AXI4-Lite or Wishbone for its registers."""

from amaranth.hdl import Cat, Module, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.registers import RegisterMap, constant_registers, frame_registers
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.render import Renderer
from blysk.hdl.bus.axi_lite import AxiLite, AxiLiteUnit
from blysk.hdl.bus.framing import FramingUnit
from blysk.hdl.bus.registers import RegistersUnit
from blysk.hdl.bus.stream_width import gather_words, split_words
from blysk.hdl.bus.tops import TOPS
from blysk.hdl.bus.wishbone import Wishbone, WishboneUnit
from blysk.hdl.core.views import copy_fields
from blysk.hdl.port_descriptions import COUNTER_TEXTS

__all__ = ["BUSES", "PORT_DESCRIPTIONS", "AxiStream", "BusUnit", "core_of"]

BUSES = {"axi": ("s_axil", AxiLite, AxiLiteUnit), "wishbone": ("wb", Wishbone, WishboneUnit)}
"""For each name of a bus: the member for registers, its signature, and the unit that adapts it."""

PORT_DESCRIPTIONS = {
    "s_axis_tdata": "bytes of one triangle or span, in the layout above",
    "s_axis_tlast": "1 in the last beat of a frame",
    "m_axis_tdata": "bytes of one pixel or span, in the layout above",
    "m_axis_tkeep": "all ones",
    "m_axis_tlast": "1 in the last beat of a packet, as said above",
    "m_axis_tuser": "bit 0: the first beat of the frame; bit 1: the last beat",
}
"""Ports of the streams, for the table in Verilog."""


class AxiStream(wiring.Signature):
    """Signals of AXI4-Stream, seen from the transmitter.

    Parameters
    ----------
    size : int
        Bytes of TDATA.
    user : int
        Bits of TUSER. If 0, the stream has no TUSER and no TKEEP.
    """

    def __init__(self, size: int, user: int = 0):
        members = {"tdata": Out(8 * size), "tvalid": Out(1), "tready": In(1), "tlast": Out(1)}
        if user:
            members |= {"tkeep": Out(size), "tuser": Out(user)}
        super().__init__(members)


class BusUnit(wiring.Component):
    """A core on a bus: a `FramingUnit` for its streams and a `RegistersUnit` for its registers, connected.

    Registers are written only while no frame is inside. So constants never change within a frame. No path
    leads from a ready to a valid. s_axis_tready may depend on s_axis_tvalid and the index of a material. If
    the design's `Build` has a width of streams, a beat is a word of a triangle, span or pixel.

    Parameters
    ----------
    design : ShadingPipeline
        Design of the core. Its `Build` names the core (see `TOPS`) and the bus (see `BUSES`).
    **options
        Keyword arguments of the core's constructor.

    Members
    -------
    s_axis : :py:`In(AxiStream(...))`
        Triangles or spans. TLAST ends a frame.
    m_axis : :py:`Out(AxiStream(..., user=2))`
        Pixels or spans.
    s_axil : :py:`In(AxiLite())`
        Registers. With Wishbone this member is ``wb``, :py:`In(Wishbone())`.
    memory
        Memory port of the core, if it has one.

    Attributes
    ----------
    map : RegisterMap
        The registers.
    stream : int
        Bits of a beat of both streams; 0: a beat is a whole triangle, span or pixel.

    Source: docs/theory/bus.md#streams.
    """

    def __init__(self, design: ShadingPipeline, **options):
        self.framing = FramingUnit(design, **options)
        member, signature, front = BUSES[design.build.bus]
        self._member, self._front = member, front()
        counters = [
            (name, field.shape.width, COUNTER_TEXTS[name])
            for name, field in self.framing.status.shape()
            if name != "busy"
        ]
        of_core = self.framing.core.signature.members
        constants = self.framing.constants.shape() if "constants" in of_core else None
        axes = Renderer(design).axes if design.build.takes_triangles else ()
        self.map = RegisterMap(
            self.framing.top.title,
            counters,
            frame_registers("keep" in constants.members) if constants else (),
            constant_registers(design, axes) if "write" in of_core else (),
        )
        self._registers = RegistersUnit(self.map)
        layouts = self.framing.model
        self.stream = design.build.stream or 0
        size = self.stream // 8
        members = {
            "s_axis": In(AxiStream(size or layouts.given.size)),
            "m_axis": Out(AxiStream(size or layouts.made.size, 2)),
            member: In(signature()),
        }
        if "memory" in of_core:
            members["memory"] = of_core["memory"]
        super().__init__(members)

    def elaborate(self, platform):
        """The adapter of the bus, the registers, and the core with its framing."""
        m = Module()
        m.submodules.framing = framing = self.framing
        m.submodules.registers = registers = self._registers
        m.submodules.front = front = self._front
        if self.stream:
            gather_words(m, self.s_axis, framing.i)
            split_words(m, framing.o, self.m_axis)
        else:
            self._connect_streams(m)
        wiring.connect(m, front.i, registers.i)
        wiring.connect(m, registers.o, front.o)
        wiring.connect(m, wiring.flipped(getattr(self, self._member)), front.bus)
        m.d.comb += copy_fields(registers.constants, framing.status)
        if self.map.picture:
            m.d.comb += copy_fields(framing.constants, registers.picture)
        if self.map.constants:
            # The core accepts a write at once, because no frame is inside.
            m.d.comb += [
                framing.write.valid.eq(registers.load.valid),
                framing.write.payload.address.eq(registers.load.address),
                framing.write.payload.data.eq(registers.load.data),
            ]
        if "memory" in self.signature.members:
            wiring.connect(m, framing.memory, wiring.flipped(self.memory))
        return m

    def _connect_streams(self, m: Module) -> None:
        """Streams whose beats are whole payloads."""
        framing, given, made = self.framing, self.s_axis, self.m_axis
        m.d.comb += [
            Value.cast(framing.i.payload.data).eq(given.tdata),
            framing.i.payload.last.eq(given.tlast),
            framing.i.valid.eq(given.tvalid),
            given.tready.eq(framing.i.ready),
            made.tdata.eq(Value.cast(framing.o.payload.data)),
            made.tkeep.eq(~0),
            made.tlast.eq(framing.o.payload.last),
            made.tuser.eq(Cat(framing.o.payload.first, framing.o.payload.end)),
            made.tvalid.eq(framing.o.valid),
            framing.o.ready.eq(made.tready),
        ]


def core_of(design: ShadingPipeline) -> wiring.Component:
    """The core that a design's `Build` names, with its own streams or on a bus; see `TOPS`.

    Raises
    ------
    ValueError
        If the design does not fit triangles (see `Renderer`), or has fewer scanlines than pipelines.
    """
    build = design.build
    return TOPS[build.top].unit(design) if build.bus == "native" else BusUnit(design)
