"""Loader: writes memories from a serial line, and from a flash after power-up."""

import zlib
from dataclasses import dataclass

from blysk.golden.bus.flash_reader import FlashReader
from blysk.golden.bus.packet_decoder import COUNTERS, PacketDecoder
from blysk.golden.bus.uart_receiver import UartReceiver
from blysk.golden.video.draw_unit import Drawing

__all__ = ["BAUD", "STATUS", "Loader"]

BAUD = 3_000_000
"""Bits a second of the serial line."""

STATUS = (*COUNTERS, "framing", "overruns")
"""Counters: those of the decoder, then framing errors, and bytes for which the line had to wait.

A line cannot wait, so a byte after an overrun may be lost.
"""


@dataclass(frozen=True)
class Loader:
    """Loads the memories of a drawing, while the drawing rests.

    After each right packet the drawing takes up no band for ``rest`` cycles. The flash is read first, and the
    drawing begins when it has been read.

    Parameters
    ----------
    decoder : PacketDecoder
        The memories.
    uart : UartReceiver, optional
        The serial line. ``None``: there is no line.
    flash : FlashReader, optional
        The flash. ``None``: there is no flash.
    rest : int
        Cycles after a packet in which the drawing rests.

    Raises
    ------
    ValueError
        If there is neither a line nor a flash.

    Source: docs/theory/bus.md#loader; not in the documents.
    """

    decoder: PacketDecoder
    uart: UartReceiver | None = None
    flash: FlashReader | None = None
    rest: int = (1 << 21) - 1

    def __post_init__(self) -> None:
        if self.uart is None and self.flash is None:
            raise ValueError("a loader needs a serial line or a flash")

    @classmethod
    def of(
        cls,
        drawing: Drawing,
        uart: UartReceiver | None = None,
        flash: FlashReader | None = None,
        rest: int = (1 << 21) - 1,
    ) -> "Loader":
        """Loader of a drawing's memories.

        The CRC begins with what the words of the memories depend on. So packets for another drawing are
        damaged, and nothing is written.
        """
        design = drawing.renderer.design
        memories = [(of.name, of.width, of.depth) for of in drawing.memories]
        frames = [sorted(frame.codes.items()) for frame in drawing.frames]
        shading = design.method, design.model, design.transfer, design.lights, design.materials
        known = repr((memories, drawing.commands.starts, frames, shading, drawing.size, drawing.lines))
        decoder = PacketDecoder(drawing.memories, zlib.crc32(known.encode()))
        return cls(decoder, uart, flash, rest)
