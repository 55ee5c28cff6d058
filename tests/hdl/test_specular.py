"""Specular unit: RTL against its twin, clock by clock, for every model and both operands."""

import numpy as np
import pytest

from golden.fixed import Fixed
from golden.specular import SPECULAR_MODELS, Specular
from golden.unit_vector import ONE_SQUARED
from hdl.specular import SpecularUnit
from sim.engine import simulate

EXPONENTS = [1, 2, 3, 7, 10, 64, 100, 255, 256, 500, 511, 512, 999, 1000]


def operands(parameters, exponent, seed):
    """Every part of the range, most of them about the base's zero, and the ends of the word."""
    rng = np.random.default_rng(seed)
    format = parameters.operand_format
    reach = min(4.0 / exponent, 2.0)
    argument = np.r_[rng.uniform(0, reach, 800), rng.uniform(0, 2, 200), 10.0 ** rng.uniform(-9, 0.3, 200)]
    if parameters.operand == "cosine":
        one = ONE_SQUARED.codes
        codes = one - np.floor(argument * 2.0**34).astype(np.int64)
        edges = [one, one - 1, one + 1, one + 10**6, 0, 1, -1, -one, format.min_code, format.max_code]
    else:
        codes = np.floor(argument * 2.0**25).astype(np.int64)
        edges = [0, 1, 2, format.max_code, format.max_code - 1, 1 << 25]
    return np.r_[edges, np.clip(codes, format.min_code, format.max_code)]


@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_equals_twin(verify, model, operand):
    parameters = Specular(model, operand)
    unit = SpecularUnit(parameters)
    for seed, exponent in enumerate(EXPONENTS):
        codes = operands(parameters, exponent, seed)
        dark = np.random.default_rng(seed).random(len(codes)) < 0.1
        expected = parameters.compute(Fixed(parameters.operand_format, codes), dark, exponent).codes
        assert expected.max() > 0
        beats = {"operand": codes, "dark": dark.astype(np.uint8)}
        if exponent in (1, 1000):
            verify(unit, beats, expected, constants={"exponent": exponent})
        else:
            run = simulate(unit, beats, count=len(codes), constants={"exponent": exponent}, engine="auto")
            np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_every_exponent(model):
    parameters = Specular(model)
    unit = SpecularUnit(parameters)
    for exponent in range(1, 1001):
        codes = operands(parameters, exponent, exponent)[::40]
        expected = parameters.compute(
            Fixed(parameters.operand_format, codes), np.zeros(len(codes), bool), exponent
        )
        beats = {"operand": codes, "dark": np.zeros(len(codes), np.uint8)}
        run = simulate(
            unit, beats, count=len(codes), constants={"exponent": exponent}, engine="auto", settle=4
        )
        np.testing.assert_array_equal(run.beats, expected.codes)
