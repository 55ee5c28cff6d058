"""Both engines on components of many kinds, and on components that break the rules of a stream."""

import numpy as np
import pytest
from amaranth.hdl import Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, stream
from amaranth.lib.fifo import SyncFIFOBuffered
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines.engine import CompilerMissing, Ports, SimulationError
from blysk.sim.engines.simulate import simulate

PAIR = data.StructLayout({"x": unsigned(16), "y": signed(18)})


@pytest.fixture(autouse=True, scope="module")
def _cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BLYSK_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def refused(component):
    """A component that is never elaborated, which Amaranth would warn about."""
    component._MustUse__silence = True
    return component


def pairs(count, seed=1):
    rng = np.random.default_rng(seed)
    return {"x": rng.integers(0, 1 << 16, count), "y": rng.integers(-(1 << 17), 1 << 17, count)}


class Register(Component):
    """``2 y + 1`` through one register; ready depends on the sink's."""

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


class Pipeline(Component):
    """``x y`` and ``(x y)^2 mod 2^63`` behind three stages with a common enable."""

    i: In(stream.Signature(PAIR))
    o: Out(stream.Signature(data.StructLayout({"product": signed(34), "square": unsigned(63)})))

    def elaborate(self, platform):
        m = Module()
        x, y, product, again = Signal(16), Signal(signed(18)), Signal(signed(34)), Signal(signed(34))
        square, valid = Signal(63), Signal(3)
        m.d.comb += [
            self.i.ready.eq(~self.o.valid | self.o.ready),
            self.o.valid.eq(valid[2]),
            self.o.payload.product.eq(again),
            self.o.payload.square.eq(square),
        ]
        with m.If(self.i.ready):
            m.d.sync += [
                x.eq(self.i.payload.x),
                y.eq(self.i.payload.y),
                product.eq(x * y),
                again.eq(product),
                square.eq(product * product),
                valid.eq(valid << 1 | self.i.valid),
            ]
        return m

    @staticmethod
    def model(beats):
        product = beats["x"].astype(np.int64) * beats["y"]
        square = [value * value % (1 << 63) for value in product.tolist()]
        return np.array(list(zip(product.tolist(), square, strict=True)), dtype="i8, u8")


class Queue(Component):
    """Amaranth's own buffered queue."""

    i: In(stream.Signature(PAIR))
    o: Out(stream.Signature(PAIR))

    def elaborate(self, platform):
        m = Module()
        m.submodules.fifo = fifo = SyncFIFOBuffered(width=34, depth=5)
        m.d.comb += [
            fifo.w_data.eq(self.i.payload),
            fifo.w_en.eq(self.i.valid),
            self.i.ready.eq(fifo.w_rdy),
            self.o.payload.eq(fifo.r_data),
            self.o.valid.eq(fifo.r_rdy),
            fifo.r_en.eq(self.o.ready),
        ]
        return m

    @staticmethod
    def model(beats):
        return np.array(list(zip(beats["x"].tolist(), beats["y"].tolist(), strict=True)), dtype="u2, i4")


class Expander(Component):
    """``x mod 8`` output beats an input beat: the index in it, and ``y``. No beat where that is 0."""

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
    """``table[x mod 50] - y`` from a ROM in a submodule; its last rows are not there and read as 0."""

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
    """Writes fill a memory; a beat gives ``scale * memory[x mod 4] + y``; status counts."""

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
            # A write is taken on every other clock.
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


ALL = [Register, Pipeline, Queue, Expander, Lookup]


def assert_equal(first, second):
    assert first.beats.dtype == second.beats.dtype
    np.testing.assert_array_equal(first.beats, second.beats)
    np.testing.assert_array_equal(first.cycles, second.cycles)
    np.testing.assert_array_equal(first.input_cycles, second.input_cycles)
    assert first.total_cycles == second.total_cycles
    assert first.status == second.status


