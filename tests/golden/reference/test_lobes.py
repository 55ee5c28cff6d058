"""Lobes of a table against their definitions: slopes of microfacets, integrals, the mirror direction."""

import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lobes import (
    BECKMANN,
    COPLANAR_PHONG,
    GGX,
    STEEPEST,
    TABLE_MODELS,
    TabulatedModel,
    exponent_of_roughness,
    roughness_of_exponent,
)
from blysk.golden.reference.reflection import BLINN, PHONG

ROUGHNESS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.85, 0.9, 0.99, 0.999, 1.0)

# A rough surface with slopes (x, y). The function gives the density at the slope r = tan gamma from 0, for a
# width alpha.
SLOPES = {
    "beckmann": lambda r, alpha: math.exp(-((r / alpha) ** 2)) / (math.pi * alpha**2),
    "ggx": lambda r, alpha: 1 / (math.pi * alpha**2 * (1 + (r / alpha) ** 2) ** 2),
}


def density(model, gamma, roughness):
    return model.peak(roughness) * float(model.reflect(math.cos(gamma), roughness))


def integral(function, alpha, end=math.pi / 2):
    """Integral from 0 to a right angle, in parts that are short where the lobe is steep."""
    ends = sorted({0.0, end, *(min(end, alpha * 4.0**k) for k in range(-3, 8))})
    return sum(quad(function, a, b, epsabs=0, epsrel=1e-11, limit=200)[0] for a, b in pairwise(ends))


@pytest.mark.parametrize("roughness", ROUGHNESS)
@pytest.mark.parametrize("model", [BECKMANN, GGX], ids=lambda model: model.name)
def test_microfacets_are_those_of_a_surface_with_such_slopes(model, roughness):
    """``D = P(tan gamma) / cos^4 gamma`` for the slopes of a height field, whose area projects to 1."""
    alpha = roughness**2
    for gamma in (*np.linspace(0, 1.56, 40), *(alpha * np.linspace(0.1, 5, 20) % 1.5)):
        expected = SLOPES[model.name](math.tan(gamma), alpha) / math.cos(gamma) ** 4
        assert density(model, gamma, roughness) == pytest.approx(expected, rel=1e-9, abs=1e-280)
    projected = integral(
        lambda g: 2 * math.pi * density(model, g, roughness) * math.cos(g) * math.sin(g), alpha
    )
    assert projected == pytest.approx(1, rel=1e-8)


@pytest.mark.parametrize("roughness", [0.1, 0.5, 0.9, 1.0])
def test_microfacets_are_those_that_the_sampling_rules_draw(roughness):
    """Walter 2007 has ``tan^2 = -alpha^2 ln(1 - x)`` and ``tan^2 = alpha^2 x / (1 - x)`` for uniform x."""
    alpha = roughness**2
    rules = {
        BECKMANN: lambda x: -(alpha**2) * math.log1p(-x),
        GGX: lambda x: alpha**2 * x / (1 - x),
    }
    for model, rule in rules.items():
        for share in (0.1, 0.5, 0.9):
            end = math.atan(math.sqrt(rule(share)))
            drawn = integral(
                lambda g, model=model: 2 * math.pi * density(model, g, roughness) * math.cos(g) * math.sin(g),
                alpha,
                end,
            )
            assert drawn == pytest.approx(share, rel=1e-8)


@pytest.mark.parametrize("roughness", ROUGHNESS)
@pytest.mark.parametrize("model", [BECKMANN, GGX], ids=lambda model: model.name)
def test_largest_value_is_one(model, roughness):
    cosine = np.r_[np.linspace(0, 1, 200_001), 1 - np.geomspace(1e-12, 0.1, 10_000)]
    value = model.reflect(cosine, roughness)
    assert value.min() >= 0
    assert 1 - 1e-8 <= value.max() <= 1 + 1e-12
    inside = model is BECKMANN and roughness**2 > math.sqrt(0.5)
    assert (model.reflect(1.0, roughness) < 0.999) == inside
    if not inside:
        assert model.reflect(1.0, roughness) == pytest.approx(1, rel=1e-12)
        order = np.argsort(cosine)
        assert (np.diff(value[order]) >= -1e-15).all()
    assert not model.reflect([0.0, -1e-9, -0.5, -1.0], roughness).any()


