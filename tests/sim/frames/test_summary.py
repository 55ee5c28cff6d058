"""Figures of many frames. Tests of the command line compare the figures of one frame with a whole run."""

import math

import pytest

from blysk.sim.frames.error_names import ERRORS
from blysk.sim.frames.figures import worst_errors
from blysk.sim.frames.summary import frame_lines, short_lines

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


ERROR = {"max_lsb": 145.6, "p999_lsb": 0.5, "rmse_lsb": 0.3, "psnr_db": 58.0, "steady_lsb": 0.53}


def figures(model, target, bound=0.92, border=3):
    errors = {f"{name}_error": {**ERROR, "border_lsb": 145.6 if border else 0.0} for name in ERRORS}
    return {
        **errors,
        **{"mesh": "teapot", "triangles": 9, "width": 16, "height": 12, "lights": 1, "materials": 1},
        **{"method": "quadratic", "model": model, "exponent": 50, "roughness": None, "engine": "cxxrtl"},
        **{"cycles": 9, "pixels": 9, "cycles_per_pixel": 1.0, "visible_pixels": 9, "spans": 3},
        **{
            "target": target,
            "transfer": "srgb",
            "bound_lsb": bound,
            "border": "|N.L| at most 0.002",
            "border_pixels": border,
        },
        "step_lsb": 0.0,
        **{"nmse": 0.1, "mnse_published": 0.1, "mnse_published_share": 1.0, "counts": {}},
        **{"simulated_pixels_per_second": 9.0, "seconds": {"total": 1.0}},
    }


def line(lines, name):
    (found,) = [text for text in lines if text.startswith(f"{name} ")]
    return found.removeprefix(name).strip()


@pytest.mark.parametrize("model", ["ggx", "phong_coplanar", "blinn", "cosquad"])
def test_the_reference_is_the_one_that_was_used(model):
    """A lobe is compared with its own model, and every other model also with Blinn's power."""
    target = "blinn" if model == "cosquad" else model
    short = list(short_lines(figures(model, target)))
    said = line(short, "error")
    assert f"from exact {target} shading" in said
    assert ("with this model" in said) == (model == "cosquad")
    full = list(frame_lines(figures(model, target)))
    assert line(full, " " * 2 + "total").endswith(f"exact normals of every pixel, model {target}")
    if target != "blinn":
        assert "blinn" not in "\n".join([*short, *full]).lower()


@pytest.mark.parametrize("lines", [short_lines, frame_lines])
@pytest.mark.parametrize(("transfer", "space"), [("srgb", "sRGB"), ("linear", "linear light")])
def test_errors_say_their_space(lines, transfer, space):
    told = list(lines({**figures("blinn", "blinn"), "transfer": transfer}))
    assert f"LSB of 8-bit {space}" in "\n".join(told)


@pytest.mark.parametrize("lines", [short_lines, frame_lines])
def test_what_the_error_leaves_out_is_told(lines):
    """The line names the bound, the largest measured error, and the number of pixels that both leave out."""
    told = list(lines(figures("blinn", "blinn")))
    text = "\n".join(told)
    assert "bound 0.92" in text
    assert "0.53" in text
    assert line(told, "left out").startswith("3 pixels with |N.L| at most 0.002")
    assert line(told, "left out").endswith("largest 145.60 LSB")
    told = list(lines(figures("linear", "blinn", None, 0)))
    assert "no bound is known" in "\n".join(told)
    assert not any(text.startswith("left out") for text in told)


def test_pixels_dropped_by_alpha_are_told():
    given = {**figures("blinn", "blinn"), "counts": {"cut_out_pixels": 1234}}
    assert line(list(short_lines(given)), "cycles").endswith("; 1,234 pixels dropped by alpha")
    reason = "pixels dropped before the depth test, as their alpha is under the cutoff"
    assert line(list(frame_lines(given)), "counted") == f"{reason}: 1,234"
    assert not any("dropped" in text for text in short_lines(figures("blinn", "blinn")))


def test_a_warning_has_number_reason_and_remedy():
    given = {**figures("blinn", "blinn"), "counts": {"missed_pieces": 1234, "sliver_triangles": 5}}
    noticed = [line for line in short_lines(given) if line.startswith("noticed")]
    reason = "spans over 0.25 LSB off with this method, as their normals differ in length"
    remedy = "use geometry software, or smaller triangles"
    assert noticed == [f"noticed     {reason}: 1,234; {remedy}; see -v"]
    given["counts"]["out_of_range_spans"] = 7
    assert list(short_lines(given))[-2].endswith(f"{remedy}, and 1 more; see -v")
