"""Texel memory: codes of texels, places of levels, and the writes that load it."""

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest

from blysk.golden.albedo.texel_memory import TexelMemory, levels_placed
from blysk.golden.reference.texture import Texture

MEMORY = TexelMemory()


def test_codes_are_the_nearest():
    """Codes are off by at most half a step, and by 0.1 LSB of sRGB. 0 and 1 are exact."""
    linear = np.linspace(0, 1, 200_001)
    code = TexelMemory.encode(linear)
    off = np.abs(TexelMemory.linear(code) - linear)
    known = np.sort(TexelMemory.linear(np.arange(1 << TexelMemory.CHANNEL_BITS)))
    nearest = np.searchsorted(known, linear).clip(1)
    best = np.minimum(np.abs(known[nearest] - linear), np.abs(known[nearest - 1] - linear))
    np.testing.assert_allclose(off, best, atol=1e-12)
    assert off[linear < 0.1249].max() <= 2.0**-15 * (1 + 2.0**-13)
    assert off.max() <= 2.0**-12 * (1 + 2.0**-13)
    assert TexelMemory.linear(code[[0, -1]]).tolist() == [0, 1]

    def encoded(x):
        return 255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)

    assert np.abs(encoded(TexelMemory.linear(code)) - encoded(linear)).max() <= 0.101


def test_levels_do_not_overlap():
    """For every size no word of a bank is in two levels, and the last level ends at the number of words."""
    for width, height in product(2 ** np.arange(11), repeat=2):
        levels = int(max(width, height)).bit_length()
        places, words = levels_placed(int(width), int(height), levels)
        order = sorted(places)
        assert order[0][0] == 0
        assert all(first + size <= after for (first, size), (after, _) in pairwise(order))
        assert order[-1][0] + order[-1][1] == words
        assert words <= 2 * places[0][1]


def test_several_textures():
    """Several textures share gaps and keep their texels. A texture that is given twice is stored once."""
    rng = np.random.default_rng(3)
    sizes = ((1, 1), (64, 64), (2, 2), (8, 16), (1, 32))
    textures = [Texture(rng.random((height, width, 3))) for width, height in sizes]
    loaded = MEMORY.load([*textures, textures[1], replace(textures[1], alpha=np.ones((64, 64)))])
    assert loaded.descriptors[1] == loaded.descriptors[-1] == loaded.descriptors[-2]
    assert len(loaded.codes) == 1536
    for texture, descriptor in zip(textures, loaded.descriptors, strict=False):
        height, width, _ = texture.texels.shape
        places, _ = levels_placed(width, height, len(texture.levels))
        for (first, size), image in zip(places, texture.levels, strict=True):
            words = loaded.codes[2 * descriptor.base + first :][:size]
            rows, columns = max(image.shape[0] // 2, 1), max(image.shape[1] // 2, 1)
            banks = words.reshape(rows, columns, 2, 2, 3).transpose(0, 2, 1, 3, 4)
            whole = banks.reshape(2 * rows, 2 * columns, 3)[: image.shape[0], : image.shape[1]]
            np.testing.assert_array_equal(whole, TexelMemory.encode(image))


def test_the_smallest_memory_has_its_textures_fixed():
    textures = [Texture(np.full((8, 8, 3), 0.5), mipmapped=False), Texture(np.ones((2, 2, 3)))]
    memory = TexelMemory.holding(textures)
    assert memory.depth == len(memory.fixed.codes) < 24
    assert not memory.written
    np.testing.assert_array_equal(memory.load(textures).codes, memory.fixed.codes)


def test_writes():
    texture = Texture(np.arange(12).reshape(2, 2, 3) / 12)
    loaded = MEMORY.load([texture])
    beats = loaded.writes()
    assert beats["begins"].tolist() == [1] + 8 * len(loaded.codes) * [0]
    low, high = beats["value"][1:].reshape(-1, 4, 2).transpose(2, 0, 1)
    np.testing.assert_array_equal(low | high << 18, loaded.words)
    assert loaded.descriptors[0].words == (0x11, 0)


@pytest.mark.parametrize(
    ("memory", "side", "message"),
    [
        (
            MEMORY,
            128,
            r"^a texture of 128x128 texels needs 6144 words of each of 4 banks, and a bank has 1536, for a "
            r"texture of 64x64 texels; take smaller images or a deeper memory$",
        ),
        (
            TexelMemory(2),
            4,
            r"needs 6 words of each of 4 banks, and a bank has 2, for a texture of 2x2 texels;",
        ),
    ],
)
def test_too_large_a_texture_is_refused(memory, side, message):
    side_that_fits = memory.fitting()
    memory.load([Texture(np.zeros((side_that_fits, side_that_fits, 3)))])
    with pytest.raises(ValueError, match=message):
        memory.load([Texture(np.zeros((side, side, 3)))])


def test_bad_arguments_are_refused():
    with pytest.raises(
        ValueError, match=r"^2 textures need 3584 words of each of 4 banks, and a bank has 2000"
    ):
        TexelMemory(2000).load([Texture(np.zeros((64, 64, 3))) for _ in range(2)])
    with pytest.raises(ValueError, match=r"^a texel memory needs a texture$"):
        MEMORY.load([])
    for depth, external in ((2, False), (24, True)):
        with pytest.raises(ValueError, match=r"^fixed texels must be inside"):
            TexelMemory(depth, external, TexelMemory.holding([Texture(np.zeros((4, 4, 3)))]).fixed)
    for depth in (1, 2**19 + 1):
        with pytest.raises(ValueError, match=rf"^a bank of texels must have 2 to 524288 words, not {depth}$"):
            TexelMemory(depth)
