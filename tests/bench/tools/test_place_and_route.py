# amaranth: UnusedElaboratable=no
"""Place and route: counts, times, stored results, and refusals."""

import time

import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In

from blysk.bench.tools import place_and_route, tool_runner
from blysk.bench.tools.families import ECP5, FAMILIES, NEXUS, Parts, Place
from blysk.bench.tools.place_and_route import Layout, Registered, lay_out, parts_of, read_report
from blysk.bench.tools.tool_runner import GivenUp, TooLarge, ToolError, ToolRunner
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.diffuse import DiffuseUnit

from .stubs import NEXUS_REPORT, REPORT, Counter, MultiplyAdd, Product, Stages, netlist

tools = pytest.mark.skipif(
    any(None in place_and_route.tool_versions(family).values() for family in FAMILIES.values()),
    reason="the extra fpga is not installed",
)


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
    ("achieved", "closed", "quoted"), [(400.0, 0, 400.0), (400.0, 1, 250.0), (240.0, 2, 240.0)]
)
def test_limit_where_an_interior_is_not_timed(achieved, closed, quoted):
    place = read_report({**REPORT, "fmax": {"clk": {"achieved": achieved}}}, 1, ECP5, closed)
    assert (place.fmax, place.closed) == (quoted, closed)


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


def test_registers_at_ports_are_not_counted():
    # From the input, between, to the output.
    flip_flops = [("TRELLIS_FF", {}, d, d + 1) for d in (2, 3, 4)]
    found = parts_of(netlist(*flip_flops, ("MULT18X18D", {"REG_OUTPUT_CLK": "NONE"}, 8, 9)), REPORT)
    assert found == Parts(77, 1, 1, 0, 0)
    found = parts_of(netlist(("DP16KD", {}, 8, 9), ("TRELLIS_DPR16X4", {}, 8, 9)), REPORT)
    assert found == Parts(77, 0, 0, 1, 1)
    # A constant does not count as a net of the port.
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
def test_what_nextpnr_does_not_time_is_not_placed(family, cell, name, calls, cache):
    calls.cells = [("LUT4", {}, 3, 4), cell]
    with pytest.raises(ToolError, match=f"has a cell {name}, which nextpnr does not time paths through"):
        lay_out("counter", Counter(), 1, family=family)
    assert calls == [("Yosys",)]


@pytest.mark.parametrize(
    ("family", "cell", "most", "name"),
    [
        pytest.param(ECP5, "TRELLIS_FF", 24_288, "flip-flops", marks=pytest.mark.long),
        (ECP5, "MULT18X18D", 28, "multipliers"),
        (ECP5, "DP16KD", 56, "block RAMs"),
        pytest.param(ECP5, "LUT4", 24_288, "look-up tables", marks=pytest.mark.long),
        (NEXUS, "MULT18X18", 56, "multipliers"),
    ],
)
def test_what_does_not_fit_is_not_placed(family, cell, most, name, calls, cache):
    """nextpnr's static placer would never end."""
    calls.cells = [(cell, {}, 3, 4)] * most
    lay_out("fits", Counter(), 1, family=family)
    calls.cells = [(cell, {}, 3, 4)] * (most + 1)
    with pytest.raises(TooLarge, match=f"^does not fit: {most + 1:,} {name}, ports too, on {most:,} of the "):
        lay_out("counter", Counter(23), 1, family=family)
    assert calls == [("Yosys",), ("nextpnr", "1"), ("Yosys",)]


def test_what_finds_no_place_does_not_fit(calls, cache, monkeypatch):
    run = place_and_route.ToolRunner.run

    def fails(self, name, *arguments, **options):
        if name == "nextpnr":
            raise ToolError(
                "nextpnr ends with status 125: ERROR: Unable to find legal placement for all cells"
            )
        run(self, name, *arguments, **options)

    monkeypatch.setattr(place_and_route.ToolRunner, "run", fails)
    with pytest.raises(
        TooLarge, match=r"^does not fit: from seed 1 nextpnr ends with status 125: ERROR: Unable"
    ):
        lay_out("counter", Counter(), 1)


def test_every_port_has_a_register():
    unit = DiffuseUnit()
    wrapped = Registered(unit)
    parts = ("payload", "valid", "ready")
    assert set(wrapped.signature.members) == {f"{port}__{part}" for port in "io" for part in parts}
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
    # A further seed is placed alone, and a damaged entry is placed again. The mapped netlist is kept.
    lay_out("counter", Counter(), 4)
    assert calls == [("nextpnr", "4")]
    calls.clear()
    next(cache.glob("*-2.json")).write_text('{"parts": {}')
    assert lay_out("counter", Counter(), 4).fmax == (101.0, 102.5, 104.0)
    assert calls == [("nextpnr", "2")]
    assert len(list(cache.iterdir())) == 4


