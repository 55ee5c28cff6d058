# amaranth: UnusedElaboratable=no
"""A write that comes while a span is offered: the span has all constants before the write, or all after
it."""

from amaranth.sim import Simulator

from blysk.golden.frame_constants import FIELDS_OF_A_LIGHT, LIGHT_STRIDE
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit

X, DIFFUSE = (LIGHT_STRIDE + FIELDS_OF_A_LIGHT[name][0] for name in ("direction", "diffuse"))


def test_a_span_that_is_taken_in_turns_keeps_its_constants():
    """The quotient method reads a span in three cycles before it accepts the span.

    A write comes in each of them.
    """
    unit = ShadingPipelineUnit(preset("quotient", "blinn"))
    write, span, pixel = unit.write, unit.i, unit.o
    shades = {}

    async def bench(ctx):
        async def written(address, data):
            ctx.set(write.payload, {"address": address, "data": data})
            ctx.set(write.valid, 1)
            await ctx.tick().until(write.ready)
            ctx.set(write.valid, 0)

        ctx.set(pixel.ready, 1)
        await written(DIFFUSE, 255 << 6)
        vectors = {"start": [0.5, 0, 0.5], "step": [-0.5, 0, 0], "exponent": 2}
        ctx.set(span.payload, {"length": 4, **vectors})
        # Without a write, with a write at once, and with a write some cycles later.
        for late in (None, 0, 1, 2, 3):
            await written(X, 0)
            await written(X + 2, 100_000)
            found, cycle = [], 0
            ctx.set(write.payload, {"address": X, "data": 80_000})
            ctx.set(span.valid, 1)
            while len(found) < 4:
                ctx.set(write.valid, ctx.get(write.valid) or cycle == late)
                *_, given, taken, valid, red = await ctx.tick().sample(
                    write.valid & write.ready, span.ready, pixel.valid, pixel.payload.r
                )
                cycle += 1
                if given:
                    ctx.set(write.valid, 0)
                if taken:
                    ctx.set(span.valid, 0)
                if valid:
                    found.append(red)
            if ctx.get(write.valid):
                await written(X, 80_000)
            shades[late] = found

    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    before, after = shades.pop(None), shades[0]
    assert before != after
    assert all(found in (before, after) for found in shades.values()), shades
