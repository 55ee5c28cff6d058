"""Recurrence unit: its cycles, and resets; `tests.test_units` has its results."""

import numpy as np
import pytest

from blysk.golden.number.spans import pixels_of
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.cosines.recurrence import MEASURED, RECORD, spans_of

from ...checks import assert_beats_equal, resets
from ..variants import mostly_long


@pytest.mark.parametrize("variant", mostly_long(MEASURED, RECORD.default))
def test_cycles(variant):
    unit, lengths = RECORD.variants[variant].unit(), np.r_[1, 2, 3, 16, 1, 1, 400, 0, 5, 0, 0, 1]
    case = spans_of(unit, np.random.default_rng(1), lengths)
    run = simulate(unit, case.beats, count=lengths.sum(), engine="auto")
    assert_beats_equal(run.beats, RECORD.expect(unit, case))
    taken = np.where(lengths > 0, unit.cycles_per_pixel * (lengths - 1) + 1, 1)
    np.testing.assert_array_equal(run.input_cycles, np.cumsum(taken) - taken)
    span, index = pixels_of(lengths)
    first = run.input_cycles[span] + unit.latency
    np.testing.assert_array_equal(run.cycles, first + unit.cycles_per_pixel * index)


@pytest.mark.parametrize("variant", MEASURED)
def test_reset_in_mid_span(variant):
    """In each cycle of a pixel, and of the interleaved states."""
    unit = RECORD.variants[variant].unit()
    case = spans_of(unit, np.random.default_rng(6), np.array([6, 9]))
    found, *others = resets(unit, case, [1, 2, 3, 4, 5, 6, 9], 40, 1)
    assert [cycle for cycle, _ in found] == [unit.latency + unit.cycles_per_pixel * k for k in range(6)]
    assert all(other == found for other in others)
