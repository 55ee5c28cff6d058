# amaranth: UnusedElaboratable=no
"""Words from the pixel clock to the serial clock: each once, five cycles apart, at any phase, with jitter."""

import numpy as np
import pytest
from amaranth.hdl import ClockDomain, Module, unsigned
from amaranth.sim import Simulator

from blysk.hdl.video.output_cells import OutputCells
from blysk.hdl.video.word_crossing import WordCrossing

WORDS = 60


def cross(phase, jitter):
    """Words taken, and the serial cycles in which they were taken."""
    m = Module()
    m.domains.pixel = pixel = ClockDomain("pixel")
    m.submodules.crossing = crossing = WordCrossing(unsigned(10))
    simulator = Simulator(m)
    simulator.add_clock(1e-6, domain="serial")
    edges = 5 * np.arange(1, WORDS + 1) + phase + np.random.default_rng(7).uniform(-jitter, jitter, WORDS)
    found = []

    async def give(ctx):
        now = 0.0
        for word, edge in enumerate(edges.tolist()):
            ctx.set(crossing.i, word + 1)
            await ctx.delay((edge - now) * 1e-6)
            ctx.set(pixel.clk, 1)
            await ctx.delay(2e-6)
            ctx.set(pixel.clk, 0)
            now = edge + 2

    async def take(ctx):
        for cycle in range(5 * WORDS):
            _, _, valid, word = await ctx.tick("serial").sample(crossing.valid, crossing.o)
            if valid:
                found.append((cycle, word))

    simulator.add_testbench(give)
    simulator.add_testbench(take)
    simulator.run()
    return np.array(found)


@pytest.mark.parametrize("phase", [0.0, 0.03, 0.25, 0.47, 0.5, 0.53, 0.8, 0.97])
@pytest.mark.parametrize("jitter", [0.0, 0.15])
def test_each_word_once(phase, jitter):
    """Every word is taken once, from the first that comes after the counter is set.

    Clock edges may coincide, and move.
    """
    found = cross(phase, jitter)
    # The first or the second word sets the counter.
    found = found[found[:, 1] > 2]
    assert len(found) > WORDS - 6
    assert (np.diff(found[:, 0]) == 5).all()
    assert (np.diff(found[:, 1]) == 1).all()


def test_output_cells():
    """The model sends its input two cycles later."""
    cells = OutputCells(2)
    simulator = Simulator(cells)
    simulator.add_clock(1e-6, domain="serial")
    sent = np.random.default_rng(2026).integers(0, 16, 50).tolist()
    found = []

    async def run(ctx):
        for word in sent:
            ctx.set(cells.pairs, {0: word & 3, 1: word >> 2})
            await ctx.tick("serial")
            found.append(ctx.get(cells.bits[0]) | ctx.get(cells.bits[1]) << 2)

    simulator.add_testbench(run)
    simulator.run()
    assert found[1:] == sent[:-1]


def test_ports_are_as_many_as_lanes():
    with pytest.raises(ValueError, match="4 lanes need 4 ports, not 1"):
        OutputCells(4, [None])
