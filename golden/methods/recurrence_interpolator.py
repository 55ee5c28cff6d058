"""The recurrence method ([T] 3.3): cosines of equal steps on the great circle, by one product each."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.interpolator import Operands
from blysk.golden.methods.normal_interpolator import EndNormalInterpolator
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.spans import LENGTH_BITS, pixels_of
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR

__all__ = ["METHODS", "PUBLISHED", "RecurrenceInterpolator"]


@dataclass(frozen=True)
class RecurrenceInterpolator(EndNormalInterpolator):
    """The cosines N·L and N·H by the recurrence: ``cos gamma(t) = cos beta cos(lambda - t psi)``.

    gamma is the angle between the normal and a fixed vector, L or H. beta is the angle of this vector to the
    plane of the great circle. lambda is the angle from ``N_l`` to its projection on this plane.

    Formats and error bounds are those of `RecurrenceSetup` and `Recurrence`. The results of the recurrence
    have 25 fraction bits here. N·L is the result itself, in ``SQ(2, 25)``. ``1 - N·H`` is computed from the
    result for H, and saturated to ``UQ(1, 25)``. The error e of 1 - N·H does not depend on its size. So the
    error of the specular term is about ``n e`` at the peak. At n = 1000 it is 0.08 LSB for spans of 1 degree
    (e = 3e-7) and 3 LSB for spans of 45 degrees (e = 1.2e-5). Spans over 90 degrees are flagged.

    Parameters
    ----------
    form : str
        Form of the recurrence: ``"reinsch"``, or ``"direct"`` as published, which is unstable. See
        `Recurrence`.

    Source: docs/theory/interpolation.md#recurrence; [T] 3.1, 3.3, figure 3.5.
    """

    form: Literal["reinsch", "direct"] = "reinsch"

    operand: ClassVar = "one_minus_cosine"
    COSINE_FORMAT = SQ(2, 25)
    COSINE_OF_ZERO = 1.0
    MAX_ANGLE = 90.0
    CURVE = "slerp"
    ORIGIN = "documents"

    def __post_init__(self) -> None:
        _ = self.setup

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        return "recurrence" if self.form == "reinsch" else "recurrence-direct"

    @property
    def serves_gate(self) -> bool:
        """Whether the method serves a highlight gate. The direct form, which is unstable, serves none."""
        return self.form == "reinsch"

    @cached_property
    def setup(self) -> RecurrenceSetup:
        """Model of the setup; it contains the model of the recurrence."""
        return RecurrenceSetup(Recurrence(self.form, interleave=4, result_format=self.COSINE_FORMAT))

    @property
    def highlight_excess(self) -> float:
        """Error of setup and recurrence, plus the errors of the lengths of N and H, and of dropped bits.

        It is largest for spans of two pixels.
        """
        if self.form == "direct":
            return 2.0
        length = np.arange(2, 1 << LENGTH_BITS)
        error = self.setup.error(length, np.full(length.shape, np.radians(self.gate_angle)))
        return float(error.max()) + 2 * CODE_LENGTH_ERROR + Specular.ARGUMENT_FORMAT.step

    def operand_error(self, length: int, degrees: float) -> float:
        """Sum of the errors of setup and recurrence."""
        return float(self.setup.error(np.asarray(length), np.radians(degrees)))

    def compute(
        self,
        normal_left: Fixed,
        normal_right: Fixed,
        length: np.ndarray,
        direction: Fixed,
        halfway: Fixed,
    ) -> Operands:
        """Bit-accurate operands of every pixel."""
        span, index = pixels_of(length)
        shape = (len(span), len(direction.codes))
        results = np.zeros((2, *shape), dtype=np.int64)
        out_of_range = np.zeros(len(length), dtype=bool)
        # A call takes as many steps as its longest span has pixels, so a call gets spans of similar length.
        size = np.frexp(length)[1]
        for group in np.unique(size):
            inside = size == group
            part, pixels = np.flatnonzero(inside), np.flatnonzero(inside[span])
            span_of_part = np.cumsum(inside)[span[pixels]] - 1
            for which, vectors in enumerate((direction, halfway)):
                for light in range(shape[1]):
                    first, second, k, shift, flags = self.setup.compute(
                        normal_left[part], normal_right[part], vectors[light], length[part]
                    )
                    out_of_range[part] = flags
                    found = self.setup.recurrence.compute(
                        first, second, k, shift, span_of_part, index[pixels]
                    )
                    results[which, pixels, light] = found.codes
        cosine, highlight = (Fixed(self.COSINE_FORMAT, codes) for codes in results)
        one = Fixed(UQ(1, 25), 1 << 25)
        return Operands(cosine, (one - highlight).saturate(Specular.ARGUMENT_FORMAT), out_of_range)


METHODS = {RecurrenceInterpolator(): "equal angles on the great circle, each cosine from the two before"}
"""The method of this module, and a line about it."""

PUBLISHED = {RecurrenceInterpolator("direct"): "the recurrence as in figure 3.5, which is unstable"}
"""The method with formula 3.3 as published."""
