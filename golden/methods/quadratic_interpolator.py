"""Quadratic interpolation of normals ([T] 2.2), by differences, by evaluation, and by Horner's rule."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from blysk.golden.methods.interpolator import Interpolator
from blysk.golden.methods.normal_interpolator import NormalInterpolator, difference_rounding
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import LENGTH_BITS, pixels_of

__all__ = ["METHODS", "PUBLISHED", "QuadraticInterpolator"]


@dataclass(frozen=True)
class QuadraticInterpolator(NormalInterpolator):
    """Normals on a quadratic through the exactly normalised middle normal, for spans to 45 degrees.

    The units are the middle normal, G/P/Q, and units that ``form`` chooses:

    - forward differences: setup and accumulator, figures 2.11 and 2.10;
    - ``direct``: the evaluator of figure 2.9 a;
    - ``horner``: the evaluator of figure 2.9 b.

    Formats and error bounds are those of the units. Nothing is rounded between them.

    Ends must be of unit length to 1/256. Longer ends may saturate without a flag.

    Parameters
    ----------
    operand : str
        See `NormalInterpolator`.
    form : str
        ``"differences"``, ``"direct"`` or ``"horner"``.
    middle_normal : MiddleNormal
        Model of the middle normal unit.

    Raises
    ------
    ValueError
        If the form or the operand is unknown.

    Source: docs/theory/interpolation.md#quadratic-normals; [T] 2.2, 2.3, figures 2.8 to 2.11.
    """

    form: Literal["differences", "direct", "horner"] = "differences"
    middle_normal: MiddleNormal = field(default_factory=MiddleNormal)

    CURVE = "quadratic"
    ORIGIN = "documents"
    LARGEST_G = 0.305
    LARGEST_P = 0.83

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.form != "differences":
            QuadraticEvaluator(self.form)

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        return {"differences": "quadratic", "direct": "quadratic-eval", "horner": "quadratic-horner"}[
            self.form
        ] + ("" if self.serves_gate else "-published")

    @property
    def serves_gate(self) -> bool:
        """Whether the method serves a highlight gate: only with the default fit of the middle normal."""
        return self.middle_normal == MiddleNormal()

    @property
    def degrees(self) -> Sequence[int]:
        """Degrees of the polynomial for the middle normal: 2 (a plain minimax fit) or 3 (the default)."""
        # The published form has no choice.
        return () if self.middle_normal == MiddleNormal("as_published") else (2, 3)

    def with_degree(self, degree: int) -> Interpolator:
        """The method with another middle normal, see `Interpolator.with_degree`."""
        if degree not in self.degrees:
            return super().with_degree(degree)
        return replace(self, middle_normal=MiddleNormal({2: "minimax_2", 3: "exact"}[degree]))

    @property
    def normal_error(self) -> float:
        """Errors of the middle normal, of the form that evaluates the curve, and of the last rounding.

        Forward differences add two errors:

        - ``2^-17 |P| + (2^-16 + 2^-17 + 2^-34) |G|`` for the reciprocal ``1/(m-1)``, where |P| <= 0.83 and
          |G| <= 0.305;
        - `difference_rounding` at pixel 4094.

        The sum is 4.4 steps of 2^-17 with the default middle normal.
        """
        middle = np.sqrt(3) * self.middle_normal.error
        if self.form != "differences":
            return float(middle + np.sqrt(3) * QuadraticEvaluator(self.form).error)
        # G and P contain four times the middle normal.
        p, g = self.LARGEST_P + 4 * middle, self.LARGEST_G + 4 * middle
        return float(middle + self._reciprocal_error(p, g) + difference_rounding((1 << LENGTH_BITS) - 2))

    @staticmethod
    def _reciprocal_error(p: float, g: float) -> float:
        """Error of a normal from the error of ``1/(m-1)``, if P is p long and G is g long."""
        return 2.0**-17 * p + (2.0**-16 + 2.0**-17 + 2.0**-34) * g

    @property
    def shortest_length(self) -> float:
        """Least length of a normal on the curve, for the largest angle psi of a gate.

        With ``s = 2t - 1`` and ``c = cos(psi/2)`` the squared length is ``1 - (1-c)^2 s^2 (1 - s^2)``. Its
        minimum is at ``s^2 = 1/2``.
        """
        return float(np.sqrt(1 - (1 - np.cos(np.radians(self.gate_angle / 2))) ** 2 / 4))

    def operand_error(self, length: int, degrees: float) -> float:
        """The errors of `normal_error`, at the last pixel of the span."""
        middle = np.sqrt(3) * self.middle_normal.error
        if self.form != "differences":
            return float(middle + np.sqrt(3) * QuadraticEvaluator(self.form).error)
        reciprocal = self._reciprocal_error(self.LARGEST_P, self.LARGEST_G)
        return float(middle + reciprocal + difference_rounding(length))

    def normals(
        self, normal_left: Fixed, normal_right: Fixed, length: np.ndarray
    ) -> tuple[Fixed, np.ndarray]:
        """Bit-accurate normals."""
        middle, out_of_range = self.middle_normal.compute(normal_left, normal_right)
        g, p, q = GPQ().compute(normal_left, middle, normal_right)
        span, step = pixels_of(length)
        if self.form == "differences":
            first, second = DifferenceSetup().compute(g, p, length)
            return DifferenceAccumulator().compute(q, first, second, span, step), out_of_range
        return QuadraticEvaluator(self.form).compute(g, p, q, length, span, step), out_of_range


METHODS = {
    QuadraticInterpolator(): "a quadratic through three normals, by differences",
    QuadraticInterpolator(form="direct"): "the same quadratic, evaluated at every pixel",
    QuadraticInterpolator(form="horner"): "the same quadratic by Horner's rule",
}
"""The methods of this module, and a line about each."""

PUBLISHED = {QuadraticInterpolator(middle_normal=MiddleNormal("as_published")): "as the thesis prints it"}
"""The method with the polynomial of [T] 2.2."""
