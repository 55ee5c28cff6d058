"""Bisection of spans until straight lines will do ([T] figure 2.7): method ``bisection``."""

from dataclasses import dataclass, field
from functools import cache

import numpy as np

from blysk.golden.methods.interpolator import NormalInterpolator
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR
from blysk.golden.reference.curves import interpolate

__all__ = ["BisectionInterpolator"]


@dataclass(frozen=True)
class BisectionInterpolator(NormalInterpolator):
    """Normals on straight lines over ``2^k`` arcs of the great circle, k just large enough.

    Formats and error bounds are those of `AdaptiveNormaliser`, for spans to 90
    degrees.

    Parameters
    ----------
    threshold : float
        Largest length error of a normal.
    bisection : Bisection
        Factor of the bisection unit.

    Raises
    ------
    ValueError
        If the threshold is out of range or the operand unknown.

    Source: [T] 2.1, figure 2.7.
    """

    threshold: float = 2.0**-14
    bisection: Bisection = field(default_factory=Bisection)

    MAX_ANGLE = 90.0

    def __post_init__(self):
        super().__post_init__()
        AdaptiveNormaliser(self.threshold)

    @property
    def name(self):
        """Name on the command line and in tables."""
        return "bisection" if self.serves_gate else "bisection-published"

    @property
    def serves_gate(self):
        """Not with the published polynomials."""
        return not self.bisection.as_published

    @property
    def normaliser(self) -> AdaptiveNormaliser:
        """The unit."""
        return _normaliser(self.threshold, self.bisection)

    @property
    def normal_error(self):
        """That of three components, at the largest depth, and the codes' lengths."""
        normaliser = self.normaliser
        return float(np.sqrt(3) * normaliser.error(normaliser.depth, False)) + CODE_LENGTH_ERROR

    @property
    def shortest_length(self):
        """One less the threshold and the rounding of the error block."""
        return 1 - self.threshold - 2.0**-18

    def normals(self, normal_left, normal_right, length):
        """Bit-true normals."""
        normals, out_of_range, _ = self.normaliser.compute(normal_left, normal_right, length)
        return normals, out_of_range

    def exact_normals(self, normal_left, normal_right, t):
        """Straight lines between exact points of the great circle."""
        t = np.asarray(t, dtype=np.float64)
        chord = np.linalg.norm(np.subtract(normal_right, normal_left), axis=-1)
        angle = 2 * np.arcsin(np.minimum(chord / 2, 1))
        depth = self.normaliser.depth
        sagitta = 1 - np.cos(angle[..., np.newaxis] / 2.0 ** np.arange(1, depth + 1))
        segments = 2.0 ** np.count_nonzero(sagitta > self.threshold, axis=-1)
        left = np.minimum(np.floor(t * segments), segments - 1)
        ends = (interpolate("slerp", normal_left, normal_right, (left + k) / segments) for k in (0, 1))
        return interpolate("linear", *ends, t * segments - left)


@cache
def _normaliser(threshold: float, bisection: Bisection) -> AdaptiveNormaliser:
    """The unit, whose polynomials take half a second to fit."""
    return AdaptiveNormaliser(threshold, bisection)
