# amaranth: UnusedElaboratable=no
"""Intensity units with an albedo: every variant equals its model under stalls; cycles, resets, netlists."""

import numpy as np
import pytest

from blysk.bench.units.lighting.intensity import RECORD
from blysk.bench.units.record import Case, UnitRun, first
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import Fixed
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.colored_intensity import intensity_unit
from blysk.sim.engines.simulate import simulate

from ...checks import assert_equals_model, resets

VARIANTS = [name for name in RECORD.variants if name.startswith("albedo")]


@pytest.mark.parametrize("variant", VARIANTS)
def test_equals_model(variant):
    """With and without stalls. The long run has more beats of each variant."""
    unit, rng = RECORD.variants[variant].unit(), np.random.default_rng(2)
    stalls = {name: rng.random(97) < 0.4 for name in ("input_stalls", "output_stalls")}
    for stimulus, held in (("terms", {}), ("colors", stalls)):
        case = RECORD.stimuli[stimulus].make(unit, rng, 40)
        assert_equals_model(unit, UnitRun(case, RECORD.expect(unit, case), None, held), "pysim")


@pytest.mark.parametrize("variant", [name for name in VARIANTS if "compact" in name and "16" not in name])
def test_cycles_of_the_compact_style(variant):
    """The cycles from each pixel to the next are those of the model."""
    unit = RECORD.variants[variant].unit()
    case = RECORD.stimuli["terms"].make(unit, np.random.default_rng(4), 60)
    terms = (case.beats["diffuse"], case.beats.get("specular", np.zeros((60, 0), dtype=np.int64)))
    fixed = (Fixed(Intensity.TERM_FORMAT, codes) for codes in terms)
    cycles = unit.model.cycles(*fixed, bool(case.constants.get("tinted", False)))
    assert cycles.max() == unit.initiation_interval
    found = simulate(unit, case.beats, count=60, constants=case.constants, engine="pysim")
    np.testing.assert_array_equal(found.input_cycles, np.r_[0, np.cumsum(cycles[:-1])])
    np.testing.assert_array_equal(found.cycles, found.input_cycles + cycles + 5)


def test_compact_reset_at_every_cycle_of_a_pixel():
    unit = RECORD.variants["albedo, compact"].unit()
    run = next(RECORD.runs(unit, "colors"))
    case = Case(first(run.case.beats, 24), run.case.constants)
    assert len(resets(unit, case, range(1, 15), cycles=90)) == 6


@pytest.mark.parametrize(("compact", "plain", "further"), [(False, 6, 3), (True, 1, 0)])
def test_multipliers(compact, plain, further):
    """The throughput style takes three further multipliers, with tints, too. The compact style takes none."""
    for count, model in (
        (plain, Intensity()),
        (plain + further, Intensity(has_albedo=True, tints=True)),
    ):
        assert cost_of(intensity_unit(model, compact)).totals["multipliers"] == count
