# amaranth: UnusedElaboratable=no
"""Value gate: parts; `tests.test_units` holds the unit against its model."""

import pytest

from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.value_gate import ValueGateUnit


@pytest.mark.long
@pytest.mark.parametrize("lights", [1, 3])
def test_parts(lights):
    """No multiplier; for all lights a PROM of 1024 words of 18 bits, none without a port for the exponent."""
    unit = ValueGateUnit(None, lights)
    assert (unit.latency, unit.initiation_interval) == (3, 1)
    assert unit.model.LEVEL_FORMAT.width == 30
    cost = cost_of(unit)
    assert (cost.multiplier_count, cost.constant_multipliers, cost.rom_bits) == (0, 0, 18 << 10)
    fixed = ValueGateUnit(None, lights, exponent=60)
    assert cost_of(fixed).rom_bits == 0
    assert "constants" not in fixed.signature.members
    given = ValueGateUnit(None, lights, takes_threshold=True)
    assert cost_of(given).rom_bits == 0
    assert len(given.constants) == 18
