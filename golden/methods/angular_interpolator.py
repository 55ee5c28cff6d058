"""The angular method ([T] 3.1, 3.2): cosines of angles in equal steps on the great circle."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import Arccos
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.methods.interpolator import Operands
from blysk.golden.methods.normal_interpolator import EndNormalInterpolator
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["METHODS", "PUBLISHED", "AngularInterpolator"]


@dataclass(frozen=True)
class AngularInterpolator(EndNormalInterpolator):
    """The operands N·L and 1 - N·H, from ``cos gamma(t) = cos beta cos(lambda - t psi)``.

    gamma is the angle between the normal and a fixed vector, L or H. beta is the angle of this vector to the
    plane of the great circle. lambda is the angle from ``N_l`` to its projection on this plane.

    Formats and error bounds are those of `AngularSetup` and `HighlightCosine`, whose result is ``1 - cos
    gamma``. N·L is 1 minus the result for L, in ``SQ(2, 25)``. Spans over 150 degrees are flagged.

    Parameters
    ----------
    setup : AngularSetup
        Bit-accurate model of the unit that computes the angles.

    Source: docs/theory/interpolation.md#angular-method; [T] 3.1, 3.2.
    """

    setup: AngularSetup = field(default_factory=AngularSetup)

    operand: ClassVar = "one_minus_cosine"
    COSINE_FORMAT = SQ(2, 25)
    COSINE_OF_ZERO = 1.0
    MAX_ANGLE = AngularSetup.MAX_ANGLE
    CURVE = "slerp"
    ORIGIN = "documents"

    @property
    def name(self) -> str:
        """Name on the command line and in tables."""
        return (
            "angular"
            if self.serves_gate
            else f"angular-{self.setup.arccos.table}".replace("as_published", "published")
        )

    @property
    def serves_gate(self) -> bool:
        """Whether the method serves a highlight gate. With an arccosine it serves none."""
        return self.setup.angle == "half_chord"

    @property
    def highlight_excess(self) -> float:
        """Errors of setup and cosine, and of the cosine's dropped bits. The curve is the great circle."""
        angles = np.linspace(1e-4, self.gate_angle, 1000)
        setup = AngularSetup.error(angles).max()
        return float(setup) + HighlightCosine.ERROR + HighlightCosine.RESULT_FORMAT.step

    def operand_error(self, length: int, degrees: float) -> float:
        """Sum of four errors: setup, cosine, the code of length 1 in place of 1, and half a step."""
        return float(AngularSetup.error(np.asarray(degrees))) + HighlightCosine.ERROR + 2.0**-16 + 2.0**-26

    def compute(
        self,
        normal_left: Fixed,
        normal_right: Fixed,
        length: np.ndarray,
        direction: Fixed,
        halfway: Fixed,
    ) -> Operands:
        """Bit-accurate operands of every pixel."""
        pixels = pixels_of(length)

        def complement(vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """1 minus the cosine of a vector and the normal, at every pixel; and the flags."""
            every = Fixed(COMPONENT, np.broadcast_to(vector, normal_left.codes.shape))
            _, phase, step, cos_beta, out_of_range = self.setup.compute(
                normal_left, normal_right, every, length
            )
            return HighlightCosine().compute(phase, step, cos_beta, *pixels).codes, out_of_range

        one = Fixed(UQ(1, 25), 1 << 25)
        results = [[complement(vector) for vector in vectors.codes] for vectors in (direction, halfway)]
        cosine, highlight = (
            Fixed(HighlightCosine.RESULT_FORMAT, np.stack([codes for codes, _ in light], axis=-1))
            for light in results
        )
        return Operands(one - cosine, highlight, results[0][0][1])


METHODS = {AngularInterpolator(): "equal angles on the great circle, from sines"}
"""The method of this module, and a line about it."""

PUBLISHED = {
    AngularInterpolator(AngularSetup("arccos", Arccos("as_published"))): "as the thesis prints it",
    AngularInterpolator(AngularSetup("arccos", Arccos("corrected"))): "as printed, the arccosine corrected",
}
"""The method with the arccosine of table 3.1: as printed, and with the misprint corrected."""
