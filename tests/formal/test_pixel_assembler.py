"""Proofs of the pixel assembler: every colour gets its position, and every span gets all of its pixels."""

import pytest
from amaranth.hdl import Cat, Const, Signal, Value

from blysk.hdl.pixel_assembler import PixelAssemblerUnit

from .prover import Harness
from .rules import answers, follows, pixels_follow, stays, taken

pytestmark = pytest.mark.prove


def of_waiting_spans():
    """Coordinates and lengths have 2 bits: spans of 1 to 3 pixels, which also run past the largest column."""
    unit = PixelAssemblerUnit(2, 1, 2)
    h = Harness(unit)
    h.assume(unit.coordinates.payload.length != 0)

    def image(span, place, last, pixel):
        return (pixel.x == (span.x + place)[:2]) & (pixel.y == span.y) & (pixel.last == last)

    stays(h, unit.o)
    # Largest number of pixels inside: of three spans, and two further pixels.
    owed = pixels_follow(h, unit.coordinates, unit.o, unit.coordinates.payload.length, 4 * 3 + 2, image)
    # Spans whose last pixel has not left.
    spans = Signal(range(unit.SPANS_INSIDE + 2))
    finished = taken(unit.o) & unit.o.payload.last
    h.m.d.sync += spans.eq(spans + taken(unit.coordinates) - finished)
    h.claim(spans <= unit.SPANS_INSIDE)
    h.claim(spans.any() == owed.any())
    return h


def of_beats(lanes):
    """Spans of 1 to 15 pixels in beats of several lanes. Coordinates have 2 bits."""
    unit = PixelAssemblerUnit(2, 1, 4, lanes)
    h = Harness(unit)
    length, bits = unit.coordinates.payload.length, lanes.bit_length() - 1
    h.assume(length != 0)

    def image(span, place, last, beat):
        first = Cat(Const(0, bits), place)
        present = Cat(first + lane < span.length for lane in range(lanes))
        absent = Cat(~beat.present[lane] & Value.cast(beat.colors[lane]).any() for lane in range(lanes))
        at = (beat.x == (span.x + first)[:2]) & (beat.y == span.y) & (beat.last == last)
        return at & (beat.present == present) & ~absent.any()

    stays(h, unit.o)
    beats = (length + lanes - 1)[bits:]
    pixels_follow(h, unit.coordinates, unit.o, beats, 4 * (16 // lanes) + 2, image)
    return h


def of_progress():
    """Count the same spans while colours are offered and the output is ready."""
    unit = PixelAssemblerUnit(2, 1, 2)
    h = Harness(unit)
    h.assume(unit.coordinates.payload.length != 0)
    owed = pixels_follow(h, unit.coordinates, unit.o, unit.coordinates.payload.length, 4 * 3 + 2)
    flows = unit.o.ready & unit.colors.valid
    answers(h, owed.any(), taken(unit.o), unit.coordinates_latency - 1, flows)
    answers(h, unit.coordinates.valid, unit.coordinates.ready, 3 + 2, flows)
    return h


def of_colors():
    """Claim on colours of one bit a channel.

    The first of red, green and blue is free; the others follow from it.
    """
    unit = PixelAssemblerUnit(1, 1, 2)
    h = Harness(unit)
    color = unit.colors.payload
    h.assume(unit.coordinates.payload.length != 0)
    for channel in "rgb":
        h.assume(color[channel][2:] == 0)

    def image(came, leaves):
        return Cat(came[name] for name in "rgb") == Cat(leaves[name] for name in "rgb")

    # One pixel is in the register, and one waits.
    follows(h, unit.colors, unit.o, 2, image)
    return h


def test_waiting_spans(prove):
    """By induction: a span's pixels leave in order from x on, modulo 2^x_bits, with y; the last pixel is
    marked.

    At most `PixelAssemblerUnit.SPANS_INSIDE` spans are inside.
    """
    prove(of_waiting_spans())


@pytest.mark.parametrize("lanes", [2, 4])
def test_beats(prove, lanes):
    """By induction: beats of several lanes have their places, and a bit for each lane with a pixel."""
    prove(of_beats(lanes))


def test_progress(prove):
    """By induction: while colours are offered and the output is ready, pixels leave at most 3 cycles apart.

    A span's position is taken within 5 cycles: the pixels of a span, and two registers.
    """
    prove(of_progress())


def test_colors(prove):
    """By induction: each colour leaves once and in order, with a pixel; at most two colours are inside."""
    prove(of_colors())


BUGS = {
    "x stays": (of_waiting_spans, "m.Elif(moves)", "m.Elif(0)"),
    "x moves while it is stalled": (of_waiting_spans, "m.Elif(moves)", "m.Else()"),
    "a colour is taken without a place": (of_colors, "advance & position.valid", "advance"),
    "a place is taken without a colour": (of_waiting_spans, "advance & self.colors.valid", "advance"),
    "the next span comes early": (of_waiting_spans, "moves & ends", "moves"),
    "a pixel needs another span": (
        of_progress,
        "position.valid & self.colors.valid",
        "self.coordinates.valid & self.colors.valid",
    ),
    "a span that waits stops the one before it": (
        of_progress,
        "moves.eq(skid_buffer(m, position, active, Cat(x, y, ends, *further)))",
        "moves.eq(skid_buffer(m, position, active, Cat(x, y, ends, *further)) & ~self.coordinates.valid)",
    ),
    "a pixel is overwritten": (of_colors, "m.If(advance)", "m.If(1)"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in `PixelAssemblerUnit`, refutes a claim on positions, progress or colours."""
    claims, *change = BUGS[bug]
    inject(PixelAssemblerUnit, "elaborate", *change)
    refute(claims(), 20)
