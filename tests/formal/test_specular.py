"""Proof by exhaustion of the specular unit: its term never rises with the argument, and ends."""

import numpy as np
import pytest

from golden.fixed import Fixed
from golden.reflection import reflect
from golden.specular import FURTHER_MODELS, SPECULAR_MODELS, Specular
from hdl.specular import SpecularUnit
from sim.engine import simulate

pytestmark = pytest.mark.prove

# Of other models than the first: small ones, those next to a power of two, where the scale jumps, and others.
SOME = sorted(
    {*range(1, 12), *(2**k + step for k in range(4, 10) for step in (-1, 0, 1)), 100, 777, 999, 1000}
)


def every_argument(unit, exponent):
    """Up to a shifted argument of 2, the first of all arguments that the unit cannot tell from it; then some.

    What it reads are the bits of the shifted argument, and of ``coscos`` those that address its first table.
    Past 2 every term is 0.
    """
    _, shift = unit.scale(np.int64(exponent))
    step = 1 << min(9 - int(shift), 8 if unit.is_coscos else 9)
    last = unit.ARGUMENT_FORMAT.max_code
    reach = min(last, unit.SHIFTED_FORMAT.max_code + 2 << 9 - int(shift))
    beyond = np.r_[np.linspace(reach, last, 5000).astype(np.int64), np.maximum(reach, 1 << np.arange(26))]
    return np.r_[np.arange(0, reach, step), np.sort(beyond)]


def check(unit, exponent):
    """Every term is the twin's, none is larger than that of a smaller argument, none is lit past the end."""
    parameters = unit.parameters
    codes = every_argument(parameters, exponent)
    run = simulate(
        unit,
        {"operand": codes, "dark": np.zeros(len(codes), dtype=np.uint8)},
        count=len(codes),
        constants={"exponent": exponent},
    )
    terms = run.beats.astype(np.int64)
    assert (np.diff(terms) <= 0).all()
    assert terms[0] >= 2**17 - 9
    assert not terms[reflect(parameters.model, 1 - codes * 2.0**-25, exponent) == 0].any()
    operand = Fixed(parameters.ARGUMENT_FORMAT, codes)
    np.testing.assert_array_equal(
        terms, parameters.compute(operand, np.zeros(len(codes), dtype=bool), exponent).codes
    )


@pytest.mark.parametrize("model", SPECULAR_MODELS + FURTHER_MODELS)
def test_term_never_rises(model):
    """Every exponent for the first model, `SOME` for the others; every argument."""
    unit = SpecularUnit(Specular(model, "one_minus_cosine"))
    for exponent in range(1, 1001) if model == SPECULAR_MODELS[0] else SOME:
        check(unit, exponent)


BUGS = {
    "nothing is cut off": ("((wide <= boundary) | Value.cast(boundary).all()) & ~dark", "~dark"),
    "the second lobe comes through": (
        "(wide <= boundary)",
        "(Value.cast(wide)[:18] <= Value.cast(boundary))",
    ),
    "the largest shift loses a bit": ("<< self._slope[1])[:36]", "<< self._slope[1])[:36] & 0x7FFFFFFFF"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(plant, bug):
    """Planted in the unit, each breaks a claim."""
    plant(SpecularUnit, "_describe", *BUGS[bug])
    unit = SpecularUnit(Specular("cosquad", "one_minus_cosine"))
    with pytest.raises(AssertionError):
        check(unit, 1000)
