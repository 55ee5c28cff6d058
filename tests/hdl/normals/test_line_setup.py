"""Line setup: its times and parts; `tests.test_units` holds it against its model."""

import pytest

from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.line_setup import LineSetupUnit


@pytest.mark.long
@pytest.mark.parametrize(("interval", "multipliers"), [(1, 9), (2, 5), (3, 3), (4, 3), (5, 2), (9, 1)])
def test_times_and_parts(interval, multipliers):
    unit = LineSetupUnit(initiation_interval=interval)
    assert unit.initiation_interval == interval
    assert unit.multipliers == multipliers == -(-9 // interval)
    cost = cost_of(unit)
    assert cost.multiplier_count == multipliers
    assert all(width <= 18 for pair in cost.multipliers for width in pair)
    assert cost.rom_bits == 2048 * 24


@pytest.mark.parametrize("given", [{"initiation_interval": 0}, {"length_bits": 1}, {"length_bits": 13}])
def test_refuses(given):
    with pytest.raises(ValueError, match="must be"):
        LineSetupUnit(**given)
