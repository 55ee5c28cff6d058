# amaranth: UnusedElaboratable=no
"""Transfer unit: its cost. `tests.test_units` compares every input with its model."""

import pytest

from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.transfer import TransferUnit


def test_a_table_and_no_multiplier():
    """The table has 14,336 bits, and a port for each channel, or a single port for all channels in turn."""
    times = []
    for options in ({}, {"initiation_interval": 3}, {"channels": 1}):
        unit = TransferUnit(**options)
        cost = cost_of(unit)
        assert cost.multiplier_count == 0
        assert cost.rom_bits == 1024 * 14
        times.append((unit.latency, unit.initiation_interval))
    assert times == [(4, 1), (8, 3), (4, 1)]


def test_other_channels_are_refused():
    with pytest.raises(ValueError, match=r"^channels must be 1 or 3, not 2$"):
        TransferUnit(channels=2)
