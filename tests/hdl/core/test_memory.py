# amaranth: UnusedElaboratable=no
"""FIFOs made from memories: their refusals, and reads at clock edges, which change no cycle.

Proofs of the units that use these FIFOs cover their behaviour.
"""

import re

import numpy as np
import pytest
from amaranth.back import rtlil
from amaranth.hdl import Const, EnableInserter, Fragment, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from blysk.bench.units.record import length_of
from blysk.bench.units.registry import RECORDS
from blysk.golden.build import STYLES
from blysk.golden.presets import METHODS, preset
from blysk.hdl.bus.bus import core_of
from blysk.hdl.core.memory import (
    UNCOUNTED,
    clocked_reads,
    connect_headed_fifo,
    connect_late_fifo,
    connect_wide_fifo,
    delayed,
    first_in_turn,
    pass_beside,
    registered_read,
    turn_of,
    words_in_turn,
)
from blysk.sim.engines.simulate import simulate

from ...checks import assert_beats_equal


@pytest.mark.parametrize("depth", [1, 2, 3, 12])
def test_headed_fifo_refuses_a_depth(depth):
    """With two words no payload would ever be accepted."""
    source, sink = (stream.Signature(8).create(path=(name,)) for name in ("source", "sink"))
    with pytest.raises(ValueError, match=re.escape(f"depth must be a power of two from 4 on, not {depth}")):
        connect_headed_fifo(Module(), "words", source, sink, Const(0, 1), depth)


def test_late_fifo_refuses_a_depth():
    """With so few words no payload would ever be accepted."""
    source, sink = (stream.Signature(8).create(path=(name,)) for name in ("source", "sink"))
    with pytest.raises(ValueError, match=f"depth must be over {UNCOUNTED}, not {UNCOUNTED}"):
        connect_late_fifo(Module(), "words", source, sink, UNCOUNTED)


class Reads(wiring.Component):
    """Every function that reads a memory. ``o`` has a valid bit and a word for each."""

    def __init__(self):
        self.names = ("wide", "headed", "late", "beside", "first", "table", "delayed")
        outputs = {f"o_{name}": Out(10) for name in self.names}
        super().__init__({"valid": In(1), "word": In(9), "ready": In(1), "enable": In(1, init=1)} | outputs)

    def elaborate(self, platform):
        m = Module()
        for name in self.names[:3]:
            source, sink = (stream.Signature(9).create(path=(name, side)) for side in "io")
            m.d.comb += [source.valid.eq(self.valid), source.payload.eq(self.word), sink.ready.eq(self.ready)]
            if name == "wide":
                connect_wide_fifo(m, name, source, sink, 4)
            elif name == "headed":
                head = connect_headed_fifo(m, name, source, sink, source.payload[:3], 4)
                m.d.comb += self.o_headed.eq(sink.valid << 9 | (sink.payload ^ head))
            else:
                connect_late_fifo(m, name, source, sink, 8)
            if name != "headed":
                m.d.comb += getattr(self, f"o_{name}").eq(sink.valid << 9 | sink.payload)
        # A word is inside for two cycles or more.
        written, came, count = Signal(), Signal(), Signal(3)
        taken = self.ready & (count != 0)
        m.d.comb += written.eq(self.valid & (count < 3))
        m.d.sync += [came.eq(written), count.eq(count + came - taken)]
        beside = pass_beside(m, "beside", self.word, written, taken, 8)
        first = first_in_turn(m, words_in_turn(m, "first", self.word, written, 8), taken)
        m.d.comb += [
            self.o_beside.eq((count != 0) << 9 | beside),
            self.o_first.eq((count != 0) << 9 | first),
        ]
        m.submodules.table = table = Memory(shape=9, depth=8, init=[])
        write = table.write_port()
        m.d.comb += [write.addr.eq(self.word), write.data.eq(self.word[3:]), write.en.eq(self.valid)]
        read, _ = registered_read(m, table, self.word[4:7], self.ready, write)
        late = delayed(m, "late_word", self.word, 5, turn_of(m, 5))
        m.d.comb += [self.o_table.eq(1 << 9 | read), self.o_delayed.eq(1 << 9 | late)]
        gated = EnableInserter(self.enable)(m)
        return gated


def test_reads_at_clock_edges_change_no_cycle():
    """Words with a valid bit are the same in each cycle, and each read has a clock."""
    asynchronous, clocked = Reads(), Reads()
    m = Module()
    m.submodules.asynchronous = asynchronous
    with clocked_reads():
        m.submodules.clocked = Fragment.get(clocked, None)
        netlist = rtlil.convert(Reads(), name="top", emit_src=False)
    assert netlist.count("$memrd_v2") == 9
    assert netlist.count("parameter \\CLK_ENABLE 0") == 0
    assert netlist.count("parameter \\TRANSPARENCY_MASK 1'1") == 6
    rng = np.random.default_rng(2026)
    count = 400
    given = {"word": rng.integers(0, 512, count), "enable": rng.random(count) < 0.8}
    share = np.repeat([0.9, 0.3, 0.6, 0.9], count // 4)
    given |= {"valid": rng.random(count) < share, "ready": rng.random(count) < share[::-1]}
    seen = dict.fromkeys(asynchronous.names, 0)

    async def drive(context):
        for cycle in range(count):
            for unit in (asynchronous, clocked):
                for name, values in given.items():
                    context.set(getattr(unit, name), int(values[cycle]))
            await context.tick()
            for name in seen:
                one, other = (
                    int(context.get(getattr(unit, f"o_{name}"))) for unit in (asynchronous, clocked)
                )
                assert one >> 9 == other >> 9, (name, cycle)
                if one >> 9:
                    seen[name] += 1
                    assert one == other, (name, cycle)

    simulator = Simulator(m)
    simulator.add_clock(1e-6)
    simulator.add_testbench(drive)
    simulator.run()
    assert min(seen.values()) > 50


@pytest.mark.parametrize(
    ("name", "variant"),
    [
        ("vertex_sort", ""),
        pytest.param("light_adapter", "", marks=[pytest.mark.long, pytest.mark.ci]),
        pytest.param("light_adapter", "serial", marks=pytest.mark.long),
    ],
)
def test_units_with_reads_of_their_own(name, variant):
    """Units that read memories without the functions of a FIFO. Reads at clock edges change no cycle."""
    record, rng = RECORDS[name], np.random.default_rng(2026)
    make = record.variants[variant].unit
    case = next(iter(record.stimuli_of(variant).values())).make(make(), rng, 40)
    expected = record.expect(make(), case)
    stalls = {side: rng.random(509) < 0.4 for side in ("input_stalls", "output_stalls")}
    found = []
    for clocked in (False, True):
        with clocked_reads(clocked):
            unit = make()
            found.append(
                simulate(unit, case.beats, count=length_of(expected), engine="pysim", **case.sent, **stalls)
            )
            netlist = rtlil.convert(make(), name="top", emit_src=False)
        assert ("parameter \\CLK_ENABLE 0" in netlist) == (not clocked)
    assert_beats_equal(found[1].beats, expected)
    np.testing.assert_array_equal(found[0].cycles, found[1].cycles)
    np.testing.assert_array_equal(found[0].input_cycles, found[1].input_cycles)


@pytest.mark.long
@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("method", METHODS)
def test_every_method_reads_at_clock_edges(method, style):
    unit = core_of(preset(method, style=style))
    with clocked_reads():
        assert "parameter \\CLK_ENABLE 0" not in rtlil.convert(unit, name="top", emit_src=False)
