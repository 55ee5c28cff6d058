# amaranth: UnusedElaboratable=no
"""Place and route: what is counted, what is timed, what is kept, and what is refused."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from amaranth.hdl import Module, Signal, signed
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.bench.tools import fpga, place_and_route
from blysk.bench.tools.families import ECP5, FAMILIES, NEXUS, Parts, Place
from blysk.bench.tools.fpga import table
from blysk.bench.tools.place_and_route import (
    Layout,
    Registered,
    TooLarge,
    ToolError,
    lay_out,
    parts_of,
    read_report,
)
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.sim.cli.main import main

tools = pytest.mark.skipif(
    any(None in place_and_route.tool_versions(family).values() for family in FAMILIES.values()),
    reason="the extra fpga is not installed",
)


class Product(wiring.Component):
    """A product of 18x18 bits between two registers, one multiplier; with gates before and behind it."""

    def __init__(self, gates=False):
        super().__init__({name: In(signed(18)) for name in "abcd"} | {"e": In(signed(36)), "o": Out(36)})
        self._gates = gates

    def elaborate(self, platform):
        m = Module()
        if self._gates:
            m.d.comb += self.o.eq((self.a ^ self.c) * (self.b ^ self.d) ^ self.e)
        else:
            m.d.comb += self.o.eq(self.a * self.b)
        return m


class MultiplyAdd(wiring.Component):
    """A product and a sum between two registers."""

    def __init__(self):
        super().__init__({"a": In(signed(18)), "b": In(signed(18)), "c": In(signed(36)), "o": Out(36)})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.o.eq(self.a * self.b + self.c)
        return m


class Counter(wiring.Component):
    """A counter, 24 flip-flops."""

    def __init__(self, width=24):
        super().__init__({"o": Out(width)})

    def elaborate(self, platform):
        m = Module()
        count = Signal(len(self.o))
        m.d.sync += count.eq(count + 1)
        m.d.comb += self.o.eq(count)
        return m


def step(kind, delay, cell, port, to=None):
    return {
        "type": kind,
        "delay": delay,
        "from": {"cell": cell, "port": "Q"},
        "to": {"cell": to or cell, "port": port},
    }


MULTIPLIER = "unit.datapath.product_TRELLIS_FF_Q_3_DI_MULT18X18D_P33"
LUT = "unit.sum_TRELLIS_FF_Q_2_DI_LUT4_Z"
# As nextpnr writes it: a path through a multiplier, a carry and a look-up table, and one from a port.
REPORT = {
    "fmax": {"clk": {"achieved": 123.4, "constraint": 150}},
    "utilization": {"TRELLIS_COMB": {"used": 77, "available": 24288}},
    "critical_paths": [
        {"from": "<async>", "to": "posedge clk", "path": [step("routing", 9.0, "i", "DI")]},
        {
            "from": "posedge clk",
            "to": "posedge clk",
            "path": [
                step("clk-to-q", 0.5, "i__payload$17_TRELLIS_FF_Q_1", "Q"),
                step("routing", 1.0, "i__payload$17_TRELLIS_FF_Q_1", "A3", MULTIPLIER),
                step("logic", 3.5, MULTIPLIER, "P4"),
                step("routing", 0.25, MULTIPLIER, "A", "unit.sum_CCU2C_S0$CCU2_COMB1"),
                step("logic", 0.5, "unit.sum_CCU2C_S0$CCU2_COMB1", "F"),
                step("routing", 0.25, "unit.sum_CCU2C_S0$CCU2_COMB1", "A", LUT),
                step("logic", 0.125, LUT, "F"),
                step("routing", 0.5, LUT, "DI", "unit.sum_TRELLIS_FF_Q_2"),
                step("setup", 0.0, "unit.sum_TRELLIS_FF_Q_2", "DI"),
            ],
        },
    ],
}


# The same of Nexus: from registers inside a multiplier, through its stages, a carry and a look-up table to a
# memory.
STAGES = "unit.product_MULT18X18_Z/"
WIDE = "unit.sum_FD1P3IX_Q_2_D_WIDEFN9_Z$widefn_comb[0]$"
NEXUS_REPORT = {
    "fmax": {"clk": {"achieved": 123.4, "constraint": 150}},
    "utilization": {"OXIDE_COMB": {"used": 77, "available": 32256}},
    "critical_paths": [
        {
            "from": "posedge clk",
            "to": "posedge clk",
            "path": [
                step("clk-to-q", 0.75, f"{STAGES}PREADD9_CORE_x0_z0", "BR0"),
                step("routing", 0.0, f"{STAGES}PREADD9_CORE_x0_z0", "BR0", f"{STAGES}MULT9_CORE_x0_z2"),
                step("logic", 1.5, f"{STAGES}MULT9_CORE_x0_z2", "P18"),
                step("routing", 0.5, f"{STAGES}MULT9_CORE_x0_z2", "P18", f"{STAGES}MULT18_CORE_x0_z4"),
                step("logic", 1.25, f"{STAGES}MULT18_CORE_x0_z4", "P36"),
                step("routing", 1.0, f"{STAGES}MULT18_CORE_x0_z4", "A", "unit.sum_CCU2_S0$ccu2_comb[1]$"),
                step("logic", 0.5, "unit.sum_CCU2_S0$ccu2_comb[1]$", "F"),
                step("routing", 0.25, "unit.sum_CCU2_S0$ccu2_comb[1]$", "A", WIDE),
                step("logic", 0.25, WIDE, "OFX"),
                step("routing", 0.25, WIDE, "WCK0", "unit.places$3.storage.0.1$lutram_ramw$"),
                step("setup", 0.25, "unit.places$3.storage.0.1$lutram_ramw$", "D0"),
            ],
        }
    ],
}


def test_report():
    place = read_report(REPORT, 7)
    assert place == Place(
        seed=7,
        fmax=123.4,
        start="i__payload",
        end="sum.DI",
        logic=4.625,
        routing=2.0,
        kinds={"multiplier": 1, "carry": 1, "LUT": 1},
    )


def test_stages_of_a_multiplier_are_one_cell():
    assert read_report(NEXUS_REPORT, 7, NEXUS) == Place(
        seed=7,
        fmax=123.4,
        start="product",
        end="places$3.storage.D0",
        logic=4.5,
        routing=2.0,
        kinds={"multiplier": 1, "carry": 1, "LUT": 1},
    )


@pytest.mark.parametrize(
    "change",
    [
        {"fmax": {}},
        {"fmax": {"clk": {"achieved": 1.0}, "other": {"achieved": 2.0}}},
        {"critical_paths": REPORT["critical_paths"][:1]},
        {"critical_paths": [{**REPORT["critical_paths"][1], "path": []}]},
    ],
)
def test_report_of_something_else(change):
    with pytest.raises(ToolError, match="report is not as expected"):
        read_report({**REPORT, **change}, 1)


def netlist(*cells):
    """Yosys's JSON of some cells: kind, parameters, and the nets of D and Q."""
    ports = {"i": {"direction": "input", "bits": [2]}, "o": {"direction": "output", "bits": [5, "0"]}}
    cells = {
        str(k): {"type": kind, "parameters": parameters, "connections": {"DI": [d], "Q": [q]}}
        for k, (kind, parameters, d, q) in enumerate(cells)
    }
    return {"modules": {"top": {"ports": ports, "cells": cells}}}


