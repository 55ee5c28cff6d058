"""Planes that are offered once for each scanline of their triangle."""

import numpy as np
import pytest
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.golden.geometry.plane_assembler import PlaneAssembler
from blysk.hdl.core.memory import clocked_reads
from blysk.hdl.geometry.plane_assembler import PlaneAssemblerUnit

WORDS = ("start", "short", "long", "inward")


@pytest.mark.parametrize("clocked", [False, True])
@pytest.mark.parametrize("count", [4, 6, 8])
def test_planes_come_again(count, clocked):
    """Each triangle's planes come in order, as often as it has scanlines, whatever comes in meanwhile."""
    rng = np.random.default_rng(count)
    scanlines = rng.integers(1, 4, 12)
    words = rng.integers(0, 1 << 20, (len(scanlines), count, len(WORDS)))
    unit, found, accepted = PlaneAssemblerUnit(PlaneAssembler(cuts=False), True, count), [], []
    ready, coming = rng.random(4000) < 0.6, rng.random(4000) < 0.8
    given, number, last = words.reshape(-1, len(WORDS)).tolist(), int((scanlines * count).sum()), None
    ends = np.cumsum(scanlines * count)

    async def testbench(ctx):
        nonlocal last
        for cycle in range(len(ready)):
            if len(found) == number:
                break
            ctx.set(unit.i.valid, bool(coming[cycle] and len(accepted) < len(given)))
            for name, word in zip(WORDS, given[min(len(accepted), len(given) - 1)], strict=True):
                ctx.set(Value.cast(unit.i.payload[name]), word)
            ctx.set(unit.o.ready, bool(ready[cycle]))
            ctx.set(unit.again, len(found) + 1 not in ends)
            plane = [ctx.get(Value.cast(unit.o.payload[name]).as_unsigned()) for name in WORDS]
            valid = ctx.get(unit.o.valid)
            # A plane that waits stays.
            assert last is None or (valid and plane == last)
            last = plane if valid and not ready[cycle] else None
            if valid and ready[cycle]:
                found.append(plane)
            if ctx.get(unit.i.valid) and ctx.get(unit.i.ready):
                accepted.append(cycle)
            await ctx.tick()

    with clocked_reads(clocked):
        simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(testbench)
    simulator.run()
    expected = [
        plane for times, planes in zip(scanlines, words.tolist(), strict=True) for plane in planes * times
    ]
    assert found == expected
