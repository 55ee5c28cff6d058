"""Controls: presses with bounces, frame by frame against the model."""

import numpy as np
import pytest
from amaranth.sim import Simulator

from blysk.golden.video.controls import BUTTONS, Controls
from blysk.hdl.video.controls import ControlsUnit


def test_presses_and_frames_equal_model():
    model = Controls(materials=3, lights=2, step=700, first=100, debounce_bits=3)
    dut, rng = ControlsUnit(model), np.random.default_rng(3)
    state = model.start

    async def hold(ctx, button, level):
        """Seven cycles of bounces, which are fewer than from one sample to the next, and then a steady
        level."""
        for value in [*rng.integers(0, 2, 7).tolist(), *[level] * 16]:
            ctx.set(dut.buttons, value << BUTTONS.index(button))
            await ctx.tick()

    async def bench(ctx):
        nonlocal state
        for step in range(60):
            if rng.random() < 0.5:
                ctx.set(dut.frame, 1)
                await ctx.tick()
                ctx.set(dut.frame, 0)
                state = model.advance(state)
            else:
                button = BUTTONS[rng.integers(len(BUTTONS))]
                await hold(ctx, button, 1)
                await hold(ctx, button, 0)
                state = model.press(state, button)
            found = ctx.get(dut.angle), ctx.get(dut.index)
            assert found == (state.angle, model.list_of(state)), step

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()


def test_a_number_out_of_range():
    with pytest.raises(ValueError, match="lights must be 1 to 64, not 0"):
        Controls(lights=0)
