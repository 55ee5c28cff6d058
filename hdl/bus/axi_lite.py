"""AXI4-Lite: a subordinate in front of registers."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.registers import ADDRESS_BITS, WORD_BITS
from blysk.hdl.bus.registers import front_members

__all__ = ["AxiLite", "AxiLiteUnit"]

_OKAY, _SLVERR = 0, 2


class AxiLite(wiring.Signature):
    """Signals of AXI4-Lite, seen from the manager; AWPROT and ARPROT are left out."""

    def __init__(self):
        super().__init__(
            {
                "awaddr": Out(ADDRESS_BITS),
                "awvalid": Out(1),
                "awready": In(1),
                "wdata": Out(WORD_BITS),
                "wstrb": Out(WORD_BITS // 8),
                "wvalid": Out(1),
                "wready": In(1),
                "bresp": In(2),
                "bvalid": In(1),
                "bready": Out(1),
                "araddr": Out(ADDRESS_BITS),
                "arvalid": Out(1),
                "arready": In(1),
                "rdata": In(WORD_BITS),
                "rresp": In(2),
                "rvalid": In(1),
                "rready": Out(1),
            }
        )


class AxiLiteUnit(wiring.Component):
    """Adapter from AXI4-Lite to accesses, one at a time. If a read and a write wait, they take turns.

    An address and a word wait in a register each. So every ready and every valid is a register, and no
    combinational path joins two of them. A refused access gets the answer SLVERR.

    Members
    -------
    bus : :py:`In(AxiLite())`
        The bus.
    i : :py:`Out(stream.Signature(access_shape()))`
        Accesses.
    o : :py:`In(stream.Signature(answer_shape()))`
        Answers to the accesses.

    Source: docs/theory/bus.md#registers.
    """

    def __init__(self):
        super().__init__(front_members(AxiLite()))

    def elaborate(self, platform):
        """Registers of the three input channels and of the two output channels."""
        m = Module()
        bus, access, answer = self.bus, self.i, self.o
        address = {name: Signal(ADDRESS_BITS, name=f"{name}_address") for name in ("write", "read")}
        word, strobe = Signal(WORD_BITS, name="word"), Signal(WORD_BITS // 8, name="word_strobe")
        has_write, has_word, has_read = (Signal(name=name) for name in ("has_write", "has_word", "has_read"))
        channels = (
            (bus.awvalid, bus.awready, has_write, [address["write"].eq(bus.awaddr)]),
            (bus.wvalid, bus.wready, has_word, [word.eq(bus.wdata), strobe.eq(bus.wstrb)]),
            (bus.arvalid, bus.arready, has_read, [address["read"].eq(bus.araddr)]),
        )
        for valid, ready, full, taken in channels:
            m.d.comb += ready.eq(~full)
            with m.If(valid & ready):
                m.d.sync += [full.eq(1), *taken]

        # ``writes``: the access is a write. ``asked``: its answer is awaited. ``last``: the access before it
        # was a write.
        writes, asked, last = Signal(name="writes"), Signal(name="asked"), Signal(name="last_writes")
        begins = Signal(name="begins")
        # A response that is not taken delays only accesses of its own kind.
        write, read = has_write & has_word & ~bus.bvalid, has_read & ~bus.rvalid
        m.d.comb += begins.eq(~asked & ~access.valid & (write | read))
        with m.If(begins):
            m.d.sync += [writes.eq(write & ~(read & last)), access.valid.eq(1)]
        m.d.comb += [
            access.payload.write.eq(writes),
            access.payload.data.eq(word),
            access.payload.strobe.eq(strobe),
            answer.ready.eq(asked),
        ]
        with m.If(writes):
            m.d.comb += access.payload.address.eq(address["write"])
        with m.Else():
            m.d.comb += access.payload.address.eq(address["read"])
        with m.If(access.valid & access.ready):
            m.d.sync += [access.valid.eq(0), asked.eq(1), last.eq(writes)]

        with m.If(bus.bready):
            m.d.sync += bus.bvalid.eq(0)
        with m.If(bus.rready):
            m.d.sync += bus.rvalid.eq(0)
        response = Mux(answer.payload.error, _SLVERR, _OKAY)
        with m.If(asked & answer.valid):
            m.d.sync += asked.eq(0)
            with m.If(writes):
                m.d.sync += [bus.bvalid.eq(1), has_write.eq(0), has_word.eq(0)]
                m.d.sync += bus.bresp.eq(response)
            with m.Else():
                m.d.sync += [bus.rvalid.eq(1), bus.rdata.eq(answer.payload.data), has_read.eq(0)]
                m.d.sync += bus.rresp.eq(response)
        return m
