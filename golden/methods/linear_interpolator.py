"""Linear interpolation of normals, as it is (``linear``) or brought to unit length (``renormalise``)."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.methods.interpolator import NormalInterpolator, difference_rounding
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import LENGTH_BITS, pixels_of
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR, COMPONENT

__all__ = ["METHODS", "LinearInterpolator"]


@dataclass(frozen=True)
class LinearInterpolator(NormalInterpolator):
    """``(1-t) N_l + t N_r`` by a first difference; with ``renormalised``, divided by its length.

    Without the division a normal is too short, by ``1 - cos(psi/2)`` in the middle of the span. With it, by
    the direct renormaliser at every pixel, the method is the baseline with which the others are compared.

    ``N_r - N_l`` saturates at 1 in a component, over 60 degrees; such a span is flagged. With
    ``renormalised``, so is a span with a pixel of which the renormaliser says that it is too short or too
    long, which passes as it is: of unit normals, those over 94 degrees with a pixel near the middle.

    Parameters
    ----------
    operand : str
        See `NormalInterpolator`.
    renormalised : bool
        Whether the normals are brought to unit length.

    Raises
    ------
    ValueError
        If the operand is unknown.

    Source: docs/theory/interpolation.md#spans, docs/theory/interpolation.md#renormaliser; [T] 2.1.
    """

    renormalised: bool = False

    @property
    def name(self):
        """Name on the command line and in tables."""
        return "renormalise" if self.renormalised else "linear"

    CUT_BY_ERROR = False

    @property
    def CURVE(self) -> str:
        """The curve in exact arithmetic."""
        return "normalised" if self.renormalised else "linear"

    @property
    def normal_error(self):
        """Error of the differences, ``|P| <= 0.766``; renormalised: at a length of 0.92, and of that unit."""
        chord = 2 * np.sin(np.radians(self.gate_angle / 2)) + 4 * CODE_LENGTH_ERROR
        error = COMPONENT.step * chord + difference_rounding((1 << LENGTH_BITS) - 2)
        if self.renormalised:
            return float(error / 0.92 + Renormaliser.ERROR + 2 * CODE_LENGTH_ERROR)
        return float(error)

    @property
    def shortest_length(self):
        """In the middle of a span of the largest angle."""
        middle = float(np.cos(np.radians(self.gate_angle / 2))) - CODE_LENGTH_ERROR
        return 1.0 if self.renormalised else middle

    def operand_error(self, length, degrees):
        """`difference_rounding`; P times 2^-17 for ``1/(m-1)``; error of the renormaliser."""
        half = np.radians(degrees) / 2
        error = difference_rounding(length) + COMPONENT.step * (2 * np.sin(half) + COMPONENT.step)
        return float(error / np.cos(half) + Renormaliser.ERROR if self.renormalised else error)

    def normals(self, normal_left, normal_right, length):
        """Bit-accurate normals."""
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


METHODS = (LinearInterpolator(), LinearInterpolator(renormalised=True))
"""Its methods."""
