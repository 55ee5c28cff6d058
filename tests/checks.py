"""Comparisons of RTL with its bit-accurate model, for any unit."""

from collections.abc import Mapping
from weakref import WeakKeyDictionary

import numpy as np
from amaranth.hdl import ResetInserter, Signal, Value, unsigned
from amaranth.lib import data
from amaranth.lib.wiring import Component, Out
from amaranth.sim import Simulator

from blysk.bench.quality.mutation import Wrapped, flags_of
from blysk.bench.units.record import Case
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.sim.engines.beats import pack
from blysk.sim.engines.simulate import simulate

__all__ = ["assert_beats_equal", "assert_equals_model", "assert_keeps_rate", "known", "resets"]

FEWEST = 16
"""Least number of beats for which a rate is checked."""


def assert_beats_equal(actual, expected, path="beat"):
    if isinstance(expected, Mapping):
        for name, value in expected.items():
            assert_beats_equal(actual[name], value, f"{path}.{name}")
    else:
        np.testing.assert_array_equal(actual, expected, err_msg=path)


class Counted(Wrapped):
    """A unit that also counts, for each of its flags, the cycles in which the flag is high.

    The counts are its status.
    """

    def __init__(self, unit: Component):
        self.flags = flags_of(unit)
        super().__init__(unit, status=Out(data.StructLayout(dict.fromkeys(self.flags, unsigned(32)))))

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.submodules.unit = self.unit
        for name in self.flags:
            m.d.sync += self.status[name].eq(self.status[name] + getattr(self.unit, name))
        return m


_counted: WeakKeyDictionary[Component, Counted] = WeakKeyDictionary()


def with_status(unit: Component, run) -> Component:
    """The unit itself, or the unit that counts its flags. All runs of the unit share it."""
    if run.status is None or "status" in unit.signature.members:
        return unit
    if unit not in _counted:
        _counted[unit] = Counted(unit)
    return _counted[unit]


def known(unit: Component) -> Component:
    """The component by which a unit is compiled: the unit itself, or the unit that counts its flags."""
    return _counted.get(unit, unit)


