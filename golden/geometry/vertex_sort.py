"""Vertex sort ([T] figure 4.10): corners from top to bottom, orientation, and dropped triangles."""

from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.geometry.triangles import GRID, FrameSettings, Grid, Triangles

__all__ = ["FACTOR_BITS", "TESTED", "SortedTriangles", "VertexSort"]

FACTOR_BITS = 18
"""Bits of a factor of a multiplier."""

TESTED = 4
"""Centres in the largest box whose centres are tested before the setup, in the throughput style."""


@dataclass(frozen=True)
class SortedTriangles:
    """Triangles to draw, with corners from top to bottom, and at equal height from left to right.

    Parameters
    ----------
    triangles : Triangles
        With sorted corners.
    area : int64 array, shape (T,)
        Twice the area in squared steps of the grid, at least 1.
    right : bool array, shape (T,)
        Whether the long edge, from the first corner to the last, is on the right.
    flip : bool array, shape (T,)
        Whether the normals have to be negated.
    source : int64 array, shape (T,)
        Index of each triangle among the triangles before the sort.
    order : int64 array, shape (T, 3)
        For each sorted corner its index among the corners before the sort.
    """

    triangles: Triangles
    area: np.ndarray
    right: np.ndarray
    flip: np.ndarray
    source: np.ndarray
    order: np.ndarray

    def __len__(self) -> int:
        return len(self.area)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes.

        Coordinates are sorted. Attributes stay in the order before the sort, with the indices ``top`` and
        ``bottom`` of the first and the last sorted corner.
        """
        beats = self.triangles.beats | self.attributes
        beats |= {"area": self.area, "right": self.right, "flip": self.flip}
        return {name: values for name, values in beats.items() if name != "two_sided"}

    @property
    def attributes(self) -> dict[str, np.ndarray]:
        """Fields of the beats with the attributes, in the order before the sort, and with both indices."""
        back = np.argsort(self.order, axis=1)
        rows = np.arange(len(self))[:, np.newaxis]
        names = [name for name in self.triangles.corners if name not in "xy"]
        given = {name: getattr(self.triangles, name)[rows, back] for name in names}
        return given | {"top": self.order[:, 0], "bottom": self.order[:, 2]}


@dataclass(frozen=True)
class VertexSort:
    """Sorts the corners of a triangle by y, then x, and drops triangles that give no span.

    In this order a triangle is

    1. counted as ``empty`` and dropped if no pixel of the picture has its centre in the triangle's bounding
       box without the right and the lower side. By the top-left rule no centre on these sides is covered;
    2. counted as ``zero_area`` and dropped if twice its area,
       ``a = (x1 - x0)(y2 - y0) - (x2 - x0)(y1 - y0)``, is 0;
    3. counted as ``culled`` and dropped if its back is seen, it is not two-sided, and the frame culls back
       faces. A triangle shows its front if its corners are counterclockwise on the screen;
    4. counted as ``empty`` and dropped if `misses`: the box has 1 to ``tested`` centres, in the picture or
       not, and the triangle covers none of them.

    The long edge is on the right if a of the sorted corners is negative. All results are exact.

    Parameters
    ----------
    grid : Grid
        Fraction bits of the coordinates.
    tested : int
        Centres in the largest box whose centres are tested: `TESTED`, or 0 in the compact style.

    Source: docs/theory/geometry.md#coverage; [T] figure 4.10.
    """

    grid: Grid = GRID
    tested: int = TESTED

    def order(self, triangles: Triangles) -> np.ndarray:
        """Indices of the corners sorted by y, then x, shape (T, 3). Equal corners stay in their order."""
        key = (triangles.y << (self.grid.bits + 1)) + triangles.x
        return np.argsort(key, axis=1, kind="stable")

    def misses(self, triangles: Triangles) -> np.ndarray:
        """Whether a triangle with an area has a box of 1 to ``tested`` centres and covers none.

        A centre is covered if it is inside, or on a left or a top edge.

        Returns
        -------
        misses : bool array, shape (T,)
        """
        grid = self.grid
        corners = np.stack((triangles.x, triangles.y))
        low, high = (grid.first_centre(f(corners, axis=2)) for f in (np.min, np.max))
        extent = high - low
        small = np.flatnonzero((extent > 0).all(axis=0) & (extent.prod(axis=0) <= self.tested))
        (x, y), first, extent = corners[:, small], low[:, small], extent[:, small]
        dx, dy = (np.roll(values, -1, axis=1) - values for values in (x, y))
        turn = np.sign(dx[:, :1] * dy[:, 1:2] - dx[:, 1:2] * dy[:, :1])
        dx, dy = dx * turn, dy * turn
        counts = (dy < 0) | ((dy == 0) & (dx > 0))
        covered = np.zeros(len(small), dtype=bool)
        for column, row in np.ndindex(self.tested, self.tested):
            cx, cy = (
                ((start + k) * grid.steps + grid.half)[:, np.newaxis]
                for start, k in zip(first, (column, row), strict=True)
            )
            edges = dx * (cy - y) - dy * (cx - x)
            inside = ((edges > 0) | ((edges == 0) & counts)).all(axis=1)
            covered |= inside & (column < extent[0]) & (row < extent[1])
        result = np.zeros(len(triangles), dtype=bool)
        result[small] = ~covered
        return result

    def cycles(self, triangles: Triangles) -> np.ndarray:
        """Cycles from each triangle to the next in the throughput style, int64 array, shape (T,).

        Every triangle takes one cycle, drawn or dropped. A triangle takes four if a difference of
        coordinates, from its first corner to another, has more than `FACTOR_BITS` bits: each product then
        has four parts. The sort waits longer if drawn triangles wait behind it.
        """
        across, down = (values[:, 1:] - values[:, :1] for values in (triangles.x, triangles.y))
        differences = np.concatenate((across, down), axis=1)
        half = 1 << (FACTOR_BITS - 1)
        wide = ((differences < -half) | (differences >= half)).any(axis=1)
        return np.where(wide, 4, 1)

    def compute(self, triangles: Triangles, frame: FrameSettings) -> tuple[SortedTriangles, dict[str, int]]:
        """Triangles to draw, and the counts of the dropped triangles.

        Parameters
        ----------
        triangles : Triangles
            Corners in the grid's range.
        frame : FrameSettings
            The picture, and the treatment of back faces.

        Returns
        -------
        sorted : SortedTriangles
            The triangles to draw, in the order of ``triangles``.
        counts : dict of str to int
            ``empty``, ``zero_area`` and ``culled``.

        Raises
        ------
        ValueError
            If a coordinate is out of range.
        """
        code = self.grid.coordinate
        for values in (triangles.x, triangles.y):
            if values.size and not (code.min_code <= values.min() and values.max() <= code.max_code):
                raise ValueError(f"coordinates must be {code}: {code.min_code} to {code.max_code}")
        covered = np.ones(len(triangles), dtype=bool)
        for values, first, end in (
            (triangles.x, frame.left, frame.right),
            (triangles.y, frame.top, frame.bottom),
        ):
            low, high = (self.grid.first_centre(f(values, axis=1)) for f in (np.min, np.max))
            covered &= np.maximum(low, first) < np.minimum(high, end)
        source = np.flatnonzero(covered)
        kept = triangles[source]
        order = self.order(kept)
        rows = np.arange(len(kept))[:, np.newaxis]
        kept = replace(kept, **{name: getattr(kept, name)[rows, order] for name in kept.corners})
        dx, dy = (values[:, 1:] - values[:, :1] for values in (kept.x, kept.y))
        area = dx[:, 0] * dy[:, 1] - dx[:, 1] * dy[:, 0]
        # An odd order of three corners exchanges two corners and leaves one corner in its place.
        odd = (order == np.arange(3)).sum(axis=1) == 1
        back = (area > 0) ^ odd
        solid = area != 0
        culls = frame.back_faces == "cull"
        shown = solid & ~(back & culls & (kept.two_sided == 0))
        missed = shown & self.misses(kept)
        drawn = shown & ~missed
        counts = {
            "empty": len(triangles) - len(kept) + int(missed.sum()),
            "zero_area": int((~solid).sum()),
            "culled": int((solid & ~shown).sum()),
        }
        result = SortedTriangles(
            triangles=kept[drawn],
            area=np.abs(area[drawn]),
            right=area[drawn] < 0,
            flip=back[drawn] & ((frame.back_faces == "flip") | culls),
            source=source[drawn],
            order=order[drawn],
        )
        return result, counts
