# amaranth: UnusedElaboratable=no
"""Diffuse unit: cost of its delay, and refusals; `tests.test_units` holds it against its model."""

import pytest

from blysk.golden.lighting.diffuse import Diffuse
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.diffuse import DiffuseUnit


@pytest.mark.long
def test_delay_costs_a_register_for_each_interval():
    """Stages; two of a skid buffer; operand, slot and ready over interval 1; rounded, result; copies."""
    assert DiffuseUnit().latency == 2
    assert DiffuseUnit(initiation_interval=4).latency == 3
    width, rounded = Diffuse().operand_format.width, 22
    for latency, interval, copies in ((7, 1, 5), (11, 2, 4), (11, 3, 2), (11, 6, 1)):
        cost = cost_of(DiffuseUnit(latency=latency, initiation_interval=interval))
        control = latency + 2 + (0 if interval == 1 else width + 2 + (interval - 1).bit_length())
        assert cost.register_bits == control + rounded + 17 * (2 + copies)
        assert cost.multiplier_count == 0


@pytest.mark.parametrize(("interval", "least"), [(1, 2), (2, 3)])
def test_latency_must_hold_the_registers(interval, least):
    with pytest.raises(ValueError, match=rf"^latency must be at least {least}, not {least - 1}$"):
        DiffuseUnit(latency=least - 1, initiation_interval=interval)
