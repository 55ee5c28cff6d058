# amaranth: UnusedElaboratable=no
"""Specular unit: RTL against its twin, clock by clock, for every model and both operands."""

import numpy as np
import pytest
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.specular import SlopeUnit, SpecularUnit
from blysk.sim.engines.simulate import simulate

from ...lists import FURTHER_MODELS, SPECULAR_MODELS

MODELS = SPECULAR_MODELS + FURTHER_MODELS
EXPONENTS = [1, 2, 3, 7, 10, 64, 100, 255, 256, 500, 511, 512, 999, 1000]
STIFF_EXPONENTS = [1, 2, 3, 10, 100, 500, 1000]
LATENCY = {"lyon2": 8, "lyon2_refitted": 8, "lyon3": 9, "lyon3_refitted": 9, "exp": 9}
LATENCY |= {"coscos2": 11, "coscos2_integral": 11, "coscos4": 12, "coscos4_integral": 12}


# Products, and the latency at initiation intervals of 1, 2, 3, 4 and 6, as the docstring has them.
TIMING = {
    "cosquad": (2, 7, 17, 17, 16, 17),
    "cosquad_q": (2, 7, 17, 17, 16, 17),
    "lyon2": (3, 8, 21, 24, 21, 24),
    "lyon3": (4, 9, 27, 26, 27, 31),
    "exp": (2, 9, 19, 19, 18, 19),
    "coscos2": (5, 11, 28, 29, 28, 31),
    "coscos4": (6, 12, 33, 35, 33, 38),
    "as_published": (1, 8, 13, 13, 13, 13),
}


def operands(parameters, exponent, seed, count=800):
    """Every part of the range, most of it where the term is not 0, and the ends of the word."""
    rng = np.random.default_rng(seed)
    format = parameters.operand_format
    reach = min((4.0 if parameters.name in SPECULAR_MODELS else 12.0) / exponent, 2.0)
    few = count // 4
    argument = np.r_[rng.uniform(0, reach, count), rng.uniform(0, 2, few), 10.0 ** rng.uniform(-9, 0.3, few)]
    if parameters.operand == "cosine":
        one = ONE_SQUARED.codes
        codes = one - np.floor(argument * 2.0**34).astype(np.int64)
        edges = [one, one - 1, one + 1, one + 10**6, 0, 1, -1, -one, format.min_code, format.max_code]
    else:
        codes = np.floor(argument * 2.0**25).astype(np.int64)
        edges = [0, 1, 2, format.max_code, format.max_code - 1, 1 << 25]
    return np.r_[edges, np.clip(codes, format.min_code, format.max_code)]


def beats_of(parameters, exponent, codes, dark=None):
    """Input beats, and the twin's terms."""
    dark = np.zeros(len(codes), dtype=bool) if dark is None else dark
    expected = parameters.compute(Fixed(parameters.operand_format, codes), dark, exponent).codes
    return {"operand": codes, "dark": dark.astype(np.uint8)}, expected


def check(unit, exponent, beats, expected, **options):
    constants = None if exponent is None else {"exponent": exponent}
    run = simulate(unit, beats, count=len(expected), constants=constants, engine="auto", **options)
    np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
@pytest.mark.parametrize("model", MODELS)
def test_equals_twin(verify, model, operand):
    parameters = Specular(REFLECTION_MODELS[model], operand)
    unit = SpecularUnit(parameters)
    assert unit.latency == LATENCY.get(model, 7)
    stalled = 1000 if operand == "cosine" else 1
    for seed, exponent in enumerate(EXPONENTS):
        codes = operands(parameters, exponent, seed)
        beats, expected = beats_of(
            parameters, exponent, codes, np.random.default_rng(seed).random(len(codes)) < 0.1
        )
        assert expected.max() >= 2**17 - 9
        if exponent == stalled:
            verify(unit, beats, expected, constants={"exponent": exponent})
        else:
            check(unit, exponent, beats, expected)


def test_every_bit_counts():
    """Every bit of the exponent and of its slope, which waits with a beat; of products those rounded off."""
    parameters = Specular()
    unit = SpecularUnit(parameters)
    rng = np.random.default_rng(7)
    for exponent in [*1 << np.arange(10), *rng.integers(1, 1001, 50)]:
        codes = operands(parameters, exponent, exponent, 4000)
        stalls = rng.random(1009) < 0.3
        check(unit, exponent, *beats_of(parameters, exponent, codes), output_stalls=stalls)


