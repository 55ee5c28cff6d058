"""Half-way vector ([T] figure 4.10, vector H): between the directions of the light and of the viewer."""

from dataclasses import dataclass, field

import numpy as np

from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["HalfwayVector"]


@dataclass(frozen=True)
class HalfwayVector:
    """Half-way vector ``H = (L + V) / |L + V|``. It is 0 where L and V are opposite.

    The sum is exact, and half of it is normalised by `VectorNormaliser`. So the length of H is off by at most
    `VectorNormaliser.LENGTH_ERROR`. Its direction is off by at most `VectorNormaliser.DIRECTION_ERROR` from
    the exact sum of the operands. If all components of the sum are in [-2^-15, 2^-15), L and V count as
    opposite.

    Parameters
    ----------
    normaliser : VectorNormaliser
        For `SPAN_NORMAL`.

    Source: docs/theory/geometry.md#half-way-vector; [T] figure 4.10.
    """

    normaliser: VectorNormaliser = field(default_factory=VectorNormaliser)

    SUM_FORMAT = SQ(2, COMPONENT.fraction_bits)

    def compute(self, light: Fixed, viewer: Fixed) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate half-way vectors.

        Parameters
        ----------
        light, viewer : Fixed, shape (..., 3), SQ(1, 17)
            Unit vectors L and V.

        Returns
        -------
        halfway : Fixed, shape (..., 3), SQ(1, 17)
            H.
        opposite : bool array, shape (...)
            Whether L and V are opposite. Then H is 0.
        """
        half = (light + viewer).wrap(self.SUM_FORMAT).scale(-1).extend(SPAN_NORMAL)
        halfway, opposite = self.normaliser.compute(half, np.zeros(half.shape[:-1], dtype=bool))
        return Fixed(COMPONENT, np.where(opposite[..., np.newaxis], 0, halfway.codes)), opposite
