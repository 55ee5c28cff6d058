"""Textures and places for records: any sizes, wraps and levels."""

import numpy as np

from blysk.golden.albedo.texel_memory import TexelMemory, TextureDescriptor
from blysk.golden.reference.texture import FILTERS, WRAPS, Texture

__all__ = ["any_descriptor", "any_places", "any_texture", "of_descriptor"]


def any_descriptor(rng: np.random.Generator, memory: TexelMemory, largest: int = 10) -> TextureDescriptor:
    """A descriptor with any wraps, any base, and sides up to 2^largest. All of its levels fit the memory."""
    most = memory.address_bits - 1
    while True:
        sides = rng.integers(0, largest + 1, 2)
        if np.maximum(sides - 1, 0).sum() <= most:
            break
    width, height = sides.tolist()
    wrap = tuple(rng.integers(0, len(WRAPS), 2).tolist())
    base = int(rng.integers(max(memory.depth // 2, 1)))
    return TextureDescriptor(width, height, wrap, bool(rng.random() < 0.2), base)


def of_descriptor(descriptor: TextureDescriptor) -> dict[str, object]:
    """A descriptor as constants of a unit."""
    names = ("width", "height", "wrap", "nearest", "base")
    return {name: getattr(descriptor, name) for name in names}


def any_texture(rng: np.random.Generator, largest: int) -> Texture:
    """A texture with any wraps and filter, and sides up to 2^largest. Some texels are 0 or 1."""
    width, height = 1 << rng.integers(0, largest + 1, 2)
    texels = rng.random((height, width, 3)) ** rng.choice([1, 6])
    texels[rng.random((height, width)) < 0.3] = rng.integers(0, 2, 3)
    wrap = tuple(rng.choice(WRAPS, 2).tolist())
    return Texture(texels, wrap, str(rng.choice(FILTERS, p=[0.8, 0.2])), bool(rng.random() < 0.8))


def any_places(rng: np.random.Generator, model, descriptor, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Codes of coordinates of places, and a level of the texture for each place.

    Most places are up to three images away in both directions. A fifth are at the centre or border of a
    texel, or next to it. A tenth are anywhere in the format.
    """
    format = model.coordinate_format
    last = max(descriptor.width, descriptor.height)
    level = rng.integers(0, last + 1, count)
    sides = np.maximum(np.array([descriptor.width, descriptor.height]) - level[:, np.newaxis], 0)
    size = 1 << (sides + format.fraction_bits)
    codes = rng.integers(-3 * size, 3 * size)
    codes[::5] &= -1 << (format.fraction_bits - 1)
    codes[::10] += rng.integers(-1, 2, codes[::10].shape)
    codes[1::10] = rng.integers(format.min_code, format.max_code, codes[1::10].shape, endpoint=True)
    return np.clip(codes, format.min_code, format.max_code), level
