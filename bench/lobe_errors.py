"""Errors of a lobe's table, by the size of the table: largest errors over all operands of its steps."""

from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.lobes import BECKMANN, GGX
from blysk.golden.reference.reflection import BLINN, ReflectionModel

__all__ = ["CASES", "Case", "errors_of_size", "largest_error"]


@dataclass(frozen=True)
class Case:
    """A model, and the exponents or alphas of its table."""

    reflection: ReflectionModel
    label: str
    values: tuple[float, ...]

    def parameter(self, value: float) -> float:
        """Parameter of the model: an exponent, or the roughness of an alpha."""
        return value if self.reflection.PARAMETER == "exponent" else value**0.5


CASES = (
    Case(BLINN, "n", (1, 2, 10, 100, 1000)),
    Case(BECKMANN, "alpha", (0.03, 0.1, 0.3, 0.6, 1)),
    Case(GGX, "alpha", (0.0025, 0.01, 0.03, 0.05, 0.1, 0.3, 0.6, 1)),
)
"""Models and values of the columns of the table of sizes."""


def largest_error(lobe: Lobe, parameter: float | None, samples: int = 256) -> float:
    """Largest error of a table's terms against the model, in LSB of an 8-bit channel at intensity 1.

    Parameters
    ----------
    lobe : Lobe
        A lobe with the operand ``one_minus_cosine``.
    parameter : float or None
        Parameter of the model.
    samples : int
        Number of sampled operands in each step of the table. The first and the last operand are among them.
        If a step has fewer operands, all are sampled.
    """
    knots = np.ldexp(lobe.knots, lobe.fraction_bits).astype(np.int64)
    first, last = knots[:-1, np.newaxis], knots[1:, np.newaxis] - 1
    codes = np.unique(first + (last - first) * np.arange(samples) // (samples - 1))
    terms = lobe.compute(
        Fixed(lobe.operand_format, codes), np.zeros(codes.shape, bool), lobe.table(parameter)
    )
    exact = lobe.reflection.reflect(1 - np.ldexp(codes, -lobe.fraction_bits), parameter)
    return 255 * float(np.abs(terms.values - exact).max())


def errors_of_size(octaves: int, steps: int, samples: int = 256) -> list[list[float]]:
    """Largest errors of tables of this size: a row for each of `CASES`, by `largest_error`."""
    lobe = Lobe(BLINN, "one_minus_cosine", octaves, steps)
    return [
        [
            largest_error(replace(lobe, reflection=case.reflection), case.parameter(value), samples)
            for value in case.values
        ]
        for case in CASES
    ]
