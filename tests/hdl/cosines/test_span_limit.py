# amaranth: UnusedElaboratable=no
"""Span limit: parts; `tests.test_units` holds it against its model, and the flag of the interpolator."""

import pytest

from blysk.hdl.cosines.span_limit import SpanLimitUnit
from blysk.hdl.emit.cost import cost_of


@pytest.mark.long
def test_parts():
    """One multiplier of 18 bits, no table; a comparison with a constant and one with a register."""
    unit = SpanLimitUnit()
    cost = cost_of(unit)
    assert (unit.initiation_interval, unit.latency, unit.multipliers) == (3, 10, 1)
    assert cost.multipliers == {(18, 18): 1}
    assert (cost.rom_bits, cost.constant_multipliers) == (0, 0)
    assert "constants" not in SpanLimitUnit(highlights=False).signature.members
