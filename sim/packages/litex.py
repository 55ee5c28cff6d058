"""LiteX: a module with the core, its registers on Wishbone, two masters for memory, and an interrupt."""

from string import Template

from blysk.golden.bus.byte_layout import ByteLayout
from blysk.sim.errors import InputError
from blysk.sim.packages.package import Core
from blysk.sim.packages.wrapper import DEPTH_PORTS, depth_memory, has_depths
from blysk.sim.run_files import MARK

__all__ = ["files"]

_MODULE = Template('''\
"""The core $name as a module of LiteX, $mark.

$title. A DMA reader takes the array of ``struct ${name}_input`` of $name.h from memory. Each pixel goes to a
frame buffer of 32-bit words, blue in the lowest byte, as LiteX's VideoFrameBuffer reads it.
"""

from pathlib import Path

from migen import *

from litex.gen import *
from litex.soc.cores.dma import WishboneDMAReader, WishboneDMAWriter
from litex.soc.integration.soc import SoCRegion
from litex.soc.interconnect import stream, wishbone
from litex.soc.interconnect.csr import CSRStorage
from litex.soc.interconnect.csr_eventmanager import EventManager, EventSourcePulse

FOLDER = Path(__file__).resolve().parent


class $class_name(LiteXModule):
    """The core with its registers on ``bus``, and the masters ``reader.bus`` and ``writer.bus``.

    A frame: write the registers, ``frame_base`` and ``frame_stride`` (bytes from a row to the next), and the
    base and length of ``reader`` in bytes. Then set ``reader_enable``. The interrupt ``frame`` comes when
    the last pixel has been written. A frame without pixels gives none: also poll ``reader_done`` and the
    register ``state``. Clear ``reader_enable`` before the next frame.

    Parameters
    ----------
    platform : GenericPlatform
        Gets the Verilog of the core.
$size_text    """

    def __init__(self, platform$size_parameter):
        for file in ($sources):
            platform.add_source(str(FOLDER / file))
        self.bus = wishbone.Interface(data_width=32, adr_width=30, addressing="word")

        # The words of memory keep their order of bytes, which LiteX calls big.
        memory = wishbone.Interface(data_width=32, adr_width=30, addressing="word")
        self.reader = reader = WishboneDMAReader(memory, endianness="big", with_csr=True)
        self.gather = gather = stream.Converter(32, $given_bits)
        self.comb += reader.source.connect(gather.sink)

        pixel, marks = Signal($made_bits), Signal(2)
        memory = wishbone.Interface(data_width=32, adr_width=30, addressing="word")
        self.writer = writer = WishboneDMAWriter(memory, endianness="big")
        self.frame_base = CSRStorage(32, description="Address of the frame buffer.")
        self.frame_stride = CSRStorage(16, description="Bytes from a row of the frame buffer to the next.")
        base, stride = self.frame_base.storage[2:], self.frame_stride.storage[2:]
        column, row = pixel[$x], pixel[$y]
        self.comb += [
            writer.sink.address.eq(base + row * stride + column),
            writer.sink.data.eq(Cat(pixel[$b], pixel[$g], pixel[$r])),
        ]

        self.ev = EventManager()
        self.ev.frame = EventSourcePulse(description="The last pixel of a frame has been written.")
        self.ev.finalize()
        self.comb += self.ev.frame.trigger.eq(writer.sink.valid & writer.sink.ready & marks[1])

        bus = self.bus
        ports = {
            "i_clk": ClockSignal(),
            "i_rst": ResetSignal(),
            "i_s_axis_tdata": gather.source.data,
            "i_s_axis_tvalid": gather.source.valid,
            "o_s_axis_tready": gather.source.ready,
            "i_s_axis_tlast": gather.source.last,
            "o_m_axis_tdata": pixel,
            "o_m_axis_tvalid": writer.sink.valid,
            "i_m_axis_tready": writer.sink.ready,
            "o_m_axis_tuser": marks,
            "i_wb_cyc": bus.cyc,
            "i_wb_stb": bus.stb,
            "i_wb_we": bus.we,
            "i_wb_adr": bus.adr[:10],
            "i_wb_sel": bus.sel,
            "i_wb_dat_w": bus.dat_w,
            "o_wb_dat_r": bus.dat_r,
            "o_wb_ack": bus.ack,
            "o_wb_err": bus.err,
        }
$depths        self.specials += Instance("$name", **ports)

    def add_to(self, soc, name="$name", origin=None):
        """Add the registers and both masters to the bus of a SoC, and the interrupt if the SoC has a CPU.

        The SoC has this module as its member ``name``. ``origin`` is the address of the registers; without
        it LiteX chooses an address.
        """
        region = SoCRegion(origin=origin, size=0x1000, cached=False)
        soc.bus.add_slave(f"{name}_registers", self.bus, region)
        soc.bus.add_master(f"{name}_reader", self.reader.bus)
        soc.bus.add_master(f"{name}_writer", self.writer.bus)
        if soc.irq.enabled:
            soc.irq.add(name, use_loc_if_exists=True)
''')

