"""Units that make the pixels of spans one after the other: their cycles.

`tests.test_units` checks their results.
"""

import numpy as np
import pytest

from blysk.bench.units.cosines import highlight_cosine, recurrence
from blysk.bench.units.normals import difference_accumulator, quadratic_evaluator
from blysk.golden.number.spans import pixels_of
from blysk.sim.engines.simulate import simulate

from ..checks import assert_beats_equal
from .variants import mostly_long

HIGHLIGHT_COSINE = (highlight_cosine, highlight_cosine.RECORD.default)
ACCUMULATOR = (difference_accumulator, difference_accumulator.RECORD.default)
RECURRENCES = [(recurrence, variant) for variant in recurrence.MEASURED]
"""Modules of records, and variants."""

QUICK = (HIGHLIGHT_COSINE, ACCUMULATOR, RECURRENCES[0])


def ids(value):
    return value if isinstance(value, str) else value.RECORD.name


def case_of(module, unit, lengths):
    """Spans of these lengths. Some records make spans for a unit."""
    of_unit = () if module in (highlight_cosine, quadratic_evaluator) else (unit,)
    return module.spans_of(*of_unit, np.random.default_rng(1), np.asarray(lengths))


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize(
    ("module", "variant"), mostly_long([HIGHLIGHT_COSINE, ACCUMULATOR, *RECURRENCES], *QUICK), ids=ids
)
def test_pixels_come_without_gaps(module, variant):
    """A value comes in every cycle, or after as many cycles as a pixel takes. An empty span takes a cycle."""
    unit = module.RECORD.variants[variant].unit()
    interval = getattr(unit, "cycles_per_pixel", 1)
    lengths = np.r_[1, 2, 3, 16, 1, 1, 4095 if interval == 1 else 400, 0, 5, 0, 0, 1]
    case = case_of(module, unit, lengths)
    run = simulate(unit, case.beats, count=lengths.sum(), engine="auto")
    assert_beats_equal(run.beats, module.RECORD.expect(unit, case))
    taken = np.where(lengths > 0, interval * (lengths - 1) + 1, 1)
    np.testing.assert_array_equal(run.input_cycles, np.cumsum(taken) - taken)
    span, index = pixels_of(lengths)
    np.testing.assert_array_equal(run.cycles, run.input_cycles[span] + unit.latency + interval * index)