def test_beckmann_of_a_large_alpha():
    """At alpha = 1 the largest value is 4/e times the value at the peak of a narrow lobe."""
    assert BECKMANN.reflect(1.0, 1.0) == pytest.approx(math.e / 4)
    assert BECKMANN.reflect(math.sqrt(0.5), 1.0) == pytest.approx(1)


@pytest.mark.parametrize("alpha", [0.0025, 0.01, 0.1, 0.6, 1])
def test_formula_of_ggx_in_one_minus_cosine(alpha):
    u = np.r_[np.linspace(0, 0.999, 1000), np.geomspace(1e-9, 1e-2, 1000)]
    expected = (1 / (1 + u * (2 - u) * (1 - alpha**2) / alpha**2)) ** 2
    np.testing.assert_allclose(GGX.reflect(1 - u, alpha**0.5), expected, rtol=1e-6)


@pytest.mark.parametrize("roughness", ROUGHNESS)
@pytest.mark.parametrize("model", [BECKMANN, GGX], ids=lambda model: model.name)
def test_energy_factors(model, roughness):
    """The viewer is along the normal, so H is half-way, and the angle of L is twice that of H."""
    reflected = integral(
        lambda t: 2 * math.pi * float(model.reflect(math.cos(t / 2), roughness)) * math.cos(t) * math.sin(t),
        2 * roughness**2,
    )
    assert model.energy_factor(roughness) * reflected == pytest.approx(1, rel=1e-7)


def test_energy_factor_of_ggx_near_alpha_1():
    """Here the series takes the place of the closed form."""
    for alpha in (0.9999, 0.9998, 0.99995):
        reflected = integral(
            lambda t, alpha=alpha: (
                2 * math.pi * float(GGX.reflect(math.cos(t / 2), alpha**0.5)) * math.cos(t) * math.sin(t)
            ),
            1.0,
        )
        assert GGX.energy_factor(alpha**0.5) * reflected == pytest.approx(1, rel=1e-10)


def test_energy_factor_is_of_models_that_have_one():
    with pytest.raises(ValueError, match=r"^model must be one of .*blinn.*, not phong_coplanar$"):
        COPLANAR_PHONG.energy_factor(10)


def test_coplanar_phong_is_phong_in_a_plane():
    rng = np.random.default_rng(1)
    for exponent in (1, 7, 100):
        axis, light, viewer, normal = rng.normal(size=(4, 2000, 3))
        # All three vectors are in the plane perpendicular to the axis. L and V are not opposite.
        axis = normalise(axis)
        plane = [normalise(v - (v * axis).sum(-1, keepdims=True) * axis) for v in (light, viewer, normal)]
        light, viewer, normal = plane
        total = light + viewer
        keep = np.linalg.norm(total, axis=-1) > 1e-3
        light, viewer, normal, halfway = (v[keep] for v in (light, viewer, normal, normalise(total)))
        mirror = 2 * (normal * light).sum(-1, keepdims=True) * normal - light
        phong = PHONG.reflect((mirror * viewer).sum(-1), exponent)
        cosine = (normal * halfway).sum(-1)
        front = cosine > 0
        np.testing.assert_allclose(
            COPLANAR_PHONG.reflect(cosine, exponent)[front], phong[front], atol=1e-9 * exponent
        )
        assert front.sum() > 500


