# amaranth: UnusedElaboratable=no
"""Bisection unit: times and parts at every interval, and refusals; `tests.test_units` has its results."""

import pytest

from blysk.golden.normals.bisection import Bisection
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.bisection import BisectionUnit

# Latency and multipliers for the initiation intervals 1, 2, ..., as the unit's text states them.
STATED = {
    Bisection(): [(23, 9), (25, 5), (26, 3), (24, 3), (29, 2), (27, 2), (25, 2), (25, 2), (38, 1)],
    Bisection(2, 45): [(20, 8), (22, 4), (23, 3), (25, 2), (24, 2), (23, 2), (23, 2), (29, 1)],
    Bisection(1, 45): [(17, 7), (19, 4), (20, 3), (21, 2), (19, 2), (20, 2), (25, 1)],
}


@pytest.mark.long
@pytest.mark.parametrize("parameters", STATED, ids=str)
def test_intervals_and_parts(parameters):
    assert BisectionUnit(parameters).initiation_interval == parameters.steps + 3
    for interval, stated in enumerate(STATED[parameters], 1):
        unit = BisectionUnit(parameters, initiation_interval=interval)
        cost = cost_of(unit)
        assert (unit.latency, cost.multiplier_count) == stated
        assert unit.initiation_interval == interval
        assert all(widest <= 18 for widest, _ in cost.multipliers)


@pytest.mark.parametrize(("steps", "interval"), [(3, 0), (3, 10), (3, 2.5), (1, 8)])
def test_refuses_an_interval(steps, interval):
    parameters = {3: Bisection(), 1: Bisection(1, 45)}[steps]
    with pytest.raises(ValueError, match=rf"^initiation_interval must be 1 to {steps + 6}, not {interval}$"):
        BisectionUnit(parameters, initiation_interval=interval)