def assert_equals_model(unit, run, engine="auto"):
    """Check every beat and the status. For a pipelined unit without stalls, check every cycle."""
    case, component = run.case, with_status(unit, run)
    # A compact geometry with ten attributes walks over 4096 scanlines without pixels in 40,960 cycles.
    options = {**case.sent, "idle_timeout": 50_000, **run.stalls}
    found = simulate(component, case.beats, count=run.count, engine=engine, **options)
    assert_beats_equal(found.beats, run.expected)
    if run.status is not None:
        assert {name: found.status[name] for name in run.status} == run.status
    if isinstance(unit, PipelinedUnit) and not run.stalls:
        # Writes come before the first beat, one in each cycle.
        start = 0 if case.write is None else found.input_cycles[0]
        latency, interval, number = unit.latency, unit.initiation_interval, np.arange(run.count)
        # Without a skid buffer each result stops the unit for a cycle, and also the inputs behind it.
        stops = np.zeros(run.count, dtype=int) if unit.skid else number
        before = np.minimum(stops, np.maximum(0, number + 1 - -(-latency // interval)))
        np.testing.assert_array_equal(found.input_cycles, start + number * interval + before)
        np.testing.assert_array_equal(found.cycles, start + number * interval + latency + stops)
    return found


def assert_keeps_rate(unit, run, free, pace=None, engine="auto"):
    """Check the rate after stalls: stalls for half of the beats, then none.

    The last half of the remaining beats must come as after a reset. In a pipelined unit every beat comes
    after its interval. If the data decide, the same beats take as many cycles as without stalls, and at most
    one gap more that the run after a reset has. The gap is allowed because a beat may get another place in
    shared slots, and because a full FIFO may be empty. With a ``pace`` the beats also take that many cycles
    each. If too few beats leave, inputs count.

    Parameters
    ----------
    unit : Component
        Unit of the run.
    run : UnitRun
        Run of a stimulus, whose stalls are to end.
    free : Run
        The run of the same beats without stalls.
    pace : float, optional
        Cycles from an output beat to the next, see `Stimulus`.
    """
    run, end = run.settled(free.cycles, free.input_cycles)
    found = assert_equals_model(unit, run, engine)
    for name in ("cycles", "input_cycles"):
        after, before = getattr(found, name), getattr(free, name)
        left = np.count_nonzero(after >= end)
        if left >= FEWEST:
            break
    if max(len(found.cycles), len(found.input_cycles)) < 4 * FEWEST:
        # There is no rate for a few operands, where only the beats matter.
        return
    assert left >= FEWEST, f"{left} beats are left after the stalls"
    steps, usual = (np.diff(cycles[-(left // 2) :]) for cycles in (after, before))
    if isinstance(unit, PipelinedUnit):
        np.testing.assert_array_equal(steps, unit.initiation_interval + (not unit.skid))
        return
    # A gap of another part of the run counts only if it came after the stalls. Otherwise a rate that locks
    # would pass beside a long gap.
    gap = max(usual.max(), min(steps.max(), np.diff(before).max()))
    assert steps.sum() <= usual.sum() + gap, f"{name}: {steps.sum()} cycles, from reset {usual.sum()}"
    if pace is not None:
        assert steps.sum() <= pace * len(steps) + gap


def resets(unit, case: Case, befores, cycles, count=6):
    """Cycles from the first input, and payloads, of the outputs: after power-up, and after resets, where they
    must be the same.

    The first beats are answered. Other beats are inside when the reset comes.
    """
    packed = words_of(unit.i, case.beats)
    writes = [] if case.write is None else words_of(unit.write, case.write)
    reset, found = Signal(), []

    async def send(context, port, words):
        """Send the beats of a stream, each until it is accepted."""
        sent = 0
        while sent < len(words):
            context.set(port.valid, 1)
            context.set(Value.cast(port.payload).as_unsigned(), words[sent])
            sent += context.get(port.ready)
            await context.tick()
        context.set(port.valid, 0)

    async def answer(context, words):
        sent, taken, start = 0, [], None
        for cycle in range(cycles):
            context.set(unit.i.valid, sent < len(words))
            context.set(Value.cast(unit.i.payload).as_unsigned(), words[min(sent, len(words) - 1)])
            accepted = context.get(unit.i.valid & unit.i.ready)
            start = cycle if accepted and start is None else start
            if context.get(unit.o.valid):
                taken.append((cycle - start, context.get(Value.cast(unit.o.payload).as_unsigned())))
            await context.tick()
            sent += accepted
        return taken

    async def keep(context, words, count):
        sent = 0
        for _ in range(count):
            context.set(unit.i.valid, 1)
            context.set(Value.cast(unit.i.payload).as_unsigned(), words[sent % len(words)])
            sent += context.get(unit.i.ready)
            await context.tick()
        context.set(unit.i.valid, 0)

    async def bench(context):
        if case.constants is not None:
            (row,) = pack(unit.constants.shape(), _single(case.constants))
            code = int.from_bytes(row.astype("<u4").tobytes(), "little")
            context.set(Value.cast(unit.constants).as_unsigned(), code)
        context.set(unit.o.ready, 1)
        for before in (0, *befores):
            if writes and before:
                await send(context, unit.write, writes)
            await keep(context, packed[count:], before)
            context.set(reset, before > 0)
            await context.tick()
            context.set(reset, 0)
            assert not context.get(unit.o.valid)
            if writes:
                await send(context, unit.write, writes)
            found.append(await answer(context, packed[:count]))

    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    fresh, *others = found
    assert all(other == fresh for other in others)
    return fresh


def words_of(port, beats) -> list[int]:
    """Payloads of a stream as integers."""
    rows = pack(port.payload.shape(), beats)
    return [int.from_bytes(row.astype("<u4").tobytes(), "little") for row in rows]


def _single(beat):
    if isinstance(beat, Mapping):
        return {name: _single(value) for name, value in beat.items()}
    return np.asarray(beat)[np.newaxis]