@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_documented_comparator_equals_twin(verify, model, operand):
    """The second lobe comes through as the twin says, and the highlight as by default."""
    parameters = Specular(REFLECTION_MODELS[model], operand, as_published=True)
    unit = SpecularUnit(parameters)
    assert unit.latency == 8
    for seed, exponent in enumerate(STIFF_EXPONENTS):
        codes = operands(parameters, exponent, seed)
        dark = np.random.default_rng(seed).random(len(codes)) < 0.1
        beats, expected = beats_of(parameters, exponent, codes, dark)
        gated = beats_of(Specular(REFLECTION_MODELS[model], operand), exponent, codes, dark)[1]
        if exponent > 3:
            assert (expected > gated).any()
        if exponent == 10:
            verify(unit, beats, expected, constants={"exponent": exponent})
        else:
            check(unit, exponent, beats, expected)
    assert cost_of(unit).rom_bits == 0


@pytest.mark.parametrize("model", MODELS)
def test_stiff_largest_and_smallest_codes(model):
    """The ends of the operand's word and of the sphere, in turn, lit and dark, at every stiff exponent."""
    parameters = Specular(REFLECTION_MODELS[model])
    unit, format, one = SpecularUnit(parameters), parameters.operand_format, ONE_SQUARED.codes.item()
    codes = np.tile([format.min_code, format.max_code, -one, one, 0, -1], 20)
    dark = np.arange(120) % 7 == 0
    for exponent in STIFF_EXPONENTS:
        check(unit, exponent, *beats_of(parameters, exponent, codes, dark))


def test_cost_of_coscos():
    """Two products of 17 bits, two of chords, and the squarers; PROM, two tables, and one of slopes."""
    for model, squarers, slopes in (("coscos2", 1, 0), ("coscos4", 2, 0), ("coscos4_integral", 2, 1)):
        cost = cost_of(SpecularUnit(Specular(REFLECTION_MODELS[model])))
        assert cost.multipliers == {(17, 17): 2 + squarers, (17, 11): 1, (14, 11): 1}
        assert cost.rom_bits == 1024 * (17 + 27 * slopes) + 128 * 36 + 64 * 33


