"""The chord method for point lights and a near viewer: three values of N·L and of the chord a span."""

from dataclasses import dataclass

from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.chord_interpolator import ChordInterpolator

__all__ = ["METHODS", "LocalChordInterpolator"]


@dataclass(frozen=True)
class LocalChordInterpolator(ChordInterpolator):
    """``N . L`` and ``u = |N - H|^2 / 2`` of each pixel by two additions each, L and H of the pixel's own.

    A span carries three values of each, computed where positions are known; everything else is that of
    `ChordInterpolator`.

    A light that fades, by its distance or as a spot, has a factor a. Its N·L comes with it, ``a N·L``; the
    specular term is multiplied by a itself, a third quadratic of the light with the words of N·L, at each
    pixel (`Factor`). Spans are cut until, at every pixel that such a light reaches, a N·L is within
    `DIFFUSE_BUDGET`; and the errors of a, at most `FACTOR_BUDGET` where the highlight shows, and of u, times
    the largest a of the span, are within `HIGHLIGHT_BUDGET` together. All of them count times the largest
    channel of the light's colour, where that is over 1, as a light that fades may be brighter than white.

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
        """Refused: the normals of a span do not give its position."""
        raise ValueError("the local chord method takes values of its spans, not normals; see compute_values")

    def operand_error(self, length, degrees):
        """That of the setup, for slopes up to 1/2 and squares up to 1/8, and the cut of the results."""
        errors = (f(0.5, 0.125) for f in (self.setup.highlight_error, self.setup.diffuse_error))
        return float(max(errors)) + Specular.ARGUMENT_FORMAT.step


METHODS = (LocalChordInterpolator(),)
"""Its method."""
