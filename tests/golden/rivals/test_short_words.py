"""Short words against scalar arithmetic, whose half floats are rounded by the standard library."""

import math
import struct
from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.raster import rasterise
from blysk.golden.rivals.short_words import short_light

from .scenes import small_scene


def half(value):
    """Nearest half float, ties to even."""
    return struct.unpack("e", struct.pack("e", value))[0]


def word(value):
    """Nearest of the 4,096 words of 12 bits from -1 on."""
    return min(max(round(value * 2048), -2048), 2047) / 2048


def of_halves(normal, towards, halfway, exponent):
    x, y, z = map(half, normal)
    square = half(half(half(x * x) + half(y * y)) + half(z * z))
    scale = half(1 / half(math.sqrt(square)))
    unit = [half(of * scale) for of in (x, y, z)]

    def dot(vector):
        a, b, c = (half(of * half(other)) for of, other in zip(unit, vector, strict=True))
        return half(half(a + b) + c)

    return dot(towards), half(max(dot(halfway), 0) ** exponent)


def of_words(normal, towards, halfway, exponent):
    unit = list(map(word, normal))
    cosines = [
        word(sum(of * word(other) for of, other in zip(unit, vector, strict=True)))
        for vector in (towards, halfway)
    ]
    return cosines[0], max(cosines[1], 0) ** exponent


@pytest.mark.parametrize(("words", "scalar"), [("12 bits", of_words), ("half floats", of_halves)])
@pytest.mark.parametrize("exponent", [10, 1000])
def test_light_is_that_of_scalar_arithmetic(words, scalar, exponent):
    scene = small_scene(exponent=exponent, lights=1)
    raster = rasterise(scene)
    found = short_light(scene, raster, words)
    towards = scene.lights[0].towards()
    halfway = halfway_vector(towards, scene.camera.viewer)
    material, some = scene.materials[0], np.arange(0, len(found), max(len(found) // 300, 1))
    lit = 0
    for k, normal in zip(some, fragment_normals(scene, raster, some), strict=True):
        diffuse, power = scalar(normal.tolist(), towards.tolist(), halfway.tolist(), exponent)
        parts = (0, 0) if diffuse <= 0 else (diffuse, power)
        lit += parts[1] > 0.1
        for channel in range(3):
            colors = (of[channel] for of in (material.ambient, material.diffuse, material.specular))
            ambient, of_diffuse, of_power = colors
            expected = min(255 * (ambient + of_diffuse * parts[0] + of_power * parts[1]), 255)
            assert found[k, channel] == pytest.approx(expected, abs=1e-9)
    assert lit > 1


def test_other_scenes_are_refused():
    scene = small_scene(lights=1)
    with pytest.raises(ValueError, match="short words need"):
        short_light(replace(scene, lights=scene.lights * 2), rasterise(scene), "12 bits")
