"""Model of the specular unit against float64: every model and exponent, and every argument of some."""

import math
from fractions import Fraction

import numpy as np
import pytest

from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import MAX_EXPONENT, Chords, Specular
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.unit_vector import ONE, ONE_SQUARED, quantise
from blysk.golden.reference.reflection import REFLECTION_MODELS, PolynomialModel, coscos_scale

from ...lists import COSCOS_MODELS, FURTHER_MODELS, LINE_MODELS, SPECULAR_MODELS

ARGUMENT = Specular.ARGUMENT_FORMAT
MODELS = SPECULAR_MODELS + FURTHER_MODELS
EVERY_EXPONENT = np.arange(1, MAX_EXPONENT + 1)
EXPONENTS = (1, 2, 3, 10, 100, 500, 1000)
QUICK = [n if n in (1, 1000) else pytest.param(n, marks=pytest.mark.long) for n in EXPONENTS]
# One minus cosine has 26 bits. From k = 128 on, at most 2^18 codes lie before the base's zero at 1/k.
EXHAUSTIVE = (300, 500, 511, 512, 513, 777, 1000)
# Largest error measured at every exponent, by the number of squarings. 6.1e-5 is the error of the cutoff.
MEASURED = {1: 6.2e-5, 2: 6.2e-5, 3: 1.3e-4, 0: 1.8e-4}
MEASURED_OF_COSCOS = {1: 8.4e-5, 2: 1.7e-4}


def shade(unit, codes, exponent, dark=False):
    codes = np.asarray(codes)
    return unit.compute(Fixed(unit.operand_format, codes), np.full(codes.shape, dark), exponent)


def exact(model, exponent, argument):
    """``max(1 - k (1 - c), 0)^2``, computed from one minus the cosine, so no digits cancel near the peak."""
    return np.maximum(1 - model.slope(exponent) * argument, 0) ** 2


def zero(unit, exponent):
    """The argument at which the unit's cutoff lies, nearly."""
    if unit.name == "exp":
        return 14 * np.log(2) / exponent
    if unit.is_coscos:
        half = np.pi / 2 / coscos_scale(exponent, *COSCOS_MODELS[unit.name])
        return 1 - np.cos(min(half, np.pi))
    return (1 - unit.cutoff.values.item()) / unit.reflection.slope(exponent)


def cell_ends(unit, exponent):
    """The first and the last argument of every value that the unit reads, up to just past the base's zero.

    The result depends on the shifted word alone; for ``coscos`` also on the argument without its last 8 bits.
    The exact function falls as the argument rises. So the errors of all arguments lie between the errors at
    these ends.
    """
    _, shift = unit.scale(np.int64(exponent))
    dropped = min(9 - int(shift), 8 if unit.is_coscos else 10)
    last = min(int(2**25 * zero(unit, exponent) * 1.01) + 1000, ARGUMENT.max_code)
    first = np.arange(0, last + 1, 1 << dropped)
    return np.c_[first, np.minimum(first + (1 << dropped) - 1, ARGUMENT.max_code)].ravel()


def check(unit, exponent, codes):
    """Largest error, and largest error of the terms that are not cut off."""
    result = shade(unit, codes, exponent).values
    ideal = exact(unit.reflection, exponent, codes * 2.0**-25)
    error = np.abs(result - ideal)
    assert error.max() <= Specular.ERROR
    dropped = result == 0
    assert ideal[dropped].max(initial=0) <= Specular.CUTOFF**2
    # No other term is cut off: beyond the reading error of the base a brighter term shows.
    assert ideal[~dropped].min() > (Specular.CUTOFF - 2.0**-14) ** 2
    return error.max(), error[~dropped].max()


@pytest.mark.parametrize("model", SPECULAR_MODELS)
@pytest.mark.parametrize("exponent", EXHAUSTIVE)
def test_error_of_every_argument(model, exponent):
    """Measured: 6.1e-5, half of the bound, where the term is cut off; 2.9e-5, a quarter of the bound,
    elsewhere."""
    unit = Specular(REFLECTION_MODELS[model], "one_minus_cosine")
    last = int(2**25 / REFLECTION_MODELS[model].slope(exponent)) + 100
    assert last < 2**18 + 100
    worst, lit = check(unit, exponent, np.arange(last))
    assert worst > Specular.ERROR / 4
    assert Specular.ERROR / 20 < lit < Specular.ERROR / 4


