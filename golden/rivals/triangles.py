"""Triangles on the screen, and quadratics over them by forward differences, for methods without spans."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from blysk.golden.number.fixed import SQ, Fixed, Format
from blysk.golden.reference.raster import SUBPIXELS, Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.trace import Trace

__all__ = [
    "Plane",
    "Polynomial",
    "ScreenTriangles",
    "Surfaces",
    "at_origin",
    "dot",
    "gradients",
    "screen_triangles",
    "six_points",
]

Plane = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Coefficients of ``c + x i + y j``, by triangle."""

Polynomial = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Coefficients of ``c + x i + y j + xx i^2 + xy i j + yy j^2``, by triangle."""


class ScreenTriangles(NamedTuple):
    """Triangles of a raster on the screen, with a pixel of each as its origin.

    Parameters
    ----------
    x, y : float64 arrays, shape (3, triangles)
        Corners in pixels from the centre of the origin.
    weight : float64 array, shape (3, triangles)
        1/W of the corners.
    normal, point : float64 arrays, shape (3, 3, triangles)
        Unit normals, negated where the face is seen from behind and flips, and positions, as [corner, axis].
    columns, rows : int64 arrays, shape (triangles,)
        Largest distance of a pixel from the origin.
    triangle, i, j : int64 arrays, shape (pixels,)
        Triangle of each fragment of the raster, and the fragment's place from the origin.
    """

    x: np.ndarray
    y: np.ndarray
    weight: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    columns: np.ndarray
    rows: np.ndarray
    triangle: np.ndarray
    i: np.ndarray
    j: np.ndarray

    @property
    def first(self) -> np.ndarray:
        """Indices of the first fragments of spans."""
        begins = (np.diff(self.triangle) != 0) | (np.diff(self.j) != 0)
        return np.flatnonzero(np.r_[True, begins])


def screen_triangles(scene: Scene, raster: Raster) -> ScreenTriangles:
    """Triangles of a raster, with corners that are rounded as `rasterise` rounds them.

    The origin is the first pixel of the triangle's first span.

    Raises
    ------
    ValueError
        If a triangle reaches before the near plane, where it would be clipped.
    """
    shown, first, place = np.unique(raster.triangle, return_index=True, return_inverse=True)
    faces = scene.mesh.faces[shown].T
    x, y, w, depth = scene.camera.homogeneous(scene.mesh.vertices, scene.width, scene.height).T
    if np.any(depth[faces] < scene.camera.near):
        raise ValueError("a triangle reaches before the near plane, and the rivals clip no triangles")
    corner_x, corner_y = (np.rint(of[faces] / w[faces] * SUBPIXELS) / SUBPIXELS - 0.5 for of in (x, y))
    turn = np.where(raster.back[first] & scene.flips[shown], -1.0, 1.0)
    triangle = place[raster.span]
    i = raster.x[raster.span] + raster.offset - raster.x[first][triangle].astype(np.int64)
    j = raster.y[raster.span] - raster.y[first][triangle].astype(np.int64)
    columns, rows = (np.zeros(len(shown), dtype=np.int64) for _ in range(2))
    np.maximum.at(columns, triangle, np.abs(i))
    np.maximum.at(rows, triangle, j)
    return ScreenTriangles(
        x=corner_x - raster.x[first],
        y=corner_y - raster.y[first],
        weight=1 / w[faces],
        normal=np.moveaxis(scene.mesh.normals[faces], 2, 1) * turn,
        point=np.moveaxis(scene.mesh.vertices[faces], 2, 1),
        columns=columns,
        rows=rows,
        triangle=triangle,
        i=i,
        j=j,
    )


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot products of vectors along the first axis, by single operations, which an array may count."""
    found: np.ndarray = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return found


def gradients(triangles: ScreenTriangles) -> tuple[Plane, Plane]:
    """Barycentric coordinates of corners 1 and 2 as planes."""
    x, y = triangles.x, triangles.y
    x1, x2, y1, y2 = x[1] - x[0], x[2] - x[0], y[1] - y[0], y[2] - y[0]
    one = 1 / (x1 * y2 - x2 * y1)
    u_x, u_y, v_x, v_y = y2 * one, -(x2 * one), -(y1 * one), x1 * one
    u, v = (-(x[0] * of_x + y[0] * of_y) for of_x, of_y in ((u_x, u_y), (v_x, v_y)))
    return (u, u_x, u_y), (v, v_x, v_y)


def at_origin(corners: np.ndarray, planes: tuple[Plane, Plane]) -> Plane:
    """Plane through values at the corners.

    Parameters
    ----------
    corners : array, shape (3, ..., triangles)
        Values at the corners.
    planes : tuple of Plane
        From `gradients`.
    """
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    (u, u_x, u_y), (v, v_x, v_y) = planes
    return corners[0] + first * u + second * v, first * u_x + second * v_x, first * u_y + second * v_y


