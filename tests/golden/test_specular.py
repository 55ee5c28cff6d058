"""Specular twin against float64: every argument up to the base's zero, every exponent, the second lobe."""

from fractions import Fraction

import numpy as np
import pytest

from golden.fixed import SQ, Fixed
from golden.reflection import reflect, slope
from golden.specular import MAX_EXPONENT, SPECULAR_MODELS, Specular
from golden.unit_vector import ONE_SQUARED

ARGUMENT = Specular.ARGUMENT_FORMAT
EVERY_EXPONENT = np.arange(1, MAX_EXPONENT + 1)
# One minus cosine has 26 bits; up to the base's zero at 1/k there are 2^18 of them or fewer from k = 128 on.
EXHAUSTIVE = (300, 500, 511, 512, 513, 777, 1000)


def shade(unit, codes, exponent, dark=False):
    codes = np.asarray(codes)
    return unit.compute(Fixed(unit.operand_format, codes), np.full(codes.shape, dark), exponent)


def exact(model, exponent, argument):
    """``max(1 - k (1 - c), 0)^2``, of one minus the cosine: nothing cancels near the peak."""
    return np.maximum(1 - slope(model, exponent) * argument, 0) ** 2


def cell_ends(unit, exponent):
    """The first and last argument of every value of the shifted word, up to past the base's zero.

    The result depends on the shifted word alone and the exact function falls with the argument, so that the
    errors of all arguments lie between those at the ends.
    """
    _, shift = unit.scale(np.int64(exponent))
    dropped = 9 - int(shift)
    last = min(int(2**25 / slope(unit.model, exponent)) + 1000, ARGUMENT.max_code)
    first = np.arange(0, last + 1, 1 << dropped)
    return np.r_[first, np.minimum(first + (1 << dropped) - 1, ARGUMENT.max_code)]


def check(unit, exponent, codes):
    """Largest error, and largest error of what is not cut off."""
    result = shade(unit, codes, exponent).values
    ideal = exact(unit.model, exponent, codes * 2.0**-25)
    error = np.abs(result - ideal)
    assert error.max() <= Specular.ERROR
    dropped = result == 0
    assert ideal[dropped].max(initial=0) <= Specular.CUTOFF**2
    # Nothing else is: past the base's reading error a brighter term shows.
    assert ideal[~dropped].min() > (Specular.CUTOFF - 2.0**-14) ** 2
    return error.max(), error[~dropped].max()


@pytest.mark.parametrize("model", SPECULAR_MODELS)
@pytest.mark.parametrize("exponent", EXHAUSTIVE)
def test_error_of_every_argument(model, exponent):
    """Measured: 6.1e-5, half of the bound, where it is cut off; 2.9e-5, a quarter of it, elsewhere."""
    unit = Specular(model, "one_minus_cosine")
    last = int(2**25 / slope(model, exponent)) + 100
    assert last < 2**18 + 100
    worst, lit = check(unit, exponent, np.arange(last))
    assert worst > Specular.ERROR / 4
    assert Specular.ERROR / 20 < lit < Specular.ERROR / 4


@pytest.mark.parametrize("model", SPECULAR_MODELS)
@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100, 255])
def test_error_of_every_shifted_argument(model, exponent):
    unit = Specular(model, "one_minus_cosine")
    _, lit = check(unit, exponent, cell_ends(unit, exponent))
    assert Specular.ERROR / 20 < lit < Specular.ERROR / 4


@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_error_and_monotony_at_every_exponent(model, operand):
    """Of a cosine of two unit vectors too: read in units of their length, it is off by no more."""
    unit = Specular(model, operand)
    worst = 0
    for exponent in EVERY_EXPONENT:
        rng = np.random.default_rng(exponent)
        k = slope(model, exponent)
        argument = np.r_[
            rng.uniform(0, min(1.3 / k, 1.99), 1200),
            rng.uniform(0, 0.02 / k, 200),
            (127 / 128 + rng.uniform(-1e-3, 1e-3, 200)) / k,
            rng.uniform(0, 1.99, 200),
        ]
        argument = np.sort(argument[argument < 1.99])
        if operand == "cosine":
            codes = np.floor(ONE_SQUARED.codes * (1 - argument)).astype(np.int64)
            argument = 1 - codes / ONE_SQUARED.codes
        else:
            codes = np.floor(argument * 2**25).astype(np.int64)
            argument = codes * 2.0**-25
        result = shade(unit, codes, exponent)
        ideal = exact(model, exponent, argument)
        worst = max(worst, np.abs(result.values - ideal).max())
        assert (np.diff(result.codes) <= 0).all()
        assert ideal[result.codes == 0].max(initial=0) <= Specular.CUTOFF**2
    assert Specular.ERROR / 20 < worst <= Specular.ERROR


