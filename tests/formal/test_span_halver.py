# amaranth: UnusedElaboratable=no
"""Proofs about the span halver: no pixel of a span is lost or drawn twice."""

import pytest
from amaranth.hdl import Cat, Mux, Signal

from blysk.golden.geometry.triangles import ATTRIBUTES, PIXEL_BITS
from blysk.hdl.geometry.span_halver import SpanHalverUnit

from .prover import Harness
from .rules import taken

pytestmark = pytest.mark.prove


def of_pixels():
    """Claims on pixels. A model holds the pixels that are owed and the column of the first of them."""
    h = Harness(SpanHalverUnit())
    given, found = h.unit.i, h.unit.o
    h.assume(~given.valid | given.payload.length.any())
    owed, column = Signal(PIXEL_BITS, name="owed"), Signal(PIXEL_BITS, name="column")
    right = Signal(name="from_the_right")
    length = found.payload.length
    with h.m.If(taken(given)):
        h.m.d.sync += [
            owed.eq(given.payload.length),
            column.eq(given.payload.x),
            right.eq(given.payload.right),
        ]
    with h.m.Elif(taken(found)):
        h.m.d.sync += [owed.eq(owed - length), column.eq(Mux(right, column, column + length))]
    first = Mux(right, column + owed - length, column)[:PIXEL_BITS]
    h.claim(~taken(found) | (length.any() & (length <= owed) & (found.payload.x == first)))
    # A span is taken when all pixels of the span before have left, or are leaving.
    h.claim(~taken(given) | ~owed.any() | (taken(found) & (length == owed)))
    valid, left, pixels, whole, x = (h.register(name) for name in ("valid", "left", "pixels", "whole", "x"))
    h.claim(valid == owed.any())
    h.claim(~valid | ((left == owed) & (x == column) & pixels.any() & (pixels <= left)))
    h.claim(~valid | (h.register("right") == right))
    h.claim(~valid | (whole == (pixels == left)))
    return h


def test_pixels_are_those_of_the_span(prove):
    """By induction: the pieces have the span's pixels, in order from the long edge and once each."""
    prove(of_pixels())


def of_waiting():
    """Claim that registers of a piece that waits keep their words.

    The piece is a function of these registers alone.
    """
    h = Harness(SpanHalverUnit())
    found, waits = h.unit.o, Signal(name="waits")
    ends = (f"{name}_{k}" for name in ("near", "far", "last", "step") for k in range(ATTRIBUTES))
    marks = (f"size_{end}_{k}" for end in range(2) for k in range(ATTRIBUTES - 1))
    names = "valid", "known", "whole", "x", "left", "pixels", "y", "right", "flip", "material", "shift"
    held = Cat(*map(h.register, (*names, *ends, *marks, *(f"same_{k}" for k in range(ATTRIBUTES - 1)))))
    before = Signal.like(held, name="before")
    h.m.d.sync += [waits.eq(found.valid & ~found.ready), before.eq(held)]
    h.claim(~waits | (held == before))
    return h


def test_a_piece_that_waits_stays(prove, refute, inject):
    """By induction. A piece that leaves without being taken is found."""
    prove(of_waiting())
    inject(SpanHalverUnit, "elaborate", "leaves.eq(self.o.valid & self.o.ready)", "leaves.eq(self.o.valid)")
    refute(of_waiting())


@pytest.mark.parametrize(
    ("text", "bug"),
    [("valid.eq(~whole)", "valid.eq(0)"), ("pixels.eq(shorter(pixels))", "pixels.eq(pixels)")],
)
def test_bugs_are_found(refute, inject, text, bug):
    """Three bugs are found: the rest of a span is forgotten, a piece is longer than the span, a piece comes
    again."""
    inject(SpanHalverUnit, "elaborate", text, bug)
    refute(of_pixels())
