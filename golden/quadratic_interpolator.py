"""Quadratic interpolation of normals ([T] 2.2): methods ``quadratic``, ``-eval`` and ``-horner``."""

from dataclasses import dataclass
from typing import Literal

from .difference_accumulator import DifferenceAccumulator
from .difference_setup import DifferenceSetup
from .gpq import GPQ
from .interpolator import NormalInterpolator, pixels_of
from .middle_normal import MiddleNormal
from .quadratic_evaluator import QuadraticEvaluator

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

    Raises
    ------
    ValueError
        If the form or the operand is unknown.

    Source: [T] 2.2, 2.3, figures 2.8 to 2.11.
    """

    form: Literal["differences", "direct", "horner"] = "differences"

    CURVE = "quadratic"

    def __post_init__(self):
        super().__post_init__()
        if self.form != "differences":
            QuadraticEvaluator(self.form)

    def normals(self, normal_left, normal_right, length):
        """Bit-true normals."""
        middle, wide = MiddleNormal().compute(normal_left, normal_right)
        g, p, q = GPQ().compute(normal_left, middle, normal_right)
        span, step = pixels_of(length)
        if self.form == "differences":
            first, second = DifferenceSetup().compute(g, p, length)
            return DifferenceAccumulator().compute(q, first, second, span, step), wide
        return QuadraticEvaluator(self.form).compute(g, p, q, length, span, step), wide
