# amaranth: UnusedElaboratable=no
"""The FIFO of payloads in parts: order, room, cycles, reads at clock edges, refusals."""

import numpy as np
import pytest
from amaranth.back import rtlil
from amaranth.hdl import Module, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.hdl.core.memory import clocked_reads
from blysk.hdl.core.serial_fifo import connect_serial_fifo
from blysk.sim.engines.simulate import simulate

BITS, PARTS = 4, 3
PAIR = data.StructLayout({"low": unsigned(5), "high": unsigned(6)})


class Fifo(wiring.Component):
    """Payloads of 11 bits in words of 4 bits."""

    def __init__(self, words):
        self.words = words
        super().__init__({"i": In(stream.Signature(PAIR)), "o": Out(stream.Signature(PAIR))})

    def elaborate(self, platform):
        m = Module()
        connect_serial_fifo(m, "pairs", wiring.flipped(self.i), wiring.flipped(self.o), self.words, BITS)
        return m


def pairs(count):
    rng = np.random.default_rng(2026)
    return {"low": rng.integers(0, 32, count), "high": rng.integers(0, 64, count)}


@pytest.mark.parametrize(("words", "busy"), [(8, 0.2), (8, 0.9), (16, 0.5), (16, 0.95)])
def test_payloads_keep_their_order(words, busy):
    """All payloads leave once and in order, while both sides stall. Reads at clock edges change no cycle."""
    rng, sent = np.random.default_rng(words), pairs(200)
    stalls = {"input_stalls": rng.random(509) < 0.4, "output_stalls": rng.random(509) < busy}
    runs = []
    for clocked in (False, True):
        with clocked_reads(clocked):
            runs.append(simulate(Fifo(words), sent, count=200, engine="pysim", **stalls))
    for run in runs:
        for name, values in sent.items():
            np.testing.assert_array_equal(run.beats[name], values)
        np.testing.assert_array_equal(run.cycles, runs[0].cycles)
        np.testing.assert_array_equal(run.input_cycles, runs[0].input_cycles)


def test_a_memory_without_a_read_in_a_cycle():
    """Within `clocked_reads` the only read has a clock."""
    with clocked_reads():
        netlist = rtlil.convert(Fifo(16), name="top", emit_src=False)
    assert netlist.count("$memrd_v2") == 1
    assert "parameter \\CLK_ENABLE 0" not in netlist


def test_cycles():
    """A payload of three parts comes every four cycles, takes eight, and leaves every five."""
    run = simulate(Fifo(16), pairs(20), count=20, engine="pysim")
    assert run.cycles[0] - run.input_cycles[0] == 2 * PARTS + 2
    assert np.diff(run.input_cycles).min() == PARTS + 1
    assert set(np.diff(run.cycles)) == {PARTS + 2}


@pytest.mark.parametrize(("words", "room"), [(8, 2), (16, 5), (32, 10)])
def test_room(words, room):
    """While nothing leaves, the memory takes as many payloads as it has words for, and a register one more.

    The last of them may wait for the first that leaves.
    """
    silent = 40 * room
    stalls = np.arange(silent + 400) < silent
    run = simulate(Fifo(words), pairs(3 * room), count=3 * room, engine="pysim", output_stalls=stalls)
    held = (run.input_cycles < run.cycles[0]).sum()
    assert room <= held <= room + 1


@pytest.mark.parametrize(
    ("bits", "words", "message"),
    [
        (11, 16, "a payload must have over 11 bits, not 11"),
        (4, 12, "words must be a power of two from 6 on, not 12"),
        (4, 4, "words must be a power of two from 6 on, not 4"),
    ],
)
def test_refusals(bits, words, message):
    source, sink = (stream.Signature(PAIR).create(path=(name,)) for name in ("source", "sink"))
    with pytest.raises(ValueError, match=message):
        connect_serial_fifo(Module(), "pairs", source, sink, words, bits)
