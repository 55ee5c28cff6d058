"""Model of the exact power unit against float64 and exact integers."""

from fractions import Fraction

import numpy as np
import pytest

from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.reflection import REFLECTION_MODELS

from ...lists import SPECULAR_MODELS

EXPONENTS = (1, 2, 3, 10, 100, 500, 1000)


def shade(unit, codes, exponent):
    codes = np.asarray(codes)
    return unit.compute(Fixed(unit.operand_format, codes), np.zeros(codes.shape, bool), exponent)


def exact(argument, exponent):
    """``(1 - x)^n`` with all digits of x."""
    return np.exp(exponent * np.log1p(-np.minimum(argument, 1 - 1e-15)))


def test_error_at_every_exponent():
    unit = Power("one_minus_cosine")
    largest, smallest = 0.0, 0.0
    for exponent in range(1, 1001):
        rng = np.random.default_rng(exponent)
        argument = np.r_[
            rng.uniform(0, min(12 / exponent, 2), 500),
            np.linspace(0, 1 / exponent, 200),
            rng.uniform(0, 2, 50),
        ]
        codes = np.sort(np.floor(argument * 2**25).astype(np.int64))
        result = shade(unit, np.minimum(codes, unit.operand_format.max_code), exponent)
        error = result.values - exact(codes * 2.0**-25, exponent)
        # The cuts of neighbours differ by less than the bound. `tests/formal/test_power.py` has any two
        # arguments.
        assert (np.diff(result.codes) <= 5).all()
        largest, smallest = max(largest, error.max()), min(smallest, error.min())
    # Every cut makes the result smaller.
    assert largest < 1e-12
    assert Power.ERROR / 2 < -smallest <= Power.ERROR


def test_error_of_a_cosine():
    """In units of the codes' length omega, ``x / omega`` exceeds x by a share of 2^-16; n x c^(n-1) <= 1."""
    unit = Power()
    omega = ONE_SQUARED.codes.item()
    for exponent in (1, 2, 3, 10, 100, 500, 1000):
        codes = omega - (np.linspace(0, min(12 / exponent, 1), 20_000) * omega).astype(np.int64)
        error = shade(unit, codes, exponent).values - exact(1 - codes / omega, exponent)
        assert np.abs(error).max() <= Power.ERROR + 2.0**-16


def test_first_order_bound():
    """The sum of docs/theory/bounds.md#power: the error of every cut product, times its factor in the
    result."""
    worst, at = 0, None
    for n in range(1, 1001):
        bits = [j for j in range(10) if n >> j & 1]
        x = [np.linspace(0, min(14 / n, 1), 800)]
        for _ in range(9):
            x.append(2 * x[-1] - x[-1] ** 2)
        total = np.ones_like(x[0])
        for k in range(9):
            # The error 2 x of a square reaches all higher bits: c^m with m = n >> (k + 1).
            m = n >> (k + 1)
            if m:
                lower = np.prod([1 - x[j] for j in bits if j <= k], axis=0)
                total = total + lower * m * (1 - x[k + 1]) ** (m - 1) * 2 * x[k]
        s = x[bits[0]]
        for place, j in enumerate(bits[1:], start=1):
            higher = np.prod([1 - x[i] for i in bits[place + 1 :]], axis=0)
            total = total + (s + x[j]) * higher
            s = s + x[j] - s * x[j]
        if total.max() > worst:
            worst, at = total.max(), n
    assert at == 513
    assert worst == pytest.approx(5.97, abs=0.01)
    assert worst * 2.0**-17 < Power.ERROR


def test_against_integers():
    """Powers in exact rational numbers, without floating point."""
    unit = Power("one_minus_cosine")
    rng = np.random.default_rng(3)
    for exponent in (1, 2, 7, 63, 513, 1000):
        codes = rng.integers(0, int(2**25 * min(6 / exponent, 1)), 40)
        for code, result in zip(codes.tolist(), shade(unit, codes, exponent).codes.tolist(), strict=True):
            power = Fraction(2**25 - code, 2**25) ** exponent
            assert 0 <= power * 2**17 - result <= 6


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_stiff_codes(exponent):
    """The peak and cosines past it, and cosines of 0 and less. `test_specular` has the other limits."""
    unit, one = Power(), ONE_SQUARED.codes.item()
    assert (shade(unit, [one, one + 2**20, unit.operand_format.max_code], exponent).codes == 2**17 - 1).all()
    assert not shade(unit, [-(2**18), -one, unit.operand_format.min_code], exponent).codes.any()
    # The square of the codes' length is 2^-16 less than 1, so c = 0 counts as 2^-16.
    assert (shade(unit, [0, -1], exponent).codes == (exponent == 1)).all()
    unit = Power("one_minus_cosine")
    assert shade(unit, [0], exponent).codes == 2**17 - 1
    assert not shade(unit, [1 << 25, unit.operand_format.max_code], exponent).codes.any()


def test_nearer_to_blinn_than_the_approximations():
    codes = ONE_SQUARED.codes - (np.linspace(0, 0.12, 5000) * 2.0**34).astype(np.int64)
    ideal = exact(1 - codes / ONE_SQUARED.codes, 100)
    off = {
        model: np.abs(shade(Specular(REFLECTION_MODELS[model]), codes, 100).values - ideal).max()
        for model in (*SPECULAR_MODELS, "lyon3_refitted", "exp")
    }
    assert 50 * np.abs(shade(Power(), codes, 100).values - ideal).max() < min(off.values())


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match=r"^operand must be 'cosine' or 'one_minus_cosine', not 'sine'$"):
        Power("sine")
    with pytest.raises(ValueError, match=r"^operand must be SQ\(4, 34\), not SQ\(1, 17\)$"):
        Power().compute(Fixed(SQ(1, 17), [0]), [False], 10)
    for exponent in (0, 1001):
        with pytest.raises(ValueError, match=rf"^exponent must be 1 to 1000, not {exponent}$"):
            shade(Power(), [0], exponent)
