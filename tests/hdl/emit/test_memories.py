"""Memories in emitted Verilog: initial zeros, reads at clock edges, and attributes for synthesis tools."""

import re

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

import blysk
from blysk.golden.build import ATTRIBUTES, STYLES
from blysk.hdl.bus.bus import core_of
from blysk.hdl.core.memory import delayed, turn_of
from blysk.hdl.emit.memories import SMALL, with_attributes
from blysk.hdl.emit.verilog import emit


class Memories(wiring.Component):
    """A table, written memories of two sizes, a written memory with a first word, and a product."""

    a: In(9)
    b: In(9)
    o: Out(18)
    words: Out(40)

    def elaborate(self, platform):
        m = Module()
        read = []
        for name, depth, init in (("fixed", 8, range(8)), ("many", 2 * SMALL, []), ("begun", SMALL, [0, 5])):
            m.submodules[name] = memory = Memory(shape=9, depth=depth, init=init)
            port = memory.read_port()
            m.d.comb += port.addr.eq(self.a)
            read.append(port.data)
            if name != "fixed":
                write = memory.write_port()
                m.d.comb += [write.addr.eq(self.b), write.data.eq(self.a), write.en.eq(1)]
        late = delayed(m, "few", self.b, 6, turn_of(m, 6))
        m.d.comb += [self.o.eq(self.a * late), self.words.eq(sum(read))]
        return m


@pytest.fixture(scope="module")
def plain():
    return emit(Memories(), "core")


def initial(text):
    return set(re.findall(r"^  initial begin\n    ([a-z]+)\w*\[", text, re.MULTILINE))


def test_initial_words(plain):
    """Zeros of written memories are left out, unless they are asked for. All other words stay."""
    assert initial(plain) == {"fixed", "begun"}
    assert initial(emit(Memories(), "core", zeros=True)) == {"fixed", "begun", "many", "few"}


def within_a_cycle(text):
    """Memories of emitted Verilog that are read outside of a clocked block.

    A clocked read that sees a write at its edge has a register for its address. Nothing else reads this
    register.
    """
    found = []
    for body in re.findall(r"^module .*?^endmodule", text, re.MULTILINE | re.DOTALL):
        body = re.sub(r"^  initial begin\n.*?^  end\n", "", body, flags=re.MULTILINE | re.DOTALL)
        rest = re.sub(r"^  always @\(posedge clk\).*?(?=^  \S)", "", body, flags=re.MULTILINE | re.DOTALL)
        for name in re.findall(r"^  reg (?:\[\d+:0\] )?(\w+) \[\d+:0\];", body, re.MULTILINE):
            for address in re.findall(rf"^  (?!reg ).*\b{name}\[(.*?)\]", rest, re.MULTILINE):
                others = re.sub(rf"\b{name}\[{re.escape(address)}\]", "", rest)
                own = re.fullmatch(r"\w+", address) and not re.search(
                    rf"^(?!  reg ).*\b{address}\b", others, re.MULTILINE
                )
                if not own or not re.search(rf"^    {address} <= ", body, re.MULTILINE):
                    found.append(f"{name}[{address}]")
    return found


def test_reads_within_a_cycle(plain):
    """A read within a cycle is in the text only without the option."""
    (read,) = within_a_cycle(plain)
    assert read.startswith("few")
    assert not within_a_cycle(emit(Memories(), "core", memories="synchronous"))


CORES = {"shader": {"albedo": "colors,bilinear"}, "geometry": {}, "render": {"lights": 2}}
"""Options with which a core has all kinds of memories."""


@pytest.mark.long
@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("top", CORES)
def test_cores_read_at_clock_edges(top, style):
    """Every memory that the text writes without the option is written with it, too."""
    chosen = blysk.design(method="quotient", style=style, **CORES[top])
    text = emit(core_of(chosen.built(top=top)), "core", memories="synchronous")
    usual = emit(core_of(chosen.built(top=top)), "core")
    assert text.count("] <= ") == usual.count("] <= ") >= 5
    assert not within_a_cycle(text)


@pytest.mark.parametrize("tool", ATTRIBUTES)
def test_attributes(tool, plain):
    """Attributes stand before the memories and the product, and the text is otherwise the same."""
    text = with_attributes(plain, tool)
    found = re.findall(r'  \(\* (\w+) = "(\w+)" \*\)\n  \w+ (?:\[\d+:0\] )?([a-z]+)[\d_]*(?: \[.*)?;\n', text)
    assert re.sub(r"  \(\* .* \*\)\n", "", text) == plain
    by_name = {name: (key, value) for key, value, name in found}
    named = {
        "vivado": ["rom_style distributed", "ram_style block", "ram_style distributed", "use_dsp yes"],
        "quartus": ["romstyle MLAB", None, "ramstyle MLAB", "multstyle dsp"],
        "synplify": [
            *("syn_romstyle logic", "syn_ramstyle block_ram", "syn_ramstyle distributed"),
            "syn_multstyle block_mult",
        ],
        "gowin": [
            *("syn_romstyle distributed_rom", "syn_ramstyle block_ram", "syn_ramstyle distributed_ram"),
            "syn_dspstyle dsp",
        ],
    }[tool]
    expected = dict(zip(("fixed", "many", "few", "o"), named, strict=True))
    expected["begun"] = expected["few"]
    assert {name: " ".join(pair) for name, pair in by_name.items()} == {
        name: words for name, words in expected.items() if words
    }


def test_no_attributes_without_a_tool(plain):
    assert with_attributes(plain, None) == plain
