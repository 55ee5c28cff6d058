"""Bit-accurate model of the texture address: where the four texels of a sample are, and their weights."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from blysk.golden.albedo.texel_memory import BANKS, TexelMemory, TextureDescriptor
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.reference.texture import WRAPS, wrapped

__all__ = ["BankAddresses", "TextureAddress"]


class BankAddresses(NamedTuple):
    """Addresses of a sample, and weights.

    Parameters
    ----------
    address : int64 array, shape (places, 4)
        Address in each bank.
    weight : Fixed, shape (places, 2)
        Weight of the banks of odd columns, and of the banks of odd rows, 0 to 1. The banks of even columns
        and rows have the rest.
    """

    address: np.ndarray
    weight: Fixed


@dataclass(frozen=True)
class TextureAddress:
    """From texture coordinates in texels of a level to an address in each bank, and two weights.

    ``first = floor(coordinate - 1/2)`` is the column (row) left of (over) the place. The fraction is the
    share of the next column. Both columns are wrapped. One column is even and the other odd, so each bank
    gets one address. If both are the same texel (at a border, or of an image of one texel), the share counts
    as 0. A sample of ``nearest`` has ``first = floor(coordinate)`` and the share 0. The weight of the odd
    column is the share if ``first`` is even, else 1 less the share.

    An address is ``base + place of the level + (row/2) (width/2) + column/2``, all of them in different bits.

    Coordinates have the format `coordinate_format`. ``repeat`` and ``mirror`` have a period of at most 2048
    texels, so coordinates may wrap. With ``clamp`` they have to stay in the format.

    Parameters
    ----------
    memory : TexelMemory
        Memory, with the bits of an address.
    share_bits : int
        Fraction bits of a coordinate, and of a weight, 8 to 14.
    bilinear : bool
        Whether there are textures with another filter than ``nearest``. If not, a weight is 0 or 1, and has
        one bit.

    Raises
    ------
    ValueError
        If the share's bits are out of range.

    Source: docs/theory/textures.md#addresses; not in the documents.
    """

    memory: TexelMemory = field(default_factory=TexelMemory)
    share_bits: int = 14
    bilinear: bool = True

    INTEGER_BITS = 13

    def __post_init__(self) -> None:
        if not 8 <= self.share_bits <= 14:
            raise ValueError(f"share_bits must be 8 to 14, not {self.share_bits}")

    @property
    def coordinate_format(self) -> Format:
        """Format of a texture coordinate, in texels of its level."""
        return SQ(self.INTEGER_BITS, self.share_bits)

    @property
    def weight_format(self) -> Format:
        """Format of a weight."""
        return UQ(1, self.share_bits if self.bilinear else 0)

    def compute(self, descriptor: TextureDescriptor, coordinates: Fixed, level: np.ndarray) -> BankAddresses:
        """Bit-accurate addresses and weights.

        Parameters
        ----------
        descriptor : TextureDescriptor
            The texture.
        coordinates : Fixed, shape (places, 2), `coordinate_format`
            u and v, in texels of the level.
        level : int64 array, shape (places,)
            Level of each place, 0 to 15. Levels beyond the level of a single texel count as this level.
        """
        nearest = descriptor.nearest or not self.bilinear
        one = 1 << self.share_bits
        place = coordinates.codes - (0 if nearest else one // 2)
        first, share = place >> self.share_bits, place & (0 if nearest else one - 1)
        low: list[np.ndarray] = []
        sizes: list[np.ndarray] = []
        weight = np.empty(first.shape, dtype=np.int64)
        for axis, logarithm in enumerate((descriptor.width, descriptor.height)):
            sizes.append(np.maximum(logarithm - level, 0))
            wrap = WRAPS[descriptor.wrap[axis]]
            pair = np.stack([wrapped(first[:, axis] + k, 1 << sizes[axis], wrap) for k in (0, self.bilinear)])
            starts_odd = pair[0] % 2
            low.append(np.where(starts_odd, pair[::-1], pair) >> 1)
            fraction = np.where(pair[0] % 2 == pair[1] % 2, 0, share[:, axis])
            weight[:, axis] = np.where(starts_odd, one - fraction, fraction)
        shift = np.maximum(sizes[0] - 1, 0)
        inner = self._place(descriptor, level, *sizes)
        bank = np.arange(BANKS)
        address = low[1][bank >> 1] << shift | low[0][bank & 1] | inner | descriptor.base << 1
        address &= (1 << self.memory.address_bits) - 1
        dropped = 0 if self.bilinear else self.share_bits
        return BankAddresses(address.T, Fixed(self.weight_format, weight >> dropped))

    @staticmethod
    def _place(
        descriptor: TextureDescriptor, level: np.ndarray, width: np.ndarray, height: np.ndarray
    ) -> np.ndarray:
        """First word of each level, from the base on; see `levels_placed`."""
        whole = max(descriptor.width - 1, 0) + max(descriptor.height - 1, 0)
        size = 1 << (np.maximum(width - 1, 0) + np.maximum(height - 1, 0))
        after = (1 << whole) + np.where(width + height > 0, size, 0)
        return np.where(level > 0, after, 0)
