"""Figures of many frames; those of one are held against a whole run by the command line's tests."""

import math

from blysk.sim.frames.figures import ERRORS, worst_errors
from blysk.sim.frames.summary import short_lines

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


def test_a_warning_has_number_reason_and_remedy():
    figures = {
        **frame(9, 3.0, 1.0, 0.5, 40.0),
        **dict.fromkeys(("mesh", "method", "model", "engine"), "x"),
        **dict.fromkeys(
            ("triangles", "width", "height", "lights", "pixels", "cycles", "cycles_per_pixel"), 1
        ),
        **dict.fromkeys(("exponent", "roughness"), None),
        "counts": {"missed_pieces": 1234, "sliver_triangles": 5},
        "seconds": {"total": 1.0},
    }
    noticed = [line for line in short_lines(figures) if line.startswith("noticed")]
    reason = "spans that this method misses by over 0.25 LSB, as lengths of their normals differ"
    remedy = "use geometry software, or smaller triangles"
    assert noticed == [f"noticed     {reason}: 1,234; {remedy}; see -v"]
    figures["counts"]["out_of_range_spans"] = 7
    assert list(short_lines(figures))[-2].endswith(f"{remedy}, and 1 more; see -v")
