# amaranth: UnusedElaboratable=no
# Above: a component that is refused is never elaborated.
"""Exact power unit: RTL against its twin, clock by clock, both forms and both operands."""

import numpy as np
import pytest

from golden.fixed import Fixed
from golden.power import Power
from golden.unit_vector import ONE_SQUARED
from hdl.power import PowerUnit
from sim.engine import simulate


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
    unit = PowerUnit(parameters, form)
    assert (unit.latency, unit.initiation_interval) == ((32, 1) if form == "pipelined" else (44, 42))
    for exponent in (1, 2, 3, 512, 511, 682, 341, 1000):
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


def test_unknown_form_is_refused():
    with pytest.raises(ValueError, match=r"^form must be 'pipelined' or 'sequential', not 'drawn'$"):
        PowerUnit(form="drawn")
