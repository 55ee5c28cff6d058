"""Serialiser: words of several lanes, two bits of each a cycle."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.video.tmds_encoder import BITS, bits_of

__all__ = ["LANES", "Serialiser"]

LANES = 4
"""Lanes of a display: blue, green, red and the clock."""


@dataclass(frozen=True)
class Serialiser:
    """Words of ten bits as five pairs each, from bit 0 on. Bit 0 of a pair is sent first.

    An output cell sends both bits of a pair within one cycle of the serial clock (double data rate). So the
    serial clock is five times the pixel clock.

    Parameters
    ----------
    lanes : int
        Number of lanes.

    Source: docs/theory/video.md#tmds.
    """

    lanes: int = LANES

    PAIRS = BITS // 2

    def compute(self, words: np.ndarray) -> np.ndarray:
        """Pairs of words.

        Parameters
        ----------
        words : int64 array, shape (n, lanes)
            Words of ten bits.

        Returns
        -------
        int64 array, shape (5 n, lanes)
        """
        shifts = 2 * np.arange(self.PAIRS)[:, np.newaxis]
        return (np.asarray(words)[:, np.newaxis] >> shifts & 3).reshape(-1, self.lanes)

    def bits(self, pairs: np.ndarray) -> np.ndarray:
        """Bits of pairs in the order of sending, shape (2 n, lanes)."""
        return bits_of(pairs, 2).swapaxes(-1, -2).reshape(-1, self.lanes)
