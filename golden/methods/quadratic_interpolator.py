"""Quadratic interpolation of normals ([T] 2.2): methods ``quadratic``, ``-eval`` and ``-horner``."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from blysk.golden.methods.interpolator import NormalInterpolator, pixels_of
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator

__all__ = ["QuadraticInterpolator"]


@dataclass(frozen=True)
class QuadraticInterpolator(NormalInterpolator):
    """Normals on a quadratic through the exactly normalised middle normal, for spans to 45 degrees.

    Middle normal, G/P/Q, and then by ``form``: forward differences (setup and accumulator, figures 2.11 and
    2.10), or the evaluator of figure 2.9 a (``direct``) or b (``horner``). Formats and error bounds are those
    of the devices; nothing is rounded in between.

    Parameters
    ----------
    form : str
        ``"differences"``, ``"direct"`` or ``"horner"``.
    middle_normal : MiddleNormal
        The unit that finds it.

    Raises
    ------
    ValueError
        If the form or the operand is unknown.

    Ends must be of unit length to 1/256; longer ones may saturate without a flag.

    Source: [T] 2.2, 2.3, figures 2.8 to 2.11.
    """

    form: Literal["differences", "direct", "horner"] = "differences"
    middle_normal: MiddleNormal = field(default_factory=MiddleNormal)

    CURVE = "quadratic"

    def __post_init__(self):
        super().__post_init__()
        if self.form != "differences":
            QuadraticEvaluator(self.form)

    @property
    def name(self):
        """Name on the command line and in tables."""
        return {"differences": "quadratic", "direct": "quadratic-eval", "horner": "quadratic-horner"}[
            self.form
        ] + ("" if self.serves_gate else "-published")

    @property
    def serves_gate(self):
        """Not with another fit of the middle normal."""
        return self.middle_normal == MiddleNormal()

    @property
    def normal_error(self):
        """Errors of the middle normal, of the form that evaluates the curve, and of the last rounding.

        For differences: ``2^-17 |P| + (2^-16 + 2^-17 + 2^-34) |G|`` for the reciprocal of the length, with
        |P| <= 0.83 and |G| <= 0.305; ``sqrt(3) 2^-42 (k + k^2/2)`` for the rounding of the differences at
        pixel k, to 4094; ``sqrt(3) 2^-18``. 4.4 steps of 2^-17 in all with the default middle normal.
        """
        middle = np.sqrt(3) * self.middle_normal.error
        if self.form != "differences":
            return float(middle + np.sqrt(3) * QuadraticEvaluator(self.form).error)
        # G and P have four times the middle normal.
        k, p, g = 4094, 0.83 + 4 * middle, 0.305 + 4 * middle
        reciprocal = 2.0**-17 * p + (2.0**-16 + 2.0**-17 + 2.0**-34) * g
        return float(middle + reciprocal + np.sqrt(3) * (2.0**-42 * (k + k * k / 2) + 2.0**-18))

    @property
    def shortest_length(self):
        """``1 - (1-c)^2 s^2 (1 - s^2)`` squared, ``c = cos(psi/2)``: least at ``s^2 = 1/2``."""
        return float(np.sqrt(1 - (1 - np.cos(np.radians(self.gate_angle / 2))) ** 2 / 4))

    def normals(self, normal_left, normal_right, length):
        """Bit-true normals."""
        middle, out_of_range = self.middle_normal.compute(normal_left, normal_right)
        g, p, q = GPQ().compute(normal_left, middle, normal_right)
        span, step = pixels_of(length)
        if self.form == "differences":
            first, second = DifferenceSetup().compute(g, p, length)
            return DifferenceAccumulator().compute(q, first, second, span, step), out_of_range
        return QuadraticEvaluator(self.form).compute(g, p, q, length, span, step), out_of_range
