"""Linear interpolation of normals, as it comes (``linear``) or brought to unit length (``renormalise``)."""

from dataclasses import dataclass

import numpy as np

from .difference_accumulator import DifferenceAccumulator
from .difference_setup import DifferenceSetup
from .fixed import Fixed
from .gpq import GPQ
from .interpolator import NormalInterpolator, pixels_of
from .renormaliser import Renormaliser

__all__ = ["LinearInterpolator"]


@dataclass(frozen=True)
class LinearInterpolator(NormalInterpolator):
    """``(1-t) N_l + t N_r`` by a first difference; with ``renormalised``, divided by its length.

    The first is what is left when a normal is not brought to unit length: too short by ``1 - cos(psi/2)`` in
    the middle. The second is the rival without the documents, with the direct renormaliser at every pixel.
    ``N_r - N_l`` saturates at 1 in a component, over 60 degrees; such a span is flagged.

    Parameters
    ----------
    renormalised : bool
        Whether the normals are brought to unit length.

    Raises
    ------
    ValueError
        If the operand is unknown.

    Source: [T] 2.1; numbers.md, "Rivals to measure against".
    """

    renormalised: bool = False

    @property
    def CURVE(self) -> str:
        """The curve in exact arithmetic."""
        return "normalised" if self.renormalised else "linear"

    def normals(self, normal_left, normal_right, length):
        """Bit-true normals."""
        difference = normal_right - normal_left
        p = difference.saturate(GPQ.P_FORMAT)
        wide = np.any(p.codes != difference.codes, axis=-1)
        zero = Fixed(GPQ.G_FORMAT, np.zeros_like(p.codes))
        first, second = DifferenceSetup().compute(zero, p, length)
        normals = DifferenceAccumulator().compute(normal_left, first, second, *pixels_of(length))
        if self.renormalised:
            normals, _ = Renormaliser().compute(normals)
        return normals, wide
