"""Beats of drawn pixels, against a loop over the spans."""

import numpy as np
import pytest

from blysk.golden.geometry.depth_lanes import DepthLanes


def looped(length, drawn, lanes):
    """Beat and lane of each drawn pixel, span by span and beat by beat."""
    found, beat, first = [], 0, 0
    for pixels in length:
        for begin in range(0, pixels, lanes):
            of_beat = [k for k in range(min(lanes, pixels - begin)) if drawn[first + begin + k]]
            found += [(beat, k) for k in of_beat]
            beat += bool(of_beat)
        first += pixels
    return found


@pytest.mark.parametrize("lanes", [2, 4])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.6, 1.0])
def test_beats_of_drawn_pixels(lanes, share):
    rng = np.random.default_rng(lanes)
    length = rng.integers(1, 9, 200)
    drawn = rng.random(length.sum()) < share
    beat, lane = DepthLanes(lanes).beats(length, drawn)
    assert list(zip(beat.tolist(), lane.tolist(), strict=True)) == looped(length.tolist(), drawn, lanes)


@pytest.mark.parametrize("lanes", [1, 3])
def test_number_of_lanes_is_checked(lanes):
    with pytest.raises(ValueError, match=f"lanes must be a power of two from 2 on, not {lanes}"):
        DepthLanes(lanes)
