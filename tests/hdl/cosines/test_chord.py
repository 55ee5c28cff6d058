"""Chord unit: its times and parts; `tests.test_units` holds it against its model."""

from blysk.hdl.cosines.chord import ChordUnit
from blysk.hdl.emit.cost import cost_of


def test_times_and_parts():
    unit = ChordUnit()
    assert (unit.latency, unit.initiation_interval) == (8, 1)
    assert cost_of(unit).multipliers == {(18, 18): 3}
