import math
from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import (
    Light,
    Material,
    gram_determinant,
    halfway_vector,
    intensity,
    intensity_of_cosines,
    saturate,
    schlick,
)
from blysk.golden.reference.lobes import GGX, TabulatedModel
from blysk.golden.reference.reflection import BLINN, REFLECTION_MODELS

V = np.array([0.0, 0.0, 1.0])

SUMMED = ("phong", "blinn", "cosquad", "cosquad7", "cosquad_q", "cosquad_lin")
"""Models whose highlights `test_formula_channel_by_channel` computes by itself."""


def grey(value):
    return (value, value, value)


def random_units(count, seed):
    return normalise(np.random.default_rng(seed).normal(size=(count, 3)))


def test_worked_example():
    material = Material(grey(0.1), grey(0.7), grey(0.5), 10)
    light = Light((1, 1, 1))
    # I_a = 0.2, I_d = 0.8, I_s = 1. In the project a light has one colour, so I_d goes into k_d.
    material = Material(material.ambient, grey(0.7 * 0.8), material.specular, 10)
    dark, matt = replace(material, diffuse=grey(0)), replace(material, specular=grey(0))
    for given, total in ((material, 0.345374), (dark, 0.02 + 0.002058), (matt, 0.02 + 0.323316)):
        value = intensity(V, given, [light], grey(0.2), V, REFLECTION_MODELS["phong"])
        assert value == pytest.approx(grey(total), abs=0.5e-6)
    # [T] 4.1 prints 0.0015 and 0.3445: half of 0.003 for 0.577^10, and the diffuse term to three digits.
    assert f"{0.577350**10:.6f}" == "0.004115"
    assert 0.5 * 0.003 == 0.0015
    assert round(0.02 + 0.323 + 0.0015, 4) == 0.3445


# The sum does not depend on the model. test_reflection.py compares each model with its formula.
@pytest.mark.parametrize("model", SUMMED)
def test_formula_channel_by_channel(model):
    n = 9
    slopes = {"cosquad": n / 2, "cosquad7": 7 * n / 16, "cosquad_lin": 0.448 * n + 0.099}
    slopes["cosquad_q"] = (0.8 - 1) / (0.64 ** (1 / n) - 1)
    material = Material((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9), n)
    lights = [Light((3, 1, 2), (0.5, 0.6, 0.7)), Light((-1, 4, 1), (0.2, 0.1, 0.9))]
    viewer = normalise([0.2, 0.3, 1])
    ambient = (0.3, 0.2, 0.1)
    normals = random_units(200, 2)
    found = intensity(normals, material, lights, ambient, viewer, REFLECTION_MODELS[model])
    lit = 0
    for normal, value in zip(normals.tolist(), found, strict=True):
        for channel in range(3):
            total = material.ambient[channel] * ambient[channel]
            for light in lights:
                cosine = sum(a * b for a, b in zip(normal, light.direction, strict=True))
                if cosine <= 0:
                    continue
                lit += 1
                if model == "phong":
                    reflected = [2 * cosine * a - b for a, b in zip(normal, light.direction, strict=True)]
                    c = sum(a * b for a, b in zip(reflected, viewer, strict=True))
                else:
                    half = [a + b for a, b in zip(light.direction, viewer, strict=True)]
                    c = sum(a * b for a, b in zip(normal, half, strict=True)) / math.hypot(*half)
                highlight = max(slopes[model] * (c - 1) + 1, 0) ** 2 if model in slopes else max(c, 0) ** n
                shade = material.diffuse[channel] * cosine + material.specular[channel] * highlight
                total += light.color[channel] * shade
            assert value[channel] == pytest.approx(total, abs=1e-12)
    assert lit > 200


@pytest.mark.parametrize("model", REFLECTION_MODELS)
def test_light_behind_gives_nothing(model):
    material = Material(grey(0.1), grey(0.7), grey(0.5), 1)
    # N·L is exactly 0, and under 0. With exponent 1 the cosine N·H alone would give a highlight.
    for direction in ((1, 0, 0), (1, 0, -0.01)):
        assert intensity(
            V, material, [Light(direction)], grey(1), V, REFLECTION_MODELS[model]
        ) == pytest.approx(grey(0.1))


