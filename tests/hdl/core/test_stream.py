# amaranth: UnusedElaboratable=no
"""Connections that compare every field, and the control of a pipelined unit: stalls and distance."""

import itertools
from functools import partial

import numpy as np
import pytest
from amaranth.hdl import Cat, Module, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from blysk.hdl.core.fixed import SQ, FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.single_register import hold_output
from blysk.hdl.core.stream import connect, connect_slice, skid_buffer, stop_output
from blysk.sim.engines.simulate import simulate


def streams(source_shape, sink_shape):
    return (
        stream.Signature(shape).create(path=(name,))
        for shape, name in ((source_shape, "a"), (sink_shape, "b"))
    )


@pytest.mark.parametrize("join", [connect, connect_slice])
def test_a_moved_binary_point_is_refused(join):
    with pytest.raises(TypeError, match=r"^payload is SQ\(1, 17\) on one side, SQ\(2, 16\) on the other$"):
        join(Module(), *streams(SQ(1, 17), SQ(2, 16)))


@pytest.mark.parametrize("drive", [skid_buffer, stop_output, hold_output])
def test_an_output_refuses_a_register_of_another_format(drive):
    output, _ = streams(SQ(1, 17), SQ(1, 17))
    with pytest.raises(TypeError, match=r"^payload is SQ\(2, 16\) on one side, SQ\(1, 17\) on the other$"):
        drive(Module(), output, Signal(), Signal(SQ(2, 16)))


@pytest.mark.parametrize(
    "shape", [SQ(1, 7), data.StructLayout({"a": SQ(1, 3), "b": unsigned(4)}), unsigned(8)]
)
def test_connect_carries_payload_valid_and_ready(shape):
    source, sink = streams(shape, shape)
    m = Module()
    connect(m, source, sink)

    async def bench(ctx):
        for code, valid, ready in ((0, 0, 0), (0x5A, 1, 0), (0xA5, 0, 1), (0xFF, 1, 1)):
            ctx.set(Value.cast(source.payload).as_unsigned(), code)
            ctx.set(source.valid, valid)
            ctx.set(sink.ready, ready)
            await ctx.delay(1e-9)
            assert ctx.get(Value.cast(sink.payload).as_unsigned()) == code
            assert (ctx.get(sink.valid), ctx.get(source.ready)) == (valid, ready)

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()


class Registers(wiring.Component):
    """Some registers in a row. Each register adds only a cycle."""

    i: In(stream.Signature(unsigned(16)))
    o: Out(stream.Signature(unsigned(16)))
    initiation_interval = 1

    def __init__(self, latency):
        self.latency = latency
        self.added = 0
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        streams = [stream.Signature(unsigned(16)).create(path=(str(k),)) for k in range(self.latency - 1)]
        streams = [wiring.flipped(self.i), *streams, wiring.flipped(self.o)]
        for source, sink in itertools.pairwise(streams):
            connect_slice(m, source, sink)
        return m


class Delay(PipelinedUnit):
    """The input, plus 1 for every register but the first. There is one register for each cycle of latency."""

    def __init__(self, latency, initiation_interval=1, spaced=False):
        super().__init__(
            unsigned(16),
            unsigned(16),
            latency=latency,
            initiation_interval=initiation_interval,
            spaced=spaced,
        )

    def datapath(self, m, operands):
        value = operands
        for stage in range(self.latency - (self.initiation_interval > 1)):
            value = self.register(m, (value + 1)[:16], f"stage_{stage}")
        return value

    @property
    def added(self):
        """The number that the registers add to the input."""
        return self.latency - (self.initiation_interval > 1)


class Ages(PipelinedUnit):
    """For each age of the beat that leaves: the number of enabled cycles ago, 4 bits an age.

    There is one beat at a time.
    """

    def __init__(self):
        super().__init__(unsigned(1), unsigned(12), latency=4, initiation_interval=4)

    def datapath(self, m, operands):
        clock = Signal(4)
        m.d.sync += clock.eq(clock + 1)
        caught = [self.register(m, clock, f"clock_{stage}", when=self.at(stage)) for stage in (1, 2, 3)]
        return Cat((clock - register)[:4] for register in caught)


@pytest.mark.parametrize(("latency", "interval"), [(0, 1), (-1, 1), (1, 0), (3, -2), (0, 0)])
def test_latency_and_interval_are_at_least_one(latency, interval):
    with pytest.raises(ValueError, match=r"^latency and initiation_interval must be at least 1$"):
        Delay(latency, interval)


@pytest.mark.parametrize("options", [{"initiation_interval": 1}, {"initiation_interval": 3, "skid": False}])
def test_a_result_stands_before_a_skid_buffer_and_an_interval(options):
    with pytest.raises(
        ValueError, match=r"^a result that stands needs a skid buffer and an interval over 1$"
    ):
        PipelinedUnit(unsigned(1), unsigned(1), latency=4, stands=True, **options)


def test_datapath_is_the_subclass_s():
    with pytest.raises(NotImplementedError):
        PipelinedUnit(unsigned(1), unsigned(1), latency=1).datapath(Module(), None)


def test_constants_are_a_member_only_where_asked_for():
    plain = PipelinedUnit(unsigned(1), unsigned(1), latency=1)
    assert set(plain.signature.members) == {"i", "o"}
    unit = PipelinedUnit(unsigned(1), unsigned(1), latency=1, constants=SQ(1, 17))
    assert unit.constants.shape() == FixedShape(unit.constants.format)


