# amaranth: UnusedElaboratable=no
"""Compact intensity unit: its cycles and resets. `tests.test_units` compares both styles with their model."""

import numpy as np
import pytest

from blysk.bench.units.lighting.intensity import RECORD
from blysk.bench.units.record import Case, first
from blysk.sim.engines.simulate import simulate

from ...checks import resets


def runs_of(lights, stimulus):
    unit = RECORD.variants[f"{lights} light{'s' * (lights > 1)}, compact"].unit()
    return unit, next(RECORD.runs(unit, stimulus))


@pytest.mark.parametrize("lights", [1, 3, *(pytest.param(k, marks=pytest.mark.long) for k in (2, 16))])
def test_compact_takes_three_cycles_a_term(lights):
    """Three cycles for each term that is not 0, and three for a pixel without terms."""
    unit, run = runs_of(lights, "terms")
    cycles = 3 * np.maximum(sum((terms != 0).sum(axis=1) for terms in run.case.beats.values()), 1)
    assert cycles.min() == 3
    assert cycles.max() == 6 * lights == unit.initiation_interval
    assert unit.latency == 6 * lights + 5
    found = simulate(unit, run.case.beats, count=run.count, constants=run.case.constants, engine="auto")
    np.testing.assert_array_equal(found.input_cycles, np.r_[0, np.cumsum(cycles[:-1])])
    np.testing.assert_array_equal(found.cycles, found.input_cycles + cycles + 5)


def test_compact_reset_at_every_cycle_of_a_pixel():
    unit, run = runs_of(1, "bright")
    case = Case(first(run.case.beats, 24), run.case.constants)
    found = resets(unit, case, range(1, 15), cycles=60)
    assert len(found) == 6


@pytest.mark.parametrize("unit", RECORD.stimuli["halves"].variants)
def test_halves_of_the_record_are_halves(unit):
    """There are enough halves of each kind to show a wrong rounding, in every channel."""
    beats = next(RECORD.runs(RECORD.variants[unit].unit(), "halves")).case.beats
    rest = ((5 << 17) + 8191 * beats["diffuse"] + 6003 * beats["specular"]) % (1 << 23)
    assert np.all(np.bincount((1 << 22) - rest[:, 0]) > 300)
