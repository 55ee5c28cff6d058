"""Fields that are read at their source: the text, and equal behaviour."""

import re

import numpy as np
import pytest
from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines.parts import read_parts

from .components import both
from .test_guards import generated

INNER = data.StructLayout({"a": 5, "b": 60})
WORD = data.StructLayout({"low": 9, "inner": INNER, "on": 1, "high": 40})
BITS = WORD.size


class Fields(Component):
    """Words joined, passed on, divided at other places, and fields across their borders."""

    i: In(stream.Signature(data.StructLayout({"low": 9, "a": 5, "b": 60, "on": 1, "high": 40})))
    o: Out(stream.Signature(data.ArrayLayout(60, 4)))

    def elaborate(self, platform):
        m = Module()
        x = data.View(WORD, self.i.payload.as_value())
        advance = Signal()
        m.d.comb += [advance.eq(~self.o.valid | self.o.ready), self.i.ready.eq(advance)]
        kept, swapped, again = (Signal(WORD, name=name) for name in ("kept", "swapped", "again"))
        # A signal with the name that a part of another signal might get.
        swapped_0 = Signal(9, name="swapped_0")
        m.d.comb += [
            swapped_0.eq(x.low ^ 0x155),
            swapped.low.eq(x.inner.a),
            swapped.inner.b.eq(Cat(x.high, x.inner.b[:30])),
            swapped.inner.a.eq(x.low[2:7] + 1),
            swapped.on.eq(x.on),
            swapped.high.eq(kept.inner.b[20:60]),
            again.eq(swapped),
        ]
        apart = Signal(WORD, name="apart")
        m.d.comb += [apart.low.eq(x.low + 3), apart.high.eq(kept.high), apart.inner.b.eq(~x.inner.b)]
        m.d.comb += [apart.on.eq(x.on), apart.inner.a.eq(kept.inner.a)]
        both = Signal(2 * BITS, name="both")
        m.d.comb += both.eq(Cat(again, kept))
        with m.If(advance):
            m.d.sync += [self.o.valid.eq(self.i.valid), kept.eq(Mux(again.on, again, x))]
            m.d.sync += [
                self.o.payload[0].eq(again.inner.b ^ apart.low ^ apart.high ^ apart.inner.b[3:]),
                self.o.payload[1].eq(both[60:130]),
                self.o.payload[2].eq(again.high + again.inner.a + kept.low + swapped_0),
                # Across the border of two fields.
                self.o.payload[3].eq(again.as_value()[5:40] ^ both[BITS + 3 :][:50]),
            ]
        return m


def test_the_machine_is_the_same():
    """Against pysim, with every bit of every field at random."""
    rng = np.random.default_rng(8)
    beats = {
        "low": rng.integers(0, 1 << 9, 1500),
        "a": rng.integers(0, 32, 1500),
        "b": rng.integers(0, 1 << 60, 1500),
        "on": rng.integers(0, 2, 1500),
        "high": rng.integers(0, 1 << 40, 1500),
    }
    assert len(np.unique(both(Fields(), beats, 1500).beats)) > 4000


def test_a_field_is_read_where_it_comes_from(monkeypatch):
    before, after = (
        text[text.index("bool p_top::eval(") :]
        for plain in [generated(Fields(), monkeypatch)]
        for text in (plain, read_parts(plain))
    )
    # A field is read from a register, or has a word of its own. Across a border the word itself is read.
    assert "add_uu<41>(p_swapped.slice<114,75>().val(), p_swapped.slice<13,9>().val())" in before
    assert "add_uu<41>(p_kept.curr.slice<73,34>().val(), p_swapped_at_9.val())" in after
    assert "p_swapped.slice<114,60>()" in after
    # Words that nobody reads any more are gone. Words that the driver reads are not.
    assert "p_apart.slice<8,0>() = " in before
    assert not re.search(r"p_apart\b(?!_at)", after)
    assert "p_i____ready = " in after


def test_other_text_stays():
    for text in ("", "bool p_top::eval(performer *performer) {", "struct p_top {};"):
        assert read_parts(text) == text


class Counted(Component):
    """A status that is combinational, from a register and from words that nothing else reads."""

    i: In(stream.Signature(16))
    o: Out(stream.Signature(16))
    status: Out(data.StructLayout({"sum": 24, "last": 16, "twice": 17}))

    def elaborate(self, platform):
        m = Module()
        total, twice = Signal(24), Signal(17)
        m.d.comb += [
            self.o.payload.eq(self.i.payload ^ 0xA5),
            self.o.valid.eq(self.i.valid),
            self.i.ready.eq(self.o.ready),
            twice.eq(total[:16] << 1),
            self.status.sum.eq(total + 1),
            self.status.last.eq(self.i.payload),
            self.status.twice.eq(twice),
        ]
        with m.If(self.i.valid & self.o.ready):
            m.d.sync += total.eq(total + self.i.payload)
        return m


@pytest.mark.ci
@pytest.mark.long
def test_the_status_is_put_together_without_an_edge(monkeypatch):
    text = read_parts(generated(Counted(), monkeypatch))
    _, _, late = text.partition("\tif (!posedge_p_clk) {\n")
    late, _, edge = late.partition("\n\t}\n")
    assert late.count("p_status.slice<") == 3
    assert "p_status" not in edge
    values = np.arange(3000) * 7 % (1 << 16)
    assert both(Counted(), values, 3000).status["sum"] == (values.sum() + 1) % (1 << 24)
