"""Flash reader: the bytes of a serial flash from an offset to their end mark."""

from amaranth.hdl import Array, Cat, Const, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.flash_reader import FlashReader
from blysk.golden.bus.packets import END, FLAG

__all__ = ["FlashReaderUnit", "flash_pins"]

_WAKE = 16
"""Bits of the clock before the flash is selected."""


def flash_pins() -> wiring.Signature:
    """Pins of a serial flash: select (1 is selected), clock, data to the flash, and data from the flash."""
    return wiring.Signature({"select": Out(1), "clock": Out(1), "to": Out(1), "back": In(1)})


class FlashReaderUnit(wiring.Component):
    """Reads a serial flash once after the reset. `FlashReader` is the bit-accurate model.

    A bit takes four cycles. The clock is low in the first two cycles. The flash takes a bit when the clock
    rises, and gives the next bit when the clock falls. The bit is taken in the fourth cycle. While a byte
    waits, the clock stands. The unit has no multipliers.

    Parameters
    ----------
    model : FlashReader
        Bit-accurate model, with the offset.

    Members
    -------
    pins : :py:`Out(flash_pins())`
        Pins of the flash.
    o : :py:`Out(stream.Signature(8))`
        Bytes.
    busy : :py:`Out(1)`
        High until the end mark, or until the first byte is no flag.

    Source: docs/theory/bus.md#loader; not in the documents.
    """

    def __init__(self, model: FlashReader):
        self.model = model
        super().__init__({"pins": Out(flash_pins()), "o": Out(stream.Signature(8)), "busy": Out(1, init=1)})

    def elaborate(self, platform):
        """A counter of cycles and bits, and a register that the bits are shifted into."""
        m = Module()
        phase, bit = Signal(2, name="phase"), Signal(5, name="bit")
        byte, first, selected = Signal(8, name="byte"), Signal(name="first", init=1), Signal(name="selected")
        sent = Array(Const(self.model.command, 32)[::-1])[bit]
        last = phase == 3
        m.d.comb += [
            self.pins.select.eq(selected),
            self.pins.clock.eq(phase[1]),
            self.o.payload.eq(byte),
            self.busy.eq(1),
        ]

        def turn(bits: int, following: str) -> None:
            m.d.sync += phase.eq(phase + 1)
            with m.If(last):
                m.d.sync += bit.eq(bit + 1)
                with m.If(bit == bits - 1):
                    m.d.sync += bit.eq(0)
                    m.next = following

        with m.FSM(name="state"):
            with m.State("wake"):
                turn(_WAKE, "select")
            with m.State("select"):
                m.d.sync += selected.eq(1)
                m.next = "command"
            with m.State("command"):
                m.d.comb += self.pins.to.eq(sent)
                turn(32, "byte")
            with m.State("byte"):
                with m.If(last):
                    m.d.sync += byte.eq(Cat(self.pins.back, byte))
                turn(8, "give")
            with m.State("give"):
                ends = (byte == END) | (first & (byte != FLAG))
                m.d.comb += self.o.valid.eq(~ends)
                with m.If(ends):
                    m.d.sync += selected.eq(0)
                    m.next = "end"
                with m.Elif(self.o.ready):
                    m.d.sync += first.eq(0)
                    m.next = "byte"
            with m.State("end"):
                m.d.comb += self.busy.eq(0)
        return m