def test_coplanar_phong_is_not_phong_elsewhere():
    """Light and viewer are 60 degrees from N on different sides, and N leaves their plane by 10 degrees."""
    light, viewer = (np.array([sign * math.sin(math.pi / 3), 0, 0.5]) for sign in (1, -1))
    normal = np.array([0, math.sin(math.radians(10)), math.cos(math.radians(10))])
    mirror = 2 * (normal @ light) * normal - light
    halfway = normalise(light + viewer)
    assert PHONG.reflect(mirror @ viewer, 50) == pytest.approx(0.46, abs=0.02)
    assert COPLANAR_PHONG.reflect(normal @ halfway, 50) == pytest.approx(0.045, abs=0.01)


def test_coplanar_phong_tends_to_blinn_with_four_times_the_exponent():
    cosine = np.linspace(0, 1, 10_001)
    for exponent, bound in ((10, 0.015), (100, 0.0014), (250, 0.0006)):
        error = np.abs(COPLANAR_PHONG.reflect(cosine, exponent) - BLINN.reflect(cosine, 4 * exponent)).max()
        assert bound / 2 < error < bound


def test_roughness_and_exponent():
    """Blinn's power is near Beckmann's distribution of the same alpha.

    Both mappings are inverse to each other.
    """
    for roughness in (0.1, 0.2, 0.3):
        exponent = exponent_of_roughness(roughness)
        assert exponent == pytest.approx(2 / roughness**4 - 2)
        assert roughness_of_exponent(exponent) == pytest.approx(roughness)
        cosine = np.linspace(0, 1, 100_001)
        apart = np.abs(BLINN.reflect(cosine, exponent) - BECKMANN.reflect(cosine, roughness)).max()
        assert apart < roughness**4
    assert exponent_of_roughness(1) == 0


@pytest.mark.parametrize("roughness", [0, -0.5, 1.0001, math.nan, math.inf])
def test_bad_roughness_is_refused(roughness):
    message = r"^roughness must be greater than 0 and at most 1, not"
    for model in (BECKMANN, GGX):
        with pytest.raises(ValueError, match=message):
            model.reflect(0.5, roughness)
        with pytest.raises(ValueError, match=message):
            model.energy_factor(roughness)
        with pytest.raises(ValueError, match=message):
            model.peak(roughness)
    with pytest.raises(ValueError, match=message):
        exponent_of_roughness(roughness)


@pytest.mark.parametrize("exponent", [0, -1, math.nan, math.inf])
def test_bad_exponent_is_refused(exponent):
    with pytest.raises(ValueError, match=r"^exponent must be finite and greater than 0, not"):
        roughness_of_exponent(exponent)


def test_models_can_be_sent_to_another_process():
    tabulated = TabulatedModel.of_points("ramp", [0, 1], [0, 1])
    for model in (*TABLE_MODELS.values(), tabulated):
        copy = pickle.loads(pickle.dumps(model))
        assert copy.reflect(0.75, 0.5) == model.reflect(0.75, 0.5)


def test_tabulated_points_and_functions():
    points = TabulatedModel.of_points("steps", [0, 0.5, 1], [0.25, 0.75, 0.5], "measured")
    np.testing.assert_allclose(points.reflect([0.25, 0.5, 0.75, 1, 2]), [0.5, 0.75, 0.625, 0.5, 0.5])
    assert not points.reflect([0.0, -0.5]).any()
    assert points.PARAMETER is None
    function = TabulatedModel("square", function=np.square)
    cosine = np.linspace(-1, 1, 41).reshape(1, 41)
    np.testing.assert_array_equal(function.reflect(cosine, 7), BLINN.reflect(cosine, 2))
    assert function.reflect(0.5) == 0.25


