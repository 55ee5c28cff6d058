"""Lengths of every porch, against the figures of the mode."""

import numpy as np
import pytest

from blysk.golden.video.display_timing import VGA, Axis, DisplayMode, DisplayTiming


def runs(values):
    """Lengths of runs of equal values, with the values."""
    edges = np.r_[0, np.flatnonzero(np.diff(values)) + 1, len(values)]
    return list(
        zip(np.asarray(values)[edges[:-1]].astype(int).tolist(), np.diff(edges).tolist(), strict=True)
    )


def test_vga():
    """The mode has 800x525 pixels at 25.2 MHz.

    Both pulses are low, 96 pixels and two lines long, with 16 pixels and 10 lines before them.
    """
    assert (VGA.cycles, VGA.pixel_rate, VGA.size) == (800 * 525, 25.2e6, (640, 480))
    frame = DisplayTiming().compute(VGA.cycles, first=45 * 800)
    assert frame["active"].sum() == 640 * 480
    line = {name: values[:800] for name, values in frame.items()}
    assert runs(line["active"]) == [(1, 640), (0, 160)]
    assert runs(line["hsync"]) == [(1, 640 + 16), (0, 96), (1, 48)]
    assert line["vsync"].all()
    assert runs(frame["vsync"]) == [(1, 489 * 800 + 656), (0, 2 * 800), (1, 33 * 800 + 144)]
    assert len(set(zip(frame["x"].tolist(), frame["y"].tolist(), strict=True))) == VGA.cycles


def test_starts_below_the_picture():
    first = DisplayTiming().compute(45 * 800 + 1)
    assert (first["x"][0], first["y"][0]) == (0, 480)
    assert not first["active"][:-1].any()
    assert first["active"][-1]


def test_polarity():
    mode = DisplayMode(Axis(4, 1, 2, 1, positive=True), Axis(3, 1, 1, 1))
    frame = DisplayTiming(mode).compute(mode.cycles)
    assert frame["hsync"].sum() == 2 * 6
    assert (~frame["vsync"]).sum() == 8


def test_empty_part_is_refused():
    with pytest.raises(ValueError, match="at least one"):
        Axis(640, 0, 96, 48)
