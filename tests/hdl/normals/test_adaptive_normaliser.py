"""Adaptive normaliser: its cycles and its FIFO. `tests.test_units` checks its results."""

import numpy as np
import pytest

from blysk.bench.units.normals.adaptive_normaliser import RECORD, spans_of
from blysk.bench.units.operands import code_pairs_at, component_words
from blysk.golden.number.spans import pixels_of
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.sim.engines.simulate import simulate

from ...checks import assert_beats_equal


def run_of(unit, angles, lengths, **stalls):
    """Spans at given angles: a run that equals the model, and the levels of the spans."""
    case = spans_of(code_pairs_at(np.random.default_rng(1), len(lengths), angles), lengths)
    run = simulate(unit, case.beats, count=lengths.sum(), engine="auto", **stalls)
    assert_beats_equal(run.beats, RECORD.expect(unit, case))
    ends = component_words(case.beats["normal_left"], case.beats["normal_right"])
    return run, unit.model.compute(*ends, lengths)[2]


@pytest.mark.long
@pytest.mark.parametrize("variant", RECORD.variants)
def test_one_normal_in_every_cycle_of_a_span(variant):
    unit = RECORD.variants[variant].unit()
    rng = np.random.default_rng(2)
    lengths = np.r_[1, 2, 3, 16, 4095, 0, 1, 1, 2, 2, 5, 17, 33, 64, 0, 0, 129, rng.integers(1, 80, 60)]
    run, levels = run_of(unit, rng.uniform(0, 95, len(lengths)), lengths)
    assert (levels.min(), levels.max()) == (0, unit.model.depth)
    span, index = pixels_of(lengths)
    starts = (np.cumsum(lengths) - lengths)[span]
    np.testing.assert_array_equal(run.cycles, run.cycles[starts] + index)


def test_preparation_as_stated():
    """The time to prepare a span that finds all parts free is as stated."""
    unit = AdaptiveNormaliserUnit()
    angles = np.r_[1.0, 0.0, 8, 16, 32, 44, 80, 120, 3, 3, 4, 80, 80, 80]
    lengths = np.r_[2, 60, 5, 5, 9, 17, 17, 30, 1, 1, 2, 1, 2, 3]
    run, levels = run_of(unit, angles, lengths, input_stalls=np.arange(700) != 0)
    np.testing.assert_array_equal(levels, [0, 0, 1, 2, 3, 4, 4, 0, 0, 0, 0, 4, 4, 4])
    first = run.cycles[np.cumsum(lengths) - lengths] - run.input_cycles
    # One pixel, or two, are the ends. The middle pixel of three belongs to the first level.
    stated = np.array([unit.preparation(k) for k in [*levels[:-3].tolist(), 0, 0, 1]])
    np.testing.assert_array_equal(first, np.where(lengths == 1, 50, stated))
    assert [unit.preparation(k) for k in range(3)] == [63, 77, 142]


@pytest.mark.long
def test_intervals_as_stated():
    unit = AdaptiveNormaliserUnit()
    for level, angle in enumerate([3.0, 8, 16, 32, 44]):
        lengths = np.full(12, (1 << level) + 1)
        run, levels = run_of(unit, np.full(12, angle), lengths)
        assert set(levels.tolist()) == {level}
        # The first two spans find the segments' part free.
        assert set(np.diff(run.input_cycles)[1:].tolist()) == {unit.interval(level)}
        assert set(np.diff(run.cycles[lengths[0] :: lengths[0]]).tolist()) == {unit.interval(level)}
    assert [unit.interval(k) for k in range(3)] == [33, 42, 70]


def test_long_spans_follow_without_a_gap():
    run, _ = run_of(AdaptiveNormaliserUnit(), np.r_[3.0, 5, 44, 20, 2], np.array([1000, 500, 600, 300, 200]))
    np.testing.assert_array_equal(np.diff(run.cycles), 1)


def test_front_runs_ahead_until_the_fifo_is_full():
    """While the output waits, spans of one pixel have one segment each."""
    unit, wait = AdaptiveNormaliserUnit(), 6000
    stalls = np.arange(2 * wait) < wait
    run, _ = run_of(unit, np.linspace(0, 3, 100), np.ones(100, dtype=np.int64), output_stalls=stalls)
    # Each of the three parts holds a further span.
    assert (run.input_cycles < wait).sum() == (2 << unit.model.depth) + 3
