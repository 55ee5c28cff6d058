"""Bit-accurate model of the texel memory: four banks of texels in linear light."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from blysk.golden.number.fixed import UQ
from blysk.golden.reference.texture import LARGEST_TEXTURE, WRAPS, Texture

__all__ = ["BANKS", "LEVEL_BITS", "LoadedTextures", "TexelMemory", "TextureDescriptor", "levels_placed"]

BANKS = 4
"""Number of banks. The texel in column i and row j is in bank ``i mod 2 + 2 (j mod 2)``."""

LEVEL_BITS = 4
"""Bits of a level, and of the logarithm of a width or height."""

_WIDTHS = (LEVEL_BITS, LEVEL_BITS, 2, 2, 1)
_PLACES = tuple(accumulate(_WIDTHS[:-1], initial=0))
"""Bits of width, height, both wraps and ``nearest`` in the first word of a descriptor, and their places."""

_BASE_UNIT = 2
"""Words of a bank in one unit of a base, or of an index."""


def levels_placed(width: int, height: int, levels: int) -> tuple[list[tuple[int, int]], int]:
    """Place of each level in a bank, from the base of the texture on.

    A level of w by h texels has ``S = max(w/2, 1) max(h/2, 1)`` words in a bank. Level 0 is at 0. The
    others follow from its end, S_0, on: level l at S_0 + S_l, and the level of a single texel at S_0.

    Parameters
    ----------
    width, height : int
        Texels of level 0, powers of two.
    levels : int
        Number of levels that are used.

    Returns
    -------
    places : list of (int, int)
        First word and number of words of each level.
    words : int
        Words of a bank up to the last level's end.

    Source: docs/theory/textures.md#memory.
    """
    places: list[tuple[int, int]] = []
    for level in range(levels):
        columns, rows = max(width >> level, 1), max(height >> level, 1)
        size = max(columns // 2, 1) * max(rows // 2, 1)
        first = places[0][1] if level else 0
        if level and (columns, rows) != (1, 1):
            first += size
        places.append((first, size))
    return places, max(first + size for first, size in places)


@dataclass(frozen=True)
class TextureDescriptor:
    """What the hardware knows of a texture: frame constants of its material.

    Parameters
    ----------
    width, height : int
        Logarithms of the width and height of level 0, 0 to 10.
    wrap : pair of int
        Index in `WRAPS`, of u and of v.
    nearest : bool
        Whether a sample is one texel.
    base : int
        First word of the texture in each bank, in pairs of words, 18 bits.
    """

    width: int
    height: int
    wrap: tuple[int, int] = (0, 0)
    nearest: bool = False
    base: int = 0

    @property
    def words(self) -> tuple[int, int]:
        """The two frame constants, 18 bits each.

        The first has width in bits 0 to 3, height in 4 to 7, wrap of u in 8 to 9 and of v in 10 to 11, and
        ``nearest`` in bit 12. The second is the base.
        """
        fields = (self.width, self.height, *self.wrap, int(self.nearest))
        return sum(value << place for value, place in zip(fields, _PLACES, strict=True)), self.base

    @classmethod
    def of_words(cls, first: int, base: int) -> "TextureDescriptor":
        """The descriptor of two words."""
        fields = zip(_PLACES, _WIDTHS, strict=True)
        width, height, *wrap, nearest = (first >> place & (1 << bits) - 1 for place, bits in fields)
        return cls(width, height, (wrap[0], wrap[1]), bool(nearest), base)


@dataclass(frozen=True, eq=False)
class LoadedTextures:
    """Contents of a texel memory.

    Parameters
    ----------
    codes : int64 array, shape (words, 4, 3)
        Texels of each word of the four banks: codes of red, green, blue.
    descriptors : tuple of TextureDescriptor
        Descriptor of each texture.
    """

    codes: np.ndarray
    descriptors: tuple[TextureDescriptor, ...]

    @property
    def words(self) -> np.ndarray:
        """Words of the banks, shape (words, 4), 36 bits. From the lowest bit up: red, green, blue."""
        bits = TexelMemory.CHANNEL_BITS
        red, green, blue = np.moveaxis(self.codes, -1, 0)
        found: np.ndarray = red | green << bits | blue << 2 * bits
        return found

    def writes(self) -> dict[str, np.ndarray]:
        """Beats that load the memory: ``value`` of 18 bits, and ``begins``.

        A value with ``begins`` is an index, in pairs of words. The values behind it are halves of words, from
        this index on. At each index the words of banks 0 to 3 follow one another. The lower 18 bits of a
        word come first, then the upper 18 bits.
        """
        halves = self.words[:, :, np.newaxis] >> np.array([0, 18]) & 0x3FFFF
        value = np.r_[0, halves.ravel()]
        return {"value": value, "begins": (np.arange(len(value)) == 0).astype(np.int64)}


@dataclass(frozen=True)
class TexelMemory:
    """Four banks of texels: any 2 by 2 neighbours are in different banks, and are read at once.

    *Code.* A channel has 12 bits: 11 bits of a number, and above them a bit for the size of its step. In
    units of 2^-14, a fine code c stands for c, up to 1/8. A coarse code c stands for ``8 c + 7``. These
    values are in linear light, times ``1 - 2^-14``: the filter divides by this factor at its end, so that the
    largest code is exactly 1. Up to 1/8 a texel is off by at most 2^-15, above 1/8 by at most 2^-12. After
    the transfer of sRGB both errors are at most 0.101 LSB. Equal steps of 2^-12 would be off by 0.4 LSB near
    black.

    Parameters
    ----------
    depth : int
        Words of each bank, `LEAST` to `LARGEST`.
    external : bool
        Whether the memory is outside of the design, behind streams of requests and responses.
    fixed : LoadedTextures or None
        Contents that are fixed at build time. ``None``: the texels are written.

    Raises
    ------
    ValueError
        If the depth is out of range. If the fixed contents are longer, or the memory is outside.

    Source: docs/theory/textures.md#memory; not in the documents.
    """

    depth: int = 1536
    external: bool = False
    fixed: LoadedTextures | None = None

    CHANNEL_BITS = 12
    COARSE_SHIFT = 3
    VALUE_FORMAT = UQ(0, 14)
    WORD_BITS = 3 * CHANNEL_BITS
    LEAST, LARGEST = 2, 1 << 19

    def __post_init__(self) -> None:
        if not self.LEAST <= self.depth <= self.LARGEST:
            raise ValueError(
                f"a bank of texels must have {self.LEAST} to {self.LARGEST} words, not {self.depth}"
            )
        if self.fixed is not None and (self.external or len(self.fixed.codes) > self.depth):
            raise ValueError("fixed texels must be inside, and at most as many as the memory has words")

    @classmethod
    def holding(cls, textures: Sequence[Texture]) -> "TexelMemory":
        """The smallest memory that holds some textures, with the textures fixed at build time.

        Raises
        ------
        ValueError
            As `load`.
        """
        loaded = cls(cls.LARGEST).load(textures)
        return cls(max(len(loaded.codes), cls.LEAST), fixed=loaded)

    @property
    def written(self) -> bool:
        """Whether texels are written by frame constants."""
        return not self.external and self.fixed is None

    @property
    def address_bits(self) -> int:
        """Bits of the address of a word in a bank."""
        return (self.depth - 1).bit_length()

    @classmethod
    def values(cls, codes: np.ndarray) -> np.ndarray:
        """Codes of `VALUE_FORMAT` from codes of channels."""
        low = codes & ((1 << (cls.CHANNEL_BITS - 1)) - 1)
        coarse = (low << cls.COARSE_SHIFT) | ((1 << cls.COARSE_SHIFT) - 1)
        return np.where(codes >> (cls.CHANNEL_BITS - 1), coarse, low)

    @classmethod
    def linear(cls, codes: np.ndarray) -> np.ndarray:
        """Linear light, 0 to 1 in float64, from codes of channels."""
        return cls.values(codes) / cls.VALUE_FORMAT.max_code

    @classmethod
    def encode(cls, linear: np.ndarray) -> np.ndarray:
        """Codes of channels nearest to linear light, 0 to 1."""
        bits, step = cls.CHANNEL_BITS - 1, 1 << cls.COARSE_SHIFT
        value = np.asarray(linear, dtype=np.float64) * cls.VALUE_FORMAT.max_code
        fine = np.rint(value).astype(np.int64)
        coarse = np.rint((value - (step - 1)) / step).astype(np.int64)
        return np.where(fine < 1 << bits, fine, coarse | 1 << bits)

    def fitting(self, mipmapped: bool = True) -> int:
        """Width of the largest square texture that fits an empty memory."""
        side = 1
        while side < LARGEST_TEXTURE:
            levels = (2 * side).bit_length() if mipmapped else 1
            if levels_placed(2 * side, 2 * side, levels)[1] > self.depth:
                break
            side *= 2
        return side

    def load(self, textures: Sequence[Texture]) -> LoadedTextures:
        """Contents with all levels of some textures. Textures with the same array of texels are stored once.

        A base is a multiple of the power of two that holds the texture. So an address is the bits of a base
        and other bits below them, without an addition.

        Parameters
        ----------
        textures : sequence of Texture
            The textures, one or more.

        Raises
        ------
        ValueError
            If the textures do not fit.
        """
        if not textures:
            raise ValueError("a texel memory needs a texture")
        places: dict[tuple[int, bool], tuple[Texture, np.ndarray]] = {}
        for texture in textures:
            levels, words = self._placed(texture)
            taken = np.zeros(words, dtype=bool)
            for first, size in levels:
                taken[first : first + size] = True
            places[_stored(texture)] = texture, taken
        grids = {
            key: max(1 << (len(taken) - 1).bit_length(), _BASE_UNIT) for key, (_, taken) in places.items()
        }
        used = np.zeros(sum(grids.values()) + max(grids.values()), dtype=bool)
        bases: dict[tuple[int, bool], int] = {}
        for key, (_, taken) in sorted(places.items(), key=lambda item: -len(item[1][1])):
            base = 0
            while (used[base : base + len(taken)] & taken).any():
                base += grids[key]
            used[base : base + len(taken)] |= taken
            bases[key] = base
        words = int(np.flatnonzero(used)[-1]) + 1
        if words > self.depth:
            raise ValueError(self._does_not_fit([texture for texture, _ in places.values()], words))
        codes = np.zeros((words, BANKS, 3), dtype=np.int64)
        for key, (texture, _) in places.items():
            for (first, _), image in zip(self._placed(texture)[0], texture.levels, strict=True):
                rows, columns = np.indices(image.shape[:2])
                stride = max(image.shape[1] // 2, 1)
                address = bases[key] + first + rows // 2 * stride + columns // 2
                codes[address, columns % 2 + 2 * (rows % 2)] = self.encode(image)
        return LoadedTextures(codes, tuple(_descriptor(t, bases[_stored(t)]) for t in textures))

    @staticmethod
    def _placed(texture: Texture) -> tuple[list[tuple[int, int]], int]:
        height, width, _ = texture.texels.shape
        return levels_placed(width, height, len(texture.levels))

    def _does_not_fit(self, textures: Sequence[Texture], words: int) -> str:
        """Message with the number of words that the textures need, and the size of a texture that fits."""
        height, width, _ = textures[0].texels.shape
        what = f"a texture of {width}x{height} texels needs"
        if len(textures) > 1:
            what = f"{len(textures)} textures need"
        side = self.fitting(any(len(texture.levels) > 1 for texture in textures))
        return (
            f"{what} {words} words of each of {BANKS} banks, and a bank has {self.depth}, for a texture of "
            f"{side}x{side} texels; take smaller images or a deeper memory"
        )

    @staticmethod
    def read(loaded: LoadedTextures, address: np.ndarray) -> np.ndarray:
        """Texels of the four banks.

        Parameters
        ----------
        loaded : LoadedTextures
            Contents.
        address : int64 array, shape (places, 4)
            Address in each bank.

        Returns
        -------
        int64 array, shape (places, 4, 3)
            Codes of channels. Words behind the last texture are 0.
        """
        inside = address < len(loaded.codes)
        found = loaded.codes[np.where(inside, address, 0), np.arange(BANKS)]
        return np.where(inside[..., np.newaxis], found, 0)


def _stored(texture: Texture) -> tuple[int, bool]:
    """Key of the levels of a texture: its array of texels, and whether it has several levels."""
    return id(texture.texels), texture.mipmapped


def _descriptor(texture: Texture, base: int) -> TextureDescriptor:
    height, width, _ = texture.texels.shape
    wrap = WRAPS.index(texture.wrap[0]), WRAPS.index(texture.wrap[1])
    sides = width.bit_length() - 1, height.bit_length() - 1
    return TextureDescriptor(*sides, wrap, texture.filter == "nearest", base // _BASE_UNIT)
