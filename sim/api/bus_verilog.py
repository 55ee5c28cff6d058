"""Headers and port descriptions of cores on a bus, and of geometry alone."""

from collections.abc import Sequence

from blysk.golden.bus.registers import CONSTANTS
from blysk.hdl.bus.bus import PORT_DESCRIPTIONS, BusUnit
from blysk.hdl.geometry.geometry import PORT_DESCRIPTIONS as GEOMETRY_PORT_DESCRIPTIONS
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.render import PORT_DESCRIPTIONS as RENDER_PORT_DESCRIPTIONS
from blysk.hdl.render import RendererUnit, port_descriptions
from blysk.sim.api.bus_documents import beats_text, frame_text, layout_lines

__all__ = ["bus_descriptions", "bus_header", "triangle_descriptions"]

_MARKS = {
    "span": "the last pixel of its span",
    "run": "a pixel whose right neighbour is not the next pixel, or the last pixel of the frame",
    "frame": "the last beat of the frame",
}
_DEPTHS = "Each frame clears the depths, unless it is sent with 1 in keep: then it adds to the picture."

_PATHS = {
    "axi": "AXI4-Lite, s_axil_*",
    "wishbone": "Wishbone B4, wb_*, classic or pipelined; wb_adr counts words",
}


_NARROW = {
    "s_axis_tdata": "next bytes of a triangle or span, in the layout above",
    "m_axis_tdata": "next bytes of a pixel or span, in the layout above",
}
"""Ports of streams with several beats for each triangle, span or pixel."""


def triangle_descriptions(unit: RendererUnit | GeometryUnit) -> dict[str, str]:
    """Descriptions of the ports of a core that takes triangles."""
    members = unit.i.payload.shape().members
    lanes = unit.model.design.build.lanes if isinstance(unit, RendererUnit) else 1
    given = {
        port: text
        for port, text in port_descriptions(lanes).items()
        if not port.startswith("i_") or port[2:] in members
    }
    if frame := frame_text(unit):
        given["i_normal"] += f", {frame}"
    if isinstance(unit, RendererUnit):
        return given
    made = set(unit.o.payload.shape().members)
    if unit.model.surface is not None:
        made |= {f"attributes_{name}" for name in unit.o.payload.attributes.shape().members}
    words = {
        f"{member}_{name}"
        for member in ("constants", "status")
        for name in getattr(unit, member).shape().members
    }
    shared = {port: text for port, text in given.items() if port in words or port.startswith("i_")}
    return shared | {f"o_{name}": text for name, text in GEOMETRY_PORT_DESCRIPTIONS.items() if name in made}


def bus_descriptions(unit: BusUnit) -> dict[str, str]:
    """Descriptions of the ports of a core on a bus."""
    of_memory = {port: text for port, text in RENDER_PORT_DESCRIPTIONS.items() if port.startswith("memory_")}
    memory = of_memory if "memory" in unit.signature.members else {}
    return PORT_DESCRIPTIONS | (_NARROW if unit.stream else {}) | memory


def bus_header(unit: BusUnit, bus: str, of_core: Sequence[str], constants: Sequence[str]) -> list[str]:
    """Header of a core on a bus, in lines: how to drive it.

    Parameters
    ----------
    unit : BusUnit
        The core.
    bus : str
        Name of the bus.
    of_core : sequence of str
        Lines that describe the core.
    constants : sequence of str
        Lines that list the frame constants with their addresses, and lines of the example.
    """
    framing, map = unit.framing, unit.map
    packets, layouts = framing.packets, framing.model
    given_bytes = beats_text(unit, layouts.given)
    # Registers take the place of these ports. The list of registers describes them.
    kept = [line for line in of_core if not line.startswith(("status_", "constants_", "before the first"))]
    registers = [
        f"  0x{register.address:03X}  {register.name:<12} {register.text}"
        for register in map.registers
        if register.address < CONSTANTS
    ]
    lines = [
        *kept,
        "",
        f"Streams: AXI4-Stream. Registers: {_PATHS[bus]}; words of 32 bits, little endian.",
        "rst is synchronous and active high: drive it with the inverse of an active-low aresetn.",
        "",
        f"s_axis_tdata, {given_bytes}: byte, C declaration, format; extended by sign or 0:",
        *layout_lines(layouts.given),
        f"m_axis_tdata, {beats_text(unit, layouts.made)}, likewise:",
        *layout_lines(layouts.made),
        "s_axis_tlast ends a frame: without it the last output beat never comes.",
        f"m_axis_tlast: {_MARKS[packets]}.",
        "m_axis_tuser: bit 0 marks the first beat of the frame, bit 1 the last; tkeep is all ones.",
        "",
        "Order: hold rst for a cycle; write every frame register and constant in any order; send the beats",
        "of a frame, tlast with the last; wait until state is 0; then write again or send the next frame.",
        "An access is refused (SLVERR, err) for one of these reasons: no register at the address, the wrong",
        "direction, part of a word, a value that does not fit, a write while a frame is inside.",
        "A refused access changes only errors and refused.",
        "errors takes any word or byte at any time; all ones clear it.",
        *([_DEPTHS] if "keep" in map.by_name else []),
        "",
        "Registers, by address of a byte:",
        *registers,
    ]
    if map.constants:
        lines += [
            "",
            f"Frame constants: register 0x{CONSTANTS:03X} + 4 address, signed values extended by sign:",
        ]
        lines += constants
    return lines
