# amaranth: UnusedElaboratable=no
"""Texel memory: writes with gaps, which the runs of its record do not have."""

import numpy as np
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.reference.texture import Texture
from blysk.hdl.albedo.texel_memory import TexelMemoryUnit


def test_writes_with_gaps():
    """Every texel of an image is read as it was written, whatever beats stood between the writes."""
    rng = np.random.default_rng(5)
    memory = TexelMemory(8)
    loaded = memory.load([Texture(rng.random((4, 4, 3)))])
    beats, unit = loaded.writes(), TexelMemoryUnit(memory)

    # A lower half without its upper half changes no word.
    sent = [*zip(beats["value"].tolist(), beats["begins"].tolist(), strict=True), (0, 1), (77, 0)]

    async def write(context, value, begins, valid):
        context.set(unit.write.payload.value, value)
        context.set(unit.write.payload.begins, begins)
        context.set(unit.write.valid, valid)
        await context.tick()

    async def bench(context):
        for beat in (*sent, None):
            for _ in range(rng.integers(3) if beat else 3):
                await write(context, int(rng.integers(1 << 18)), int(rng.integers(2)), 0)
            if beat:
                await write(context, *beat, 1)
        context.set(unit.write.valid, 0)
        context.set(unit.o.ready, 1)
        for address, words in enumerate(loaded.words.tolist()):
            for request in unit.i.payload:
                context.set(request, address)
            context.set(unit.i.valid, 1)
            await context.tick()
            context.set(unit.i.valid, 0)
            await context.tick()
            assert context.get(unit.o.valid)
            code = context.get(Value.cast(unit.o.payload))
            assert [code >> 36 * bank & (1 << 36) - 1 for bank in range(4)] == words

    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
