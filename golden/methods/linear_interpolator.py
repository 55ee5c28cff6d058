"""Linear interpolation of normals, as it comes (``linear``) or brought to unit length (``renormalise``)."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.methods.interpolator import NormalInterpolator, pixels_of
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import LENGTH_BITS, DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR

__all__ = ["LinearInterpolator"]


@dataclass(frozen=True)
class LinearInterpolator(NormalInterpolator):
    """``(1-t) N_l + t N_r`` by a first difference; with ``renormalised``, divided by its length.

    The first is what is left when a normal is not brought to unit length: too short by ``1 - cos(psi/2)`` in
    the middle. The second is the rival without the documents, with the direct renormaliser at every pixel.
    ``N_r - N_l`` saturates at 1 in a component, over 60 degrees; such a span is flagged. With
    ``renormalised``, so is one with a pixel of which the renormaliser says that it is too short or too long,
    which passes as it is: of unit normals, those over 94 degrees with a pixel near the middle.

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
    def name(self):
        """Name on the command line and in tables."""
        return "renormalise" if self.renormalised else "linear"

    @property
    def CURVE(self) -> str:
        """The curve in exact arithmetic."""
        return "normalised" if self.renormalised else "linear"

    @property
    def normal_error(self):
        """That of the differences, with |P| <= 0.766; renormalised, of a length of 0.92, and of the rest."""
        k = (1 << LENGTH_BITS) - 2
        chord = 2 * np.sin(np.radians(self.gate_angle / 2)) + 4 * CODE_LENGTH_ERROR
        error = 2.0**-17 * chord + np.sqrt(3) * (2.0**-42 * (k + k * k / 2) + 2.0**-18)
        if self.renormalised:
            return float(error / 0.92 + Renormaliser.ERROR + 2 * CODE_LENGTH_ERROR)
        return float(error)

    @property
    def shortest_length(self):
        """In the middle of the widest span."""
        middle = float(np.cos(np.radians(self.gate_angle / 2))) - CODE_LENGTH_ERROR
        return 1.0 if self.renormalised else middle

    def normals(self, normal_left, normal_right, length):
        """Bit-true normals."""
        difference = normal_right - normal_left
        p = difference.saturate(GPQ.P_FORMAT)
        out_of_range = np.any(p.codes != difference.codes, axis=-1)
        zero = Fixed(GPQ.G_FORMAT, np.zeros_like(p.codes))
        first, second = DifferenceSetup().compute(zero, p, length)
        span, step = pixels_of(length)
        normals = DifferenceAccumulator().compute(normal_left, first, second, span, step)
        if self.renormalised:
            normals, outside = Renormaliser().compute(normals)
            out_of_range[span[outside]] = True
        return normals, out_of_range
