# amaranth: UnusedElaboratable=no
"""Pipelines with an albedo: pixels of every variant, latency, and cycles as without an albedo."""

import numpy as np
import pytest

from blysk.bench.units.pipeline import RECORD, case_of
from blysk.bench.units.pipeline_spans import any_constants, any_spans
from blysk.bench.units.record import UnitRun
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate

from ..checks import assert_equals_model

QUICK = "albedo", "albedo, orthographic, compact, grey"
VARIANTS = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.long)
    for name in RECORD.variants
    if name.startswith("albedo")
]


@pytest.mark.parametrize("variant", VARIANTS)
def test_equals_model(variant):
    """Under stalls; the long run has more spans of each."""
    unit, rng = RECORD.variants[variant].unit(), np.random.default_rng(2)
    stalls = {name: rng.random(97) < 0.3 for name in ("input_stalls", "output_stalls")}
    case = RECORD.stimuli["spans"].make(unit, rng, 120)
    assert_equals_model(unit, UnitRun(case, RECORD.expect(unit, case), None, stalls), "pysim")


def cycles_of(unit, lengths):
    rng, design = np.random.default_rng(5), unit.model
    spans = any_spans(rng, design, np.asarray(lengths))
    case = case_of(unit, spans, any_constants(rng, design, spans))
    found = simulate(unit, case.beats, count=sum(lengths), engine="pysim", write=case.write)
    return found.input_cycles, found.cycles


def test_albedo_costs_no_cycle():
    """Spans follow each other as without it; the first pixel comes later by the latency of the units."""
    lengths = [5, 40, *range(1, 12), *[1] * 30, 60, 1, 1, 2, 3]
    design = RECORD.variants["albedo"].unit().model
    units = ShadingPipelineUnit(preset("quotient")), ShadingPipelineUnit(design)
    (_, plain), (inputs, colored) = (cycles_of(unit, lengths) for unit in units)
    np.testing.assert_array_equal(np.diff(colored), np.diff(plain))
    assert colored[0] - inputs[0] == units[1].latency == units[0].latency + 3


def test_first_pixel_of_a_long_albedo_path():
    """Without lights nothing hides the latency of texture and product."""
    unit = RECORD.variants["albedo, both, without lights, 2 materials"].unit()
    inputs, cycles = cycles_of(unit, [3, 1, 40])
    assert cycles[0] - inputs[0] == unit.latency
    assert np.all(np.diff(cycles)[4:] == 1)
