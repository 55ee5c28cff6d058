"""Forward-difference accumulator: its cycles, and resets; `tests.test_units` has its results."""

import numpy as np

from blysk.golden.number.spans import pixels_of
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.normals.difference_accumulator import RECORD, spans_of

from ...checks import resets


def test_one_normal_in_every_cycle_without_gaps():
    lengths = np.r_[1, 2, 3, 16, 1, 1, 4095, 0, 5, 0, 0, 1]
    unit = DifferenceAccumulatorUnit()
    case = spans_of(unit, np.random.default_rng(1), lengths)
    run = simulate(unit, case.beats, count=lengths.sum(), engine="auto")
    np.testing.assert_array_equal(run.beats, RECORD.expect(unit, case))
    cycles_taken = np.maximum(lengths, 1)
    np.testing.assert_array_equal(run.input_cycles, np.cumsum(cycles_taken) - cycles_taken)
    span, index = pixels_of(lengths)
    np.testing.assert_array_equal(run.cycles, run.input_cycles[span] + unit.latency + index)


def test_reset_in_mid_span():
    """From the first cycle of a span of 60 to its last, with and without a pixel that waits."""
    unit = DifferenceAccumulatorUnit()
    case = spans_of(unit, np.random.default_rng(7), np.array([3, 60]))
    found, *others = resets(unit, case, [1, 2, 3, 4, 31, 59, 60, 61], 10, 1)
    assert [cycle for cycle, _ in found] == [3, 4, 5]
    assert all(other == found for other in others)
