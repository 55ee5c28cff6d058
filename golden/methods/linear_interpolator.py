"""Linear interpolation of normals."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.methods.frame_steps import SpanCutter
from blysk.golden.methods.normal_interpolator import NormalInterpolator, difference_rounding
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import LENGTH_BITS, pixels_of
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR, COMPONENT
from blysk.golden.reference.raster import Raster

__all__ = ["METHODS", "LinearInterpolator"]


@dataclass(frozen=True)
class LinearInterpolator(NormalInterpolator):
    """Normals ``(1-t) N_l + t N_r``, by a first difference.

    A normal is too short, by ``1 - cos(psi/2)`` in the middle of the span. Components of ``N_r - N_l``
    saturate at 1. This can happen only in spans over 60 degrees; the span is then flagged.

    Parameters
    ----------
    operand : str
        See `NormalInterpolator`.

    Raises
    ------
    ValueError
        If the operand is unknown.

    Source: docs/theory/interpolation.md#spans; [T] 2.1.
    """

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        return "linear"

    CURVE = "linear"
    ORIGIN = "baseline"

    @property
    def lights_cut(self) -> bool:
        """``False``: spans are cut by their angle alone."""
        return False

    def cut(self, cutter: SpanCutter) -> tuple[Raster, int]:
        """Spans cut by their angle alone."""
        return cutter.by_angle()

    def missed(self, cutter: SpanCutter, cut: Raster) -> int:
        """Spans whose angle alone does not keep the tolerance, see `Interpolator.missed`."""
        return cutter.missed(cut)

    @property
    def normal_error(self) -> float:
        """Error of the forward differences, with ``|P| <= 0.766``."""
        chord = 2 * np.sin(np.radians(self.gate_angle / 2)) + 4 * CODE_LENGTH_ERROR
        return float(COMPONENT.step * chord + difference_rounding((1 << LENGTH_BITS) - 2))

    @property
    def shortest_length(self) -> float:
        """Length in the middle of a span of the largest angle."""
        return float(np.cos(np.radians(self.gate_angle / 2))) - CODE_LENGTH_ERROR

    def operand_error(self, length: int, degrees: float) -> float:
        """Error of a normal: `difference_rounding`, plus ``2^-17 |P|`` for the error of ``1/(m-1)``."""
        half = np.radians(degrees) / 2
        return float(difference_rounding(length) + COMPONENT.step * (2 * np.sin(half) + COMPONENT.step))

    def normals(
        self, normal_left: Fixed, normal_right: Fixed, length: np.ndarray
    ) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate normals."""
        difference = normal_right - normal_left
        p = difference.saturate(GPQ.P_FORMAT)
        out_of_range = np.any(p.codes != difference.codes, axis=-1)
        zero = Fixed(GPQ.G_FORMAT, np.zeros_like(p.codes))
        first, second = DifferenceSetup().compute(zero, p, length)
        span, step = pixels_of(length)
        return DifferenceAccumulator().compute(normal_left, first, second, span, step), out_of_range


METHODS = {LinearInterpolator(): "a straight line between the ends, not normalised: highlights go dull"}
"""The method of this module, and a line about it."""
