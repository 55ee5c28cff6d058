# amaranth: UnusedElaboratable=no
"""Proofs about the span halver: no pixel of a span is lost or drawn twice."""

import pytest
from amaranth.hdl import Cat, Mux, Signal, Value
from amaranth.lib import data

from blysk.golden.geometry.triangles import ATTRIBUTES, PIXEL_BITS
from blysk.hdl.geometry.span_halver import SpanHalverUnit

from .prover import Harness
from .rules import taken

pytestmark = pytest.mark.prove


def of_pixels():
    """Claims on pixels. A model holds the pixels that are owed, and the column of the first of them.

    The model takes a span when the span leaves the register where it waits for its test.
    """
    h = Harness(SpanHalverUnit())
    given, found = h.unit.i, h.unit.o
    h.assume(~given.valid | given.payload.length.any())
    names = "waits", "valid", "left", "pixels", "whole", "x", "fits", "misses", "again", "tried"
    waits, valid, left, pixels, whole, x, *states = (h.register(name) for name in names)
    waiting = data.View(given.payload.shape(), h.register("waiting"))
    owed, column = Signal(PIXEL_BITS, name="owed"), Signal(PIXEL_BITS, name="column")
    right = Signal(name="from_the_right")
    length, ends = found.payload.length, Signal(name="ends_span")
    h.m.d.comb += ends.eq(taken(found) & (length == owed))
    moves = waits & (~owed.any() | ends)
    with h.m.If(moves):
        h.m.d.sync += [owed.eq(waiting.length), column.eq(waiting.x), right.eq(waiting.right)]
    with h.m.Elif(taken(found)):
        h.m.d.sync += [owed.eq(owed - length), column.eq(Mux(right, column, column + length))]
    # The span that waits is the span that was taken in last, and no other is taken in before it moves.
    entered = Signal.like(Value.cast(given.payload), name="entered")
    with h.m.If(taken(given)):
        h.m.d.sync += entered.eq(Value.cast(given.payload))
    h.claim(~waits | (waiting.as_value() == entered))
    h.claim(~waits | waiting.length.any())
    h.claim(~(waits & taken(given)) | moves)
    h.claim(~(h.register("ready") & waits & valid))
    first = Mux(right, column + owed - length, column)[:PIXEL_BITS]
    h.claim(~taken(found) | (length.any() & (length <= owed) & (found.payload.x == first)))
    h.claim(valid == owed.any())
    h.claim(~valid | ((left == owed) & (x == column) & pixels.any() & (pixels <= left)))
    h.claim(~valid | (h.register("right") == right))
    h.claim(~valid | (whole == (pixels == left)))
    # A piece that is inside is in a single state of its test.
    h.claim(valid == Cat(states).any())
    h.claim(Cat(states) & (Cat(states) - 1) == 0)
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
    names = "valid", "whole", "x", "left", "pixels", "y", "right", "flip", "material", "fits", "shift"
    held = Cat(*map(h.register, (*names, *ends)))
    before = Signal.like(held, name="before")
    h.m.d.sync += [waits.eq(found.valid & ~found.ready), before.eq(held)]
    h.claim(~waits | (held == before))
    return h


def test_a_piece_that_waits_stays(prove, refute, inject):
    """By induction. A piece that leaves without being taken is found."""
    prove(of_waiting())
    inject(SpanHalverUnit, "elaborate", "leaves.eq(fits & self.o.ready)", "leaves.eq(fits)")
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
