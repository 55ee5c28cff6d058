"""Small components of many kinds, a component that breaks the rules of a stream, and runs of both engines."""

import numpy as np
from amaranth.hdl import Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, stream
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines.simulate import simulate

PAIR = data.StructLayout({"x": unsigned(16), "y": signed(18)})


def refused(component):
    """A component that is never elaborated, without Amaranth's warning."""
    component._MustUse__silence = True
    return component


def pairs(count, seed=1):
    rng = np.random.default_rng(seed)
    return {"x": rng.integers(0, 1 << 16, count), "y": rng.integers(-(1 << 17), 1 << 17, count)}


class Register(Component):
    """``2 y + 1`` through one register. Ready depends on the sink's ready."""

    i: In(stream.Signature(PAIR))
    o: Out(stream.Signature(signed(19)))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += [self.o.valid.eq(self.i.valid), self.o.payload.eq(2 * self.i.payload.y + 1)]
        return m

    @staticmethod
    def model(beats):
        return 2 * beats["y"].astype(np.int64) + 1


class Expander(Component):
    """``x mod 8`` output beats for each input beat, with their index and ``y``.

    There is none if ``x mod 8`` is 0.
    """

    i: In(stream.Signature(PAIR))
    o: Out(stream.Signature(data.StructLayout({"index": 3, "y": signed(18)})))

    def elaborate(self, platform):
        m = Module()
        left, index, y, free = Signal(3), Signal(3), Signal(signed(18)), Signal()
        m.d.comb += [free.eq(~self.o.valid | self.o.ready), self.i.ready.eq((left == 0) & free)]
        with m.If(self.i.ready & self.i.valid):
            m.d.sync += [left.eq(self.i.payload.x), index.eq(0), y.eq(self.i.payload.y)]
        with m.If(free):
            m.d.sync += [self.o.valid.eq(left != 0), self.o.payload.index.eq(index), self.o.payload.y.eq(y)]
            with m.If(left != 0):
                m.d.sync += [left.eq(left - 1), index.eq(index + 1)]
        return m

    @staticmethod
    def model(beats):
        rows = [(k, y) for x, y in zip(beats["x"], beats["y"], strict=True) for k in range(x % 8)]
        return np.array(rows, dtype="u1, i4")


class Lookup(Component):
    """``table[x mod 50] - y`` from a ROM in a submodule. Its last rows are missing and read as 0."""

    i: In(stream.Signature(PAIR))
    o: Out(stream.Signature(signed(20)))

    class Table(Component):
        address: In(6)
        enable: In(1)
        data: Out(16)

        def elaborate(self, platform):
            m = Module()
            init = [row * row * 3 for row in range(50)]
            m.submodules.rom = rom = Memory(shape=16, depth=50, init=init)
            port = rom.read_port()
            m.d.comb += [port.addr.eq(self.address), port.en.eq(self.enable), self.data.eq(port.data)]
            return m

    def elaborate(self, platform):
        m = Module()
        m.submodules.table = table = self.Table()
        y, valid = Signal(signed(18)), Signal()
        m.d.comb += [
            self.i.ready.eq(~self.o.valid | self.o.ready),
            table.address.eq(self.i.payload.x),
            table.enable.eq(self.i.ready),
        ]
        with m.If(self.i.ready):
            m.d.sync += [
                y.eq(self.i.payload.y),
                valid.eq(self.i.valid),
                self.o.valid.eq(valid),
                self.o.payload.eq(table.data.as_signed() - y),
            ]
        return m

    @staticmethod
    def model(beats):
        row = beats["x"].astype(np.int64) % 64
        return np.where(row < 50, row * row * 3, 0) - beats["y"]


