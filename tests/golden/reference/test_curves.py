import math

import numpy as np
import pytest

from blysk.golden.reference.curves import CURVES, interpolate
from blysk.golden.reference.geometry import normalise

LEFT = np.array([0.0, 0.0, 1.0])
T = np.linspace(0, 1, 20001)


def pair(degrees):
    """Two unit vectors at an angle, in a plane that is no coordinate plane."""
    first, side = normalise([1.0, 2.0, 3.0]), normalise(np.cross([1.0, 2.0, 3.0], [0.3, -1.0, 0.2]))
    angle = math.radians(degrees)
    return first, math.cos(angle) * first + math.sin(angle) * side


def great_circle(degrees):
    """Points of the great circle by Rodrigues' formula, which the code does not use."""
    left, right = pair(degrees)
    axis = np.cross(left, right) / math.sin(math.radians(degrees))
    angle = (T * math.radians(degrees))[:, np.newaxis]
    return np.cos(angle) * left + np.sin(angle) * np.cross(axis, left)


@pytest.mark.parametrize(
    ("degrees", "linear", "length", "vector", "angle"),
    [
        (5, "9.5e-4", "1.1e-7", "5.3e-6", "0.0006"),
        (10, "3.8e-3", "1.8e-6", "4.3e-5", "0.005"),
        (20, "1.5e-2", "2.9e-5", "3.4e-4", "0.039"),
        # Exactly 1 - sqrt(1 - (1 - cos 22.5°)^2 / 4) = 7.2455e-4.
        (45, "7.6e-2", "7.2e-4", "3.9e-3", "0.46"),
        (90, "0.29", "1.1e-2", "3.0e-2", "4.1"),
    ],
)
def test_published_errors(degrees, linear, length, vector, angle):
    left, right = pair(degrees)
    exact = great_circle(degrees)

    def shown(value, digits):
        # Half of the last digit shown.
        mantissa, _, power = digits.partition("e")
        step = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
        assert value == pytest.approx(float(digits), abs=0.5001 * step)

    raw = interpolate("linear", left, right, T)
    shown(np.abs(np.linalg.norm(raw, axis=1) - 1).max(), linear)
    quadratic = interpolate("quadratic", left, right, T)
    shown(np.abs(np.linalg.norm(quadratic, axis=1) - 1).max(), length)
    shown(np.linalg.norm(quadratic - exact, axis=1).max(), vector)
    unit = interpolate("normalised", left, right, T)
    between = np.linalg.norm(np.cross(unit, exact), axis=1)
    shown(np.degrees(np.arcsin(between)).max(), angle)
    assert interpolate("slerp", left, right, T) == pytest.approx(exact, abs=1e-14)


@pytest.mark.parametrize(("degrees", "shown"), [(30, "0.13"), (60, "1.1")])
def test_great_circle_is_a_third_curve(degrees, shown):
    """Distance of ``slerp`` from the curve with which methods are compared."""
    left, right = pair(degrees)
    between = np.cross(interpolate("slerp", left, right, T), interpolate("normalised", left, right, T))
    angle = np.degrees(np.arcsin(np.linalg.norm(between, axis=1).max()))
    assert f"{angle:.{len(shown) - 2}f}" == shown


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 89.9, 90, 120, 180])
def test_stiff_span_angles_and_lengths(degrees, length):
    """Every pixel of every curve is compared with the closed form of its angle. 180 degrees have no plane."""
    left, right = pair(degrees)
    angle = math.radians(degrees)
    t = np.arange(length) / max(length - 1, 1)
    found = {curve: interpolate(curve, left, right, t) for curve in CURVES}
    for normals in found.values():
        assert np.isfinite(normals).all()
        assert normals[0] == pytest.approx(left, abs=1e-15)
        assert normals[-1] == pytest.approx(right if length > 1 else left, abs=1e-14)
    size = {curve: np.linalg.norm(normals, axis=1) for curve, normals in found.items()}
    # |(1-t) N_l + t N_r|^2 = 1 - 4 t (1-t) sin^2(psi/2).
    assert size["linear"] ** 2 == pytest.approx(1 - 4 * t * (1 - t) * math.sin(angle / 2) ** 2, abs=1e-14)
    assert size["slerp"] == pytest.approx(1, abs=1e-14)
    if degrees == 180:
        return
    assert size["normalised"] == pytest.approx(1, abs=1e-14)
    # Coordinates are along the middle normal, and along N_r - N_l: s = 2t - 1 goes from -1 to 1.
    s = 2 * t - 1
    middle = (left + right) / (2 * math.cos(angle / 2))
    along = found["quadratic"] @ middle
    assert along == pytest.approx(math.cos(angle / 2) + (1 - s * s) * (1 - math.cos(angle / 2)), abs=1e-14)
    assert found["quadratic"] @ (right - left) == pytest.approx(2 * s * math.sin(angle / 2) ** 2, abs=1e-13)
    assert found["slerp"] @ middle == pytest.approx(np.cos(s * angle / 2), abs=1e-14)
    assert found["normalised"] @ middle == pytest.approx(
        math.cos(angle / 2) / np.sqrt(1 - (1 - s * s) * math.sin(angle / 2) ** 2), abs=1e-14
    )


