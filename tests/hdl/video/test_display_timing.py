# amaranth: UnusedElaboratable=no
"""Timing RTL equals its model in every cycle of two frames, and after a reset between them."""

import pytest
from amaranth.hdl import ResetInserter, Signal
from amaranth.sim import Simulator

from blysk.golden.video.display_timing import Axis, DisplayMode, DisplayTiming
from blysk.hdl.video.display_timing import DisplayTimingUnit

MODES = (
    DisplayMode(Axis(8, 1, 3, 2), Axis(5, 2, 1, 3)),
    DisplayMode(Axis(5, 2, 1, 1, positive=True), Axis(4, 1, 2, 1, positive=True)),
)


@pytest.mark.parametrize("mode", MODES)
def test_equals_model(mode):
    timing = DisplayTiming(mode)
    unit, reset = DisplayTimingUnit(timing), Signal()
    expected = timing.compute(2 * mode.cycles)
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)

    async def check(ctx):
        for count in (mode.cycles // 2, 2 * mode.cycles):
            for k in range(count):
                found = {name: ctx.get(getattr(unit.o, name)) for name in expected}
                assert found == {name: int(values[k]) for name, values in expected.items()}, k
                ctx.set(reset, k == count - 1)
                await ctx.tick()
                ctx.set(reset, 0)

    simulator.add_testbench(check)
    simulator.run()
