"""Band depth: a memory for the depths of one band, cleared for the next band by a tag."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.depth_tester import DepthTester

__all__ = ["BandDepth"]


@dataclass(frozen=True)
class BandDepth:
    """A memory of depths. Words from earlier bands count as cleared.

    A word holds a depth and a tag of ``tag_bits`` bits: the number of the band in which it was written,
    modulo ``2^tag_bits``. A word with another tag than the present tag reads as `DepthTester.CLEARED`. An old
    tag must not become the present tag again. So when a band begins, ``swept`` words are written with the tag
    before the present tag, beginning with the words that were swept longest ago. Let t be ``tag_bits``. Two
    sweeps of a word are at most ``2^t - 2`` bands apart. One band later the word's old tag would be the
    present tag.

    Parameters
    ----------
    size : (int, int)
        Width and lines of a band.
    tag_bits : int
        Bits of a tag, 2 to 8.

    Raises
    ------
    ValueError
        If ``tag_bits`` is out of range.

    Source: docs/theory/video.md#bands; not in the documents.
    """

    size: tuple[int, int]
    tag_bits: int = 3

    def __post_init__(self) -> None:
        if self.tag_bits not in range(2, 9):
            raise ValueError(f"tag_bits must be 2 to 8, not {self.tag_bits!r}")

    @property
    def words(self) -> int:
        """Number of words: the pixels of a band."""
        return self.size[0] * self.size[1]

    @property
    def swept(self) -> int:
        """Number of words that are swept when a band begins."""
        return -(-self.words // ((1 << self.tag_bits) - 2))

    def compute(
        self, begins: np.ndarray, writes: np.ndarray, place: np.ndarray, depth: np.ndarray
    ) -> np.ndarray:
        """Depth read at each step: the last depth written at its place since the present band began.

        Parameters
        ----------
        begins : bool array, shape (N,)
            Steps on which a band begins. The other operands of these steps have no effect.
        writes : bool array, shape (N,)
            Steps that write ``depth`` after they have read.
        place, depth : int64 arrays, shape (N,)
            Index of the word, and depth.

        Raises
        ------
        ValueError
            If an index is out of range.
        """
        for wrong in place[(place < 0) | (place >= self.words)][:1]:
            raise ValueError(f"a band has words 0 to {self.words - 1}, not {wrong}")
        band = np.cumsum(begins)
        key = band * self.words + place
        order = np.argsort(key, kind="stable")
        step = np.arange(len(key))
        wrote = np.where((writes & ~begins)[order], step, -1)
        # For each step, the last write before it with the same key.
        last = np.r_[-1, np.maximum.accumulate(wrote)[:-1]] if len(key) else wrote
        same = (last >= 0) & (key[order][np.maximum(last, 0)] == key[order])
        result = np.empty(len(key), dtype=np.int64)
        result[order] = np.where(same, depth[order][np.maximum(last, 0)], DepthTester.CLEARED)
        return result