UNITS = [
    pytest.param(make, id=f"{make.func.__name__}-{'-'.join(map(str, make.args))}")
    for make in (
        *(
            partial(Delay, *timing)
            for timing in ((1, 1), (4, 1), (2, 2), (5, 3), (9, 4), (2, 2, True), (9, 4, True))
        ),
        partial(Registers, 1),
        partial(Registers, 3),
    )
]


@pytest.mark.parametrize("make", UNITS)
@pytest.mark.parametrize(("input_share", "output_share"), [(0, 0), (0.4, 0.4), (0.9, 0.1), (0.1, 0.9)])
def test_stalls_and_distance(make, input_share, output_share):
    """No beat is lost or repeated, and none changes while it waits.

    Without stalls every cycle is as stated.
    """
    unit = make()
    rng = np.random.default_rng(unit.latency)
    latency, interval = unit.latency, unit.initiation_interval
    codes = rng.integers(0, 2**15, 60)
    stalls = {
        "input_stalls": rng.random(97) < input_share,
        "output_stalls": rng.random(89) < output_share,
    }
    run = simulate(unit, codes, count=60, engine="pysim", **stalls)
    np.testing.assert_array_equal(run.beats, codes + unit.added)
    if not input_share:
        np.testing.assert_array_equal(run.input_cycles, np.arange(60) * interval)
    if not output_share:
        np.testing.assert_array_equal(run.cycles, run.input_cycles + latency)
    assert (run.cycles - run.input_cycles >= latency).all()


@pytest.mark.parametrize("make", UNITS)
def test_a_stall_costs_its_own_clock(make):
    """After beats have waited, the beats behind them follow in every cycle that the interval allows."""
    unit = make()
    codes = np.arange(60)
    stalled = simulate(unit, codes, count=60, engine="pysim", output_stalls=np.arange(1000) % 40 == 20)
    free = simulate(unit, codes, count=60, engine="pysim")
    lost = stalled.cycles - free.cycles
    assert np.all(np.diff(lost) >= 0)
    assert lost[-1] <= np.count_nonzero(np.arange(stalled.cycles[-1]) % 40 == 20)


@pytest.mark.parametrize("make", UNITS)
def test_ready_waits_for_no_other_ready(make):
    """Input ready, output valid and payload come from registers alone. No path leads to them from a port."""
    unit = make()
    rng = np.random.default_rng(unit.latency)
    seen = set()

    async def bench(ctx):
        for _ in range(200):
            found = set()
            for ready, valid in ((0, 0), (0, 1), (1, 0), (1, 1)):
                ctx.set(unit.o.ready, ready)
                ctx.set(unit.i.valid, valid)
                await ctx.delay(1e-9)
                found.add((ctx.get(unit.i.ready), ctx.get(unit.o.valid), ctx.get(unit.o.payload)))
            assert len(found) == 1
            seen.add(next(iter(found))[:2])
            ctx.set(unit.i.payload, int(rng.integers(2**15)))
            ctx.set(unit.i.valid, bool(rng.random() < 0.8))
            ctx.set(unit.o.ready, bool(rng.random() < 0.3))
            await ctx.tick()

    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    assert {(0, 1), (1, 0)} <= seen


@pytest.mark.parametrize("interval", [2, 3, 5])
@pytest.mark.parametrize("output_share", [0, 0.4])
def test_spaced_beats_come_at_any_distance(interval, output_share):
    """Beats come at the interval or later, not counting stalled cycles, and never sooner."""
    unit = Delay(9, interval, True)
    rng = np.random.default_rng(interval)
    codes = rng.integers(0, 2**15, 300)
    stalls = {"input_stalls": rng.random(997) < 0.6, "output_stalls": rng.random(89) < output_share}
    run = simulate(unit, codes, count=300, engine="pysim", **stalls)
    np.testing.assert_array_equal(run.beats, codes + unit.added)
    distance = np.diff(run.input_cycles)
    assert distance.min() == interval
    if not output_share:
        # Every distance occurs. No beat waits for a distance that the source does not make.
        assert {interval, interval + 1, interval + 2} <= set(distance.tolist())
        np.testing.assert_array_equal(run.cycles, run.input_cycles + 9)
    else:
        assert (run.cycles - run.input_cycles >= 9).all()


@pytest.mark.parametrize("count", [1, 3])
def test_slices_lose_no_cycle_to_a_payload_that_waits(count):
    """The sink takes one of two beats, and the source pauses.

    Each register holds a further beat while one waits.
    """
    unit = Registers(count)
    codes = np.arange(60)
    stalls = {"input_stalls": np.arange(4) % 4 == 1, "output_stalls": np.arange(4) % 4 == 3}
    run = simulate(unit, codes, count=60, engine="pysim", **stalls)
    np.testing.assert_array_equal(run.beats, codes)
    # Both sides move in three of four cycles, with all phases.
    assert run.cycles[-1] - run.cycles[10] <= 49 * 4 // 3 + 1


def test_at_counts_enabled_cycles():
    """Age 1 is 3 cycles before a beat leaves at age 4, and so on. Stalled cycles do not count."""
    rng = np.random.default_rng(1)
    stalls = {"input_stalls": rng.random(97) < 0.3, "output_stalls": rng.random(89) < 0.5}
    run = simulate(Ages(), np.zeros(100, int), count=100, engine="pysim", **stalls)
    assert (run.cycles - run.input_cycles > 4).any()
    np.testing.assert_array_equal(run.beats, 3 | 2 << 4 | 1 << 8)
