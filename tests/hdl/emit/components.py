# amaranth: UnusedElaboratable=no
# A component that is refused is never elaborated; the line above switches off the warning.
"""Components for the tests of the Verilog writer."""

from amaranth.hdl import Array, Cat, Module, Signal, signed
from amaranth.lib import data, enum, fifo, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.hdl.core.fixed import SQ, UQ

SPAN = data.StructLayout({"x": 12, "normal": data.ArrayLayout(SQ(1, 17), 3), "last": 1})
PIXEL = data.StructLayout({"x": 12, "r": UQ(0, 8), "total": signed(37)})
CONSTANTS = data.StructLayout({"gain": SQ(2, 7), "on": 1})
WRITE = data.StructLayout({"address": 4, "data": signed(8)})


class Model(enum.Enum, shape=2):
    PHONG = 0
    BLINN = 1


class Multiplier(wiring.Component):
    a: In(signed(18))
    b: In(signed(9))
    product: Out(signed(27))

    def elaborate(self, platform):
        m = Module()
        m.d.sync += self.product.eq(self.a * self.b)
        return m


class Everything(wiring.Component):
    """Signed multipliers in submodules, a table with contents and a write port, a state machine, a FIFO."""

    i: In(stream.Signature(SPAN))
    o: Out(stream.Signature(PIXEL))
    constants: In(CONSTANTS)
    write: In(stream.Signature(WRITE, always_ready=True))
    status: Out(data.StructLayout({"busy": 1, "count": 7}))

    def elaborate(self, platform):
        m = Module()
        m.submodules.fifo = queue = fifo.SyncFIFOBuffered(width=PIXEL.size, depth=8)
        m.submodules.table = table = memory.Memory(
            shape=signed(8), depth=16, init=[37 * k % 256 - 128 for k in range(16)]
        )
        reader, writer = table.read_port(domain="sync"), table.write_port()
        products = []
        for k in range(3):
            m.submodules[f"multiplier_{k}"] = unit = Multiplier()
            m.d.comb += [
                unit.a.eq(self.i.p.normal[k].as_value()),
                unit.b.eq(self.constants.gain.as_value()),
            ]
            products.append(unit.product)
        valid, x, pixel = Signal(), Signal(12), Signal(PIXEL)
        m.d.comb += [
            writer.addr.eq(self.write.p.address),
            writer.data.eq(self.write.p.data),
            writer.en.eq(self.write.valid),
            self.i.ready.eq(queue.w_level < 5),
            reader.addr.eq(self.i.p.x[:4]),
            pixel.x.eq(x),
            pixel.total.eq(products[0] + products[1] - products[2]),
            queue.w_data.eq(pixel),
            queue.w_en.eq(valid),
            self.o.payload.eq(queue.r_data),
            self.o.valid.eq(queue.r_rdy),
            queue.r_en.eq(self.o.ready),
        ]
        m.d.sync += [valid.eq(self.i.valid & self.i.ready), x.eq(self.i.p.x)]
        red = pixel.r.as_value()
        with m.Switch(x[:2]):
            with m.Case(0):
                m.d.comb += red.eq(reader.data)
            with m.Case(1):
                m.d.comb += red.eq(-reader.data)
            with m.Case(2):
                m.d.comb += red.eq(reader.data >> x[8:10])
            with m.Default():
                m.d.comb += red.eq(Cat(x, x).bit_select(x[4:8], 8))
        with m.FSM():
            with m.State("IDLE"), m.If(valid):
                m.next = "BUSY"
            with m.State("BUSY"):
                m.d.comb += self.status.busy.eq(1)
                with m.If(~valid):
                    m.next = "IDLE"
        m.d.sync += self.status.count.eq(self.status.count + (self.constants.on & valid))
        return m


class Stages(wiring.Component):
    """A pipeline whose stages move on when the output is free."""

    i: In(stream.Signature(data.ArrayLayout(SQ(1, 17), 2)))
    o: Out(stream.Signature(SQ(2, 34)))

    def elaborate(self, platform):
        m = Module()
        move = Signal()
        m.d.comb += [move.eq(self.o.ready | ~self.o.valid), self.i.ready.eq(move)]
        before, product, valid = Signal(self.i.payload.shape()), Signal(signed(36)), Signal(2)
        with m.If(move):
            m.d.sync += [
                before.eq(self.i.payload),
                product.eq(before[0].as_value() * before[1].as_value()),
                self.o.payload.as_value().eq(product),
                Cat(valid, self.o.valid).eq(Cat(self.i.valid, valid)),
            ]
        return m


class Awkward(wiring.Component):
    """Names that are keywords, names that are equal when made plain, names with brackets; an enumeration and
    a union."""

    i: In(
        stream.Signature(
            data.StructLayout(
                {"model": Model, "word": data.UnionLayout({"code": signed(8), "bits": 8}), "spare": 0}
            )
        )
    )
    o: Out(stream.Signature(signed(9), always_valid=True))
    plain: In(5)

    def elaborate(self, platform):
        m = Module()
        names = ["bit", "reg", "final", "logic", "a.b", "a_b", "a b"[0] + "[0]", "1st", "module", "type"]
        registers = [Signal(signed(9), name=name) for name in names]
        for source, register in zip([self.i.p.word.code, *registers], registers, strict=False):
            m.d.sync += register.eq(source + 1)
        m.d.comb += self.o.payload.eq(Array(registers)[self.plain])
        m.d.comb += self.i.ready.eq(self.o.ready & (self.i.p.model == Model.BLINN))
        return m


class Combinational(wiring.Component):
    a: In(signed(4))
    b: In(6)
    o: Out(signed(8))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.o.eq(self.a - self.b)
        return m


class TwoClocks(wiring.Component):
    i: In(1)
    o: Out(1)

    def elaborate(self, platform):
        m = Module()
        m.d.other += self.o.eq(self.i)
        return m


class Alike(wiring.Component):
    i: In(data.StructLayout({"a_b": 1, "a": data.StructLayout({"b": 1})}))
    o: Out(1)

    def elaborate(self, platform):
        return Module()
