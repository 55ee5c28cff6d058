# amaranth: UnusedElaboratable=no
"""Intensity unit: RTL against its twin, clock by clock, in both styles, for numbers of lights."""

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import Fixed
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.intensity import CompactIntensityUnit, IntensityUnit
from blysk.sim.engines.simulate import simulate

COLOR, TERM = Intensity.COLOR_FORMAT, Intensity.TERM_FORMAT


def case(rng, lights, brightness, terms):
    """Input beats, constants, and the twin's channels."""
    ambient = rng.integers(0, 255 * 64 * brightness, 3)
    colors = rng.integers(0, 255 * 64 * brightness, (2, lights, 3))
    expected = Intensity(lights).compute(
        Fixed(COLOR, ambient),
        Fixed(COLOR, colors[0]),
        Fixed(COLOR, colors[1]),
        Fixed(TERM, terms[0]),
        Fixed(TERM, terms[1]),
    )
    return (
        {"diffuse": terms[0], "specular": terms[1]},
        {"ambient": ambient, "diffuse": colors[0], "specular": colors[1]},
        {name: expected[:, channel] for channel, name in enumerate("rgb")},
    )


@pytest.mark.parametrize("lights", [1, 2, 3, pytest.param(16, marks=pytest.mark.long)])
def test_equals_twin(verify, lights):
    rng = np.random.default_rng(lights)
    for brightness in (1, 8):
        terms = rng.integers(0, TERM.max_code + 1, (2, 800, lights))
        terms[:, :50] = TERM.max_code
        terms[:, 50:100] = 0
        beats, constants, expected = case(rng, lights, brightness, terms)
        verify(IntensityUnit(Intensity(lights)), beats, expected, constants=constants)


@pytest.mark.parametrize("brightness", [1, 2, 8])
def test_every_bit_counts(brightness):
    """Many colours: each bit of them, and the last bits of the products, which are rounded off."""
    rng = np.random.default_rng(brightness)
    unit = IntensityUnit()
    for _ in range(20):
        terms = rng.integers(0, TERM.max_code + 1, (2, 5000, 1)) >> rng.integers(0, 12, (2, 5000, 1))
        beats, constants, expected = case(rng, 1, brightness, terms)
        run = simulate(unit, beats, count=5000, constants=constants, engine="auto")
        for name in "rgb":
            np.testing.assert_array_equal(run.beats[name], expected[name])


@pytest.mark.parametrize("unit", [IntensityUnit, CompactIntensityUnit])
def test_halves_round_up(unit):
    """Channels of a half, and of the least step less: there every bit of a product and of a sum counts."""
    rng = np.random.default_rng(9)
    colors = np.repeat([[[8191]], [[6003]]], 3, axis=-1)
    ambient = np.array([3, 100, 40]) * 64 + 5
    specular = rng.integers(0, TERM.max_code + 1, (2, 40_000))
    wanted = (1 << 22) - np.arange(2)[:, np.newaxis]
    # An odd colour's term gives all bits that are wanted below those of the ambient light.
    diffuse = (wanted - 6003 * specular) * pow(8191, -1, 1 << 17) % (1 << 17)
    total = (5 << 17) + 8191 * diffuse + 6003 * specular
    chosen = total % (1 << 23) == wanted
    assert np.all(np.count_nonzero(chosen, axis=1) > 500)
    lit = (total[chosen] + (1 << 22) >> 23)[:, np.newaxis] + [3, 100, 40]
    beats = {"diffuse": diffuse[chosen][:, np.newaxis], "specular": specular[chosen][:, np.newaxis]}
    constants = {"ambient": ambient, "diffuse": colors[0], "specular": colors[1]}
    stalls = rng.random(1009) < 0.3
    run = simulate(unit(), beats, count=len(lit), constants=constants, engine="auto", output_stalls=stalls)
    for channel, name in enumerate("rgb"):
        np.testing.assert_array_equal(run.beats[name], np.minimum(lit[:, channel], 255))


def sparse_terms(rng, lights, count):
    """Terms of which any part is 0; none and all of them; all of the largest."""
    terms = rng.integers(1, TERM.max_code + 1, (2, count, lights))
    terms *= rng.random(terms.shape) < rng.random((1, count, 1))
    terms[:, :20] = TERM.max_code
    terms[:, 20:40] = 0
    terms[1, 40:60] = 0
    return terms


