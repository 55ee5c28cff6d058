# amaranth: UnusedElaboratable=no
"""Albedo unit: every variant equals its model under stalls; its latency, rate and multipliers."""

import numpy as np
import pytest

from blysk.bench.units.albedo.albedo import RECORD
from blysk.bench.units.record import UnitRun
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.hdl.albedo.albedo import AlbedoUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.simulate import simulate

from ...checks import assert_equals_model


@pytest.mark.parametrize("variant", RECORD.variants)
def test_equals_model(variant):
    """With stalls on both sides. The long run has more beats of each variant."""
    unit, rng = RECORD.variants[variant].unit(), np.random.default_rng(2)
    stalls = {name: rng.random(97) < 0.4 for name in ("input_stalls", "output_stalls")}
    case = RECORD.stimuli["spans"].make(unit, rng, 150)
    assert_equals_model(unit, UnitRun(case, RECORD.expect(unit, case), None, stalls), "pysim")


@pytest.mark.parametrize("variant", RECORD.variants)
def test_latency_and_rate(variant):
    """A pixel comes in every cycle of the interval: no unit and no FIFO makes the rate smaller."""
    unit = RECORD.variants[variant].unit()
    case = RECORD.stimuli["spans"].make(unit, np.random.default_rng(3), 100)
    case.beats["length"] = 3
    found = simulate(unit, case.beats, count=3 * len(case.beats), engine="pysim", **case.sent)
    assert found.cycles[0] - found.input_cycles[0] == unit.latency
    assert (np.diff(found.cycles) == unit.initiation_interval).all()


@pytest.mark.parametrize(
    ("model", "interval", "multipliers"),
    [
        (Albedo(perspective=False), 1, 0),
        (Albedo(texture=TextureSampler()), 1, 18),
        (Albedo(texture=TextureSampler()), 3, 6),
    ],
)
def test_multipliers(model, interval, multipliers):
    """Multipliers of quotients, of the filter, and of the product of both colours."""
    unit = AlbedoUnit(model, initiation_interval=interval)
    assert cost_of(unit).totals["multipliers"] == multipliers
