"""Forward-difference accumulator: one normal a pixel ([T] figure 2.10)."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["DifferenceAccumulator"]


@dataclass(frozen=True)
class DifferenceAccumulator:
    """Normals by forward differences: ``N += W; W += 2 G dt^2`` once a pixel, from ``N = Q``, ``W = W_0``.

    ====== ============ =====================================================================
    word   format       why
    ====== ============ =====================================================================
    N, W   SQ(2, 42)    as an error e of the second difference grows to e m^2/2; adders are cheap
    normal SQ(1, 17)    18 bits for the multipliers that follow
    ====== ============ =====================================================================

    These are the formats of a component of a normal. Other quadratics have other formats.

    Half a step of the output is added to N once, at the start. A cut then rounds half up. A value past the
    end of ``SQ(1, 17)`` saturates. The sums are exact. Up to 45 degrees no used value leaves ``SQ(2, 42)``.
    In a wider span, which the middle normal flags, sums may wrap.

    The error of a normal against ``Q + k W_0 + k (k - 1)/2 (2 G dt^2)`` is the last rounding, 2^-18, unless
    the value saturates. `DifferenceSetup` bounds the drift from the rounding of the differences.

    Parameters
    ----------
    start_format : Format
        Format of the first value Q.
    format : Format
        Format of the sum N.
    difference_format : Format
        Format of W and the second difference.
    result_format : Format
        Format of a pixel's value.

    Source: docs/theory/interpolation.md#forward-differences; [T] figure 2.10.
    """

    start_format: Format = COMPONENT
    format: Format = DifferenceSetup.FORMAT
    difference_format: Format = DifferenceSetup.FORMAT
    result_format: Format = COMPONENT

    def compute(
        self, start: Fixed, first: Fixed, second: Fixed, span: np.ndarray, index: np.ndarray
    ) -> Fixed:
        """Bit-accurate normals, in closed form.

        Parameters
        ----------
        start : Fixed, shape (spans, components), `start_format`
            Values at the first pixel.
        first, second : Fixed, shape (spans, components), `difference_format`
            First and second differences.
        span : int array, shape (pixels,)
            Span of each pixel.
        index : int array, shape (pixels,)
            Index of each pixel in its span, 0 to 4094.

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
        index = np.asarray(index, dtype=np.int64)[:, np.newaxis]
        # An int64 wraps modulo 2^64, and the hardware modulo 2^width. Their low bits agree.
        total = (
            (start.codes[span] << shift)
            + (1 << (fraction_bits - self.result_format.fraction_bits - 1))
            + index * first.codes[span]
            + index * (index - 1) // 2 * second.codes[span]
        )
        result = self.result_format
        return Fixed(self.format, self.format.wrap(total)).truncate(result.fraction_bits).saturate(result)
