"""How RTL is held against its bit-accurate model, whatever the unit."""

from collections.abc import Mapping

import numpy as np
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.hdl.core.stream import PipelinedUnit
from blysk.sim.engines.beats import pack
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.record import Case, first, length_of

__all__ = ["assert_beats_equal", "assert_equals_model", "resets"]

FEW = 60
"""Output beats that Amaranth's simulator is held to, too."""


def assert_beats_equal(actual, expected, path="beat"):
    if isinstance(expected, Mapping):
        for name, value in expected.items():
            assert_beats_equal(actual[name], value, f"{path}.{name}")
    else:
        np.testing.assert_array_equal(actual, expected, err_msg=path)


def assert_equals_model(unit, run, engine="auto"):
    """Every beat; of a pipelined unit without stalls every cycle; the first beats in both engines."""
    case = run.case
    options = {"constants": case.constants, "write": case.write, **run.stalls}
    found = simulate(unit, case.beats, count=run.count, engine=engine, **options)
    assert_beats_equal(found.beats, run.expected)
    if isinstance(unit, PipelinedUnit) and not run.stalls:
        np.testing.assert_array_equal(found.input_cycles, np.arange(run.count) * unit.initiation_interval)
        np.testing.assert_array_equal(found.cycles, found.input_cycles + unit.latency)
    if run.stalls:
        few = min(length_of(case.beats), FEW)
        beats = first(case.beats, few)
        slow, fast = (
            simulate(unit, beats, count=None, engine=name, idle_timeout=2000, **options)
            for name in ("pysim", engine)
        )
        for name in ("beats", "cycles", "input_cycles"):
            np.testing.assert_array_equal(getattr(slow, name), getattr(fast, name))
    return found


def resets(unit, case: Case, befores, cycles):
    """Output cycles and payloads after power-up, and after resets with beats inside; the first six beats."""
    packed = [
        int.from_bytes(row.astype("<u4").tobytes(), "little")
        for row in pack(unit.i.payload.shape(), case.beats)
    ]
    reset, found = Signal(), []

    async def send(context, words):
        sent, taken = 0, []
        for cycle in range(cycles):
            context.set(unit.i.valid, sent < len(words))
            context.set(Value.cast(unit.i.payload).as_unsigned(), words[min(sent, len(words) - 1)])
            accepted = context.get(unit.i.valid & unit.i.ready)
            if context.get(unit.o.valid):
                taken.append((cycle, context.get(Value.cast(unit.o.payload).as_unsigned())))
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

    async def bench(context):
        if case.constants is not None:
            (row,) = pack(unit.constants.shape(), _single(case.constants))
            code = int.from_bytes(row.astype("<u4").tobytes(), "little")
            context.set(Value.cast(unit.constants).as_unsigned(), code)
        context.set(unit.o.ready, 1)
        for before in (0, *befores):
            await keep(context, packed[6:], before)
            context.set(reset, before > 0)
            await context.tick()
            context.set(reset, 0)
            assert not context.get(unit.o.valid)
            found.append(await send(context, packed[:6]))

    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    return found


def _single(beat):
    if isinstance(beat, Mapping):
        return {name: _single(value) for name, value in beat.items()}
    return np.asarray(beat)[np.newaxis]
