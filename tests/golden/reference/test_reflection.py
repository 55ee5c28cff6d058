import math

import numpy as np
import pytest
from scipy.integrate import quad

from blysk.golden.reference.reflection import REFLECTION_MODELS, coscos_scale, exponent_ratio

from ...lists import LINE_MODELS

EXPONENTS = range(2, 1001)
# The models depend almost only on x = n (1 - c). Above x = 30 Blinn's power is below 1e-13 and the other
# models are 0. The largest error is at most half a step of 0.005 from a sample, and its second derivative is
# below 3. So the samples miss at most 1e-5 of the error.
X = np.linspace(0, 30, 6001)
# [C] does not define its "epicentre zone". From this brightness up, f2 has the 7.924 % that [C] prints. The
# rounded 0.594 gives 7.90 %.
ZONE = 0.59363


def errors(model):
    """Largest absolute error against Blinn's power, and largest relative error in the zone."""
    absolute, relative = 0.0, 0.0
    for n in EXPONENTS:
        cosine = np.append(1 - X[n >= X] / n, ZONE ** (1 / n))
        blinn = cosine**n
        error = np.abs(REFLECTION_MODELS[model].reflect(cosine, n) - blinn)
        absolute = max(absolute, error.max())
        zone = blinn >= ZONE - 1e-12
        relative = max(relative, (error[zone] / blinn[zone]).max())
    return absolute, relative


@pytest.mark.parametrize(
    ("model", "absolute", "relative"),
    [
        ("cosquad", 0.1616, 0.0792),
        ("cosquad7", 0.1208, 0.0759),
        ("cosquad_q", None, 0.0125),
        ("cosquad_lin", 0.1278, 0.01257),
        ("cosquad_lin_refitted", None, 0.0125),
        ("coscos2", 0.1135, 0.051),
        ("coscos4", 0.0638, 0.024),
    ],
)
def test_published_errors_against_blinn(model, absolute, relative):
    found_absolute, found_relative = errors(model)
    if absolute is not None:
        assert found_absolute == pytest.approx(absolute, abs=0.5e-4)
    # Half of the last digit shown.
    digit = {"cosquad_lin": 1e-5, "coscos2": 1e-3, "coscos4": 1e-3}.get(model, 1e-4)
    assert found_relative == pytest.approx(relative, abs=digit / 2)


@pytest.mark.parametrize(
    ("model", "shown"),
    [
        ("cosquad", (0.145, 0.158, 0.161)),
        ("cosquad_lin", (0.115, 0.125, 0.127)),
        ("lyon1_refitted", (0.062, 0.068, 0.070)),
        ("lyon2", (0.057, 0.070, 0.073)),
        ("lyon2_refitted", (0.025, 0.031, 0.033)),
        ("lyon3", (0.018, 0.031, 0.034)),
        ("lyon3_refitted", (0.008, 0.014, 0.016)),
        ("exp", (0.017, 0.004, 0.001)),
    ],
)
def test_errors_over_the_whole_range(model, shown):
    for n, error in zip((16, 64, 256), shown, strict=True):
        cosine = 1 - X[n >= X] / n
        assert np.abs(REFLECTION_MODELS[model].reflect(cosine, n) - cosine**n).max() == pytest.approx(
            error, abs=0.5e-3
        )


@pytest.mark.parametrize(("n", "shown"), [(16, "0.19"), (64, "0.20"), (256, "0.20")])
def test_schlick_is_no_better_than_the_parabola(n, shown):
    """A model of the literature that the project does not build: ``c / (n - n c + c)``."""
    cosine = 1 - np.linspace(0, min(n, 30), 6001) / n
    error = np.abs(cosine / (n - n * cosine + cosine) - cosine**n).max()
    assert f"{error:.2f}" == shown
    assert error > np.abs(REFLECTION_MODELS["cosquad"].reflect(cosine, n) - cosine**n).max()


def test_refitted_slopes_are_minimax():
    """No slope near has a largest error that is smaller by 2e-4.

    This is the cost of a line in n and of four digits.
    """
    for model, power, slack in (
        ("lyon1_refitted", 2, 2e-4),
        ("lyon2_refitted", 4, 2e-4),
        ("lyon3_refitted", 8, 2e-4),
    ):
        for n in (16, 64, 256, 1000):
            cosine = 1 - X[n >= X] / n
            fitted = REFLECTION_MODELS[model].slope(n)
            error = [
                np.abs(np.maximum(1 - k * (1 - cosine), 0) ** power - cosine**n).max()
                for k in fitted * np.linspace(0.9, 1.1, 201)
            ]
            assert error[100] <= min(error) + slack


