# amaranth: UnusedElaboratable=no
"""Proofs of the adaptive normaliser: segments have the pixels of their span, and each pixel leaves once.

The unit has three parts. Between the second and the third part is a queue of segments,
`amaranth.lib.fifo.SyncFIFOBuffered`. A stub replaces the queue: it takes and gives any segments in any
cycles. So a claim on one side of the queue holds whatever the other side does. The first part counts the
levels of a span while the second part divides the span before.

The bisection is a stub of 3 cycles with free results. Products are free, too, and so is the number of levels.
Lengths have 3 bits. A segment is prepared in 6 cycles in place of 14; the other cycles are for its start and
step.
"""

from types import SimpleNamespace

import pytest
from amaranth.hdl import Elaboratable, Module, Mux, Signal
from amaranth.lib import data
from amaranth.lib.fifo import FIFOInterface

import blysk.hdl.normals.adaptive_normaliser
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.hdl.normals.bisection import BisectionUnit

from .prover import Harness
from .rules import answers, pixels_follow, stays, taken
from .stubs import short

pytestmark = [pytest.mark.prove, pytest.mark.seldom]

LENGTH_BITS = 3
PROGRESS_CLOCKS = 25
THRESHOLDS = {1: 1 / 8, 2: 1 / 16}
"""Thresholds by the largest number of levels that they allow."""

SEGMENT = data.StructLayout({"count": LENGTH_BITS, "last": 1, "out_of_range": 1})
"""Upper bits of a word of the queue."""


class Queue(Elaboratable, FIFOInterface):
    """A queue with free behaviour: it takes and gives any segments in any cycles."""

    def elaborate(self, platform):
        return Module()


@pytest.fixture
def harness(monkeypatch):
    """Make a harness of the unit and its queue, for a threshold."""
    queues = []

    def queue(width, depth):
        queues.append(Queue(width=width, depth=depth))
        return queues[-1]

    monkeypatch.setattr(AdaptiveNormaliser, "LENGTH_BITS", LENGTH_BITS)
    unit = blysk.hdl.normals.adaptive_normaliser
    monkeypatch.setattr(unit, "SyncFIFOBuffered", queue)
    monkeypatch.setattr(unit, "SEGMENT_CYCLES", 6)
    monkeypatch.setattr(unit, "BisectionUnit", short(BisectionUnit, lambda *_: [], 3, 2))

    def make(threshold):
        h = Harness(AdaptiveNormaliserUnit(AdaptiveNormaliser(threshold)))
        (made,) = queues
        for port in (made.w_rdy, made.r_data, made.r_rdy):
            h.m.d.comb += port.eq(h.free(len(port), port.name))
        return h, made

    return make


def segment_of(port):
    return data.View(SEGMENT, port[-SEGMENT.as_shape().width :])


def pixels_left(h, queue):
    """Whether a segment is given; the pixels left of its span; the length of the following span."""
    left, following = (Signal(LENGTH_BITS, name=name) for name in ("left", "following"))
    gives, came = queue.w_en & queue.w_rdy, Signal(LENGTH_BITS)
    h.m.d.comb += came.eq(Mux(taken(h.unit.i), h.unit.i.payload.length, 0))
    rest = (left - segment_of(queue.w_data).count)[:LENGTH_BITS]
    with h.m.If(gives & (rest != 0)):
        h.m.d.sync += left.eq(rest)
    with h.m.Elif(gives | ~left.any()):
        h.m.d.sync += [left.eq(Mux(following.any(), following, came)), following.eq(0)]
    with h.m.If(came.any() & left.any() & ~(gives & (rest == 0) & ~following.any())):
        h.m.d.sync += following.eq(came)
    return gives, left, following


def of_segments(h, queue):
    """Claim that a span's segments have its pixels, and at least one pixel each.

    The last segment is marked, and at most two spans are inside.
    """
    segment, (gives, left, following) = segment_of(queue.w_data), pixels_left(h, queue)
    h.claim(~queue.w_en | (segment.count.any() & (segment.count <= left)))
    h.claim(~queue.w_en | (segment.last == (segment.count == left)))
    h.claim(~(taken(h.unit.i) & following.any()))
    # The queue has room for all segments of a span.
    count = Signal(range(queue.depth + 2))
    h.m.d.sync += count.eq(Mux(gives & segment.last, 0, count + gives))
    h.claim(count <= queue.depth)
    return h


