"""Bisection of spans into segments short enough for straight lines ([T] figure 2.7): method ``bisection``."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from blysk.golden.methods.interpolator import Interpolator
from blysk.golden.methods.normal_interpolator import NormalInterpolator
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR
from blysk.golden.reference.curves import interpolate

__all__ = ["METHODS", "PUBLISHED", "BisectionInterpolator"]


@dataclass(frozen=True)
class BisectionInterpolator(NormalInterpolator):
    """Normals on straight lines over ``2^k`` arcs of the great circle, with the least k for the threshold.

    Formats and error bounds are those of `AdaptiveNormaliser`, for spans to 90 degrees.

    Parameters
    ----------
    operand : str
        See `NormalInterpolator`.
    threshold : float
        Largest length error of a normal.
    bisection : Bisection
        Bit-accurate model of the bisection unit, with its factor.

    Raises
    ------
    ValueError
        If the threshold is out of range or the operand unknown.

    Source: docs/theory/interpolation.md#adaptive-normaliser; [T] 2.1, figure 2.7.
    """

    threshold: float = 2.0**-14
    bisection: Bisection = field(default_factory=Bisection)

    ORIGIN = "documents"
    MAX_ANGLE = 90.0
    # The ends of the straight lines lie at multiples of 1/2^k. None of the places here is an end.
    CHECKED_AT = (0.09, 0.31, 0.45, 0.64, 0.82)

    def __post_init__(self) -> None:
        super().__post_init__()
        AdaptiveNormaliser(self.threshold)

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        return "bisection" if self.serves_gate else "bisection-published"

    @property
    def serves_gate(self) -> bool:
        """Whether the method serves a highlight gate. With the published polynomials it serves none."""
        return not self.bisection.as_published

    @property
    def divides_spans(self) -> bool:
        """``True``: a span of several segments takes more cycles."""
        return True

    @property
    def degrees(self) -> Sequence[int]:
        """Degrees of the factor of `Bisection`; empty for the published factor."""
        return () if self.bisection.as_published else (1, 2)

    def with_degree(self, degree: int) -> Interpolator:
        """The method with another factor, see `Interpolator.with_degree`."""
        if degree not in self.degrees:
            return super().with_degree(degree)
        return replace(self, bisection=replace(self.bisection, degree=degree))

    @property
    def normaliser(self) -> AdaptiveNormaliser:
        """Model of the adaptive normaliser."""
        return _normaliser(self.threshold, self.bisection)

    @property
    def normal_error(self) -> float:
        """Error of the normaliser at the largest depth, in three components, plus `CODE_LENGTH_ERROR`."""
        normaliser = self.normaliser
        return float(np.sqrt(3) * normaliser.error(normaliser.depth, False)) + CODE_LENGTH_ERROR

    @property
    def shortest_length(self) -> float:
        """1 minus the threshold, minus the rounding error of the error block."""
        return 1 - self.threshold - 2.0**-18

    def operand_error(self, length: int, degrees: float) -> float:
        """Error of the normaliser at any depth plus the distance of a straight line from the great circle."""
        return _operand_error(self.normaliser, degrees > MAX_SPAN_ANGLE)

    def normals(
        self, normal_left: Fixed, normal_right: Fixed, length: np.ndarray
    ) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate normals."""
        normals, out_of_range, _ = self.normaliser.compute(normal_left, normal_right, length)
        return normals, out_of_range

    def exact_normals(self, normal_left: np.ndarray, normal_right: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Straight lines between exact points of the great circle."""
        t = np.asarray(t, dtype=np.float64)
        chord = np.linalg.norm(np.subtract(normal_right, normal_left), axis=-1)
        angle = 2 * np.arcsin(np.minimum(chord / 2, 1))
        depth = self.normaliser.depth
        sagitta = 1 - np.cos(angle[..., np.newaxis] / 2.0 ** np.arange(1, depth + 1))
        segments = 2.0 ** np.count_nonzero(sagitta > self.threshold, axis=-1)
        left = np.minimum(np.floor(t * segments), segments - 1)
        start, end = (interpolate("slerp", normal_left, normal_right, (left + k) / segments) for k in (0, 1))
        return interpolate("linear", start, end, t * segments - left)


@cache
def _normaliser(threshold: float, bisection: Bisection) -> AdaptiveNormaliser:
    """The bit-accurate model, cached because the fit of its polynomials takes half a second."""
    return AdaptiveNormaliser(threshold, bisection)


@cache
def _operand_error(normaliser: AdaptiveNormaliser, beyond_45_degrees: bool) -> float:
    threshold = normaliser.threshold
    error = max(normaliser.error(depth, beyond_45_degrees) for depth in range(normaliser.depth + 1))
    # A line of angle psi is off the great circle by the threshold in length and by 0.017 psi^3 in direction.
    return float(np.sqrt(3) * error + threshold + 2.0**-19 + 0.017 * (8.1 * threshold) ** 1.5)


METHODS = {BisectionInterpolator(): "spans halved until straight lines are exact enough"}
"""The method of this module, and a line about it."""

PUBLISHED = {
    BisectionInterpolator(
        bisection=Bisection(as_published=True)
    ): "with the polynomials that the thesis prints"
}
"""The method with the polynomials of [T] 2.1."""
