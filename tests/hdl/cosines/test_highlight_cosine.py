"""Highlight-cosine unit: its cycles; `tests.test_units` has its results."""

import numpy as np

from blysk.golden.number.spans import pixels_of
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.cosines.highlight_cosine import RECORD, spans_of


def test_one_value_in_every_cycle_without_gaps():
    unit, lengths = HighlightCosineUnit(), np.r_[1, 2, 3, 16, 1, 1, 4095, 0, 5, 0, 0, 1]
    case = spans_of(np.random.default_rng(1), lengths)
    run = simulate(unit, case.beats, count=lengths.sum(), engine="auto")
    np.testing.assert_array_equal(run.beats, RECORD.expect(unit, case))
    taken = np.maximum(lengths, 1)
    np.testing.assert_array_equal(run.input_cycles, np.cumsum(taken) - taken)
    span, index = pixels_of(lengths)
    np.testing.assert_array_equal(run.cycles, run.input_cycles[span] + unit.latency + index)
