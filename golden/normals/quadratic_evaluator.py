"""Quadratic evaluators: the normals of a span by multiplication ([T] figures 2.9 a and b)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from blysk.golden.normals.gpq import GPQ
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.reciprocal import reciprocal_address, reciprocal_table
from blysk.golden.number.spans import checked_lengths
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["QUADRATIC_FORMS", "QuadraticEvaluator"]

QUADRATIC_FORMS = ("direct", "horner")
"""Forms of the evaluator: figure 2.9 a and figure 2.9 b."""


@dataclass(frozen=True)
class QuadraticEvaluator:
    """Normals ``N(t) = G t^2 + P t + Q`` at ``t = k/(m - 1)``, for the pixels k = 0 ... m - 1 of a span.

    ``direct`` adds the two products (figure 2.9 a); ``horner`` is ``(G t + P) t + Q`` (figure 2.9 b).

    The words of the parameter are ``-t`` and ``-t^2``, because ``SQ(1, 17)`` holds -1 but not 1. ``-t`` is
    the sum of ``-dt``, and dt comes from `reciprocal_table` in words of 18 bits. The relative error of these
    words is at most 2^-18. The shifted word and its sums are exact. So the rounded t of the last pixel is
    exactly 1. **The curve starts in** ``N_l`` **and ends in** ``G + P + Q``, **which is** ``N_r``, **at every
    length**.

    ============ =========== ============================================================
    word         format      why
    ============ =========== ============================================================
    1/f          UQ(0, 18)   the end of the longest span rounds to t = 1
    dt           UQ(1, 29)   18 bits shifted by up to 11: exact
    -t (sums)    SQ(1, 29)   starts at 2^-18, so that a cut rounds half up
    -t, -t^2     SQ(1, 17)   multiplier operands; rounded
    G t + P      SQ(1, 17)   multiplier operand of ``horner``; rounded; saturates
    normal       SQ(1, 17)   rounded; saturates
    ============ =========== ============================================================

    The arithmetic error of a component is at most `error` for spans up to 45 degrees, where
    ``|2 G t + P| <= 0.83`` and ``|G| <= 0.305``. The error of t is 2^-18 by its table plus 2^-18 by its
    rounding. The rounding of t^2 (``direct``) or of the inner sum (``horner``) is 2^-18, and the rounding of
    the result, too.

    The middle normal flags wider spans. Cut them before. P saturates from 53 degrees on and G from 57. The
    curve then stays in its words and keeps its start. It misses its end by up to 0.1 at 60 degrees, 0.48 at
    90, 0.78 at 120 and 1.05 at 180 (length of the error vector).

    Parameters
    ----------
    form : str
        One of `QUADRATIC_FORMS`.

    Raises
    ------
    ValueError
        If the form is unknown.

    Source: docs/theory/interpolation.md#quadratic-normals; [T] 2.2, figures 2.9 a and b.
    """

    form: Literal["direct", "horner"] = "direct"

    RECIPROCAL_FORMAT = UQ(0, 18)
    STEP_FORMAT = UQ(1, 29)
    SUM_FORMAT = SQ(1, 29)
    PARAMETER_FORMAT = COMPONENT
    RESULT_FORMAT = COMPONENT

    def __post_init__(self) -> None:
        if self.form not in QUADRATIC_FORMS:
            raise ValueError(f"form must be one of {', '.join(QUADRATIC_FORMS)}, not {self.form!r}")

    @property
    def error(self) -> float:
        """Bound on the error of a component against the exact polynomial, up to 45 degrees."""
        return 2.0**-18 * (2 * 0.83 + (0.305 if self.form == "direct" else 1.0) + 1)

    def step(self, length: np.ndarray) -> Fixed:
        """Bit-accurate ``dt = 1/(m - 1)``; 1 for a span of one pixel, which ignores dt.

        Parameters
        ----------
        length : int array, any shape
            Pixels, 1 to 4095.

        Returns
        -------
        Fixed, same shape, UQ(1, 29)

        Raises
        ------
        ValueError
            If a length is out of range.
        """
        length = checked_lengths(length)
        address, shift = reciprocal_address(length - 1)
        scaled = reciprocal_table(self.RECIPROCAL_FORMAT)[address].scale(1).extend(self.STEP_FORMAT)
        return Fixed(self.STEP_FORMAT, scaled.codes >> shift)

    def parameter(self, step: Fixed, index: np.ndarray) -> Fixed:
        """Bit-accurate ``-t`` of pixels.

        Parameters
        ----------
        step : Fixed, any shape
            dt in ``UQ(1, 29)``.
        index : int array, same shape
            Index of the pixel in its span, from 0 on.

        Returns
        -------
        Fixed, same shape, SQ(1, 17)
        """
        half = 1 << (self.SUM_FORMAT.fraction_bits - self.PARAMETER_FORMAT.fraction_bits - 1)
        return Fixed(self.SUM_FORMAT, half - step.codes * index).truncate(17)

    def evaluate(self, g: Fixed, p: Fixed, q: Fixed, parameter: Fixed) -> Fixed:
        """Bit-accurate normals of single pixels.

        Parameters
        ----------
        g, p, q : Fixed, shape (pixels, 3)
            Coefficients in the formats of `GPQ`.
        parameter : Fixed, shape (pixels,), SQ(1, 17)
            ``-t``, -1 to 0.

        Returns
        -------
        Fixed, shape (pixels, 3), SQ(1, 17)
        """
        minus_t = Fixed(parameter.format, parameter.codes[:, np.newaxis])
        if self.form == "horner":
            inner = (p - g * minus_t).round_half_up(17).saturate(COMPONENT)
            return (q - inner * minus_t).round_half_up(17).saturate(COMPONENT)
        minus_square = (-(minus_t * minus_t)).round_half_up(17).wrap(COMPONENT)
        return (q - p * minus_t - g * minus_square).round_half_up(17).saturate(COMPONENT)

    def compute(
        self, g: Fixed, p: Fixed, q: Fixed, length: np.ndarray, span: np.ndarray, index: np.ndarray
    ) -> Fixed:
        """Bit-accurate normals.

        Parameters
        ----------
        g, p, q : Fixed, shape (spans, 3)
            Coefficients in the formats of `GPQ`.
        length : int array, shape (spans,)
            Pixels of each span, 1 to 4095.
        span : int array, shape (pixels,)
            Span of each pixel.
        index : int array, shape (pixels,)
            Index of each pixel in its span, 0 to the span's length minus 1.

        Returns
        -------
        Fixed, shape (pixels, 3), SQ(1, 17)

        Raises
        ------
        ValueError
            If an operand has another format, or a length is out of range.
        """
        formats = (GPQ.G_FORMAT, GPQ.P_FORMAT, GPQ.Q_FORMAT)
        if (g.format, p.format, q.format) != formats:
            raise ValueError(
                f"operands must be {', '.join(map(str, formats))}, not {g.format}, {p.format}, {q.format}"
            )
        parameter = self.parameter(self.step(length)[span], np.asarray(index, dtype=np.int64))
        return self.evaluate(g[span], p[span], q[span], parameter)
