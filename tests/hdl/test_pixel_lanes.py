"""The pixel lanes: each lane's pixels in order, none waits for another lane, and a beat that waits stays."""

import numpy as np
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.hdl.pixel_lanes import PixelLanesUnit


def test_lanes_under_stalls():
    rng = np.random.default_rng(2)
    unit, pipes = PixelLanesUnit(4, 4, 4), 4
    queues = [rng.integers(0, 1 << 33, 50).tolist() for _ in range(pipes)]
    found, beats, held = [[] for _ in range(pipes)], [], []

    async def process(context):
        sent, offered = [0] * pipes, [False] * pipes
        for _ in range(600):
            for k, port in enumerate(unit.i):
                offered[k] = offered[k] or (sent[k] < 50 and rng.random() < 0.4)
                context.set(port.valid, offered[k])
                context.set(Value.cast(port.payload).as_unsigned(), queues[k][sent[k]] if offered[k] else 0)
            ready = rng.random() < 0.6
            context.set(unit.o.ready, ready)
            accepts = {context.get(port.ready) for port in unit.i}
            assert len(accepts) == 1
            if context.get(unit.o.valid):
                word = context.get(Value.cast(unit.o.payload).as_unsigned())
                assert not held or held.pop() == word
                present = context.get(unit.o.payload.present)
                assert present
                if not ready:
                    held.append(word)
                else:
                    beats.append(present)
                    for k in range(pipes):
                        if present >> k & 1:
                            pixel = context.get(Value.cast(unit.o.payload.pixels[k]).as_unsigned())
                            found[k].append(pixel)
            else:
                assert not held
            for k, port in enumerate(unit.i):
                if context.get(port.valid & port.ready):
                    sent[k] += 1
                    offered[k] = False
            await context.tick()

    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(process)
    simulator.run()
    assert found == queues
    # Lanes share beats, where several have a pixel.
    assert len(beats) < 200
