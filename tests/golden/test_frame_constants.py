"""Codes of a scene's constants, and the beats that write them."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.frame_constants import (
    FIELDS_OF_A_FRAME,
    FIELDS_OF_A_LIGHT,
    LIGHT_STRIDE,
    MATERIAL_ADDRESS,
    FrameConstants,
    address_table,
)
from blysk.golden.number.unit_vector import ONE
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture

TRIANGLE = Mesh(
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]), np.tile([0.0, 0, 1], (3, 1))
)


def scene(lights, material=None, ambient_light=(1.0, 1.0, 1.0)):
    return Scene(
        mesh=TRIANGLE,
        camera=Camera.framing(TRIANGLE.vertices, (0, 0, 1)),
        width=4,
        height=4,
        material=material or Material((0.1, 0.2, 0.3), (0.6, 0.5, 0.4), (0.5, 0.25, 1), 20),
        lights=lights,
        ambient_light=ambient_light,
    )


def test_codes_of_a_scene():
    """The half-way vector is that of the light if L = V.

    If L is at a right angle to V, it is between both.
    """
    lights = [Light((0, 0, 5), (1, 0.5, 2)), Light((3, 0, 0))]
    given = scene(lights, ambient_light=(0.5, 1, 2))
    np.testing.assert_allclose(given.camera.viewer, (0, 0, 1), atol=1e-15)
    constants = FrameConstants.of(given)
    assert constants.exponent == 20
    np.testing.assert_array_equal(constants.ambient, np.rint(255 * 64 * np.array([0.05, 0.2, 0.6])))
    np.testing.assert_array_equal(constants.direction, [[0, 0, ONE], [ONE, 0, 0]])
    np.testing.assert_array_equal(constants.halfway[0], [0, 0, ONE])
    np.testing.assert_allclose(constants.halfway[1] / ONE, [0.5**0.5, 0, 0.5**0.5], atol=2.0**-17)
    scale = 255 * 64
    # Codes are rounded half up: 0.6 * 255 * 64 is 9792, 0.5 * 0.5 a quarter, and so on. All are off by at
    # most half a code.
    diffuse = scale * np.array([[0.6, 0.25, 0.8], [0.6, 0.5, 0.4]])
    specular = scale * np.array([[0.5, 0.125, 2], [0.5, 0.25, 1]])
    assert np.abs(constants.diffuse - diffuse).max() <= 0.5
    assert np.abs(constants.specular - specular).max() <= 0.5


def test_stiff_light_opposite_the_viewer_has_no_highlight():
    constants = FrameConstants.of(scene([Light((0, 0, -1)), Light((0, 0, 1))]))
    np.testing.assert_array_equal(constants.direction[0], [0, 0, -ONE])
    assert not constants.halfway[0].any()
    assert not constants.specular[0].any()
    assert constants.diffuse[0].all()
    assert constants.specular[1].all()


@pytest.mark.parametrize("count", [0, 1, 3])
def test_missing_lights_are_black(count):
    constants = FrameConstants.of(scene([Light((0, 1, 1))] * count), lights=5)
    for name in FIELDS_OF_A_LIGHT:
        field = getattr(constants, name)
        assert field.shape == (5, 3)
        assert field[:count].any(axis=1).all()
        assert not field[count:].any()
    assert FrameConstants.of(scene([Light((0, 1, 1))] * count)).direction.shape == (max(count, 1), 3)


def test_what_does_not_fit_is_refused():
    with pytest.raises(ValueError, match=r"^the pipeline has 1 lights, the scene 2$"):
        FrameConstants.of(scene([Light((0, 0, 1))] * 2), lights=1)
    with pytest.raises(ValueError, match=r"^the pipeline has 17 lights, the scene 17$"):
        FrameConstants.of(scene([Light((0, 0, 1))] * 17))
    assert len(FrameConstants.of(scene([Light((0, 0, 1))] * 16)).direction) == 16
    for bright in (
        scene([Light((0, 0, 1), (14, 1, 1))]),
        scene([Light((0, 0, 1))], Material((0, 0, 0), (0, 0, 0), (9, 0, 0), 3)),
        scene([], ambient_light=(100, 1, 1)),
    ):
        with pytest.raises(ValueError, match=r"^the intensity of a term must be 0 to 8$"):
            FrameConstants.of(bright)
    # A light of eight times the full channel is the brightest that is allowed.
    assert FrameConstants.of(scene([Light((0, 0, 1), (8, 8, 8))])).specular[0, 2] == 8 * 255 * 64


@pytest.mark.parametrize("energy", ["phong", "blinn", "cosquad_lin"])
def test_energy_factor_multiplies_the_specular_colour(energy):
    """The integrated reflected energy of the highlight is k_s, up to rounding."""
    # If the viewer looks along the normal, Blinn's angle is half of the light's angle.
    model, share = ("blinn", 0.5) if energy == "blinn" else (energy, 1)
    for exponent in (2, 10, 30):
        material = Material((0.1, 0.2, 0.3), (0.6, 0.5, 0.4), (0.5, 0.25, 1), exponent)
        given = scene([Light((0, 0, 5)), Light((0, 1, 1), (0.5, 0.5, 0.5))], material)
        plain, normalised = (
            FrameConstants.of(given),
            FrameConstants.of(given, energy=REFLECTION_MODELS[energy]),
        )
        angle = np.linspace(0, np.pi / 2, 20_001)
        curve = REFLECTION_MODELS[model].reflect(np.cos(share * angle), exponent) * np.sin(2 * angle) * np.pi
        reflected = np.trapezoid(curve, angle)
        found = normalised.specular / (255 * 64) * reflected
        # [C]'s line is off by 5.3 %.
        bound = 0.054 if energy == "cosquad_lin" else 1e-6
        light = np.array([[1.0], [0.5]])
        assert (np.abs(found - light * (0.5, 0.25, 1)) <= bound * light + 2.0**-7 / 255 * reflected).all()
        for name in ("exponent", "ambient", "direction", "halfway", "diffuse"):
            np.testing.assert_array_equal(getattr(normalised, name), getattr(plain, name))


def test_fresnel_is_in_the_specular_colour():
    """Each light has its own k_s F, here with V·H = cos 60 degrees and 1. A point light has k_s F_0."""
    material = Material((0.1, 0.2, 0.3), (0.6, 0.5, 0.4), (0.5, 1, 1), 9, fresnel=(0.04, 0.5, 1))
    lights = [Light((3**0.5, 0, -1)), Light((0, 0, 5)), Light((1, 1, 1), (0, 0, 0))]
    found = FrameConstants.of(scene(lights, material))
    expected = [[0.5 * (0.04 + 0.96 / 32), 0.5 + 0.5 / 32, 1], [0.02, 0.5, 1], [0, 0, 0]]
    assert np.abs(found.specular / (255 * 64) - expected).max() <= 2.0**-7 / 255
    # A light that is off has no vectors either: its terms are 0.
    assert not any(getattr(found, name)[2].any() for name in ("direction", "halfway", "diffuse"))
    assert found.direction[0].any()
    near = FrameConstants.of(scene([Light(position=(1e9, 0, -1e9)), *lights], material))
    assert np.abs(near.specular[0] / (255 * 64) - (0.02, 0.5, 1)).max() <= 2.0**-7 / 255


@pytest.mark.parametrize(("energy", "largest"), [("phong", 48), ("blinn", 195), ("cosquad_lin", 36)])
def test_exponents_whose_energy_factor_fits(energy, largest):
    def of(exponent, coefficient):
        material = Material((0, 0, 0), (0, 0, 0), (coefficient, 0, 0), exponent)
        return FrameConstants.of(scene([Light((0, 0, 1))], material), energy=REFLECTION_MODELS[energy])

    assert 7.5 * 255 * 64 < of(largest, 1.0).specular[0, 0] <= 8 * 255 * 64
    with pytest.raises(
        ValueError,
        match=rf"^the energy factor 8\.\d+ of {energy} with exponent {largest + 1} makes a specular term of "
        r"8\.\d+, over 8; lower the exponent, the specular coefficient or the light$",
    ):
        of(largest + 1, 1.0)
    assert of(1000, 0.03).specular[0, 0] > 0


def test_models_without_an_energy_factor_are_refused():
    with pytest.raises(ValueError, match=r"^model must be one of .*blinn.*, not exp$"):
        FrameConstants.of(scene([Light((0, 0, 1))]), energy=REFLECTION_MODELS["exp"])


@pytest.mark.parametrize("lights", [1, 2, 16])
def test_writes_hold_every_constant(lights):
    """The constants are read back from the beats by the table of addresses, with their signs."""
    rng = np.random.default_rng(lights)
    vectors, colors = rng.integers(-ONE, ONE + 1, (2, lights, 3)), rng.integers(0, 2**17, (2, lights, 3))
    constants = FrameConstants(1000, rng.integers(0, 2**17, 3), *vectors, *colors)
    writes = constants.writes()
    assert len(writes["address"]) == len(set(writes["address"].tolist())) == 4 + 12 * lights
    assert 0 <= writes["data"].min() <= writes["data"].max() < 2**18
    assert writes["address"].max() < 512
    memory = dict(zip(writes["address"].tolist(), writes["data"].tolist(), strict=True))

    def read(first, count, signed):
        words = np.array([memory[first + k] for k in range(count)])
        return np.where(signed & (words >= 2**17), words - 2**18, words)

    for name, (first, count) in FIELDS_OF_A_FRAME.items():
        np.testing.assert_array_equal(read(first, count, False), np.atleast_1d(getattr(constants, name)))
    for light in range(lights):
        for name, (first, count) in FIELDS_OF_A_LIGHT.items():
            signed = name in ("direction", "halfway")
            words = read((light + 1) * LIGHT_STRIDE + first, count, signed)
            np.testing.assert_array_equal(words, getattr(constants, name)[light])


@pytest.mark.parametrize(("lights", "axes"), [(1, ""), (3, ""), (16, ""), (1, "xyz"), (3, "z"), (16, "xyz")])
def test_address_table_tells_every_address_once(lights, axes):
    rows = np.zeros((lights - 1, len(axes), 3), int) if axes else None
    constants = FrameConstants(1, np.zeros(3, int), *np.zeros((4, lights, 3), int), axes=rows)
    told = []
    for line in address_table(lights, axes=tuple(axes)):
        words = line.split()
        first, last = int(words[0]), int(words[2] if words[1] == "to" else words[0])
        told += range(first, last + 1)
        assert ("light" in line.rsplit("(", 1)[-1]) == (first >= LIGHT_STRIDE)
    assert sorted(told) == sorted(constants.writes()["address"].tolist())


def test_codes_of_several_materials():
    """Each material has its own exponent and colours, and all share the lights.

    Its constants equal those of a scene with this material alone.
    """
    rng = np.random.default_rng(5)
    lights = [Light((0, 0, 5), (1, 0.5, 2)), Light((3, 0, 0))]
    materials = [Material(*rng.uniform(0, 0.5, (3, 3)), n) for n in (1, 20, 1000)]
    for index, material in enumerate(materials):
        ours = FrameConstants.of(scene(lights, materials), lights=3, index=index)
        alone = FrameConstants.of(scene(lights, material), lights=3)
        assert ours.exponent == alone.exponent == (1, 20, 1000)[index]
        for name in ("ambient", *FIELDS_OF_A_LIGHT):
            np.testing.assert_array_equal(getattr(ours, name), getattr(alone, name))
        expected = 255 * 64 * np.multiply(material.diffuse, [light.color for light in lights])
        assert np.abs(ours.diffuse[:2] - expected).max() <= 0.5
        assert not ours.diffuse[2].any()
    with pytest.raises(IndexError):
        FrameConstants.of(scene(lights, materials), index=3)


def test_writes_of_a_material_begin_with_its_index():
    rng = np.random.default_rng(6)
    constants = FrameConstants(7, rng.integers(0, 2**17, 3), *rng.integers(0, 2**17, (4, 2, 3)))
    plain = constants.writes()
    for index in (0, 1, 1023):
        writes = constants.writes(index)
        assert (writes["address"][0], writes["data"][0]) == (MATERIAL_ADDRESS, index)
        for name in ("address", "data"):
            np.testing.assert_array_equal(writes[name][1:], plain[name])
    # No other constant has this address.
    assert MATERIAL_ADDRESS not in plain["address"]


def test_writes_and_address_table_of_an_albedo():
    """The table has a line for each word of an albedo's constants. Other designs have no such lines."""
    rng = np.random.default_rng(6)
    plain = FrameConstants(7, rng.integers(0, 2**17, 3), *rng.integers(0, 2**17, (4, 2, 3)))
    texels = TexelMemory(4).load([Texture(np.ones((2, 2, 3)))])
    constants = replace(
        plain, emission=np.array([5, 6, 7]), tinted=True, texture=texels.descriptors[0], texels=texels
    )
    writes, others = constants.writes(), plain.writes()
    new = ~np.isin(writes["address"], others["address"])
    assert writes["address"][new].tolist() == [8, 9, 10, 11, 12, 13, 14, *[15] * 16]
    assert writes["data"][new][:5].tolist() == [5, 6, 7, 1, 1 | 1 << 4]
    np.testing.assert_array_equal(writes["data"][~new], others["data"])
    albedo = Albedo(texture=TextureSampler(), tints=True)
    more = [line for line in address_table(2, albedo=albedo) if line not in address_table(2)]
    assert [int(line.split()[0]) for line in more] == [8, 11, 12, 14, 15]


@pytest.mark.parametrize("lights", [1, 16])
def test_address_table_of_several_materials(lights):
    """With several materials the table has one further line, for the index."""
    more = [line for line in address_table(lights, 2) if line not in address_table(lights)]
    assert len(more) == 1
    assert int(more[0].split()[0]) == MATERIAL_ADDRESS
    assert "material" in more[0]
    assert len(address_table(lights, 2)) == len(address_table(lights)) + 1