class Accumulator(Component):
    """Writes fill a memory. A beat gives ``scale * memory[x mod 4] + y``, and the status counts."""

    i: In(stream.Signature(PAIR))
    o: Out(stream.Signature(signed(40)))
    write: In(stream.Signature(data.StructLayout({"row": 2, "value": signed(12)})))
    constants: In(data.StructLayout({"scale": data.ArrayLayout(signed(9), 2), "unused": 40}))
    status: Out(data.StructLayout({"writes": 8, "total": signed(30), "busy": 1}))

    def elaborate(self, platform):
        m = Module()
        m.submodules.memory = memory = Memory(shape=signed(12), depth=4, init=[])
        store, fetch = memory.write_port(), memory.read_port(domain="comb")
        beat = Signal()
        m.d.comb += [
            # A write is taken in every second cycle.
            self.write.ready.eq(beat),
            store.addr.eq(self.write.payload.row),
            store.data.eq(self.write.payload.value),
            store.en.eq(self.write.valid & self.write.ready),
            fetch.addr.eq(self.i.payload.x),
            self.i.ready.eq(~self.o.valid | self.o.ready),
            self.status.busy.eq(self.o.valid),
        ]
        m.d.sync += beat.eq(~beat)
        with m.If(store.en):
            m.d.sync += self.status.writes.eq(self.status.writes + 1)
        with m.If(self.i.ready):
            scale = Mux(self.i.payload.x[2], self.constants.scale[1], self.constants.scale[0])
            m.d.sync += [
                self.o.valid.eq(self.i.valid),
                self.o.payload.eq(scale * fetch.data + self.i.payload.y),
            ]
            with m.If(self.i.valid):
                m.d.sync += self.status.total.eq(self.status.total + self.i.payload.y)
        return m


ALL = [Register, Expander, Lookup]


class Plain(Component):
    """Members of plain signed shapes, ``i * constants + status``. A write sets the status."""

    i: In(stream.Signature(signed(18)))
    o: Out(stream.Signature(signed(36)))
    constants: In(signed(16))
    write: In(stream.Signature(signed(5)))
    status: Out(signed(7))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += [self.write.ready.eq(1), self.i.ready.eq(~self.o.valid | self.o.ready)]
        with m.If(self.write.valid):
            m.d.sync += self.status.eq(self.write.payload)
        with m.If(self.i.ready):
            m.d.sync += [
                self.o.valid.eq(self.i.valid),
                self.o.payload.eq(self.i.payload * self.constants + self.status),
            ]
        return m


class Faulty(Component):
    """A register that breaks one rule."""

    i: In(stream.Signature(PAIR))
    o: Out(stream.Signature(signed(18)))

    def __init__(self, fault):
        super().__init__()
        self.fault = fault

    def elaborate(self, platform):
        m = Module()
        age = Signal(8)
        free = Signal()
        m.d.comb += [free.eq(~self.o.valid | self.o.ready), self.i.ready.eq(free)]
        with m.If(self.i.valid & self.i.ready & (age != 255)):
            m.d.sync += age.eq(age + 1)
        with m.If(free):
            m.d.sync += [self.o.valid.eq(self.i.valid), self.o.payload.eq(self.i.payload.y)]
        if self.fault == "drops":
            with m.If(self.o.valid & ~self.o.ready):
                m.d.sync += self.o.valid.eq(0)
        elif self.fault == "changes":
            with m.If(self.o.valid & ~self.o.ready):
                m.d.sync += self.o.payload.eq(self.o.payload + 1)
        elif self.fault == "loses":
            with m.If(self.i.valid & self.i.ready & (age == 7)):
                m.d.sync += self.o.valid.eq(0)
        elif self.fault == "deadlocks":
            m.d.comb += self.i.ready.eq(free & (age < 7))
            with m.If(age >= 7):
                m.d.sync += self.o.valid.eq(0)
        elif self.fault == "invents":
            again = Signal()
            with m.If(free & ~self.i.valid & (age == 20) & ~again):
                m.d.sync += [self.o.valid.eq(1), again.eq(1)]
        return m


def assert_equal(first, second):
    assert first.beats.dtype == second.beats.dtype
    np.testing.assert_array_equal(first.beats, second.beats)
    np.testing.assert_array_equal(first.cycles, second.cycles)
    np.testing.assert_array_equal(first.input_cycles, second.input_cycles)
    assert first.total_cycles == second.total_cycles
    assert first.status == second.status


def both(component, beats, count, **options):
    """A run of both engines, which must agree."""
    slow, fast = (
        simulate(component, beats, count=count, engine=engine, **options) for engine in ("pysim", "cxxrtl")
    )
    assert (slow.engine, fast.engine) == ("pysim", "cxxrtl")
    assert_equal(slow, fast)
    return fast
