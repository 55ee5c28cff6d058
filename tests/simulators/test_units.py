"""Every unit as Verilog, in Icarus Verilog and in Verilator, against its model, beat by beat, under stalls.

The quick run has one unit. The long run has the default variant of each record with its first stimulus, in
Icarus. Units that are no parts of others run in both simulators. In Icarus they run with all variants that
are not long themselves. Other variants of parts are built of the same operators. Pipelines have a file of
their own.

Verilator runs two thousand times as many cycles a second, so it gets many beats, with rare operands. Icarus
shows that another reader understands the text in the same way, and that no undefined bit comes out. A few
beats are enough for this.
"""

from functools import lru_cache

import numpy as np
import pytest

from blysk.bench.units.record import length_of
from blysk.bench.units.registry import RECORDS
from blysk.hdl.emit.verilog import emit
from blysk.sim.engines.simulate import simulate

from ..decided import digest_of
from ..lists import OF_DOCUMENTS, WHOLE
from .verilog_bench import SIMULATORS, VerilogBench, assert_beats, missing_tool, pauses

QUICK = (("intensity", "3 lights, compact"),)
QUICK_BEATS = 2000
BEATS = {"verilator": 20_000, "icarus": 1000}
"""Beats of a long run of the default variants."""

FEWER = 1000
"""Beats of the other variants. The compiled engine has many beats of these."""

UNITS = [
    pytest.param(
        name,
        variant,
        simulator,
        marks=[pytest.mark.ci]
        * (simulator == "icarus" and variant == record.default and name not in OF_DOCUMENTS),
    )
    for name, record in RECORDS.items()
    if name != "pipeline"
    for variant, given in record.variants.items()
    if not given.long and (variant == record.default or name in WHOLE)
    for simulator in SIMULATORS
    if simulator == "icarus" or (variant == record.default and name in WHOLE)
]

WITH_DEPTHS = ("depth_tester", "depth_lanes", "render")
"""Units whose record has a memory of depths inside. Its zeros stand for a picture that was cleared."""


@lru_cache(maxsize=1)
def verilog_of(name, variant):
    """A component and its text, which both simulators share."""
    unit = RECORDS[name].variants[variant].unit()
    return unit, emit(unit, "core", zeros=name in WITH_DEPTHS)


@pytest.fixture
def check(tmp_path, decided, request):
    """Make a check that compares a unit's Verilog with its model.

    It gives the unit, the input, and the cycles found. Runs that CI leaves out are run again if the text, the
    input or the expected output changes.
    """
    seldom = request.node.get_closest_marker("long") and not request.node.get_closest_marker("ci")

    def check(name, variant, simulator, beats, **options):
        if missing_tool(simulator):
            pytest.skip(missing_tool(simulator))
        record, rng = RECORDS[name], np.random.default_rng(2026)
        unit, text = verilog_of(name, variant)
        make = next(iter(record.stimuli_of(variant).values())).make
        case = make(unit, rng, beats)
        expected = record.expect(unit, case)
        sent = {"constants": case.constants, "write": case.write, **pauses(rng)}
        digest = digest_of("unit", simulator, text, case.beats, sent, expected)
        if seldom and decided.knows(digest):
            return None
        bench = VerilogBench(unit, tmp_path, text, **options)
        # Hidden pixels: 12,732 cycles of the renderer without a beat.
        found = bench.run(simulator, case.beats, length_of(expected), idle_timeout=50_000, **sent)
        assert_beats(found.beats, expected)
        if seldom:
            decided.add(digest)
        return unit, case.beats, sent, found.cycles

    return check


@pytest.mark.parametrize("simulator", ["icarus", pytest.param("verilator", marks=pytest.mark.long)])
@pytest.mark.parametrize(("name", "variant"), QUICK)
def test_unit(check, name, variant, simulator):
    """Beats also come in the cycles of the compiled engine."""
    found = check(name, variant, simulator, QUICK_BEATS)
    if found is None:
        return
    unit, beats, sent, cycles = found
    run = simulate(unit, beats, count=len(cycles), engine="auto", **sent)
    np.testing.assert_array_equal(cycles, run.cycles)


@pytest.mark.long
@pytest.mark.parametrize(("name", "variant", "simulator"), UNITS)
def test_every_unit(check, name, variant, simulator):
    beats = BEATS[simulator] if variant == RECORDS[name].default else FEWER
    check(name, variant, simulator, beats, optimise=True)
