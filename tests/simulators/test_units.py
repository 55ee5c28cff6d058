"""Every unit as Verilog, in Icarus Verilog and in Verilator, against its model, beat by beat, under stalls.

The quick run has one unit, the long one every variant of each record that is not long itself, with its first
stimulus: the default variants in both, the others in Icarus. Pipelines have a file of their own.
"""

import numpy as np
import pytest

from blysk.sim.engines.simulate import simulate
from blysk.sim.units.record import length_of
from blysk.sim.units.registry import RECORDS

from .verilog_bench import SIMULATORS, VerilogBench, assert_beats, missing_tool

QUICK = (("intensity", "3 lights, compact"),)
QUICK_BEATS = 2000
BEATS = {"verilator": 200_000, "icarus": 20_000}
"""Of a long run of the default variants; of the others a tenth."""

UNITS = [
    (name, variant, simulator)
    for name, record in RECORDS.items()
    if name != "pipeline"
    for variant, given in record.variants.items()
    if not given.long
    for simulator in SIMULATORS
    if simulator == "icarus" or variant == record.default
]


@pytest.fixture
def check(tmp_path):
    """Hold a unit's Verilog against its model; the unit, what was sent, and the cycles found."""

    def check(name, variant, simulator, beats, **options):
        if missing_tool(simulator):
            pytest.skip(missing_tool(simulator))
        record, rng = RECORDS[name], np.random.default_rng(2026)
        unit = record.variants[variant].unit()
        make = next(iter(record.stimuli_of(variant).values())).make
        case = make(unit, rng, beats)
        expected = record.expect(unit, case)
        stalls = {"input_stalls": rng.random(997) < 0.3, "output_stalls": rng.random(1009) < 0.3}
        sent = {"constants": case.constants, "write": case.write, **stalls}
        bench = VerilogBench(unit, tmp_path, **options)
        found = bench.run(simulator, case.beats, length_of(expected), **sent)
        assert_beats(found.beats, expected)
        return unit, case.beats, sent, found.cycles

    return check


@pytest.mark.parametrize("simulator", ["icarus", pytest.param("verilator", marks=pytest.mark.long)])
@pytest.mark.parametrize(("name", "variant"), QUICK)
def test_unit(check, name, variant, simulator):
    """On the cycles of the compiled engine, too."""
    unit, beats, sent, cycles = check(name, variant, simulator, QUICK_BEATS)
    run = simulate(unit, beats, count=len(cycles), engine="auto", **sent)
    np.testing.assert_array_equal(cycles, run.cycles)


@pytest.mark.long
@pytest.mark.parametrize(("name", "variant", "simulator"), UNITS)
def test_every_unit(check, name, variant, simulator):
    share = 1 if variant == RECORDS[name].default else 10
    check(name, variant, simulator, BEATS[simulator] // share, optimise=True)
