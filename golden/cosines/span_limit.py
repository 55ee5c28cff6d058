"""Span limit: which spans are wider than the chord method's error bound allows at a specular exponent."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.chord_setup import ChordSetup, SpanValues, largest_span_angle
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["SpanLimit"]


@dataclass(frozen=True)
class SpanLimit:
    """Whether a span of four pixels or more is *wide*: the error of its quadratics may be too large.

    With psi for the angle between the normals at its ends, a span is wide where

    - psi is over `WIDEST`, with any light; or
    - psi is over `angle` of the exponent, and a light that is not behind the span may have a highlight on it:
      ``2 min(u_l, u_r) - max(u_l + u_r - 2 u_m, 0)``, twice the least u of the quadratic or less, is under
      twice `lit` of the exponent.

    The limit by the exponent holds for normals of *equal length* at the ends: no length comes with a span.
    For lengths in the ratio g the error may be about ``12 n (g - 1) psi^2`` LSB more, and the span is not
    wide. Software cuts by the error itself; geometry in hardware does not, and `missed_pieces` counts.

    Both limits have one value for all exponents from ``2^k`` to ``2^(k+1) - 1``, the safer of those at the
    two ends, so that a small table holds them. A light is behind if N·L is under `BEHIND` at all three
    places. psi is compared as half the squared chord of the two normals, with `SLACK` steps for their
    rounding: a span that is cut at the limit and then quantised is not wide. This takes three products a
    span.

    Source: docs/theory/chord.md#where-spans-are-cut.
    """

    SHORTEST = 4
    WIDEST = 30.0
    BEHIND = Fixed(ChordSetup.DIFFUSE_FORMAT, -(1 << ChordSetup.DIFFUSE_FORMAT.fraction_bits - 4))
    SLACK = 4
    EXPONENT_BITS = 10
    LEVEL_FORMAT = SQ(4, ChordSetup.HIGHLIGHT_FORMAT.fraction_bits)

    @staticmethod
    def angle(exponent: int) -> float:
        """Widest lit span in degrees: `largest_span_angle` of the largest exponent of the octave.

        Parameters
        ----------
        exponent : int
            n, 1 to 1000.
        """
        return largest_span_angle(min((1 << int(exponent).bit_length()) - 1, MAX_EXPONENT))

    @staticmethod
    def lit(exponent: int) -> float:
        """Least u from which a highlight is under 1/4 LSB: ``7 / (n - 1)`` with the least n of the octave.

        Parameters
        ----------
        exponent : int
            n, 1 to 1000.
        """
        least = 1 << int(exponent).bit_length() - 1
        return min(7 / (least - 1), 2.0) if least > 1 else 2.0

    @staticmethod
    def _chord(degrees: float) -> Fixed:
        exact = 1 - np.cos(np.radians(degrees)) + SpanLimit.SLACK * COMPONENT.step
        return Fixed.round(Chord.FORMAT, exact)

    @property
    def widest(self) -> Fixed:
        """Half the squared chord of `WIDEST`, UQ(2, 35)."""
        return self._chord(self.WIDEST)

    @cached_property
    def chords(self) -> Fixed:
        """Half the squared chord of `angle` by the number of bits of the exponent, 0 (unused) to 10."""
        angles = [self.angle((1 << bits) - 1 or 1) for bits in range(self.EXPONENT_BITS + 1)]
        return self._chord(np.array(angles))

    @cached_property
    def levels(self) -> Fixed:
        """Twice `lit` by the number of bits of the exponent, 0 (unused) to 10; SQ(4, 26)."""
        levels = [2 * self.lit((1 << bits) - 1 or 1) for bits in range(self.EXPONENT_BITS + 1)]
        return Fixed.round(self.LEVEL_FORMAT, np.array(levels))

    def compute(
        self,
        normal_left: Fixed,
        normal_right: Fixed,
        values: SpanValues,
        length: np.ndarray,
        exponent: np.ndarray,
        highlights: bool = True,
        threshold: Fixed | None = None,
    ) -> np.ndarray:
        """Whether spans are wide; bool, shape (spans,).

        Parameters
        ----------
        normal_left, normal_right : Fixed, shape (spans, 3), SQ(1, 17)
            Unit normals of the ends.
        values : SpanValues
            Values of the spans and lights.
        length : int array, shape (spans,)
            Pixels.
        exponent : int array, shape (spans,)
            Specular exponent, 1 to 1000.
        highlights : bool
            Whether there is specular light.
        threshold : Fixed, shape (spans,), UQ(3, 15), optional
            Threshold in place of twice `lit` of the exponent: `ValueGate.thresholds_of` a lobe's table.

        Raises
        ------
        ValueError
            If an operand has another format or an exponent is out of range.
        """
        wide, wide_if_lit = self.exceeds(normal_left, normal_right, exponent)
        if highlights:
            levels = self.levels[self._bits(exponent)]
            if threshold is not None:
                levels = threshold.extend(self.LEVEL_FORMAT)
            level = self.least(values.highlight) < levels.codes[:, np.newaxis]
            front = values.diffuse.max(axis=2) >= self.BEHIND.codes
            wide = wide | (wide_if_lit & (level & front).any(axis=1))
        return wide & (np.asarray(length) >= self.SHORTEST)

    def exceeds(
        self, normal_left: Fixed, normal_right: Fixed, exponent: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Whether psi is over `WIDEST`, and whether over `angle` of the exponent; bool, shape (spans,) each.

        Parameters and errors are those of `compute`.
        """
        bits = self._bits(exponent)
        chord = Chord().compute(normal_right, normal_left).codes
        return chord > self.widest.codes, chord > self.chords.codes[bits]

    @staticmethod
    def _bits(exponent: np.ndarray) -> np.ndarray:
        """Number of bits of exponents."""
        exponent = np.asarray(exponent)
        if exponent.size and not 1 <= exponent.min() <= exponent.max() <= MAX_EXPONENT:
            raise ValueError(f"exponents must be 1 to {MAX_EXPONENT}")
        return np.frexp(exponent.astype(np.float64))[1]

    @staticmethod
    def least(highlight: np.ndarray) -> np.ndarray:
        """``2 min(u_l, u_r) - max(u_l + u_r - 2 u_m, 0)``, from the three values along the last axis."""
        left, middle, right = np.moveaxis(highlight, -1, 0)
        return 2 * np.minimum(left, right) - np.maximum(left + right - 2 * middle, 0)
