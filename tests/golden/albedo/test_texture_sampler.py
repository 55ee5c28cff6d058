"""Texture sampler: address, memory and filter together, against the exact rule in float64."""

from itertools import product

import numpy as np
import pytest

from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_filter import TextureFilter
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.texture import WRAPS, Texture

SAMPLER = TextureSampler(TexelMemory(2048))
SIZES = ((1, 1), (1, 2), (2, 1), (2, 2), (1, 16), (32, 1), (2, 8), (64, 4), (64, 64))
WHITE = Texture(np.ones((1, 1, 3)))


def image(rng, kind, width, height):
    """Texels of an image: random, a checker of full contrast, or dark."""
    if kind == "checker":
        return np.repeat((np.indices((height, width)).sum(axis=0) % 2.0)[:, :, np.newaxis], 3, axis=2)
    return rng.random((height, width, 3)) * (1 if kind == "any" else 0.01)


def places(rng, texture, count, share_bits=14):
    """Levels, and texture coordinates with ``share_bits`` fraction bits, in texels of these levels.

    They reach over 6 images each way. Every fifth is at the centre or the border of a texel.
    """
    height, width, _ = texture.texels.shape
    level = rng.integers(0, len(texture.levels), count)
    size = np.maximum(np.array([width, height]) >> level[:, np.newaxis], 1)
    codes = rng.integers(-3 * size << share_bits, 3 * size << share_bits)
    codes[::5] &= -1 << (share_bits - 1)
    return level, codes, size


def sampled(sampler, texture, codes, level):
    """Colours of a texture that stands behind another texture in the memory."""
    loaded = sampler.memory.load([WHITE, texture])
    coordinates = Fixed(sampler.address.coordinate_format, codes)
    return sampler.sample(loaded, loaded.descriptors[1], coordinates, level)


@pytest.mark.parametrize("filter", ["bilinear", "nearest"])
@pytest.mark.parametrize("kind", ["any", "checker", "dark"])
def test_error_against_the_exact_rule(kind, filter):
    """With all sizes, wraps and levels, only the arithmetic and the rounding of texels make errors."""
    rng = np.random.default_rng(17)
    quantised = 2.0**-12 if kind == "any" else 2.0**-15
    for size, *wrap in product(SIZES, WRAPS, WRAPS):
        texture = Texture(image(rng, kind, *size), tuple(wrap), filter)
        level, codes, sides = places(rng, texture, 150)
        found = sampled(SAMPLER, texture, codes, level).values
        off = np.abs(found - texture.sample(codes * 2.0**-14 / sides, level)).max()
        assert off <= TextureFilter.ERROR + quantised, (size, wrap)


def test_error_of_the_arithmetic():
    """If texels are codes, only the arithmetic makes errors. The bound is not far above them."""
    rng = np.random.default_rng(21)
    worst = 0
    for _ in range(20):
        texels = TexelMemory.linear(rng.integers(0, 1 << TexelMemory.CHANNEL_BITS, (64, 64, 3)))
        texture = Texture(texels, mipmapped=False)
        level, codes, sides = places(rng, texture, 2000)
        found = sampled(SAMPLER, texture, codes, level).values
        worst = max(worst, np.abs(found - texture.sample(codes * 2.0**-14 / sides, level)).max())
    assert 0.6 * TextureFilter.ERROR <= worst <= TextureFilter.ERROR


@pytest.mark.parametrize(("wrap", "mode"), [("repeat", "wrap"), ("mirror", "symmetric"), ("clamp", "edge")])
def test_wraps_as_padded_images(wrap, mode):
    """Samples are compared with means of neighbours in an image that NumPy has padded."""
    rng = np.random.default_rng(22)
    for width, height in ((1, 1), (2, 1), (4, 2), (8, 8)):
        texels = TexelMemory.linear(rng.integers(0, 1 << TexelMemory.CHANNEL_BITS, (height, width, 3)))
        pad = 3 * max(width, height) + 1
        padded = np.pad(texels, ((pad, pad), (pad, pad), (0, 0)), mode)
        shares = rng.integers(0, 1 << 14, (300, 2))
        first = rng.integers(1 - pad, pad, (300, 2))
        texture = Texture(texels, (wrap, wrap), mipmapped=False)
        codes = (first << 14) + shares + (1 << 13)
        found = sampled(SAMPLER, texture, codes, np.zeros(300, dtype=np.int64)).values
        (x, y), (s, t) = first.T + pad, shares.T[:, :, np.newaxis] * 2.0**-14
        upper, lower = (padded[row, x] * (1 - s) + padded[row, x + 1] * s for row in (y, y + 1))
        assert np.abs(found - (upper * (1 - t) + lower * t)).max() <= TextureFilter.ERROR


@pytest.mark.parametrize("share_bits", [8, 14])
def test_error_of_rounded_coordinates_in_proportion_to_contrast(share_bits):
    rng = np.random.default_rng(18)
    sampler = TextureSampler(SAMPLER.memory, share_bits)
    steps = []
    for contrast in (1, 0.1):
        texels = 0.05 + contrast * 0.95 * image(rng, "checker", 16, 16)
        texture = Texture(texels, mipmapped=False)
        place = rng.uniform(-16, 32, (4000, 2))
        level = np.zeros(len(place), dtype=np.int64)
        codes = np.rint(place * 2**share_bits).astype(np.int64)
        found = sampled(sampler, texture, codes, level).values
        off = np.abs(found - texture.sample(place / 16, level)).max() - TextureFilter.ERROR - 2.0**-12
        assert off <= 2 * 2.0 ** -(share_bits + 1) * contrast * 0.95
        steps.append(off)
    # With few bits the rounding of shares is most of the error.
    assert share_bits > 8 or steps[0] > 2.0**-9


def test_flat_images_are_exact():
    """With an image of a single code, every sample is the colour nearest to the texel. 1 is exactly 1."""
    rng = np.random.default_rng(19)
    code = np.arange(1 << TexelMemory.CHANNEL_BITS)
    texels = np.broadcast_to(code[:, np.newaxis, np.newaxis], (len(code), 4, 3))
    format = SAMPLER.address.weight_format
    found = [
        SAMPLER.filter.compute(texels, Fixed(format, rng.integers(0, (1 << 14) + 1, (len(code), 2)))).codes
        for _ in range(4)
    ]
    assert (np.array(found) == found[0][:, :1]).all()
    assert np.abs(found[0][:, 0] * 2.0**-16 - TexelMemory.linear(code)).max() <= 2.0**-17
    assert found[0][-1, 0] == 1 << 16
    assert found[0][0, 0] == 0


def test_nearest_alone_is_the_same():
    """A sampler for ``nearest`` alone, with weights of one bit, gives the same texels."""
    rng = np.random.default_rng(20)
    texture = Texture(image(rng, "any", 16, 8), ("mirror", "clamp"), "nearest")
    level, codes, _ = places(rng, texture, 500)
    alone = TextureSampler(SAMPLER.memory, bilinear=False)
    assert alone.address.weight_format.width == 1
    found = sampled(alone, texture, codes, level)
    np.testing.assert_array_equal(found.codes, sampled(SAMPLER, texture, codes, level).codes)
