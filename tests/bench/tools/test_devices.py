# amaranth: UnusedElaboratable=no
"""Parts of other FPGAs by Yosys alone: kinds of cells, the command, and small netlists."""

import json
import re
from importlib.util import find_spec
from pathlib import Path

import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.bench.tools import devices
from blysk.bench.tools.device_names import DEVICE_NAMES
from blysk.bench.tools.devices import DEVICES, PARTS, count_cells, parts
from blysk.hdl.core.memory import connect_wide_fifo
from blysk.hdl.emit.cost import cost_of
from blysk.sim.cli.main import main
from blysk.sim.installation import install_extra

LIBRARIES = {
    "xc7": "xilinx/cells_sim.v xilinx/cells_xtra.v",
    "gowin": "gowin/cells_sim.v gowin/cells_xtra_gw2a.v",
    "nexus": "lattice/cells_bb_nexus.v lattice/cells_sim_nexus.v nexus/cells_sim.v",
    "cyclonev": "intel_alm/common/alm_sim.v intel_alm/common/dff_sim.v intel_alm/common/dsp_sim.v "
    "intel_alm/common/mem_sim.v intel_alm/common/misc_sim.v",
    "ice40": "ice40/cells_sim.v",
    "gatemate": "gatemate/cells_sim.v gatemate/cells_bb.v",
}
"""Files of Yosys with the cells of each family."""

WITHOUT_LUT_RAM = ("ice40", "gatemate")

needs_yosys = pytest.mark.skipif(not find_spec("pyosys"), reason="the extra fpga is not installed")


def test_names():
    assert list(DEVICES) == list(DEVICE_NAMES)


@needs_yosys
@pytest.mark.parametrize("name", DEVICES)
def test_patterns_fit_cells_of_yosys(name):
    """Each pattern fits kinds of cells that Yosys has for the family, and no kind fits two patterns."""
    folder = Path(find_spec("pyosys").origin).parent / "share"
    files = [folder / file for file in LIBRARIES[name].split()]
    text = "".join(file.read_text(encoding="utf-8") for file in files if file.is_file())
    kinds = dict.fromkeys(re.findall(r"^module\s+\\?([\w$]+)", text, re.MULTILINE), 1)
    found = {part: 0 for part in PARTS.values() if part != "others"}
    for kind in kinds:
        fits = [part for part in found if re.fullmatch(getattr(DEVICES[name], part), kind)]
        assert len(fits) <= 1, kind
        for part in fits:
            found[part] += 1
    assert {part for part, count in found.items() if not count} == (
        {"distributed_rams"} if name in WITHOUT_LUT_RAM else set()
    )


def test_other_cells_are_counted():
    cells = {"LUT6": 5, "SRL16E": 2, "CARRY4": 3, "FDRE": 4, "FDSE": 1, "RAMB36E1": 6, "RAMB18E1": 1}
    cells |= {"RAM32M": 7, "DSP48E1": 8, "MUXF7": 9, "INV": 1, "$scopeinfo": 20}
    assert parts(cells, "xc7") == {
        "luts": 7,
        "carries": 3,
        "flip_flops": 5,
        "multipliers": 8,
        "block_rams": 7,
        "distributed_rams": 7,
        "others": 10,
    }


@pytest.fixture
def scripts(monkeypatch):
    """Yosys in place of which a stub writes a netlist. The scripts that it was given."""
    given = []

    def run(self, name, code, arguments, folder, text="", watch=None):
        assert (folder / "top.il").is_file()
        given.append(text)
        cells = {str(k): {"type": kind} for k, kind in enumerate(["CC_DFF", "CC_DFF", "SB_LUT4", "X"])}
        (folder / "netlist.json").write_text(json.dumps({"modules": {"top": {"cells": cells}}}))

    monkeypatch.setattr(devices.ToolRunner, "run", run)
    monkeypatch.setattr(devices, "version_of", lambda package: "1")
    return given


