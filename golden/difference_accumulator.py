"""Forward-difference accumulator: one normal a pixel ([T] figure 2.10)."""

from dataclasses import dataclass

import numpy as np

from .difference_setup import DifferenceSetup
from .fixed import Fixed
from .unit_vector import COMPONENT

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

    Half a step of the output is added to N once, at the start, so that rounding half up is a cut; a value
    past the end of ``SQ(1, 17)`` saturates. The sums themselves are exact. Up to 45 degrees no value that is
    used leaves ``SQ(2, 42)``; a wider, flagged span may wrap there.

    Error of a normal against ``Q + k W_0 + k (k - 1)/2 (2 G dt^2)``: the last rounding, 2^-18, alone, unless
    it saturates. Drift
    from the rounding of the differences is bounded in `DifferenceSetup`.

    Source: [T] figure 2.10; numbers.md, "Recurrences in fixed point".
    """

    FORMAT = DifferenceSetup.FORMAT
    RESULT_FORMAT = COMPONENT

    def compute(self, start: Fixed, first: Fixed, second: Fixed, span: np.ndarray, step: np.ndarray) -> Fixed:
        """Bit-true normals, in closed form.

        Parameters
        ----------
        start : Fixed, shape (spans, 3), SQ(1, 17)
            Normals at the first pixel.
        first, second : Fixed, shape (spans, 3), SQ(2, 42)
            Differences.
        span : int array, shape (pixels,)
            Span of each pixel.
        step : int array, shape (pixels,)
            Place of each pixel in its span, 0 to 4094.

        Returns
        -------
        Fixed, shape (pixels, 3), SQ(1, 17)

        Raises
        ------
        ValueError
            If an operand has another format.
        """
        if (start.format, first.format, second.format) != (COMPONENT, self.FORMAT, self.FORMAT):
            raise ValueError(f"operands must be {COMPONENT}, {self.FORMAT}, {self.FORMAT}")
        shift = self.FORMAT.fraction_bits - COMPONENT.fraction_bits
        step = np.asarray(step, dtype=np.int64)[:, np.newaxis]
        # An int64 wraps modulo 2^64, the hardware modulo 2^44: the low 44 bits agree whatever the size.
        total = (
            (start.codes[span] << shift)
            + (1 << (shift - 1))
            + step * first.codes[span]
            + step * (step - 1) // 2 * second.codes[span]
        )
        width = self.FORMAT.width
        total = ((total & ((1 << width) - 1)) ^ (1 << (width - 1))) - (1 << (width - 1))
        return Fixed(self.FORMAT, total).truncate(COMPONENT.fraction_bits).saturate(COMPONENT)
