"""Band depths: random reads and writes over many bands, against the model."""

import numpy as np
import pytest
from amaranth.sim import Simulator

from blysk.golden.geometry.depth_tester import DepthTester
from blysk.golden.video.band_depth import BandDepth
from blysk.hdl.video.band_depth import BandDepthUnit

SIZE = 5, 3


@pytest.mark.parametrize("tag_bits", [2, 3])
def test_reads_are_those_of_the_band(tag_bits):
    """There are 40 bands, some without a write. If a tag came round without a sweep, an old depth would show.

    Places outside a band are clear, and writes there are lost.
    """
    model, rng = BandDepth(SIZE, tag_bits), np.random.default_rng(tag_bits)
    count = 600
    begins = rng.random(count) < 0.1
    begins[0] = True
    writes = rng.random(count) < 0.3
    # In long runs of bands without a write, words of earlier bands wait for their sweep.
    writes[200:400] = False
    anywhere = rng.random(count) < 0.3
    x = rng.integers(0, np.where(anywhere, 8, SIZE[0]))
    y = rng.integers(0, np.where(anywhere, 4, SIZE[1]))
    inside = (x < SIZE[0]) & (y < SIZE[1])
    depth = rng.integers(0, DepthTester.FARTHEST, count)
    expected = model.compute(begins, writes & inside, np.where(inside, y * SIZE[0] + x, 0), depth)
    expected[~inside] = DepthTester.CLEARED
    dut, found = BandDepthUnit(model, 3, 2), []

    async def bench(ctx):
        port = dut.memory
        for step in range(count):
            if begins[step]:
                ctx.set(dut.begin, 1)
                await ctx.tick()
                ctx.set(dut.begin, 0)
                cycles = 0
                while ctx.get(dut.busy):
                    await ctx.tick()
                    cycles += 1
                assert cycles == (model.words if step == 0 else model.swept)
                continue
            place = {"x": int(x[step]), "y": int(y[step])}
            ctx.set(port.read_place, place)
            ctx.set(port.read_enable, 1)
            await ctx.tick()
            ctx.set(port.read_enable, 0)
            found.append(ctx.get(port.read_data))
            if writes[step]:
                ctx.set(port.write_place, place)
                ctx.set(port.write_data, int(depth[step]))
                ctx.set(port.write_enable, 1)
                await ctx.tick()
                ctx.set(port.write_enable, 0)

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    np.testing.assert_array_equal(found, expected[~begins])
    assert 0.05 < np.mean(np.array(found) != DepthTester.CLEARED) < 0.9


def test_words_that_there_are_not():
    none = np.zeros(1, dtype=bool)
    for place in (-1, 15):
        with pytest.raises(ValueError, match=f"a band has words 0 to 14, not {place}"):
            BandDepth(SIZE).compute(none, none, np.array([place]), np.array([3]))


def test_tag_bits_out_of_range():
    with pytest.raises(ValueError, match="tag_bits must be 2 to 8, not 1"):
        BandDepth(SIZE, 1)
