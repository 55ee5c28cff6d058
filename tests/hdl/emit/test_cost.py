"""Costs are counted right for a component made for this test. Costs of units are baselines."""

from amaranth.hdl import Cat, Module, Signal, signed, unsigned
from amaranth.lib import memory, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.hdl.emit.cost import Cost, cost_of


class Sample(Component):
    """Two multipliers, one with a sign-extended operand; a product by a constant; 16 registers; two
    memories."""

    i: In(stream.Signature(signed(16)))
    o: Out(stream.Signature(unsigned(16)))

    def elaborate(self, platform):
        m = Module()
        m.submodules.table = table = memory.Memory(shape=4, depth=8, init=range(8))
        m.submodules.store = store = memory.Memory(shape=2, depth=4, init=[])
        read, look, write = table.read_port(domain="comb"), store.read_port(domain="comb"), store.write_port()
        low = Signal(signed(7))
        extended = Signal(signed(12))
        m.d.comb += [
            low.eq(self.i.payload),
            extended.eq(low),
            read.addr.eq(self.i.payload),
            look.addr.eq(self.i.payload),
            write.addr.eq(self.i.payload),
            write.data.eq(self.i.payload),
            write.en.eq(self.i.valid),
            self.i.ready.eq(1),
            self.o.valid.eq(1),
        ]
        parity = Signal(16)
        product = Signal(80)
        m.d.comb += [
            product.eq(Cat(extended * self.i.payload, self.i.payload * low * 5, read.data, look.data)),
            parity.eq(product.xor()),
        ]
        m.d.sync += self.o.payload.eq(Cat(product[:15], parity[0]))
        return m


def test_counts():
    cost = cost_of(Sample())
    # Three multipliers, two memories, the register, the sum of bits, and the enable of the write port.
    assert cost == Cost(8, {(16, 7): 2}, 1, 16, rom_bits=32, ram_bits=8)
    assert cost.multiplier_count == 2