def stall_patterns(seed):
    rng = np.random.default_rng(seed)
    return {
        "free": (None, None),
        "source": (rng.random(61) < 0.5, None),
        "sink": (None, rng.random(53) < 0.5),
        "both": (rng.random(61) < 0.3, rng.random(53) < 0.7),
        "alternating": (np.array([True, False]), np.array([False, True])),
    }


@pytest.mark.parametrize("stalls", stall_patterns(5).values(), ids=stall_patterns(5).keys())
@pytest.mark.parametrize("kind", ALL)
def test_engines_agree_with_each_other_and_with_arithmetic(kind, stalls):
    beats = pairs(120)
    expected = kind.model(beats)
    runs = [
        simulate(
            kind(), beats, count=len(expected), engine=engine, input_stalls=stalls[0], output_stalls=stalls[1]
        )
        for engine in ("pysim", "cxxrtl")
    ]
    assert_equal(*runs)
    assert [run.engine for run in runs] == ["pysim", "cxxrtl"]
    beats = runs[0].beats
    assert beats.tolist() == expected.tolist()
    assert len(runs[0].cycles) == len(expected)
    assert len(runs[0].input_cycles) == 120


def test_clocks_of_a_register():
    """A beat taken at clock k comes out at k + 1 when nobody stalls, and clock 0 is the first."""
    for engine in ("pysim", "cxxrtl"):
        run = simulate(Register(), pairs(9), count=9, engine=engine)
        np.testing.assert_array_equal(run.input_cycles, np.arange(9))
        np.testing.assert_array_equal(run.cycles, np.arange(1, 10))
        assert run.total_cycles == 10


@pytest.mark.parametrize("engine", ["pysim", "cxxrtl"])
def test_stall_patterns_are_by_clock_and_an_offer_is_held(engine):
    # Offers start at cycles 1, 4, 7 ... (stall 1, 0, 1); the sink is ready at cycles 0, 5, 10, 15 ...
    run = simulate(
        Register(),
        pairs(3),
        count=3,
        engine=engine,
        input_stalls=np.array([True, False, True]),
        output_stalls=np.array([False, True, True, True, True]),
    )
    # Offered at 1 and taken, out from 2, taken at 5. Offered at 4, taken at 5 when the register is freed, out
    # at 10. Offered at 7, held until 10, out at 15.
    np.testing.assert_array_equal(run.input_cycles, [1, 5, 10])
    np.testing.assert_array_equal(run.cycles, [5, 10, 15])


@pytest.mark.parametrize("stalls", stall_patterns(6).values(), ids=stall_patterns(6).keys())
def test_constants_writes_and_status(stalls):
    beats = pairs(50)
    rows = {"row": np.array([3, 0, 1, 2, 0]), "value": np.array([-2048, 5, 2047, -1, 99])}
    constants = {"scale": np.array([-256, 255]), "unused": (1 << 40) - 1}
    runs = [
        simulate(
            Accumulator(),
            beats,
            count=50,
            engine=engine,
            constants=constants,
            write=rows,
            input_stalls=stalls[0],
            output_stalls=stalls[1],
        )
        for engine in ("pysim", "cxxrtl")
    ]
    assert_equal(*runs)
    x = beats["x"]
    memory = np.array([99, 2047, -1, -2048])
    scale = np.where(x & 4, 255, -256)
    np.testing.assert_array_equal(runs[1].beats, scale * memory[x % 4] + beats["y"])
    assert runs[1].status["writes"] == 5
    assert runs[1].status["total"] == beats["y"].sum()
    assert runs[1].status["busy"] == 0
    # Writes go at cycles 1, 3, 5, 7, 9, before any input beat.
    assert runs[1].input_cycles[0] > 9


class Plain(Component):
    """Members of plain signed shapes, ``i * constants + status``; a write sets the status."""

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


