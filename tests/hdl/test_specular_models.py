"""Specular unit: RTL against its twin for the models beyond the documents' three."""

import numpy as np
import pytest

from golden.fixed import Fixed
from golden.specular import FURTHER_MODELS, Specular
from golden.unit_vector import ONE_SQUARED
from hdl.specular import SpecularUnit
from sim.engine import simulate


def operands(parameters, exponent, seed):
    """Every part of the range, most of it where the term is not 0, and the ends of the word."""
    rng = np.random.default_rng(seed)
    format = parameters.operand_format
    reach = min(12.0 / exponent, 2.0)
    argument = np.r_[rng.uniform(0, reach, 400), rng.uniform(0, 2, 60), 10.0 ** rng.uniform(-9, 0.3, 60)]
    if parameters.operand == "cosine":
        one = ONE_SQUARED.codes
        codes = one - np.floor(argument * 2.0**34).astype(np.int64)
        edges = [one, one - 1, one + 1, one + 10**6, 0, 1, -1, -one, format.min_code, format.max_code]
    else:
        codes = np.floor(argument * 2.0**25).astype(np.int64)
        edges = [0, 1, 2, format.max_code, format.max_code - 1, 1 << 25]
    return np.r_[edges, np.clip(codes, format.min_code, format.max_code)]


@pytest.mark.parametrize("model", FURTHER_MODELS)
def test_equals_twin(verify, model):
    parameters = Specular(model)
    unit = SpecularUnit(parameters)
    # A clock for every squarer; the documents' three have 7.
    assert unit.latency == (9 if model == "exp" else 6 + parameters.squarings)
    for seed, exponent in enumerate((1, 2, 3, 100, 511, 999, 1000)):
        codes = operands(parameters, exponent, seed)
        dark = np.random.default_rng(seed).random(len(codes)) < 0.1
        expected = parameters.compute(Fixed(parameters.operand_format, codes), dark, exponent).codes
        assert expected.max() > 130000
        beats = {"operand": codes, "dark": dark.astype(np.uint8)}
        if exponent == 100:
            verify(unit, beats, expected, constants={"exponent": exponent})
        else:
            run = simulate(unit, beats, count=len(codes), constants={"exponent": exponent}, engine="auto")
            np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize("model", ["cosquad_q", "exp"])
def test_takes_one_minus_cosine(model):
    parameters = Specular(model, "one_minus_cosine")
    codes = operands(parameters, 40, 1)
    dark = np.zeros(len(codes), np.uint8)
    expected = parameters.compute(Fixed(parameters.operand_format, codes), dark, 40).codes
    run = simulate(
        SpecularUnit(parameters),
        {"operand": codes, "dark": dark},
        count=len(codes),
        constants={"exponent": 40},
        engine="auto",
    )
    np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.long
@pytest.mark.parametrize("model", FURTHER_MODELS)
def test_every_exponent(model):
    parameters = Specular(model)
    unit = SpecularUnit(parameters)
    for exponent in range(1, 1001):
        codes = operands(parameters, exponent, exponent)[::20]
        dark = np.zeros(len(codes), np.uint8)
        expected = parameters.compute(Fixed(parameters.operand_format, codes), dark, exponent).codes
        run = simulate(
            unit,
            {"operand": codes, "dark": dark},
            count=len(codes),
            constants={"exponent": exponent},
            engine="auto",
            settle=4,
        )
        np.testing.assert_array_equal(run.beats, expected)
