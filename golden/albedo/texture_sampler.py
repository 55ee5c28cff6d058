"""Bit-accurate model of the texture sampler: address, memory and filter."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from blysk.golden.albedo.texel_memory import LoadedTextures, TexelMemory, TextureDescriptor
from blysk.golden.albedo.texture_address import TextureAddress
from blysk.golden.albedo.texture_filter import TextureFilter
from blysk.golden.number.fixed import Fixed

__all__ = ["TextureSampler"]


@dataclass(frozen=True)
class TextureSampler:
    """Colours of a texture at places of a surface.

    Against `Texture.sample` of the same level a colour is off by at most the sum of

    - `TextureFilter.ERROR`, the rounding of the arithmetic,
    - the largest rounding of the four texels, see `TexelMemory`,
    - for a coordinate that is off by e texels, e times the difference of neighbours along its axis.

    Parameters
    ----------
    memory : TexelMemory
        The memory.
    share_bits : int
        Fraction bits of a coordinate, 8 to 14. A coordinate that is rounded to them is off by
        ``2^-(share_bits + 1)``.
    bilinear : bool
        Whether there are textures with another filter than ``nearest``.

    Source: docs/theory/textures.md#texture-unit; not in the documents.
    """

    memory: TexelMemory = field(default_factory=TexelMemory)
    share_bits: int = 14
    bilinear: bool = True

    @cached_property
    def address(self) -> TextureAddress:
        """Model of the addresses."""
        return TextureAddress(self.memory, self.share_bits, self.bilinear)

    @cached_property
    def filter(self) -> TextureFilter:
        """Model of the filter."""
        return TextureFilter(self.share_bits, self.bilinear)

    def sample(
        self, loaded: LoadedTextures, descriptor: TextureDescriptor, coordinates: Fixed, level: np.ndarray
    ) -> Fixed:
        """Bit-accurate colours.

        Parameters
        ----------
        loaded : LoadedTextures
            Contents of the memory.
        descriptor : TextureDescriptor
            The texture, one of ``loaded.descriptors``.
        coordinates : Fixed, shape (places, 2), `TextureAddress.coordinate_format`
            u and v, in texels of the level.
        level : int64 array, shape (places,)
            Level of each place.

        Returns
        -------
        Fixed, shape (places, 3), UQ(1, 16)
        """
        address, weight = self.address.compute(descriptor, coordinates, level)
        return self.filter.compute(self.memory.read(loaded, address), weight)