@pytest.mark.parametrize("model", FURTHER_MODELS)
def test_every_argument_of_a_narrow_highlight(model):
    unit = Specular(REFLECTION_MODELS[model], "one_minus_cosine")
    for exponent in (997, 1000):
        codes = np.arange(int(1.1 * zero(unit, exponent) * 2**25))
        error = np.abs(
            shade(unit, codes, exponent).values
            - REFLECTION_MODELS[model].reflect(1 - codes * 2.0**-25, exponent)
        )
        assert unit.error / 10 < error.max() <= unit.error


@pytest.mark.parametrize("model", COSCOS_MODELS)
@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100])
def test_error_of_every_argument_of_a_wide_highlight(model, exponent):
    unit = Specular(REFLECTION_MODELS[model], "one_minus_cosine")
    codes = cell_ends(unit, exponent)
    result = shade(unit, codes, exponent)
    ideal = REFLECTION_MODELS[model].reflect(1 - codes * 2.0**-25, exponent)
    assert np.abs(result.values - ideal).max() <= unit.error
    assert (np.diff(result.codes) <= 0).all()
    # The base is read too small by a chord's 8.5e-6 and a cut of 2^-17, and is dropped there.
    assert ideal[result.codes == 0].max() <= (unit.cutoff.values + 2.0**-15) ** COSCOS_MODELS[model][0]


@pytest.mark.parametrize(
    ("operand", "step"),
    [("cosine", 21), ("one_minus_cosine", 39), pytest.param("cosine", 1, marks=pytest.mark.long)],
)
@pytest.mark.parametrize("model", MODELS)
def test_error_and_monotony_at_every_exponent(model, operand, step):
    """For a cosine of two unit vectors, read in units of their length, the error is not larger."""
    unit = Specular(REFLECTION_MODELS[model], operand)
    worst = 0
    for exponent in EVERY_EXPONENT[::step]:
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
        ideal = REFLECTION_MODELS[model].reflect(1 - argument, exponent)
        worst = max(worst, np.abs(result.values - ideal).max())
        assert (np.diff(result.codes) <= 0).all()
        # A dropped term is under 2^-14, except for the error with which the argument is read.
        assert ideal[result.codes == 0].max(initial=0) <= 2.0**-14 * 1.001
    measured = (MEASURED_OF_COSCOS if unit.is_coscos else MEASURED)[unit.squarings]
    assert unit.error / 10 < worst <= min(unit.error, measured)


@pytest.mark.parametrize("model", COSCOS_MODELS)
def test_first_order_bound_of_coscos(model):
    """The sum of docs/theory/bounds.md#specular-terms, up to x = 1.7: every cut, times the slope of the term
    in w."""
    unit, (power, rule) = Specular(REFLECTION_MODELS[model]), COSCOS_MODELS[model]
    worst = 0
    for exponent in (*range(1, 33), *range(33, 1001, 31), 1000):
        a = coscos_scale(exponent, power, rule)
        ideal = 8 * (a / math.pi) ** 2
        code = unit.slopes.codes[exponent] * 2.0**-18
        k = code / 2.0 ** int(unit.scale(np.int64(exponent))[1])
        gamma = np.linspace(1e-6, min(math.pi / 2 / a, math.acos(-0.7)), 3000)
        x = 1 - np.cos(gamma)
        e = gamma**2 / (2 * x) - 1
        p, w = ideal * x, (2 * a * gamma / math.pi) ** 2
        cuts = (2.0**-16 * k + 2.0**-17) * (1 + e) + 2.0**-17 * w / k + 2.0**-16 * p + 2.0**-17
        cuts += abs(code / ideal - 1) * w
        base, falls = np.cos(a * gamma), np.sin(a * gamma) / np.sqrt(w) * math.pi / 4
        found = power * base ** (power - 1) * (falls * cuts + 1.11e-5)
        worst = max(worst, found.max())
    assert worst == pytest.approx(9.8e-5 * power / 2, rel=0.03)
    assert worst < unit.error


