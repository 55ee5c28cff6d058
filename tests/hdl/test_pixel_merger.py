"""The pixel merger: spans of pixels in the order of their turns, whichever input is ready first."""

import numpy as np
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.hdl.pixel_merger import PixelMergerUnit


def test_order_of_turns_under_stalls():
    rng = np.random.default_rng(1)
    unit, pipes = PixelMergerUnit(3, 4, 4), 3
    turns = rng.integers(0, pipes, 60).tolist()
    spans = [rng.integers(0, 1 << 32, rng.integers(1, 5)).tolist() for _ in turns]
    # The payload's top bit tells the last pixel of a span.
    spans = [[*(word & ~(1 << 32) for word in span[:-1]), span[-1] | 1 << 32] for span in spans]
    queues = [[w for t, span in zip(turns, spans, strict=True) if t == k for w in span] for k in range(pipes)]
    found, moved = [], []

    async def process(context):
        sent, offered = [0] * (pipes + 1), [False] * (pipes + 1)
        for cycle in range(2000):
            ports = [*unit.i, unit.turns]
            words = [*queues, turns]
            for k, (port, queue) in enumerate(zip(ports, words, strict=True)):
                offered[k] = offered[k] or (sent[k] < len(queue) and rng.random() < 0.7)
                context.set(port.valid, offered[k])
                word = queue[sent[k]] if offered[k] else -1
                context.set(
                    Value.cast(port.payload).as_unsigned(), word & (1 << len(Value.cast(port.payload))) - 1
                )
            context.set(unit.o.ready, rng.random() < 0.7)
            if context.get(unit.o.valid & unit.o.ready):
                found.append(context.get(Value.cast(unit.o.payload).as_unsigned()))
                moved.append(cycle)
            for k, port in enumerate(ports):
                if context.get(port.valid & port.ready):
                    sent[k] += 1
                    offered[k] = False
            await context.tick()

    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(process)
    simulator.run()
    assert found == [word for span in spans for word in span]
