"""The recurrence method ([T] 3.3): cosines of equal steps on the great circle, one product each."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.interpolator import Interpolator, Operands
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.spans import LENGTH_BITS, pixels_of
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR

__all__ = ["METHODS", "PUBLISHED", "RecurrenceInterpolator"]


@dataclass(frozen=True)
class RecurrenceInterpolator(Interpolator):
    """``cos gamma(t) = cos beta cos(lambda - t psi)`` by the recurrence, for L and H of each light.

    Formats and error bounds are those of `RecurrenceSetup` and `Recurrence`, whose results have 25 fraction
    bits here: N·L as it is, ``SQ(2, 25)``, and ``1 - N·H``, ``UQ(1, 25)``, saturated. The error is absolute,
    whatever the size of 1 - N·H, so an exponent n makes about ``n e`` of an error e at the peak: 3e-7 at 1
    degree is 0.08 steps of an 8-bit channel at n = 1000, 1.2e-5 at 45 degrees is 3. Spans over 90 degrees are
    flagged.

    Parameters
    ----------
    form : str
        Of the recurrence: ``"reinsch"``, or ``"direct"``, as drawn, which is unstable: see `Recurrence`.

    Source: docs/theory/interpolation.md#recurrence; [T] 3.1, 3.3, figure 3.5.
    """

    form: Literal["reinsch", "direct"] = "reinsch"

    operand: ClassVar = "one_minus_cosine"
    COSINE_FORMAT = SQ(2, 25)
    COSINE_OF_ZERO = 1.0
    MAX_ANGLE = 90.0
    CURVE = "slerp"

    def __post_init__(self):
        _ = self.setup

    @property
    def name(self):
        """Name on the command line and in tables."""
        return "recurrence" if self.form == "reinsch" else "recurrence-direct"

    @property
    def serves_gate(self):
        """Not with the direct form, which is unstable."""
        return self.form == "reinsch"

    @cached_property
    def setup(self) -> RecurrenceSetup:
        """Model of the setup, with that of the recurrence."""
        return RecurrenceSetup(Recurrence(self.form, interleave=4, result_format=self.COSINE_FORMAT))

    @property
    def highlight_excess(self):
        """Error of the setup and the recurrence, largest for spans of two pixels; lengths of the codes."""
        if self.form == "direct":
            return 2.0
        length = np.arange(2, 1 << LENGTH_BITS)
        error = self.setup.error(length, np.full(length.shape, np.radians(self.gate_angle)))
        return float(error.max()) + 2 * CODE_LENGTH_ERROR + Specular.ARGUMENT_FORMAT.step

    def operand_error(self, length, degrees):
        """That of the setup and the recurrence."""
        return float(self.setup.error(length, np.radians(degrees)))

    def compute(self, normal_left, normal_right, length, direction, halfway):
        """Bit-accurate operands."""
        span, index = pixels_of(length)
        shape = (len(span), len(direction.codes))
        results = np.zeros((2, *shape), dtype=np.int64)
        out_of_range = np.zeros(len(length), dtype=bool)
        # All spans of a call take as many steps as the longest, so those of similar length go together.
        size = np.frexp(length)[1]
        for group in np.unique(size):
            inside = size == group
            part, pixels = np.flatnonzero(inside), np.flatnonzero(inside[span])
            span_of_part = np.cumsum(inside)[span[pixels]] - 1
            for which, vectors in enumerate((direction, halfway)):
                for light in range(shape[1]):
                    *start, out_of_range[part] = self.setup.compute(
                        normal_left[part], normal_right[part], vectors[light], length[part]
                    )
                    found = self.setup.recurrence.compute(*start, span_of_part, index[pixels])
                    results[which, pixels, light] = found.codes
        cosine, highlight = (Fixed(self.COSINE_FORMAT, codes) for codes in results)
        one = Fixed(UQ(1, 25), 1 << 25)
        return Operands(cosine, (one - highlight).saturate(Specular.ARGUMENT_FORMAT), out_of_range)


METHODS = (RecurrenceInterpolator(),)
"""Its method."""

PUBLISHED = (RecurrenceInterpolator("direct"),)
"""Formula 3.3 as it is."""