@pytest.mark.parametrize(
    ("luts", "placer"), [(place_and_route._LARGE - 1, ()), (place_and_route._LARGE, ECP5.large)]
)
def test_placer_by_size(luts, placer, calls, cache):
    """With hardly any logic the static placer would never end."""
    calls.cells = [("LUT4", {}, 3, 4)] * luts
    lay_out("counter", Counter(), 1)
    given = calls.arguments
    place = given.index("--placer") if placer else 0
    assert ("--placer" in given) == bool(placer)
    assert tuple(given[place : place + len(placer)]) == placer


def rounds(*slack):
    return "".join(
        f"Info: 9 arcs ripped up due to negative slack WNS={worst}ns TNS=-9.0ns.\n" for worst in slack
    )


@pytest.mark.parametrize(
    ("slack", "is_stuck"),
    [
        ([], False),
        ([-4.2] * 10, False),
        ([-4.2] * 11, True),
        ([-4.2 + 0.01 * k for k in range(40)], False),
        ([-4.2, -1.0, *[-4.2] * 10], True),
        ([*[-4.2] * 10, -4.1], False),
    ],
)
def test_a_router_that_does_not_end_is_asked_for_less(slack, is_stuck, calls, cache, monkeypatch):
    """If a target cannot be met at all, its slow paths are not routed again and again."""
    run, given = place_and_route.ToolRunner.run, []

    def talks(self, name, code, arguments, folder, text="", watch=None):
        given.append("--tmg-ripup" in arguments)
        if "--tmg-ripup" in arguments and (reason := watch(rounds(*slack))):
            raise GivenUp(reason)
        run(self, name, code, arguments, folder, text)

    monkeypatch.setattr(place_and_route.ToolRunner, "run", talks)
    monkeypatch.setattr(place_and_route, "_LARGE", 0)
    layout = lay_out("counter", Counter(), 1)
    assert layout.fmax == (101, 101, 101)
    assert layout.places[0].rerouted == is_stuck
    assert lay_out("counter", Counter(), 1) == layout
    assert given == [False, True, False][: 2 + is_stuck]


def overlaps(*rounds):
    return "".join(
        f"Info: overlap: COMB={logic}%, FF={logic / 2}%, RAM={ram}%, MUL=0.0%\n" for logic, ram in rounds
    )


@pytest.mark.parametrize(
    ("log", "is_crowded"),
    [
        ([(99.0, 90.0)] * 300, False),
        ([(0.2, 20.0)] * 200, False),
        ([(0.2, 20.0)] * 201, True),
        ([*[(0.2, 20.0)] * 200, (5.5, 20.0)], False),
    ],
)
def test_a_placer_that_does_not_end_is_replaced(log, is_crowded, calls, cache, monkeypatch):
    """The static placer moves block RAMs to and fro when all else has a place."""
    run, given = place_and_route.ToolRunner.run, []

    def talks(self, name, code, arguments, folder, text="", watch=None):
        if name == "nextpnr":
            given.append("static" in arguments and "--placer" in arguments)
            assert "--tmg-ripup" in arguments
        if given[-1:] == [True] and (reason := watch(overlaps(*log))):
            raise GivenUp(reason)
        run(self, name, code, arguments, folder, text)

    monkeypatch.setattr(place_and_route.ToolRunner, "run", talks)
    monkeypatch.setattr(place_and_route, "_LARGE", 0)
    layout = lay_out("counter", Counter(), 1)
    assert layout.places[0].default_placer == is_crowded
    assert not layout.places[0].rerouted
    assert lay_out("counter", Counter(), 1) == layout
    assert given == [True, False][: 1 + is_crowded]


def test_another_design_family_or_tool_is_another_entry(calls, cache, monkeypatch):
    lay_out("counter", Counter(), 1)
    lay_out("counter", Counter(23), 1)
    lay_out("counter", Counter(), 1, family=NEXUS)
    monkeypatch.setattr(place_and_route, "versions_of", lambda family: {"pyosys": "1", family.package: "3"})
    lay_out("counter", Counter(), 1)
    assert calls == [("Yosys",), ("nextpnr", "1")] * 4
    assert len(list(cache.iterdir())) == 4


def test_seeds_that_are_done_stay_when_one_fails(calls, cache, monkeypatch):
    run = place_and_route.ToolRunner.run

    def fails(self, name, code, arguments, folder, text="", watch=None):
        if arguments[-1:] == ["2"]:
            raise ToolError("nextpnr ends with status 1: no place")
        run(self, name, code, arguments, folder, text)

    with monkeypatch.context() as patch:
        patch.setattr(place_and_route.ToolRunner, "run", fails)
        with pytest.raises(ToolError, match="no place"):
            lay_out("counter", Counter(), 3)
    assert [path.name[-6] for path in cache.iterdir()] == ["1"]


