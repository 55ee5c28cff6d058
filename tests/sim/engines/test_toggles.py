"""Toggle counts against those of small components, found by hand, and of units with nothing to do."""

from itertools import pairwise

import numpy as np
import pytest
from amaranth.hdl import EnableInserter, Module, Signal
from amaranth.lib import memory, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.sim.engines.toggles import count_toggles


class Sample(Component):
    """The last beat, plain or inverted. Submodules have a count, a table, and the lowest bit."""

    i: In(stream.Signature(8))
    o: Out(stream.Signature(8))
    constants: In(8)
    status: Out(8)

    def elaborate(self, platform):
        m = Module()
        m.submodules.count = count = Module()
        m.submodules.table = table = memory.Memory(shape=4, depth=4, init=[0, 15, 1, 7])
        inner = Module()
        odd = Signal(init=1)
        inner.d.sync += odd.eq(self.i.payload[0])
        m.submodules.gated = EnableInserter(self.i.valid & self.i.ready)(inner)
        port = table.read_port()
        wire = Signal(8)
        taken = self.i.valid & self.i.ready
        beats = Signal(8, init=3)
        m.d.comb += [
            self.i.ready.eq(~self.o.valid | self.o.ready),
            wire.eq(self.i.payload ^ self.constants),
            port.addr.eq(beats[:2]),
            self.status.eq(port.data),
        ]
        with m.If(self.i.ready):
            m.d.sync += self.o.valid.eq(self.i.valid)
        with m.If(taken):
            m.d.sync += self.o.payload.eq(wire)
        with count.If(taken):
            count.d.sync += beats.eq(beats + 1)
        return m


@pytest.mark.parametrize("engine", ["pysim", "auto"])
def test_counts_known_by_hand(engine):
    beats = np.array([0x00, 0xFF, 0xFE, 0x01, 0x03])
    run, toggles = count_toggles(Sample(), beats, count=5, constants=0, engine=engine)
    np.testing.assert_array_equal(run.beats, beats)
    assert toggles == {
        # 0 to 0, 8, 1, 8, 1 bits of the payload; valid rises and falls.
        "top": 18 + 2,
        # 3, 4, 5, 6, 7, 8.
        "count": 3 + 1 + 2 + 1 + 4,
        # 0, then words 3, 0, 1, 2, 3, 0: 0, 7, 0, 15, 1, 7, 0.
        "table": 3 + 3 + 4 + 3 + 2 + 3,
        # 1, then 0, 1, 0, 1, 1.
        "gated": 4,
    }


@pytest.mark.parametrize("engine", ["pysim", "auto"])
def test_stalls_and_equal_beats_toggle_nothing(engine):
    """The same beat comes over and over, and the sink is seldom ready.

    Only its first pass and valid toggle.
    """
    stalls = np.arange(10) != 7
    beats = np.full(20, 0xA5)
    run, toggles = count_toggles(
        Sample(), beats, count=20, constants=0x5A, output_stalls=stalls, input_stalls=~stalls, engine=engine
    )
    assert (run.beats == 0xFF).all()
    valid = toggles["top"] - 8
    assert valid % 2 == 0
    assert 2 <= valid <= 40
    # From 3 to 23.
    assert toggles["count"] == sum((k ^ (k + 1)).bit_count() for k in range(3, 23))
    assert toggles["gated"] == 0


class Chain(Component):
    """26 registers of 40 bits, each a cycle behind the one before.

    Words of a sum are divided and overflow.
    """

    i: In(stream.Signature(40))
    o: Out(stream.Signature(40))

    INITS = np.random.default_rng(3).integers(0, 1 << 40, 26)

    def elaborate(self, platform):
        m = Module()
        value = self.i.payload
        stages = [Signal(40, init=int(init), name=f"stage_{k}") for k, init in enumerate(self.INITS)]
        with m.If(self.i.valid):
            m.d.sync += stages[0].eq(value)
        m.d.sync += [stage.eq(before) for before, stage in pairwise(stages)]
        m.d.comb += [self.i.ready.eq(self.o.ready), self.o.valid.eq(self.i.valid), self.o.payload.eq(value)]
        return m


@pytest.mark.long
@pytest.mark.parametrize("engine", ["pysim", "auto"])
def test_many_wide_registers(engine):
    """Stage k has the words that it and the stages before it had after the reset, last first, and then the
    beats."""
    beats = np.random.default_rng(4).integers(0, 1 << 40, 300)
    beats[100:200:2] = 0
    beats[101:200:2] = (1 << 40) - 1
    _, toggles = count_toggles(Chain(), beats, count=len(beats), engine=engine)
    expected = 0
    for stage in range(26):
        shown = np.r_[Chain.INITS[stage::-1], beats].astype(np.uint64)
        expected += int(np.bitwise_count(shown[1:] ^ shown[:-1]).sum())
    assert toggles == {"top": expected}


@pytest.mark.parametrize("interval", [2, *(pytest.param(k, marks=pytest.mark.long) for k in (1, 4))])
def test_dark_beats_toggle_only_their_input(interval):
    """200 dark beats add no toggles to the data path, except in its first registers.

    These are the registers of one minus the cosine. If one part serves several cycles, they also are the
    registers of the input. Those take the word at the port after the last beat, too, which is all ones.
    """
    rng = np.random.default_rng(2)
    lit = ONE_SQUARED.codes - rng.integers(0, 1 << 32, 40)
    dark = ONE_SQUARED.codes - rng.integers(0, 1 << 34, 200)
    counts = {}
    for kind, codes, marks in (
        ("short", np.r_[lit, dark[:1]], np.r_[np.zeros(40), 1]),
        ("long", np.r_[lit, dark], np.r_[np.zeros(40), np.ones(200)]),
        ("lit", np.r_[lit, dark], np.zeros(240)),
    ):
        beats = {"operand": codes, "dark": marks.astype(np.uint8)}
        unit = SpecularUnit(initiation_interval=interval)
        run, toggles = count_toggles(
            unit, beats, count=len(codes), constants={"exponent": 10}, engine="pysim"
        )
        if kind == "long":
            assert not run.beats[40:].any()
        counts[kind] = toggles["datapath"]

    def changes(codes):
        mask = np.uint64((1 << 38) - 1)
        return np.bitwise_count((codes[1:] ^ codes[:-1]).astype(np.uint64) & mask).sum().astype(int)

    expected = changes((ONE_SQUARED.codes - dark) >> 9)
    if interval > 1:
        expected += changes(np.r_[dark, -1]) - changes(np.r_[dark[:1], -1])
    assert counts["long"] - counts["short"] == expected
    assert counts["lit"] > counts["long"] + 200 * 20
