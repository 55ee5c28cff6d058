"""Local chord setup: forward differences of N·L and of half the squared chord, from three values a span."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.cosines.chord_setup import ChordSetup, Differences
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.spans import checked_lengths

__all__ = ["LocalChordSetup"]


@dataclass(frozen=True)
class LocalChordSetup:
    """Quadratics through given values of ``f = N·L`` and ``u = |N - H|^2 / 2`` at t = 0, 1/2 and 1.

    With point lights or a near viewer L and H differ at every pixel, so that `ChordSetup`, which has one L
    and one H for a frame, cannot find the values. Here they are given with the span. f and u are each
    ``v = v_l + P t + G t^2`` with

    ``G = 2 (v_l + v_r - 2 v_m)`` and ``P = v_r - v_l - G``;

    their differences are those of `ChordSetup.differences`. Five products a light and one a span.

    ============ ============ =====================================================================
    word         format       why
    ============ ============ =====================================================================
    u            UQ(1, 26)    given; half a step costs ``1.25 n 255 2^-27``, 0.0024 LSB at n = 1000
    f            SQ(1, 25)    given; as many fraction bits as the N·L of a pixel
    G            SQ(-2, 20)   as in `ChordSetup`; saturates
    P of u       SQ(0, 26)    exact; saturates
    P of f       SQ(0, 18)    multiplier operand; rounded; saturates
    differences  SQ(1, 46)    as in `ChordSetup`
    ============ ============ =====================================================================

    A span with ``|G| >= 1/8`` or ``|P| >= 1/2`` is flagged, and its words are invalid. No sum along a span
    wraps: u_l is in [0, 2), f_l in [-1, 1), and the curve of any span, flagged or not, is at most
    ``|P| + |G|``, 5/8, away from its start; the sums hold -4 to 4.

    Error of u at any pixel against the quadratic through the exact values: `highlight_error`; of f:
    `diffuse_error`.

    Source: docs/theory/chord.md#local-lights.
    """

    DIFFUSE_FORMAT = SQ(1, 25)
    HIGHLIGHT_FORMAT = UQ(1, 26)
    CURVATURE_FORMAT = ChordSetup.CURVATURE_FORMAT
    SLOPE_FORMAT = SQ(0, 26)
    DIFFUSE_SLOPE_FORMAT = ChordSetup.HIGH_FORMAT

    def compute(
        self, diffuse: Fixed, highlight: Fixed, length: np.ndarray
    ) -> tuple[Differences, Differences, np.ndarray]:
        """Bit-accurate differences of f and of u.

        Parameters
        ----------
        diffuse : Fixed, shape (spans, lights, 3), SQ(1, 25)
            f at the centre of the first pixel, in the middle, and at the centre of the last pixel.
        highlight : Fixed, shape (spans, lights, 3), UQ(1, 26)
            u at the same three points.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.

        Returns
        -------
        diffuse, highlight : Differences
            Of f and of u, in the formats of `ChordSetup`.
        out_of_range : bool array, shape (spans,)
            Whether P or G of the span does not fit its word; the differences are then invalid.

        Raises
        ------
        ValueError
            If an operand has another format or a length is out of range.
        """
        length = checked_lengths(length)
        if (diffuse.format, highlight.format) != (self.DIFFUSE_FORMAT, self.HIGHLIGHT_FORMAT):
            raise ValueError(
                f"operands must be {self.DIFFUSE_FORMAT} and {self.HIGHLIGHT_FORMAT}, "
                f"not {diffuse.format}, {highlight.format}"
            )
        steps = ChordSetup.steps(length)
        out_of_range = np.zeros(len(length), dtype=bool)
        results = []
        for values, start_format, slope_format in (
            (diffuse, ChordSetup.COSINE_FORMAT, self.DIFFUSE_SLOPE_FORMAT),
            (highlight, ChordSetup.CHORD_FORMAT, self.SLOPE_FORMAT),
        ):
            left, middle, right = (values[..., k] for k in range(3))
            exact = (left + right - middle.scale(1)).scale(1)
            exact = exact.round_half_up(self.CURVATURE_FORMAT.fraction_bits)
            curvature = exact.saturate(self.CURVATURE_FORMAT)
            out_of_range |= (exact != curvature).any(axis=1)
            exact = (right - left - curvature).round_half_up(slope_format.fraction_bits)
            slope = exact.saturate(slope_format)
            out_of_range |= (exact != slope).any(axis=1)
            slope = slope.extend(ChordSetup.SLOPE_FORMAT)
            results.append(ChordSetup().differences(left.extend(start_format), slope, curvature, *steps))
        return *results, out_of_range

    @classmethod
    def highlight_error(cls, slope: np.ndarray, curvature: np.ndarray) -> np.ndarray:
        """Largest error of u at any pixel of a span that is not flagged, against the exact quadratic.

        In units of `ONE_SQUARED`, as u is. The three values are off by half a step, which the quadratic
        multiplies by at most 1.25. The rounding of G, 2^-21, does not move the ends and counts as
        ``t (1 - t)``, at most a quarter of it. The rest is `ChordSetup.walk_error`.

        Parameters
        ----------
        slope, curvature : arrays
            Absolute values of P and G.
        """
        return 1.25 * cls.HIGHLIGHT_FORMAT.step / 2 + 2.0**-23 + ChordSetup().walk_error(slope, curvature)

    @classmethod
    def diffuse_error(cls, slope: np.ndarray, curvature: np.ndarray) -> np.ndarray:
        """Largest error of f, as `highlight_error` of u; the rounding of P adds 2^-19.

        Parameters
        ----------
        slope, curvature : arrays
            Absolute values of P and G.
        """
        rounding = 1.25 * cls.DIFFUSE_FORMAT.step / 2 + 2.0**-23 + 2.0**-19
        return rounding + ChordSetup().walk_error(slope, curvature)