@pytest.mark.parametrize(
    ("cosines", "values", "message"),
    [
        ([0, 1], [1], r"^curve must have one value for each cosine, and one row of each$"),
        ([[0, 1]], [[0, 1]], r"^curve must have one value for each cosine, and one row of each$"),
        ([0], [1], r"^curve must have at least 2 points, not 1$"),
        ([], [], r"^curve must have at least 2 points, not 0$"),
        (
            [0, math.nan, 1],
            [0, 0, 0],
            r"^point 2 of curve must have two finite numbers, not cosine nan, value 0$",
        ),
        ([0, 0.5, 1], [0, 0, math.nan], r"^point 3 of curve must have two finite numbers"),
        (
            [0, 0.5, 1],
            [0, 1.5, 0],
            r"^point 2 of curve must have a value from 0 to 1, not cosine 0.5, value 1.5$",
        ),
        ([0, 0.5, 1], [-0.1, 1, 0], r"^point 1 of curve must have a value from 0 to 1"),
        (
            [0, 0.5, 0.4, 1],
            [0, 0, 0, 0],
            r"^point 3 of curve must have a larger cosine than the point before it",
        ),
        (
            [0, 0.5, 0.5, 1],
            [0, 0, 0, 0],
            r"^point 3 of curve must have a larger cosine than the point before it",
        ),
        ([0.1, 1], [0, 0], r"^the cosines of curve must go from 0 to 1, not from 0.1 to 1$"),
        ([0, 0.9], [0, 0], r"^the cosines of curve must go from 0 to 1, not from 0 to 0.9$"),
    ],
)
def test_bad_points_are_refused(cosines, values, message):
    with pytest.raises(ValueError, match=message):
        TabulatedModel.of_points("curve", cosines, values)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda c: 2 * c, r"^curve must give values from 0 to 1$"),
        (lambda c: c * math.nan, r"^curve must give values from 0 to 1$"),
        (lambda c: 0.5, r"^curve must give one value for each cosine$"),
    ],
)
def test_bad_functions_are_refused(function, message):
    with pytest.raises(ValueError, match=message):
        TabulatedModel("curve", function=function).reflect([0.2, 0.9])


def test_curve_of_a_file(tmp_path):
    path = tmp_path / "satin.csv"
    path.write_text("cosine, value\n# measured\n\n0, 0\n0.9, 0.1\n1, 1\n", encoding="utf-8-sig")
    model = TabulatedModel.of_csv(path)
    assert (model.name, model.source, model.PARAMETER) == ("satin", "satin.csv", None)
    np.testing.assert_allclose(model.reflect([-0.5, 0.45, 0.9, 0.95, 1.2]), [0, 0.05, 0.1, 0.55, 1])
    assert model.steepness() == pytest.approx(9, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,0\n0.9,\n1,1\n", r"^line 2 of bad.csv must have two numbers, not '0.9,'$"),
        ("cosine,value\n0,0\n0.9;0.3\n1,1\n", r"^line 3 of bad.csv must have two numbers, not '0.9;0.3'$"),
        ("0,0\n0.5,nan\n1,1\n", r"^point 2 of bad must have two finite numbers, not cosine 0.5, value nan$"),
        ("", r"^bad must have at least 2 points, not 0$"),
        ("0,0\n" * 100_001, r"^bad.csv must have at most 100,000 points, not 100,001$"),
        (b"\xff\xfe\x00", r"^bad.csv must be a text of numbers, not other bytes$"),
    ],
)
def test_bad_files_are_refused(tmp_path, text, message):
    path = tmp_path / "bad.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError, match=message):
        TabulatedModel.of_csv(path)


def test_steepness():
    """The largest slope of Blinn's power is its exponent, and that of GGX is 4/alpha^2 for a small alpha."""
    assert BLINN.steepness(70) == 70
    assert COPLANAR_PHONG.steepness(20) == 80
    for roughness in (0.2, 0.3):
        assert GGX.steepness(roughness) == pytest.approx(4 / roughness**4, rel=0.01)
    assert GGX.steepness(1) == 1
    assert GGX.steepness(0.01) == STEEPEST
    with pytest.raises(ValueError, match=r"^roughness must be greater than 0 and at most 1"):
        BECKMANN.steepness(2)
