"""Registers grouped by the conditions under which they change, and changed in place: the text, and equal
behaviour."""

import re

import numpy as np
import pytest
from amaranth.back import rtlil
from amaranth.hdl import Array, Module, Mux, Signal
from amaranth.lib import data, stream
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines import cxxrtl_source
from blysk.sim.engines.guards import _choice, group_registers

from .components import both


class Tangle(Component):
    """Registers that swap, hold, go round and depend on each other, under nested conditions."""

    i: In(stream.Signature(data.StructLayout({"x": 16, "on": 3})))
    o: Out(stream.Signature(data.ArrayLayout(32, 4)))

    def elaborate(self, platform):
        m = Module()
        x, on = self.i.payload.x, self.i.payload.on
        advance = Signal()
        m.d.comb += [advance.eq(~self.o.valid | self.o.ready), self.i.ready.eq(advance)]
        swap = [Signal(16, init=k, name=f"swap_{k}") for k in range(6)]
        ring = [Signal(32, init=3 * k + 1, name=f"ring_{k}") for k in range(6)]
        out_of_range = Signal(100, init=1)
        free = Signal(8)
        pair = data.StructLayout({"a": 16, "b": 20})
        m.submodules.memory = memory = Memory(shape=pair, depth=8, init=[{"a": k} for k in range(8)])
        read, write = memory.read_port(), memory.write_port()
        kept = Signal(data.StructLayout({"low": 16, "one": 1, "high": 47}))
        m.d.comb += [
            read.addr.eq(ring[0]),
            read.en.eq(advance),
            write.addr.eq(swap[1]),
            write.data.a.eq(x),
            write.data.b.eq(swap[3] + x),
            write.en.eq(advance & on[1]),
        ]
        # In the middle of the rest, and under no condition.
        m.d.sync += free.eq(free + 1)
        with m.If(advance):
            m.d.sync += [self.o.valid.eq(self.i.valid), kept.low.eq(kept.high)]
            with m.If(self.i.valid & on[0]):
                m.d.sync += [kept.one.eq(~kept.one), kept.high.eq(kept.low * x + kept.one)]
                m.d.sync += [to.eq(source) for to, source in zip(swap, reversed(swap), strict=True)]
                m.d.sync += swap[2].eq(x)
                with m.If(on[1]):
                    m.d.sync += [
                        to.eq(source + x) for to, source in zip(ring, ring[1:] + ring[:1], strict=True)
                    ]
                with m.Else():
                    m.d.sync += [
                        ring[0].eq(ring[3]),
                        ring[1].eq(ring[0] ^ free),
                        out_of_range.eq(out_of_range * 5 + x),
                    ]
            with m.Elif(on[2]):
                # Registers in both branches, and a part of a register.
                m.d.sync += [ring[4].eq(Mux(on[1], ring[5], ring[4])), ring[5][4:9].eq(x)]
                m.d.sync += Array(swap)[x[:2]].eq(free)
            with m.Switch(on):
                with m.Case(1, 5):
                    m.d.sync += [word.eq(word + 1) for word in ring[2:]]
                with m.Case(7):
                    m.d.sync += out_of_range.eq(0)
            m.d.sync += [
                self.o.payload[0].eq(ring[0] ^ ring[4]),
                self.o.payload[1].eq(sum(ring)),
                self.o.payload[2].eq(out_of_range >> 50),
                self.o.payload[3].eq(sum(swap) + read.data.a + read.data.b + kept.high + kept.one),
            ]
        return m


def generated(component, monkeypatch):
    """CXXRTL's own text."""
    with monkeypatch.context() as patch:
        for name in ("read_parts", "group_registers", "plain_words"):
            patch.setattr(cxxrtl_source, name, lambda text: text)
        return cxxrtl_source.generated(rtlil.convert(component, name="top", emit_src=False))


@pytest.mark.ci
@pytest.mark.long
def test_the_machine_is_the_same(monkeypatch):
    """Against pysim under stalls, over four times the cycles of the check of a new model."""
    rng = np.random.default_rng(4)
    beats = {"x": rng.integers(0, 1 << 16, 1500), "on": rng.integers(0, 8, 1500)}
    component = Tangle()
    assert re.search(r"p_ring__\d\.curr = ", group_registers(generated(component, monkeypatch)))
    stalls = {"input_stalls": rng.random(701) < 0.3, "output_stalls": rng.random(503) < 0.4}
    both(component, beats, 1500, **stalls)


class Few(Component):
    """One register for each output."""

    i: In(stream.Signature(8))
    o: Out(stream.Signature(8))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += [self.o.valid.eq(self.i.valid), self.o.payload.eq(self.i.payload)]
        return m


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("(a ? b : c)", ("a", "b", "c")),
        (
            "(f<1>(a, (b ? c : d)) ? value<2>{0u} : (e ? f : g))",
            ("f<1>(a, (b ? c : d))", "value<2>{0u}", "(e ? f : g)"),
        ),
        ("((a ? b : c) ? d : e)", ("(a ? b : c)", "d", "e")),
        ("(a ? b : c).slice<1>().val()", None),
        ("f(a ? b : c)", None),
        ("(a)", None),
        ("a.curr", None),
        ("(a ? b : c) + (d)", None),
    ],
)
def test_choice(text, parts):
    assert _choice(text) == parts


def test_text_that_is_not_understood_stays(monkeypatch):
    plain = generated(Tangle(), monkeypatch)
    # A combinational value after the first register.
    odd = plain.replace("\treturn converged;\n", "\tp_x = p_y;\n\treturn converged;\n")
    assert odd != plain
    assert group_registers(odd) == odd
    for text in ("", "struct p_top {};", plain.replace("posedge_p_clk", "posedge_p_other")):
        assert group_registers(text) == text
