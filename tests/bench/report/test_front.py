"""The drawing of the front: which axis it has, and designs that it leaves out."""

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
        summary("chord, blinn", 0.6, 1.0, 150),
        summary("linear, cosquad", 90.0, 1.3, 140),
        summary("quadratic, blinn", 0.7, 1.3, 160),
        summary("angular, cosquad", 20.0, 1.4, angular),
    ]


def test_nanoseconds_where_most_are_placed_and_the_others_are_named():
    drawing = conclusion(found()).drawing
    assert drawing.title == "Error against nanoseconds a pixel"
    assert "for the FPGA): angular, cosquad." in drawing.note
    assert "Not drawn" not in conclusion(found(angular=100)).drawing.note


def test_cycles_where_most_are_not_placed():
    few = [of | {"ns": None, "luts": None, "fmax_mhz": None} for of in found()[1:]]
    drawing = conclusion([found()[0], *few]).drawing
    assert drawing.title == "Error against cycles a pixel"
    assert "1 of 4 designs have committed clock rates" in drawing.note


@pytest.mark.parametrize(("mhz", "is_on"), [(250, True), (100, False)])
def test_front_in_nanoseconds(mhz, is_on):
    """A design of as small an error, more cycles and a faster clock is on the front: its name is bold."""
    faster = summary("quadratic, blinn", 0.6, 1.3, mhz)
    drawing = conclusion([faster, summary("chord, blinn", 0.6, 1.0, 150), *found()[1:2]]).drawing
    (style, *_) = re.findall(r'<text class="(\w+)"[^>]*>quadratic, blinn</text>', drawing.svg)
    (rule,) = re.findall(rf"\.{style} *{{([^}}]*)}}", drawing.svg)
    assert ("bold" in rule or "700" in rule) == is_on
