# amaranth: UnusedElaboratable=no
"""Chord setup: options, beats at any distance, waiting output. `tests.test_units` checks its results."""

import numpy as np
import pytest

from blysk.bench.units.cosines.chord_setup import RECORD
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.simulate import simulate


def test_options():
    unit = ChordSetupUnit()
    assert (unit.lights, unit.initiation_interval, unit.multipliers, unit.latency) == (1, 3, 2, 21)
    assert cost_of(ChordSetupUnit(length_bits=9)).rom_bits == 17 << 8
    assert ChordSetupUnit(None, 2, initiation_interval=1, highlights=False).multipliers == 5


@pytest.mark.parametrize("interval", [3, pytest.param(9, marks=pytest.mark.long)])
def test_beats_at_any_distance(interval):
    """At each distance from one interval to three intervals, beats are taken at once, and words are the
    model's."""
    unit = ChordSetupUnit(ChordSetup(), 1, initiation_interval=interval)
    case = RECORD.stimuli["spans"].make(unit, np.random.default_rng(3), 200)
    distances = np.tile(np.arange(interval, 3 * interval + 1), 40)[:199]
    stalls = np.ones(int(distances.sum()) + 2, dtype=bool)
    stalls[np.r_[0, np.cumsum(distances)]] = False
    run = simulate(unit, case.beats, count=200, engine="auto", input_stalls=stalls)
    np.testing.assert_array_equal(run.beats, RECORD.expect(unit, case))
    np.testing.assert_array_equal(np.diff(run.input_cycles), distances)
    np.testing.assert_array_equal(run.cycles, run.input_cycles + unit.latency)


def test_waiting_output_blocks_the_input():
    """The first beat of each pair waits at the output.

    The second enters one cycle after the first has left.
    """
    unit = ChordSetupUnit()
    case = RECORD.stimuli["spans"].make(unit, np.random.default_rng(3), 40)
    stalls = {"input_stalls": np.arange(60) != 0, "output_stalls": np.arange(120) < 65}
    run = simulate(unit, case.beats, count=40, engine="auto", **stalls)
    np.testing.assert_array_equal(run.beats, RECORD.expect(unit, case))
    np.testing.assert_array_equal(run.input_cycles[1::2], run.cycles[::2] + 1)
    np.testing.assert_array_equal(run.cycles[1::2], run.input_cycles[1::2] + unit.latency)
