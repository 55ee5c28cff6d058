"""Quadratic evaluators: their cycles. `tests.test_units` checks their results."""

import numpy as np
import pytest

from blysk.bench.units.normals.quadratic_evaluator import RECORD, spans_of
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from blysk.golden.number.spans import pixels_of
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit
from blysk.sim.engines.simulate import simulate

SHORTEST = {"direct": 7, "horner": 4}
"""Pixels of spans between which there is no gap."""


@pytest.fixture(params=QUADRATIC_FORMS)
def unit(request):
    return QuadraticEvaluatorUnit(QuadraticEvaluator(request.param))


def run_of(unit, lengths, seed):
    case = spans_of(np.random.default_rng(seed), lengths)
    run = simulate(unit, case.beats, count=lengths.sum(), engine="auto")
    np.testing.assert_array_equal(run.beats, RECORD.expect(unit, case))
    return run


@pytest.mark.long
def test_no_gap_between_spans(unit):
    shortest = SHORTEST[unit.model.form]
    rng = np.random.default_rng(1)
    lengths = np.r_[np.full(6, shortest), 4095, shortest, 16, rng.integers(shortest, 40, 300)]
    run = run_of(unit, lengths, 2)
    assert run.input_cycles[0] == 0
    np.testing.assert_array_equal(run.cycles, unit.latency + unit.cycles_per_pixel * np.arange(lengths.sum()))


def test_short_spans_come_seven_cycles_apart(unit):
    lengths = np.r_[1, 0, 2, 0, 0, 3, 1, 1, 2]
    run = run_of(unit, lengths, 3)
    np.testing.assert_array_equal(run.input_cycles, 7 * np.arange(len(lengths)))
    span, index = pixels_of(lengths)
    # The polynomial takes a pixel in every cycle. The form horner takes one in every second cycle, counted
    # from a pixel inside.
    late = run.cycles - (run.input_cycles[span] + unit.latency + unit.cycles_per_pixel * index)
    assert np.all((late >= 0) & (late < unit.cycles_per_pixel))
