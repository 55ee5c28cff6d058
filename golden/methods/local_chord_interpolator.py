"""The chord method for point lights and a near viewer: three values of N·L and of the chord a span."""

from dataclasses import dataclass

from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.chord_interpolator import ChordInterpolator

__all__ = ["METHODS", "LocalChordInterpolator"]


@dataclass(frozen=True)
class LocalChordInterpolator(ChordInterpolator):
    """``N . L`` and ``u = |N - H|^2 / 2`` of each pixel by two additions each, with L and H of the pixel.

    A span carries three values of N·L and three of u, computed where positions are known; everything else is
    as in `ChordInterpolator`.

    A light that fades, by its distance or as a spot, has a factor a. Its values of N·L are multiplied by a
    before, ``a N·L``; its specular term is multiplied by a at each pixel (`Factor`), where a is a third
    quadratic of the light, in the formats of N·L. Spans are cut until three conditions hold at every pixel
    that such a light reaches: the error of ``a N·L`` is within `DIFFUSE_BUDGET`; where the highlight shows,
    the error of a is within `FACTOR_BUDGET`; and the errors of a, and of u times the largest a of the span,
    are together within `HIGHLIGHT_BUDGET`. A light that fades may be brighter than white: all errors are
    multiplied by the largest channel of its colour, if that is over 1.

    Parameters
    ----------
    fraction_bits : int
        As for `ChordInterpolator`.

    Source: docs/theory/chord.md#local-lights.
    """

    TAKES_VALUES = True
    TAKES_MIDDLE = False

    @property
    def name(self):
        """Name on the command line and in tables."""
        return "chord-local"

    def compute(self, normal_left, normal_right, length, direction, halfway, normal_middle=None):
        """Raise `ValueError`: the normals of a span do not give its position."""
        raise ValueError("the local chord method takes values of its spans, not normals; see compute_values")

    def operand_error(self, length, degrees):
        """Error of the setup, for slopes up to 1/2 and squares up to 1/8, plus the cut of the results."""
        errors = (f(0.5, 0.125) for f in (self.setup.highlight_error, self.setup.diffuse_error))
        return float(max(errors)) + Specular.ARGUMENT_FORMAT.step


METHODS = {LocalChordInterpolator(): "the same for point lights and a near viewer"}
"""The method of this module, and a line about it."""
