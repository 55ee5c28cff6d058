"""Loader: writes memories from a serial line, and from a flash after power-up."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.loader import STATUS, Loader
from blysk.golden.bus.packet_decoder import COUNTERS
from blysk.hdl.bus.flash_reader import FlashReaderUnit, flash_pins
from blysk.hdl.bus.packet_decoder import PacketDecoderUnit, write_shape
from blysk.hdl.bus.uart_receiver import UartReceiverUnit
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import copy_fields
from blysk.hdl.geometry.triangles import count_events, counters_shape

__all__ = ["LoaderUnit", "loader_members"]


def loader_members(model: Loader) -> dict[str, wiring.Member]:
    """Members of a loader at the border of a chip."""
    members = {"resting": Out(1), "dropped": Out(1)}
    if model.uart is not None:
        members["line"] = In(1, init=1)
    if model.flash is not None:
        members["flash"] = Out(flash_pins())
    return members


class LoaderUnit(wiring.Component):
    """Writes words of packets, while the drawing rests. `Loader` has the bit-accurate models of its parts.

    Parameters
    ----------
    model : Loader
        The decoder, the line and the flash.

    Members
    -------
    o : :py:`Out(stream.Signature(write_shape(decoder)))`
        Words to write.
    resting : :py:`Out(1)`
        High while the drawing must not begin a band: while the flash is read, while a word waits, and for
        ``rest`` cycles after a right packet.
    dropped : :py:`Out(1)`
        High after a packet or a byte was dropped.
    status : :py:`Out(counters_shape(*STATUS))`
        Counters since the reset.
    line : :py:`In(1)`
        The serial line, from any clock. Only with a `UartReceiver`.
    flash : :py:`Out(flash_pins())`
        Pins of the flash. Only with a `FlashReader`.

    Source: docs/theory/bus.md#loader; not in the documents.
    """

    def __init__(self, model: Loader):
        self.model = model
        self.decoder = PacketDecoderUnit(model.decoder)
        super().__init__(
            {
                "o": Out(stream.Signature(write_shape(model.decoder))),
                "status": Out(counters_shape(*STATUS)),
                **loader_members(model),
            }
        )

    def elaborate(self, platform):
        """The parts, the choice of their bytes, and the time of rest."""
        m = Module()
        m.submodules.decoder = decoder = self.decoder
        lost, framed, reads = Signal(name="lost"), Signal(name="framed"), Signal(name="reads")
        taken = decoder.i
        if self.model.flash is not None:
            m.submodules.flash = flash = FlashReaderUnit(self.model.flash)
            wiring.connect(m, wiring.flipped(self.flash), flash.pins)
            m.d.comb += reads.eq(flash.busy)
        if self.model.uart is not None:
            self._line(m, lost, framed, reads)
        if self.model.flash is not None:
            with m.If(reads):
                m.d.comb += [
                    taken.payload.eq(flash.o.payload),
                    taken.valid.eq(flash.o.valid),
                    flash.o.ready.eq(taken.ready),
                ]
        left = Signal(range(self.model.rest + 1), name="rest")
        with m.If(decoder.accepted):
            m.d.sync += left.eq(self.model.rest)
        with m.Elif(left.any()):
            m.d.sync += left.eq(left - 1)
        dropped = Signal(name="was_dropped")
        with m.If(decoder.dropped | lost | framed):
            m.d.sync += dropped.eq(1)
        connect(m, decoder.o, self.o)
        m.d.comb += [
            self.resting.eq(reads | decoder.o.valid | left.any()),
            self.dropped.eq(dropped),
            *copy_fields(self.status, decoder.status, COUNTERS),
        ]
        return m

    def _line(self, m: Module, lost: Signal, framed: Signal, reads: Signal) -> None:
        """The receiver behind a synchroniser. Its bytes go to the decoder."""
        m.submodules.uart = uart = UartReceiverUnit(self.model.uart)
        level, waits = Signal(name="level", init=1), Signal(name="waits")
        m.submodules.level = FFSynchronizer(self.line, level, init=1)
        taken = self.decoder.i
        m.d.sync += waits.eq(~uart.i.ready)
        m.d.comb += [
            uart.i.payload.eq(level),
            uart.i.valid.eq(1),
            taken.payload.eq(uart.o.payload),
            taken.valid.eq(uart.o.valid),
            uart.o.ready.eq(Mux(reads, 0, taken.ready)),
            lost.eq(~uart.i.ready & ~waits),
            framed.eq(uart.dropped),
            self.status.framing.eq(uart.status.framing),
        ]
        count_events(m, self.status, overruns=lost)