@pytest.mark.parametrize("model", TIMING)
def test_timing_and_multipliers_at_every_interval(model):
    products, *latencies = TIMING[model]
    as_published = model == "as_published"
    parameters = (
        Specular(REFLECTION_MODELS["cosquad"], as_published=True)
        if as_published
        else Specular(REFLECTION_MODELS[model])
    )
    for interval, latency in zip((1, 2, 3, 4, 6), latencies, strict=True):
        unit = SpecularUnit(parameters, initiation_interval=interval)
        assert (unit.latency, unit.initiation_interval) == (latency, interval)
        if interval > 2:
            continue
        cost = cost_of(unit)
        assert cost.multiplier_count == -(-products // interval) + as_published
        if interval == 2:
            shared = {(18, 18): cost.multiplier_count - as_published}
            assert cost.multipliers == ({(18, 17): 1} | shared if as_published else shared)


@pytest.mark.parametrize(
    ("model", "interval"),
    [
        *(("cosquad", 2), ("cosquad", 3), ("cosquad_lin", 6)),
        *(("lyon3", 3), ("exp", 4), ("coscos4", 2), ("as_published", 2)),
    ],
)
def test_equals_twin_at_longer_intervals(verify, model, interval):
    as_published = model == "as_published"
    parameters = Specular(REFLECTION_MODELS["cosquad" if as_published else model], as_published=as_published)
    unit = SpecularUnit(parameters, initiation_interval=interval)
    for exponent in STIFF_EXPONENTS:
        codes = operands(parameters, exponent, exponent, 400)
        dark = np.random.default_rng(exponent).random(len(codes)) < 0.3
        beats, expected = beats_of(parameters, exponent, codes, dark)
        if exponent == 10:
            verify(unit, beats, expected, constants={"exponent": exponent})
        else:
            check(unit, exponent, beats, expected)


@pytest.mark.parametrize(
    "model", [*SPECULAR_MODELS, "cosquad_q", "lyon3", "exp", "coscos4", "coscos2_integral"]
)
def test_slopes_of_every_exponent(model):
    """All that a unit needs of an exponent, two cycles after it, against the twin's tables."""
    parameters = Specular(REFLECTION_MODELS[model])
    unit = SlopeUnit(parameters)
    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    seen = []

    async def bench(context):
        for exponent in range(1003):
            context.set(unit.exponent, min(exponent, 1000))
            if exponent > 2:
                slope = unit.slope
                seen.append([context.get(Value.cast(slope[name])) for name in ("scale", "shift", "boundary")])
            await context.tick()

    simulator.add_testbench(bench)
    simulator.run()
    scale, shift = parameters.scale(np.arange(1, 1001))
    expected = np.stack([scale.codes, shift + 1, parameters.boundaries.codes[1:1001]], axis=1)
    np.testing.assert_array_equal(seen, expected)


@pytest.mark.parametrize("interval", [1, 3])
@pytest.mark.parametrize("model", ["cosquad", "coscos4"])
def test_shared_slope_equals_twin(verify, model, interval):
    """The slope from outside: the same terms at the same cycles, and no PROM in the unit."""
    parameters = Specular(REFLECTION_MODELS[model])
    unit = SpecularUnit(parameters, initiation_interval=interval, shares_slope=True)
    assert unit.latency == SpecularUnit(parameters, initiation_interval=interval).latency
    tables = 128 * 36 + 64 * 33 if model == "coscos4" else 0
    assert cost_of(unit).rom_bits == tables
    assert cost_of(SlopeUnit(parameters)).rom_bits == 1024 * 17
    for exponent in (1, 20, 1000):
        scale, shift = parameters.scale(exponent)
        boundary = parameters.boundaries[exponent]
        constants = {"scale": scale.codes, "shift": shift + 1, "boundary": boundary.codes}
        beats, expected = beats_of(parameters, exponent, operands(parameters, exponent, exponent, 400))
        if exponent == 20:
            verify(unit, beats, expected, constants=constants)
        else:
            run = simulate(unit, beats, count=len(expected), constants=constants, engine="auto")
            np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize(
    ("model", "exponent", "interval"),
    [("cosquad", 20, 1), ("cosquad", 1, 2), ("cosquad_lin", 1000, 1), ("exp", 57, 1), ("coscos2", 300, 4)],
)
def test_exponent_for_good_equals_twin(verify, model, exponent, interval):
    parameters = Specular(REFLECTION_MODELS[model])
    unit = SpecularUnit(parameters, initiation_interval=interval, exponent=exponent)
    assert not hasattr(unit, "constants")
    codes = operands(parameters, exponent, exponent)
    dark = np.random.default_rng(exponent).random(len(codes)) < 0.1
    verify(unit, *beats_of(parameters, exponent, codes, dark))


def test_exponent_for_good_costs_less():
    """No PROM, and one multiplier less: that of the slope is by a constant. No clock more."""
    for model, tables in (("cosquad", 0), ("cosquad_q", 0), ("lyon3", 0), ("exp", 64 * 32)):
        parameters = Specular(REFLECTION_MODELS[model])
        unit, fixed = SpecularUnit(parameters), SpecularUnit(parameters, exponent=37)
        assert fixed.latency == unit.latency
        cost, full = cost_of(fixed), cost_of(unit)
        assert cost.multiplier_count == full.multiplier_count - 1
        assert (cost.constant_multipliers, cost.rom_bits) == (1, tables)
        # Slope, its normal form, and the boundary.
        assert full.register_bits - cost.register_bits == 17 + 4 + 17 + (0 if model == "cosquad_q" else 27)


def test_bad_options_are_refused():
    with pytest.raises(ValueError, match=r"^exponent must be 1 to 1000, not 0$"):
        SpecularUnit(exponent=0)
    with pytest.raises(ValueError, match=r"^exponent must be 1 to 1000, not 1001$"):
        SpecularUnit(exponent=1001)
    with pytest.raises(ValueError, match=r"^a unit with an exponent of its own shares no slope$"):
        SpecularUnit(exponent=20, shares_slope=True)
    with pytest.raises(ValueError, match=r"^interval must be at least 1, not 0$"):
        SpecularUnit(initiation_interval=0)


@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_every_exponent(model):
    every_exponent(model)


@pytest.mark.long
@pytest.mark.parametrize("model", FURTHER_MODELS)
def test_every_exponent_of_further_models(model):
    every_exponent(model)


def every_exponent(model):
    parameters = Specular(REFLECTION_MODELS[model])
    unit = SpecularUnit(parameters)
    for exponent in range(1, 1001):
        codes = operands(parameters, exponent, exponent)[::40]
        check(unit, exponent, *beats_of(parameters, exponent, codes), settle=4)
