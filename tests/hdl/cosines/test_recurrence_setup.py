# amaranth: UnusedElaboratable=no
"""Recurrence setup: times and parts, and refusals; `tests.test_units` has its results."""

import pytest

from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.hdl.emit.cost import cost_of

STATED = [
    (1, 1, 46, 18, 112),
    (1, 2, 23, 9, 121),
    (1, 4, 12, 5, 126),
    (1, 8, 6, 3, 138),
    (1, 46, 1, 1, 225),
    (2, 4, 20, 9, 130),
]
"""Lights, interval, multipliers, shifters and latency, as the unit's text states them."""


@pytest.mark.long
@pytest.mark.parametrize(("lights", "interval", "multipliers", "shifters", "latency"), STATED)
def test_times_and_parts(lights, interval, multipliers, shifters, latency):
    """14 products a span and 32 a light, as even as the interval allows; all of 18 bits."""
    unit = RecurrenceSetupUnit(None, lights, initiation_interval=interval)
    cost = cost_of(unit)
    assert cost.multipliers == {(18, 18): multipliers}
    assert (unit.multipliers, unit.shifters) == (multipliers, shifters)
    assert cost.constant_multipliers == 0
    assert unit.latency == latency
    assert multipliers == -(-(14 + 32 * lights) // interval)


@pytest.mark.parametrize("interval", [0, -1])
def test_refuses_an_interval(interval):
    with pytest.raises(ValueError, match=rf"^interval must be at least 1, not {interval}$"):
        RecurrenceSetupUnit(initiation_interval=interval)
