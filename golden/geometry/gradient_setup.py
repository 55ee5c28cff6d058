"""Gradient setup: one attribute's start and steps along the long edge and along a scanline."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.edge_setup import FRACTION_BITS
from blysk.golden.geometry.plane_setup import PlaneScales, PlaneSetup
from blysk.golden.geometry.triangles import ATTRIBUTE
from blysk.golden.geometry.wide_product import LOST, halves, wide_product
from blysk.golden.number.fixed import SQ, UQ, Fixed

__all__ = ["GradientSetup", "Gradients"]


@dataclass(frozen=True)
class Gradients:
    """Start values and steps of attributes over triangles, arrays of any shape; words are modulo 4.

    Parameters
    ----------
    start : Fixed, SQ(2, 28)
        Value at the centre of the pixel at the long edge, on the first scanline.
    short, long : Fixed, SQ(2, 32)
        Steps from a scanline to the next, without the long edge's carry and with it.
    inward : Fixed, SQ(2, 32)
        Step from a pixel to the next pixel, away from the long edge.
    size : int64 array
        Upper bound of ``|inward|`` before it is taken modulo 4, in 2^-20, 1 to ``2^20 - 1``. The largest
        value also stands for all larger bounds.
    """

    start: Fixed
    short: Fixed
    long: Fixed
    inward: Fixed
    size: np.ndarray

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        return {
            name: value.codes if isinstance(value, Fixed) else value for name, value in vars(self).items()
        }


@dataclass(frozen=True)
class GradientSetup:
    """The plane of an attribute v in the form that the walk along the long edge needs.

    The corners' values are v0, v1, v2 from the top. ``r`` is the step of v along the long edge per scanline,
    ``g`` the step per pixel away from this edge. Both avoid differences of large numbers that nearly cancel:

        r = (v2 - v0) / D,    g = (v1 - v0 - r D1) / W

    D is the height, D1 the height of the middle corner, and W the width there. Every value in the triangle is
    ``v0 + r (y - y0) + g |x - X(y)|``. This is a mean of the corners' values. Its weights have small errors
    even in a thin triangle.

    The pixel at the long edge moves by whole columns. Let ``f`` be the fraction of the edge's step. Then v
    moves by ``short = r - f g`` a scanline, and by ``long = short + g`` with the walk's carry. If the edge is
    on the right, g has the other sign in both: ``short = r + f g``, ``long = short - g``. The start is ``v0 +
    (k short + n g) / 256`` with ``k = down`` of `Edges`, and with ``n = along`` if the edge is on the left,
    ``n = 256 - along`` if it is on the right.

    D' and W' are the powers of two with ``1/2 < D'/D <= 1`` and ``1/2 <= W'/W < 1``; `PlaneSetup` gives these
    quotients and the exponents.

    ============ ============ =====================================================================
    word         format       why
    ============ ============ =====================================================================
    v            SQ(1, 23)
    r D'         SQ(2, 24)    `wide_product` with D'/D, 7 and 9 low bits
    v1 - v0 - r D1  SQ(2, 24) `wide_product`, 8 and 3 low bits; saturates
    g W'         SQ(2, 24)    `wide_product` with W'/W, 8 and 8 low bits
    f            UQ(0, 33)    32 bits, and a 1 for the half step that they leave out
    f g W'       SQ(2, 40)    `wide_product`, 16 and 8 low bits; cut, not rounded
    r, g, f g    SQ(10, 32)   shifted by the scales' exponents, rounded half up
    k short, n g fraction 28  one sum, cut after the division by 256
    ============ ============ =====================================================================

    Finished sums are taken modulo 4. Attributes are in [-1, 1). So the values at covered pixels are right
    even if a step or an intermediate value wraps. `error` is the bound. The setup takes twelve
    multiplications.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    FORMAT = SQ(2, 32)
    START_FORMAT = SQ(2, 28)
    DIFFERENCE_FORMAT = SQ(2, 23)
    PRODUCT_FORMAT = SQ(2, 24)
    FRACTION_FORMAT = UQ(0, FRACTION_BITS + 1)
    SHIFTED_FORMAT = SQ(10, 32)
    SIZE_BITS = 20
    DIFFERENCE_LOW = 7
    PRODUCT_LOW = 8
    WIDTH_LOW = 8
    FRACTION_LOW = 16

    @staticmethod
    def error(rows: np.ndarray, width: np.ndarray) -> np.ndarray:
        """Bound on the error of an attribute at any pixel that a triangle covers, before it is cut.

        docs/theory/bounds.md#gradients derives it.

        Parameters
        ----------
        rows : array
            Scanlines of the triangles.
        width : array
            Widths W of the triangles in pixels, more than 1/256.

        Returns
        -------
        float array
            In units of the attribute, which is in [-1, 1).
        """
        product = LOST * 2.0**-24 + 2.0**-32
        along = PlaneSetup.HEIGHT_ERROR + product
        inward = 2 * along + product + 2 * PlaneSetup.WIDTH_ERROR + product
        row = 3 * 2.0**-33 + 2 / width * (2.0**-32 + 2.0**-39)
        return 2 * along + 2 * inward + (rows + 1) * row + (width + 1) * 2.0**-33 + 2.0**-26

    def compute(self, first: Fixed, middle: Fixed, last: Fixed, scales: PlaneScales) -> Gradients:
        """Bit-accurate gradients.

        Parameters
        ----------
        first, middle, last : Fixed, shape (T, ...), SQ(1, 23)
            Values of an attribute at the sorted corners, or values of several attributes.
        scales : PlaneScales
            Of the triangles, from `PlaneSetup`.

        Returns
        -------
        Gradients, shape (T, ...)

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        if {v.format for v in (first, middle, last)} != {ATTRIBUTE}:
            raise ValueError(f"operands must be {ATTRIBUTE}")

        def each(values: np.ndarray) -> np.ndarray:
            return values.reshape(-1, *(1,) * (first.codes.ndim - 1))

        def scale(value: Fixed) -> Fixed:
            return Fixed(value.format, each(value.codes))

        right = each(scales.right)
        product = self.PRODUCT_FORMAT
        point = product.fraction_bits
        along = wide_product(
            (last - first).wrap(self.DIFFERENCE_FORMAT),
            scale(scales.height_reciprocal),
            self.DIFFERENCE_LOW,
            PlaneSetup.RECIPROCAL_LOW,
            point,
        ).wrap(product)
        knee = wide_product(along, scale(scales.knee), self.PRODUCT_LOW, PlaneSetup.HEIGHT_LOW, point)
        across = ((middle - first).extend(SQ(3, point)) - knee).saturate(product)
        inward = wide_product(
            across, scale(scales.width_reciprocal), self.PRODUCT_LOW, self.WIDTH_LOW, point
        ).wrap(product)
        fraction = Fixed(self.FRACTION_FORMAT, 2 * each(scales.fraction) + 1)
        part = self._part(fraction, inward)

        row = self._shifted(along, each(scales.row_shift))
        inward = self._shifted(inward, each(scales.column_shift))
        part = self._shifted(part, each(scales.column_shift))
        short = Fixed((row - part).format, np.where(right, (row + part).codes, (row - part).codes))
        long = Fixed((short - inward).format, np.where(right, (short - inward).codes, (short + inward).codes))
        start = self._start(first, short, inward, each(scales.down), each(scales.along), right)
        size = np.where(inward.codes < 0, ~inward.codes, inward.codes)
        size = (size >> (self.FORMAT.fraction_bits - self.SIZE_BITS)) + 1
        return Gradients(
            start=start,
            short=short.wrap(self.FORMAT),
            long=long.wrap(self.FORMAT),
            inward=inward.wrap(self.FORMAT),
            size=np.minimum(size, (1 << self.SIZE_BITS) - 1),
        )

    def _part(self, fraction: Fixed, inward: Fixed) -> Fixed:
        """Product ``f g W'``, cut to 40 fraction bits."""
        (f_high, f_low), (g_high, g_low) = (
            halves(fraction, self.FRACTION_LOW),
            halves(inward, self.PRODUCT_LOW),
        )
        parts = f_high * g_high, (f_high * g_low).truncate(40), (f_low * g_high).truncate(40)
        return (parts[0] + (parts[1] + parts[2])).wrap(SQ(2, 40))

    def _shifted(self, value: Fixed, shift: np.ndarray) -> Fixed:
        """``2^8 value``, shifted right by ``shift`` places and rounded half up, SQ(10, 32)."""
        word = value.scale(8).extend(self.SHIFTED_FORMAT).codes
        return Fixed(self.SHIFTED_FORMAT, ((word << 1 >> shift) + 1) >> 1)

    def _start(
        self,
        first: Fixed,
        short: Fixed,
        inward: Fixed,
        down: np.ndarray,
        along: np.ndarray,
        right: np.ndarray,
    ) -> Fixed:
        point = self.START_FORMAT.fraction_bits
        n = np.where(right, 256 - along, along)
        short, inward = short.truncate(point), inward.truncate(point)
        total = (down * short.codes + (n & 255) * inward.codes) >> 8
        total = total + (n >> 8) * inward.codes + first.extend(SQ(1, point)).codes
        return Fixed(self.START_FORMAT, self.START_FORMAT.wrap(total))
