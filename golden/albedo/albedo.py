"""The albedo path of a pipeline: the colour of the surface at every pixel, and its bit-accurate model."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans, SpanAttributes
from blysk.golden.albedo.attributes import Attributes
from blysk.golden.albedo.texel_memory import LoadedTextures, TextureDescriptor
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.spans import pixels_of

__all__ = ["Albedo"]


@dataclass(frozen=True)
class Albedo:
    """Albedo of every pixel: vertex colour times colour of the texture.

    Spans become words of each pixel, words become attributes, and texture coordinates become a colour of the
    texture. With both colours their product is rounded to 16 fraction bits.

    Parameters
    ----------
    colors : bool
        Whether there are vertex colours.
    texture : TextureSampler or None
        Model of the texture unit; ``None``: no textures.
    perspective : bool
        Whether attributes are divided by W.
    tints : bool
        Whether materials may be tinted, see `Intensity`.

    Raises
    ------
    ValueError
        If there are neither colours nor textures.

    Source: docs/theory/textures.md.
    """

    colors: bool = True
    texture: TextureSampler | None = None
    perspective: bool = True
    tints: bool = False

    FORMAT = UQ(1, 16)

    def __post_init__(self) -> None:
        if not (self.colors or self.texture):
            raise ValueError("an albedo needs vertex colours or textures")

    @property
    def has_product(self) -> bool:
        """Whether a vertex colour multiplies the colour of a texture."""
        return self.colors and self.texture is not None

    @cached_property
    def spans(self) -> AttributeSpans:
        """Model of the words of each pixel."""
        return AttributeSpans(self.colors, self.texture is not None, self.perspective)

    @cached_property
    def attributes(self) -> Attributes:
        """Model of the attributes of each pixel."""
        return Attributes(self.spans, *([] if self.texture is None else [self.texture.share_bits]))

    def compute(
        self,
        spans: SpanAttributes,
        length: np.ndarray,
        material: np.ndarray,
        textures: Sequence[TextureDescriptor] = (),
        texels: LoadedTextures | None = None,
    ) -> Fixed:
        """Bit-accurate albedo of every pixel, in the order of the spans.

        Parameters
        ----------
        spans : SpanAttributes
            The spans.
        length : int array, shape (spans,)
            Pixels of each span, 1 or more.
        material : int array, shape (spans,)
            Material of each span.
        textures : sequence of TextureDescriptor
            Texture of each material; only with textures.
        texels : LoadedTextures, optional
            Contents of the texel memory; only with textures.

        Returns
        -------
        Fixed, shape (pixels, 3), UQ(1, 16)

        Raises
        ------
        ValueError
            If a code is out of range, or textures are missing.
        """
        found = self.attributes.compute(self.spans.compute(spans, length))
        if self.texture is None:
            assert found.colors is not None
            return found.colors
        if texels is None or not textures:
            raise ValueError("an albedo with textures needs texels and a texture of each material")
        assert found.coordinates is not None
        assert found.level is not None
        of_pixel = material[pixels_of(length)[0]]
        codes = np.empty((len(of_pixel), 3), dtype=np.int64)
        for index in np.unique(of_pixel):
            own = of_pixel == index
            places = found.coordinates[own], found.level[own]
            codes[own] = self.texture.sample(texels, textures[index], *places).codes
        sampled = Fixed(self.FORMAT, codes)
        if found.colors is None:
            return sampled
        product = (found.colors * sampled).round_half_up(self.FORMAT.fraction_bits)
        # Neither factor is over 1.
        return Fixed(self.FORMAT, product.codes)
