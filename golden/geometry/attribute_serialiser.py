"""Attribute serialiser: a triangle's attributes one by one, and a bound on its normals' length."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.triangles import ATTRIBUTE, ATTRIBUTES, Triangles

__all__ = ["AttributeSerialiser"]


@dataclass(frozen=True)
class AttributeSerialiser:
    """The components of N/W and the depth of sorted triangles, one after the other, and `least`.

    ``least`` bounds the length m of N/W in the triangle from below: ``m >= max(9/16 M, L)``. Of the corners'
    components, each with the sign that it has at the first corner and cut to 11 fraction bits, M is the
    least sum of a corner's, and L the largest over the components of the least of a component; 0 where that
    is negative. A vector is at least as long as its largest component, and as ``1/sqrt(3)`` of their sum,
    which is over 9/16; both hold for any mean of the corners as they do for the corners.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    FRACTION_BITS = 11
    BITS = 12

    def least(self, triangles: Triangles) -> np.ndarray:
        """Bound on m of sorted triangles, in 2^-11, 0 to 3456; from the components' first 12 bits."""
        cut = triangles.normal >> (ATTRIBUTE.fraction_bits - self.FRACTION_BITS)
        turned = np.where(triangles.normal[:, :1] < 0, ~cut, cut)
        total, single = turned.sum(axis=2).min(axis=1), turned.min(axis=1).max(axis=1)
        return np.maximum(np.maximum((9 * total) >> 4, single), 0)

    def compute(self, triangles: Triangles) -> dict[str, np.ndarray]:
        """Bit-accurate beats, four of each triangle: ``first``, ``middle``, ``last`` and ``least``.

        Parameters
        ----------
        triangles : Triangles
            With sorted corners.
        """
        values = np.moveaxis(triangles.attributes, 1, 0).reshape(3, -1)
        beats = dict(zip(("first", "middle", "last"), values, strict=True))
        return beats | {"least": np.repeat(self.least(triangles), ATTRIBUTES)}
