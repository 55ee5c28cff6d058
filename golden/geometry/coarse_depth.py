"""Coarse depth test: spans that are hidden for their whole length, by a bound of the depths of each block."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.depth_test import DepthTest
from blysk.golden.geometry.span_attributes import SPAN_DEPTH
from blysk.golden.geometry.triangles import DEPTH
from blysk.golden.number.spans import pixels_of

__all__ = ["BLOCKS", "CoarseDepth"]

BLOCKS = (4, 8, 16)
"""Pixels of a scanline that may share a bound."""


@dataclass(frozen=True)
class CoarseDepth:
    """A bound of the depths of each block of pixels of a scanline; a span behind it everywhere is hidden.

    A block has a bound b, a candidate c and a mask. No depth that `DepthTest` has stored in the block is
    deeper than b. A span's pixels in the block lie between ``lo`` and ``hi``, as depth is linear: they are
    hidden if ``lo > b``. If ``hi < b``, they are marked in the mask and c becomes the larger of c and ``hi``;
    once all pixels of the block are marked, c is the new b and the mask is empty. Depths are cut to their
    upper bits, by which a block may be kept that could be dropped, and never the reverse: of two depths
    whose upper bits differ the larger is deeper. A block behind its bound changes nothing, so that a span
    that is dropped leaves no trace.

    A word has a tag, too, the number of the picture in which it was written, modulo ``2^tag_bits``: of
    another picture it counts as cleared. So that no tag comes round again, ``swept`` words are cleared with
    each picture, in turn those that were swept longest ago.

    Spans go on to shading and to `DepthTest` in the order in which they came, so that what is bounded is
    stored before a later span is compared. Pictures with and without this test are the same.

    Parameters
    ----------
    width, height : int
        Size of the largest picture, 1 to 4096.
    block : int
        Pixels of a block, one of `BLOCKS`. What of the last block is outside the picture counts as marked.
    depth_bits : int
        Upper bits of a depth that are kept, 8 to 24.
    tag_bits : int
        2 to 8.

    Raises
    ------
    ValueError
        If one is out of range.

    Source: docs/theory/geometry.md#depth; not in the documents.
    """

    width: int
    height: int
    block: int = 8
    depth_bits: int = 12
    tag_bits: int = 4

    def __post_init__(self):
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
        """Words of the memory."""
        return self.blocks_per_line * self.height

    @property
    def word_bits(self) -> int:
        """Bits of a word: bound, candidate, mask and tag; by default 36, as of a block RAM of the ECP5."""
        return 2 * self.depth_bits + self.block + self.tag_bits

    @property
    def swept(self) -> int:
        """Words swept for a picture."""
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
        """Which spans are hidden, bit-accurate.

        Parameters
        ----------
        x, y, length : int64 arrays, shape (S,)
            First pixel and pixels of each span, inside the picture, 1 pixel or more.
        depth : int64 array, shape (S,)
            At the first pixel, UQ(24, 9).
        depth_step : int64 array, shape (S,)
            From a pixel to the next, SQ(25, 9).
        picture : int array, shape (S,), optional
            A picture begins cleared where this is another than that of the span before.

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
        upper = np.clip(code, 0, DepthTest.FARTHEST) >> (DEPTH.width - self.depth_bits)
        end = np.where(ends[1] == self.width - 1, self.block - 1, ends[1] - start)
        mask = (np.int64(2) << end) - (np.int64(1) << (ends[0] - start))
        place = (number * self.blocks + y * self.blocks_per_line + block)[span] + k
        behind = self._behind(place, upper.min(axis=0), upper.max(axis=0), mask)
        first = np.cumsum(last - block + 1) - (last - block + 1)
        return np.logical_and.reduceat(behind, first) if len(first) else np.zeros(0, dtype=bool)

    def _behind(self, place: np.ndarray, lo: np.ndarray, hi: np.ndarray, mask: np.ndarray) -> np.ndarray:
        """Which parts of spans are behind the bounds of their blocks, in the order in which they come."""
        order = np.argsort(place, kind="stable")
        _, block, count = np.unique(place[order], return_inverse=True, return_counts=True)
        rank = np.arange(len(order)) - np.repeat(np.cumsum(count) - count, count)
        bound = np.full(len(count), (1 << self.depth_bits) - 1)
        candidate, marked = np.zeros_like(bound), np.zeros_like(bound)
        full = (1 << self.block) - 1
        behind = np.zeros(len(order), dtype=bool)
        by_rank = np.argsort(rank, kind="stable")
        # A turn for each span that lies over another in a block; the blocks of a turn are different ones.
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