def test_registers_at_ports_are_not_counted():
    # From the input, between, to the output.
    flip_flops = [("TRELLIS_FF", {}, d, d + 1) for d in (2, 3, 4)]
    found = parts_of(netlist(*flip_flops, ("MULT18X18D", {"REG_OUTPUT_CLK": "NONE"}, 8, 9)), REPORT)
    assert found == Parts(77, 1, 1, 0, 0)
    found = parts_of(netlist(("DP16KD", {}, 8, 9), ("TRELLIS_DPR16X4", {}, 8, 9)), REPORT)
    assert found == Parts(77, 0, 0, 1, 1)
    # A constant is no net of the port that has one.
    assert parts_of(netlist(("TRELLIS_FF", {}, "0", 9)), REPORT).flip_flops == 1


def test_cells_of_nexus():
    """Four kinds of flip-flop and of block RAM, and a multiplier with its registers."""
    flip_flops = [(f"FD1P3{kind}X", {}, 3, 4) for kind in "BDIJ"]
    memories = [(f"{kind}16K", {}, 8, 9) for kind in ("DP", "PDP", "PDPSC", "SP")]
    others = [("MULT18X18", {"REGINPUTA": "REGISTER"}, 8, 9), ("DPR16X4", {}, 8, 9), ("CCU2", {}, 8, 9)]
    assert parts_of(netlist(*flip_flops, *memories, *others), NEXUS_REPORT, NEXUS) == Parts(77, 4, 1, 4, 1)