@pytest.mark.parametrize("model", COSCOS_MODELS)
def test_boundaries_of_coscos(model):
    """At the last lit argument, and one step of the shifted word further, the cosine is the cutoff to 2^-14.

    The base is read too high by at most 4.3e-5 there, the sum of docs/theory/bounds.md#specular-terms with a
    slope of pi/4. A step is up to 1.2e-5 of it. The lobe of n = 1 is left out, because the chords of e fail
    there.
    """
    unit, exponents = Specular(REFLECTION_MODELS[model]), EVERY_EXPONENT[1:]
    scale = np.array([coscos_scale(n, *COSCOS_MODELS[model]) for n in exponents.tolist()])
    _, shift = unit.scale(exponents)
    for step in (0, 1):
        boundary = unit.boundaries.codes[exponents] + step
        argument = (((boundary + 1) << 10) - 1 >> (shift + 1)) * 2.0**-25
        base = np.cos(scale * np.arccos(1 - argument))
        assert np.abs(base - unit.cutoff.values).max() <= 2.0**-14


def test_curves_of_coscos():
    """Both tables are compared with their functions at every code."""
    unit = Specular(REFLECTION_MODELS["coscos2"])
    w = np.arange(2**17)
    error = unit.chords.compute(w).values - np.cos(np.pi / 2 * np.sqrt(w * 2.0**-17))
    assert 0.9e-5 < error.max() <= 1.11e-5
    assert error.min() > -1e-5
    x = np.arange(2**18) * 2.0**-17
    e = np.r_[0, np.arccos(1 - x[1:]) ** 2 / (2 * x[1:]) - 1]
    error = unit.excess.compute(np.arange(2**18)).values - e
    assert error.min() > -6e-6
    for end, bound in ((1, 1.1e-5), (1.7, 8e-5)):
        assert bound / 2 < error[x <= end].max() <= bound


def test_slopes_of_coscos():
    """By Taylor's rule the slope is a line, by equal integrals a table."""
    for model, (power, rule) in COSCOS_MODELS.items():
        unit = Specular(REFLECTION_MODELS[model])
        assert (unit.slope_terms is None) == (rule == "integral")
        ideal = [8 * (coscos_scale(n, power, rule) / np.pi) ** 2 for n in EVERY_EXPONENT.tolist()]
        # As in test_slope: a n + b is off by n 2^-20 and 2^-18, and a table by 2^-19.
        bound = 2.0**-19 if rule == "integral" else EVERY_EXPONENT * 2.0**-20 + 2.0**-18
        assert (np.abs(unit.slopes.values[1:1001] - ideal) <= bound).all()


@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_slope(model):
    """The hardware's ``K 2^s`` differs from the model's k by at most the cuts of the sum and of K, 2^-17
    each."""
    unit = Specular(REFLECTION_MODELS[model])
    scale, shift = unit.scale(EVERY_EXPONENT)
    assert scale.codes.min() >= 2**16
    assert (shift >= -1).all()
    assert (shift <= 9).all()
    ours = scale.values * 2.0**shift
    ideal = np.array([REFLECTION_MODELS[model].slope(exponent) for exponent in EVERY_EXPONENT])
    # For a n: a is rounded to 2^-20, the product is cut to 2^-18, b is rounded to 2^-19. K is cut, a relative
    # 2^-16 of at least 1/2.
    bound = EVERY_EXPONENT * 2.0**-20 + 2.0**-18 + 2.0**-19 + ideal * 2.0**-16
    assert (np.abs(ours - ideal) <= bound).all()
    if model != "cosquad_lin":
        np.testing.assert_array_equal(ours, ideal)


