"""The chord method: scalar forward differences of N·L and of the squared chord from N to H (chord.md)."""

from dataclasses import dataclass
from typing import ClassVar

from .chord_setup import ChordSetup, largest_span_angle
from .difference_accumulator import DifferenceAccumulator
from .fixed import SQ
from .interpolator import Interpolator, Operands, pixels_of
from .specular import Specular

__all__ = ["ChordInterpolator"]


@dataclass(frozen=True)
class ChordInterpolator(Interpolator):
    """``N . L`` and ``u = |N - H|^2 / 2`` of each pixel by two additions each, without a normal.

    `golden.chord_setup.ChordSetup` fits both through their exact values at t = 0, 1/2 and 1; sums in 49 bits
    follow, whose drift is bounded there. The specular unit takes u as its ``1 - cos gamma``.

    Spans should be no wider than `golden.chord_setup.largest_span_angle` of the exponent, where the fit is
    within a quarter of an LSB of exactly normalised interpolation; they are flagged over 22.5 degrees.

    ========== ========== ========================================
    word       format     why
    ========== ========== ========================================
    sums       SQ(3, 46)  hold u up to 2
    N·L        SQ(2, 25)  cut
    u          UQ(1, 25)  cut, saturates
    ========== ========== ========================================

    Source: chord.md.
    """

    operand: ClassVar = "one_minus_cosine"
    COSINE_FORMAT = SQ(2, 25)
    MAX_ANGLE = ChordSetup.MAX_ANGLE
    CURVE = "quadratic"

    DIFFUSE = DifferenceAccumulator(ChordSetup.COSINE_FORMAT, SQ(3, 46), ChordSetup.FORMAT, SQ(2, 25))
    HIGHLIGHT = DifferenceAccumulator(
        ChordSetup.CHORD_FORMAT, SQ(3, 46), ChordSetup.FORMAT, Specular.ARGUMENT_FORMAT
    )

    def widest_span(self, exponent):
        """Widest span, in degrees, that the fit shades well."""
        return largest_span_angle(exponent)

    def largest_bend(self, exponent):
        """What costs 0.15 LSB: the cosine-quadratic model changes by ``0.77 sqrt(n)`` a radian at most."""
        return 0.15 / (255 * 0.77 * exponent**0.5)

    def compute(self, normal_left, normal_right, length, direction, halfway):
        """Bit-true operands."""
        diffuse, highlight, wide = ChordSetup().compute(normal_left, normal_right, direction, halfway, length)
        place = pixels_of(length)
        return Operands(
            self.DIFFUSE.compute(*diffuse, *place), self.HIGHLIGHT.compute(*highlight, *place), wide
        )
