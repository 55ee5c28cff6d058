# amaranth: UnusedElaboratable=no
"""Diffuse unit: refusals. `tests.test_units` compares it with its model."""

import pytest

from blysk.hdl.lighting.diffuse import DiffuseUnit


@pytest.mark.parametrize(("interval", "least"), [(1, 2), (2, 3)])
def test_latency_must_hold_the_registers(interval, least):
    with pytest.raises(ValueError, match=rf"^latency must be at least {least}, not {least - 1}$"):
        DiffuseUnit(latency=least - 1, initiation_interval=interval)
