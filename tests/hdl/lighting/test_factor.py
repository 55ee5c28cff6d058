# amaranth: UnusedElaboratable=no
"""Factor unit: the cost of a factor. `tests.test_units` compares it with its model."""

import pytest

from blysk.golden.presets import preset
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.factor import FactorUnit
from blysk.hdl.pipeline import ShadingPipelineUnit


def test_a_product_or_none():
    assert FactorUnit().latency == FactorUnit(has_factor=False).latency == 2
    assert cost_of(FactorUnit()).multiplier_count == 1
    assert cost_of(FactorUnit(has_factor=False)).multiplier_count == 0


@pytest.mark.long
def test_a_light_that_fades_takes_a_product_a_pixel_and_two_a_span():
    """At an interval of 3 the setup's 13 products of two lights become 15 or 17, on 5 or 6 multipliers."""
    counts = []
    for factors in ((), (1,), (0, 1)):
        unit = ShadingPipelineUnit(preset("chord-local", "blinn", 2, factors=factors))
        counts.append(sum(cost_of(unit).multipliers.values()))
        assert unit.latency == ShadingPipelineUnit(preset("chord-local", "blinn", 2)).latency + 2 * bool(
            factors
        )
    assert counts == [19, 21, 23]


def test_compact_lights_without_a_factor_do_not_wait():
    """The terms of a light without a factor need no further unit, and its input has no factor."""
    unit = ShadingPipelineUnit(preset("chord-local", "lyon3", 2, factors=(1,), style="compact"))
    members = [set(light.i.payload.shape().members) for light in unit._shading.lights]
    assert ["factor" in names for names in members] == [False, True]
    assert unit._shading.lights[1].latency == unit._shading.lights[0].latency + 2
