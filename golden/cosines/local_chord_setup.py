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

    With point lights or a near viewer, L and H differ at every pixel, and there is no L or H of a frame from
    which `ChordSetup` could find the values. Here they come with the span. For each of the
    two ``v = v_l + P t + G t^2`` with

    ``G = 2 (v_l + v_r - 2 v_m)`` and ``P = v_r - v_l - G``;

    the differences follow as there. Five products a light and one for the span.

    ============ ============ =====================================================================
    word         format       why
    ============ ============ =====================================================================
    u            UQ(1, 26)    given; half a step costs ``1.25 n 255 2^-27``, 0.0024 LSB at n = 1000
    f            SQ(1, 25)    given; what the pixels have, too
    G            SQ(-2, 20)   as in `ChordSetup`; saturates
    P of u       SQ(0, 26)    exact; saturates
    P of f       SQ(0, 18)    multiplier operand; rounded; saturates
    differences  SQ(1, 46)    as in `ChordSetup`
    ============ ============ =====================================================================

    A span that does not fit, ``|G| >= 1/8`` or ``|P| >= 1/2``, is flagged, and its words mean nothing. No sum
    wraps: u_l is in [0, 2), f_l in [-1, 1), and flagged or not a curve leaves them by ``|P| + |G|`` at most,
    5/8; the sums hold -4 to 4.

    Error of u at any pixel against the quadratic through the exact values: `highlight_error`; of f:
    `diffuse_error`.

    Source: chord.md.
    """

    DIFFUSE_FORMAT = SQ(1, 25)
    HIGHLIGHT_FORMAT = UQ(1, 26)
    BEND_FORMAT = ChordSetup.BEND_FORMAT
    SLOPE_FORMAT = SQ(0, 26)
    DIFFUSE_SLOPE_FORMAT = ChordSetup.HIGH_FORMAT

    def compute(
        self, diffuse: Fixed, highlight: Fixed, length: np.ndarray
    ) -> tuple[Differences, Differences, np.ndarray]:
        """Bit-true differences.

        Parameters
        ----------
        diffuse : Fixed, shape (spans, lights, 3), SQ(1, 25)
            f at the first pixel centre, the middle and the last pixel centre.
        highlight : Fixed, shape (spans, lights, 3), UQ(1, 26)
            u there.
        length : int array, shape (spans,)
            Pixels, 1 to 4095.

        Returns
        -------
        diffuse, highlight : Differences
            Of f and of u, in the formats of `ChordSetup`.
        wide : bool array, shape (spans,)
            Whether a word of the span does not fit, and its differences are not to be used.

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
            left, middle, right = (values[..., place] for place in range(3))
            exact = (left + right - middle.scale(1)).scale(1).round_half_up(self.BEND_FORMAT.fraction_bits)
            bend = exact.saturate(self.BEND_FORMAT)
            out_of_range |= (exact != bend).any(axis=1)
            exact = (right - left - bend).round_half_up(slope_format.fraction_bits)
            slope = exact.saturate(slope_format)
            out_of_range |= (exact != slope).any(axis=1)
            slope = slope.extend(ChordSetup.SLOPE_FORMAT)
            results.append(ChordSetup().differences(left.extend(start_format), slope, bend, *steps))
        return *results, out_of_range

    @classmethod
    def highlight_error(cls, slope: np.ndarray, bend: np.ndarray) -> np.ndarray:
        """Largest error of u at any pixel against the quadratic through the exact values, not flagged.

        In units of `ONE_SQUARED`, as u is. The three values are off by half a step, which
        the quadratic magnifies by 1.25 at most. The rounding of G, 2^-21, is felt as ``t (1 - t)`` of it, a
        quarter, as the ends stay. The rest is that of `ChordSetup.walk_error`.

        Parameters
        ----------
        slope, bend : arrays
            Sizes of P and G.
        """
        return 1.25 * cls.HIGHLIGHT_FORMAT.step / 2 + 2.0**-23 + ChordSetup().walk_error(slope, bend)

    @classmethod
    def diffuse_error(cls, slope: np.ndarray, bend: np.ndarray) -> np.ndarray:
        """The same of f; the rounding of P adds 2^-19.

        Parameters
        ----------
        slope, bend : arrays
            Sizes of P and G.
        """
        rounding = 1.25 * cls.DIFFUSE_FORMAT.step / 2 + 2.0**-23 + 2.0**-19
        return rounding + ChordSetup().walk_error(slope, bend)
