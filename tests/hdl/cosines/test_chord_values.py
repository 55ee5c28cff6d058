# amaranth: UnusedElaboratable=no
"""Chord values: multipliers and latencies; `tests.test_units` holds the unit against its model."""

import pytest

from blysk.hdl.cosines.chord_values import ChordValuesUnit
from blysk.hdl.emit.cost import cost_of

FIGURES = {
    (1, 1): (6, 9),
    (1, 3): (2, 11),
    (1, 6): (1, 13),
    (2, 1): (12, 9),
    (2, 3): (4, 11),
    (3, 6): (4, 14),
}
"""Multipliers and latency, of numbers of lights and intervals."""


@pytest.mark.long
@pytest.mark.parametrize(("lights", "interval"), FIGURES)
def test_multipliers(lights, interval):
    """6 products a light, of 18 bits; 3 without highlights."""
    unit = ChordValuesUnit(None, lights, initiation_interval=interval)
    multipliers, latency = FIGURES[lights, interval]
    assert (unit.multipliers, unit.latency) == (multipliers, latency)
    assert cost_of(unit).multipliers == {(18, 18): multipliers}
    dark = ChordValuesUnit(None, lights, initiation_interval=interval, highlights=False)
    assert -(-3 * lights // interval) <= cost_of(dark).multiplier_count == dark.multipliers < multipliers + 1
    if interval == 1:
        assert dark.multipliers == 3 * lights
