"""Forward-difference accumulator: one normal a pixel ([T] figure 2.10)."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["DifferenceAccumulator"]


@dataclass(frozen=True)
class DifferenceAccumulator:
    """``N += W; W += 2 G dt^2`` once a pixel, from ``N = Q`` and ``W = W_0``.

    ====== ============ =====================================================================
    word   format       why
    ====== ============ =====================================================================
    N, W   SQ(2, 42)    adders are cheap: an error e of the second difference grows to e m^2/2
    normal SQ(1, 17)    18 bits for the multipliers that follow
    ====== ============ =====================================================================

    These are the formats of a component of a normal; the parameters make it serve other quadratics.

    Half a step of the output is added to N once, at the start, so that rounding half up is a cut; a value
    past the end of ``SQ(1, 17)`` saturates. The sums themselves are exact. Up to 45 degrees no value that is
    used leaves ``SQ(2, 42)``; a wider, flagged span may wrap there.

    Error of a normal against ``Q + k W_0 + k (k - 1)/2 (2 G dt^2)``: the last rounding, 2^-18, alone, unless
    it saturates. Drift from the rounding of the differences is bounded in `DifferenceSetup`.

    Parameters
    ----------
    start_format : Format
        Of the first value Q.
    format : Format
        Of the sum N.
    difference_format : Format
        Of W and the second difference.
    result_format : Format
        Of a pixel's value.

    Source: [T] figure 2.10; numbers.md, "Recurrences in fixed point".
    """

    start_format: Format = COMPONENT
    format: Format = DifferenceSetup.FORMAT
    difference_format: Format = DifferenceSetup.FORMAT
    result_format: Format = COMPONENT

    def compute(self, start: Fixed, first: Fixed, second: Fixed, span: np.ndarray, step: np.ndarray) -> Fixed:
        """Bit-true normals, in closed form.

        Parameters
        ----------
        start : Fixed, shape (spans, components), `start_format`
            Values at the first pixel.
        first, second : Fixed, shape (spans, components), `difference_format`
            Differences.
        span : int array, shape (pixels,)
            Span of each pixel.
        step : int array, shape (pixels,)
            Place of each pixel in its span, 0 to 4094.

        Returns
        -------
        Fixed, shape (pixels, components), `result_format`

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        wanted = (self.start_format, self.difference_format, self.difference_format)
        if (start.format, first.format, second.format) != wanted:
            raise ValueError(f"operands must be {', '.join(map(str, wanted))}")
        fraction_bits = self.format.fraction_bits
        shift = fraction_bits - self.start_format.fraction_bits
        step = np.asarray(step, dtype=np.int64)[:, np.newaxis]
        # An int64 wraps modulo 2^64, the hardware modulo its width: the low bits agree whatever the size.
        total = (
            (start.codes[span] << shift)
            + (1 << (fraction_bits - self.result_format.fraction_bits - 1))
            + step * first.codes[span]
            + step * (step - 1) // 2 * second.codes[span]
        )
        result = self.result_format
        return Fixed(self.format, self.format.wrap(total)).truncate(result.fraction_bits).saturate(result)
