# amaranth: UnusedElaboratable=no
# Above: a component that is refused is never elaborated.
"""Exact power unit: RTL against its twin, clock by clock, both forms and both operands."""

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.lighting.power import Power
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.hdl.lighting.power import PowerUnit
from blysk.sim.engines.simulate import simulate


def operands(parameters, exponent, count):
    rng = np.random.default_rng(exponent)
    format = parameters.operand_format
    argument = np.r_[rng.uniform(0, min(12 / exponent, 2), count), 10.0 ** rng.uniform(-9, 0.3, count // 4)]
    if parameters.operand == "cosine":
        one = ONE_SQUARED.codes
        codes = one - np.floor(argument * 2.0**34).astype(np.int64)
        edges = [one, one - 1, one + 1, one + 10**6, 0, 1, -1, -one, format.min_code, format.max_code]
    else:
        codes = np.floor(argument * 2.0**25).astype(np.int64)
        edges = [0, 1, 2, format.max_code, (1 << 25) - 1, 1 << 25]
    codes = np.r_[edges, np.clip(codes, format.min_code, format.max_code)]
    return codes, rng.random(len(codes)) < 0.1


@pytest.mark.parametrize("form", ["pipelined", "sequential"])
@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
def test_equals_twin(verify, operand, form):
    parameters = Power(operand)
    unit = PowerUnit(parameters, form=form)
    assert (unit.latency, unit.initiation_interval) == ((32, 1) if form == "pipelined" else (44, 42))
    # A bit of the exponent alone, too: its square is large where the term is not 0.
    for exponent in (*(1 << np.arange(10)).tolist(), 3, 511, 682, 341, 1000):
        codes, dark = operands(parameters, exponent, 400 if form == "pipelined" else 60)
        expected = parameters.compute(Fixed(parameters.operand_format, codes), dark, exponent).codes
        assert expected.max() == 2**17 - 1
        beats = {"operand": codes, "dark": dark.astype(np.uint8)}
        constants = {"exponent": exponent}
        if exponent == 682 and operand == "cosine":
            verify(unit, beats, expected, constants=constants)
        else:
            run = simulate(unit, beats, count=len(codes), constants=constants, engine="auto")
            np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize("exponent", [255, 341, 682, 1000])
def test_every_bit_counts(exponent):
    """The last bits of the products are rounded off: each decides once in many thousands."""
    parameters = Power()
    codes, dark = operands(parameters, exponent, 100_000)
    expected = parameters.compute(Fixed(parameters.operand_format, codes), dark, exponent).codes
    beats, constants = {"operand": codes, "dark": dark.astype(np.uint8)}, {"exponent": exponent}
    stalls = np.random.default_rng(exponent).random(1009) < 0.3
    run = simulate(
        PowerUnit(), beats, count=len(codes), constants=constants, engine="auto", output_stalls=stalls
    )
    np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.long
def test_every_exponent():
    parameters = Power()
    unit = PowerUnit(parameters)
    for exponent in range(1, 1001):
        codes, dark = operands(parameters, exponent, 40)
        expected = parameters.compute(Fixed(parameters.operand_format, codes), dark, exponent).codes
        beats = {"operand": codes, "dark": dark.astype(np.uint8)}
        run = simulate(unit, beats, count=len(codes), constants={"exponent": exponent}, engine="auto")
        np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize("form", ["pipelined", "sequential"])
def test_stiff_largest_and_smallest_codes(form):
    """The ends of the word and of the sphere in turn, lit and dark: no beat sees anything of the last."""
    parameters = Power()
    unit, format, one = PowerUnit(parameters, form=form), parameters.operand_format, ONE_SQUARED.codes.item()
    codes = np.tile([format.min_code, format.max_code, -one, one, 0, one // 2], 10)
    dark = np.arange(60) % 7 == 0
    beats = {"operand": codes, "dark": dark.astype(np.uint8)}
    for exponent in (1, 2, 3, 10, 100, 500, 1000):
        expected = parameters.compute(Fixed(format, codes), dark, exponent).codes
        constants = {"exponent": exponent}
        run = simulate(unit, beats, count=len(codes), constants=constants, engine="auto")
        np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize("clock", [0, 1, 2, 6, 23, 41, 42, 43, 44])
def test_stiff_reset_in_mid_power(clock):
    """The sequential form, so many cycles after it took a cosine: the next is raised as from power-up."""
    parameters = Power("one_minus_cosine")
    unit, exponent = PowerUnit(parameters, form="sequential"), 1000
    codes = np.array([1 << 14, 1 << 15])
    expected = parameters.compute(Fixed(parameters.operand_format, codes), np.zeros(2, bool), exponent).codes
    assert 0 < expected[1] < expected[0]
    reset = Signal()
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    seen = []

    async def bench(context):
        context.set(unit.constants.exponent, exponent)
        context.set(unit.o.ready, 1)
        context.set(unit.i.valid, 1)
        context.set(Value.cast(unit.i.payload.operand), int(codes[0]))
        await context.tick()
        context.set(unit.i.valid, 0)
        for _ in range(clock):
            await context.tick()
        context.set(reset, 1)
        await context.tick()
        context.set(reset, 0)
        context.set(unit.i.valid, 1)
        context.set(Value.cast(unit.i.payload.operand), int(codes[1]))
        # Taken in at once.
        assert context.get(unit.i.ready)
        assert not context.get(unit.o.valid)
        await context.tick()
        context.set(unit.i.valid, 0)
        for wait in range(100):
            if context.get(unit.o.valid):
                seen.append((wait, context.get(Value.cast(unit.o.payload))))
            await context.tick()

    simulator.add_testbench(bench)
    simulator.run()
    assert seen == [(unit.latency - 1, expected[1])]


def test_unknown_form_is_refused():
    with pytest.raises(ValueError, match=r"^form must be 'pipelined' or 'sequential', not 'drawn'$"):
        PowerUnit(form="drawn")
