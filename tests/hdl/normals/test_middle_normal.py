# amaranth: UnusedElaboratable=no
"""Middle normal: times and parts at every interval, and refusals; `tests.test_units` has its results."""

import pytest

from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.middle_normal import MiddleNormalUnit

# Latency and multipliers for the initiation intervals 1 to 9, as the unit's text states them.
STATED = [(26, 9), (28, 5), (29, 3), (28, 3), (30, 2), (34, 2), (30, 2), (28, 2), (39, 1)]


@pytest.mark.long
@pytest.mark.parametrize("interval", range(1, 10))
def test_intervals_and_parts(interval):
    unit = MiddleNormalUnit(initiation_interval=interval)
    cost = cost_of(unit)
    assert (unit.latency, cost.multiplier_count) == STATED[interval - 1]
    assert unit.initiation_interval == interval
    assert all(widest <= 18 for widest, _ in cost.multipliers)


def test_default_interval():
    assert MiddleNormalUnit().initiation_interval == 6


@pytest.mark.parametrize("interval", [0, 10, -1, 1.5])
def test_refuses_an_interval(interval):
    with pytest.raises(ValueError, match=rf"^initiation_interval must be 1 to 9, not {interval}$"):
        MiddleNormalUnit(initiation_interval=interval)
