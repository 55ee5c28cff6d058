# amaranth: UnusedElaboratable=no
"""Half-chord unit: its times and parts; `tests.test_units` holds it against its model."""

import pytest

from blysk.hdl.cosines.half_chord import HalfChordUnit
from blysk.hdl.emit.cost import cost_of

# Latency and multipliers for the initiation intervals 1 to 6, as the unit's text states them.
STATED = [(1, 25, 6), (2, 28, 3), (3, 26, 2), (4, 27, 2), (5, 26, 2), (6, 32, 1)]


@pytest.mark.long
@pytest.mark.parametrize(("interval", "latency", "multipliers"), STATED)
def test_times_and_parts(interval, latency, multipliers):
    unit = HalfChordUnit(initiation_interval=interval)
    assert (unit.latency, cost_of(unit).multiplier_count) == (latency, multipliers)


def test_refuses_an_interval():
    assert HalfChordUnit().initiation_interval == 6
    with pytest.raises(ValueError, match=r"^initiation_interval must be 1 to 6, not 7$"):
        HalfChordUnit(initiation_interval=7)
