"""Lights that fade with the distance, and spots."""

import math

import numpy as np
import pytest

from blysk.golden.reference.light import Light
from blysk.golden.reference.lighting import Material, intensity
from blysk.golden.reference.reflection import BLINN


def by_hand(light, point):
    """The factor by its definition, without vectors of NumPy."""
    way = [a - b for a, b in zip(point, light.position, strict=True)]
    distance = math.hypot(*way)
    k_0, k_1, k_2 = light.attenuation
    total = k_0 + k_1 * distance + k_2 * distance**2
    fade = min(1 / total, 1) if total else 1
    if light.spot is None:
        return fade
    cosine = sum(a * b for a, b in zip(way, light.spot, strict=True)) / distance
    inner, outer = (math.cos(math.radians(angle)) for angle in light.cone)
    share = min(max((cosine - outer) / (inner - outer), 0), 1)
    return fade * share * share * (3 - 2 * share)


@pytest.mark.parametrize("attenuation", [(1, 0, 0), (2, 0, 0), (0, 0, 1), (0.5, 0.1, 0.02)])
@pytest.mark.parametrize("cone", [None, (0, 5), (10, 40), (60, 180)])
def test_factor(attenuation, cone):
    rng = np.random.default_rng(1)
    spot = None if cone is None else (1, -2, 0.5)
    light = Light(position=(0.3, 1, -0.2), attenuation=attenuation, spot=spot, cone=cone)
    points = rng.normal(size=(400, 3)) * 2 + np.multiply(rng.uniform(0, 4, (400, 1)), spot or (0, 0, 0))
    found = light.factor(points)
    assert found == pytest.approx(np.array([by_hand(light, point) for point in points]), abs=1e-12)
    if light.fades:
        assert 0 <= found.min() <= found.max() <= 1
        assert found.shape == (400,)


def test_the_light_itself_and_far_away():
    """At the light's own place a spot gives nothing along its axis, and far away a light gives nothing.

    There is no NaN and no warning.
    """
    light = Light(position=(1, 2, 3), attenuation=(0, 0, 1e300), spot=(0, -1, 0))
    points = np.array([[1.0, 2, 3], [1e300, 0, 0], [1, -1e200, 3]])
    assert not light.factor(points).any()
    assert Light(position=(1, 2, 3), attenuation=(0, 1, 0)).factor(points).tolist() == [1, 1e-100, 1e-100]


def test_both_terms_have_the_factor():
    """The factor multiplies both terms of the light, and not the ambient light."""
    material = Material((0.1,) * 3, (0.5,) * 3, (0.4,) * 3, 20)
    normals, points = np.tile([0.0, 0, 1], (2, 1)), np.array([[0.0, 0, 0], [1, 0, 0]])
    plain = Light(position=(0, 0, 2))
    light = Light(position=(0, 0, 2), attenuation=(1, 0, 0.5), spot=(0, 0, -1), cone=(10, 50))
    given = (material, (1, 1, 1), (0, 0, 1.0), BLINN)
    full, faded = (
        intensity(normals, given[0], [one], given[1], given[2], given[3], points=points)
        for one in (plain, light)
    )
    factor = light.factor(points)[:, np.newaxis]
    assert faded == pytest.approx(0.1 + factor * (full - 0.1), abs=1e-15)
    assert 0.1 < factor[0] < 0.4


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"attenuation": (1, -1, 0)}, r"^a light's attenuation must be at least 0, not "),
        ({"attenuation": (0, 0, 0)}, r"^a light's attenuation must not be 0, 0, 0$"),
        ({"spot": (0, 0, 0)}, r"^a light's spot must not be 0, 0, 0$"),
        ({"cone": (10, 20)}, r"^a light's cone needs the direction of a spot$"),
        ({"spot": (1, 0, 0), "cone": (20, 10)}, r"0 <= inner < outer <= 180, not 20 and 10$"),
        ({"spot": (1, 0, 0), "cone": (-1, 10)}, r"not -1 and 10$"),
        ({"spot": (1, 0, 0), "cone": (1, math.nan)}, r"not 1 and nan$"),
        ({"position": None, "direction": (1, 0, 0), "spot": (1, 0, 0)}, r"^a directional light has no dist"),
        ({"position": None, "direction": (1, 0, 0), "attenuation": (2, 0, 0)}, r"give it a position$"),
    ],
)
def test_refusals(options, says):
    with pytest.raises(ValueError, match=says):
        Light(**{"position": (1, 2, 3)} | options)


def test_a_light_that_does_not_fade_reads_no_points():
    assert Light((1, 0, 0)).factor() == 1
    assert not Light(position=(1, 2, 3)).fades
    with pytest.raises(ValueError, match=r"^a point light needs the points that it lights$"):
        Light(position=(1, 2, 3), attenuation=(2, 0, 0)).factor()