def test_command(scripts, tmp_path, capsys):
    path = tmp_path / "out.json"
    arguments = ["--unit", "gpq", "--device", "ice40", "--device", "gatemate", "--device", "ice40"]
    assert main(["fpga", *arguments, "--json", str(path)]) == 0
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["design", "device", *PARTS],
        ["gpq", "iCE40", "UP", *"1000003"],
        ["gpq", "GateMate", *"0020002"],
    ]
    assert [re.search("synth_[a-z0-9]+", script)[0] for script in scripts] == [
        "synth_ice40",
        "synth_gatemate",
    ]
    report = json.loads(path.read_text())
    assert report["tools"] == {"pyosys": "1"}
    assert report["designs"][1]["cells"] == {"CC_DFF": 2, "SB_LUT4": 1, "X": 1}


def test_every_device(scripts, capsys):
    assert main(["fpga", "--unit", "gpq", "--device", "all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + len(DEVICES)
    assert all(name in line for name, line in zip(DEVICE_NAMES.values(), lines[1:], strict=True))


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ["--device", "max10"],
            "--device max10: unknown device; use one of xc7, gowin, nexus, cyclonev, ice40, gatemate, all\n",
        ),
        (
            ["--device", "xc7", "--seeds", "2"],
            "--seeds: a --device is mapped by Yosys alone; leave out --seeds or --device\n",
        ),
        (
            ["--device", "xc7", "--family", "nexus"],
            "--family: a --device is mapped by Yosys alone; leave out --family or --device\n",
        ),
        (["--device", "xc7", "--unit", "fuse"], "--unit fuse: unknown unit; use attribute_serialiser, "),
        (["--device", "xc7", "--json", "nowhere/x"], "nowhere/x: cannot be written, there is no folder"),
    ],
)
def test_bad_input_is_one_line(arguments, line, refused):
    refused("fpga", *arguments, line=line)


def test_missing_yosys_is_one_line_that_names_the_extra(refused, monkeypatch):
    monkeypatch.setattr(devices, "version_of", lambda package: None)
    line = f"fpga: pyosys is not installed; {install_extra('fpga')}\n"
    refused("fpga", "--unit", "gpq", "--device", "xc7", line=line)


class Parts(wiring.Component):
    """A product without registers beside it, a FIFO in a small memory, a large table, and a counter."""

    i: In(stream.Signature(8))
    o: Out(stream.Signature(8))
    a: In(16)
    b: In(16)
    product: Out(32)
    word: Out(16)
    count: Out(24)

    def elaborate(self, platform):
        m = Module()
        connect_wide_fifo(m, "few", wiring.flipped(self.i), wiring.flipped(self.o), 16)
        # Not written, because families differ in the word that is read at the edge of a write.
        words = [k * 40503 % 65521 for k in range(1024)]
        m.submodules.many = many = Memory(shape=16, depth=1024, init=words)
        read = many.read_port()
        count = Signal(24)
        m.d.sync += count.eq(count + 1)
        m.d.comb += [
            self.product.eq(self.a * self.b),
            read.addr.eq(self.a),
            self.word.eq(read.data),
            self.count.eq(count),
        ]
        return m


@pytest.mark.long
@needs_yosys
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.ci] * (name == "gowin")) for name in DEVICES]
)
def test_small_netlist(name):
    """A multiplier, a block RAM, and a flip-flop for each bit of a register.

    The FIFO is in a memory of look-up tables if the family has these memories.
    """
    registers = cost_of(Parts()).register_bits
    found = parts(count_cells(Parts(), name), name)
    assert found["multipliers"] == 1
    assert found["block_rams"] >= 1
    assert found["carries"] > 0
    assert found["luts"] > 0
    if name in WITHOUT_LUT_RAM:
        assert found["flip_flops"] == registers + 8 * 16
        if name == "ice40":
            # A block RAM of GateMate is not taken for so few words.
            clocked = parts(count_cells(Parts(), name, clocked=True), name)
            assert clocked["flip_flops"] < registers + 8 * 16
    else:
        assert found["flip_flops"] == registers
        assert found["distributed_rams"] > 0