@pytest.mark.parametrize(
    ("family", "cell", "name"),
    [
        (ECP5, ("MULT18X18D", {"REG_INPUTA_CLK": "CLK0"}, 8, 9), "MULT18X18D.REG_INPUTA_CLK=CLK0"),
        (ECP5, ("ALU54B", {"REG_OUTPUT0_CLK": "NONE"}, 8, 9), "ALU54B"),
        (NEXUS, ("MULTADDSUB18X18", {"REGOUTPUT": "BYPASS"}, 8, 9), "MULTADDSUB18X18"),
    ],
)
def test_what_nextpnr_does_not_time_is_not_placed(family, cell, name, cache, monkeypatch):
    def run(self, tool, code, arguments, folder, text=""):
        assert tool == "Yosys"
        (folder / "netlist.json").write_text(json.dumps(netlist(("LUT4", {}, 3, 4), cell)))

    monkeypatch.setattr(place_and_route._Runner, "run", run)
    monkeypatch.setattr(place_and_route, "versions_of", lambda family: {})
    with pytest.raises(ToolError, match=f"has a cell {name}, which nextpnr does not time paths through"):
        lay_out("counter", Counter(), 1, family=family)


@pytest.mark.parametrize(
    ("family", "cell", "most", "name"),
    [
        (ECP5, "TRELLIS_FF", 24_288, "flip-flops"),
        (ECP5, "MULT18X18D", 28, "multipliers"),
        (ECP5, "DP16KD", 56, "block RAMs"),
        (ECP5, "LUT4", 24_288, "look-up tables"),
        (NEXUS, "MULT18X18", 56, "multipliers"),
    ],
)
def test_what_does_not_fit_is_not_placed(family, cell, most, name, cache, monkeypatch):
    """nextpnr's static placer would never end."""
    count = most

    def run(self, tool, code, arguments, folder, text=""):
        if tool == "Yosys":
            (folder / "netlist.json").write_text(json.dumps(netlist(*[(cell, {}, 3, 4)] * count)))
        else:
            raise ToolError("it is placed")

    monkeypatch.setattr(place_and_route._Runner, "run", run)
    monkeypatch.setattr(place_and_route, "versions_of", lambda family: {})
    with pytest.raises(ToolError, match=r"^it is placed$"):
        lay_out("counter", Counter(), 1, family=family)
    count += 1
    with pytest.raises(TooLarge, match=f"^does not fit: {count:,} {name}, ports too, on {most:,} of the "):
        lay_out("counter", Counter(), 1, family=family)


def test_what_finds_no_place_does_not_fit(calls, cache, monkeypatch):
    run = place_and_route._Runner.run

    def fails(self, name, *arguments):
        if name == "nextpnr":
            raise ToolError(
                "nextpnr ends with status 125: ERROR: Unable to find legal placement for all cells"
            )
        run(self, name, *arguments)

    monkeypatch.setattr(place_and_route._Runner, "run", fails)
    with pytest.raises(
        TooLarge, match=r"^does not fit: from seed 1 nextpnr ends with status 125: ERROR: Unable"
    ):
        lay_out("counter", Counter(), 1)