@pytest.mark.parametrize("model", REFLECTION_MODELS)
def test_light_opposite_to_the_viewer_has_no_highlight_of_a_halfway_vector(model):
    """There is no H. R·V is 1 - 2 (N·L)^2, and needs no H."""
    material = Material(grey(0.1), grey(0.7), grey(0.5), 1)
    direction = normalise([1, 2, 3])
    light = Light(-direction)
    assert (halfway_vector(light.direction, direction) == 0).all()
    normals = random_units(50, 3)
    found = intensity(normals, material, [light], grey(1), direction, REFLECTION_MODELS[model])
    cosine = normals @ -direction
    expected = 0.1 + 0.7 * np.maximum(cosine, 0)
    if REFLECTION_MODELS[model].MIRROR:
        expected += 0.5 * np.where(cosine > 0, np.maximum(1 - 2 * cosine**2, 0), 0)
    assert found == pytest.approx(np.repeat(expected[:, np.newaxis], 3, axis=1), abs=1e-14)


@pytest.mark.parametrize("model", REFLECTION_MODELS)
def test_stiff_terminator(model):
    """N·L goes through 0 with ``k_s`` 1. The highlight is cut there, and the diffuse term is continuous."""
    material = Material(grey(0), grey(1), grey(1), 1)
    # Seen from V, these are behind the light's edge: N·H is far from 0 where N·L is 0.
    light = Light((1, 0, 0))
    halfway = halfway_vector(light.direction, V)
    for tilt in (1e-3, 1e-9, 1e-15, 5e-324):
        normal = np.array([tilt, 0, 1.0])
        value = intensity(normal, material, [light], grey(0), V, REFLECTION_MODELS[model])
        shine = REFLECTION_MODELS[model].reflect(2 * tilt - 0 if model == "phong" else normal @ halfway, 1)
        assert value == pytest.approx(np.full(3, tilt + shine), rel=1e-12)
        assert (
            intensity(normal * (-1, 1, 1), material, [light], grey(0), V, REFLECTION_MODELS[model]) == 0
        ).all()
    assert (intensity(V, material, [light], grey(0), V, REFLECTION_MODELS[model]) == 0).all()


def test_stiff_half_way_vectors():
    """L = V, and L near -V, where L + V is nearly 0."""
    for direction in normalise(np.random.default_rng(11).normal(size=(20, 3))):
        assert halfway_vector(direction, direction) == pytest.approx(direction, abs=1e-15)
        assert (halfway_vector(-direction, direction) == 0).all()
        side = normalise(np.cross(direction, [0.3, 0.5, 0.8]))
        for angle in (1e-2, 1e-4, 1e-6, 1e-8):
            opposite = -math.cos(angle) * direction + math.sin(angle) * side
            half = halfway_vector(opposite, direction)
            assert np.linalg.norm(half) == pytest.approx(1, abs=1e-14)
            # H is at a right angle to V, less half the angle. L + V keeps 1e-16/angle of its digits.
            assert half == pytest.approx(
                math.cos(angle / 2) * side + math.sin(angle / 2) * direction, abs=1e-15 / angle
            )


@pytest.mark.parametrize("model", REFLECTION_MODELS)
def test_stiff_lengths_of_normals(model):
    """A length of 0 gives the ambient term alone.

    Lengths of 1 +- 1/256 change N·L by 1/256. NaN stays NaN.
    """
    n = 1000
    material = Material(grey(0.1), grey(0.5), grey(0.4), n)
    lights = [Light(V)]
    assert intensity(np.zeros(3), material, lights, grey(1), V, REFLECTION_MODELS[model]) == pytest.approx(
        grey(0.1), abs=0
    )
    assert np.isnan(
        intensity(np.full(3, np.nan), material, lights, grey(1), V, REFLECTION_MODELS[model])
    ).all()
    for scale in (1 - 1 / 256, 1 + 1 / 256):
        value = intensity(V * scale, material, lights, grey(1), V, REFLECTION_MODELS[model])
        # R·V with R = 2 (N·L) N - L is twice the squared scale, less 1.
        cosine = min(2 * scale**2 - 1 if model == "phong" else scale, 1.0)
        expected = 0.1 + 0.5 * scale + 0.4 * float(REFLECTION_MODELS[model].reflect(cosine, n))
        assert value == pytest.approx(grey(expected), rel=1e-12)
    # A normal that is 1/256 too short loses the highlight of every model.
    assert float(REFLECTION_MODELS[model].reflect(1 - 1 / 256, n)) < 0.05