@pytest.mark.parametrize("lights", [1, 2, 3, 16])
def test_compact_equals_twin_in_the_clocks_stated(lights):
    """Every clock of every pixel: three for each term that is not 0, and three where there is none."""
    rng = np.random.default_rng(lights)
    unit = CompactIntensityUnit(Intensity(lights))
    assert unit.latency == 6 * lights + 5
    for brightness in (1, 8):
        terms = sparse_terms(rng, lights, 300)
        beats, constants, expected = case(rng, lights, brightness, terms)
        cycles = 3 * np.maximum((terms != 0).sum(axis=(0, 2)), 1)
        assert cycles.min() == 3
        assert cycles.max() == 6 * lights == unit.initiation_interval
        for engine in ("pysim", "auto"):
            few = 100 if engine == "pysim" else 300
            run = simulate(
                unit,
                {name: term[:few] for name, term in beats.items()},
                count=few,
                constants=constants,
                engine=engine,
            )
            for name in "rgb":
                np.testing.assert_array_equal(run.beats[name], expected[name][:few])
            np.testing.assert_array_equal(run.input_cycles, np.r_[0, np.cumsum(cycles[: few - 1])])
            np.testing.assert_array_equal(run.cycles, run.input_cycles + cycles[:few] + 5)


@pytest.mark.parametrize("lights", [1, 3])
def test_compact_equals_twin_under_stalls(lights):
    """Pixels are lost, repeated and changed by no pattern of stalls, in both engines on the same cycles."""
    rng = np.random.default_rng(lights)
    unit = CompactIntensityUnit(Intensity(lights))
    beats, constants, expected = case(rng, lights, 2, sparse_terms(rng, lights, 400))
    for input_share, output_share in ((0.4, 0.4), (0.9, 0.1), (0.1, 0.9), (0.0, 0.97), (0.97, 0.0)):
        stalls = {
            "input_stalls": rng.random(997) < input_share,
            "output_stalls": rng.random(1009) < output_share,
        }
        runs = []
        for engine, count in (("auto", 400), ("pysim", 70), ("auto", 70)):
            few = {name: term[:count] for name, term in beats.items()}
            run = simulate(unit, few, count=count, constants=constants, engine=engine, **stalls)
            for name in "rgb":
                np.testing.assert_array_equal(run.beats[name], expected[name][:count])
            runs.append(run)
        np.testing.assert_array_equal(runs[1].cycles, runs[2].cycles)
        np.testing.assert_array_equal(runs[1].input_cycles, runs[2].input_cycles)


@pytest.mark.parametrize("clock", range(14))
def test_compact_reset_in_mid_pixel(clock):
    """Reset so many cycles after a pixel was taken: the next comes as from power-up, and alone."""
    terms = np.full((2, 1, 1), TERM.max_code)
    _, constants, expected = case(np.random.default_rng(1), 1, 1, terms)
    unit = CompactIntensityUnit()
    reset = Signal()
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    seen = []

    async def bench(context):
        for color, codes in zip(unit.constants.ambient, constants["ambient"], strict=True):
            context.set(Value.cast(color), int(codes))
        for kind in ("diffuse", "specular"):
            context.set(Value.cast(unit.i.payload[kind]), TERM.max_code)
            for color, code in zip(unit.constants[kind][0], constants[kind][0], strict=True):
                context.set(Value.cast(color), int(code))
        context.set(unit.i.valid, 1)
        await context.tick()
        context.set(unit.i.valid, 0)
        for _ in range(clock):
            await context.tick()
        context.set(reset, 1)
        await context.tick()
        context.set(reset, 0)
        context.set(unit.o.ready, 1)
        context.set(unit.i.valid, 1)
        assert context.get(unit.i.ready)
        await context.tick()
        context.set(unit.i.valid, 0)
        for wait in range(1, 40):
            if context.get(unit.o.valid):
                seen.append((wait, *(context.get(unit.o.payload[name]) for name in "rgb")))
            await context.tick()

    simulator.add_testbench(bench)
    simulator.run()
    assert seen == [(unit.latency, *(expected[name][0] for name in "rgb"))]


@pytest.mark.parametrize("lights", [1, 2, 16])
def test_compact_costs_one_multiplier(lights):
    cost = cost_of(CompactIntensityUnit(Intensity(lights)))
    assert cost.multipliers == {(17, 17): 1}
    # As the docstring states.
    stated = {1: (230, 1335), 16: (808, 18769)}
    if lights in stated:
        assert (cost.register_bits, cost_of(IntensityUnit(Intensity(lights))).register_bits) == stated[lights]
    # Terms and which are left and used; operands, product, rounded sum; sum; channels, twice, as one waits;
    # four notes; the rest.
    growth = (2 * lights).bit_length()
    assert cost.register_bits == 38 * lights + 34 + 34 + (12 + growth) + (34 + growth) + 2 * 24 + 20 + 6