def test_command_goes_on_after_what_does_not_fit(calls, cache, tmp_path, capsys, monkeypatch):

    def refuses(name, *arguments):
        layout = lay_out(name, *arguments)
        if name == "diffuse":
            raise TooLarge("does not fit: 30 multipliers")
        return layout

    monkeypatch.setattr(fpga, "lay_out", refuses)
    path = tmp_path / "out.json"
    assert main(["fpga", "--unit", "diffuse", "--unit", "gpq", "--seeds", "1", "--json", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].startswith("gpq ")
    assert lines[3] == "diffuse: does not fit: 30 multipliers"
    assert json.loads(path.read_text())["too_large"] == {"diffuse": "does not fit: 30 multipliers"}
    # Alone it is an error.
    assert main(["fpga", "--unit", "diffuse", "--seeds", "1"]) == 1
    assert capsys.readouterr().err == "blysk: does not fit: 30 multipliers\n"


def test_every_port_has_a_register():
    unit = DiffuseUnit()
    wrapped = Registered(unit)
    assert set(wrapped.signature.members) == {
        "i__payload",
        "i__valid",
        "i__ready",
        "o__payload",
        "o__valid",
        "o__ready",
    }
    bits = sum(len(getattr(wrapped, name)) for name in wrapped.signature.members)
    assert cost_of(wrapped).register_bits == cost_of(DiffuseUnit()).register_bits + bits


def test_ports_that_are_constant_have_none():
    class Always(wiring.Component):
        i: In(stream.Signature(4, always_ready=True))

        def elaborate(self, platform):
            m = Module()
            m.d.sync += Signal(4, name="kept").eq(self.i.payload)
            return m

    assert set(Registered(Always()).signature.members) == {"i__payload", "i__valid"}


@pytest.fixture
def calls(monkeypatch):
    """Stands for the tools: writes what they would, notes what was called."""
    calls = []

    def run(self, name, code, arguments, folder, text=""):
        calls.append((name, *arguments[-1:]))
        if name == "Yosys":
            (folder / "netlist.json").write_text(json.dumps(netlist(("TRELLIS_FF", {}, 3, 4))))
        else:
            seed = int(arguments[-1])
            report = {
                **REPORT,
                "fmax": {"clk": {"achieved": 100.0 + seed}},
                "utilization": REPORT["utilization"] | NEXUS_REPORT["utilization"],
            }
            (folder / f"{seed}.json").write_text(json.dumps(report))

    monkeypatch.setattr(place_and_route._Runner, "run", run)
    for module in (fpga, place_and_route):
        monkeypatch.setattr(module, "versions_of", lambda family: {"pyosys": "1", family.package: "2"})
    return calls


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "fpga"


def test_what_is_cached_runs_no_tool(calls, cache):
    first = lay_out("counter", Counter(), 3, 2)
    assert sorted(calls) == [("Yosys",), ("nextpnr", "1"), ("nextpnr", "2"), ("nextpnr", "3")]
    assert first.fmax == (101.0, 102.0, 103.0)
    assert [place.seed for place in first.places] == [1, 2, 3]
    calls.clear()
    ticks = []
    assert lay_out("again", Counter(), 3, progress=lambda: ticks.append(1)) == Layout(
        "again", first.parts, first.places
    )
    assert not calls
    assert len(ticks) == 3
    # A seed more is placed alone; a damaged entry again.
    lay_out("counter", Counter(), 4)
    assert calls == [("Yosys",), ("nextpnr", "4")]
    calls.clear()
    next(cache.glob("*-2.json")).write_text('{"parts": {}')
    assert lay_out("counter", Counter(), 4).fmax == (101.0, 102.5, 104.0)
    assert calls == [("Yosys",), ("nextpnr", "2")]
    assert len(list(cache.iterdir())) == 4


@pytest.mark.parametrize(
    ("luts", "placer"), [(place_and_route._MANY - 1, ()), (place_and_route._MANY, ECP5.large)]
)
def test_placer_by_size(luts, placer, cache, monkeypatch):
    """Hardly any logic would never end in the static placer."""
    given = []

    def run(self, name, code, arguments, folder, text=""):
        if name == "Yosys":
            (folder / "netlist.json").write_text(json.dumps(netlist(*[("LUT4", {}, 3, 4)] * luts)))
        else:
            given.extend(arguments)
            (folder / "1.json").write_text(json.dumps(REPORT))

    monkeypatch.setattr(place_and_route._Runner, "run", run)
    monkeypatch.setattr(place_and_route, "versions_of", lambda family: {})
    lay_out("counter", Counter(), 1)
    place = given.index("--placer") if placer else 0
    assert ("--placer" in given) == bool(placer)
    assert tuple(given[place : place + len(placer)]) == placer


def test_another_design_family_or_tool_is_another_entry(calls, cache, monkeypatch):
    lay_out("counter", Counter(), 1)
    lay_out("counter", Counter(23), 1)
    lay_out("counter", Counter(), 1, family=NEXUS)
    monkeypatch.setattr(place_and_route, "versions_of", lambda family: {"pyosys": "1", family.package: "3"})
    lay_out("counter", Counter(), 1)
    assert calls == [("Yosys",), ("nextpnr", "1")] * 4
    assert len(list(cache.iterdir())) == 4


def test_seeds_that_are_done_stay_when_one_fails(calls, cache, monkeypatch):
    run = place_and_route._Runner.run

    def fails(self, name, code, arguments, folder, text=""):
        if arguments[-1:] == ["2"]:
            raise ToolError("nextpnr ends with status 1: no place")
        run(self, name, code, arguments, folder, text)

    with monkeypatch.context() as patch:
        patch.setattr(place_and_route._Runner, "run", fails)
        with pytest.raises(ToolError, match="no place"):
            lay_out("counter", Counter(), 3)
    assert [path.name[-6] for path in cache.iterdir()] == ["1"]


def test_runner_names_the_tools_own_error(tmp_path):
    runner = place_and_route._Runner()
    code = "import sys; print('INFO: x'); print('ERROR: no such cell'); print('more'); sys.exit(3)"
    with pytest.raises(ToolError, match=r"^Yosys ends with status 3: ERROR: no such cell$"):
        runner.run("Yosys", code, [], tmp_path)
    runner.stop()
    with pytest.raises(ToolError, match="Yosys was stopped"):
        runner.run("Yosys", "", [], tmp_path)
    assert not list(tmp_path.iterdir())


def test_stopped_runner_ends_what_runs(tmp_path):
    runner = place_and_route._Runner()
    pool = place_and_route.ThreadPoolExecutor(1)
    waiting = pool.submit(runner.run, "nextpnr", "import time; time.sleep(600)", [], tmp_path)
    while not runner._running:
        time.sleep(0.01)
    start = time.monotonic()
    runner.stop()
    with pytest.raises(ToolError, match="nextpnr ends with status -9"):
        waiting.result(60)
    assert time.monotonic() - start < 60
    pool.shutdown()


def test_table():
    def place(seed, fmax):
        return Place(seed, fmax, "a", f"b.{seed}", 4.0, 3.25, {})

    layouts = [
        Layout("short", Parts(1, 2, 3, 4, 5), (place(1, 130.0), place(2, 120.04), place(3, 125.0))),
        Layout("longer", Parts(10000, 2, 0, 0, 0), (place(1, 99.96),)),
    ]
    assert table(layouts, NEXUS).splitlines() == [
        "design                              LUT    FF mult BRAM LUTRAM   min median   max slowest path, ns",
        "LIFCL-40, CABGA400, speed grade 7 32256 32256   56   84   4032",
        "short                                 1     2    3    4      5 120.0  125.0 130.0 4.0+3.2 a -> b.2",
        "longer                            10000     2    0    0      0 100.0  100.0 100.0 4.0+3.2 a -> b.1",
    ]
    figures = layouts[0].as_dict()
    assert [figures[f"fmax_{name}_mhz"] for name in ("min", "median", "max")] == [120.04, 125.0, 130.0]
    assert figures["seeds"][1]["end"] == "b.2"


@pytest.mark.parametrize(("options", "family"), [([], ECP5), (["--family", "nexus"], NEXUS)])
def test_command(options, family, calls, cache, tmp_path, capsys):
    path = tmp_path / "out.json"
    arguments = ["--unit", "diffuse", "--unit", "gpq", "--seeds", "2", "--json", str(path)]
    assert main(["fpga", *options, *arguments]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith(f"{family.device} ")
    assert [line.split()[0] for line in lines[::2]] == ["design", "diffuse"]
    assert lines[3].startswith("gpq ")
    report = json.loads(path.read_text())
    assert report["device"] == family.device
    assert report["capacity"]["multipliers"] == family.capacity.multipliers
    assert report["tools"] == {"pyosys": "1", family.package: "2"}
    assert [design["design"] for design in report["designs"]] == ["diffuse", "gpq"]
    for design in report["designs"]:
        assert design["fmax_median_mhz"] == 101.5
        assert [place["seed"] for place in design["seeds"]] == [1, 2]


def test_designs():
    def names(designs):
        return [name for name, _ in designs]

    gates = ["middle_normal exact", "diffuse"]
    assert names(fpga._units(gates)) == gates
    forms = names(fpga._units(["quadratic_evaluator"]))
    assert forms == [f"quadratic_evaluator {form}" for form in QUADRATIC_FORMS]
    full = {"method": "chord", "style": "compact", "setup_interval": 7, "gate": True}
    whole = "pipeline chord, cosquad, 2 lights, compact, interval 7, gate"
    assert names(fpga._pipelines(full, 2, False)) == [whole]
    assert names(fpga._pipelines({}, 1, True)) == [f"pipeline {m}, cosquad, 1 light" for m in fpga.METHODS]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--seeds", "0"], "blysk: --seeds 0: out of range; give a whole number from 1 to 100"),
        (["--jobs", "no"], "blysk: --jobs no: not a whole number; give"),
        (
            ["--unit", "fuse"],
            "blysk: --unit fuse: unknown unit; use a name of the table of blysk blocks",
        ),
        (["--unit", "gpq", "--method", "chord"], "blysk: --method: is for the pipeline; leave it out, or"),
        (["--unit", "gpq", "--every-method"], "blysk: --every-method: is for the pipeline; leave it out"),
        (["--method", "chord", "--every-method"], "blysk: --method: is one of every method; leave it out"),
        (["--family", "ice40"], "blysk: --family ice40: unknown family; use one of ecp5, nexus"),
        (["--method", "none"], "blysk: --method none: unknown method; use one of"),
        (["--model", "phong"], "blysk: --model phong: the pipeline finds N.H, not R.V; use one of"),
        (["--json", "nowhere/x"], "blysk: nowhere/x: cannot be written, there is no folder nowhere; make"),
    ],
)
def test_bad_input_is_one_line(arguments, line, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["fpga", *arguments]) == 2
    output, errors = capsys.readouterr()
    assert output == ""
    assert errors.startswith(line)
    assert errors.count("\n") == 1


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("which", [(0,), (1,), (0, 1)])
def test_missing_tools_are_one_line_that_names_the_extra(which, family, capsys, monkeypatch):
    # Whether or not they are installed here.
    missing = [("pyosys", FAMILIES[family].package)[k] for k in which]
    monkeypatch.setattr(place_and_route, "version_of", lambda package: None if package in missing else "1")
    assert main(["fpga", "--unit", "gpq", "--family", family]) == 2
    output, errors = capsys.readouterr()
    assert output == ""
    text = f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} not installed"
    assert errors == f"blysk: fpga: {text}; pip install 'blysk[fpga]'\n"


