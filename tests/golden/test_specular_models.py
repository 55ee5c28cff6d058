"""The specular unit's models beyond the documents' three, against float64."""

import numpy as np
import pytest

from golden.fixed import Fixed
from golden.reflection import LINE_MODELS, REFLECTION_MODELS, reflect, slope
from golden.specular import FURTHER_MODELS, SPECULAR_MODELS, Specular
from golden.unit_vector import ONE_SQUARED

EVERY_EXPONENT = np.arange(1, 1001)
EXPONENTS = (1, 2, 3, 10, 100, 500, 1000)
# Largest error measured over every exponent, by squarings; 6.1e-5 is the cutoff itself.
MEASURED = {1: 6.2e-5, 2: 6.2e-5, 3: 1.3e-4, 0: 1.8e-4}


def shade(unit, codes, exponent):
    codes = np.asarray(codes)
    return unit.compute(Fixed(unit.operand_format, codes), np.zeros(codes.shape, bool), exponent)


def zero(unit, exponent):
    """Argument at which the unit's cutoff lies, nearly."""
    if unit.model == "exp":
        return 14 * np.log(2) / exponent
    return (1 - unit.cutoff.values.item()) / slope(unit.model, exponent)


def test_models_are_reflection_models():
    assert not set(FURTHER_MODELS) & set(SPECULAR_MODELS)
    assert set(LINE_MODELS) | {"exp"} == set(FURTHER_MODELS) | set(SPECULAR_MODELS)
    assert set(FURTHER_MODELS) < set(REFLECTION_MODELS)


@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
@pytest.mark.parametrize("model", FURTHER_MODELS)
def test_error_and_monotony_at_every_exponent(model, operand):
    unit = Specular(model, operand)
    worst = 0
    for exponent in EVERY_EXPONENT[:: 1 if operand == "cosine" else 7]:
        rng = np.random.default_rng(exponent)
        end = zero(unit, exponent)
        argument = np.r_[
            np.linspace(0, end / 50, 100),
            rng.uniform(0, 1.1 * end, 500),
            end * (1 + rng.uniform(-1e-2, 1e-2, 100)),
        ]
        argument = np.sort(np.r_[argument, rng.uniform(0, 1.99, 50)])
        argument = argument[argument < 1.99]
        if operand == "cosine":
            codes = np.floor(ONE_SQUARED.codes * (1 - argument)).astype(np.int64)
            argument = 1 - codes / ONE_SQUARED.codes
        else:
            codes = np.floor(argument * 2**25).astype(np.int64)
            argument = codes * 2.0**-25
        result = shade(unit, codes, exponent)
        ideal = reflect(model, 1 - argument, exponent)
        worst = max(worst, np.abs(result.values - ideal).max())
        assert (np.diff(result.codes) <= 0).all()
        # What is dropped is under 2^-14, but for the error with which the argument is read.
        assert ideal[result.codes == 0].max(initial=0) <= 2.0**-14 * 1.001
    assert unit.error / 10 < worst <= min(unit.error, MEASURED[unit.squarings])


@pytest.mark.parametrize("model", FURTHER_MODELS)
def test_every_argument_of_a_narrow_highlight(model):
    unit = Specular(model, "one_minus_cosine")
    for exponent in (997, 1000):
        codes = np.arange(int(1.1 * zero(unit, exponent) * 2**25))
        error = np.abs(shade(unit, codes, exponent).values - reflect(model, 1 - codes * 2.0**-25, exponent))
        assert unit.error / 10 < error.max() <= unit.error


def test_table_of_slopes():
    ours = Specular("cosquad_q").slopes.values[1:1001]
    ideal = [slope("cosquad_q", exponent) for exponent in EVERY_EXPONENT]
    assert np.abs(ours - ideal).max() <= 2.0**-19


@pytest.mark.parametrize("model", FURTHER_MODELS)
def test_stiff_arguments(model):
    """The peak and past it by rounding; the far side of the sphere; codes of no unit vector."""
    unit = Specular(model, "cosine")
    one = ONE_SQUARED.codes.item()
    for exponent in EXPONENTS:
        peak = shade(unit, [one, one + 1, one + 2**20, unit.operand_format.max_code], exponent)
        assert (peak.codes >= 2**17 - 9).all()
        assert len(set(peak.codes.tolist())) == 1
        ends = shade(unit, [-one, unit.operand_format.min_code], exponent)
        ideal = reflect(model, [-1.0, -1.0], exponent)
        assert ends.values == pytest.approx(ideal, abs=unit.error)
        dark = unit.compute(Fixed(unit.operand_format, [one]), np.ones(1, bool), exponent)
        assert dark.codes == 0


def test_chords_meet():
    start, drop = Specular("exp").chords
    ends = np.r_[start.codes[1:], start.codes[0] / 2]
    assert start.codes - drop.codes == pytest.approx(ends, abs=0.5)
