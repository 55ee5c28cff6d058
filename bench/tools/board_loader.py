"""Loader of a board: its parts by the board's clock, and its pins."""

from dataclasses import replace
from typing import Any

from amaranth.hdl import Instance, Module
from amaranth.lib import io
from amaranth.lib.wiring import Component

from blysk.bench.tools.boards import Board
from blysk.golden.bus.flash_reader import FlashReader
from blysk.golden.bus.loader import BAUD, Loader
from blysk.golden.bus.packets import stream_of
from blysk.golden.bus.uart_receiver import UartReceiver
from blysk.golden.gpu import Gpu
from blysk.golden.video.clock_plan import ClockPlan
from blysk.golden.video.draw_unit import Room
from blysk.sim.errors import InputError

__all__ = ["FLASH_OFFSET", "connect_loader", "loader_of", "sent_by"]

FLASH_OFFSET = 0x400000
"""Offset in the flash of the bytes for a loader. Bitstreams of an 85F take the first 2 MB at most."""

_FLAGS = 6000
"""Flags after the first packet. At 3 Mbaud they take 20 ms, longer than any band that is in time."""

_LEAST_CLOCK = 30e6
"""Least drawing clock in Hz. A byte takes 100 cycles of this clock, and writing a packet takes 80."""

_LAMPS = ("resting", "dropped")
"""Outputs of the loader that are shown by the first lamps of a board."""


def loader_of(gpu: Gpu, plan: ClockPlan, kind: str, mesh: str, first: Gpu, room: Room) -> Gpu:
    """The drawing with a loader, and with memories that have room for other meshes.

    Parameters
    ----------
    gpu : Gpu
        The drawing.
    plan : ClockPlan
        Clocks. The divisor of the line depends on the drawing clock.
    kind : str
        One of `LOADERS`.
    mesh : str
        Name of the drawing's mesh.
    first : Gpu
        Drawing for which the bitstream is made.
    room : Room
        Room of the memories of the bitstream.

    Raises
    ------
    InputError
        If the drawing clock is too slow for the line. If the drawing does not fit the memories of the first
        drawing, or is of another design.
    """
    clock = float(plan.rates["sync"])
    if kind != "flash" and clock < _LEAST_CLOCK:
        raise InputError(
            "--clock",
            f"a loader at {BAUD / 1e6:g} Mbaud needs {_LEAST_CLOCK / 1e6:g} MHz, not {clock / 1e6:g}",
            "give a faster --clock, or --loader flash",
        )
    uart = None if kind == "flash" else UartReceiver.of(clock, BAUD)
    flash = None if kind == "uart" else FlashReader(FLASH_OFFSET)
    try:
        drawings = [each.drawing.padded(room) for each in (gpu, first)]
    except ValueError as error:
        remedy = "use a smaller mesh, or make a bitstream for it"
        raise InputError(f"mesh {mesh}", f"does not fit the bitstream: {error}", remedy) from error
    mine, theirs = (Loader.of(drawing, uart, flash) for drawing in drawings)
    if mine.decoder.start != theirs.decoder.start:
        raise InputError(
            f"mesh {mesh}",
            "has another design than the bitstream: other materials, lights, vertex colours or textures",
            "give --materials one, or make a bitstream for it",
        )
    return replace(gpu, drawing=drawings[0], loader=mine)


def sent_by(gpu: Gpu) -> bytes:
    """Bytes that load the words of a drawing's memories, by a line or from a flash.

    Parameters
    ----------
    gpu : Gpu
        The drawing, with its loader.
    """
    return stream_of(gpu.drawing.memories, gpu.loader.decoder.start, _FLAGS)


def connect_loader(m: Module, platform: Any, board: Board, gpu: Component) -> None:
    """Connect the members of a loader to the pins of a board: serial line, flash, two lamps.

    Parameters
    ----------
    m : Module
        Module that gets the pins.
    platform : Platform
        Platform of amaranth-boards.
    board : Board
        The board.
    gpu : Component
        The component. Members that it lacks are not connected.
    """
    members = gpu.signature.members
    if "line" in members:
        uart = _requested(platform, "uart")
        m.submodules.line = line = io.Buffer("i", uart.rx)
        m.d.comb += gpu.line.eq(line.i)
    if "flash" in members:
        _connect_flash(m, _requested(platform, board.flash), gpu.flash)
    for number, name in enumerate(name for name in _LAMPS if name in members):
        port = platform.request("led", number, dir="-")
        m.submodules[f"lamp_{name}"] = lamp = io.Buffer("o", port)
        m.d.comb += lamp.o.eq(getattr(gpu, name))


def _connect_flash(m: Module, port: Any, pins: Any) -> None:
    """Connect a flash. Its clock is the clock of configuration, which an ECP5 gives by a cell of its own."""
    for name, value in (("cs", pins.select), ("copi", pins.to), ("wp", 0), ("hold", 0)):
        m.submodules[f"flash_{name}"] = pin = io.Buffer("o", getattr(port, name))
        m.d.comb += pin.o.eq(value)
    m.submodules.flash_cipo = back = io.Buffer("i", port.cipo)
    m.d.comb += pins.back.eq(back.i)
    m.submodules.flash_clock = Instance("USRMCLK", i_USRMCLKI=pins.clock, i_USRMCLKTS=0)


def _requested(platform: Any, name: str) -> Any:
    """Ports of a resource, without buffers."""
    pins = [pin.name for pin in platform.lookup(name, 0).ios if hasattr(pin, "ios")]
    return platform.request(name, 0, dir=dict.fromkeys(pins, "-"))
