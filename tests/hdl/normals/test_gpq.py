"""G/P/Q unit: its times and parts; `tests.test_units` holds it against its model."""

from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.gpq import GPQUnit


def test_times_and_parts():
    unit = GPQUnit()
    assert (unit.latency, unit.initiation_interval) == (3, 1)
    assert cost_of(unit).multiplier_count == 0