@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_boundaries_are_the_last_arguments_over_the_cutoff(model):
    """The boundary is exact: there the base reaches 1/128, and one step beyond it does not."""
    unit = Specular(REFLECTION_MODELS[model])
    scale, _ = unit.scale(EVERY_EXPONENT)
    for exponent, k in zip(EVERY_EXPONENT, scale.codes.tolist(), strict=True):
        boundary = int(unit.boundaries.codes[exponent])

        def base(shifted, k=k):
            return 1 - Fraction(1, 2**17) - Fraction(shifted * k >> 16, 2**17)

        assert base(boundary) >= Fraction(1, 128)
        assert base(boundary + 1) < Fraction(1, 128) or boundary == unit.SHIFTED_FORMAT.max_code


def test_second_lobe_stays_dark():
    """The parabola is 16 at n = 20 and 60 degrees. No light comes back up to the largest argument."""
    cosine = Specular(REFLECTION_MODELS["cosquad"], "cosine")
    code = np.rint(ONE_SQUARED.codes * 0.5).astype(np.int64)
    assert shade(cosine, code, 20).codes == 0
    everything = np.linspace(0, ARGUMENT.max_code, 20_001).astype(np.int64)
    for model in SPECULAR_MODELS:
        unit = Specular(REFLECTION_MODELS[model], "one_minus_cosine")
        for exponent in (2, 3, 10, 20, 100, 500, 1000):
            beyond = everything[everything * 2.0**-25 > 1 / REFLECTION_MODELS[model].slope(exponent)]
            assert len(beyond) > 0 or REFLECTION_MODELS[model].slope(exponent) < 1
            assert not shade(unit, beyond, exponent).codes.any()
    # Every code that a cosine can have is tried, also codes of vectors that are no unit vectors.
    ends = [cosine.operand_format.min_code, -ONE_SQUARED.codes.item(), -1, 0]
    assert not shade(cosine, ends, 4).codes.any()


def test_published_comparator_lets_the_second_lobe_through():
    """At n = 20 and 60 degrees the square is 16.

    It saturates, and the surface is as bright as at the peak.
    """
    published, gated = (Specular(as_published=as_published) for as_published in (True, False))
    code = np.rint(ONE_SQUARED.codes * 0.5).astype(np.int64)
    assert shade(published, code, 20).codes == 2**17 - 2
    assert (shade(published, np.arange(-ONE_SQUARED.codes, code, 2**20), 20).codes == 2**17 - 2).all()
    assert shade(published, ONE_SQUARED.codes, 20).codes == 2**17 - 2
    assert shade(gated, code, 20).codes == 0
    # Where the base passes -1: 36.87 degrees, cos = 0.8.
    for degrees, bright in ((36, False), (37, True)):
        code = np.rint(ONE_SQUARED.codes * np.cos(np.radians(degrees))).astype(np.int64)
        assert (shade(published, code, 20).codes == 2**17 - 2) == bright
    # Dark beats are dark in both forms.
    assert shade(published, code, 20, dark=True).codes == 0


@pytest.mark.parametrize("model", SPECULAR_MODELS)
def test_published_comparator(model):
    """Up to the base's zero the published form equals the default to the bit.

    Beyond it is the published parabola, limited to 1.
    """
    published, gated = (
        Specular(REFLECTION_MODELS[model], "one_minus_cosine", published) for published in (True, False)
    )
    for exponent in EXPONENTS:
        k = REFLECTION_MODELS[model].slope(exponent)
        argument = np.r_[np.linspace(0, min(3 / k, 2), 20_000), np.linspace(0, 2, 20_000)]
        codes = np.minimum((argument * 2**25).astype(np.int64), ARGUMENT.max_code)
        base = 1 - k * codes * 2.0**-25
        result = shade(published, codes, exponent)
        assert np.abs(result.values - np.minimum(base * base, 1)).max() <= Specular.ERROR
        first = base > 0
        np.testing.assert_array_equal(result.codes[first], shade(gated, codes, exponent).codes[first])
        assert (result.codes[base <= -1] >= 2**17 - 4).all()
        assert (base <= -1).any() == (2 * k > 2)


def unit_of(model, operand="cosine"):
    """Model of a unit of highlights, and the bound of its error for a cosine of codes."""
    if model == "blinn":
        return Power(operand), Power.ERROR + 2.0**-16
    unit = Specular(REFLECTION_MODELS[model], operand)
    return unit, unit.error


