"""Every device as Verilog, in Icarus Verilog and in Verilator, against its twin, beat by beat, under stalls.

The quick run has two devices, the long one every structure: 10^6 beats of each in Verilator, and of every
device in Icarus Verilog, which takes some ten to some hundred times as long; a device's other structures have
10^5 there.
"""

import numpy as np
import pytest

from blysk.bench.tools.blocks import BLOCKS
from blysk.sim.engines.simulate import simulate

from .devices import DEVICES
from .verilog_bench import SIMULATORS, VerilogBench, assert_beats, missing_tool

QUICK = ("quadratic_evaluator, horner", "intensity, compact")
QUICK_BEATS = 2000
BEATS = 1_000_000
"""Of a long run."""

FEWER = 100_000
"""In Icarus Verilog, of the second and further structures of a device."""


@pytest.fixture
def check(tmp_path):
    """Hold a device's Verilog against its twin; what was run, and the cycles found."""

    def check(name, simulator, beats, **options):
        if missing_tool(simulator):
            pytest.skip(missing_tool(simulator))
        rng = np.random.default_rng(2026)
        case = DEVICES[name](rng, beats)
        stalls = {"input_stalls": rng.random(997) < 0.3, "output_stalls": rng.random(1009) < 0.3}
        bench = VerilogBench(case.unit, tmp_path, **options)
        found = bench.run(simulator, case.beats, beats, constants=case.constants, **stalls)
        assert_beats(found.beats, case.expected)
        return case, stalls, found.cycles

    return check


@pytest.mark.parametrize("simulator", ["icarus", pytest.param("verilator", marks=pytest.mark.long)])
@pytest.mark.parametrize("name", QUICK)
def test_device(check, name, simulator):
    """On the cycles of the compiled engine, too."""
    case, stalls, cycles = check(name, simulator, QUICK_BEATS)
    run = simulate(
        case.unit, case.beats, count=QUICK_BEATS, constants=case.constants, engine="auto", **stalls
    )
    np.testing.assert_array_equal(cycles, run.cycles)


@pytest.mark.long
@pytest.mark.parametrize("simulator", SIMULATORS)
@pytest.mark.parametrize("name", DEVICES)
def test_every_device(check, name, simulator):
    device = name.split(", ")[0]
    further = name != next(other for other in DEVICES if other.split(", ")[0] == device)
    check(name, simulator, FEWER if simulator == "icarus" and further else BEATS, optimise=True)


def test_no_device_is_left_out():
    """Every device of the device table is here; the pipelines have a file of their own."""
    here = {name.split(", ")[0] for name in DEVICES}
    assert here == {block.device for block in BLOCKS} - {"pipeline"}
