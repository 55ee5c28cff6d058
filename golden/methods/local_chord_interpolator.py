"""The chord method for point lights and a near viewer: three values of N·L and of the chord a span."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.methods.interpolator import Interpolator, Operands
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import ONE_SQUARED

__all__ = ["METHODS", "LocalChordInterpolator", "SpanValues"]


class SpanValues(NamedTuple):
    """Values of each light that a span carries: at its first pixel centre, its middle and its last.

    Parameters
    ----------
    diffuse, highlight : int64 arrays, shape (spans, lights, 3)
        Codes of N·L and of ``u = |N - H|^2 / 2`` in the formats of `LocalChordSetup`, in units of
        `ONE_SQUARED`, as in all units.
    """

    diffuse: np.ndarray
    highlight: np.ndarray

    @classmethod
    def quantise(cls, diffuse: np.ndarray, highlight: np.ndarray) -> "SpanValues":
        """Nearest codes of exact values.

        Parameters
        ----------
        diffuse, highlight : float64 arrays, shape (spans, lights, 3)
            N·L, -1 to 1, and u, 0 to 2.

        Raises
        ------
        ValueError
            If a value is out of range.
        """
        one = float(ONE_SQUARED.values)
        return cls(
            Fixed.round(LocalChordSetup.DIFFUSE_FORMAT, np.multiply(diffuse, one)).codes,
            Fixed.round(LocalChordSetup.HIGHLIGHT_FORMAT, np.multiply(highlight, one)).codes,
        )


@dataclass(frozen=True)
class LocalChordInterpolator(Interpolator):
    """``N . L`` and ``u = |N - H|^2 / 2`` of each pixel by two additions each, L and H of the pixel's own.

    A span carries three values of each, computed where positions are known. `LocalChordSetup` takes the
    quadratics through them; the sums and the formats of the pixels are those of `ChordInterpolator`.

    The quadratic is good for short spans only. Spans should be cut until

    - N, V and each light's L change by at most `MAX_VECTOR_ANGLE` degrees from end to end, and ``|dV| +
      |dL|`` is at most `MAX_HALFWAY_CHANGE` of ``|L + V|``: where L is nearly -V, H changes fast;
    - the quadratics are as near to the values at t = 1/4 and 3/4 as `highlight_tolerance` and
      `diffuse_tolerance` allow, less the bounds of the arithmetic; an error there counts `MARGIN` times, for
      the positions between. That factor is found by search: the largest distance at any t was 1.31 times that
      at 1/4 and 3/4.

    Fit and arithmetic then are within 0.4 LSB of exactly normalised interpolation in the specular term and
    0.12 in the diffuse one, at full reflection.

    Where N·L changes its sign the highlight ends, however bright it is. A pixel whose N·L is within the error
    of 0 may have it or not; a span with such pixels, where `is_lit`, should be cut further.

    Source: docs/theory/chord.md#local-lights.
    """

    operand: ClassVar = "one_minus_cosine"
    COSINE_FORMAT = ChordInterpolator.COSINE_FORMAT
    CURVE = "quadratic"
    TAKES_VALUES = True
    HIGHLIGHT_BUDGET: ClassVar[float] = 0.4
    DIFFUSE_BUDGET: ClassVar[float] = 0.12
    MAX_VECTOR_ANGLE: ClassVar[float] = 30.0
    MAX_HALFWAY_CHANGE: ClassVar[float] = 0.5
    MARGIN: ClassVar[float] = 4 / 3

    def compute(self, normal_left, normal_right, length, direction, halfway):
        """Refused: the normals of a span do not give its position."""
        raise ValueError("the local chord method takes values of its spans, not normals; see compute_values")

    def compute_values(self, values: SpanValues, length: np.ndarray) -> Operands:
        """Bit-accurate operands of every pixel, in the order of the spans.

        Parameters
        ----------
        values : SpanValues
            Of each span and light.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.

        Raises
        ------
        ValueError
            If a code or a length is out of range.
        """
        diffuse, highlight, out_of_range = LocalChordSetup().compute(
            Fixed(LocalChordSetup.DIFFUSE_FORMAT, values.diffuse),
            Fixed(LocalChordSetup.HIGHLIGHT_FORMAT, values.highlight),
            length,
        )
        pixels, accumulators = pixels_of(length), ChordInterpolator().accumulators
        return Operands(
            accumulators["diffuse"].compute(*diffuse, *pixels),
            accumulators["highlight"].compute(*highlight, *pixels),
            out_of_range,
        )

    def exact_operands(self, values: SpanValues, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The quadratics through the values in float64, in units of 1.

        Parameters
        ----------
        values : SpanValues
            Of each span and light.
        length : int array, shape (spans,)
            Pixels.

        Returns
        -------
        cosine, one_minus_cosine : float64 arrays, shape (pixels, lights)
        """
        span, step = pixels_of(length)
        t = (step / np.maximum(length - 1, 1)[span])[:, np.newaxis]
        formats = LocalChordSetup.DIFFUSE_FORMAT, LocalChordSetup.HIGHLIGHT_FORMAT
        results = []
        for codes, format in zip(values, formats, strict=True):
            left, middle, right = np.moveaxis(codes * (format.step / float(ONE_SQUARED.values)), 2, 0)
            square = 2 * (left + right - 2 * middle)
            slope = right - left - square
            results.append(left[span] + t * (slope[span] + t * square[span]))
        return tuple(results)

    def highlight_tolerance(self, exponent: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Largest error of u that keeps `HIGHLIGHT_BUDGET`, where no smaller u occurs.

        The derivative of a term to u is about n at the peak, and smaller farther off: ``n (1 - n u/2)`` of
        the cosine-quadratic one, ``n (1 - u)^(n-1)`` of Blinn's power. With ``x = (n - 1) u`` neither is more
        than ``n / (1 + x/2 + x^2/4 + x^3/8)``, and those of the pipeline's other models not more than 1.25 of
        it, for n = 1 1.6.

        Parameters
        ----------
        exponent : int array
            n, 1 to 1000.
        u : array
            Least value of u, at least 0.
        """
        x = (np.asarray(exponent) - 1) * u / 2
        return self.HIGHLIGHT_BUDGET / (255 * np.asarray(exponent)) * (1 + x * (1 + x * (1 + x)))

    @staticmethod
    def is_lit(exponent: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Whether a highlight may be over a quarter of an LSB, where no smaller u occurs.

        Blinn's power, at most ``e^-x`` with ``x = (n - 1) u``, is not from ``x = 7`` on; the others reach 0
        earlier, or decrease as fast.

        Parameters
        ----------
        exponent : int array
            n, 1 to 1000.
        u : array
            Least value of u, at least 0.
        """
        return (np.asarray(exponent) - 1) * u < 7

    @property
    def name(self):
        """Name on the command line and in tables."""
        return "chord-local"

    @property
    def serves_gate(self):
        """No: spans carry no normals."""
        return False

    @property
    def diffuse_tolerance(self) -> float:
        """Largest error of N·L that keeps `DIFFUSE_BUDGET`."""
        return self.DIFFUSE_BUDGET / 255

    def operand_error(self, length, degrees):
        """That of the setup, for slopes up to 1/2 and squares up to 1/8, and the cut of the results."""
        errors = (f(0.5, 0.125) for f in (LocalChordSetup.highlight_error, LocalChordSetup.diffuse_error))
        return float(max(errors)) + Specular.ARGUMENT_FORMAT.step


METHODS = (LocalChordInterpolator(),)
"""Its method."""
