"""Attribute serialiser: a triangle's attributes one after the other, and a bound on its normals' length."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.triangles import ATTRIBUTE, Triangles

__all__ = ["AttributeSerialiser"]


@dataclass(frozen=True)
class AttributeSerialiser:
    """Gives the attributes of sorted triangles one after the other, with `least`.

    ``least`` is a lower bound of the length m of N/W in the triangle: ``m >= max(9/16 M, L, 0)``. Components
    are cut to 11 fraction bits. If a component is negative at the first corner, its bits are inverted at all
    three corners. M is the smallest of the corners' sums of components. L is the largest of three values: the
    smallest value of each component at the corners. A vector is at least as long as its largest component,
    and as ``1/sqrt(3) > 9/16`` of the sum of its components. Every N/W in the triangle is a weighted mean of
    the corners' N/W. So the bound holds there too.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    FRACTION_BITS = 11
    BITS = 12

    def least(self, triangles: Triangles) -> np.ndarray:
        """Lower bound of m in sorted triangles, from the components' first 12 bits.

        Parameters
        ----------
        triangles : Triangles
            With sorted corners.

        Returns
        -------
        int64 array, shape (T,)
            In 2^-11, 0 to 3454.
        """
        cut = triangles.normal >> (ATTRIBUTE.fraction_bits - self.FRACTION_BITS)
        turned = np.where(triangles.normal[:, :1] < 0, ~cut, cut)
        total, single = turned.sum(axis=2).min(axis=1), turned.min(axis=1).max(axis=1)
        found: np.ndarray = np.maximum(np.maximum((9 * total) >> 4, single), 0)
        return found

    def compute(self, triangles: Triangles) -> dict[str, np.ndarray]:
        """Bit-accurate beats of each triangle: components x, y and z of N/W, the depth, then the surface.

        Parameters
        ----------
        triangles : Triangles
            With sorted corners.

        Returns
        -------
        dict of str to int64 array, shape (T (4 + S),)
            ``first``, ``middle`` and ``last``: the attribute at each corner, SQ(1, 23); ``least``: the bound.
        """
        attributes = triangles.attributes
        values = np.moveaxis(attributes, 1, 0).reshape(3, -1)
        beats = dict(zip(("first", "middle", "last"), values, strict=True))
        return beats | {"least": np.repeat(self.least(triangles), attributes.shape[2])}
