# amaranth: UnusedElaboratable=no
"""Proofs about the serial vectors: no pixel of a span is lost or drawn twice, and no piece is lost."""

import pytest
from amaranth.hdl import Mux, Signal

from blysk.golden.geometry.triangles import PIXEL_BITS
from blysk.hdl.geometry.serial_vectors import SerialVectorsUnit

from .prover import Harness
from .rules import taken

pytestmark = pytest.mark.prove

PHASES = "loads", "settles", "repeats", "tests", "starts", "steps", "renews"


def of_pixels():
    """Claims on pixels.

    Until a piece's last turn, a model holds the pixels that are owed and the column of the first of them.
    """
    h = Harness(SerialVectorsUnit())
    given = h.unit.i
    h.assume(~given.valid | given.payload.length.any())
    owed, column = Signal(PIXEL_BITS, name="owed"), Signal(PIXEL_BITS, name="column")
    from_the_right = Signal(name="from_the_right")
    phases = loads, settles, repeats, tests, starts, steps, renews = [h.register(name) for name in PHASES]
    names = "place", "overlaps", "left", "pixels", "x", "whole", "right"
    place, overlaps, left, pixels, x, whole, right = (h.register(name) for name in names)
    result = h.unit.o.payload
    ends = steps & place.all() & (~overlaps | given.valid)
    with h.m.If(taken(given) & place.all()):
        h.m.d.sync += [
            owed.eq(given.payload.length),
            column.eq(given.payload.x),
            from_the_right.eq(given.payload.right),
        ]
    with h.m.Elif(ends):
        h.m.d.sync += [owed.eq(owed - pixels), column.eq(Mux(from_the_right, column, column + pixels))]
    # The piece that is due, from its first turn on.
    length, first = Signal(PIXEL_BITS, name="length"), Signal(PIXEL_BITS, name="first")
    with h.m.If(starts & ~place.any()):
        h.m.d.sync += [
            length.eq(pixels),
            first.eq(Mux(from_the_right, column + owed - pixels, column)),
        ]
    busy = settles | repeats | tests | starts | steps | renews
    h.claim(sum(phases) == 1)
    h.claim(~(settles & place.any()))
    h.claim(~overlaps | ~steps | whole | ~place.any())
    h.claim(~busy | ((left == owed) & (x == column) & pixels.any() & (pixels <= left)))
    h.claim(~busy | ((right == from_the_right) & (whole == (pixels == left))))
    h.claim(~((starts & place.any()) | steps) | ((pixels == length) & (result.length == length)))
    h.claim(~((starts & place.any()) | steps) | (result.x == first))
    # A span is taken when all pixels of the span before have left, or are leaving.
    h.claim(~(taken(given) & place.all()) | loads | (ends & (pixels == owed)))
    return h


@pytest.mark.seldom
def test_pixels_are_those_of_the_span(prove):
    """By induction: the pieces have the span's pixels, in order from the long edge and once each."""
    prove(of_pixels())


def of_pieces():
    """Claim that a piece, from its last component on, is not replaced until it is taken."""
    h = Harness(SerialVectorsUnit())
    starts, steps, place, overlaps = (h.register(name) for name in ("starts", "steps", "place", "overlaps"))
    owed = Signal(name="owed")
    goes = steps & (place == 2) & (~overlaps | h.unit.i.valid)
    with h.m.If(goes):
        h.m.d.sync += owed.eq(1)
    with h.m.Elif(taken(h.unit.o)):
        h.m.d.sync += owed.eq(0)
    h.claim(~h.unit.o.valid | owed)
    h.claim(~(goes | (starts & place.any())) | ~owed)
    h.claim(owed == h.register("leaving"))
    return h


def test_each_piece_leaves_before_the_next(prove):
    """By induction."""
    prove(of_pieces())


@pytest.mark.parametrize(
    ("function", "text", "bug"),
    [
        ("_pixels", "whole.eq(0)", "whole.eq(1)"),
        ("_pixels", "pixels.eq(shorter(pixels))", "pixels.eq(pixels)"),
        ("elaborate", "steps & ends, (whole", "0, (whole"),
    ],
)
def test_bugs_are_found(refute, inject, function, text, bug):
    """Three bugs are found: the rest of a span is forgotten, a piece is longer than the span, a piece comes
    again."""
    inject(SerialVectorsUnit, function, text, bug)
    refute(of_pixels())
