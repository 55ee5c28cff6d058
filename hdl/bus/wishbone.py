"""Wishbone B4, classic and pipelined: a peripheral in front of registers."""

from amaranth.hdl import Cat, Const, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.registers import ADDRESS_BITS, WORD_BITS
from blysk.hdl.bus.registers import front_members

__all__ = ["Wishbone", "WishboneUnit"]

_WORD_ADDRESS_BITS = ADDRESS_BITS - 2


class Wishbone(wiring.Signature):
    """Signals of Wishbone B4 with words of 32 bits, seen from the initiator. Addresses count words."""

    def __init__(self):
        super().__init__(
            {
                "cyc": Out(1),
                "stb": Out(1),
                "we": Out(1),
                "adr": Out(_WORD_ADDRESS_BITS),
                "sel": Out(WORD_BITS // 8),
                "dat_w": Out(WORD_BITS),
                "dat_r": In(WORD_BITS),
                "ack": In(1),
                "err": In(1),
                "stall": In(1),
            }
        )


class WishboneUnit(wiring.Component):
    """Adapter from Wishbone to accesses, one at a time.

    A request is taken on a cycle on which ``stall`` is low. From the next cycle to the cycle of ``ack`` or
    ``err`` ``stall`` is high. A classic initiator keeps ``stb`` until its answer, and so asks once. A
    pipelined initiator waits. Neither needs other wiring. A classic initiator leaves ``stall`` open. If an
    initiator ends the bus cycle before the answer, it gets no answer. Its write may have been made. ``ack``,
    ``err`` and ``stall`` are registers.

    Members
    -------
    bus : :py:`In(Wishbone())`
        The bus.
    i : :py:`Out(stream.Signature(access_shape()))`
        Accesses.
    o : :py:`In(stream.Signature(answer_shape()))`
        Answers to the accesses.

    Source: docs/theory/bus.md#registers.
    """

    def __init__(self):
        super().__init__(front_members(Wishbone()))

    def elaborate(self, platform):
        """The request in a register, and its answer in another register."""
        m = Module()
        bus, access, answer = self.bus, self.i, self.o
        busy, dropped = Signal(name="request_busy"), Signal(name="dropped")
        m.d.comb += [bus.stall.eq(busy), answer.ready.eq(1)]
        with m.If(access.ready):
            m.d.sync += access.valid.eq(0)
        with m.If(bus.cyc & bus.stb & ~busy):
            m.d.sync += [
                busy.eq(1),
                dropped.eq(0),
                access.valid.eq(1),
                access.payload.address.eq(Cat(Const(0, 2), bus.adr)),
                access.payload.write.eq(bus.we),
                access.payload.data.eq(bus.dat_w),
                access.payload.strobe.eq(bus.sel),
            ]
        with m.Elif(busy & ~bus.cyc):
            m.d.sync += dropped.eq(1)
        m.d.sync += [bus.ack.eq(0), bus.err.eq(0)]
        with m.If(busy & answer.valid):
            given = bus.cyc & ~dropped
            m.d.sync += [
                bus.ack.eq(given & ~answer.payload.error),
                bus.err.eq(given & answer.payload.error),
                bus.dat_r.eq(answer.payload.data),
            ]
        ends = Signal(name="ends")
        m.d.sync += ends.eq(busy & answer.valid)
        with m.If(ends):
            m.d.sync += busy.eq(0)
        return m
