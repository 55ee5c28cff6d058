"""Depth test of several lanes: the beats that a span's drawn pixels make."""

from dataclasses import dataclass

import numpy as np

from blysk.golden.cosines.quotient_lanes import pixels_of_beats
from blysk.golden.geometry.depth_tester import DepthTester

__all__ = ["DepthLanes"]


@dataclass(frozen=True)
class DepthLanes(DepthTester):
    """`DepthTester` for a pipeline with several lanes: it draws the same pixels, in beats with a mask.

    A beat of shaded pixels becomes a beat of drawn pixels if at least one of its pixels is drawn. Each place
    has a lane of its own in a beat. So the pixels of a beat are tested at once, and the order of drawing is
    the order of one lane.

    Parameters
    ----------
    lanes : int
        Number of lanes, a power of two.

    Raises
    ------
    ValueError
        If the number of lanes is 1 or no power of two.

    Source: docs/theory/geometry.md#depth-lanes; not in the documents.
    """

    lanes: int = 2

    def __post_init__(self) -> None:
        if self.lanes < 2 or self.lanes & (self.lanes - 1):
            raise ValueError(f"lanes must be a power of two from 2 on, not {self.lanes}")

    def beats(self, length: np.ndarray, drawn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Beat and lane of each drawn pixel.

        Parameters
        ----------
        length : int64 array, shape (S,)
            Pixels of each span, 1 or more.
        drawn : bool array, shape (P,)
            From `drawn`, for all pixels of the spans in their order.

        Returns
        -------
        beat, lane : int64 arrays, shape (number of drawn pixels,)
            Beats without a drawn pixel do not count.
        """
        index, present, _ = pixels_of_beats(length, self.lanes)
        beat, lane = np.nonzero(present & drawn[index])
        return np.unique(beat, return_inverse=True)[1], lane
