# amaranth: UnusedElaboratable=no
"""The pins of a loader on each board."""

from importlib.util import find_spec

import pytest
from amaranth.hdl import Module
from amaranth.lib import data, wiring
from amaranth.lib.wiring import Out

from blysk.bench.tools.board_design import BoardTop
from blysk.bench.tools.boards import BOARDS
from blysk.golden.bus.flash_reader import FlashReader
from blysk.golden.bus.loader import Loader
from blysk.golden.bus.packet_decoder import PacketDecoder
from blysk.golden.bus.uart_receiver import UartReceiver
from blysk.golden.video.clock_plan import clock_plan
from blysk.golden.video.display_timing import VGA
from blysk.golden.video.memory_contents import MemoryContents
from blysk.hdl.bus.loader import loader_members

PINS = {
    "ulx3s-25f": {"M1", "R2", "W2", "V2", "W1", "Y2", "B2", "C2"},
    "icepi-zero": {"K16", "N8", "T8", "T7", "M7", "N7", "E13", "D14"},
}
"""From the boards' schematics: line, flash without its clock, two lamps."""


class Pins(wiring.Component):
    """A component with members, and nothing inside."""

    def elaborate(self, platform):
        return Module()


@pytest.mark.parametrize("name", PINS)
def test_pins_of_a_loader(name):
    """The line, the flash and the lamps are at the board's pins. The clock of the flash has its own cell."""
    if find_spec("amaranth_boards") is None:
        pytest.skip("the Python package amaranth-boards is not installed")
    board = BOARDS[name]
    decoder = PacketDecoder((MemoryContents("words", 8, 1),))
    members = loader_members(Loader(decoder, UartReceiver(280), FlashReader(0)))
    top = Pins({"pairs": Out(data.ArrayLayout(2, 4)), **members})
    plan = clock_plan(board.reference, VGA.pixel_rate, 52.5e6)
    files = board.make().prepare(BoardTop(board, top, plan), "top", debug_verilog=False).files
    text = {name: of if isinstance(of, str) else of.decode() for name, of in files.items()}
    sites = {line.split('"')[3] for line in text["top.lpf"].splitlines() if line.startswith("LOCATE")}
    assert sites >= PINS[name]
    assert "USRMCLK" in text["top.il"]
