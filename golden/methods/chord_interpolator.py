"""The chord method: forward differences of N·L and of half the squared chord from N to H."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from blysk.golden.cosines.chord_setup import ChordSetup, largest_span_angle
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.interpolator import Interpolator, Operands
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.fixed import SQ
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR

__all__ = ["METHODS", "ChordInterpolator"]


@dataclass(frozen=True)
class ChordInterpolator(Interpolator):
    """``N . L`` and ``u = |N - H|^2 / 2`` of each pixel by two additions each, without a normal.

    `ChordSetup` fits both through their exact values at t = 0, 1/2 and 1; sums of 49 bits follow, with the
    drift that is bounded there. The specular unit takes u as its ``1 - cos gamma``.

    Spans should be at most `largest_span_angle` of the exponent, where the fit is within a quarter of an LSB
    of exactly normalised interpolation; they are flagged over 22.5 degrees.

    ========== ========== ========================================
    word       format     why
    ========== ========== ========================================
    sums       SQ(3, 46)  hold u up to 2
    N·L        SQ(2, 25)  cut
    u          UQ(1, 25)  cut, saturates
    ========== ========== ========================================

    Parameters
    ----------
    terms, fraction_bits : int
        Of the setup.

    Raises
    ------
    ValueError
        If one is out of range.

    Source: docs/theory/chord.md#differences.
    """

    terms: int = 3
    fraction_bits: int = 46

    operand: ClassVar = "one_minus_cosine"
    COSINE_FORMAT = SQ(2, 25)
    CURVE = "quadratic"

    def __post_init__(self):
        _ = self.setup

    @property
    def name(self):
        """Name on the command line and in tables."""
        return "chord"

    @cached_property
    def setup(self) -> ChordSetup:
        """Model of the setup."""
        return ChordSetup(self.terms, self.fraction_bits)

    @property
    def MAX_ANGLE(self) -> float:
        """Largest angle in degrees of a span that is not flagged."""
        return self.setup.max_angle

    @property
    def accumulators(self) -> dict[str, DifferenceAccumulator]:
        """Models of the accumulators, ``diffuse`` of N·L and ``highlight`` of u."""
        format, difference = SQ(3, self.fraction_bits), self.setup.format
        starts = {"diffuse": ChordSetup.COSINE_FORMAT, "highlight": ChordSetup.CHORD_FORMAT}
        results = {"diffuse": self.COSINE_FORMAT, "highlight": Specular.ARGUMENT_FORMAT}
        return {
            name: DifferenceAccumulator(start, format, difference, results[name])
            for name, start in starts.items()
        }

    def widest_span(self, exponent):
        """Largest angle of a span, in degrees, for which the fit is good."""
        return largest_span_angle(exponent)

    @property
    def highlight_excess(self):
        """Error of u at the largest angle and any ends, its cut, and the lengths of N and H as codes.

        The quadratic through the exact values is ``1 - N·H`` of the quadratic curve of normals.
        """
        error = self.setup.highlight_error(self.gate_angle, np.array(2.0))
        return float(error) + 2 * CODE_LENGTH_ERROR + Specular.ARGUMENT_FORMAT.step

    def operand_error(self, length, degrees):
        """That of the setup, and the cut of the results."""
        errors = self.setup.highlight_error(degrees), self.setup.diffuse_error(degrees)
        return float(max(errors)) + Specular.ARGUMENT_FORMAT.step

    def compute(self, normal_left, normal_right, length, direction, halfway):
        """Bit-accurate operands."""
        diffuse, highlight, out_of_range = self.setup.compute(
            normal_left, normal_right, direction, halfway, length
        )
        pixels = pixels_of(length)
        return Operands(
            self.accumulators["diffuse"].compute(*diffuse, *pixels),
            self.accumulators["highlight"].compute(*highlight, *pixels),
            out_of_range,
        )


METHODS = (ChordInterpolator(),)
"""Its method."""
