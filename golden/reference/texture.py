"""Textures: images on a surface in linear light, and the rule of their samples in float64."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

__all__ = ["FILTERS", "LARGEST_TEXTURE", "WRAPS", "Texture", "wrapped"]

WRAPS = ("repeat", "mirror", "clamp")
"""Ways to find a texel outside the image: as tiles, as tiles that are mirrored in turns, or at its border."""

FILTERS = ("bilinear", "nearest")
"""Ways to find a colour between texel centres: a weighted mean of four texels, or the nearest texel."""

LARGEST_TEXTURE = 1024
"""Largest width and height of a texture, in texels."""


def wrapped(index: np.ndarray, size: int | np.ndarray, wrap: str) -> np.ndarray:
    """Index of a texel inside the image, for an index outside it.

    Parameters
    ----------
    index : int64 array
        Column or row.
    size : int or int64 array
        Columns or rows of the image.
    wrap : str
        One of `WRAPS`.

    Returns
    -------
    int64 array, same shape
        0 to ``size - 1``.
    """
    found: np.ndarray
    if wrap == "clamp":
        found = np.clip(index, 0, size - 1)
    elif wrap == "repeat":
        found = index % size
    else:
        tile = index % (2 * size)
        found = np.minimum(tile, 2 * size - 1 - tile)
    return found


@dataclass(frozen=True, eq=False)
class Texture:
    """An image on a surface, and the rule by which it is sampled.

    Texture coordinates u and v are 0 to 1 from the left to the right border of the image, and from its upper
    to its lower border. Texel (i, j) has its centre at ``u = (i + 1/2)/width``, ``v = (j + 1/2)/height``.

    *Levels.* Level 0 is the image. Each further level has half of the columns and rows, at least one. Its
    texels are the means of the texels that they cover. The last level has one texel.

    Parameters
    ----------
    texels : float64 array, shape (height, width, 3)
        Linear light, 0 to 1. Height and width are powers of two, 1 to `LARGEST_TEXTURE`.
    wrap : pair of str
        Of u and of v, each one of `WRAPS`.
    filter : str
        One of `FILTERS`.
    mipmapped : bool
        Whether smaller images than level 0 are used.
    alpha : float64 array, shape (height, width), optional
        Alpha of the texels, 0 to 1, with the same levels and samples. Empty: none, which is 1.

    Raises
    ------
    ValueError
        If a value is out of range.

    Source: docs/theory/textures.md#samples.
    """

    texels: np.ndarray
    wrap: tuple[str, str] = ("repeat", "repeat")
    filter: str = "bilinear"
    mipmapped: bool = True
    alpha: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        texels = np.asarray(self.texels, dtype=np.float64)
        object.__setattr__(self, "texels", texels)
        if texels.ndim != 3 or texels.shape[2] != 3:
            raise ValueError(f"texels must have shape (height, width, 3), not {texels.shape}")
        for side in texels.shape[:2]:
            if not 1 <= side <= LARGEST_TEXTURE or side & (side - 1):
                raise ValueError(f"a texture's sides must be powers of two to {LARGEST_TEXTURE}, not {side}")
        if not ((texels >= 0) & (texels <= 1)).all():
            raise ValueError("texels must be 0 to 1")
        alpha = np.asarray(self.alpha, dtype=np.float64)
        object.__setattr__(self, "alpha", alpha)
        if alpha.size and alpha.shape != texels.shape[:2]:
            raise ValueError(f"alpha must have shape {texels.shape[:2]}, not {alpha.shape}")
        if not ((alpha >= 0) & (alpha <= 1)).all():
            raise ValueError("alpha must be 0 to 1")
        object.__setattr__(self, "wrap", tuple(self.wrap))
        if len(self.wrap) != 2 or not set(self.wrap) <= set(WRAPS):
            raise ValueError(f"wrap must be two of {', '.join(WRAPS)}, not {self.wrap}")
        if self.filter not in FILTERS:
            raise ValueError(f"filter must be one of {', '.join(FILTERS)}, not {self.filter!r}")

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of level 0."""
        height, width, _ = self.texels.shape
        return width, height

    @cached_property
    def levels(self) -> tuple[np.ndarray, ...]:
        """Images of all levels that are used, each a float64 array of shape (height, width, 3)."""
        return self._levels(self.texels)

    @cached_property
    def alpha_levels(self) -> tuple[np.ndarray, ...]:
        """Alpha of all levels that are used, each a float64 array of shape (height, width, 1)."""
        return self._levels(self.alpha[..., np.newaxis])

    def _levels(self, image: np.ndarray) -> tuple[np.ndarray, ...]:
        levels = [image]
        while self.mipmapped and max(levels[-1].shape[:2]) > 1:
            height, width, channels = levels[-1].shape
            rows, columns = max(height // 2, 1), max(width // 2, 1)
            blocks = levels[-1].reshape(rows, height // rows, columns, width // columns, channels)
            levels.append(blocks.mean(axis=(1, 3)))
        return tuple(levels)

    def level_of(self, step: np.ndarray) -> np.ndarray:
        """Level for pixels that lie some texels of level 0 apart: ``log2(step)``, rounded half up.

        Parameters
        ----------
        step : float64 array
            Texels, 0 or more.

        Returns
        -------
        int64 array, same shape
            0 to the last level.
        """
        # Rounded half up: from sqrt(2) on, level 1.
        found = np.frexp(np.maximum(step, 0.5) * np.sqrt(2))[1] - 1
        level: np.ndarray = np.clip(found, 0, len(self.levels) - 1).astype(np.int64)
        return level

    def sample(self, coordinates: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Colours at places of the surface.

        ``nearest`` takes the texel that holds the place. ``bilinear`` takes the four texels whose centres
        surround it, each with the product of its nearness along u and along v.

        Parameters
        ----------
        coordinates : float64 array, shape (places, 2)
            u and v.
        level : int64 array, shape (places,)
            Level of each place, see `level_of`.

        Returns
        -------
        float64 array, shape (places, 3)
        """
        return self._samples(self.levels, coordinates, level)

    def sample_alpha(self, coordinates: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Alpha at places of the surface, by the rule of `sample`; 1 for a texture without alpha.

        Parameters
        ----------
        coordinates, level
            As for `sample`.

        Returns
        -------
        float64 array, shape (places,)
        """
        if not self.alpha.size:
            return np.ones(len(coordinates))
        return self._samples(self.alpha_levels, coordinates, level)[:, 0]

    def _samples(
        self, levels: tuple[np.ndarray, ...], coordinates: np.ndarray, level: np.ndarray
    ) -> np.ndarray:
        """Samples of the channels of images, shape (places, channels)."""
        coordinates, level = np.asarray(coordinates, dtype=np.float64), np.asarray(level)
        found = np.empty((len(coordinates), levels[0].shape[-1]))
        for number in np.unique(level):
            chosen = np.flatnonzero(level == number)
            found[chosen] = self._sample(levels[number], coordinates[chosen])
        return found

    def _sample(self, image: np.ndarray, coordinates: np.ndarray) -> np.ndarray:
        """Samples at places, by one level."""
        size = np.array(image.shape[1::-1])
        place = coordinates * size
        if self.filter == "nearest":
            column, row = (
                wrapped(np.floor(place[:, axis]).astype(np.int64), size[axis], self.wrap[axis])
                for axis in (0, 1)
            )
            nearest: np.ndarray = image[row, column]
            return nearest
        place = place - 0.5
        first = np.floor(place).astype(np.int64)
        share = place - first
        color = np.zeros((len(place), image.shape[-1]))
        for right in (0, 1):
            column = wrapped(first[:, 0] + right, size[0], self.wrap[0])
            for lower in (0, 1):
                row = wrapped(first[:, 1] + lower, size[1], self.wrap[1])
                weight = np.abs(1 - right - share[:, 0]) * np.abs(1 - lower - share[:, 1])
                color += weight[:, np.newaxis] * image[row, column]
        return color