_SIZE_TEXT = """\
    size : (int, int)
        Width and height of the largest picture, for the memory of depths.
"""


def files(core: Core) -> dict[str, str]:
    """Texts of the package, by path. `InputError` if a span of the core is not a number of words."""
    given, made = core.layouts
    if given.size % 4:
        reason = f"a span of {given.size} bytes is not a number of words of 4 bytes"
        raise InputError("--package litex", reason, "give --lights 1 or more")
    sources = {f"{core.name}.v": core.verilog}
    if has_depths(core):
        sources[f"{core.name}_depths.v"] = depth_memory(core, MARK)
    text = _MODULE.substitute(
        name=core.name,
        class_name=core.name[0].upper() + core.name[1:],
        mark=MARK,
        title=core.title.capitalize(),
        sources=", ".join(f'"{file}"' for file in sources) + ("," if len(sources) == 1 else ""),
        size_text=_SIZE_TEXT if has_depths(core) else "",
        size_parameter=", size=(640, 480)" if has_depths(core) else "",
        given_bits=8 * given.size,
        made_bits=8 * made.size,
        depths=_depths(core) if has_depths(core) else "",
        **{name: _slice(made, name) for name in "xyrgb"},
    )
    documents = {f"{core.name}{suffix}": text for suffix, text in core.documents.items()}
    return {f"{core.name}_litex.py": text} | sources | documents


def _slice(layout: ByteLayout, name: str) -> str:
    """Bits of a field of a beat, as an index."""
    index = next(k for k, field in enumerate(layout.fields) if field.name == name)
    first = 8 * layout.offsets[index]
    return f"{first}:{first + layout.fields[index].width}"


def _depths(core: Core) -> str:
    """Lines that join the core to its memory of depths."""
    memory = {port: bits for port, bits in core.ports.items() if port.startswith(DEPTH_PORTS)}
    lines = [f"{port} = Signal({abs(bits)})" for port, bits in memory.items()]
    of_core = [f'"{"o" if bits < 0 else "i"}_{port}": {port},' for port, bits in memory.items()]
    of_memory = [
        f"{'i' if bits < 0 else 'o'}_{port.removeprefix(DEPTH_PORTS)}={port},"
        for port, bits in memory.items()
    ]
    lines += ["ports |= {", *(f"    {line}" for line in of_core), "}"]
    lines += ["self.specials += Instance(", f'    "{core.name}_depths",', "    p_WIDTH=size[0],"]
    lines += [
        "    p_HEIGHT=size[1],",
        "    i_clk=ClockSignal(),",
        *(f"    {line}" for line in of_memory),
        ")",
    ]
    return "".join(f"        {line}\n" for line in lines)