def test_lyon_is_a_power_of_the_line_and_tends_to_the_exponential():
    cosine = np.linspace(-1, 1, 401)
    for n in (1, 7, 300):
        x = n * (1 - cosine)
        for j, model in ((1, "cosquad"), (2, "lyon2"), (3, "lyon3")):
            expected = [max(1 - value / 2**j, 0) ** (2**j) for value in x.tolist()]
            assert REFLECTION_MODELS[model].reflect(cosine, n) == pytest.approx(expected, abs=1e-14)
        assert REFLECTION_MODELS["exp"].reflect(cosine, n) == pytest.approx(np.exp(-x), rel=1e-13)


def test_coscos_scale():
    # Figures of [T] 3.1, and the closed form for k = 2.
    for n, a in ((5, 1.45021), (20, 2.75817), (100, 6.07915)):
        assert coscos_scale(n, 2, "integral") == pytest.approx(a, abs=0.5e-5)
    for n in (0.6, 1, 3, 10, 300, 1000):
        a = coscos_scale(n, 2, "integral")
        closed = (2 * a**2 * (1 - math.cos(math.pi / (2 * a))) - 1) / (4 * a**2 - 1)
        assert closed == pytest.approx(1 / (n + 1), rel=1e-9)
        for k in (2, 4):
            a = coscos_scale(n, k, "integral")
            lobe = quad(lambda g, a=a, k=k: math.cos(a * g) ** k * math.sin(g), 0, math.pi / (2 * a))[0]
            assert lobe == pytest.approx(1 / (n + 1), rel=1e-9)
            assert coscos_scale(n, k) == pytest.approx(math.sqrt(n / k))


def test_coscos_models():
    gamma = np.linspace(0, math.pi, 1001)
    for model, k, rule in (
        ("coscos2", 2, "taylor"),
        ("coscos4", 4, "taylor"),
        ("coscos2_integral", 2, "integral"),
        ("coscos4_integral", 4, "integral"),
    ):
        for n in (1, 10, 1000):
            angle = coscos_scale(n, k, rule) * gamma
            expected = [math.cos(value) ** k if value < math.pi / 2 else 0.0 for value in angle.tolist()]
            # The cosine of an angle near 0 gives the angle only to 1e-8.
            assert REFLECTION_MODELS[model].reflect(np.cos(gamma), n) == pytest.approx(
                expected, abs=1e-12 * n
            )
    # Equal integrals spread the error: the largest error is smaller, and the error near the peak larger.
    for n in (20, 1000):
        cosine = 1 - X[n >= X] / n
        for k in (2, 4):
            taylor, integral = (
                np.abs(REFLECTION_MODELS[f"coscos{k}{way}"].reflect(cosine, n) - cosine**n).max()
                for way in ("", "_integral")
            )
            assert integral < 0.75 * taylor


def test_energy_factors():
    for n in (1, 2, 10, 100, 1000):
        for model, angle in (("phong", lambda t: t), ("blinn", lambda t: t / 2)):
            reflected = quad(
                lambda t, n=n, angle=angle: math.cos(angle(t)) ** n * math.cos(t) * math.sin(t),
                0,
                math.pi / 2,
                epsabs=1e-12,
                points=[0.1, 0.3],
            )[0]
            assert REFLECTION_MODELS[model].energy_factor(n) * 2 * math.pi * reflected == pytest.approx(
                1, abs=1e-8
            )


def test_energy_factor_of_the_line():
    def reflectance(n):
        # The line is cut where it meets 0.
        zero = max(1 - 1 / REFLECTION_MODELS["cosquad_lin"].slope(n), 0.0)
        return (
            2
            * math.pi
            * quad(lambda c: float(REFLECTION_MODELS["cosquad_lin"].reflect(c, n)) * c, zero, 1)[0]
        )

    for n, shown in ((2, 0.6345), (3, 0.8334), (4, 1.0404), (5, 1.2504), (10, 2.3126)):
        assert 1 / reflectance(n) == pytest.approx(shown, abs=0.5e-4)
    deviation = np.array(
        [REFLECTION_MODELS["cosquad_lin"].energy_factor(n) * reflectance(n) - 1 for n in EXPONENTS]
    )
    assert np.abs(deviation).max() == pytest.approx(0.0533, abs=0.5e-4)
    assert np.abs(deviation).argmax() == 0


