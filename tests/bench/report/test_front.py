"""The drawing of the front: its axis, and the designs that it leaves out."""

import re

import pytest

from blysk.bench.report.front import conclusion


def summary(label, error, cycles, mhz):
    method, _, _ = label.partition(", ")
    return {
        "label": label,
        "method": method,
        "group": "own",
        "is_prepared": False,
        "is_mirror": label.endswith("phong"),
        "samples": 3,
        "method_error": (error / 2, error),
        "total_error": (error / 2, error),
        "cycles": (cycles, cycles, cycles * 1.5),
        "ns": mhz and (cycles * 900 / mhz, cycles * 1e3 / mhz, cycles * 1600 / mhz),
        "multipliers": 16,
        "luts": mhz and 5000,
        "fmax_mhz": mhz,
        "parts": 1.0,
    }


def found(*, angular=None):
    return [
        summary("quotient, blinn", 0.55, 1.006, 150),
        summary("linear, cosquad", 90.0, 1.3, 140),
        summary("quadratic, blinn", 0.7, 1.3, 160),
        summary("angular, cosquad", 20.0, 1.4, angular),
    ]


def test_nanoseconds_where_most_are_placed_and_the_others_are_named():
    drawing = conclusion(found()).drawing
    assert drawing.title == "Error against nanoseconds a pixel"
    assert "for the FPGA): angular, cosquad." in drawing.note
    assert "Not drawn" not in conclusion(found(angular=100)).drawing.note


@pytest.mark.long
def test_cycles_where_most_are_not_placed():
    few = [of | {"ns": None, "luts": None, "fmax_mhz": None} for of in found()[1:]]
    drawing = conclusion([found()[0], *few]).drawing
    assert drawing.title == "Error against cycles a pixel"
    assert "1 of 4 designs have committed clock rates" in drawing.note
    # The axis is not used either if the best design would be left out.
    best = found()[0] | {"ns": None, "luts": None, "fmax_mhz": None}
    drawing = conclusion([best, *found(angular=100)[1:]]).drawing
    assert drawing.title == "Error against cycles a pixel"
    assert "quotient, blinn" in drawing.svg


@pytest.mark.parametrize(("mhz", "is_on"), [(250, True), (100, False)])
def test_front_in_nanoseconds(mhz, is_on):
    """A design with an equal error, more cycles and a faster clock is on the front, and its name is bold."""
    faster = summary("quadratic, blinn", 0.6, 1.3, mhz)
    drawing = conclusion([faster, summary("quotient, blinn", 0.6, 1.0, 150), *found()[1:2]]).drawing
    (style, *_) = re.findall(r'<text class="(\w+)"[^>]*>quadratic, blinn</text>', drawing.svg)
    (rule,) = re.findall(rf"\.{style} *{{([^}}]*)}}", drawing.svg)
    assert ("bold" in rule or "700" in rule) == is_on


@pytest.mark.parametrize(
    ("luts", "others"), [(4929, "Of 2 other designs none"), (3000, "angular, blinn"), (None, "")]
)
def test_as_fast_as_another_and_as_exact(luts, others):
    """Of two designs with equal multipliers the one with fewer look-up tables is on the front, if both
    numbers are known."""
    other = summary("angular, blinn", 0.58, 1.005, 150) | {"luts": luts}
    own, linear, *_ = found()
    sentence = conclusion([other, own | {"luts": 3169}, linear]).sentence
    best = "angular, blinn" if luts == 3000 else "quotient, blinn"
    assert sentence.startswith(f"**`{best}`**")
    assert ("The front also has" in sentence) == (luts is None)
    assert others in sentence


def test_phong_is_told_and_on_no_front():
    """Its errors are against another picture, so no design of Blinn's model is compared with it."""
    phong = summary("quotient, phong", 0.51, 0.9, 150) | {"multipliers": 1}
    made = conclusion([phong, *found()[:2]])
    assert made.sentence.startswith("**`quotient, blinn`**")
    assert "Of 1 other designs none" in made.sentence
    assert "(R·V)^n, `quotient, phong` takes 0.90 cycles and 1 multipliers" in made.sentence
    assert "Its largest error against exact Phong shading is 0.51 LSB." in made.sentence
