"""Edge normals ([T] figure 4.10): unit normals at both ends and in the middle of every piece of a span."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from blysk.golden.geometry.span_attributes import SPAN_NORMAL, Pieces
from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE

__all__ = ["EdgeNormals", "PlacedSpans", "TrueSpans"]


@dataclass(frozen=True)
class PlacedSpans:
    """Where spans are on the screen, how deep, and of what: without normals.

    Parameters
    ----------
    x, y, length : int64 arrays, shape (S,)
        First pixel, and pixels from there on, 1 or more.
    depth : int64 array, shape (S,)
        At the first pixel, UQ(24, 9).
    depth_last : int64 array, shape (S,)
        At the last pixel.
    depth_step : int64 array, shape (S,)
        From a pixel to the next, SQ(25, 9); of a single pixel it means nothing.
    material : int64 array, shape (S,)
        Index of the material.
    triangle : int64 array, shape (S,)
        Index of the triangle.
    """

    x: np.ndarray
    y: np.ndarray
    length: np.ndarray
    depth: np.ndarray
    depth_last: np.ndarray
    depth_step: np.ndarray
    material: np.ndarray
    triangle: np.ndarray

    def __len__(self) -> int:
        return len(self.x)

    @property
    def beats(self) -> dict:
        """What the hardware gives."""
        return {name: value for name, value in vars(self).items() if name != "triangle"}

    @classmethod
    def of(cls, pieces: Pieces, **normals: np.ndarray) -> Self:
        """Spans of pieces, with what this class has besides."""
        placed = {name: getattr(pieces, name) for name in ("x", "y", "length", "material", "triangle")}
        depths = {name: getattr(pieces, name).codes for name in ("depth", "depth_last", "depth_step")}
        return cls(**placed, **depths, **normals)


@dataclass(frozen=True)
class TrueSpans(PlacedSpans):
    """Spans with three unit normals each.

    Parameters
    ----------
    x, y, length, depth, depth_last, depth_step, material, triangle
        As `PlacedSpans` has them.
    normal_left, normal_middle, normal_right : int64 arrays, shape (S, 3)
        Unit normals, SQ(1, 17), at the first pixel's centre, half-way to the last, and at the last. Of 1
        pixel all are the left one, of 2 the middle one is the right one.
    line_left, line_right : int64 arrays, shape (S, 3)
        N/W at the first and at the last pixel, `SPAN_NORMAL`: the normals' magnitudes, whose line on the
        screen is exact in perspective. Where ``flip`` is set they point against the unit normals.
    flip : bool array, shape (S,)
        The unit normals are negated.
    """

    normal_left: np.ndarray
    normal_middle: np.ndarray
    normal_right: np.ndarray
    line_left: np.ndarray
    line_right: np.ndarray
    flip: np.ndarray


@dataclass(frozen=True)
class EdgeNormals:
    """Unit normals of pieces by `VectorNormaliser`: left, right, and of 3 pixels and more the middle one.

    N/W is linear along a scanline, and normalising takes 1/W away: all three are the perspective-correct
    normals. The middle one is that of ``(left + right) / 2``, cut to 26 fraction bits, at half the way
    between the first and the last pixel's centre.

    A normal that is lost, because opposite normals cancel there or a corner has none, is repaired: it takes
    the place of the one before it, in the order of the pieces and of left, right, middle. The first of all
    has (0, 0, 1) before it. Repaired normals are counted.

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
        middle = (pieces.left + pieces.right).scale(-1).truncate(SPAN_NORMAL.fraction_bits)
        vectors = np.stack([pieces.left.codes, pieces.right.codes, middle.codes], axis=1)
        flip = np.broadcast_to(pieces.flip[:, np.newaxis], vectors.shape[:2])
        normals, lost = self.normaliser.compute(Fixed(SPAN_NORMAL, vectors), flip)
        made = pieces.length[:, np.newaxis] > np.arange(3)
        repaired = int((lost & made).sum())
        # What is not made, or lost, is the last good one before it.
        good = np.r_[True, (made & ~lost).ravel()]
        codes = np.vstack([self.FIRST, normals.codes.reshape(-1, 3)])
        codes = codes[np.maximum.accumulate(np.where(good, np.arange(len(good)), 0))][1:].reshape(-1, 3, 3)
        spans = TrueSpans.of(
            pieces,
            normal_left=codes[:, 0],
            normal_middle=codes[:, 2],
            normal_right=codes[:, 1],
            line_left=pieces.left.codes,
            line_right=pieces.right.codes,
            flip=pieces.flip,
        )
        return spans, repaired
