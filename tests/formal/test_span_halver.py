# amaranth: UnusedElaboratable=no
"""Proofs about the span halver: no pixel of a span is lost or drawn twice."""

import pytest
from amaranth.hdl import Mux, Signal

from blysk.golden.geometry.triangles import PIXEL_BITS
from blysk.hdl.geometry.span_halver import SpanHalverUnit

from .prover import Harness
from .rules import taken

pytestmark = pytest.mark.prove


def of_pixels():
    """A model has the pixels that are owed and the column of the first of them."""
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
    # A span is taken when all pixels of the one before have left, or leave.
    h.claim(~taken(given) | ~owed.any() | (taken(found) & (length == owed)))
    valid, left, pixels, whole, x = (h.register(name) for name in ("valid", "left", "pixels", "whole", "x"))
    h.claim(valid == owed.any())
    h.claim(~valid | ((left == owed) & (x == column) & pixels.any() & (pixels <= left)))
    h.claim(~valid | (h.register("right") == right))
    h.claim(~valid | (whole == (pixels == left)))
    return h


def test_pixels_are_those_of_the_span(prove):
    """Inductive: pieces are the span's pixels, in their order from the long edge, each once."""
    prove(of_pixels())


@pytest.mark.parametrize(
    ("text", "bug"),
    [("valid.eq(~whole)", "valid.eq(0)"), ("Mux(odd, pixels >> 1, pixels)", "pixels")],
)
def test_bugs_are_found(refute, inject, text, bug):
    """What is left of a span is forgotten; a piece is longer than the span."""
    inject(SpanHalverUnit, "elaborate", text, bug)
    refute(of_pixels())
