"""UART receiver: from the levels of a serial line to bytes."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.uart_receiver import FRACTION_BITS, UartReceiver
from blysk.hdl.geometry.triangles import count_events, counters_shape

__all__ = ["UartReceiverUnit"]

_STOP = 9


class UartReceiverUnit(wiring.Component):
    """Finds bytes in the levels of a line. `UartReceiver` is the bit-accurate model.

    A byte is offered in the cycle after the middle of its stop bit. The unit takes a level in each cycle, but
    not while two bytes wait. A line cannot wait, so its levels are then lost. The unit has no multipliers.

    Parameters
    ----------
    model : UartReceiver
        Bit-accurate model, with the length of a bit.

    Members
    -------
    i : :py:`In(stream.Signature(1))`
        Level of the line in each cycle, from a synchroniser.
    o : :py:`Out(stream.Signature(8))`
        Bytes.
    status : :py:`Out(counters_shape("framing"))`
        Number of bytes that were dropped, because their stop bit was 0.

    Attributes
    ----------
    dropped : Signal
        High when a byte is dropped.

    Source: docs/theory/bus.md#loader; not in the documents.
    """

    def __init__(self, model: UartReceiver):
        self.model = model
        super().__init__(
            {
                "i": In(stream.Signature(1)),
                "o": Out(stream.Signature(8)),
                "status": Out(counters_shape("framing")),
            }
        )
        self.dropped = Signal(name="dropped")

    def elaborate(self, platform):
        """A counter to the middle of the next bit, and a register that the bits are shifted into."""
        m = Module()
        divisor, cycle = self.model.divisor, 1 << FRACTION_BITS
        left = Signal(range(divisor), name="left")
        bit, byte = Signal(range(_STOP + 1), name="bit"), Signal(8, name="byte")
        offered, valid = Signal(8, name="offered"), Signal(name="valid")
        level, framing, gives = self.i.payload, self.dropped, Signal(name="gives")
        middle = ~left[FRACTION_BITS:].any()
        m.d.comb += [self.o.payload.eq(offered), self.o.valid.eq(valid)]
        with m.If(self.o.ready):
            m.d.sync += valid.eq(0)
        with m.If(gives & (~valid | self.o.ready)):
            m.d.sync += [offered.eq(byte), valid.eq(1)]
        with m.FSM(name="state"):
            with m.State("idle"):
                m.d.comb += self.i.ready.eq(1)
                m.d.sync += [left.eq(divisor // 2 - cycle), bit.eq(0)]
                with m.If(self.i.valid & ~level):
                    m.next = "bits"
            with m.State("bits"):
                m.d.comb += self.i.ready.eq(1)
                with m.If(self.i.valid):
                    m.d.sync += left.eq(left - cycle)
                    with m.If(middle):
                        m.d.sync += [left.eq(left + (divisor - cycle)), bit.eq(bit + 1)]
                        with m.If((bit == 0) & level):
                            m.next = "idle"
                        with m.If(bit == _STOP):
                            m.d.comb += framing.eq(~level)
                            m.next = "give"
                            with m.If(~level):
                                m.next = "break"
                        with m.Else():
                            m.d.sync += byte.eq(Cat(byte[1:], level))
            with m.State("give"):
                # The line is taken while the byte moves on.
                m.d.comb += [gives.eq(1), self.i.ready.eq(~valid)]
                with m.If(~valid | self.o.ready):
                    m.next = "idle"
                with m.If(~valid & self.i.valid & ~level):
                    m.d.sync += [left.eq(divisor // 2 - cycle), bit.eq(0)]
                    m.next = "bits"
            with m.State("break"):
                m.d.comb += self.i.ready.eq(1)
                with m.If(self.i.valid & level):
                    m.next = "idle"
        count_events(m, self.status, framing=framing)
        return m