@pytest.mark.parametrize("exponent", QUICK)
@pytest.mark.parametrize("model", [*MODELS, "blinn"])
def test_stiff_exponents(model, exponent):
    """The bound holds over the whole half sphere.

    At the peak, and past it by rounding, terms are 1 to nine steps.
    """
    unit, bound = unit_of(model)
    one = ONE_SQUARED.codes.item()
    codes = np.unique(np.r_[np.linspace(0, one, 5000), one - np.geomspace(1, one, 5000)].astype(np.int64))
    ideal = REFLECTION_MODELS[model].reflect(codes / one, exponent)
    assert np.abs(shade(unit, codes, exponent).values - ideal).max() <= bound
    peak = shade(unit, [one, one + 1, one + 2**20, unit.operand_format.max_code], exponent)
    assert (peak.codes >= 2**17 - (2 if model in SPECULAR_MODELS else 9)).all()
    assert len(set(peak.codes.tolist())) == 1
    assert shade(unit_of(model, "one_minus_cosine")[0], [0], exponent).codes == peak.codes[0]


@pytest.mark.parametrize("exponent", QUICK)
@pytest.mark.parametrize("model", [*MODELS, "blinn"])
def test_stiff_largest_and_smallest_codes(model, exponent):
    """The far side of the sphere, and codes of no unit vector, give the terms of N·H = -1 and of 1."""
    unit, bound = unit_of(model)
    one, format = ONE_SQUARED.codes.item(), unit.operand_format
    ends = shade(unit, [-one, format.min_code], exponent)
    assert ends.values == pytest.approx(REFLECTION_MODELS[model].reflect([-1.0, -1.0], exponent), abs=bound)
    assert shade(unit, format.max_code, exponent).codes == shade(unit, one, exponent).codes
    argument = unit_of(model, "one_minus_cosine")[0]
    last = shade(argument, ARGUMENT.max_code, exponent)
    assert last.values == pytest.approx(REFLECTION_MODELS[model].reflect(-1.0, exponent), abs=bound)
    # A light behind the surface, or at the terminator with N·L = 0, gives nothing, whatever the cosine.
    codes = [format.min_code, -one, 0, one, format.max_code]
    assert not shade(unit, codes, exponent, dark=True).codes.any()


