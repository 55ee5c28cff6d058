"""Chain of bisections: its cycles. `tests.test_units` checks its results."""

import numpy as np
import pytest

from blysk.bench.units.normals.bisection_chain import RECORD
from blysk.bench.units.operands import code_pairs_at
from blysk.hdl.normals.bisection_chain import BisectionChainUnit
from blysk.sim.engines.simulate import simulate


@pytest.mark.long
@pytest.mark.parametrize("variant", RECORD.variants)
def test_latency_by_level(variant):
    """A level of 0 counts as 16, because a counter of 4 bits wraps."""
    unit = RECORD.variants[variant].unit()
    left, right = code_pairs_at(np.random.default_rng(1), 31, 30)
    level = np.r_[1:16, 15:-1:-1]
    beats = {"normal_left": left, "normal_right": right, "level": level}
    run = simulate(unit, beats, count=len(level), engine="auto")
    assert BisectionChainUnit().latency(2) == 51
    latency = np.array([unit.latency(k) for k in np.where(level, level, 16).tolist()])
    np.testing.assert_array_equal(run.cycles - run.input_cycles, latency)
    np.testing.assert_array_equal(run.input_cycles[1:], run.cycles[:-1] + 1)
