"""Colours kept by their highest bits, late bands, and the order of bands."""

import numpy as np
import pytest

from blysk.golden.video.band_buffer import RGB565, RGB888, BandBuffer
from blysk.golden.video.display_timing import Axis, DisplayMode

MODE = DisplayMode(Axis(8, 1, 1, 1), Axis(16, 1, 1, 1))


@pytest.mark.parametrize("bits", [RGB888, RGB565, (4, 4, 4)])
def test_colours(bits):
    """Black and white stay, the order stays, and every channel is within the stated error."""
    buffer = BandBuffer(MODE, 4, bits)
    every = np.repeat(np.arange(256)[:, np.newaxis], 3, axis=1)
    shown = buffer.shown(buffer.kept(every))
    assert shown[0].tolist() == [0, 0, 0]
    assert shown[255].tolist() == [255, 255, 255]
    assert (np.diff(shown, axis=0) >= 0).all()
    assert np.abs(shown - every).max() == buffer.error
    for channel, count in enumerate(bits):
        assert len(set(shown[:, channel].tolist())) == 1 << count


@pytest.mark.parametrize(
    ("shape", "late", "message"),
    [
        ((16, 8, 3), (4,), "bands are 0 to 3, not 4"),
        ((16, 8, 3), (-1,), "bands are 0 to 3, not -1"),
        ((16, 9, 3), (), r"has shape \(16, 8, 3\), not \(16, 9, 3\)"),
    ],
)
def test_what_is_beside_the_display(shape, late, message):
    with pytest.raises(ValueError, match=message):
        BandBuffer(MODE, 4).compute(np.zeros(shape, dtype=int), late)


def test_late_bands_are_background():
    buffer = BandBuffer(MODE, 4, background=(1, 2, 3))
    picture = np.full((16, 8, 3), 200)
    shown = buffer.compute(picture, late=(0, 2))
    assert (shown[4:8] == 200).all()
    assert (shown[12:] == 200).all()
    assert (shown[0:4] == (1, 2, 3)).all()
    assert (shown[8:12] == (1, 2, 3)).all()


def test_following():
    """For every band and slot, the next band is one of the next two slots' bands: the nearest that is not
    drawn yet."""
    buffer = BandBuffer(MODE, 2)
    band, slot = np.mgrid[:8, :8]
    following = buffer.following(band, slot)
    ahead = (following - slot) % 8
    assert np.isin(ahead, (1, 2)).all()
    assert (ahead[(band - slot) % 8 == 1] == 2).all()
    assert (following[band == slot] == (slot[band == slot] + 1) % 8).all()


@pytest.mark.parametrize(
    "options",
    [
        {"lines": 3},
        {"lines": 8},
        {"lines": 4, "colour_bits": (3, 6, 5)},
        {"lines": 4, "background": (0, 256, 0)},
    ],
)
def test_bad_parameters_are_refused(options):
    with pytest.raises(ValueError, match=r"band|channel"):
        BandBuffer(MODE, **options)
