"""Figures of many frames; those of one are held against a whole run by the command line's tests."""

import math

from blysk.sim.frames.figures import ERRORS, worst_errors

FIGURES = ("max_lsb", "p999_lsb", "rmse_lsb", "psnr_db")


def frame(visible, *values):
    return {
        "visible_pixels": visible,
        **{f"{name}_error": dict(zip(FIGURES, values, strict=True)) for name in ERRORS},
    }


def test_worst_of_each_error():
    frames = [frame(9, 3.0, 1.0, 0.5, 40.0), frame(5, 2.0, 1.5, 0.25, 50.0)]
    expected = {"max_lsb": 3.0, "p999_lsb": 1.5, "rmse_lsb": 0.5, "psnr_db": 40.0}
    assert worst_errors(frames) == {f"{name}_error": expected for name in ERRORS}


def test_a_frame_without_surface_does_not_count():
    empty = frame(0, *[math.nan] * 4)
    seen = frame(9, 3.0, 1.0, 0.5, 40.0)
    assert worst_errors([empty, seen, empty]) == worst_errors([seen])
    nothing = worst_errors([empty, empty])
    assert all(math.isnan(value) for error in nothing.values() for value in error.values())
