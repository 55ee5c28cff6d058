# amaranth: UnusedElaboratable=no
"""Display RTL down to the bits of the lanes equals the model. Late bands leave the lanes whole."""

from fractions import Fraction

import numpy as np
import pytest

from blysk.golden.video.band_buffer import RGB565, BandBuffer
from blysk.golden.video.display_timing import Axis, DisplayMode
from blysk.sim.frames.display import OneClock, show

from .pattern import PatternTop, picture

MODE = DisplayMode(Axis(24, 2, 3, 11), Axis(16, 1, 2, 3))
PARAMETERS = BandBuffer(MODE, 4, background=(9, 99, 199))


def shown(pause, rate, frames=4, model=PARAMETERS, **options):
    """Frames of a display in a small mode."""
    return show(OneClock(PatternTop(model, pause), Fraction(rate)), MODE, frames, **options)


@pytest.mark.long
@pytest.mark.parametrize(
    ("rate", "model"),
    [pytest.param("5/7", PARAMETERS, marks=pytest.mark.ci), ("1/2", BandBuffer(MODE, 2, RGB565))],
)
def test_lanes_decode_to_the_frames(rate, model):
    """Every frame, through the lanes."""
    found = shown(3, rate, model=model)
    expected = [model.compute(picture(model, frame)) for frame in range(4)]
    np.testing.assert_array_equal(found.frames, expected)
    assert found.status["late_bands"] == 0


@pytest.mark.ci
@pytest.mark.long
def test_too_heavy():
    """The lanes stay whole. Late bands are background and are counted, and the other bands are right."""
    found = shown(900, "3/4", frames=8)
    empty = (found.frames == PARAMETERS.background).all((-1, -2)).reshape(8, 4, 4).all(-1)
    assert 0 < empty.sum() < empty.size
    # A further band may have been late before the counters were read.
    assert found.status["late_bands"] in (empty.sum(), empty.sum() + 1)
    for frame, bands in zip(found.frames, empty, strict=True):
        for band in np.flatnonzero(~bands):
            lines = slice(4 * band, 4 * band + 4)
            # The pattern counts frames by band 0, which may have been among the late bands.
            drawn = (picture(PARAMETERS, number)[lines] for number in range(9))
            assert any((frame[lines] == lines_drawn).all() for lines_drawn in drawn)


def test_faster_than_the_lanes_is_refused():
    with pytest.raises(ValueError, match="at most the rate of the serial clock"):
        OneClock(PatternTop(PARAMETERS), Fraction(4, 3))
