"""Vertex unit: a vertex times a matrix, its perspective division, and its place on the screen."""

from dataclasses import dataclass, field

import numpy as np

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.reciprocal import Reciprocal
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.geometry.triangles import ATTRIBUTE, DEPTH, GRID, Grid
from blysk.golden.geometry.wide_product import LOST, wide_product
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT, ONE

__all__ = ["ENTRY", "OFFSET", "WEIGHT", "Matrix", "ScreenVertices", "VertexTransform"]

ENTRY = SQ(2, 16)
"""Number format of an entry of a matrix."""

OFFSET = SQ(5, 20)
"""Number format of an offset, in units of the near plane's distance."""

WEIGHT = round(SurfaceWords.LARGEST * 2**COMPONENT.fraction_bits)
"""Code of `COMPONENT` that an attribute of 1 has in a memory of vertices."""


@dataclass(frozen=True)
class Matrix:
    """Matrix for vertices: rows X, Y and W for positions, rows x, y and z for normals.

    Parameters
    ----------
    position : int64 array, shape (3, 3)
        Rows X, Y, W, codes of `ENTRY`.
    offset : int64 array, shape (3,)
        Offsets of these rows, codes of `OFFSET`.
    normal : int64 array, shape (3, 3)
        Rotation of the mesh, codes of `ENTRY`. It may be followed by the rotation into the frame of a light.
    """

    position: np.ndarray
    offset: np.ndarray
    normal: np.ndarray

    @property
    def codes(self) -> dict[str, np.ndarray]:
        """Words of the matrix by name, as the hardware takes them."""
        return {name: getattr(self, name) for name in ("position", "offset", "normal")}


