"""Coarse depth test, which drops spans that are hidden for their whole length, by a bound of each block's
depths.
"""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.depth_tester import DepthTester
from blysk.golden.geometry.span_attributes import SPAN_DEPTH
from blysk.golden.geometry.triangles import DEPTH
from blysk.golden.number.spans import pixels_of

__all__ = ["BLOCKS", "CoarseDepth"]

BLOCKS = (4, 8, 16)
"""Pixels of a scanline that may share a bound."""


@dataclass(frozen=True)
class CoarseDepth:
    """Bounds of the depths in blocks of pixels. A span behind the bounds of all its blocks is hidden.

    A block has a bound b, a candidate c and a mask. No depth that `DepthTester` has stored in the block is
    deeper than b. Depth is linear. So the depths of a span's pixels in the block lie between the depths of
    the first and the last of these pixels: ``lo``, the smaller depth, and ``hi``, the larger depth.

    - If ``lo > b``, these pixels are hidden.
    - If ``hi < b``, these pixels are marked in the mask, and c becomes the larger of c and ``hi``. When all
      pixels of the block are marked, c is the new b and the mask is empty.

    Depths are compared by their upper bits: of two depths with different upper bits the larger is deeper. So
    the test may keep a hidden span, but it never drops a visible span. A part of a span behind the bound of
    its block leaves the block's word as it is. So a dropped span leaves no trace.

    A word also has a tag, the number of the picture in which it was written, modulo ``2^tag_bits``. A word
    with the tag of another picture counts as cleared. With each picture `swept` words are cleared, beginning
    with the words that were cleared longest ago. So every word is cleared before its tag is used again.

    Spans go on to shading and to `DepthTester` in the order in which they came. So the depths under a bound
    are stored before the depths of a later span are tested. Pictures with and without this test are equal.

    Parameters
    ----------
    width, height : int
        Size of the largest picture, 1 to 4096. A span that leaves this picture counts as visible, and changes
        no bound.
    block : int
        Pixels of a block, one of `BLOCKS`. Pixels of the last block outside the picture count as marked.
    depth_bits : int
        Upper bits of a depth that are kept, 8 to 24.
    tag_bits : int
        Bits of a tag, 2 to 8.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Source: docs/theory/geometry.md#depth; not in the documents.
    """

    width: int
    height: int
    block: int = 8
    depth_bits: int = 12
    tag_bits: int = 4

    def __post_init__(self) -> None:
        if not (1 <= self.width <= 4096 and 1 <= self.height <= 4096):
            raise ValueError(f"width and height must be 1 to 4096, not {self.width} and {self.height}")
        if self.block not in BLOCKS:
            raise ValueError(f"block must be one of {', '.join(map(str, BLOCKS))}, not {self.block}")
        if not 8 <= self.depth_bits <= DEPTH.width:
            raise ValueError(f"depth_bits must be 8 to {DEPTH.width}, not {self.depth_bits}")
        if not 2 <= self.tag_bits <= 8:
            raise ValueError(f"tag_bits must be 2 to 8, not {self.tag_bits}")

    @property
    def blocks_per_line(self) -> int:
        """Blocks of a scanline."""
        return -(-self.width // self.block)

    @property
    def blocks(self) -> int:
        """Words of the memory: the blocks of the largest picture."""
        return self.blocks_per_line * self.height

    @property
    def deepest(self) -> int:
        """Bound of a cleared block, behind every depth."""
        return (1 << self.depth_bits) - 1

    @property
    def word_bits(self) -> int:
        """Bits of a word: bound, candidate, mask and tag; by default 36, as of a block RAM of the ECP5."""
        return 2 * self.depth_bits + self.block + self.tag_bits

    @property
    def swept(self) -> int:
        """Words that are cleared with each picture: ``ceil(blocks / (2^tag_bits - 2))``."""
        return -(-self.blocks // ((1 << self.tag_bits) - 2))

    def compute(
        self,
        x: np.ndarray,
        y: np.ndarray,
        length: np.ndarray,
        depth: np.ndarray,
        depth_step: np.ndarray,
        picture: np.ndarray | int = 0,
    ) -> np.ndarray:
        """Bit-accurate decisions: whether each span is hidden for its whole length.

        Parameters
        ----------
        x, y, length : int64 arrays, shape (S,)
            First pixel and pixels of each span, 1 pixel or more.
        depth : int64 array, shape (S,)
            Depth at the first pixel, UQ(24, 9).
        depth_step : int64 array, shape (S,)
            Step of the depth from a pixel to the next, SQ(25, 9).
        picture : int or int array, shape (S,), optional
            Number of each span's picture. If it differs from the number of the span before, a new picture
            begins, with all bounds cleared.

        Returns
        -------
        bool array, shape (S,)
        """
        given = (x, y, length, depth, depth_step)
        x, y, length, depth, step = (np.asarray(values, dtype=np.int64) for values in given)
        number = np.cumsum(np.diff(np.broadcast_to(picture, x.shape), prepend=0) != 0)
        block, last = x // self.block, (x + length - 1) // self.block
        span, k = pixels_of(last - block + 1)
        start = (block[span] + k) * self.block
        ends = np.stack([np.maximum(x[span], start), np.minimum((x + length)[span], start + self.block) - 1])
        code = (depth[span] + (ends - x[span]) * step[span]) >> SPAN_DEPTH.fraction_bits
        upper = np.clip(code, 0, DepthTester.FARTHEST) >> (DEPTH.width - self.depth_bits)
        end = np.where(ends[1] == self.width - 1, self.block - 1, ends[1] - start)
        mask = (np.int64(2) << end) - (np.int64(1) << (ends[0] - start))
        place = (number * self.blocks + y * self.blocks_per_line + block)[span] + k
        outside = ((x + length > self.width) | (y >= self.height))[span]
        lo, hi = np.where(outside, 0, upper.min(axis=0)), np.where(outside, self.deepest, upper.max(axis=0))
        behind = self._behind(place, lo, hi, mask)
        first = np.cumsum(last - block + 1) - (last - block + 1)
        return np.logical_and.reduceat(behind, first) if len(first) else np.zeros(0, dtype=bool)

    def _behind(self, place: np.ndarray, lo: np.ndarray, hi: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Whether each part of a span is behind the bound of its block, in the order of the spans."""
        order = np.argsort(place, kind="stable")
        _, block, count = np.unique(place[order], return_inverse=True, return_counts=True)
        rank = np.arange(len(order)) - np.repeat(np.cumsum(count) - count, count)
        bound = np.full(len(count), self.deepest)
        candidate, marked = np.zeros_like(bound), np.zeros_like(bound)
        full = (1 << self.block) - 1
        behind = np.zeros(len(order), dtype=bool)
        by_rank = np.argsort(rank, kind="stable")
        # Turn r takes part number r of every block, so no block occurs twice in a turn.
        for part in np.split(by_rank, np.cumsum(np.bincount(rank))[:-1] if len(rank) else []):
            at, what = block[part], order[part]
            behind[what] = lo[what] > bound[at]
            nearer = hi[what] < bound[at]
            at, what = at[nearer], what[nearer]
            # A mask without marks has candidate 0.
            candidate[at] = np.maximum(candidate[at], hi[what])
            marked[at] |= mask[what]
            done = at[marked[at] == full]
            bound[done] = candidate[done]
            candidate[done] = marked[done] = 0
        return behind