def test_runner_names_the_tools_own_error(tmp_path):
    runner = place_and_route.ToolRunner()
    code = "import sys; print('INFO: x'); print('ERROR: no such cell'); print('more'); sys.exit(3)"
    with pytest.raises(ToolError, match=r"^Yosys ends with status 3: ERROR: no such cell$"):
        runner.run("Yosys", code, [], tmp_path)
    runner.stop()
    with pytest.raises(ToolError, match="Yosys was stopped"):
        runner.run("Yosys", "", [], tmp_path)
    assert not list(tmp_path.iterdir())


def test_stopped_runner_ends_what_runs(tmp_path):
    runner = place_and_route.ToolRunner()
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


# With the tools.


def period(place):
    """The period of a path is the clock's period, up to the rounding of the report."""
    return pytest.approx(1000 / place.fmax, rel=1e-3) == place.logic + place.routing


@pytest.mark.long
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
    # nextpnr's message about the parts of the device.
    available = [reports[0]["utilization"][kind]["available"] for kind in kinds]
    assert Parts(*available) == family.capacity


@pytest.mark.long
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
        # The limit of a single 18x18 multiplier, from a placement with nothing else.
        assert 120 < place.fmax < 180


@pytest.mark.long
@tools
def test_times_of_a_multiplier_with_absorbed_registers(cache):
    """With registers on one side the multiplier is timed in full.

    With registers on both sides its interior is not timed.
    """
    for before, behind, lowest, highest in (
        (0, 0, 120, 160),
        (1, 0, 170, 220),
        (0, 1, 165, 210),
        (2, 2, 250, 250),
    ):
        layout, kept = (
            lay_out("product", Stages(before, behind), 1, absorb=absorb) for absorb in (True, False)
        )
        (place,) = layout.places
        assert place.closed == bool(before and behind)
        assert lowest <= place.fmax <= highest
        assert kept.parts.flip_flops == 36 * before + 36 * behind
        absorbed = 36 * min(before, 1) + 36 * min(behind, 1)
        assert layout.parts.flip_flops == kept.parts.flip_flops - absorbed
        assert kept.places[0].closed == 0


@pytest.mark.long
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
    # By the speed grade of the device.
    assert 165 < place.fmax < 221
    (place,) = outside.places
    assert place.kinds == {"LUT": 2, "multiplier": 1}
    assert {place.start} <= set("abcd")
    assert place.end.startswith("o.D")


@pytest.mark.long
@tools
def test_a_multiplier_with_an_adder_is_refused(cache):
    with pytest.raises(ToolError, match="has a cell MULTADDSUB18X18, which nextpnr does not time"):
        lay_out("sum", MultiplyAdd(), 1, family=NEXUS)


@tools
def test_what_the_tools_refuse_is_one_line(cache, monkeypatch):
    monkeypatch.setattr(place_and_route, "MAP_BEFORE", "read_rtlil nothing.il\n")
    with pytest.raises(ToolError, match=r"^Yosys ends with status .*nothing\.il"):
        lay_out("none", Counter(), 1)


def test_a_tool_is_ended_by_what_it_says(tmp_path, monkeypatch):
    """The tool writes meanwhile. Reading its output does not change where it writes."""
    monkeypatch.setattr(tool_runner, "_SECONDS", 0.05)
    seen = []

    def watch(said):
        seen.append(said)
        return "enough" if said.count("line") > 40 else ""

    code = (
        "import time, sys\nfor k in range(9000): print('line', k, sys.argv[1], flush=True); time.sleep(0.01)"
    )
    with pytest.raises(GivenUp, match=r"^enough$"):
        ToolRunner().run("talker", code, ["a"], tmp_path, watch=watch)
    assert len(seen) > 1
    lines = seen[-1].splitlines()
    assert lines == [f"line {k} a" for k in range(len(lines))]
    assert not list(tmp_path.iterdir())


def test_text_reaches_a_tool_that_takes_its_time(tmp_path, monkeypatch):
    """The text takes longer than the time between two reads."""
    monkeypatch.setattr(tool_runner, "_SECONDS", 0.05)
    code = "import time, sys, pathlib; time.sleep(1); pathlib.Path('x').write_text(sys.stdin.read())"
    text = "word " * 100_000
    ToolRunner().run("slow", code, [], tmp_path, text)
    assert (tmp_path / "x").read_text() == text