def test_plain_signed_members():
    beats = pairs(30)["y"]
    runs = [
        simulate(Plain(), beats, count=30, engine=engine, constants=-32768, write=np.array([7, -16]))
        for engine in ("pysim", "cxxrtl")
    ]
    assert_equal(*runs)
    np.testing.assert_array_equal(runs[0].beats, beats * -32768 - 16)
    assert runs[0].status == -16


def test_members_without_bits():
    class Empty(Register):
        constants: In(data.StructLayout({}))
        status: Out(unsigned(0))

    runs = [
        simulate(Empty(), pairs(5), count=5, engine=engine, constants={}) for engine in ("pysim", "cxxrtl")
    ]
    assert_equal(*runs)
    assert runs[0].status == 0


def test_count_none_takes_what_comes():
    beats = pairs(40)
    runs = [
        simulate(Expander(), beats, count=None, engine=engine, idle_timeout=50)
        for engine in ("pysim", "cxxrtl")
    ]
    assert_equal(*runs)
    assert runs[0].beats.tolist() == Expander.model(beats).tolist()


@pytest.mark.parametrize("engine", ["pysim", "cxxrtl"])
def test_no_beats(engine):
    run = simulate(Register(), pairs(0), count=0, engine=engine)
    assert (len(run.beats), len(run.cycles), run.total_cycles, run.status) == (0, 0, 0, None)


def test_one_component_many_runs():
    """Every run starts from power-up."""
    component = Accumulator()
    arguments = {"count": 20, "constants": {"scale": np.array([1, 2]), "unused": 0}}
    rows = {"row": np.array([0]), "value": np.array([7])}
    first = simulate(component, pairs(20), write=rows, **arguments)
    simulate(component, pairs(20), **arguments)
    assert_equal(first, simulate(component, pairs(20), write=rows, **arguments))


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


ONE_STALL = np.arange(20) == 13
FAULTS = {
    # Beat k waits in the register from clock k + 1 on; the sink stalls at clock 13.
    "drops": "at clock 14, output beat 12: valid went low while the beat waited for ready",
    "changes": "at clock 14, output beat 12: the payload changed while the beat waited for ready",
    "loses": "nothing moved for 100 cycles up to clock 122: 19 of 20 output beats came, "
    "20 of 20 input beats and 0 of 0 writes were taken",
    "deadlocks": "nothing moved for 100 cycles up to clock 108: 7 of 20 output beats came, "
    "7 of 20 input beats and 0 of 0 writes were taken",
    "invents": "at clock 22, output beat 20: a beat more than the 20 expected",
}


@pytest.mark.parametrize("engine", ["pysim", "cxxrtl"])
@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_caught(fault, engine):
    with pytest.raises(SimulationError) as caught:
        simulate(Faulty(fault), pairs(20), count=20, engine=engine, output_stalls=ONE_STALL, idle_timeout=100)
    assert str(caught.value) == FAULTS[fault]


def test_no_fault_is_no_error():
    for engine in ("pysim", "cxxrtl"):
        run = simulate(
            Faulty(None), pairs(20), count=20, engine=engine, output_stalls=ONE_STALL, idle_timeout=100
        )
        np.testing.assert_array_equal(run.beats, pairs(20)["y"])


@pytest.mark.parametrize("engine", ["pysim", "cxxrtl"])
def test_a_late_extra_beat_needs_enough_settle_cycles(engine):
    """The invented beat shows at clock 22, one clock after the last of the 20."""
    arguments = {"count": 20, "engine": engine, "output_stalls": ONE_STALL}
    assert len(simulate(Faulty("invents"), pairs(20), settle=0, **arguments).beats) == 20
    with pytest.raises(SimulationError, match="a beat more"):
        simulate(Faulty("invents"), pairs(20), settle=1, **arguments)


class Members(Component):
    def __init__(self, **members):
        super().__init__({"i": In(stream.Signature(4)), "o": Out(stream.Signature(4))} | members)

    def elaborate(self, platform):
        m = Module()
        if not hasattr(self, "combinational"):
            m.d.sync += self.o.valid.eq(self.i.valid)
        return m


