"""Words of frames decode to the frames, from any bit on. Each broken rule is reported."""

import numpy as np
import pytest

from blysk.golden.video.display import Display, LaneError
from blysk.golden.video.display_timing import Axis, DisplayMode
from blysk.golden.video.serialiser import Serialiser
from blysk.golden.video.tmds_encoder import bits_of

DISPLAY = Display(DisplayMode(Axis(24, 2, 3, 3), Axis(16, 1, 2, 3)))
FRAMES = np.random.default_rng(2026).integers(0, 256, (2, 16, 24, 3))
FRAMES[0, :4] = 255


def bits(words):
    """Bits of words, in the order in which they are sent."""
    serialiser = Serialiser()
    sent = serialiser.bits(serialiser.compute(words))
    # The same by definition: bit 0 of a word comes first.
    np.testing.assert_array_equal(sent, bits_of(words).swapaxes(1, 2).reshape(-1, 4))
    return sent


def test_round_trip():
    words = DISPLAY.compute(FRAMES)
    for skipped in range(0, 41, 7):
        np.testing.assert_array_equal(DISPLAY.decode(bits(words)[skipped:]), FRAMES)


def spoil(lane, at, value=None, *, roll=0):
    """Bits with another word in a lane, or with a lane that comes later."""
    words = DISPLAY.compute(FRAMES)
    if value is not None:
        words[at, lane] = value
    sent = bits(words)
    sent[:, lane] = np.roll(sent[:, lane], roll)
    return sent


TOP = 6 * 32


@pytest.mark.parametrize(
    ("sent", "message"),
    [
        (spoil(3, TOP, 0b0000111110), "clock"),
        (spoil(1, TOP + 5, 0b1101010100), "not together"),
        (spoil(0, TOP + 26, 0b1010101011), "sync"),
        (spoil(2, 0, roll=1), "aligned"),
        (spoil(0, 0)[: 10 * 400], "no frame"),
    ],
)
def test_broken_lanes_are_told(sent, message):
    with pytest.raises(LaneError, match=message):
        DISPLAY.decode(sent)


def test_lean_is_told():
    """Words of an encoder without balance are reported: the same word each time, with mostly ones."""
    words = DISPLAY.compute(np.full((1, 16, 24, 3), 255))
    blank = np.isin(words[:, 0], (0b1101010100, 0b0010101011, 0b0101010100, 0b1010101011))
    words[~blank, 0] = 0b0111111111 ^ 0b0000000000
    with pytest.raises(LaneError, match="ones"):
        DISPLAY.decode(bits(words))


def test_lines_of_another_length_are_told():
    words = np.delete(DISPLAY.compute(FRAMES), TOP + 3, axis=0)
    with pytest.raises(LaneError, match="blank"):
        DISPLAY.decode(bits(words))
