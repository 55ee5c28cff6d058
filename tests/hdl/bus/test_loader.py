"""The loader: words by a line and by a flash, the time of rest, lost bytes; pins against a flash's model."""

import numpy as np
import pytest
from amaranth.sim import Simulator

from blysk.golden.bus.flash_reader import FlashReader
from blysk.golden.bus.loader import Loader
from blysk.golden.bus.packet_decoder import PacketDecoder
from blysk.golden.bus.packets import stream_of
from blysk.golden.bus.uart_receiver import UartReceiver
from blysk.golden.video.memory_contents import MemoryContents
from blysk.hdl.bus.loader import LoaderUnit

from .flash import OFFSET, flash_of

MEMORIES = (MemoryContents("a", 9, 5, (1, 2, 3, 511, 255)), MemoryContents("b", 36, 2, (1 << 35, 7)))
SENT = stream_of(MEMORIES, 9, 2)
DECODER = PacketDecoder(tuple(MemoryContents(of.name, of.width, of.depth) for of in MEMORIES), 9)


def run(unit, *processes):
    simulator = Simulator(unit)
    simulator.add_clock(1e-8)
    for process in processes:
        simulator.add_testbench(process, background=True)
    return simulator


@pytest.mark.ci
@pytest.mark.long
def test_words_by_flash_and_line():
    """Words of the flash come first, then words of the line.

    The unit asks for rest from power-up until the last packet and the time after it. With a byte that is lost
    in between, a packet is dropped, and ``dropped`` is high.
    """
    uart, rest = UartReceiver(80), 300
    unit = LoaderUnit(Loader(DECODER, uart, FlashReader(OFFSET), rest))
    writes, rests, ends = [], [], []
    line = uart.line(SENT[:30] + SENT[31:] + SENT, 50)

    async def drive(ctx):
        while not ends:
            await ctx.tick()
            if not ctx.get(unit.resting):
                ends.append(len(rests))
        assert not ctx.get(unit.dropped)
        for level in line.tolist():
            ctx.set(unit.line, level)
            await ctx.tick()
        assert ctx.get(unit.resting)
        for _ in range(rest):
            await ctx.tick()
        assert not ctx.get(unit.resting)
        assert ctx.get(unit.dropped)

    async def take(ctx):
        while True:
            ctx.set(unit.o.ready, len(rests) % 3 == 0)
            if ctx.get(unit.o.valid) and ctx.get(unit.o.ready):
                word = ctx.get(unit.o.payload)
                writes.append((word.target, word.address, *list(word.data)))
            rests.append(ctx.get(unit.resting))
            await ctx.tick()

    simulator = run(unit, flash_of(unit.flash, SENT), take)
    simulator.add_testbench(drive)
    simulator.run()
    received = SENT + SENT[:30] + SENT[31:] + SENT
    expected, counts = DECODER.compute(np.frombuffer(received, dtype=np.uint8))
    words = np.c_[expected["target"], expected["address"], expected["data"]]
    assert writes == [tuple(row) for row in words.tolist()]
    assert counts["damaged"] > 0
    assert all(rests[: ends[0] - 1])


def test_a_loader_needs_a_source():
    with pytest.raises(ValueError, match="a loader needs a serial line or a flash"):
        Loader(DECODER)