def six_points(
    corners: Sequence[np.ndarray], middles: Sequence[np.ndarray], planes: tuple[Plane, Plane]
) -> Polynomial:
    """Quadratic through the values at three corners and at the middles of three edges.

    With the barycentric coordinates u and v of corners 1 and 2 it is ``a + b u + c v + d u^2 + e u v +
    f v^2``.

    Parameters
    ----------
    corners, middles : three arrays each, shape (..., triangles)
        Values at corners 0, 1, 2, and at the middles of the edges 01, 02, 12.
    planes : tuple of Plane
        From `gradients`.

    Source: docs/theory/rivals.md#six-points; [Abbas01], [Seiler98].
    """
    a, end_u, end_v = corners
    middle_u, middle_v, across = middles
    b, c = 4 * middle_u - 3 * a - end_u, 4 * middle_v - 3 * a - end_v
    d, f = 2 * (a + end_u) - 4 * middle_u, 2 * (a + end_v) - 4 * middle_v
    e = 4 * (a - middle_u - middle_v + across)
    (u, u_x, u_y), (v, v_x, v_y) = planes
    # Derivatives of the polynomial by u and v at the origin.
    by_u, by_v = b + 2 * (d * u) + e * v, c + e * u + 2 * (f * v)
    return (
        a + u * (b + d * u + e * v) + v * (c + f * v),
        by_u * u_x + by_v * v_x,
        by_u * u_y + by_v * v_y,
        d * (u_x * u_x) + e * (u_x * v_x) + f * (v_x * v_x),
        2 * (d * (u_x * u_y) + f * (v_x * v_y)) + e * (u_x * v_y + u_y * v_x),
        d * (u_y * u_y) + e * (u_y * v_y) + f * (v_y * v_y),
    )


@dataclass(frozen=True)
class Surfaces:
    """Quadratics over triangles by forward differences: two additions a pixel, three a span.

    A quadratic has six words at the origin: f, its differences to the next column ``f_x`` and to the next row
    ``f_y``, and the second differences ``f_xx``, ``f_xy``, ``f_yy``. At column i and row j it is

    ``f + i f_x + j f_y + i (i-1)/2 f_xx + i j f_xy + j (j-1)/2 f_yy``,

    exact in the words. So the pixels do not depend on the way from the origin. Hardware walks down an edge.
    From a span to the next the edge moves by k or k + 1 columns, so three additions with differences of the
    edge give f, its difference, and the difference along the edge.

    With ``m = |i| + |j|`` the rounding of the words adds up to at most ``2^-(F+1) (1 + m + m^2/2)``.

    Parameters
    ----------
    format : Format
        Format of all words, with F fraction bits. Larger values saturate, and their triangles are flagged.

    Source: docs/theory/rivals.md#words.
    """

    format: Format = field(default_factory=lambda: SQ(5, 46))

    WORDS = 6

    def drift(self, columns: int, rows: int) -> float:
        """Largest error by the rounding of the words, at this distance from the origin."""
        m = columns + rows
        return self.format.step / 2 * (1 + m + m * m / 2)

    def quantise(self, polynomial: Polynomial) -> tuple[Fixed, np.ndarray]:
        """Words of quadratics, and flags of those that are out of range.

        Parameters
        ----------
        polynomial : Polynomial
            Coefficients, each of shape (words, triangles).

        Returns
        -------
        words : Fixed, shape (triangles, words, 6)
        out_of_range : bool array, shape (triangles,)
        """
        c, x, y, xx, xy, yy = polynomial
        exact = np.stack([c, x + xx, y + yy, 2 * xx, xy, 2 * yy], axis=-1)
        scaled = np.ldexp(np.moveaxis(exact, 1, 0), self.format.fraction_bits)
        least, most = float(self.format.min_code), float(self.format.max_code)
        wrong = ~((scaled >= least) & (scaled <= most))
        codes = np.rint(np.where(wrong, np.clip(np.nan_to_num(scaled), least, most), scaled))
        limited = np.clip(codes, least, np.nextafter(most, 0)).astype(np.int64)
        return Fixed(self.format, limited), wrong.any(axis=(1, 2))

    def compute(self, words: Fixed, triangles: ScreenTriangles, trace: Trace) -> Fixed:
        """Bit-accurate values at every fragment, shape (pixels, words)."""
        f, f_x, f_y, f_xx, f_xy, f_yy = np.moveaxis(words.codes[triangles.triangle], 2, 0)
        i, j = triangles.i[:, np.newaxis], triangles.j[:, np.newaxis]
        # An int64 wraps modulo 2^64. The low bits of the sum are those of the hardware.
        step = f_x + i * f_xx + j * f_xy
        value = f + i * f_x + j * f_y + i * (i - 1) // 2 * f_xx + i * j * f_xy + j * (j - 1) // 2 * f_yy
        steps, values = (Fixed(self.format, self.format.wrap(of)) for of in (step, value))
        first = triangles.first
        # The difference along the edge has as many bits as f_x.
        for of_span in (values, steps, steps):
            trace.added(of_span[first], "span")
        trace.added(steps)
        return trace.added(values)
