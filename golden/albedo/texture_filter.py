"""Bit-accurate model of the texture filter: a weighted mean of four texels."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.number.fixed import UQ, Fixed

__all__ = ["TextureFilter"]


@dataclass(frozen=True)
class TextureFilter:
    """Mean of four texels by two weights: first along a row, then from row to row.

    Three means ``a + w (b - a)`` a channel are three products. With equal texels, or a weight of 0 or 1, each
    mean is exact. So a flat image gives its colour everywhere, and ``nearest`` needs no other path.

    ============ ========= ==================================================================
    word         format    why
    ============ ========= ==================================================================
    texel        UQ(0, 14) `TexelMemory.values`; 1 is ``1 - 2^-14``
    a, b         UQ(0, 17) with half a step of the colour, whose last rounding is then a cut
    weight       UQ(1, F)  0 to 1
    product      SQ(1, 18) cut
    row          UQ(0, 17) rounded
    mean         UQ(0, 18) cut
    colour       UQ(1, 16) ``mean (1 + 2^-14)``, cut; 0 to 1
    ============ ========= ==================================================================

    A colour is off from the exact mean of the same texels by at most `ERROR`.

    Parameters
    ----------
    share_bits : int
        Fraction bits of a weight.
    bilinear : bool
        Whether there are weights other than 0 and 1. If not, a weight has one bit, and there is no product.

    Source: docs/theory/textures.md#filter; not in the documents.
    """

    share_bits: int = 14
    bilinear: bool = True

    COLOR_FORMAT = UQ(1, 16)
    ROW_FORMAT = UQ(0, 17)
    MEAN_FORMAT = UQ(0, 18)
    ERROR = 5 * 2.0**-18

    def compute(self, texels: np.ndarray, weight: Fixed) -> Fixed:
        """Bit-accurate colours.

        Parameters
        ----------
        texels : int64 array, shape (places, 4, 3)
            Channel codes of the texel from each bank.
        weight : Fixed, shape (places, 2)
            Weights of odd columns and of odd rows, see `TextureAddress`.

        Returns
        -------
        Fixed, shape (places, 3), UQ(1, 16)
        """
        texel = TexelMemory.values(texels) << 3 | 1
        if not self.bilinear:
            bank = weight.codes @ np.array([1, 2])
            return self._color(texel[np.arange(len(bank)), bank] << 1)
        across, down = np.moveaxis(weight.codes[:, :, np.newaxis], 1, 0)
        upper, lower = (
            self._mean(even << 1 | 1, odd, across) >> 1
            for even, odd in (texel[:, :2].swapaxes(0, 1), texel[:, 2:].swapaxes(0, 1))
        )
        return self._color(self._mean(upper << 1, lower, down))

    def _mean(self, start: np.ndarray, end: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Mean of a word of 18 bits and a word of 17 bits. The result has 18 bits."""
        mean: np.ndarray = start + ((end - (start >> 1)) * weight >> (self.share_bits - 1))
        return mean

    def _color(self, mean: np.ndarray) -> Fixed:
        return Fixed(self.COLOR_FORMAT, (mean + (mean >> TexelMemory.VALUE_FORMAT.width)) >> 2)