@pytest.mark.long
@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_error_of_every_shifted_argument_at_every_exponent(model):
    unit = Specular(model, "one_minus_cosine")
    for exponent in EVERY_EXPONENT:
        codes = cell_ends(unit, exponent)
        check(unit, exponent, codes)
        assert (np.diff(shade(unit, np.sort(codes), exponent).codes) <= 0).all()


@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_slope(model):
    """The hardware's ``K 2^s`` against the model's k: at most the cut of the sum and of K, 2^-17 each."""
    unit = Specular(model)
    scale, shift = unit.scale(EVERY_EXPONENT)
    assert scale.codes.min() >= 2**16
    assert (shift >= -1).all()
    assert (shift <= 9).all()
    ours = scale.values * 2.0**shift
    ideal = np.array([slope(model, exponent) for exponent in EVERY_EXPONENT])
    # a n: a rounded to 2^-20; cut to 2^-18; b rounded to 2^-19; K cut, a relative 2^-16 of at least 1/2.
    bound = EVERY_EXPONENT * 2.0**-20 + 2.0**-18 + 2.0**-19 + ideal * 2.0**-16
    assert (np.abs(ours - ideal) <= bound).all()
    if model != "cosquad_lin":
        np.testing.assert_array_equal(ours, ideal)


@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_boundaries_are_the_last_arguments_over_the_cutoff(model):
    """Exact: the base at the boundary reaches 1/128, one step on it does not."""
    unit = Specular(model)
    scale, _ = unit.scale(EVERY_EXPONENT)
    for exponent, k in zip(EVERY_EXPONENT, scale.codes.tolist(), strict=True):
        boundary = int(unit.boundaries.codes[exponent])

        def base(shifted, k=k):
            return 1 - Fraction(1, 2**17) - Fraction(shifted * k >> 16, 2**17)

        assert base(boundary) >= Fraction(1, 128)
        assert base(boundary + 1) < Fraction(1, 128) or boundary == unit.SHIFTED_FORMAT.max_code


def test_second_lobe_stays_dark():
    """The parabola is 16 at n = 20, 60 degrees; nothing comes back up to the largest argument."""
    assert (20 / 2 * (np.cos(np.radians(60)) - 1) + 1) ** 2 == pytest.approx(16)
    cosine = Specular("cosquad", "cosine")
    code = np.rint(ONE_SQUARED.codes * 0.5).astype(np.int64)
    assert shade(cosine, code, 20).codes == 0
    assert reflect("cosquad", 0.5, 20) == 0
    everything = np.linspace(0, ARGUMENT.max_code, 20_001).astype(np.int64)
    for model in SPECULAR_MODELS:
        unit = Specular(model, "one_minus_cosine")
        for exponent in (2, 3, 10, 20, 100, 500, 1000):
            beyond = everything[everything * 2.0**-25 > 1 / slope(model, exponent)]
            assert len(beyond) > 0 or slope(model, exponent) < 1
            assert not shade(unit, beyond, exponent).codes.any()
    # Every code that a cosine can have, to those of no unit vector.
    ends = [cosine.operand_format.min_code, -ONE_SQUARED.codes.item(), -1, 0]
    assert not shade(cosine, ends, 4).codes.any()


@pytest.mark.parametrize("model", SPECULAR_MODELS)
@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100, 500, 1000])
def test_peak(model, exponent):
    """At the peak, and past it by rounding, the term is 1 to two steps."""
    one = ONE_SQUARED.codes.item()
    unit = Specular(model, "cosine")
    codes = [one, one + 1, one + 2**20, unit.operand_format.max_code]
    assert (shade(unit, codes, exponent).codes == 2**17 - 2).all()
    unit = Specular(model, "one_minus_cosine")
    assert shade(unit, [0], exponent).codes == [2**17 - 2]
    assert not shade(unit, [0, 1, 2], exponent, dark=True).codes.any()


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match=r"^the specular unit serves cosquad, .*, not 'phong'$"):
        Specular("phong")
    with pytest.raises(ValueError, match=r"^operand must be 'cosine' or 'one_minus_cosine', not 'sine'$"):
        Specular(operand="sine")
    with pytest.raises(ValueError, match=r"^operand must be SQ\(4, 34\), not SQ\(1, 17\)$"):
        Specular().compute(Fixed(SQ(1, 17), [0]), [False], 10)
    for exponent in (0, 1001, -1):
        with pytest.raises(ValueError, match=rf"^exponent must be 1 to 1000, not {exponent}$"):
            shade(Specular(), [0], exponent)