def test_halfway_vector():
    rng = np.random.default_rng(4)
    for light, viewer in normalise(rng.normal(size=(50, 2, 3))):
        half = halfway_vector(light, viewer)
        assert np.linalg.norm(half) == pytest.approx(1, abs=1e-15)
        assert half @ light == pytest.approx(half @ viewer, abs=1e-12)
        assert np.cross(light, viewer) @ half == pytest.approx(0, abs=1e-12)
    assert halfway_vector(V, V) == pytest.approx(V)


def test_halfway_vectors_of_arrays():
    """Each vector of an array is found as if alone. Opposite vectors have none."""
    lights, viewers = random_units(50, 8), random_units(50, 9)
    viewers[::5] = -lights[::5]
    half = halfway_vector(lights, viewers)
    for light, viewer, found in zip(lights, viewers, half, strict=True):
        np.testing.assert_array_equal(found, halfway_vector(light, viewer))
    assert not half[::5].any()
    np.testing.assert_array_equal(halfway_vector(lights, V), [halfway_vector(light, V) for light in lights])


# Point lights and a near viewer.


def test_point_light_towards():
    light = Light(position=(1, 2, 3))
    assert light.direction is None
    assert light.towards(np.array([1.0, 2.0, 1.0])) == pytest.approx((0, 0, 1))
    points = np.array([[1.0, 2, 3], [4, 2, 3], [1, 2 + 3e-200, 3 - 4e-200], [1, 5, -1]])
    expected = [(0, 0, 0), (-1, 0, 0), (0, 0, 0), (0, -0.6, 0.8)]
    assert light.towards(points) == pytest.approx(np.array(expected))
    assert Light(direction=(0, 0, 2)).towards(points) == pytest.approx((0, 0, 1))
    with pytest.raises(ValueError, match=r"^a point light needs the points that it lights$"):
        light.towards()


@pytest.mark.parametrize("chord", [False, True])
@pytest.mark.parametrize("model", SUMMED)
def test_local_formula_point_by_point(model, chord):
    """Each point is shaded as if it were alone, with its own directional light and its own distant viewer."""
    rng = np.random.default_rng(10)
    normals, points = random_units(60, 11), rng.normal(size=(60, 3))
    eye = np.array([0.3, 0.4, 5.0])
    viewers = normalise(eye - points)
    lights = [Light(position=(2, 1, 3), color=(0.5, 0.6, 0.7)), Light((-1, 4, 1)), Light(position=(0, -4, 1))]
    material = Material((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9), 9)
    found = intensity(normals, material, lights, grey(0.5), viewers, REFLECTION_MODELS[model], chord, points)
    for normal, point, viewer, value in zip(normals, points, viewers, found, strict=True):
        alone = [
            Light(np.subtract(light.position, point), light.color) if light.position else light
            for light in lights
        ]
        expected = intensity(normal, material, alone, grey(0.5), viewer, REFLECTION_MODELS[model], chord)
        assert value == pytest.approx(expected, abs=1e-12)
    assert np.ptp(found, axis=0).min() > 0.1


@pytest.mark.parametrize("model", REFLECTION_MODELS)
def test_stiff_point_light_on_the_surface_and_behind_it(model):
    """At its own place a light gives nothing. With L = -V there is no highlight. No value is NaN."""
    material = Material(grey(0.1), grey(0.5), grey(0.5), 1)
    light = Light(position=(0, 0, -1))
    points = np.array([[0.0, 0, -1], [0, 0, 0], [0, 0, -2]])
    normals = np.array([[0.0, 0, 1], [0, 0, -1], [0, 0, 1]])
    value = intensity(normals, material, [light], grey(1), V, REFLECTION_MODELS[model], points=points)
    # The points are at the light, between light and viewer (L = -V, seen from behind), and beyond it, lit
    # from the front.
    assert value[0] == pytest.approx(grey(0.1))
    assert value[1] == pytest.approx(grey(0.6))
    assert value[2] == pytest.approx(grey(1.1), abs=1e-9)
    # A point at the viewer's own place has no V.
    nowhere = intensity(
        normals, material, [light], grey(1), np.zeros((3, 3)), REFLECTION_MODELS[model], points=points
    )
    assert np.isfinite(nowhere).all()


