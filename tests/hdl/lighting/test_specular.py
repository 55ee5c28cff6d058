# amaranth: UnusedElaboratable=no
"""Specular unit: times, words of every exponent, refusals. `tests.test_units` compares it with its model."""

import numpy as np
import pytest
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.golden.lighting.specular import Specular
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.specular import SlopeUnit, SpecularUnit

from ...lists import FURTHER_MODELS, SPECULAR_MODELS
from ..variants import mostly_long

MODELS = SPECULAR_MODELS + FURTHER_MODELS

# Products, and the latency at initiation intervals of 1, 2, 3, 4 and 6, as in the docstring.
TIMING = {
    "cosquad": (2, 7, 13, 12, 13, 12),
    "cosquad_q": (2, 7, 13, 12, 13, 12),
    "lyon2": (3, 8, 15, 16, 18, 15),
    "lyon3": (4, 9, 19, 19, 23, 19),
    "exp": (2, 9, 15, 14, 15, 14),
    "coscos2": (5, 11, 20, 21, 21, 21),
    "coscos4": (6, 12, 23, 24, 25, 24),
    "as_published": (1, 8, 11, 11, 11, 11),
}


@pytest.mark.long
@pytest.mark.parametrize("reflection", TIMING)
def test_times_and_multipliers_at_every_interval(reflection):
    products, *latencies = TIMING[reflection]
    as_published = reflection == "as_published"
    model = Specular(REFLECTION_MODELS["cosquad" if as_published else reflection], as_published=as_published)
    for interval, latency in zip((1, 2, 3, 4, 6), latencies, strict=True):
        unit = SpecularUnit(model, initiation_interval=interval)
        assert (unit.latency, unit.initiation_interval) == (latency, interval)
        if interval > 2:
            continue
        cost = cost_of(unit)
        assert cost.multiplier_count == -(-products // interval) + as_published
        assert (cost.rom_bits == 0) == as_published
        if interval == 2:
            shared = {(18, 18): cost.multiplier_count - as_published}
            assert cost.multipliers == ({(18, 17): 1} | shared if as_published else shared)


@pytest.mark.parametrize("reflection", mostly_long(MODELS, "cosquad_lin", "cosquad_q", "exp"))
def test_slopes_of_every_exponent(reflection):
    """Every word that a unit needs for an exponent equals the reflection's tables, two cycles after the
    exponent.

    The boundary comes from a memory and its register, a cycle later.
    """
    model = Specular(REFLECTION_MODELS[reflection])
    unit = SlopeUnit(model)
    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    seen = []

    async def bench(context):
        for exponent in range(1004):
            context.set(unit.exponent, min(exponent, 1000))
            if exponent > 2:
                slope = unit.slope
                seen.append([context.get(Value.cast(slope[name])) for name in ("scale", "shift", "boundary")])
            await context.tick()

    simulator.add_testbench(bench)
    simulator.run()
    scale, shift = model.scale(np.arange(1, 1001))
    expected = np.stack([scale.codes, shift + 1, model.boundaries.codes[1:1001]], axis=1)
    seen = np.array(seen)
    np.testing.assert_array_equal(seen[:-1, :2], expected[:, :2])
    np.testing.assert_array_equal(seen[1:, 2], expected[:, 2])


@pytest.mark.parametrize(
    ("reflection", "tables", "interval"), [("cosquad", 0, 1), ("coscos4", 128 * 36 + 64 * 33, 3)]
)
def test_shared_slope_saves_the_prom(reflection, tables, interval):
    """A slope from outside comes in the same cycles, and the unit then has no PROM."""
    model = Specular(REFLECTION_MODELS[reflection])
    unit = SpecularUnit(model, initiation_interval=interval, shares_slope=True)
    assert unit.latency == SpecularUnit(model, initiation_interval=interval).latency
    assert cost_of(unit).rom_bits == tables
    assert cost_of(SlopeUnit(model)).rom_bits == 1024 * 17


def test_bad_options_are_refused():
    for exponent in (0, 1001):
        with pytest.raises(ValueError, match=rf"^exponent must be 1 to 1000, not {exponent}$"):
            SpecularUnit(exponent=exponent)
    with pytest.raises(ValueError, match=r"^a unit with an exponent of its own shares no slope$"):
        SpecularUnit(exponent=20, shares_slope=True)
    with pytest.raises(ValueError, match=r"^interval must be at least 1, not 0$"):
        SpecularUnit(initiation_interval=0)
