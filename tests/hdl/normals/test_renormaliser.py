"""Renormaliser: its times and parts; `tests.test_units` holds it against its model."""

import pytest

from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.renormaliser import RenormaliserUnit


@pytest.mark.long
def test_times_and_parts():
    unit = RenormaliserUnit()
    assert (unit.latency, unit.initiation_interval) == (16, 1)
    cost = cost_of(unit)
    assert cost.multiplier_count == 8
    assert cost.rom_bits == 64 * 48
