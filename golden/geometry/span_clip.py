"""Span clip ([T] figure 4.10, screen coordinates): scanlines of triangles cut to the picture."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.geometry.edge_walk import Rows
from blysk.golden.geometry.triangles import FrameSettings

__all__ = ["ClippedRows", "SpanClip"]


@dataclass(frozen=True)
class ClippedRows:
    """Scanlines of triangles, cut to the picture.

    Parameters
    ----------
    x, y : int64 arrays, shape (R,)
        First column, and scanline, counted from the picture's top left pixel; 0 where ``length`` is 0.
    length : int64 array, shape (R,)
        Pixels in the picture, 0 to 4095.
    skip : int64 array, shape (R,)
        Pixels cut off at the long edge; 0 where ``length`` is 0.
    carry, last, right, flip : bool arrays, shape (R,)
        As in `Rows`.
    material : int64 array, shape (R,)
        As in `Rows`.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    skip: np.ndarray
    carry: np.ndarray
    last: np.ndarray
    right: np.ndarray
    flip: np.ndarray
    material: np.ndarray

    def __len__(self) -> int:
        return len(self.y)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        return vars(self) | {"covered": self.length > 0, "skips": self.skip > 0}


@dataclass(frozen=True)
class SpanClip:
    """Cuts scanlines to the picture.

    A scanline gets ``x = max(begin, left) - left`` and ``length = min(end, right) - max(begin, left)``.
    Scanlines above the picture, and scanlines without a pixel in it, are passed on with length 0. For these
    scanlines `SpanAttributes` steps down the long edge, and makes no span.

    Source: docs/theory/geometry.md#coverage; [T] figure 4.10.
    """

    def compute(self, rows: Rows, frame: FrameSettings) -> ClippedRows:
        """Bit-accurate scanlines in the picture.

        Parameters
        ----------
        rows : Rows
            From `EdgeWalk`.
        frame : FrameSettings
            The picture.
        """
        begin, end = np.maximum(rows.begin, frame.left), np.minimum(rows.end, frame.right)
        covered = (end > begin) & (rows.y >= frame.top)
        return ClippedRows(
            x=np.where(covered, begin - frame.left, 0),
            y=np.where(covered, rows.y - frame.top, 0),
            length=np.where(covered, end - begin, 0),
            skip=np.where(covered, np.where(rows.right, rows.end - end, begin - rows.begin), 0),
            carry=rows.carry,
            last=rows.last,
            right=rows.right,
            flip=rows.flip,
            material=rows.material,
        )