def test_help_has_an_example(capsys):
    assert main(["fpga", "--help"]) == 0
    assert re.search(r"Examples:\n +blysk fpga ", capsys.readouterr().out)


# With the tools.


def period(place):
    """A path is the clock's period, to the rounding of the report."""
    return pytest.approx(1000 / place.fmax, rel=1e-3) == place.logic + place.routing


@tools
@pytest.mark.parametrize(
    ("family", "kinds"),
    [
        (ECP5, ("TRELLIS_COMB", "TRELLIS_FF", "MULT18X18D", "DP16KD", "TRELLIS_RAMW")),
        (NEXUS, ("OXIDE_COMB", "OXIDE_FF", "MULT18_CORE", "OXIDE_EBR", "RAMW")),
    ],
)
def test_parts_and_time_of_a_counter(family, kinds, cache, monkeypatch):
    reports = []

    def parts(netlist, report, family):
        reports.append(report)
        return parts_of(netlist, report, family)

    monkeypatch.setattr(place_and_route, "parts_of", parts)
    counter = lay_out("counter", Counter(), 1, family=family)
    assert counter.parts.flip_flops == 24
    assert 24 <= counter.parts.luts <= 24 + 8
    assert counter.parts.multipliers == counter.parts.block_rams == 0
    assert "multiplier" not in counter.places[0].kinds
    assert period(counter.places[0])
    # What nextpnr says that the device has.
    available = [reports[0]["utilization"][kind]["available"] for kind in kinds]
    assert Parts(*available) == family.capacity


