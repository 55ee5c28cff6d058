"""The bytes of a flash, by its pins."""

import numpy as np
import pytest
from amaranth.sim import Simulator

from blysk.golden.bus.flash_reader import FlashReader
from blysk.golden.bus.packets import stream_of
from blysk.golden.video.memory_contents import MemoryContents
from blysk.hdl.bus.flash_reader import FlashReaderUnit

from .flash import OFFSET, flash_of

SENT = stream_of([MemoryContents("a", 9, 5, (1, 2, 3, 511, 255))], 9, 2)


@pytest.mark.parametrize(
    "contents",
    [pytest.param(SENT, marks=[pytest.mark.ci, pytest.mark.long]), SENT[:9], b"", b"\x00" + SENT],
    ids=["packets", "no end mark", "erased", "other"],
)
def test_bytes_of_a_flash(contents):
    """The bytes up to the end mark or erased flash, and none of a flash with other contents."""
    unit, found = FlashReaderUnit(FlashReader(OFFSET)), []

    async def take(ctx):
        rng = np.random.default_rng(1)
        while ctx.get(unit.busy):
            ctx.set(unit.o.ready, int(rng.integers(2)))
            if ctx.get(unit.o.valid) and ctx.get(unit.o.ready):
                found.append(ctx.get(unit.o.payload))
            await ctx.tick()
        assert not ctx.get(unit.pins.select)

    simulator = Simulator(unit)
    simulator.add_clock(1e-8)
    simulator.add_testbench(flash_of(unit.pins, contents), background=True)
    simulator.add_testbench(take)
    simulator.run()
    assert bytes(found) == unit.model.compute(contents)


def test_an_offset_has_three_bytes():
    with pytest.raises(ValueError, match="an address of a flash is 0 to 16777215, not 16777216"):
        FlashReader(1 << 24)