@pytest.mark.parametrize(("line", "error"), [((0.448, 0.099), 0.0050), ((0.44813, 0.10235), 0.0014)])
def test_linear_fit_of_the_slope(line, error):
    n = np.array(EXPONENTS)
    exact = np.array([REFLECTION_MODELS["cosquad_q"].slope(value) for value in n])
    found = np.abs((line[0] * n + line[1]) / exact - 1).max()
    assert found == pytest.approx(error, abs=0.5e-4)
    model = "cosquad_lin" if line == (0.448, 0.099) else "cosquad_lin_refitted"
    assert [REFLECTION_MODELS[model].slope(value) for value in n] == pytest.approx(
        line[0] * n + line[1], rel=1e-15
    )


def test_slopes():
    assert REFLECTION_MODELS["cosquad"].slope(20) == 10
    assert REFLECTION_MODELS["cosquad7"].slope(16) == 7
    # fQ meets Blinn's power where this is Q = 0.64: at c = 0.64^(1/n).
    for n in (1, 10, 1000):
        assert REFLECTION_MODELS["cosquad_q"].reflect(0.64 ** (1 / n), n) == pytest.approx(0.64, rel=1e-9)


def test_stiff_exponents():
    """At exponents 1 to 1000 models are within 0 and 1, fall with the angle, and are 1 at the peak.

    So the second lobe is cut off.
    """
    # The parabola (n/2 (c - 1) + 1)^2 is 16 again at n = 20, gamma = 60 degrees.
    assert (20 / 2 * (math.cos(math.pi / 3) - 1) + 1) ** 2 == pytest.approx(16)
    cosine = np.linspace(1, -1, 4001)
    for model in REFLECTION_MODELS:
        for n in (1, 2, 3, 10, 20, 100, 500, 1000):
            value = REFLECTION_MODELS[model].reflect(cosine, n)
            assert value[0] == 1
            assert (np.diff(value) <= 0).all()
            assert value[-1] >= 0
            # Only exp has no zero: it is exp(-10) at 60 degrees.
            assert n != 20 or (value[cosine <= 0.5] < (4.6e-5 if model == "exp" else 1e-6)).all()


def test_stiff_normals_of_wrong_length():
    """Cosines above 1 count as 1.

    A normal of length 0 counts as at a right angle, and a normal of NaN stays NaN.
    """
    for model in REFLECTION_MODELS:
        assert REFLECTION_MODELS[model].reflect(1 + 1 / 256, 1000) == 1
        assert REFLECTION_MODELS[model].reflect(0.0, 1000) == pytest.approx(0, abs=1e-300)
        assert np.isnan(REFLECTION_MODELS[model].reflect(np.nan, 10))


def test_phong_and_blinn_are_powers():
    cosine = np.random.default_rng(1).uniform(-1, 1, 100)
    expected = [max(c, 0.0) ** 37 for c in cosine.tolist()]
    assert REFLECTION_MODELS["blinn"].reflect(cosine, 37) == pytest.approx(expected, rel=1e-13)
    assert (
        REFLECTION_MODELS["phong"].reflect(cosine, 37) == REFLECTION_MODELS["blinn"].reflect(cosine, 37)
    ).all()


def test_exponent_ratio():
    assert exponent_ratio(1.0) == 4
    assert exponent_ratio(math.cos(1e-6)) == pytest.approx(4, abs=1e-9)
    # With n = ratio p both models agree at the angle, because Phong's angle is twice Blinn's.
    for gamma in (1e-3, 0.05, 0.2, 0.3, 0.5, 0.7):
        ratio = exponent_ratio(math.cos(gamma))
        assert math.cos(gamma) ** (12 * ratio) == pytest.approx(math.cos(2 * gamma) ** 12, rel=1e-12)
    with pytest.raises(ValueError, match=r"cosine must be greater than 1/sqrt\(2\) and at most 1"):
        exponent_ratio(np.array([0.9, 0.7]))


def test_refusals():
    with pytest.raises(ValueError, match=r"model must be one of .*blinn.*, not cosquad$"):
        REFLECTION_MODELS["cosquad"].energy_factor(10)
    with pytest.raises(ValueError, match="power must be 2 or 4, not 3"):
        coscos_scale(10, 3)
    with pytest.raises(ValueError, match="rule must be 'taylor' or 'integral', not 'simpson'"):
        coscos_scale(10, 2, "simpson")
    with pytest.raises(ValueError, match=r"equal integrals with power 4 need .* at least 0\.5, not 0\.4"):
        REFLECTION_MODELS["coscos4_integral"].reflect(1.0, 0.4)
    assert set(LINE_MODELS) < set(REFLECTION_MODELS)
    for exponent in (0, -1, math.nan, math.inf):
        with pytest.raises(ValueError, match="exponent must be finite and greater than 0"):
            REFLECTION_MODELS["blinn"].reflect(1.0, exponent)