@tools
def test_parts_and_times_of_a_product(cache):
    """The slowest path is through the multiplier."""
    product = lay_out("product", Product(), 2, 2)
    assert product.parts.multipliers == 1
    assert product.parts.flip_flops == 0
    for place in product.places:
        assert place.kinds == {"multiplier": 1}
        assert {place.start} <= {"a", "b"}
        assert place.end.startswith("o.")
        assert period(place)
        # toolchain.md: one 18x18 multiplier's ceiling, out of a placement of nothing else.
        assert 120 < place.fmax < 180


@tools
def test_times_of_a_multiplier_with_registers_of_its_own(cache):
    """On Nexus the multiplier is timed between its own registers, and between others."""
    inside, outside = (lay_out("product", Product(gates), 1, family=NEXUS) for gates in (False, True))
    for layout in (inside, outside):
        assert layout.parts.multipliers == 1
        assert layout.parts.flip_flops == 0
        assert period(layout.places[0])
    (place,) = inside.places
    assert place.kinds == {"multiplier": 1}
    assert place.start == "o"
    assert place.end.startswith("o.P")
    # toolchain.md: by the speed grade of the device.
    assert 165 < place.fmax < 221
    (place,) = outside.places
    assert place.kinds == {"LUT": 2, "multiplier": 1}
    assert {place.start} <= set("abcd")
    assert place.end.startswith("o.D")


@tools
def test_a_multiplier_with_an_adder_is_refused(cache):
    with pytest.raises(ToolError, match="has a cell MULTADDSUB18X18, which nextpnr does not time"):
        lay_out("sum", MultiplyAdd(), 1, family=NEXUS)


@tools
def test_what_the_tools_refuse_is_one_line(cache, monkeypatch):
    monkeypatch.setattr(place_and_route, "_BEFORE", "read_rtlil nothing.il\n")
    with pytest.raises(ToolError, match=r"^Yosys ends with status .*nothing\.il"):
        lay_out("none", Counter(), 1)


@tools
@pytest.mark.skipif(os.name != "posix", reason="a signal to a process")
def test_interrupt_leaves_nothing_behind(cache, tmp_path):
    folder = tmp_path / "temporary"
    folder.mkdir()
    environment = {**os.environ, "TMPDIR": str(folder)}
    arguments = ["fpga", "--method", "chord"]
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import sys; from blysk.sim.cli.main import main; sys.exit(main())",
            *arguments,
        ],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
    )
    while not list(folder.glob("blysk-*/top.il")):
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "blysk: interrupted"
    assert not list(folder.iterdir())
    assert not list(cache.glob("*"))