def of_progress(h, queue):
    """Claim that segments come in time, and that a span is taken when no segments are left."""
    gives, left, following = pixels_left(h, queue)
    answers(h, left.any(), gives, PROGRESS_CLOCKS, queue.w_rdy)
    answers(h, h.unit.i.valid & ~left.any() & ~following.any(), h.unit.i.ready, 1, 1)
    return h


def of_pixels(h, queue):
    """Claim that a segment of n pixels gives n pixels in order, and that a span's last pixel is marked."""
    before, stood = Signal.like(queue.r_data), Signal()
    h.m.d.sync += [before.eq(queue.r_data), stood.eq(queue.r_rdy & ~queue.r_en)]
    h.assume(~stood | (queue.r_rdy & (queue.r_data == before)))
    segment = segment_of(queue.r_data)
    h.assume(~queue.r_rdy | segment.count.any())
    source = SimpleNamespace(valid=queue.r_rdy, ready=queue.r_en, payload=segment)

    def image(came, place, last, pixel):
        return (pixel.last == (last & came.last)) & (pixel.out_of_range == came.out_of_range)

    stays(h, h.unit.o)
    owed = pixels_follow(h, source, h.unit.o, segment.count, 2 * ((1 << LENGTH_BITS) - 1) + 2, image)
    answers(h, owed.any(), taken(h.unit.o), 1, h.unit.o.ready)
    # Number of spans with all of their segments in the queue.
    inside, spans = Signal(), Signal(range(queue.depth + 2))
    completes = queue.w_en & queue.w_rdy & segment_of(queue.w_data).last
    h.m.d.sync += spans.eq(spans + completes - (taken(source) & ~inside))
    with h.m.If(taken(source)):
        h.m.d.sync += inside.eq(~segment.last)
    h.assume(spans <= queue.depth)
    h.claim(~taken(source) | inside | spans.any())
    due = queue.r_rdy & (inside | spans.any())
    answers(h, due, queue.r_en, (1 << LENGTH_BITS) - 1, h.unit.o.ready)
    return h


@pytest.mark.parametrize("levels", THRESHOLDS)
def test_segments(prove, harness, levels):
    """By induction, up to a number of levels: the claims on segments."""
    prove(of_segments(*harness(THRESHOLDS[levels])))


def test_progress(prove, harness):
    """By induction, up to one level: if the queue takes segments, they come at most 25 cycles apart."""
    prove(of_progress(*harness(THRESHOLDS[1])))


def test_pixels(prove, harness):
    """By induction: pixels come in order, one in each cycle, and a segment follows the segment before.

    A segment follows as soon as all segments of its span have come. Segments pass the queue in order, so a
    span's pixels leave in order.
    """
    prove(of_pixels(*harness(THRESHOLDS[1])))


BUGS = {
    "a segment is not taken off": (of_segments, "_end_segment", "s.remaining - s.count", "s.remaining"),
    "the last is not marked": (of_segments, "_prepare_segment", ">= s.remaining)", "> s.remaining)"),
    "a segment that finds no room is lost": (of_segments, "_end_segment", "m.If(fifo.w_rdy)", "m.If(1)"),
    "segments are not given": (of_progress, "_end_segment", "fifo.w_en.eq(1)", "fifo.w_en.eq(0)"),
    "a pixel that waits is lost": (of_pixels, "_back", "skid_buffer(m, self.o, valid, pixel)", "1"),
    "segments are taken while pixels wait": (of_pixels, "_back", "r_en.eq(load)", "r_en.eq(ends & may_take)"),
    "the last of every segment is marked": (of_pixels, "_back", "active & ends & ~inside", "active & ends"),
    "a span begins before it is complete": (of_pixels, "_back", "(inside | (ready_spans != 0))", "1"),
    "a span is begun with every segment": (of_pixels, "_back", "begun.eq(load & ~inside)", "begun.eq(load)"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, harness, bug):
    """Each bug, injected in the unit, refutes a claim."""
    claims, *change = BUGS[bug]
    inject(AdaptiveNormaliserUnit, *change)
    refute(claims(*harness(THRESHOLDS[1])))
