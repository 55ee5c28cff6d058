# amaranth: UnusedElaboratable=no
"""Specular unit: times, cost, every exponent, refusals; `tests.test_units` holds it against its model."""

import numpy as np
import pytest
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.bench.units.lighting.specular import expect, highlights
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.reference.reflection import REFLECTION_MODELS, AngleCosine, Exponential, PolynomialModel
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SlopeUnit, SpecularUnit
from blysk.sim.engines.simulate import simulate

from ...lists import FURTHER_MODELS, SPECULAR_MODELS
from ..variants import mostly_long

MODELS = SPECULAR_MODELS + FURTHER_MODELS

# Latency at an interval of 1, by the family of a model and its squarings.
LATENCY = {(PolynomialModel, 1): 7, (PolynomialModel, 2): 8, (PolynomialModel, 3): 9}
LATENCY |= {(Exponential, 0): 9, (AngleCosine, 1): 11, (AngleCosine, 2): 12}

# Products, and the latency at initiation intervals of 1, 2, 3, 4 and 6, as the docstring has them.
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


def test_latency_of_every_model():
    for model in MODELS:
        p = Specular(REFLECTION_MODELS[model])
        assert SpecularUnit(p).latency == LATENCY[type(p.reflection), p.squarings]


@pytest.mark.long
def test_cost_of_coscos():
    """Two products of 17 bits, two of chords, and the squarers; PROM, two tables, and one of slopes."""
    for model, squarers, slopes in (("coscos2", 1, 0), ("coscos4", 2, 0), ("coscos4_integral", 2, 1)):
        cost = cost_of(SpecularUnit(Specular(REFLECTION_MODELS[model])))
        assert cost.multipliers == {(17, 17): 2 + squarers, (17, 11): 1, (14, 11): 1}
        assert cost.rom_bits == 1024 * (17 + 27 * slopes) + 128 * 36 + 64 * 33


@pytest.mark.parametrize("reflection", mostly_long(MODELS, "cosquad_lin", "cosquad_q", "exp"))
def test_slopes_of_every_exponent(reflection):
    """Every word that a unit needs of an exponent against the reflection's tables, two cycles after it.

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
    """The slope from outside: at the same cycles, and no PROM in the unit."""
    model = Specular(REFLECTION_MODELS[reflection])
    unit = SpecularUnit(model, initiation_interval=interval, shares_slope=True)
    assert unit.latency == SpecularUnit(model, initiation_interval=interval).latency
    assert cost_of(unit).rom_bits == tables
    assert cost_of(SlopeUnit(model)).rom_bits == 1024 * 17


@pytest.mark.long
@pytest.mark.parametrize("reflection", ["cosquad", "cosquad_q", "lyon3", "exp"])
def test_fixed_exponent_costs_less(reflection):
    """No PROM, and one multiplier less: that of the slope is by a constant. No cycle more."""
    model = Specular(REFLECTION_MODELS[reflection])
    unit, fixed = SpecularUnit(model), SpecularUnit(model, exponent=37)
    assert fixed.latency == unit.latency
    assert not hasattr(fixed, "constants")
    cost, full = cost_of(fixed), cost_of(unit)
    assert cost.multiplier_count == full.multiplier_count - 1
    assert (cost.constant_multipliers, cost.rom_bits) == (1, 64 * 32 if reflection == "exp" else 0)
    # What the PROM gives, twice; the slope's normal form, and the boundary.
    assert full.register_bits - cost.register_bits == 2 * 17 + 4 + 17 + (
        0 if reflection == "cosquad_q" else 27
    )


def test_bad_options_are_refused():
    for exponent in (0, 1001):
        with pytest.raises(ValueError, match=rf"^exponent must be 1 to 1000, not {exponent}$"):
            SpecularUnit(exponent=exponent)
    with pytest.raises(ValueError, match=r"^a unit with an exponent of its own shares no slope$"):
        SpecularUnit(exponent=20, shares_slope=True)
    with pytest.raises(ValueError, match=r"^interval must be at least 1, not 0$"):
        SpecularUnit(initiation_interval=0)


@pytest.mark.long
@pytest.mark.parametrize("model", [*MODELS, "blinn"])
def test_every_exponent(model):
    unit = PowerUnit(Power()) if model == "blinn" else SpecularUnit(Specular(REFLECTION_MODELS[model]))
    for exponent in range(1, 1001):
        case = highlights(unit, np.random.default_rng(exponent), 40, exponent)
        run = simulate(unit, case.beats, count=40, constants=case.constants, engine="auto", settle=4)
        np.testing.assert_array_equal(run.beats, expect(unit, case))