@pytest.mark.parametrize("model", [name for name, model in REFLECTION_MODELS.items() if not model.MIRROR])
def test_intensity_of_cosines(model):
    """The sum from N·L and N·H is the same."""
    normals = random_units(300, 14)
    lights = [Light((1, 2, 3), (0.5, 0.6, 0.7)), Light((-3, 2, 1))]
    material = Material((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9), 9, fresnel=(0.04, 0.3, 1))
    cosine = np.stack([normals @ light.direction for light in lights], axis=-1)
    highlight = np.stack([normals @ halfway_vector(light.direction, V) for light in lights], axis=-1)
    found = intensity_of_cosines(material, lights, grey(0.5), cosine, highlight, REFLECTION_MODELS[model], V)
    expected = intensity(normals, material, lights, grey(0.5), V, REFLECTION_MODELS[model])
    assert found == pytest.approx(expected, abs=1e-14)


def test_fresnel():
    """k_s is multiplied by F_0 + (1 - F_0)(1 - V·H)^5 for a distant light and viewer, otherwise by F_0."""
    assert schlick(0.04, np.array([1.0, 0.5, 0.0])) == pytest.approx([0.04, 0.04 + 0.96 / 32, 1])
    f0 = np.array([0.04, 0.5, 1.0])
    given = Material(grey(0), grey(0), (0.5, 0.25, 2), 9, fresnel=tuple(f0))
    normals, points = random_units(50, 3), random_units(50, 4)
    # The directions are 120 degrees from the viewer, so that V·H is 1/2. A far light has the same direction.
    direction = (math.sqrt(3) / 2, 0, -0.5)
    expected = intensity(normals, replace(given, fresnel=None), [Light(direction)], grey(0), V, BLINN)
    assert expected.max() > 0.5
    found = intensity(normals, given, [Light(direction)], grey(0), V, BLINN)
    assert found == pytest.approx(expected * (f0 + (1 - f0) / 32), abs=1e-14)
    far = Light(position=tuple(1e12 * np.array(direction)))
    found = intensity(normals, given, [far], grey(0), V, BLINN, points=points)
    assert found == pytest.approx(expected * f0, abs=1e-9)
    near = np.tile(V, (50, 1))
    assert intensity(normals, given, [Light(direction)], grey(0), near, BLINN) == pytest.approx(expected * f0)
    with pytest.raises(ValueError, match=r"^a material's fresnel must be in 0 to 1"):
        replace(given, fresnel=(0, 0, 1.5))


def test_gram_identity():
    normals, lights, viewers = random_units(300, 5), random_units(300, 6), random_units(300, 7)
    product = (np.cross(lights, normals) * viewers).sum(axis=1)
    assert gram_determinant(normals, lights, viewers) == pytest.approx(product**2, abs=1e-14)
    coplanar = normalise(normals + lights)
    assert gram_determinant(normals, lights, coplanar) == pytest.approx(0, abs=1e-14)


def test_sums_over_one_and_sixteen_lights():
    material = Material(grey(1), grey(1), grey(1), 2)
    value = intensity(V, material, [Light((0, 0, 5))] * 16, grey(1), V, REFLECTION_MODELS["blinn"])
    assert value == pytest.approx(grey(33))
    assert saturate(value) == pytest.approx(grey(1))
    assert intensity(np.zeros((4, 5, 3)), material, [], grey(0.5), V, REFLECTION_MODELS["blinn"]).shape == (
        4,
        5,
        3,
    )


def test_texts_and_numbers_are_colours():
    assert Light("0,0,2", "#ff8000").color == pytest.approx((1, 0.215861, 0), abs=1e-6)
    assert Light((0, 0, 1), 0.5) == Light((0, 0, 1), grey(0.5)) == Light((0, 0, 1), "0.5,0.5,0.5")
    lamp = Light(position="1,2,3", attenuation="1,0,2", spot="0,-1,0")
    assert lamp == Light(position=(1, 2, 3), attenuation=(1, 0, 2), spot=(0, -1, 0))
    assert Material("0.1", 1, "#000000", 9, fresnel=0.5) == Material(
        grey(0.1), grey(1), grey(0), 9, fresnel=grey(0.5)
    )


