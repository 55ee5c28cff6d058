"""Edge normals ([T] figure 4.10): unit normals at both ends of every piece of a span."""

from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from blysk.golden.geometry.span_attributes import SPAN_NORMAL, Pieces
from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE

__all__ = ["EdgeNormals", "PlacedSpans", "TrueSpans"]


@dataclass(frozen=True)
class PlacedSpans:
    """Spans with their places, depths, materials and triangles, without normals.

    Parameters
    ----------
    x, y, length : int64 arrays, shape (S,)
        Column and scanline of the first pixel, and number of pixels, 1 or more.
    depth : int64 array, shape (S,)
        Depth at the first pixel, UQ(24, 9).
    depth_step : int64 array, shape (S,)
        Step of the depth from a pixel to the next, SQ(25, 9); without meaning in a span of one pixel.
    material : int64 array, shape (S,)
        Index of the material.
    triangle : int64 array, shape (S,)
        Index of the triangle.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    depth: np.ndarray
    depth_step: np.ndarray
    material: np.ndarray
    triangle: np.ndarray

    def __len__(self) -> int:
        return len(self.x)

    @property
    def beats(self) -> dict[str, np.ndarray]:
        """Fields of the output beats of the hardware, by name: arrays of codes."""
        return {name: value for name, value in vars(self).items() if name != "triangle"}

    @classmethod
    def of(cls, pieces: Pieces, **others: Any) -> Self:
        """Spans of this class, with places and depths from ``pieces`` and other fields from ``others``."""
        placed = {name: getattr(pieces, name) for name in ("x", "y", "length", "material", "triangle")}
        depths = {name: getattr(pieces, name).codes for name in ("depth", "depth_step")}
        return cls(**placed, **depths, **others)


@dataclass(frozen=True)
class TrueSpans(PlacedSpans):
    """Spans with two unit normals each.

    Parameters
    ----------
    x, y, length, depth, depth_step, material, triangle
        As in `PlacedSpans`.
    depth_last : int64 array, shape (S,)
        Depth at the last pixel, UQ(24, 9).
    normal_left, normal_right : int64 arrays, shape (S, 3)
        Unit normals, SQ(1, 17), at the centres of the first and of the last pixel.
    line_left, line_right : int64 arrays, shape (S, 3)
        N/W at the first and at the last pixel, `SPAN_NORMAL`: the normals with their magnitudes. The straight
        line between them is perspective-correct. If ``flip`` is set, they point against the unit normals.
    flip : bool array, shape (S,)
        Whether the unit normals are negated.
    """

    depth_last: np.ndarray
    normal_left: np.ndarray
    normal_right: np.ndarray
    line_left: np.ndarray
    line_right: np.ndarray
    flip: np.ndarray


@dataclass(frozen=True)
class EdgeNormals:
    """Unit normals of pieces by `VectorNormaliser`: left, and right from 2 pixels on.

    N/W is linear along a scanline, and normalising takes 1/W away. So both normals are perspective-correct.

    A normal is lost where opposite normals cancel, or where a corner has no normal. The normal before it
    takes its place. Normals are in the order of the pieces, and left before right within a piece. For the
    first normal, `FIRST` = (0, 0, `ONE`) is the normal before it. These *repaired* normals are counted.

    Parameters
    ----------
    normaliser : VectorNormaliser
        For components of `SPAN_NORMAL`.

    Source: docs/theory/geometry.md#normals; [T] figure 4.10 (normals along the edges).
    """

    normaliser: VectorNormaliser = field(default_factory=VectorNormaliser)

    FIRST = (0, 0, ONE)

    def compute(self, pieces: Pieces) -> tuple[TrueSpans, int]:
        """Bit-accurate spans, and the number of repaired normals.

        Parameters
        ----------
        pieces : Pieces
            From `SpanAttributes`.
        """
        vectors = np.stack([pieces.left.codes, pieces.right.codes], axis=1)
        flip = np.broadcast_to(pieces.flip[:, np.newaxis], vectors.shape[:2])
        normals, lost = self.normaliser.compute(Fixed(SPAN_NORMAL, vectors), flip)
        made = pieces.length[:, np.newaxis] > np.arange(2)
        repaired = int((lost & made).sum())
        # The last good normal replaces a normal that is lost, and a normal for which the piece is too short.
        good = np.r_[True, (made & ~lost).ravel()]
        codes = np.vstack([self.FIRST, normals.codes.reshape(-1, 3)])
        codes = codes[np.maximum.accumulate(np.where(good, np.arange(len(good)), 0))][1:].reshape(-1, 2, 3)
        spans = TrueSpans.of(
            pieces,
            depth_last=pieces.depth_last.codes,
            normal_left=codes[:, 0],
            normal_right=codes[:, 1],
            line_left=pieces.left.codes,
            line_right=pieces.right.codes,
            flip=pieces.flip,
        )
        return spans, repaired
