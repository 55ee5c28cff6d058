"""Plane setup: reciprocals of a triangle's height and width, for the steps of its attributes."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.edge_setup import Edges
from blysk.golden.geometry.reciprocal import Reciprocal
from blysk.golden.geometry.triangles import GRID, Grid
from blysk.golden.geometry.vertex_sort import SortedTriangles
from blysk.golden.geometry.wide_product import wide_product
from blysk.golden.number.fixed import UQ, Fixed

__all__ = ["PlaneScales", "PlaneSetup", "leading_bit"]


def leading_bit(codes: np.ndarray) -> np.ndarray:
    """Place of the highest 1 of positive integers below 2^52, counted from 0 at the lowest bit."""
    return np.frexp(codes.astype(np.float64))[1].astype(np.int64) - 1


@dataclass(frozen=True)
class PlaneScales:
    """Words of a triangle that all its attributes share.

    Parameters
    ----------
    height_reciprocal : Fixed, shape (T,), UQ(1, 25)
        Reciprocal of the mantissa d of the height, which is ``d 2^e`` with d from 1 to 2.
    knee : Fixed, shape (T,), UQ(1, 19)
        Distance from the first corner down to the middle corner, divided by ``2^e``.
    width_reciprocal : Fixed, shape (T,), UQ(0, 25)
        Mantissa of the reciprocal of the width; 0 for a sliver.
    row_shift, column_shift : int64 arrays, shape (T,)
        Places by which steps per scanline and per column are shifted right, 0 to 19. The column shift of a
        sliver has no meaning.
    fraction, down, along, right
        Unchanged fields of `Edges` and `SortedTriangles`.
    sliver : bool array, shape (T,)
        Whether the triangle is at most 1/256 pixel wide.
    """

    height_reciprocal: Fixed
    knee: Fixed
    width_reciprocal: Fixed
    row_shift: np.ndarray
    column_shift: np.ndarray
    fraction: np.ndarray
    down: np.ndarray
    along: np.ndarray
    right: np.ndarray
    sliver: np.ndarray

    def __len__(self) -> int:
        return len(self.right)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        return {
            name: value.codes if isinstance(value, Fixed) else value for name, value in vars(self).items()
        }


@dataclass(frozen=True)
class PlaneSetup:
    """Reciprocals ``1/D`` and ``1/W`` of a triangle: D is its height, W its width at the middle corner.

    Let a be twice the area, ``D = d 2^e`` and ``a = A 2^g`` in steps of the grid, d and A from 1 to 2. The
    width in pixels is ``a / (D 2^s)``, so ``1/W = (d / A) 2^(s + e - g)``. `Reciprocal` gives ``1/d`` and
    ``1/A``; A is cut to 25 fraction bits. ``d / A`` is one `wide_product`. A quotient of 1 or more is halved.

    For a difference v of attributes the step per scanline is ``2^s v / D = (v / d) 2^(s - e)``. The step per
    column is ``v / W``. `GradientSetup` multiplies the mantissas by 2^8. It shifts right by
    ``row_shift = 8 - s + e`` and by ``column_shift``, 8 less the exponent of ``1/W``, which is -11 to 8.
    Triangles of ``W <= 1/256`` are slivers. Their ``1/W`` is 0: they have the attributes of the long edge.

    The relative error of ``1/d`` is `HEIGHT_ERROR`, 2 `Reciprocal.ERROR`. The dropped bits of A add 2^-25 and
    the `wide_product` 2^-24: the relative error of ``1/W`` is `WIDTH_ERROR`, 2^-22.7. The setup takes seven
    multiplications.

    Parameters
    ----------
    grid : Grid
        Fraction bits s of the coordinates.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    grid: Grid = GRID

    HEIGHT_FORMAT = UQ(1, 19)
    WIDTH_FORMAT = UQ(0, 25)
    HEIGHT_LOW = 3
    RECIPROCAL_LOW = 9
    SHIFT_BITS = 5
    HEIGHT_ERROR = 2 * Reciprocal.ERROR
    WIDTH_ERROR = HEIGHT_ERROR + 2.0**-25 + 2 * 2.0**-25

    def is_sliver(self, area: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Whether triangles are slivers, bool array: ``W <= 1/256``.

        Parameters
        ----------
        area, height : int64 arrays, shape (T,)
            Area as in `SortedTriangles`, and height of the long edge, in steps of the grid.
        """
        return (area << (8 - self.grid.subpixel_bits)) <= height

    def compute(self, triangles: SortedTriangles, edges: Edges) -> PlaneScales:
        """Bit-accurate scales.

        Parameters
        ----------
        triangles : SortedTriangles
            From `VertexSort`.
        edges : Edges
            Edges of the triangles, from `EdgeSetup`.
        """
        s, area = self.grid.subpixel_bits, triangles.area
        height, knee = edges.height[:, 0], triangles.triangles.y[:, 1] - triangles.triangles.y[:, 0]
        top = self.HEIGHT_FORMAT.fraction_bits
        e, g = leading_bit(height), leading_bit(area)
        mantissa = Fixed(self.HEIGHT_FORMAT, height << (top - e))
        table = Reciprocal()
        point = table.FORMAT.fraction_bits
        area_mantissa = np.where(
            g > point, area >> np.maximum(g - point, 0), area << np.maximum(point - g, 0)
        )
        height_reciprocal = table.compute(mantissa.extend(table.FORMAT))
        area_reciprocal = table.compute(Fixed(table.FORMAT, area_mantissa))
        ratio = wide_product(mantissa, area_reciprocal, self.HEIGHT_LOW, self.RECIPROCAL_LOW, point).codes
        halved = ratio >> point
        sliver = self.is_sliver(area, height)
        width = np.where(sliver, 0, np.where(halved == 1, ratio >> 1, ratio))
        return PlaneScales(
            height_reciprocal=height_reciprocal,
            knee=Fixed(self.HEIGHT_FORMAT, knee << (top - e)),
            width_reciprocal=Fixed(self.WIDTH_FORMAT, width),
            row_shift=8 - s + e,
            column_shift=(8 - s - e + g - halved) & ((1 << self.SHIFT_BITS) - 1),
            fraction=edges.fraction,
            down=edges.down,
            along=edges.along,
            right=triangles.right,
            sliver=sliver,
        )