def test_refusals():
    with pytest.raises(ValueError, match="a light's direction must not be 0"):
        Light((0, 0, 0))
    with pytest.raises(ValueError, match="a light's direction must be three finite numbers"):
        Light((0, 0, math.nan))
    for both in ({}, {"direction": (0, 0, 1), "position": (0, 0, 1)}):
        with pytest.raises(ValueError, match=r"^a light must have either a direction or a position$"):
            Light(**both)
    with pytest.raises(ValueError, match="a light's position must be three finite numbers"):
        Light(position=(0, math.inf, 0))
    material, lamp = Material(grey(0), grey(1), grey(0), 1), Light(position=(0, 0, 1))
    with pytest.raises(ValueError, match="a point light needs the points"):
        intensity(V, material, [lamp], grey(0), V, REFLECTION_MODELS["blinn"])
    with pytest.raises(ValueError, match="a light's color must be at least 0"):
        Light((0, 0, 1), (1, -1, 1))
    for bad in ("red", "#12345", (1, 2), True, None, "1,2", math.nan):
        with pytest.raises(
            ValueError, match=r"a material's diffuse must be #rrggbb, one finite number or three"
        ):
            Material(grey(0), bad, grey(0), 10)
    for bad in ("up", "1,2", 5, (0, 1)):
        with pytest.raises(ValueError, match="a light's direction must be three finite numbers"):
            Light(bad)
    for exponent in (0, 1001):
        with pytest.raises(ValueError, match=f"exponent must be in 1 to 1000, not {exponent}"):
            Material(grey(0), grey(0), grey(0), exponent)
    with pytest.raises(TypeError):
        Material(grey(0), grey(0), grey(0), 10.5)


def test_roughness_of_a_material():
    """A material has its own roughness, or that of its exponent.

    Models with an exponent, or without a parameter, do not read it.
    """
    plain, rough = (Material((0,) * 3, (0,) * 3, (0,) * 3, 20, roughness) for roughness in (None, 0.3))
    assert rough.parameter(GGX) == 0.3
    assert plain.parameter(GGX) == pytest.approx((2 / 22) ** 0.25)
    assert rough.parameter(BLINN) == 20
    assert rough.parameter(TabulatedModel("flat", function=np.ones_like)) is None
    for roughness in (0, 1.5, math.nan):
        with pytest.raises(ValueError, match=r"^roughness must be greater than 0 and at most 1, not"):
            Material((0,) * 3, (0,) * 3, (0,) * 3, 20, roughness)


def test_material_of_metallic_roughness():
    """A dielectric reflects 4 % and its base colour.

    A metal reflects its base colour, and has no diffuse light.

    k_s makes the highlight's peak as large as D/4, relative to 1/pi, with D of the model itself.
    """
    base = (0.8, 0.5, 0.2)
    dielectric, metal = (Material.of_metallic_roughness(base, metallic, 0.4) for metallic in (0, 1))
    assert dielectric.diffuse == base
    assert dielectric.fresnel == (0.04,) * 3
    assert metal.diffuse == (0,) * 3
    assert metal.fresnel == base
    assert dielectric.specular == (4,) * 3
    assert metal.specular == pytest.approx((1 / 0.8,) * 3)
    rough = Material.of_metallic_roughness(base, 0, 0.7)
    assert rough.specular == pytest.approx((math.pi * GGX.peak(0.7) / 4,) * 3)
    assert Material.of_metallic_roughness(base, 0, 0.01).roughness == 0.05
    assert (metal.roughness, metal.exponent) == (0.4, round(2 / 0.4**4 - 2))
    assert [Material.of_metallic_roughness(base, 0, r).exponent for r in (0, 1)] == [1000, 1]
    for values, name in (((-0.1, 0.5), "metallic"), ((0.5, 1.1), "roughness")):
        with pytest.raises(ValueError, match=rf"^{name} must be 0 to 1, not"):
            Material.of_metallic_roughness(base, *values)


def test_material_of_specular_glossiness():
    """With F_0 = 0.04 the material is that of a dielectric, less the diffuse light that F_0 takes.

    Without diffuse light it is a metal.
    """
    base = (0.8, 0.5, 0.2)
    made = Material.of_specular_glossiness(base, (0.04,) * 3, 0.6)
    same = Material.of_metallic_roughness(base, 0, 0.4)
    assert made.diffuse == pytest.approx([0.96 * channel for channel in base])
    assert (made.specular, made.exponent, made.fresnel) == (same.specular, same.exponent, same.fresnel)
    metal = Material.of_specular_glossiness((0, 0, 0), base, 0.6)
    assert metal == Material.of_metallic_roughness(base, 1, 0.4)
    with pytest.raises(ValueError, match=r"^glossiness must be 0 to 1, not 1.5"):
        Material.of_specular_glossiness(base, base, 1.5)
