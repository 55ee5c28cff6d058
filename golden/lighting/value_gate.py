"""Value gate, which stops spans of ``chord-local`` without a visible highlight, by three values of u."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.lighting.gate import Gate
from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import SQ, UQ, Fixed, Format

__all__ = ["ValueGate"]


@dataclass(frozen=True)
class ValueGate(Gate):
    """Whether a span may be lit, from ``u = |N - H|^2 / 2`` at its first pixel, middle and last pixel.

    The u of the pixels lie on a quadratic, ``u_l + P t + G t^2`` with ``G = 2 (u_l + u_r - 2 u_m)``. It is
    the straight line from u_l to u_r minus ``G t (1 - t)``. Hence it is at least
    ``min(u_l, u_r) - max(G, 0) / 4``. `least` is twice this bound. A span is lit unless

    - ``|u_l + u_r - 2 u_m| < 2^-5`` and ``|u_r - u_l| < 2^-3``, so that ``|G| < 1/16`` and ``|P| < 3/16`` fit
      their words; and
    - `least` is at least a threshold, from a PROM addressed by the exponent.

    A pixel's u is within `margin` of the quadratic through the values. The threshold is twice the sum of the
    margin, one step, and the largest argument with a term over 0 (`HighlightOperand.last_lit_arguments`).
    **So no pixel of a span that is not lit has a specular term other than 0**, and the picture is the same to
    the bit (docs/theory/bounds.md#gate-of-values). The gate needs no multiplication.

    In a span of one pixel all three values belong to the pixel.

    Parameters
    ----------
    specular : Specular or Power
        Model of the gated unit. Its operand is 1 - N·H.

    Source: docs/theory/units.md#highlight-gate.
    """

    specular: HighlightOperand = field(default_factory=lambda: Specular(operand="one_minus_cosine"))

    LEVEL_FORMAT = SQ(4, ChordSetup.HIGHLIGHT_FORMAT.fraction_bits)
    THRESHOLD_FORMAT = UQ(3, 15)
    LARGEST_BULGE = 1 << ChordSetup.HIGHLIGHT_FORMAT.fraction_bits - 5
    LARGEST_RISE = 1 << ChordSetup.HIGHLIGHT_FORMAT.fraction_bits - 3

    @cached_property
    def margin(self) -> float:
        """Largest distance of a pixel's u from the quadratic through the values."""
        return float(2.0**-23 + ChordSetup().walk_error(np.asarray(3 / 16), np.asarray(1 / 16)) + 2.0**-26)

    @property
    def threshold_format(self) -> Format:
        """``THRESHOLD_FORMAT``."""
        return self.THRESHOLD_FORMAT

    @property
    def threshold_rule(self) -> str | None:
        """See `Gate.threshold_rule`."""
        return "2^16 times the least u from which on all values are 0, rounded up, + 1"

    def thresholds_of(self, last_lit_arguments: np.ndarray) -> Fixed:
        """Thresholds from the largest arguments with a term over 0, in steps of 2^-25; rounded up.

        If every argument may be lit, the threshold is over 4. No `least` reaches this.
        """
        format = self.THRESHOLD_FORMAT
        nearest = (np.asarray(last_lit_arguments) + 1) * 2.0**-25 + self.margin
        codes = np.ceil(2 * nearest / format.step).astype(np.int64)
        return Fixed(format, np.minimum(codes, format.max_code))

    def compute(self, highlight: np.ndarray, exponent: int | np.ndarray) -> np.ndarray:
        """Bit-accurate decisions.

        Parameters
        ----------
        highlight : int64 array, shape (..., 3)
            Codes of u, UQ(1, 26).
        exponent : int or int array, broadcast to (...)
            1 to 1000.

        Returns
        -------
        bool array, shape (...)
            False: every pixel of the span has a specular term of 0.

        Raises
        ------
        ValueError
            If an exponent is out of range.
        """
        return self.compute_by(highlight, self.thresholds_at(exponent))

    def compute_by(self, highlight: np.ndarray, threshold: Fixed) -> np.ndarray:
        """Decisions as by `compute`, from thresholds, UQ(3, 15), in place of exponents."""
        left, middle, right = np.moveaxis(highlight, -1, 0)
        held = (np.abs(left + right - 2 * middle) < self.LARGEST_BULGE) & (
            np.abs(right - left) < self.LARGEST_RISE
        )
        level = threshold.extend(self.LEVEL_FORMAT).codes
        found: np.ndarray = ~held | (self.least(highlight) < level)
        return found

    def lit(self, spans: Spans, halfway: np.ndarray, threshold: Fixed) -> np.ndarray:
        """Bit-accurate decisions from the values of spans, see `Gate.lit`; H has no effect.

        Values that belong to no pixel are replaced. These are the middle value of a span of two pixels, and
        the second and third value of a span of one pixel.
        """
        if spans.values is None:
            raise ValueError("a value gate takes spans with values")
        highlight = spans.values.highlight.astype(np.int64)
        length = np.asarray(spans.length)
        short, one = length < 3, length == 1
        highlight[short, :, 1] = highlight[short][:, :, ::2].min(axis=-1)
        highlight[one] = highlight[one][:, :, :1]
        return self.compute_by(highlight, threshold[:, np.newaxis])

    @staticmethod
    def least(highlight: np.ndarray) -> np.ndarray:
        """``2 min(u_l, u_r) - max(u_l + u_r - 2 u_m, 0)``, from the three values along the last axis."""
        left, middle, right = np.moveaxis(highlight, -1, 0)
        found: np.ndarray = 2 * np.minimum(left, right) - np.maximum(left + right - 2 * middle, 0)
        return found
