"""Counters of events, from counts that no run reaches."""

from functools import partial

import pytest
from amaranth.hdl import Module, Signal
from amaranth.sim import Simulator

from blysk.hdl.geometry import triangles
from blysk.hdl.geometry.triangles import COUNTER_BITS, count_events, counters_shape


@pytest.mark.parametrize("bits", range(COUNTER_BITS + 1))
def test_a_counter_counts_on(monkeypatch, bits):
    """The counter starts as after 2^bits - 1 events.

    It gets a cycle with an event, one without, and one with; it counts modulo 2^32.
    """
    start = (1 << bits) - 1
    monkeypatch.setattr(triangles, "Signal", partial(Signal, init=start))
    m, event, counters = Module(), Signal(), Signal(counters_shape("events"))
    count_events(m, counters, events=event)
    found = []

    async def testbench(ctx):
        for given in (1, 0, 1):
            ctx.set(event, given)
            await ctx.tick()
            found.append(ctx.get(counters.events))

    simulator = Simulator(m)
    simulator.add_clock(1e-6)
    simulator.add_testbench(testbench)
    simulator.run()
    assert found == [count % 2**32 for count in (start + 1, start + 1, start + 2)]
