"""The albedo path of a pipeline: the colour of the surface at every pixel, and its bit-accurate model."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans, SpanAttributes
from blysk.golden.albedo.attributes import Attributes
from blysk.golden.albedo.texel_memory import LoadedTextures, TexelMemory, TextureDescriptor
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.spans import pixels_of

__all__ = ["Albedo"]


@dataclass(frozen=True)
class Albedo:
    """Albedo of every pixel: vertex colour times colour of the texture.

    Spans become words of each pixel, words become attributes, and texture coordinates become a colour of the
    texture. If there are both colours, their product is rounded to 16 fraction bits.

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

    PARTS: ClassVar[dict[str, str]] = {
        "colors": "vertex colours",
        "nearest": "textures of one texel a sample",
        "bilinear": "textures with the mean of four texels",
        "outside": "texels in a memory outside of the core",
        "tinted": "metals, whose colour also multiplies the highlight",
        "orthographic": "only for cameras without perspective",
    }
    """Words that `of_parts` takes, with their meanings."""

    def __post_init__(self) -> None:
        if not (self.colors or self.texture):
            raise ValueError("an albedo needs vertex colours or textures")

    @classmethod
    def of_parts(cls, parts: Collection[str]) -> "Albedo":
        """The albedo path that some words describe.

        Parameters
        ----------
        parts : collection of str
            Words of `PARTS`. Attributes of an orthographic camera are not divided by W.

        Raises
        ------
        ValueError
            If the words exclude each other, or need another word. The message ends in a remedy, after a
            semicolon.
        """
        textured = not {"nearest", "bilinear"}.isdisjoint(parts)
        if {"nearest", "bilinear"} <= set(parts):
            raise ValueError("a bilinear unit also serves nearest textures; leave out nearest")
        if "outside" in parts and not textured:
            raise ValueError("texels need textures; also give nearest or bilinear")
        if not textured and "colors" not in parts:
            raise ValueError("there is no colour of a pixel; also give colors, nearest or bilinear")
        memory = TexelMemory(external="outside" in parts)
        texture = TextureSampler(memory, bilinear="bilinear" in parts) if textured else None
        return cls("colors" in parts, texture, "orthographic" not in parts, "tinted" in parts)

    @property
    def parts(self) -> tuple[str, ...]:
        """The words that describe this albedo path, see `of_parts`."""
        texture = self.texture
        has = (
            self.colors,
            texture is not None and not texture.bilinear,
            texture is not None and texture.bilinear,
            texture is not None and texture.memory.external,
            self.tints,
            not self.perspective,
        )
        return tuple(word for word, given in zip(self.PARTS, has, strict=True) if given)

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
            Contents of the texel memory; only with textures. By default the texels that are fixed.

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
        texels = texels or self.texture.memory.fixed
        if texels is None or not textures:
            raise ValueError("an albedo with textures needs texels and a texture of each material")
        assert found.coordinates is not None
        assert found.level is not None
        of_pixel = material[pixels_of(length)[0]]
        codes = np.empty((len(of_pixel), 3), dtype=np.int64)
        for index in np.unique(of_pixel):
            chosen = of_pixel == index
            places = found.coordinates[chosen], found.level[chosen]
            codes[chosen] = self.texture.sample(texels, textures[index], *places).codes
        sampled = Fixed(self.FORMAT, codes)
        if found.colors is None:
            return sampled
        product = (found.colors * sampled).round_half_up(self.FORMAT.fraction_bits)
        # Neither factor is over 1.
        return Fixed(self.FORMAT, product.codes)