@pytest.mark.parametrize("curve", CURVES)
def test_exact_at_the_ends_and_in_the_middle(curve):
    for degrees in (1e-4, 1, 45, 89.9, 90, 120, 179):
        left, right = pair(degrees)
        ends = interpolate(curve, left, right, np.array([0.0, 1.0]))
        assert ends == pytest.approx(np.stack((left, right)), abs=1e-14)
        middle = (left + right) / 2
        if curve != "linear":
            middle = middle / np.linalg.norm(middle)
        # The half-way sum of normals 179 degrees apart keeps 1/57 of their length.
        assert interpolate(curve, left, right, 0.5) == pytest.approx(middle, abs=1e-13)


@pytest.mark.parametrize("curve", CURVES)
def test_equal_normals_stay(curve):
    left, _ = pair(30)
    found = interpolate(curve, left, left, T[::100])
    assert found == pytest.approx(np.tile(left, (len(found), 1)), abs=1e-15)


def test_opposite_normals():
    line = np.outer(1 - 2 * T[::100], LEFT)
    assert interpolate("linear", LEFT, -LEFT, T[::100]) == pytest.approx(line, abs=1e-15)
    assert interpolate("quadratic", LEFT, -LEFT, T[::100]) == pytest.approx(line, abs=1e-14)
    assert interpolate("normalised", LEFT, -LEFT, T[::100]) == pytest.approx(np.sign(line), abs=0)
    for left in (LEFT, pair(1)[0], np.array([0.0, -1.0, 0.0])):
        circle = interpolate("slerp", left, -left, T[::100])
        assert np.linalg.norm(circle, axis=1) == pytest.approx(1, abs=1e-14)
        assert circle @ left == pytest.approx(np.cos(np.pi * T[::100]), abs=1e-14)
        assert circle[-1] == pytest.approx(-left, abs=1e-14)
        steps = np.linalg.norm(np.diff(circle, axis=0), axis=1)
        assert steps == pytest.approx(2 * math.sin(math.pi / 400), rel=1e-9)


def test_broadcasts():
    left = normalise(np.random.default_rng(8).normal(size=(7, 3)))
    right = normalise(np.random.default_rng(9).normal(size=(7, 3)))
    t = np.random.default_rng(10).uniform(size=7)
    for curve in CURVES:
        together = interpolate(curve, left, right, t)
        single = [interpolate(curve, a, b, c) for a, b, c in zip(left, right, t, strict=True)]
        assert together == pytest.approx(np.array(single), abs=1e-15)
        assert interpolate(curve, left[:, np.newaxis], right[:, np.newaxis], T[:5]).shape == (7, 5, 3)


def test_unknown_curve():
    with pytest.raises(ValueError, match=r"curve must be one of linear, normalised, .* not 'cubic'"):
        interpolate("cubic", LEFT, LEFT, 0.5)