@dataclass(frozen=True)
class ScreenVertices:
    """Vertices on the screen.

    Parameters
    ----------
    x, y : int64 arrays, shape (V,)
        Coordinates in steps of the grid.
    depth : int64 array, shape (V,)
        Depth, 0 at the near plane, codes of `DEPTH`.
    normal : int64 array, shape (V, 3)
        N/W, codes of `ATTRIBUTE`.
    outside : bool array, shape (V,)
        Whether the vertex is nearer than the near plane, outside the grid, or at least `VertexTransform.FAR`
        times as far as the near plane. Its other words are then invalid.
    surface : int64 array, shape (V, S), optional
        Vertex colours and texture coordinates over W, then 1/W, codes of `ATTRIBUTE`, see `SurfaceWords`.
    """

    x: np.ndarray
    y: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    outside: np.ndarray
    surface: np.ndarray | None = None

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Output beats of the hardware, by field."""
        return {name: value for name, value in vars(self).items() if value is not None}


@dataclass(frozen=True)
class VertexTransform:
    """Transforms vertices by a matrix: place ``x = X/W``, ``y = Y/W``, depth ``1 - 1/W``, and ``N/W``.

    W is in units of the near plane's distance, so it is 1 on the near plane. A vertex with W under 1, or with
    W of `FAR` or more, is outside. X/W and Y/W are in units of ``2^scale_bits`` pixels from the middle of the
    grid. The depth ``1 - 1/W`` and N/W are linear on the screen. N/W has the same scale for all triangles of
    the frame. So a vertex is transformed once for all of its triangles.

    ============ ============ =====================================================================
    word         format       why
    ============ ============ =====================================================================
    p, N         SQ(1, 17)    18 bits for the multiplier
    entries      SQ(2, 16)    18 bits for the multiplier; holds 1, for rotations
    X, Y, W      SQ(6, 25)    sum of three products and the offset, rounded
    m            UQ(1, 25)    W shifted by s = 0 to 3 into [1, 2); cut
    r = 1/m      UQ(1, 25)    `Reciprocal`
    X', Y'       SQ(6, 25)    shifted by s; cut
    x, y         SQ(3, 17)    from three products, 20 fraction bits, then rounded to the grid (scale 9)
    depth        UQ(24, 0)    ``1 - r 2^-s``, cut
    N'           SQ(1, 17)    rounded, saturates to ONE
    r'           UQ(1, 16)    r rounded for the multiplier
    N/W          SQ(1, 23)    ``N' r' 2^-s``, rounded to 26 fraction bits before the shift, then cut
    A            SQ(1, 17)    attribute of the surface, times `SurfaceWords.LARGEST`
    A/W, 1/W     SQ(1, 23)    ``A r' 2^-s`` as N/W; 1/W is that of ``A = 1``
    ============ ============ =====================================================================

    Error bounds, for the given entries, are derived in docs/theory/bounds.md#vertices:

    - `ERROR` steps of the grid for a coordinate of a vertex inside;
    - `DEPTH_ERROR` for the depth;
    - `NORMAL_ERROR` for a component of N/W;
    - `surface_error` for an attribute, as the quotient of its word and that of 1/W.

    The unit takes 29 multiplications. Attributes take a multiplication each, and their 1/W takes another.

    Parameters
    ----------
    scale_bits : int
        1 in X/W is ``2^scale_bits`` pixels; 4 to 11. 9 is for pictures up to 1024 pixels wide.
    grid : Grid
        Fraction bits of the coordinates.
    surface : AttributeSpans, optional
        Attributes of the surface that vertices bring.

    Raises
    ------
    ValueError
        If ``scale_bits`` is not 4 to 11.

    Source: docs/theory/video.md#vertices; not in the documents.
    """

    scale_bits: int = 9
    grid: Grid = field(default_factory=lambda: GRID)
    surface: AttributeSpans | None = None

    SPACE = SQ(6, 25)
    SHIFTS = 3
    FAR = 2 << SHIFTS
    X_LOW, RECIPROCAL_LOW = 13, 9
    GUARD = 3
    FACTOR_FORMAT = UQ(1, 16)
    ERROR = 0.5 + LOST / 8 + 2.0**17 * (2.0**-26 + 2.0**-25 + 8 * Reciprocal.ERROR + 4 * 2.0**-25) + 2.0**-8
    DEPTH_ERROR = 1 + (Reciprocal.ERROR + 2.0**-25 + 2.0**-26) * 2.0**24
    NORMAL_ERROR = 2.0**-18 + 2.0**-17 + 2.0**-27 + 2.0**-23

    def __post_init__(self) -> None:
        if self.scale_bits not in range(4, 12):
            raise ValueError(f"scale_bits must be 4 to 11, not {self.scale_bits!r}")

    @property
    def cycles(self) -> int:
        """Cycles from a vertex to the next with a single multiplier."""
        return 30 + (0 if self.surface is None else self.surface.attributes + 1)

    @staticmethod
    def surface_error(w: np.ndarray) -> np.ndarray:
        """Bound of the error of attributes from -1 to 1 at vertices with W; docs/theory/video.md#vertices."""
        found: np.ndarray = 2.0**-18 / SurfaceWords.LARGEST + 2.26 * 2.0**-23 * w
        return found

    @property
    def place(self) -> Format:
        """Number format of x and y, as X/W and Y/W, with the steps of the grid."""
        return self.grid.coordinate.scaled(-self.scale_bits)

    def space(self, position: np.ndarray, matrix: Matrix) -> Fixed:
        """``X, Y, W`` of positions, shape (V, 3)."""
        total = Fixed(OFFSET, matrix.offset)
        for k in range(3):
            entry = Fixed(ENTRY, matrix.position[:, k])
            product = Fixed(COMPONENT, position[:, k, np.newaxis]) * entry
            total = total + product
        return total.round_half_up(self.SPACE.fraction_bits).wrap(self.SPACE)

    def compute(
        self,
        position: np.ndarray,
        normal: np.ndarray,
        matrix: Matrix,
        attributes: np.ndarray | None = None,
    ) -> ScreenVertices:
        """Bit-accurate vertices on the screen.

        Parameters
        ----------
        position, normal : int64 arrays, shape (V, 3)
            Codes of ``SQ(1, 17)``.
        matrix : Matrix
            The matrix.
        attributes : int64 array, shape (V, A), optional
            Attributes of the surface times `SurfaceWords.LARGEST`, codes of ``SQ(1, 17)``.
        """
        space = self.space(position, matrix)
        w = space.codes[:, 2]
        one = 1 << self.SPACE.fraction_bits
        outside = (w < one) | (w >= self.FAR * one)
        w = np.where(outside, one, w)
        shift = (w >= one << np.arange(1, self.SHIFTS + 1)[:, np.newaxis]).sum(0)
        r = Reciprocal().compute(Fixed(Reciprocal.FORMAT, w >> shift))
        places = []
        for axis in (0, 1):
            shifted = Fixed(self.SPACE, space.codes[:, axis] >> shift)
            product = wide_product(
                shifted, r, self.X_LOW, self.RECIPROCAL_LOW, self.place.fraction_bits + self.GUARD
            )
            rounded = product.round_half_up(self.place.fraction_bits)
            place = rounded.saturate(self.place)
            outside = outside | (place.codes != rounded.codes)
            places.append(place.codes)
        factor = r.round_half_up(self.FACTOR_FORMAT.fraction_bits).wrap(self.FACTOR_FORMAT)

        def over_w(words: Fixed) -> np.ndarray:
            scaled = (words * factor[:, np.newaxis]).round_half_up(26).codes >> shift[:, np.newaxis]
            cut: np.ndarray = scaled >> (26 - ATTRIBUTE.fraction_bits)
            return cut

        surface = None
        if self.surface is not None:
            assert attributes is not None
            words = np.column_stack([attributes, np.full(len(position), WEIGHT)])
            surface = over_w(Fixed(COMPONENT, words))
        return ScreenVertices(
            x=places[0],
            y=places[1],
            depth=(one - (r.codes >> shift)) >> (25 - DEPTH.width),
            normal=over_w(self._normals(normal, matrix)),
            outside=outside,
            surface=surface,
        )

    def _normals(self, normal: np.ndarray, matrix: Matrix) -> Fixed:
        """Turned normals ``R N``, shape (V, 3), in `COMPONENT`, -ONE to ONE."""
        products = [
            Fixed(COMPONENT, normal[:, k, np.newaxis]) * Fixed(ENTRY, matrix.normal[:, k]) for k in range(3)
        ]
        total = ((products[0] + products[1]) + products[2]).round_half_up(COMPONENT.fraction_bits)
        return Fixed(COMPONENT, np.clip(total.codes, -ONE, ONE))
