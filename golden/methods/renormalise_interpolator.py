"""Renormalisation at every pixel: perspective-correct normals of wide spans."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.methods.frame_steps import Bound, ErrorBounds, ExactShading, SpanCutter, SpanFiller
from blysk.golden.methods.interpolator import Operand
from blysk.golden.methods.normal_interpolator import NormalInterpolator
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.line_setup import LineSetup
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.reference.raster import Raster

if TYPE_CHECKING:
    from blysk.golden.geometry.geometry import Geometry

__all__ = ["METHODS", "RenormaliseInterpolator"]


@dataclass(frozen=True)
class RenormaliseInterpolator(NormalInterpolator):
    """Vectors of the true line, ``(1-t) m_l N_l + t m_r N_r``, divided by their lengths: the baseline.

    A span carries the two ends with their lengths, relative to the larger length. The lengths include
    ``1/W``. So the line between the ends is the true line on the screen, and no span is cut for its angle.
    Line setup, accumulator and renormaliser follow. The specular operand is half the squared chord. An error
    of the normal's length counts there only at second order.

    The longer end has length 1. Rounding to words turns a vector of length m by up to
    ``(LineSetup.ERROR + sqrt(3) 2^-23)/m``. At `PIXEL_RATIO`, where m = 1/64, this is 2.7e-5 radians, 0.17
    LSB on the steepest flank of n = 1000. Spans with shorter vectors must be cut. Such vectors occur if W
    differs much between the ends, or if the ends are nearly opposite. If every component of a pixel's vector
    is under 1/256, the span is flagged, and the pixel is wrong.

    Parameters
    ----------
    operand : str
        See `NormalInterpolator`.

    Raises
    ------
    ValueError
        If the operand is unknown.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    operand: Operand = "one_minus_cosine"

    PIXEL_RATIO: ClassVar[float] = 64.0
    END_FORMAT = Renormaliser.VECTOR_FORMAT
    MAX_ANGLE = 180.0
    CURVE = "normalised"
    ORIGIN = "baseline"

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        return "renormalise"

    @property
    def serves_gate(self) -> bool:
        """``False``, because a gate takes unit normals."""
        return False

    @property
    def curve_is_exact(self) -> bool:
        """``True``: each vector of the true line is divided by its length."""
        return True

    @property
    def lights_cut(self) -> bool:
        """``False``: the curve is exact, so no light cuts a span."""
        return False

    def input_lines(self, lights: int, highlights: bool, factors: Sequence[int]) -> list[str]:
        """Line that describes the ends of the true line, see `Interpolator.input_lines`."""
        return [
            "i_normal_*: N/W at the ends of a span, scaled so that the longer of both vectors has length 1, "
            f"in {self.END_FORMAT}; a pixel whose N/W has every component under 1/256 is wrong, and its span "
            "is counted in status_out_of_range_spans"
        ]

    def geometry(self, lights: int) -> "Geometry":
        """Geometry that makes true lines."""
        # Commands that build no geometry start without its files.
        from blysk.golden.geometry.geometry import Geometry

        return Geometry(lines=True)

    def cut(self, cutter: SpanCutter) -> tuple[Raster, int]:
        """Spans cut where a pixel's vector is shorter than `PIXEL_RATIO` allows."""
        return cutter.by_length(self.PIXEL_RATIO)

    def filled(self, filler: SpanFiller) -> Spans:
        """Spans with the ends of the true line."""
        return filler.with_lines()

    def exact_frame(self, shading: ExactShading) -> np.ndarray:
        """A frame by normals on the true line, in exact arithmetic."""
        return shading.by_lines()

    def bound(self, bounds: ErrorBounds[Bound]) -> Bound | None:
        """Bound from the tolerances of spans; the method's curve keeps these tolerances."""
        return bounds.by_tolerance()

    @property
    def accumulator(self) -> DifferenceAccumulator:
        """Model of the accumulator."""
        format = LineSetup.FORMAT
        return DifferenceAccumulator(self.END_FORMAT, format, format, self.END_FORMAT)

    def operand_error(self, length: int, degrees: float) -> float:
        """Bound of the error of N·L and of N·H, for ends of unit length.

        The bound is the error of the line divided by the line's shortest length, plus the renormaliser's
        error.
        """
        shortest = np.cos(np.radians(min(degrees, 170.0)) / 2)
        line = LineSetup.ERROR + np.sqrt(3) * self.END_FORMAT.step
        own = Renormaliser.DIRECTION_ERROR + Renormaliser.LENGTH_ERROR
        return float(2 * (line / shortest + own))

    def normals(
        self, normal_left: Fixed, normal_right: Fixed, length: np.ndarray
    ) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate normals, from ends in ``SQ(1, 22)``."""
        first = LineSetup().compute(normal_left, normal_right, length)
        span, step = pixels_of(length)
        zero = Fixed(first.format, np.zeros_like(first.codes))
        line = self.accumulator.compute(normal_left, first, zero, span, step)
        normals, too_short = Renormaliser().compute(line)
        return normals, np.bincount(span, too_short, len(length)) > 0


METHODS = {RenormaliseInterpolator(): "the true line of normals, each divided by its length; rarely cut"}
"""The method of this module, and a line about it."""
