"""Serialiser: words of several lanes, two bits of each a cycle."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.video.tmds_encoder import BITS, bits_of

__all__ = ["LANES", "Serialiser"]

LANES = 4
"""Lanes of a display: blue, green, red and the clock."""


@dataclass(frozen=True)
class Serialiser:
    """Ten bits as five pairs, bit 0 first: of a pair bit 0 is sent first. Exact.

    An output cell sends both bits of a pair within one cycle of the serial clock (double data rate), so that
    this is five times the pixel clock.

    Parameters
    ----------
    lanes : int
        Words at a time.

    Source: docs/theory/video.md#tmds.
    """

    lanes: int = LANES

    PAIRS = BITS // 2

    def compute(self, words: np.ndarray) -> np.ndarray:
        """Pairs of words.

        Parameters
        ----------
        words : int64 array, shape (n, lanes)
            Ten bits each.

        Returns
        -------
        int64 array, shape (5 n, lanes)
        """
        shifts = 2 * np.arange(self.PAIRS)[:, np.newaxis]
        return (np.asarray(words)[:, np.newaxis] >> shifts & 3).reshape(-1, self.lanes)

    def bits(self, pairs: np.ndarray) -> np.ndarray:
        """Bits of pairs in the order in which they are sent, shape (2 n, lanes)."""
        return bits_of(pairs, 2).swapaxes(-1, -2).reshape(-1, self.lanes)