@pytest.mark.parametrize("model", [*MODELS, "blinn"])
def test_stiff_normals_of_wrong_length(model):
    """With N of length 1 +- 1/256 or 0, or without H, the term is that of the product, at most 1, without
    another error.

    At n = 1000 a normal that is 1/256 too short has no highlight left: ``cosquad`` gives 0, Blinn's power
    0.02.
    """
    unit, bound = unit_of(model)
    rng = np.random.default_rng(5)
    normal = rng.normal(size=(400, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    halfway = quantise(normal)
    for length in (0, 1 - 1 / 256, 1 + 1 / 256):
        codes = np.clip(np.rint(normal * length * ONE), -ONE - 1, ONE).astype(np.int64)
        product = np.einsum("ij,ij->i", codes, halfway)
        for exponent in EXPONENTS:
            found = shade(unit, product, exponent).values
            assert found == pytest.approx(
                REFLECTION_MODELS[model].reflect(product / ONE**2, exponent), abs=bound
            )
            if length > 1:
                assert (found >= 1 - 9 * 2.0**-17).all()
    short = shade(unit, np.rint(ONE_SQUARED.codes * (1 - 1 / 256)).astype(np.int64), 1000).values
    assert short <= 0.06


@pytest.mark.parametrize("model", [*MODELS, "blinn"])
def test_stiff_peak_on_and_between_pixels(model):
    """With pixels 1 degree apart, and the peak on a pixel or half-way, terms are symmetric, largest in the
    middle, and exact.

    From n = 1000 on, the documents' highlights are 2.6 degrees across, three or four pixels. With pixels 20
    degrees apart a highlight is narrower than a pixel: only a pixel at the peak is lit, and none if the peak
    is between two.
    """
    unit, bound = unit_of(model)
    for pitch in (1.0, 20.0):
        for offset in (0.0, 0.5):
            angle = np.radians(pitch * (np.arange(-9, 10 - 2 * offset) + offset))
            codes = np.rint(ONE_SQUARED.codes * np.cos(angle)).astype(np.int64)
            for exponent in EXPONENTS:
                found = shade(unit, codes, exponent)
                np.testing.assert_array_equal(found.codes, found.codes[::-1])
                middle = len(codes) // 2
                assert found.codes.max() == found.codes[middle]
                ideal = REFLECTION_MODELS[model].reflect(np.cos(angle), exponent)
                assert np.abs(found.values - ideal).max() <= bound + 2.0**-17
            # The figures of the last exponent, 1000.
            assert found.codes.any() == (pitch == 1 or not offset)


def test_chords_meet():
    """From one chord to the next there is no step of more than half a code.

    The last chord ends where the curve does.
    """
    unit = Specular(REFLECTION_MODELS["exp"])
    start, step = unit.chords.start, unit.chords.step
    assert start.codes - step.codes == pytest.approx(np.r_[start.codes[1:], start.codes[0] / 2], abs=0.5)
    for curve in (
        unit.chords,
        Specular(REFLECTION_MODELS["coscos4"]).chords,
        Specular(REFLECTION_MODELS["coscos4"]).excess,
    ):
        found = curve.compute(np.arange(len(curve.start.codes) << 11)).codes
        assert (np.diff(found) * (1 if curve.rising else -1) >= 0).all()
    line = Chords.of(np.linspace(0, 1, 5) * 0.75, UQ(0, 12), UQ(0, 12))
    assert line.rising
    np.testing.assert_array_equal(line.compute(np.arange(8192)).codes, np.arange(8192) * 3072 >> 13)


def test_models_are_reflection_models():
    assert not set(FURTHER_MODELS) & set(SPECULAR_MODELS)
    assert {*LINE_MODELS, *COSCOS_MODELS, "exp"} <= set(MODELS)
    assert set(FURTHER_MODELS) < set(REFLECTION_MODELS)


def test_table_of_slopes():
    ours = Specular(REFLECTION_MODELS["cosquad_q"]).slopes.values[1:1001]
    ideal = [REFLECTION_MODELS["cosquad_q"].slope(exponent) for exponent in EVERY_EXPONENT]
    assert np.abs(ours - ideal).max() <= 2.0**-19


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match=r"^the specular unit does not serve phong$"):
        Specular(REFLECTION_MODELS["phong"])
    with pytest.raises(
        ValueError, match=r"^as_published is of polynomials that are squared once, not of exp$"
    ):
        Specular(REFLECTION_MODELS["exp"], as_published=True)
    with pytest.raises(ValueError, match=r"^operand must be 'cosine' or 'one_minus_cosine', not 'sine'$"):
        Specular(operand="sine")
    # Earlier, each of these wrapped, or ended in an error without a name.
    for options, message in (
        ({"a": 1.5}, r"a must be from 0 to 0\.999998, not 1\.5"),
        ({"a": 0.4, "b": -0.1}, r"b must be from 0 to 0\.999996, not -0\.1"),
        ({"a": 0.75}, r"slope at exponent 1023 must be from 0 to 511\.999996, not 767\.25"),
        ({"a": 0.25, "squarings": 4}, r"squarings must be 1, 2 or 3, not 4"),
        ({"a": 0.25, "squarings": 0}, r"squarings must be 1, 2 or 3, not 0"),
    ):
        with pytest.raises(ValueError, match=rf"^own: {message}$"):
            Specular(PolynomialModel("own", **options))
    with pytest.raises(ValueError, match=r"^operand must be SQ\(4, 34\), not SQ\(1, 17\)$"):
        Specular().compute(Fixed(SQ(1, 17), [0]), [False], 10)
    for exponent in (0, 1001, -1):
        with pytest.raises(ValueError, match=rf"^exponent must be 1 to 1000, not {exponent}$"):
            shade(Specular(), [0], exponent)
