"""Dot-product unit: its times and parts; `tests.test_units` holds it against its model."""

from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.dot_product import DotProductUnit


def test_times_and_parts():
    unit = DotProductUnit()
    assert (unit.latency, unit.initiation_interval) == (3, 1)
    assert cost_of(unit).multipliers == {(18, 18): 3}