def test_members():
    ports = Ports(refused(Accumulator()))
    assert (ports.i, ports.o) == (PAIR, signed(40))
    assert list(ports.status.members) == ["writes", "total", "busy"]
    ports = Ports(refused(Members(extra=Out(3))))
    assert (ports.constants, ports.write, ports.status) == (None, None, None)
    for member, message in {
        "i=Out(stream.Signature(4))": r"member i must be In\(stream.Signature\)",
        "o=Out(4)": r"member o must be Out\(stream.Signature\)",
        "o=Out(stream.Signature(4, always_valid=True))": r"member o must be Out\(stream.Signature\)",
        "constants=Out(4)": r"member constants must be In\(shape\)",
        "constants=In(4).array(2)": r"member constants must be In\(shape\)",
        "i=In(stream.Signature(0))": "the payload of stream i has no bits",
        "extra=In(1)": "Members has members that nothing drives: extra",
    }.items():
        component = refused(eval(f"Members({member})"))
        with pytest.raises(ValueError, match=message):
            Ports(component)
    with pytest.raises(ValueError, match="Table has no stream i"):
        Ports(refused(Lookup.Table()))
    with pytest.raises(TypeError, match=r"component must be a wiring\.Component, not Module"):
        Ports(refused(Module()))


@pytest.mark.parametrize("engine", ["pysim", "cxxrtl"])
def test_a_component_without_registers_is_refused(engine):
    component = Members()
    component.combinational = True
    with pytest.raises(ValueError, match="Members has nothing in the clock domain sync"):
        simulate(component, np.arange(3), count=3, engine=engine)


def test_arguments():
    beats = pairs(2)
    for arguments, message in (
        ({"engine": "verilator"}, "engine must be 'cxxrtl', 'pysim' or 'auto', not 'verilator'"),
        ({"vcd": "x.vcd"}, "waveforms need engine 'pysim', not 'cxxrtl'"),
        ({"input_stalls": np.array([True])}, "input_stalls must leave at least one clock free"),
        ({"output_stalls": np.array([], dtype=bool)}, "output_stalls must leave at least one clock free"),
        (
            {"output_stalls": np.array([0, 1])},
            r"output_stalls must be a bool array of one dimension, not int64 \(2,\)",
        ),
        ({"idle_timeout": 0}, "idle_timeout must be at least 1, not 0"),
        ({"settle": -1}, "settle must be at least 0, not -1"),
        ({"count": -1}, "count must be at least 0, not -1"),
        ({"constants": {}}, "the component has no constants"),
        ({"write": beats}, "the component has no stream write"),
    ):
        with pytest.raises(ValueError, match=message):
            simulate(refused(Register()), beats, **{"count": 2} | arguments)
    with pytest.raises(ValueError, match="the component has constants, and none are given"):
        simulate(refused(Accumulator()), beats, count=2)
    with pytest.raises(ValueError, match=r"y of beat 1 is 131072, outside -131072 to 131071"):
        simulate(refused(Register()), {"x": [0, 0], "y": [0, 1 << 17]}, count=2)


def test_auto_falls_back_to_pysim(monkeypatch):
    assert simulate(Register(), pairs(3), count=3, engine="auto").engine == "cxxrtl"

    def broken(component):
        raise CompilerMissing("no compiler")

    monkeypatch.setattr("blysk.sim.engines.cxxrtl.Model", broken)
    with pytest.warns(RuntimeWarning, match="^no compiler; using pysim, some hundred times slower$"):
        run = simulate(Register(), pairs(3), count=3, engine="auto")
    assert run.engine == "pysim"
    np.testing.assert_array_equal(run.beats, Register.model(pairs(3)))
    with pytest.raises(CompilerMissing, match="no compiler"):
        simulate(refused(Register()), pairs(3), count=3)
