"""Triangles as the hardware takes them: corners on a sub-pixel grid with depth and scaled normal."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from blysk.golden.number.fixed import SQ, UQ, Format
from blysk.golden.reference.scene import BACK_FACES

__all__ = [
    "ATTRIBUTE",
    "ATTRIBUTES",
    "DEPTH",
    "GRID",
    "LIMIT_BITS",
    "MATERIAL_BITS",
    "PIXEL_BITS",
    "FrameSettings",
    "Grid",
    "Triangles",
]

PIXEL_BITS = 12
"""Bits of a coordinate before the binary point: pixels -2048 to 2047."""

ATTRIBUTE = SQ(1, 23)
"""Number format of the attributes: components of N/W, and ``depth / 2^23 - 1``."""

ATTRIBUTES = 4
"""Number of attributes of a corner: the components x, y, z of N/W, then the depth."""

DEPTH = UQ(24, 0)
"""Number format of a corner's depth, 0 nearest."""

LIMIT_BITS = 10
"""Bits of a frame's limit."""

MATERIAL_BITS = 10
"""Bits of the index of a material."""


@dataclass(frozen=True)
class Grid:
    """The grid of corners: fractions of a pixel, and words that follow from them.

    Pixel i has its centre at ``i + 1/2``, which is ``i 2^s + 2^(s-1)`` in steps of the grid.

    Parameters
    ----------
    subpixel_bits : int
        Fraction bits s of a coordinate: 4 or 8.

    Raises
    ------
    ValueError
        If it is another number.
    """

    subpixel_bits: int = 8

    def __post_init__(self) -> None:
        if self.subpixel_bits not in (4, 8):
            raise ValueError(f"subpixel_bits must be 4 or 8, not {self.subpixel_bits!r}")

    @property
    def coordinate(self) -> Format:
        """Number format of a coordinate, in pixels."""
        return SQ(PIXEL_BITS, self.subpixel_bits)

    @property
    def bits(self) -> int:
        """Bits of a coordinate, and of the unsigned difference of two sorted coordinates."""
        return self.coordinate.width

    @property
    def steps(self) -> int:
        """Steps of the grid in a pixel."""
        return 1 << self.subpixel_bits

    @property
    def half(self) -> int:
        """Steps from a pixel's border to its centre."""
        return self.steps // 2

    def first_centre(self, codes: np.ndarray) -> np.ndarray:
        """First column or scanline whose centre is not before a coordinate: ``ceil((c - half) / steps)``."""
        return (codes + (self.half - 1)) >> self.subpixel_bits


GRID = Grid()
"""The grid of 1/256 pixel."""


@dataclass(frozen=True)
class FrameSettings:
    """Settings that stay constant while the triangles of a frame pass.

    Parameters
    ----------
    left, top, right, bottom : int
        The picture, in pixels of the grid, from -2048 to 2048: columns ``left`` to ``right - 1``, scanlines
        ``top`` to ``bottom - 1``. The picture has 1 to 4095 columns and scanlines.
    back_faces : str
        Treatment of back faces, one of `BACK_FACES`.
    limit : int
        Largest chord between the unit normals of a span's ends, in 1/1024: 0 to 1023. See `PlaneAssembler`;
        `limit_of` gives it for an angle. Spans of true lines or vectors ignore it.

    Raises
    ------
    ValueError
        If a value is out of range.
    """

    left: int
    top: int
    right: int
    bottom: int
    back_faces: str = "flip"
    limit: int = 267

    def __post_init__(self) -> None:
        for low, high in (("left", "right"), ("top", "bottom")):
            first, end = getattr(self, low), getattr(self, high)
            if not (-2048 <= first < end <= 2048 and end - first <= 4095):
                raise ValueError(
                    f"a frame's {low} and {high} must be 1 to 4095 apart, from -2048 to 2048, "
                    f"not {first} and {end}"
                )
        if self.back_faces not in BACK_FACES:
            raise ValueError(f"back_faces must be one of {', '.join(BACK_FACES)}, not {self.back_faces!r}")
        if not 0 <= self.limit < 1 << LIMIT_BITS:
            raise ValueError(f"a frame's limit must be 0 to {(1 << LIMIT_BITS) - 1}, not {self.limit}")

    @classmethod
    def centred(cls, width: int, height: int, **options: Any) -> "FrameSettings":
        """Frame with the picture in the middle of the grid. The guard band is then equal on all sides.

        Parameters
        ----------
        width, height : int
            Size of the picture, 1 to 4095.
        **options
            ``back_faces`` and ``limit``.
        """
        left, top = -(width // 2), -(height // 2)
        return cls(left, top, left + width, top + height, **options)

    @staticmethod
    def limit_of(angle: float) -> int:
        """Largest ``limit`` for which no span's normals are more than ``angle`` degrees apart, 0 to 60."""
        return min(int(2048 * np.sin(np.radians(angle) / 2)), (1 << LIMIT_BITS) - 1)

    @property
    def codes(self) -> dict[str, int]:
        """Codes of the fields of the hardware's port ``constants``, by name."""
        return {
            "left": self.left,
            "top": self.top,
            "right": self.right,
            "bottom": self.bottom,
            "back_faces": BACK_FACES.index(self.back_faces),
            "limit": self.limit,
        }


@dataclass(frozen=True)
class Triangles:
    """Triangles in codes, corner by corner.

    Parameters
    ----------
    x, y : int64 arrays, shape (T, 3)
        Corners in steps of the grid, y down.
    depth : int64 array, shape (T, 3)
        0 to 2^24 - 1, linear on the screen. Nearer corners have smaller depths.
    normal : int64 array, shape (T, 3, 3)
        Components of N/W over the largest 1/W of the triangle, `ATTRIBUTE`; the last axis is x, y, z.
    material : int64 array, shape (T,)
        Index of the material.
    two_sided : bool array, shape (T,)
        Whether a frame that culls back faces draws the triangle's back with negated normals, in place of
        culling it.
    surface : int64 array, shape (T, 3, S), optional
        Vertex colours and texture coordinates over W, then 1/W, `ATTRIBUTE`, see `SurfaceWords`.
    base : int64 array, shape (T, 2), optional
        Whole texel from which the texture coordinates of a triangle are counted, see `SpanAttributes`.
    range, level : int64 arrays, shape (T,), optional
        Range of these coordinates, and level of the texture.
    """

    x: np.ndarray
    y: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    material: np.ndarray
    two_sided: np.ndarray
    surface: np.ndarray | None = None
    base: np.ndarray | None = None
    range: np.ndarray | None = None
    level: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.x)

    def __getitem__(self, key: Any) -> "Triangles":
        """Triangles picked by a NumPy index."""
        return Triangles(**{name: values[key] for name, values in self.beats.items()})

    @property
    def attributes(self) -> np.ndarray:
        """Codes of N/W, of ``depth - 2^23``, and of the surface: int64 array, shape (T, 3, 4 + S)."""
        depth = self.depth + ATTRIBUTE.min_code
        surface = () if self.surface is None else (self.surface,)
        return np.concatenate((self.normal, depth[..., np.newaxis], *surface), axis=-1)

    @property
    def corners(self) -> tuple[str, ...]:
        """Fields with a value for each corner."""
        return ("x", "y", "depth", "normal", *([] if self.surface is None else ["surface"]))

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the input beats of the hardware, by name: arrays of codes."""
        return {name: value for name, value in vars(self).items() if value is not None}
